"""Numerical error of findings, from their results at fractions of the time step.

The errors are those at the scenario's own step. Sources: L. F. Richardson, Phil. Trans. R. Soc. A
210 (1911); P. J. Roache, Verification and Validation in Computational Science and Engineering
(1998), chapter 5 (grid convergence index, "GCI").
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations

from bridgegen.search.triage.record import AtStep, StepCheck

STEPS = (1, 2, 4, 8)
"""Fractions of the time step that a series has, the scenario's own first."""

QUANTITIES = {"time": "s", "place": "m", "speed": "m/s", "harm": "1", "severity": "1"}
"""Quantities whose error is stated, with their units; the first three are of the conflict."""

SAFETY = 1.25
"""Factor of the spread of four results in the error that is stated. Ours, as Roache's for an order
that is observed; docs/credibility.md has how often it holds."""

OF_CONFLICT = ("time", "place", "speed")

ORDERS = (0.5, 2.0)
"""Observed orders that are believed; the scheme promises the first order."""


@dataclass(frozen=True)
class Convergence:
    """What a series of four results says of the error of the first.

    Attributes:
        error: |q(dt) − q(dt/8)|.
        order: observed at dt/2, dt/4 and dt/8; None where these do not converge monotonically.
        extrapolated: |q(dt) − q*|, q* being Richardson's extrapolation to a step of 0 from the two
            finest results, by the observed order where it is believed, else by the first order.
        gci: the same times Roache's factor of safety: 1.25 with an observed order, else 3.
        stated: `SAFETY` times the widest difference of two of the results; and what the finest
            step resolves, since a conflict is at an instant.
    """

    error: float
    order: float | None
    extrapolated: float
    gci: float
    stated: float

    @classmethod
    def of(cls, q: Sequence[complex], finest: float = 0.0) -> "Convergence":
        """Return that of ``q(dt), q(dt/2), q(dt/4), q(dt/8)``; of places as complex numbers.

        Args:
            q: the four results.
            finest: what the finest step resolves of them.
        """
        before, last = q[1] - q[2], q[2] - q[3]
        on = (before * last.conjugate()).real > 0.0
        order = math.log2(abs(before) / abs(last)) if on else None
        believed = order is not None and ORDERS[0] <= order <= ORDERS[1]
        power = order if order is not None and believed else 1.0
        extrapolated = abs(q[0] - (q[3] - last / (2.0**power - 1.0)))
        spread = max(abs(a - b) for a, b in combinations(q, 2))
        return cls(
            abs(q[0] - q[3]), order, extrapolated, extrapolated * (1.25 if believed else 3),
            SAFETY * spread + finest,
        )  # fmt: skip


def series(check: StepCheck, quantity: str) -> list[complex] | None:
    """Return a quantity at each of `STEPS`; None where it has no value at one of them.

    What is of a conflict has one only where that is of the same kind at all of them.
    """
    at = {one.steps: one for one in check.at}
    some = [at[steps] for steps in STEPS if steps in at and at[steps].ok]
    kinds = {one.conflict for one in some}
    if len(some) < len(STEPS) or (quantity in OF_CONFLICT and (len(kinds) > 1 or kinds == {""})):
        return None
    found = [getattr(one, quantity) for one in some]
    if None in found:
        return None
    return [complex(*q) for q in found] if quantity == "place" else found


def finest(check: StepCheck, quantity: str) -> float:
    """Return what the finest step resolves of a quantity: of a time the step, of a place its way.

    A conflict is at an instant, so that series of equal times say nothing below the finest step.
    """
    speed = check.at[0].speed or 0.0
    return check.time_step / STEPS[-1] * {"time": 1.0, "place": speed}.get(quantity, 0.0)


def state(one: AtStep) -> tuple[bool, bool, str]:
    """Return what must be the same at each step: result, verdict, and kind of a failure."""
    return one.ok, one.harmful, one.conflict if one.harmful else ""
