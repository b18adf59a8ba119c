"""Attribute values of OpenSCENARIO: literals, ``$name`` references and ``${…}`` expressions.

Each data type of the standard is a type alias that carries its ``Kind``; the model's fields are
annotated with these aliases, and reading, writing and checking follow the kind. An enumeration is
a ``StrEnum`` and needs no kind.

Source: ASAM OpenSCENARIO XML 1.2, sections 9.1 (parameters) and 9.2 (expressions), and its XSD.
"""

import ast
import math
import re
from collections.abc import Mapping
from dataclasses import dataclass
from datetime import date
from decimal import Decimal
from enum import Enum
from functools import lru_cache
from typing import Annotated, TypeVar

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.scenario.language.expression import RESERVED, Expression, parse

V = TypeVar("V")

_REFERENCE = re.compile(r"\$[A-Za-z_][A-Za-z0-9_]*")
# An alphabet, before any parser sees the text: no quotation marks, brackets or comparisons, which
# the standard's expressions do not have either.
_EXPRESSION = re.compile(r"\$\{[ A-Za-z0-9_+\-*/%$().,]*\}")
_WORD = re.compile(r"\$?[A-Za-z_][A-Za-z0-9_]*|(?:\d+\.?\d*|\.\d+)(?:[eE][+-]?\d+)?")
_TRUTHS = {
    "true": "(0<1)",
    "false": "(1<0)",
}  # as `bridgegen.scenario.language.expression` has no such words
_TRUTH = re.compile(r"(?<![$A-Za-z0-9_])(true|false)(?![A-Za-z0-9_])")
_WORDS = RESERVED | {"not", "and", "or", *_TRUTHS}  # of an expression besides parameters


MAX_LENGTH, MAX_DEPTH = 20_000, 100
"""Largest number of characters and largest nesting depth of an expression, with what its parameters
stand for."""


class Kind(Enum):
    """A data type of the standard's attributes, named as a parameter's type is."""

    BOOLEAN = "boolean"
    DATE_TIME = "dateTime"
    DOUBLE = "double"
    INT = "int"
    STRING = "string"
    UNSIGNED_INT = "unsignedInt"
    UNSIGNED_SHORT = "unsignedShort"

    @property
    def is_number(self) -> bool:
        """Whether it takes part in arithmetic."""
        return self in _NUMBERS

    @property
    def whole(self) -> tuple[int, int] | None:
        """The least and the greatest of the whole numbers that it has; None if it has others."""
        return _RANGES.get(self)

    @property
    def is_integer(self) -> bool:
        """Whether it is a whole number."""
        return self in _RANGES


_RANGES = {
    Kind.INT: (-(2**31), 2**31 - 1),
    Kind.UNSIGNED_INT: (0, 2**32 - 1),
    Kind.UNSIGNED_SHORT: (0, 2**16 - 1),
}
_NUMBERS = frozenset({Kind.DOUBLE, *_RANGES})
_PATTERNS = {
    Kind.BOOLEAN: re.compile("true|false|0|1"),
    Kind.DATE_TIME: re.compile(
        r"-?\d{4,}-(0[1-9]|1[0-2])-(0[1-9]|[12]\d|3[01])"
        r"T([01]\d|2[0-3]):[0-5]\d:[0-5]\d(\.\d+)?(Z|[+-]\d\d:\d\d)?",
        re.ASCII,
    ),
    # By pattern and not by `float`, which takes "nan", "1_000" and digits of all scripts; XSD's
    # double does not. NaN is left out: no attribute of the standard means it.
    Kind.DOUBLE: re.compile(r"[+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|-?INF", re.ASCII),
    # Twenty digits at most, since `int` of a long text takes time that grows with its square.
    **dict.fromkeys(_RANGES, re.compile(r"[+-]?\d{1,20}", re.ASCII)),
}


@dataclass(frozen=True)
class ParameterRef:
    """A reference to a declared parameter.

    Attributes:
        text: as in the file, ``$name``.
    """

    text: str

    def __post_init__(self) -> None:
        if not _REFERENCE.fullmatch(self.text):
            raise FileFormatError(f"a parameter reference reads $name, got '{self.text}'")

    @property
    def name(self) -> str:
        """The parameter's name, without the ``$``."""
        return self.text[1:]

    @property
    def names(self) -> frozenset[str]:
        """The one parameter that it needs."""
        return frozenset({self.name})

    def resolve(self, parameters: Mapping[str, V]) -> V:
        """Return the parameter's value: a scalar, or one per row.

        Raises:
            KeyError: the parameter is missing.
        """
        return parameters[self.name]

    def __str__(self) -> str:
        return self.text


@dataclass(frozen=True)
class Expr:
    """An expression over declared parameters: a number, or a boolean.

    Attributes:
        text: as in the file, ``${…}`` with ``$name`` for each parameter.
    """

    text: str

    def __post_init__(self) -> None:
        if not _EXPRESSION.fullmatch(self.text):
            raise FileFormatError(f"an expression reads ${{…}}, got '{self.text}'")

    @property
    def names(self) -> frozenset[str]:
        """The parameters that it needs."""
        return self.expression.names

    @property
    def expression(self) -> Expression:
        """The compiled form, with ``name`` for each ``$name``.

        Raises:
            FileFormatError: not an expression that can be evaluated.
        """
        return _compile(self.text)

    def resolve(self, parameters: Mapping[str, float | Float]) -> Float:
        """Return the value over scalars, or one per row over columns of N rows.

        Raises:
            FileFormatError: not an expression that can be evaluated.
            KeyError: a parameter is missing.
        """
        return self.expression.evaluate({name: parameters[name] for name in self.names})

    def __str__(self) -> str:
        return self.text


AnyValue = Annotated[str | ParameterRef | Expr, Kind.STRING]
Boolean = Annotated[bool | ParameterRef | Expr, Kind.BOOLEAN]
DateTime = Annotated[str | ParameterRef, Kind.DATE_TIME]
Double = Annotated[float | ParameterRef | Expr, Kind.DOUBLE]
Int = Annotated[int | ParameterRef | Expr, Kind.INT]
LiteralString = Annotated[str, Kind.STRING]
String = Annotated[str | ParameterRef, Kind.STRING]
UnsignedInt = Annotated[int | ParameterRef | Expr, Kind.UNSIGNED_INT]
UnsignedShort = Annotated[int | ParameterRef | Expr, Kind.UNSIGNED_SHORT]

Literal = bool | int | float | str
Value = Literal | ParameterRef | Expr


def resolve(value: Value, parameters: Mapping[str, float | Float]) -> Value | Float:
    """Return a literal as it is, and a reference or an expression by its parameters' values.

    Raises:
        FileFormatError: not an expression that can be evaluated.
        KeyError: a parameter is missing.
    """
    return value.resolve(parameters) if isinstance(value, ParameterRef | Expr) else value


@lru_cache(maxsize=1024)
def _compile(text: str) -> Expression:
    body = text[2:-1]
    words = _WORD.findall(body)
    bare = sorted({w for w in words if w[0].isalpha() or w[0] == "_"} - _WORDS)
    if bare:
        raise FileFormatError(
            f"'{text}': unknown name {bare[0]}; a parameter is written ${bare[0]}"
        )
    taken = sorted({w[1:] for w in words if w[0] == "$"} & _WORDS)
    if taken:
        raise FileFormatError(f"'{text}': the parameter ${taken[0]} is a word of expressions")
    try:
        formula = _TRUTH.sub(lambda word: _TRUTHS[word[1]], body).replace("$", "")
        return parse(formula, longest=MAX_LENGTH, deepest=MAX_DEPTH)
    except InputError as error:
        raise FileFormatError(f"'{text}' cannot be evaluated: {error}") from None


def parse_literal(kind: Kind, text: str) -> Literal:
    """Return a literal by its XSD type; a date stays text.

    Raises:
        FileFormatError: not of that type, out of its range, or NaN.
    """
    if kind is Kind.STRING:
        return text
    text = text.strip(" \t\r\n")
    if not _PATTERNS[kind].fullmatch(text):
        raise FileFormatError(f"must be of type {kind.value}, got '{text[:80]}'")
    if kind is Kind.BOOLEAN:
        return text in ("true", "1")
    if kind is Kind.DATE_TIME:
        return _checked_date(text)
    if kind is Kind.DOUBLE:
        value = float(text)
        # 7e999 is a double by its form, and would be infinite without anybody having said so.
        if math.isinf(value) and "INF" not in text:
            raise FileFormatError(f"must be of type double, got '{text[:80]}', which overflows")
        return value
    number = int(text)
    low, high = _RANGES[kind]
    if not low <= number <= high:
        raise FileFormatError(f"must be of type {kind.value}, {low} to {high}, got {number}")
    return number


def _checked_date(text: str) -> str:
    year, month, day = re.findall(r"\d+", text)[:3]
    try:
        # Python's dates end with the year 9999, and the XSD's do not.
        date(int(year) % 400 or 400, int(month), int(day))  # the calendar repeats after 400 years
    except ValueError:
        raise FileFormatError(f"must be of type dateTime, got '{text}': no such day") from None
    return text


def parse_value(kind: Kind, text: str, *, expressions: bool | None = None) -> Value:
    """Return an attribute's value: a literal, a ``$name`` or a ``${…}``.

    Args:
        kind: its data type.
        text: as in the file.
        expressions: whether it may be an expression; by default, whether its type may.

    Raises:
        FileFormatError: malformed, or an expression where the standard has none.
    """
    if _REFERENCE.fullmatch(text):
        return ParameterRef(text)
    if expressions is None:
        expressions = kind not in (Kind.STRING, Kind.DATE_TIME)
    if expressions and text.startswith("${"):
        expression = Expr(text)
        _compile(text)
        return expression
    return parse_literal(kind, text)


def format_double(value: float) -> str:
    """Return the shortest decimal text that reads back as the same double.

    Without an exponent from 1e-15 to 1e22: esmini pastes a parameter's text into an expression,
    and its expressions have no exponents.

    Raises:
        ValueError: NaN, which no attribute of the standard means.
    """
    if math.isnan(value):
        raise ValueError("NaN cannot be written")
    if math.isinf(value):
        return "INF" if value > 0 else "-INF"
    text = repr(float(value))
    if "e" in text and 1e-15 <= abs(value) < 1e22:
        text = format(Decimal(text), "f")
    return text


def format_value(kind: Kind, value: Value) -> str:
    """Return the text of an attribute's value.

    Raises:
        TypeError: a value of another type than the attribute's.
        ValueError: NaN, or a string that would be read back as a reference.
    """
    if isinstance(value, ParameterRef | Expr):
        return value.text
    if kind in (Kind.STRING, Kind.DATE_TIME):
        if not isinstance(value, str):
            raise TypeError(f"text is expected, got {value!r}")
        # What is written must read back as the same: a text that looks like a reference would not.
        if _REFERENCE.fullmatch(value):
            raise ValueError(f"the text '{value}' would be read as a reference to a parameter")
        return value
    if kind is Kind.BOOLEAN:
        if not isinstance(value, bool):
            raise TypeError(f"true or false is expected, got {value!r}")
        return "true" if value else "false"
    if isinstance(value, str | bool):
        raise TypeError(f"a number is expected, got {value!r}")
    if kind is Kind.DOUBLE:
        return format_double(value)
    if not isinstance(value, int):
        raise TypeError(f"a whole number is expected, got {value!r}")
    return str(value)


# --- Whether an expression is a number or a boolean, and whether it makes sense ---
# Source: ASAM OpenSCENARIO XML 1.3, section 9.2.1: arithmetic takes and gives numbers; ``not``,
# ``and`` and ``or`` take and give booleans; nothing turns one into the other.


def problem(expression: Expr, is_boolean: Mapping[str, bool], want: Kind) -> str | None:
    """Return what is wrong with the types in an expression, or None.

    Args:
        expression: whose parameters are all known.
        is_boolean: of each parameter, whether it is a boolean; else it is a number.
        want: the type that it is needed as; a text is content with both.
    """
    try:
        truth = _is_truth(expression.expression.tree, is_boolean)
    except _MixedError as error:
        return str(error)
    if want is Kind.BOOLEAN and not truth:
        return f"must be a boolean, {expression} is a number"
    if want.is_number and truth:
        return f"must be of type {want.value}, {expression} is a boolean"
    return None


class _MixedError(Exception):
    """A boolean where a number is needed, or the other way round."""


def _is_truth(node: ast.expr, is_boolean: Mapping[str, bool]) -> bool:
    match node:
        case ast.Name(id=name):
            return is_boolean[name]
        case ast.Compare():  # true and false
            return True
        case ast.BoolOp(values=operands):
            return _all(operands, is_boolean, truth=True)
        case ast.UnaryOp(op=ast.Not(), operand=operand):
            return _all([operand], is_boolean, truth=True)
        case ast.UnaryOp(operand=operand):
            return _all([operand], is_boolean, truth=False)
        case ast.BinOp(left=left, right=right):
            return _all([left, right], is_boolean, truth=False)
        case ast.Call(args=arguments):
            return _all(arguments, is_boolean, truth=False)
    return False


def _all(nodes: list[ast.expr], is_boolean: Mapping[str, bool], *, truth: bool) -> bool:
    for node in nodes:
        if _is_truth(node, is_boolean) is not truth:
            names = sorted(item.id for item in ast.walk(node) if isinstance(item, ast.Name))
            of = f" of ${', $'.join(names)}" if names else ""
            what = ("not, and, or", "number") if truth else ("arithmetic", "boolean")
            raise _MixedError(f"takes a {what[1]}{of} for {what[0]}")
    return truth
