"""The folders of a project that test no driver for failures: preventability maps, comparisons."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated, Any

from pydantic import BaseModel, ConfigDict, Field

from bridgegen.base.errors import FileFormatError, StorageError
from bridgegen.base.records import parse_json, read_bytes, read_model
from bridgegen.jobs.compare.plan import FILE as COMPARISON_FILE
from bridgegen.jobs.compare.result import PAGE as COMPARISON_PAGE
from bridgegen.jobs.preventability.chunks import SETTINGS as MAP_FILE
from bridgegen.jobs.preventability.result import PAGE as MAP_PAGE
from bridgegen.jobs.preventability.result import SUMMARY
from bridgegen.jobs.view.overview import find_folders, is_run

Count = Annotated[int, Field(ge=0, le=10**12)]
Text = Annotated[str, Field(max_length=4096)]


class MapFigures(BaseModel):
    """A driver's numbers of cells, as ``summary.json`` states them."""

    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    driver: Text
    avoided: Count
    preventable: Count
    unpreventable: Count
    not_applicable: Count
    no_result: Count

    @property
    def judged(self) -> int:
        """The number of cells that apply and have a result."""
        return self.avoided + self.preventable + self.unpreventable


class _Summary(BaseModel):
    model_config = ConfigDict(frozen=True, extra="ignore", allow_inf_nan=False)

    scenario: Text
    cells: Count
    drivers: Annotated[tuple[MapFigures, ...], Field(max_length=1000)]


@dataclass(frozen=True)
class MapLine:
    """A preventability map in a line.

    Attributes:
        source: folder, as seen from the project's.
        page: of the map, or "".
        scenario: its name; "" of a map that is not finished.
        cells: number of them.
        drivers: the figures of each.
    """

    source: str
    page: str
    scenario: str = ""
    cells: int = 0
    drivers: tuple[MapFigures, ...] = ()


@dataclass(frozen=True)
class ComparisonLine:
    """A comparison of algorithms in a line.

    Attributes:
        source: folder, as seen from the project's.
        page: of the comparison, or "".
        scenarios: their names.
        algorithms: their names.
        runs: number of its runs.
    """

    source: str
    page: str
    scenarios: tuple[str, ...]
    algorithms: tuple[str, ...]
    runs: int


def read_map(project: Path, folder: Path) -> MapLine:
    """Return a map.

    Raises:
        FileFormatError: its figures are damaged.
        StorageError: they cannot be read.
    """
    source = folder.relative_to(project).as_posix()
    summary = read_model(folder / SUMMARY, _Summary, _no_map)
    page = f"{source}/{MAP_PAGE}" if (folder / MAP_PAGE).is_file() else ""
    if summary is None:
        _object(folder / MAP_FILE)
        return MapLine(source, page)
    return MapLine(source, page, summary.scenario, summary.cells, summary.drivers)


def read_comparison(project: Path, folder: Path) -> ComparisonLine:
    """Return a comparison.

    Raises:
        FileFormatError: its record is damaged.
        StorageError: it cannot be read.
    """
    source, record = folder.relative_to(project).as_posix(), _object(folder / COMPARISON_FILE)
    page = f"{source}/{COMPARISON_PAGE}" if (folder / COMPARISON_PAGE).is_file() else ""
    return ComparisonLine(
        source,
        page,
        _behind("scenario ", record),
        _behind("settings of ", record),
        len(find_folders(folder, is_run)),
    )


def _behind(prefix: str, record: dict[str, Any]) -> tuple[str, ...]:
    return tuple(key.removeprefix(prefix) for key in record if key.startswith(prefix))


def _object(path: Path) -> dict[str, Any]:
    try:
        value = parse_json(read_bytes(path))
    except OSError as error:
        raise StorageError(f"{path}: cannot be read: {error.strerror}") from None
    except ValueError as error:
        raise FileFormatError(f"{path}: is damaged: {error}") from None
    if not isinstance(value, dict):
        raise FileFormatError(f"{path}: is damaged: it must hold an object")
    return value


def _no_map(path: Path, why: str) -> FileFormatError:
    return FileFormatError(f"{path}: is damaged: {why}")
