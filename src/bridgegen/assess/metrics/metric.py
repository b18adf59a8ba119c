"""The classes of metrics, and their checks of a rollout."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Literal, TypeVar

import numpy as np

from bridgegen.base.arrays import Float, Int, as_float
from bridgegen.simulation.boxes import as_steps
from bridgegen.simulation.rollout import Rollout

Derived = TypeVar("Derived")
Need = Literal["detections", "lights", "offset"]
"""What a rollout may lack: detections unless its ego perceives; traffic lights and the offset from
the route if it is a recording from elsewhere, not a simulator's."""


@dataclass(frozen=True)
class Quantity:
    """A number per scenario that measures its criticality.

    Attributes:
        name: as in Table I of the paper, or the field's abbreviation in small letters.
        unit: "m", "m/s" …; "count" for whole numbers.
        description: one line.
        sense: which values are more critical, "smaller" or "larger" ones.
        cap: the finite value that counts as "not critical at all"; in an objective every less
            critical value, for example +inf, counts as this. The quantity itself is not capped.
    """

    name: str
    unit: str
    description: str
    sense: Literal["smaller", "larger"]
    cap: float

    def __post_init__(self) -> None:
        if self.sense not in ("smaller", "larger"):
            raise ValueError(f"sense must be 'smaller' or 'larger', got {self.sense!r}")
        if not isfinite(self.cap):
            raise ValueError(f"cap [{self.unit}] of {self.name} must be finite, got {self.cap}")

    @property
    def sign(self) -> float:
        """+1 if larger values are more critical, −1 if smaller ones are."""
        return 1.0 if self.sense == "larger" else -1.0


@dataclass(frozen=True)
class Metric(Quantity):
    """A quantity that is a function of the rollout alone, in a file of its own.

    Attributes:
        compute: rollout → ``(N,)`` float64, NaN exactly where the scenario failed.
        needs: what a rollout must hold for the metric to exist; None if the motion is enough.
    """

    compute: Callable[[Rollout], Float]
    needs: Need | None = None


def shared(rollout: Rollout, derive: Callable[[Rollout], Derived]) -> Derived:
    """Return ``derive(rollout)``, computed once for all metrics."""
    if derive not in rollout.derived:
        rollout.derived[derive] = derive(rollout)
    derived: Derived = rollout.derived[derive]
    return derived


def recorded(rollout: Rollout, field: str) -> Float:
    """Return a state of the rollout, ``(N, E, T)``, fit for compiled code.

    Raises:
        ValueError: another shape, or not finite.
    """
    return as_float(f"rollout.{field}", getattr(rollout, field), rollout.shape)


def distance(rollout: Rollout) -> Float:
    """Return the distances ego to others, ``(N, E, T)`` [m]; +inf for the ego itself."""
    return as_float("rollout.distance [m]", rollout.distance, rollout.shape, finite=False)


def steps(rollout: Rollout) -> Int:
    """Return the number of real instants of every scenario, ``(N,)`` int64 in 1..T."""
    n, _, t = rollout.shape
    return as_steps(rollout.n_steps, n, t)


def in_steps(name: str, seconds: float, time_step: float) -> int:
    """Return the number of whole time steps in a duration.

    Raises:
        ValueError: the duration or the time step is not a positive number of seconds.
    """
    for what, value in ((name, seconds), ("time_step", time_step)):
        if not (isfinite(value) and value > 0.0):
            raise ValueError(f"{what} [s] must be finite and > 0, got {value}")
    # 0.5 s are ten steps of 0.05 s, despite rounding of the quotient.
    return int(np.floor(seconds / time_step + 1e-9))


def without_failed(rollout: Rollout, values: Float) -> Float:
    """Set the values of failed scenarios to NaN, in place, and return the array."""
    values[np.asarray(rollout.status) != 0] = np.nan
    return values
