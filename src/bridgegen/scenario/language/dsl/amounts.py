"""The values of an OpenSCENARIO DSL file: numbers, and formulas of what its ranges become."""

import re
from collections.abc import Iterator, Mapping
from dataclasses import dataclass
from typing import Any, NamedTuple, NoReturn

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import ScenarioError, UnsupportedError
from bridgegen.scenario.language.dsl.names import QUANTITIES, Names, Type
from bridgegen.scenario.language.dsl.parser import Node

SAMPLE = 512
"""Rows on which amounts are tried: what a road must hold, and which speeds there are."""

_LIMITS = {"<": "hi", "<=": "hi", ">": "lo", ">=": "lo"}
_FLIPPED = {"<": ">", "<=": ">=", ">": "<", ">=": "<=", "==": "=="}


def refuse(what: str, node: Node) -> NoReturn:
    """Refuse what logical scenarios have no words for, with its line."""
    raise UnsupportedError(f"{what} ({node.place})")


@dataclass(frozen=True, eq=False)
class Amount:
    """A number, or a formula of parameters, with its values in a sample of rows.

    Attributes:
        text: the formula.
        values: ``(SAMPLE,)`` float64; the first is that at the defaults.
    """

    text: str
    values: Float

    @property
    def low(self) -> float:
        """The least value."""
        return float(self.values.min())

    @property
    def high(self) -> float:
        """The greatest value."""
        return float(self.values.max())

    @property
    def fixed(self) -> bool:
        """Whether it is one number."""
        return bool((self.values == self.values[0]).all())

    def __add__(self, other: "Amount | float") -> "Amount":
        return _joined("+", self, other)

    def __sub__(self, other: "Amount | float") -> "Amount":
        return _joined("-", self, other)

    def __mul__(self, other: "Amount | float") -> "Amount":
        return _joined("*", self, other)

    def __truediv__(self, other: "Amount | float") -> "Amount":
        return _joined("/", self, other)

    def __abs__(self) -> "Amount":
        return _made(f"abs({self.text})", np.abs(self.values))

    def least(self, limit: float) -> "Amount":
        """Return it, or a limit where it is below."""
        return _made(f"max({self.text}, {limit!r})", np.maximum(self.values, limit))


_WORK = {"+": np.add, "-": np.subtract, "*": np.multiply, "/": np.divide}


def number(value: float) -> Amount:
    """Return a number."""
    return _made("", np.full(SAMPLE, value))


def _made(text: str, values: Float) -> Amount:
    is_number = bool((values == values[0]).all())
    return Amount(repr(round(float(values[0]), 9)) if is_number else text, values)


def _joined(sign: str, a: Amount, other: Amount | float) -> Amount:
    b = number(other) if isinstance(other, float) else other
    with np.errstate(all="ignore"):
        values = _WORK[sign](a.values, b.values)
    if sign == "+" and a.text == "0.0":
        return b
    is_same = b.fixed and b.low == (0.0 if sign in "+-" else 1.0)
    return a if is_same else _made(f"({a.text} {sign} {b.text})", values)


class Guard(NamedTuple):
    """What must hold in a row for something to happen: a formula, and where it does."""

    text: str
    rows: Bool

    def chosen(self, yes: Amount, no: Amount) -> Amount:
        """Return one amount where it holds, and the other one elsewhere."""
        if yes.text == no.text:
            return yes
        text = f"({yes.text} if {self.text} else {no.text})"
        return _made(text, np.where(self.rows, yes.values, no.values))


class Scope(NamedTuple):
    """What names mean in a scenario: its declaration, and the arguments that it is given."""

    of: Type
    given: Mapping[str, Amount]


class Amounts:
    """The parameters, bounds and derived quantities that a file's expressions become.

    Attributes:
        sections: ``parameters``, ``derived`` and ``bounds`` as a scenario file holds them.
        lines: of what is in there, by path.

    Args:
        names: what the file declares.
    """

    def __init__(self, names: Names) -> None:
        self._names = names
        self.sections: dict[str, Any] = {"parameters": {}, "derived": {}, "bounds": []}
        self.lines: dict[tuple[str | int, ...], int] = {}
        self._known: dict[tuple[str, str], Amount] = {}
        self._random = np.random.default_rng(0)  # which rows are tried; no scenario depends on it

    def new_name(self, name: str) -> str:
        """Return a name that no quantity has, like this one."""
        name, taken = re.sub(r"\W", "_", name)[:56], self.sections
        tried = (name, *(f"{name}_{number}" for number in range(2, 10_000)))
        return next(n for n in tried if n not in taken["parameters"] and n not in taken["derived"])

    def _declare(self, section: str, name: str, node: Node, **more: Any) -> None:
        source = {"axis": "participants", "source": node.source}
        self.sections[section][name] = {**source, "description": f"{name}, of the file.", **more}
        self.lines[(section, name)] = node.line

    def parameter(
        self, name: str, unit: str, low: float, high: float, node: Node, usual: float | None = None
    ) -> Amount:
        """Return a range as a parameter.

        Raises:
            ScenarioError: it is empty, or not finite.
        """
        if not -1e9 <= low <= high <= 1e9:
            what = f"a range goes up from a number to another, got [{low:g}..{high:g}]"
            raise ScenarioError(f"{what} for {name} ({node.place})")
        if low == high:
            return number(low)
        name = self.new_name(name)
        usual = 0.5 * (low + high) if usual is None else usual
        self._declare(
            "parameters", name, node, unit=unit, low=low, high=high, default=usual
        )  # fmt: skip
        values = low + self._random.choice([0.0, 0.0, 0.5, 1.0, 1.0], SAMPLE) * (high - low)
        values[0] = usual
        return Amount(name, values)

    def choice(self, name: str, options: list[str], node: Node) -> list[Guard]:
        """Return what holds where a new category has each of its values."""
        name = self.new_name(name)
        self._declare(
            "parameters", name, node, kind="category", values=options, default=options[0]
        )  # fmt: skip
        chosen = self._random.integers(0, len(options), SAMPLE)
        chosen[0] = 0
        return [Guard(f"{name} == {option}", chosen == k) for k, option in enumerate(options)]

    def written(self, amount: Amount, name: str, unit: str, node: Node) -> float | str:
        """Return an amount as a scenario file holds it; a formula becomes a derived quantity."""
        if not np.isfinite(amount.values).all():
            refuse(f"{name} has no finite value", node)
        if amount.fixed:
            return round(amount.low, 9)
        text = amount.text
        if text not in self.sections["parameters"] and text not in self.sections["derived"]:
            name = self.new_name(name)
            why = "What the file says of its phases."
            self._declare("derived", name, node, unit=unit, value=text, why=why)
            return name
        return text

    def short(self, amount: Amount, name: str, unit: str, node: Node) -> Amount:
        """Return an amount by a name, so that what is made of it stays readable."""
        return _made(str(self.written(amount, name, unit, node)), amount.values)

    def amount(self, node: Node, scope: Scope, unit: str, name: str) -> Amount:
        """Return the value of an expression.

        Args:
            node: the expression.
            scope: where it stands.
            unit: SI, or "" for a count.
            name: of the parameter that a range becomes.

        Raises:
            ScenarioError: it has another unit, or names what is not declared.
            UnsupportedError: it is no arithmetic.
        """
        match node.kind, node.name:
            case "number", _:
                given = self._names.unit(node.name) if node.name else ("", 1.0)
                value = float(node.more["value"])
                if given is None or given[0] != unit:
                    what = f"{name} needs {f'a value in {unit}' if unit else 'a plain number'}"
                    raise ScenarioError(f"{what}, got {value:g} {node.name} ({node.place})")
                return number(value * given[1])
            case "range", _:
                low, high = (self.amount(item, scope, unit, name) for item in node.items)
                if not (low.fixed and high.fixed and unit):
                    refuse(f"a range of {name} goes from a physical value to another", node)
                return self.parameter(name, unit, low.low, high.low, node)
            case "operation", "minus":
                return number(0.0) - self.amount(node.items[0], scope, unit, name)
            case "operation", "+" | "-" | "*" | "/":
                left, right = node.items
                flips = node.name == "*" and left.kind == "number" and not left.name
                units = (unit, unit) if node.name in "+-" else ("", unit) if flips else (unit, "")
                a = self.amount(left, scope, units[0], name)
                return _joined(node.name, a, self.amount(right, scope, units[1], name))
            case "name", _:
                return self._field(node, scope, unit)
        refuse(f"{name} cannot be a {node.kind.replace('_', ' ')}", node)

    def _field(self, node: Node, scope: Scope, unit: str) -> Amount:
        """Return the value of a field: given, declared, or limited by keep()."""
        name, key = node.name, (scope.of.node.name, node.name)
        if name in scope.given:
            return scope.given[name]
        declared = scope.of.fields.get(name) or self._names.fields.get(name)
        if declared is None:
            raise ScenarioError(f"no field '{name}' is declared ({node.place})")
        of = str(declared.more["of"])
        if unit_of(declared) != unit:
            what = f"a value in {unit}" if unit else "a number"
            raise ScenarioError(f"{name} is of type {of}, {what} is needed ({node.place})")
        if key not in self._known:
            self._known[key] = number(np.nan)  # of a field that its own value names
            self._known[key] = self._limited(name, declared, scope, unit)
        return self._known[key]

    def forget(self, of: str) -> None:
        """Let a scenario's fields be drawn again: it is called once more."""
        self._known = {key: value for key, value in self._known.items() if key[0] != of}

    def _limited(self, name: str, declared: Node, scope: Scope, unit: str) -> Amount:
        value, usual = declared.more["value"], None
        ends: dict[str, float] = {}
        bounds: list[tuple[str, Amount]] = []
        for sign, other, strength in _kept(name, declared, scope):
            side = _LIMITS.get(sign, "")
            if sign == "==" and strength == "default":
                usual = self.amount(other, scope, unit, name)
            elif sign == "==" or (sign == "in" and other.kind == "range"):
                value = other
            elif not side:
                refuse("keep() limits a field by ==, <, <=, >, >= or to a range", other)
            elif (limit := self.amount(other, scope, unit, name)).fixed:
                nearer = max if side == "lo" else min
                ends[side] = nearer(ends.get(side, limit.low), limit.low)
            else:
                bounds.append((side, limit))
        default = usual.low if usual is not None and usual.fixed else None
        if value is not None:
            found = self.amount(value, scope, unit, name)
            bounds += [(side, number(end)) for side, end in ends.items()]
        elif len(ends) == 2:
            low, high = ends["lo"], ends["hi"]
            found = self.parameter(name, unit or "1", low, high, declared, default)
        elif usual is not None and not ends:
            found = usual
        else:
            refuse(f"'{name}' has no value, and no keep() limits it to a range", declared)
        parameter = self.sections["parameters"].get(found.text)
        if bounds and parameter is None:
            refuse(f"keep() limits '{name}', which has no range", declared)
        if parameter is not None and default is not None:
            parameter["default"] = default
        for side, limit in bounds:
            said = {"why": "A keep() of the file.", "source": declared.source}
            self.sections["bounds"].append({"target": found.text, side: limit.text, **said})
        return found


def unit_of(declared: Node | None) -> str | None:
    """Return the unit of a field's values; "" of plain numbers; None if it has no number."""
    of = str(declared.more["of"]) if declared is not None else ""
    return QUANTITIES.get(of, "" if of in ("int", "uint", "float") else None)


def _kept(name: str, declared: Node, scope: Scope) -> Iterator[tuple[str, Node, str]]:
    """Yield the constraints on a field: a sign, the other side, and how strong it is."""
    keeps = [(member, {name}) for member in scope.of.members]
    keeps += [(member, {name, "it"}) for member in declared.part("members")]
    for member, called in keeps:
        waiting = [member.items[0]] if member.kind == "keep" else []
        while waiting:
            each = waiting.pop()
            if each.kind == "operation" and each.name == "and":
                waiting += each.items
            elif each.kind == "operation" and len(each.items) == 2:
                left, right = each.items
                if left.kind == "name" and left.name in called:
                    yield each.name, right, member.name
                elif right.kind == "name" and right.name in called and left.kind == "number":
                    yield _FLIPPED.get(each.name, "?"), left, member.name
