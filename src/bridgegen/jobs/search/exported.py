"""The exported scenarios of a run on disk: their names, their evaluations, what their JSON says."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar

from pydantic import BaseModel, ConfigDict, Field, TypeAdapter, ValidationError, model_validator

from bridgegen.base.errors import StorageError
from bridgegen.base.records import parse_json, read_bytes

_Read = TypeVar("_Read", bound=BaseModel)

FOLDER = "critical"
MINIMAL = "minimal-"
"""Prefix of the files of minimal scenarios, in the same folder."""

NOT_EXPORTED = "not-exported.json"
"""The file of a run's folder that names the scenarios whose export was refused; none without."""


@dataclass(frozen=True)
class Exported:
    """An exported scenario.

    Attributes:
        name: of its files, "0001" the most critical.
        evaluation: its row in the store.
        files: their paths relative to the run's folder.
    """

    name: str
    evaluation: int
    files: tuple[str, ...]


@dataclass(frozen=True)
class Refused:
    """A scenario that could not be exported.

    Attributes:
        name: that its files would have.
        evaluation: its row in the store.
        problems: why not.
    """

    name: str
    evaluation: Annotated[int, Field(ge=0)]
    problems: tuple[str, ...]


_REFUSED = TypeAdapter(list[Refused])


class Quantity(BaseModel):
    """A value in a scenario's ``.json``: None is infinite or NaN."""

    model_config = ConfigDict(allow_inf_nan=False)

    value: float | None
    unit: str


class ParameterValue(BaseModel):
    """A parameter's value in a scenario's ``.json``: a number, or the name of a category's."""

    model_config = ConfigDict(allow_inf_nan=False)

    value: float | Annotated[str, Field(max_length=1000)] | None
    unit: str


class _Origin(BaseModel):
    """The evaluation that a scenario's ``.json`` is of.

    Attributes:
        row: in the store, counted from 0.
        evaluation: counted from 1, as in the report; files of earlier versions, which state no
            row, count it from 0.
    """

    row: Annotated[int, Field(ge=0)]
    evaluation: Annotated[int, Field(ge=1)]

    @model_validator(mode="before")
    @classmethod
    def _of_earlier_version(cls, data: Any) -> Any:
        first = data.get("evaluation") if isinstance(data, dict) and "row" not in data else None
        if isinstance(first, int) and not isinstance(first, bool):
            return {**data, "row": first, "evaluation": first + 1}
        return data

    @model_validator(mode="after")
    def _counts_alike(self) -> Self:
        if self.evaluation != self.row + 1:
            raise ValueError(f"evaluation must be row + 1, got {self.evaluation}, row {self.row}")
        return self


class _Values(BaseModel):
    parameters: dict[str, ParameterValue]


class Facts(_Origin, _Values):
    """What a scenario's ``.json`` says, as far as a verdict needs it."""

    metrics: dict[str, Quantity]
    cause: str | None
    quick_cause: str | None = None
    mode: int | None = None
    robustness: Annotated[float, Field(ge=0.0, le=1.0)] | None = None


def read_facts(path: Path) -> Facts:
    """Return what the ``.json`` of a scenario says.

    Raises:
        StorageError: it is not what was written.
    """
    return _read(path, Facts)


def read_parameters(path: Path) -> dict[str, ParameterValue]:
    """Return the parameters that the ``.json`` of a scenario, a minimal one too, states.

    Raises:
        StorageError: it is not what was written.
    """
    return _read(path, _Values).parameters


def not_exported(folder: Path) -> tuple[Refused, ...]:
    """Return the critical scenarios of a run that could not be exported, most critical first.

    Args:
        folder: the run's.

    Raises:
        StorageError: the file that names them is not what was written.
    """
    path = folder / NOT_EXPORTED
    try:
        data = read_bytes(path)
        # Only for what it refuses and pydantic takes: infinite numbers, lone surrogates.
        parse_json(data)
        return tuple(_REFUSED.validate_json(data, strict=True))
    except FileNotFoundError:
        return ()
    except (OSError, ValueError) as error:
        raise StorageError(
            f"{path}: is not what was written: {_why(error)}; 'bridgegen resume {folder}' writes "
            "it again"
        ) from None


def exported_scenarios(folder: Path, evaluations: int | None = None) -> tuple[Exported, ...]:
    """Return the exported scenarios of a run, most critical first; none before it has finished.

    Args:
        folder: the run's.
        evaluations: how many the run has, if known; no exported scenario may be of another one.

    Raises:
        StorageError: a scenario's ``.json`` is not what was written.
    """
    kept = []
    for path in sorted((folder / FOLDER).glob("[0-9]*.json")):
        row = _read(path, _Origin).row
        if evaluations is not None and row >= evaluations:
            raise _not_written(path, f"the run has no evaluation {row + 1}")
        files = (
            path.with_suffix(f".{kind}") for kind in ("owl", "xodr", "xosc", "cod.yaml", "json")
        )
        names = tuple(f"{FOLDER}/{file.name}" for file in files if file.is_file())
        kept.append(Exported(path.stem, row, names))
    return tuple(kept)


def _read(path: Path, model: type[_Read]) -> _Read:
    try:
        data = read_bytes(path)
        parse_json(data)
        return model.model_validate_json(data, strict=True)
    except (OSError, ValueError) as error:
        raise _not_written(path, _why(error)) from None


def _not_written(path: Path, why: str) -> StorageError:
    run = path.parent.parent
    return StorageError(
        f"{path}: is not what was exported: {why}; 'bridgegen resume {run}' writes the files again"
    )


def _why(error: OSError | ValueError) -> str:
    """Return what is wrong with a record, in one line."""
    if isinstance(error, ValidationError):
        first = error.errors(include_input=False, include_url=False)[0]
        return f"{'.'.join(map(str, first['loc']))}: {first['msg']}"
    return str(error)
