"""The formulas of constraints: restricted arithmetic, read by Python's parser, never run by it.

What a formula may hold, and all that a compiler of ``Expression.tree`` has to know (``parse``
normalises everything else away):

=====================  ==========================================================================
``Constant``           a finite float (``pi`` and integers become one)
``Name``               a parameter
``UnaryOp``            ``USub`` of a number; ``Not`` of a truth value (``+x`` becomes ``x``)
``BinOp``              ``Add Sub Mult Div Mod Pow`` of numbers (``pow(a, b)`` becomes ``a ** b``)
``Compare``            one of ``Lt LtE Gt GtE Eq NotEq`` between two numbers; no chains
``BoolOp``             ``And``, ``Or``
``IfExp``              ``a if condition else b``
``Call``               a function of ``FUNCTIONS`` by name, positional arguments only
=====================  ==========================================================================

A name may also be a category; it is compared by ``==`` or ``!=`` with one of its values, which
stands for its number (`bridgegen.scenario.language.kinds.Category`): ``surface == wet``.

A formula is a number or a truth value. A number stands for a truth value as in Python (not 0 is
true); a truth value never stands for a number, except as the whole formula: 1 or 0.
``%`` has the sign of the divisor. ``round`` takes halves up, as SPARQL and XPath do.
"""

import ast
import math
import re
import warnings
from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, field
from functools import reduce
from types import MappingProxyType
from typing import Any

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError

MAX_LENGTH = 1000
MAX_DEPTH = 32

Categories = Mapping[str, Sequence[str]]
_Program = Callable[[Mapping[str, Any]], Any]


def _round_half_up(value: Any) -> Any:
    floor = np.floor(value)
    # NumPy's `round` takes halves to the even number; SPARQL and XPath take them up, and both must
    # agree with the decoder.
    return floor + (value - floor >= 0.5)


def _least(*values: Any) -> Any:
    return reduce(np.minimum, values)


def _greatest(*values: Any) -> Any:
    return reduce(np.maximum, values)


# name: (fewest arguments, most arguments, function)
FUNCTIONS: dict[str, tuple[int, int, Callable[..., Any]]] = {
    "abs": (1, 1, np.abs),
    "acos": (1, 1, elementary.acos),
    "asin": (1, 1, elementary.asin),
    "atan": (1, 1, elementary.atan),
    "ceil": (1, 1, np.ceil),
    "cos": (1, 1, elementary.cos),
    "exp": (1, 1, elementary.exp),
    "floor": (1, 1, np.floor),
    "log": (1, 1, elementary.log),
    "max": (2, 16, _greatest),
    "min": (2, 16, _least),
    "round": (1, 1, _round_half_up),
    "sign": (1, 1, np.sign),
    "sin": (1, 1, elementary.sin),
    "sqrt": (1, 1, np.sqrt),
    "tan": (1, 1, elementary.tan),
}
RESERVED = frozenset(FUNCTIONS) | {"pi", "pow"}

_BINARY: dict[type[ast.operator], Callable[..., Any]] = {
    ast.Add: np.add,
    ast.Sub: np.subtract,
    ast.Mult: np.multiply,
    ast.Div: np.divide,
    ast.Mod: np.mod,
    ast.Pow: elementary.power,
}
_COMPARE: dict[type[ast.cmpop], Callable[..., Any]] = {
    ast.Lt: np.less,
    ast.LtE: np.less_equal,
    ast.Gt: np.greater,
    ast.GtE: np.greater_equal,
    ast.Eq: np.equal,
    ast.NotEq: np.not_equal,
}
_CHARACTERS = re.compile(r"[A-Za-z0-9_.,+\-*/%()<>=! ]*")


@dataclass(frozen=True)
class Expression:
    """A formula over named columns. Made by ``parse``; equal when written equally.

    Attributes:
        source: the text, white space normalised.
        names: the parameters that occur in it.
        tree: its normalised syntax tree, of the nodes listed above.
        categories: its parameters that are categories, each with the names of its values.
    """

    source: str
    names: frozenset[str] = field(compare=False, repr=False)
    tree: ast.expr = field(compare=False, repr=False)
    _program: _Program = field(compare=False, repr=False)
    categories: tuple[tuple[str, tuple[str, ...]], ...] = field(
        default=(), repr=False, kw_only=True
    )

    def evaluate(self, columns: Mapping[str, Float | float]) -> Float:
        """Return the formula's value for each row.

        A row's value has the same bits whatever the rows around it.

        Args:
            columns: ``(N,)`` or a number for each of ``names``; others are ignored.

        Returns:
            Float64 of the columns' common shape; shape ``()`` if all are numbers. NaN or inf
            where the formula has no value (division by zero, root of a negative number).

        Raises:
            ValueError: a column is missing.
        """
        missing = sorted(self.names - columns.keys())
        if missing:
            raise ValueError(f"'{self.source}' needs a value for {', '.join(missing)}")
        arrays = {name: np.asarray(columns[name], dtype=np.float64) for name in self.names}
        with np.errstate(all="ignore"):
            return np.asarray(self._program(arrays), dtype=np.float64)

    def as_json(self) -> Any:
        """Return the formula for other programs: numbers, names, and lists of operator and parts.

        Operators are Python's: ``["+", "a", 2.0]``; also ``["neg", a]``, ``["if", test, a, b]``,
        and a function's name with its arguments.
        """
        return _as_json(self.tree)

    def __str__(self) -> str:
        return self.source

    def __reduce__(self) -> tuple[Callable[..., "Expression"], tuple[Any, ...]]:
        # A compiled formula is made of closures, which pickle cannot take to a worker; its text is
        # enough.
        return parse, (self.source, "", dict(self.categories))


@dataclass(frozen=True)
class Lookup(Expression):
    """A value for each whole number of a parameter, from 0. Made by ``lookup``; no formula.

    Attributes:
        values: by number.
    """

    values: tuple[float, ...]

    def as_json(self) -> Any:
        """See `Expression`: ``["lookup", name, value, …]``."""
        return ["lookup", *self.names, *self.values]

    def __reduce__(self) -> tuple[Callable[..., Expression], tuple[Any, ...]]:
        (index,) = self.names
        return lookup, (index, self.values)


def lookup(index: str, values: Sequence[float]) -> Lookup:
    """Return what takes a value by number.

    Args:
        index: the parameter that holds the number, 0 to len(values) - 1.
        values: what there is to take.
    """
    table = np.array(values, dtype=np.float64)
    source = f"({', '.join(f'{value:g}' for value in values)})[{index}]"
    exact = f"({', '.join(map(repr, table.tolist()))},)[{index}]"
    tree = ast.parse(exact, mode="eval").body

    def take(columns: Mapping[str, Any]) -> Any:
        return table[columns[index].astype(np.int64)]

    return Lookup(source, frozenset({index}), tree, take, tuple(table.tolist()))


def parse(
    text: str,
    place: str = "",
    categories: Categories = MappingProxyType({}),
    *,
    longest: int = MAX_LENGTH,
    deepest: int = MAX_DEPTH,
) -> Expression:
    """Read a formula.

    Args:
        text: such as ``"50 if fog_density > 80 else 100 - 0.5*fog_density"``.
        place: file and line, for the message.
        categories: the names of the values of each parameter that is a category.
        longest: how many characters it may have.
        deepest: how deep it may nest.

    Raises:
        InputError: not a formula, or one that holds what formulas may not.
    """
    source = " ".join(text.split())
    where = f" ({place})" if place else ""
    shown = source if len(source) <= 80 else source[:77] + "..."
    if len(source) > longest:
        raise InputError(
            f"a formula may have {longest} characters, got {len(source)}: '{shown}'{where}"
        )
    try:
        # Before Python's parser sees the text: no brackets, quotation marks or underscored tricks
        # reach it.
        unknown = _CHARACTERS.sub("", source)
        if unknown:
            raise _RefusedError(f"{unknown[0]!r} is no part of a formula")
        tree, _ = _normalise(_numbered(_syntax(source, deepest), categories))
    except _RefusedError as error:
        raise InputError(f"cannot read the formula '{shown}': {error}{where}") from None
    names = frozenset(node.id for node in _nodes(tree) if isinstance(node, ast.Name))
    own = tuple((name, tuple(categories[name])) for name in sorted(names & categories.keys()))
    return Expression(source, names, tree, _compile(tree), categories=own)


_SIGNS: dict[type[ast.AST], str] = {
    ast.Add: "+", ast.Sub: "-", ast.Mult: "*", ast.Div: "/", ast.Mod: "%", ast.Pow: "**",
    ast.Lt: "<", ast.LtE: "<=", ast.Gt: ">", ast.GtE: ">=", ast.Eq: "==", ast.NotEq: "!=",
    ast.And: "and", ast.Or: "or", ast.USub: "neg", ast.Not: "not",
}  # fmt: skip


def _as_json(node: ast.expr) -> Any:
    match node:
        case ast.Constant(value=value):
            return float(value)  # type: ignore[arg-type]
        case ast.Name(id=name):
            return name
        case ast.UnaryOp(op=op, operand=operand):
            return [_SIGNS[type(op)], _as_json(operand)]
        case ast.BinOp(op=operator, left=left, right=right):
            return [_SIGNS[type(operator)], _as_json(left), _as_json(right)]
        case ast.Compare(left=left, ops=[comparison], comparators=[right]):
            return [_SIGNS[type(comparison)], _as_json(left), _as_json(right)]
        case ast.BoolOp(op=bool_op, values=values):
            return [_SIGNS[type(bool_op)], *map(_as_json, values)]
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return ["if", _as_json(test), _as_json(body), _as_json(orelse)]
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return [name, *map(_as_json, arguments)]
    raise AssertionError(f"no formula has a {type(node).__name__}")


class _RefusedError(Exception):
    """Why a text is not a formula."""


def _syntax(source: str, deepest: int) -> ast.expr:
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("error")  # such as "0if a else b": Python only warns
            tree = ast.parse(source, mode="eval").body
    # The parser may run out of its own stack on a text within the bound of length.
    except (SyntaxError, ValueError, MemoryError, RecursionError, Warning) as error:
        reason = error.msg if isinstance(error, SyntaxError) else str(error)
        raise _RefusedError(reason or "too deep") from None
    # Level by level: measuring a depth by recursion would fail on the depth that it is to refuse.
    level: list[ast.AST] = [tree]
    for _ in range(deepest):
        level = [child for node in level for child in ast.iter_child_nodes(node)]
        if not level:
            return tree
    raise _RefusedError(f"a formula may nest {deepest} deep")


def _numbered(tree: ast.expr, categories: Categories) -> ast.expr:
    """Return a formula in which the values of categories are their numbers."""
    if not categories:
        return tree
    found = _Numbers(categories).visit(tree)
    assert isinstance(found, ast.expr)
    return found


class _Numbers(ast.NodeTransformer):
    """Puts the number of a category's value in place of its name."""

    def __init__(self, categories: Categories) -> None:
        self._categories = categories

    def visit_Compare(self, node: ast.Compare) -> ast.AST:
        sides = [node.left, *node.comparators]
        of = [
            side.id for side in sides if isinstance(side, ast.Name) and side.id in self._categories
        ]
        if len(sides) != 2 or not of:
            return self.generic_visit(node)
        name, values = of[0], self._categories[of[0]]
        category, value = (
            sides
            if isinstance(sides[0], ast.Name) and sides[0].id == name
            else (sides[1], sides[0])
        )
        if not isinstance(node.ops[0], ast.Eq | ast.NotEq):
            raise _RefusedError(f"the values of '{name}' have no order: compare it by == or !=")
        if not isinstance(value, ast.Name) or value.id not in values:
            raise _RefusedError(
                f"'{name}' is one of {', '.join(values)}, got '{ast.unparse(value)}'"
            )
        # Names become numbers here, once: rows, kernels and SPARQL hold a category as the number of
        # its name.
        return ast.Compare(category, node.ops, [ast.Constant(float(values.index(value.id)))])

    def visit_Name(self, node: ast.Name) -> ast.AST:
        if node.id in self._categories:
            first = self._categories[node.id][0]
            raise _RefusedError(
                f"'{node.id}' is a category and no number: compare it, {node.id} == {first}"
            )
        return node


def _nodes(tree: ast.expr) -> list[ast.AST]:
    """Every node but the names of functions."""
    called = {id(node.func) for node in ast.walk(tree) if isinstance(node, ast.Call)}
    return [node for node in ast.walk(tree) if id(node) not in called]


def _number(node: ast.expr) -> ast.expr:
    result, truth = _normalise(node)
    if truth:
        raise _RefusedError(f"'{ast.unparse(node)}' is true or false, a number is needed")
    return result


def _normalise(node: ast.expr) -> tuple[ast.expr, bool]:
    """Return the normalised node and whether it is a truth value."""
    match node:
        case ast.Constant(value=int() | float() as value) if not isinstance(value, bool):
            return _constant(value), False
        case ast.Name(id="pi"):
            return ast.Constant(math.pi), False
        case ast.Name(id=name):
            if name in RESERVED:
                raise _RefusedError(f"'{name}' is a function: write {name}(…)")
            return ast.Name(name, ast.Load()), False
        case ast.UnaryOp(op=ast.UAdd(), operand=operand):
            return _number(operand), False
        case ast.UnaryOp(op=ast.USub() as sign, operand=operand):
            return ast.UnaryOp(sign, _number(operand)), False
        case ast.UnaryOp(op=ast.Not() as op, operand=operand):
            return ast.UnaryOp(op, _normalise(operand)[0]), True
        case ast.BinOp(left=left, op=operator, right=right) if type(operator) in _BINARY:
            return ast.BinOp(_number(left), operator, _number(right)), False
        case ast.Compare(left=left, ops=[op], comparators=[right]) if type(op) in _COMPARE:
            return ast.Compare(_number(left), [op], [_number(right)]), True
        case ast.Compare(ops=[_, _, *_]):
            raise _RefusedError(
                f"write the chain '{ast.unparse(node)}' as two comparisons joined by 'and'"
            )
        case ast.BoolOp(op=bool_op, values=values):
            return ast.BoolOp(bool_op, [_normalise(value)[0] for value in values]), True
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return ast.IfExp(_normalise(test)[0], _number(body), _number(orelse)), False
        case ast.Call(func=ast.Name(id=name), args=args, keywords=[]):
            return _call(name, [_number(argument) for argument in args]), False
    raise _RefusedError(f"'{ast.unparse(node)}' is outside what formulas may hold")


def _constant(value: float) -> ast.Constant:
    try:
        result = float(value)
    except OverflowError:
        result = math.inf
    if not math.isfinite(result):
        raise _RefusedError("a number must be finite")
    return ast.Constant(result)


def _call(name: str, arguments: list[ast.expr]) -> ast.expr:
    if name != "pow" and name not in FUNCTIONS:
        known = ", ".join(sorted(FUNCTIONS | {"pow": None}))
        raise _RefusedError(f"there is no function '{name}'; there are {known}")
    fewest, most = (2, 2) if name == "pow" else FUNCTIONS[name][:2]
    if not fewest <= len(arguments) <= most:
        want = str(fewest) if fewest == most else f"{fewest} to {most}"
        raise _RefusedError(f"{name} takes {want} arguments, got {len(arguments)}")
    if name == "pow":
        return ast.BinOp(arguments[0], ast.Pow(), arguments[1])
    return ast.Call(ast.Name(name, ast.Load()), arguments, [])


def _compile(node: ast.AST) -> _Program:
    """Turn a normalised node into nested functions of the columns."""
    match node:
        case ast.Constant(value=value):
            return lambda columns: value
        case ast.Name(id=name):
            return lambda columns: columns[name]
        case ast.UnaryOp(op=op, operand=operand):
            return _apply(np.logical_not if isinstance(op, ast.Not) else np.negative, operand)
        case ast.BinOp(left=left, op=operator, right=right):
            return _apply(_BINARY[type(operator)], left, right)
        case ast.Compare(left=left, ops=[op], comparators=[right]):
            return _apply(_COMPARE[type(op)], left, right)
        case ast.BoolOp(op=bool_op, values=values):
            pair = np.logical_and if isinstance(bool_op, ast.And) else np.logical_or
            return _apply(lambda *truths: reduce(pair, truths), *values)
        case ast.IfExp(test=test, body=body, orelse=orelse):
            return _apply(
                lambda t, a, b: np.where(np.asarray(t, dtype=np.bool_), a, b), test, body, orelse
            )
        case ast.Call(func=ast.Name(id=name), args=arguments):
            return _apply(FUNCTIONS[name][2], *arguments)
    raise AssertionError(f"normalised trees hold no {type(node).__name__}")  # pragma: no cover


def _apply(function: Callable[..., Any], *operands: ast.AST) -> _Program:
    programs = [_compile(operand) for operand in operands]
    if len(programs) == 1:
        (only,) = programs
        return lambda columns: function(only(columns))
    if len(programs) == 2:
        left, right = programs
        return lambda columns: function(left(columns), right(columns))
    return lambda columns: function(*[program(columns) for program in programs])
