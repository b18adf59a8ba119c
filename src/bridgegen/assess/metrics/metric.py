"""The classes of metrics, and their checks of a rollout."""

from collections.abc import Callable
from dataclasses import dataclass
from math import isfinite
from typing import Literal, TypeVar

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int, as_float
from bridgegen.simulation.boxes import as_steps
from bridgegen.simulation.rollout import Rollout

Derived = TypeVar("Derived")
Need = Literal["detections", "lights", "offset"]
"""Data that a rollout may lack: detections unless its ego perceives; traffic lights and the offset
from the route if it is a recording from elsewhere, not a simulator's."""


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


# --- Shared by the metrics beyond Table I: every body's position and direction, computed once ---


@dataclass(frozen=True)
class Motion:
    """A rollout's bodies for compiled code; instants from ``n_steps`` on are unset.

    Attributes:
        half: ``(E, 2)`` float64 [m], half lengths and half widths.
        x, y: ``(N, E, T)`` float64 [m], the boxes' centres.
        cosine, sine: ``(N, E, T)`` float64, of the direction in which each body drives: that of
            its heading, the opposite one where it reverses. Its box is the same either way.
        v: ``(N, E, T)`` float64 [m/s], ≥ 0, in that direction.
        a: ``(N, E, T)`` float64 [m/s²], likewise.
        reverses: ``(N, E, T)`` bool, see ``_kernels.turn_round``; None where no speed is < 0.
        distance: ``(N, E, T)`` float64 [m], from the ego's box; +inf where absent.
        n_steps: ``(N,)`` int64.
    """

    half: Float
    x: Float
    y: Float
    cosine: Float
    sine: Float
    v: Float
    a: Float
    reverses: Bool | None
    distance: Float
    n_steps: Int


def motion(rollout: Rollout) -> Motion:
    """Return a rollout's bodies, computed once for all metrics."""
    return shared(rollout, _motion)


def _motion(rollout: Rollout) -> Motion:
    from bridgegen.assess.metrics import _kernels as _motion_kernels

    box = as_float("rollout.box [m]", rollout.box, (rollout.shape[1], 3))
    x, y, v = (recorded(rollout, field) for field in ("x", "y", "v"))
    n_steps, (cosine, sine) = steps(rollout), rollout.direction
    centre_x, centre_y = np.empty(rollout.shape), np.empty(rollout.shape)
    _motion_kernels.place(box, x, y, cosine, sine, n_steps, centre_x, centre_y)
    a, reverses = recorded(rollout, "a"), None
    if v.size and v.min() < 0.0:
        reverses = np.empty(v.shape, np.bool_)
        cosine, sine, v, a = (array.copy() for array in (cosine, sine, v, a))
        _motion_kernels.turn_rows_round(cosine, sine, v, a, reverses)
    half = 0.5 * box[:, :2]
    return Motion(
        half, centre_x, centre_y, cosine, sine, v, a, reverses, distance(rollout), n_steps
    )
