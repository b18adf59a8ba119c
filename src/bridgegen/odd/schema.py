"""The shape of a scenario file: which keys there are and what type each takes.

Rules about values are kept by the types that the file becomes (``parameters``, ``scenario``).
"""

import re
from typing import Annotated, Any, Literal, TypeVar, get_args

from pydantic import BaseModel, ConfigDict, Field, PlainValidator, ValidationError
from pydantic_core import ErrorDetails, PydanticCustomError

from bridgegen.odd.parameters import nearest
from bridgegen.odd.plain_yaml import Document, Path


def _number_or(what: str, pattern: str) -> PlainValidator:
    def read(value: object) -> float | str:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if isinstance(value, str) and re.fullmatch(pattern, value, re.DOTALL):
            return value
        raise PydanticCustomError("number_or", f"must be a number or {what}")

    return PlainValidator(read)


# Strict, so that "3" is no number and true no 1; an integer is a number, as everywhere.
_Number = Annotated[float, Field(strict=True)]
_Text = Annotated[str, Field(strict=True, min_length=1, max_length=20_000)]
_Word = Annotated[str, Field(strict=True, pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,63}$")]
_Quantity = Annotated[
    float | str, _number_or("the name of a parameter", "[A-Za-z][A-Za-z0-9_]{0,63}")
]
_Formula = Annotated[float | str, _number_or("a formula", ".+")]
_AxisName = Literal["static", "temporary", "participants", "weather", "extension"]


class _Section(BaseModel):
    model_config = ConfigDict(extra="forbid", strict=True, frozen=True)


class ParameterSection(_Section):
    """One entry of ``parameters``."""

    axis: _AxisName
    unit: _Text
    low: _Number
    high: _Number
    default: _Number
    kind: Literal["float", "integer"] = "float"
    description: _Text
    source: _Text


class BoundSection(_Section):
    """One entry of ``bounds``."""

    target: _Text
    lo: _Formula | None = None
    hi: _Formula | None = None
    why: _Text
    source: _Text


class DerivedSection(_Section):
    """One entry of ``derived``."""

    axis: _AxisName
    unit: _Text
    value: _Formula
    why: _Text
    source: _Text
    description: _Text


class FragmentFile(_Section):
    """A file that scenarios include: parameters and their constraints."""

    fragment: _Word
    description: _Text
    parameters: dict[str, ParameterSection] = {}
    bounds: list[BoundSection] = []
    derived: dict[str, DerivedSection] = {}


class WaypointSection(_Section):
    """Start or end of a route."""

    point: Literal["P1", "P2", "P3", "P4", "P5", "P6", "P7", "P8"]
    distance: _Quantity


class ParticipantSection(_Section):
    """One entry of ``participants``."""

    type: Literal["car"]
    start: WaypointSection
    end: WaypointSection
    speed: _Quantity


class ConditionSection(_Section):
    """One alternative of an event's ``when``."""

    kind: Literal["time", "distance"]
    value: _Quantity
    to: _Word | None = None


class EventSection(_Section):
    """One entry of ``events``."""

    participant: _Word
    speed: _Quantity
    rate: _Quantity
    when: Annotated[list[ConditionSection], Field(min_length=1)]


class TermSection(_Section):
    """One metric of the objective."""

    metric: _Word
    weight: _Number | None = None


class CriticalSection(_Section):
    """What makes a scenario critical."""

    n_collision_above: _Number = 0.0
    d_min_below: _Number = 2.0
    v_d_at_least: _Number = 1.0


class ObjectiveSection(_Section):
    """What is optimised."""

    terms: Annotated[list[TermSection], Field(min_length=1)]
    weights: Literal["fixed", "entropy"]
    scale: Literal["raw", "standardised"]
    critical: CriticalSection = CriticalSection()


class ScenarioFile(_Section):
    """A logical scenario."""

    scenario: _Word
    title: _Text
    description: _Text
    source: _Text
    template: Literal["crossroads"]
    duration: _Number
    time_step: _Number
    axes: Annotated[list[_AxisName], Field(min_length=1)]
    include: list[_Text] = []
    participants: dict[str, ParticipantSection]
    events: dict[str, EventSection] = {}
    parameters: dict[str, ParameterSection] = {}
    bounds: list[BoundSection] = []
    derived: dict[str, DerivedSection] = {}
    objective: ObjectiveSection


Section = TypeVar("Section", bound=_Section)

_MESSAGES = {
    "dict_type": "must be a mapping",
    "float_type": "must be a number",
    "list_type": "must be a list",
    "model_type": "must be a mapping",
    "string_pattern_mismatch": "must be a word of letters, digits, '_' and '-'",
    "string_too_short": "must not be empty",
    "string_type": "must be a text",
    "too_short": "must not be empty",
}


def section(model: type[Section], data: object) -> Section | None:
    """Return data as a section of a file, or ``None`` if it is not of that shape."""
    try:
        return model.model_validate(data)
    except ValidationError:
        return None


def shape_problems(model: type[_Section], document: Document) -> list[str]:
    """Return every way in which a file is not of the shape of ``model``, with its line."""
    try:
        model.model_validate(document.data)
    except ValidationError as error:
        return [_describe(model, document, one) for one in error.errors(include_url=False)]
    return []


def _describe(model: type[_Section], document: Document, error: ErrorDetails) -> str:
    path: Path = error["loc"]
    where = document.at(path)
    *parents, last = path or ("the file",)
    inside = ".".join(str(part) for part in parents)
    name = ".".join(str(part) for part in path) or "the file"
    if error["type"] == "missing":
        return f"{inside or 'the file'} must have the key '{last}' ({where})"
    if error["type"] == "extra_forbidden":
        keys = list(_model_at(model, tuple(parents)).model_fields)
        hint = nearest(str(last), keys) or f"; known: {', '.join(keys)}"
        return f"unknown key '{last}'{f' in {inside}' if inside else ''}{hint} ({where})"
    got = repr(error["input"])
    got = got if len(got) <= 60 else got[:57] + "..."
    if error["type"] == "literal_error":
        choices = error["ctx"]["expected"]
        hint = nearest(str(error["input"]), re.findall("'([^']*)'", choices))
        return f"{name} must be {choices}, got {got}{hint} ({where})"
    return f"{name} {_MESSAGES.get(error['type'], error['msg'])}, got {got} ({where})"


def _model_at(model: type[BaseModel], path: Path) -> type[BaseModel]:
    """Return the model of the section at ``path``: for the keys it may have."""
    kind: Any = model
    for part in path:
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            kind = kind.model_fields[str(part)].annotation
        else:  # list[Section] or dict[str, Section]
            kind = get_args(kind)[-1]
    assert isinstance(kind, type)
    assert issubclass(kind, BaseModel)
    return kind
