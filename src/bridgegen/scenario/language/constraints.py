"""What limits parameters: the graph of constraints, and whether a row keeps all of them."""

from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass
from graphlib import CycleError, TopologicalSorter

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.scenario.language.expression import Expression
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter, at, nearest


@dataclass(frozen=True)
class Constraints:
    """What a search space is made of, and what its rows must keep.

    Attributes:
        parameters: what may vary, by name.
        bounds: what limits it.
        derived: what follows from it.
        axes: searched by default.
    """

    parameters: Mapping[str, Parameter]
    bounds: tuple[Bound, ...]
    derived: tuple[Derived, ...]
    axes: tuple[Axis, ...]


def problems_of(
    parameters: Iterable[Parameter],
    bounds: Sequence[Bound],
    derived: Sequence[Derived],
    also: Iterable[str] = (),
) -> list[str]:
    """Return what is wrong with the constraints as a whole; nothing if they can be computed.

    That is: a name declared twice, a formula or a bound that names nothing, a bound on a derived
    quantity, a cycle.

    Args:
        parameters: what may vary.
        bounds: what limits it.
        derived: what follows from it.
        also: names that are declared, but wrongly: no reason to call them unknown.
    """
    problems: list[str] = []
    declared: dict[str, Parameter | Derived] = {}
    ones: list[Parameter | Derived] = [*parameters, *derived]
    for parameter in ones:
        if parameter.name in declared:
            first = at(declared[parameter.name].place)
            problems.append(
                f"'{parameter.name}' is declared twice{at(parameter.place)}, first{first}"
            )
        declared.setdefault(parameter.name, parameter)
    known = [*declared, *also]
    for bound in bounds:
        target = declared.get(bound.target)
        if bound.target not in known:
            problems.append(
                f"the bound '{bound}' limits the unknown parameter '{bound.target}'"
                f"{nearest(bound.target, known)}{at(bound.place)}"
            )
        elif isinstance(target, Derived):
            problems.append(
                f"the bound '{bound}' limits '{bound.target}', which follows from "
                f"'{target}': limit what it follows from{at(bound.place)}"
            )
        elif isinstance(target, Parameter) and target.kind.names:
            problems.append(
                f"the bound '{bound}' limits '{bound.target}', a category: its values have no "
                f"order{at(bound.place)}"
            )
    rules: list[Bound | Derived] = [*bounds, *derived]
    for rule in rules:
        problems += [
            f"unknown name '{name}' in '{rule}'{nearest(name, known)}{at(rule.place)}"
            for name in sorted(rule.names - set(known))
        ]
    cycle = _cycle(known, bounds, derived)
    if cycle:
        places = {b.place for b in bounds if b.target in cycle and b.names & set(cycle)}
        places |= {d.place for d in derived if d.name in cycle and d.names & set(cycle)}
        problems.append(
            f"constraints must not form a cycle, got {' → '.join(cycle)} "
            f"(each limits the next){at('; '.join(sorted(places - {''})))}"
        )
    return problems


def order(
    names: Sequence[str], bounds: Sequence[Bound], derived: Sequence[Derived]
) -> tuple[str, ...]:
    """Return ``names`` so that each comes after all that limit it.

    Raises:
        CycleError: there is no such order (``problems_of`` names the cycle).
    """
    return tuple(_graph(names, bounds, derived).static_order())


def _graph(
    names: Sequence[str], bounds: Sequence[Bound], derived: Sequence[Derived]
) -> TopologicalSorter[str]:
    graph: TopologicalSorter[str] = TopologicalSorter(dict.fromkeys(names, ()))
    for bound in bounds:
        graph.add(bound.target, *sorted(bound.names))
    for item in derived:
        graph.add(item.name, *sorted(item.names))
    return graph


def _cycle(
    names: Sequence[str], bounds: Sequence[Bound], derived: Sequence[Derived]
) -> tuple[str, ...]:
    try:
        _graph(names, bounds, derived).prepare()
    except CycleError as error:
        return tuple(error.args[1])
    return ()


# --- Does a row keep every range, bound and formula? Asked of the row alone, not of the decoder ---


@dataclass(frozen=True)
class Violation:
    """A value of a row that breaks a rule.

    Attributes:
        row: which row of X.
        parameter: which column.
        value: what it holds.
        reason: the rule with its value there, the parameter with its unit, the value, and why.
    """

    row: int
    parameter: str
    value: float
    reason: str


def violations(constraints: Constraints, table: Mapping[str, Float]) -> list[Violation]:
    """Return all that is wrong with the rows, by row; nothing if they are feasible.

    Args:
        constraints: the rules: parameters' ranges, bounds and formulas.
        table: ``(N,)`` for each parameter and derived quantity; NaN and inf break every rule.
    """
    found: list[Violation] = []
    units = {item.name: item.unit for item in constraints.parameters.values()}
    units |= {item.name: item.unit for item in constraints.derived}

    def report(name: str, kept: Bool, rule: str, limit: Float | None = None, why: str = "") -> None:
        for row in np.flatnonzero(~kept).tolist():
            value = float(table[name][row])
            side = "" if limit is None else f" (= {float(limit[row]):.6g})"
            reason = f"{rule}{side} must hold for {name} [{units[name]}], got {value:.6g}{why}"
            found.append(Violation(row, name, value, reason))

    with np.errstate(invalid="ignore"):  # comparing with NaN is false, which is what is wanted
        for name, parameter in constraints.parameters.items():
            value, low, high = table[name], parameter.low, parameter.high
            inside = (value >= low - slack(low)) & (value <= high + slack(high))
            report(name, inside, parameter.kind.rule(name, low, high))
            if of_kind := parameter.kind.kept(value):
                report(name, *of_kind)
        for bound in constraints.bounds:
            name, why = bound.target, f": {bound.why} (source: {bound.source})"
            value = table[name]
            if bound.lo is not None:
                limit = _column(bound.lo, table, value)
                report(name, value >= limit - slack(limit), f"{name} >= {bound.lo}", limit, why)
            if bound.hi is not None:
                limit = _column(bound.hi, table, value)
                report(name, value <= limit + slack(limit), f"{name} <= {bound.hi}", limit, why)
        for derived in constraints.derived:
            name, why = derived.name, f": {derived.why} (source: {derived.source})"
            limit = _column(derived.value, table, table[name])
            kept = np.abs(table[name] - limit) <= slack(limit)
            report(name, kept, str(derived), limit, why)
    return sorted(found, key=lambda violation: violation.row)


def _column(expression: Expression, table: Mapping[str, Float], like: Float) -> Float:
    return np.broadcast_to(expression.evaluate(table), like.shape)
