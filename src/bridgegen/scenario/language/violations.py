"""Does a row keep every range, bound and formula? Asked of the row alone, not of the decoder."""

from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.scenario.language.constraints import Constraints
from bridgegen.scenario.language.expression import Expression
from bridgegen.scenario.language.kinds import slack


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
    units = {one.name: one.unit for one in constraints.parameters.values()}
    units |= {one.name: one.unit for one in constraints.derived}

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
    return sorted(found, key=lambda one: one.row)


def _column(expression: Expression, table: Mapping[str, Float], like: Float) -> Float:
    return np.broadcast_to(expression.evaluate(table), like.shape)
