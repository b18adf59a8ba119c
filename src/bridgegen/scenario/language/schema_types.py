"""Does a part of a file have its shape? The types of keys, and in words what does not fit."""

import re
from types import UnionType
from typing import Annotated, Any, Literal, TypeVar, Union, get_args, get_origin

from pydantic import (
    BaseModel,
    BeforeValidator,
    ConfigDict,
    Field,
    GetCoreSchemaHandler,
    GetJsonSchemaHandler,
    PlainValidator,
    StringConstraints,
    ValidationError,
    WithJsonSchema,
)
from pydantic_core import CoreSchema, ErrorDetails, PydanticCustomError, core_schema

from bridgegen.base.units import PATTERN, has_unit, in_unit
from bridgegen.scenario.language.parameters import nearest
from bridgegen.scenario.language.plain_yaml import Document, Path
from bridgegen.scenario.language.story import STRIPS

_PARAMETER = "[A-Za-z][A-Za-z0-9_]{0,63}"

ID = r"[A-Za-z0-9][A-Za-z0-9_.-]{0,63}"
"""The pattern of the id of a requirement, and of a tag."""


def _with_unit(text: str, unit: str) -> float:
    try:
        return in_unit(text, unit)
    except ValueError as error:
        raise PydanticCustomError("unit", str(error)) from None


def convert(value: object, unit: object) -> object:
    """Return a value of a file, a number with a unit as one in that unit; others as they are.

    Raises:
        PydanticCustomError: it is in a unit of another dimension.
    """
    if isinstance(value, str) and isinstance(unit, str) and has_unit(value):
        return _with_unit(value, unit)
    return value


def _number_or(what: str, pattern: str, unit: str = "") -> PlainValidator:
    def read(value: object) -> float | str:
        if isinstance(value, int | float) and not isinstance(value, bool):
            return float(value)
        if unit and isinstance(value, str) and has_unit(value):
            return _with_unit(value, unit)
        if isinstance(value, str) and re.fullmatch(pattern, value, re.DOTALL):
            return value
        raise PydanticCustomError("number_or", f"must be a number or {what}")

    return PlainValidator(read)


def _number_in(unit: str) -> BeforeValidator:
    return BeforeValidator(lambda value: convert(value, unit))


def _quantity_in(unit: str) -> PlainValidator:
    return _number_or("the name of a parameter", _PARAMETER, unit)


def _lane() -> PlainValidator:
    def read(value: object) -> int | str:
        if isinstance(value, int | float) and not isinstance(value, bool) and 1 <= value <= 9:
            if value == int(value):
                return int(value)
        elif isinstance(value, str) and value in STRIPS:
            return value
        raise PydanticCustomError(
            "lane", f"must be a lane's number from the inside, 1 to 9, or {' or '.join(STRIPS)}"
        )

    return PlainValidator(read)


# Strict, so that "3" is no number and true no 1; an integer is a number, as everywhere.
Number = Annotated[float, Field(strict=True)]
Text = Annotated[
    str,
    StringConstraints(strict=True, strip_whitespace=True, min_length=1, max_length=20_000),
    WithJsonSchema({"type": "string", "pattern": r"\S"}),
]
Word = Annotated[str, Field(strict=True, pattern=r"^[A-Za-z][A-Za-z0-9_-]{0,63}$")]
QuantityName = Annotated[
    str,
    Field(
        strict=True,
        pattern=r"^([A-Za-z][A-Za-z0-9_-]{0,63}|criterion:[A-Za-z0-9][A-Za-z0-9_.-]{0,63})$",
    ),
]
_SCHEMA_WITH_UNIT = {"type": "string", "pattern": PATTERN}
_MEASURED = WithJsonSchema({"anyOf": [{"type": "number"}, _SCHEMA_WITH_UNIT]})
_QUANTITY = WithJsonSchema(
    {
        "anyOf": [
            {"type": "number"},
            {"type": "string", "pattern": f"^{_PARAMETER}$"},
            _SCHEMA_WITH_UNIT,
        ]
    }
)

# Numbers, which may be written with a unit of that dimension.
Metres = Annotated[Number, _number_in("m"), _MEASURED]
Seconds = Annotated[Number, _number_in("s"), _MEASURED]
MetresPerSecond = Annotated[Number, _number_in("m/s"), _MEASURED]
Degrees = Annotated[Number, _number_in("deg"), _MEASURED]
Measured = Annotated[Number, _MEASURED]
"""Number in the unit that another key states; a validator converts it."""

# The same, or the name of a parameter in that unit.
QuantityField = Annotated[float | str, _quantity_in(""), _QUANTITY]
Length = Annotated[float | str, _quantity_in("m"), _QUANTITY]
Duration = Annotated[float | str, _quantity_in("s"), _QUANTITY]
Speed = Annotated[float | str, _quantity_in("m/s"), _QUANTITY]
Acceleration = Annotated[float | str, _quantity_in("m/s²"), _QUANTITY]
Angle = Annotated[float | str, _quantity_in("deg"), _QUANTITY]
Curvature = Annotated[float | str, _quantity_in("1/m"), _QUANTITY]
Ratio = Annotated[float | str, _quantity_in("1"), _QUANTITY]
Percent = Annotated[float | str, _quantity_in("%"), _QUANTITY]
LaneField = Annotated[
    int | str,
    _lane(),
    WithJsonSchema(
        {"anyOf": [{"type": "integer", "minimum": 1, "maximum": 9}, {"enum": list(STRIPS)}]}
    ),
]
Formula = Annotated[
    float | str,
    _number_or("a formula", ".+"),
    WithJsonSchema({"anyOf": [{"type": "number"}, {"type": "string", "minLength": 1}]}),
]
NumberOrName = Annotated[
    float | str,
    _number_or("the name of a category's value", rf"{_PARAMETER}|{PATTERN[1:-1]}"),
    _QUANTITY,
]
KindName = Literal["float", "integer", "category", "angle"]
AxisName = Literal["static", "temporary", "participants", "weather", "extension"]


class ShapedSection(BaseModel):
    """A mapping of a file with the keys that it may have, and no others."""

    model_config = ConfigDict(
        extra="forbid", strict=True, frozen=True, use_attribute_docstrings=True
    )


Section = TypeVar("Section", bound=ShapedSection)


class OrWord:
    """A section of a file in whose place a word may stand: ``Annotated[S | Literal[word], …]``.

    Unlike a plain union, it reports which parts of an invalid section are wrong.
    """

    def __init__(self, model: type[ShapedSection], *words: str) -> None:
        self._model, self._words = model, words

    def __get_pydantic_core_schema__(
        self, source: Any, handler: GetCoreSchemaHandler
    ) -> CoreSchema:
        def read(value: Any, section: core_schema.ValidatorFunctionWrapHandler) -> Any:
            return value if isinstance(value, str) and value in self._words else section(value)

        return core_schema.no_info_wrap_validator_function(
            read, handler.generate_schema(self._model)
        )

    def __get_pydantic_json_schema__(
        self, schema: CoreSchema, handler: GetJsonSchemaHandler
    ) -> dict[str, Any]:
        return {"anyOf": [*({"const": word} for word in self._words), handler(schema)]}


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


_WORDS = {
    f"^{ID}$": "must be a word of letters, digits, '.', '_' and '-', at most 64 characters, the "
    "first a letter or digit",
}
"""Rules for a text in words, by its regular expression."""


def section(model: type[Section], data: object) -> Section | None:
    """Return data as a section of a file, or ``None`` if it is not of that shape."""
    try:
        return model.model_validate(data)
    except ValidationError:
        return None


def shape_problems(model: type[ShapedSection], document: Document) -> list[str]:
    """Return every way in which a file is not of the shape of ``model``, with its line."""
    try:
        model.model_validate(document.data)
    except ValidationError as error:
        return [_describe(model, document, item) for item in error.errors(include_url=False)]
    return []


def _describe(model: type[ShapedSection], document: Document, error: ErrorDetails) -> str:
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
    if last == "[key]" and parents:
        name = f"the key '{parents[-1]}'" + (
            f" of {inside.rpartition('.')[0]}" if parents[:-1] else ""
        )
    must = _MESSAGES.get(error["type"], error["msg"])
    if error["type"] == "string_pattern_mismatch":
        must = _WORDS.get(error["ctx"]["pattern"], must)
    return f"{name} {must}, got {got} ({where})"


def _model_at(model: type[BaseModel], path: Path) -> type[BaseModel]:
    """Return the model of the section at ``path``: for the keys it may have."""
    kind: Any = model
    for part in path:
        if isinstance(kind, type) and issubclass(kind, BaseModel):
            kind = kind.model_fields[str(part)].annotation
            if isinstance(kind, UnionType) or get_origin(kind) is Union:  # Section | None
                kind = get_args(kind)[0]
        else:  # list[Section] or dict[str, Section]
            kind = get_args(kind)[-1]
    assert isinstance(kind, type)
    assert issubclass(kind, BaseModel)
    return kind
