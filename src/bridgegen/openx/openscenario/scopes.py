"""What a parameter's name means where it stands: the innermost declaration counts.

A parameter of the whole scenario stays one. One of a story, a maneuver, a vehicle and so on is its
value: a literal, or what it makes of the scenario's own. So is a parameter of the scenario whose
value is made of others: it is these that can be varied.

Source: ASAM OpenSCENARIO XML 1.2, section 9.1.
"""

import re
from collections.abc import Iterable, Mapping
from contextlib import suppress
from dataclasses import dataclass, field, replace
from typing import Any, Protocol

import numpy as np

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario.declarations import ParameterDeclaration, ValueConstraint
from bridgegen.openx.openscenario.element import Attribute, Element
from bridgegen.openx.openscenario.enumerations import ParameterType
from bridgegen.openx.openscenario.parameters import (
    broken,
    clash,
    kind_of,
    misfits,
    name_problem,
    refers,
)
from bridgegen.openx.openscenario.values import (
    MAX_LENGTH,
    Expr,
    Kind,
    Literal,
    ParameterRef,
    Value,
    format_double,
    parse_literal,
    parse_value,
)

_TEXTS = (Kind.STRING, Kind.DATE_TIME)
_NAMES = re.compile(r"\$([A-Za-z_][A-Za-z0-9_]*)")

_NUMBER = re.compile(r"\s*([+-]?(\d+\.?\d*|\.\d+)([eE][+-]?\d+)?|true|false)\s*")


class Problems(Protocol):
    """Takes down what is wrong with parameters."""

    def wrong(self, element: Element, text: str) -> None:
        """Note what is wrong."""

    def doubtful(self, element: Element, text: str) -> None:
        """Note what is wrong and can be made sense of: the last value counts."""

    def odd(self, element: Element, text: str) -> None:
        """Note what is wrong and harms nothing unless it is used."""


@dataclass(frozen=True)
class Binding:
    """What a parameter is.

    Attributes:
        declaration: its own, with the value that it has while the scenario's own parameters have
            their declared ones.
        kind: its type.
        now: that value.
        value: the same, or how it depends on the scenario's own parameters.
    """

    declaration: ParameterDeclaration
    kind: Kind
    now: Literal
    value: Value


@dataclass(frozen=True)
class Scope:
    """The parameters that can be referred to.

    Attributes:
        names: all of them.
        own: those that the scenario declares with a literal, which stay parameters.
    """

    names: Mapping[str, Binding] = field(default_factory=dict)
    own: Mapping[str, Binding] = field(default_factory=dict)

    @classmethod
    def of_scenario(
        cls, declarations: Iterable[ParameterDeclaration], problems: Problems
    ) -> "Scope":
        """Return the scope of a scenario's declarations; see `inner`."""
        declarations = list(declarations)
        # The literal ones first, wherever they stand: these stay parameters, and the made ones are
        # formulas of them. All are compared with their constraints last, as a constraint may refer
        # to any parameter.
        literal = [declaration for declaration in declarations if not is_made(declaration)]
        found = cls().inner(literal, problems, checks=False).names
        own = {
            name: replace(binding, value=ParameterRef(f"${name}"))
            for name, binding in found.items()
        }
        made = [declaration for declaration in declarations if is_made(declaration)]
        scope = cls(own, own).inner(made, problems, checks=False)
        scope._check(declarations, problems)
        return scope

    def inner(
        self,
        declarations: Iterable[ParameterDeclaration],
        problems: Problems,
        assigned: Mapping[str, Value] | None = None,
        *,
        checks: bool = True,
    ) -> "Scope":
        """Return the scope within an element that declares parameters.

        Args:
            declarations: a value may refer to what is in scope around, or declared before.
            problems: takes what is wrong with them.
            assigned: values that count instead of the declared ones, by the scenario's own.
            checks: whether to compare them with their constraints.
        """
        names = dict(self.names)
        made = Scope(names, self.own)
        seen: dict[str, ParameterDeclaration] = {}
        for declaration in declarations:
            if problem := name_problem(declaration.name):
                problems.wrong(declaration, problem)
                continue
            if problem := clash(declaration, seen.get(declaration.name)):
                problems.doubtful(declaration, problem)
            seen[declaration.name] = declaration
            is_given = assigned is not None and declaration.name in assigned
            value = (
                assigned[declaration.name]
                if assigned is not None and is_given
                else declaration.value
            )
            # An assigned value comes from outside the element: the names in it are the scenario's
            # own, and not those that the element declares.
            scope = Scope(self.own, self.own) if is_given else made
            try:
                names[declaration.name] = scope._bind(declaration, value)
            except FileFormatError as error:
                said = f"the value of parameter {declaration.name} {error}"
                as_text = replace(declaration, parameter_type=ParameterType.STRING)
                try:
                    names[declaration.name] = scope._bind(as_text, value)
                except FileFormatError:
                    problems.doubtful(declaration, said)
                else:
                    if "$" in str(value):
                        problems.doubtful(declaration, said)
                    else:
                        problems.odd(declaration, f"{said}; taken as a text")
        if checks:
            made._check(seen.values(), problems)
        return made

    def _check(self, declarations: Iterable[ParameterDeclaration], problems: Problems) -> None:
        """Compare parameters with their constraints, which may refer to one another."""
        known = {name: binding.now for name, binding in self.names.items()}
        for declaration in declarations:
            bound = self.names.get(declaration.name)
            if bound is None or bound.kind is not kind_of(declaration.parameter_type):
                continue  # it has no value of its type, which has been said
            for text in broken(declaration, bound.now, known):
                problems.wrong(declaration, f"parameter {declaration.name} {text}")

    def _bind(self, declaration: ParameterDeclaration, value: Value) -> Binding:
        kind = kind_of(declaration.parameter_type)
        if isinstance(value, str):
            declaration = replace(declaration, value=value)
            value = parse_value(kind, value)
        if not isinstance(value, ParameterRef | Expr):
            return Binding(declaration, kind, value, value)
        attribute = Attribute("value", "value", kind, None, True, False, True, None, None)
        made = self.value(attribute, value)
        now = self.now(made, kind)
        return Binding(replace(declaration, value=text_of(now)), kind, now, made)

    def value(self, attribute: Attribute, value: Any) -> Any:
        """Return an attribute's value as it depends on nothing but the scenario's own parameters.

        Args:
            attribute: what takes it.
            value: as in the file.

        Raises:
            FileFormatError: what it refers to is not there or does not fit, or has no value.
        """
        if not isinstance(value, ParameterRef | Expr):
            return value
        bound = {name: self.names[name] for name in value.names if name in self.names}
        kinds = {name: (item.kind, item.now) for name, item in bound.items()}
        for text in misfits(attribute, value, kinds, texts=True):
            raise FileFormatError(text)
        as_text = attribute.kind in _TEXTS and isinstance(value, ParameterRef)
        if not as_text:  # a text that reads as a number is that number
            fixed = (*_TEXTS, Kind.BOOLEAN) if isinstance(value, Expr) else _TEXTS
            bound |= {n: replace(b, value=b.now) for n, b in bound.items() if b.kind in fixed}
        depends = all(self.own.get(name) is item for name, item in bound.items())
        if depends and not (isinstance(value, Expr) and attribute.kind is Kind.BOOLEAN):
            return value
        if isinstance(value, ParameterRef):
            binding = bound[value.name]
            made = binding.value
            if not isinstance(made, ParameterRef | Expr):
                return (
                    attribute.enum(str(made)) if attribute.enum else _typed(binding, attribute.kind)
                )
        else:
            made = _put_in(value, bound)
        if isinstance(made, ParameterRef) or (made.names and attribute.takes_expressions):
            return made
        now = self.now(made, attribute.kind)
        return text_of(now) if attribute.kind is Kind.STRING else now

    def now(self, value: Value, kind: Kind) -> Literal:
        """Return a value at the declared values of the scenario's own parameters, by its type.

        Raises:
            FileFormatError: it has none, or none of that type.
        """
        if isinstance(value, ParameterRef):
            return _typed(self.own[value.name], kind)
        if not isinstance(value, Expr):
            return value
        # Whatever a formula of a file does not define, 1/0 or an overflow, is infinite or NaN, and
        # refused below with the formula.
        with np.errstate(all="ignore"):
            number = float(value.resolve({name: float(self.own[name].now) for name in value.names}))
        if not np.isfinite(number) or (kind.is_integer and not number.is_integer()):
            what = "a whole number" if kind.is_integer else "finite"
            raise FileFormatError(f"must be {what}, got {value} = {number:g}")
        if kind is Kind.BOOLEAN:
            return bool(number)
        return int(number) if kind.is_integer else number

    def constrained(self, declaration: ParameterDeclaration) -> ParameterDeclaration:
        """Return one of the scenario's own declarations with constraints on its own parameters."""
        kind = kind_of(declaration.parameter_type)
        takes = Attribute("value", "value", kind, None, True, False, True, None, None)

        def limited(limit: ValueConstraint) -> ValueConstraint:
            if not refers(limit):
                return limit
            made = self.value(takes, parse_value(kind, limit.value, expressions=True))
            is_made = isinstance(made, ParameterRef | Expr)
            return replace(limit, value=made.text if is_made else text_of(made))

        with suppress(FileFormatError):  # which has been said
            groups = (
                replace(group, constraints=tuple(map(limited, group.constraints)))
                for group in declaration.constraint_groups
            )
            return replace(declaration, constraint_groups=tuple(groups))
        return declaration

    def text(self, attribute: Attribute, value: Any) -> str:
        """Return the text that an attribute is at the scenario's declared values.

        Raises:
            FileFormatError: what it refers to is not there or does not fit.
        """
        return text_of(self.now(self.value(attribute, value), Kind.STRING))


def is_made(declaration: ParameterDeclaration) -> bool:
    """Return whether a parameter's value refers to others, or is to be computed."""
    if kind_of(declaration.parameter_type) in _TEXTS:
        return _NAMES.fullmatch(declaration.value) is not None
    return "$" in declaration.value


def reads_as_number(declaration: ParameterDeclaration) -> bool:
    """Return whether a parameter is a text that may stand for a number or a boolean."""
    return kind_of(declaration.parameter_type) is Kind.STRING and (
        _NUMBER.fullmatch(declaration.value) is not None
    )


def _put_in(value: Expr, bound: Mapping[str, Binding]) -> Expr:
    """Return an expression in which parameters stand for what they are."""

    def stands(name: str) -> str:
        # In parentheses: $a*2 with a = ${$b + 1} must not become $b + 1*2, nor -$a with a = -3
        # become --3.
        flag = bound[name].value
        if isinstance(flag, Expr):
            return f"({flag.text[2:-1]})"
        return flag.text if isinstance(flag, ParameterRef) else f"({text_of(flag)})"

    text = _NAMES.sub(lambda found: stands(found[1]), value.text)
    # Formulas that refer to each other twice double in length with each level: a small file could
    # ask for any amount of memory.
    if len(text) > MAX_LENGTH:
        raise FileFormatError(
            f"may have {MAX_LENGTH} characters, {value} has {len(text)} with what it refers to"
        )
    return Expr(text)


def _typed(bound: Binding, kind: Kind) -> Literal:
    """Return a parameter's value as one of another type that it fits."""
    if kind in _TEXTS:
        return bound.declaration.value
    if isinstance(bound.now, str):
        return parse_literal(kind, bound.now)
    if kind is Kind.BOOLEAN:
        return bool(bound.now)
    return int(bound.now) if kind.is_integer else float(bound.now)


def text_of(value: Literal) -> str:
    """Return a literal as a file has it."""
    if isinstance(value, bool):
        return "true" if value else "false"
    return format_double(value) if isinstance(value, float) else str(value)
