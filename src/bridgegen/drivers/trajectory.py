"""Trajectories that a driver plans: what is accepted, and how the car follows them.

The rules are in `checked_plans`, the controller in ``_trajectory_kernels``.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import Observation, Trajectory

MOST_STATES = 1000
"""Largest number K of states of a trajectory."""

JUMP, TURN = 2.0, 1.0
"""Largest distance of a trajectory's start from the ego [m], and from its heading [rad]."""

ROUNDED, SLACK = 1.2, 0.5
"""Tolerances of the distance between two states, as planners round: a factor of what their greater
speed allows, and a distance [m]."""

STILL = 0.01
"""Size of a negative speed up to which it is rounding, and taken for 0 [m/s]."""

SAME_TIME = 1e-6  # s


@dataclass(frozen=True)
class Plans:
    """The trajectories of N scenarios, checked.

    Attributes:
        states: ``(N, 1 + K, 6)`` float64, see ``_trajectory_kernels``; first the ego's own state
            where the trajectory begins later, else the trajectory's first one, a second before.
            Stations are 0 until it is followed.
    """

    states: Float


def checked_plans(planned: Trajectory, seen: Observation, period: float) -> Plans:
    """Return the trajectories of N scenarios; those of scenarios that have ended stand.

    A trajectory begins between now and the next call, and lasts until the next call at least.

    Args:
        planned: the driver's answer.
        seen: what it was asked about.
        period: the time until it is asked again [s].

    Raises:
        InputError: another shape, more than `MOST_STATES` states, or a value that is not finite;
            times that do not increase, or that begin or end too early or too late; negative
            speeds; a trajectory that begins elsewhere, jumps, or goes backwards.
    """
    running = np.flatnonzero(seen.running)
    columns = _columns(planned, len(seen.x))[:, running]
    now = np.stack([array[running] for array in (seen.x, seen.y, seen.h, seen.v)])
    _refuse_values(columns)
    _refuse_times(columns[0], period)
    columns[4] = np.maximum(columns[4], 0.0)
    _refuse_motion(columns, now)
    states = np.zeros((len(seen.x), columns.shape[2] + 1, 6))
    states[:, :, 0] = np.arange(states.shape[1])
    states[:, :, 1:4] = np.stack([seen.x, seen.y, seen.h], axis=1)[:, np.newaxis]
    states[running, 1:, :5] = columns.transpose(1, 2, 0)
    late = columns[0, :, 0] > SAME_TIME
    states[running[late], 0, 1:5] = now.T[late]
    # All rows need the same number of states; a second before has no effect on what follows.
    states[running[~late], 0, :5] = states[running[~late], 1, :5] - (1.0, 0.0, 0.0, 0.0, 0.0)
    return Plans(states)


def _columns(planned: Trajectory, n: int) -> Float:
    """Return ``(5, N, K)`` time, x, y, h, v."""
    names = ("time", "x", "y", "h", "v")
    try:
        arrays = [np.asarray(getattr(planned, name), dtype=np.float64) for name in names]
    except (TypeError, ValueError) as error:
        raise InputError(f"a trajectory must consist of numbers: {error}") from None
    k = arrays[0].shape[-1] if arrays[0].ndim else 0
    if arrays[0].shape not in ((k,), (n, k)) or not 1 <= k <= MOST_STATES:
        raise InputError(
            f"a trajectory's time must have the shape (K,) or ({n}, K) with K in 1..{MOST_STATES}, "
            f"got {arrays[0].shape}"
        )
    for name, array in zip(names[1:], arrays[1:], strict=True):
        if array.shape != (n, k):
            raise InputError(
                f"a trajectory's {name} must have the shape ({n}, {k}), got {array.shape}"
            )
    arrays[0] = np.broadcast_to(arrays[0], (n, k))
    return np.stack(arrays)


def _refuse_values(columns: Float) -> None:
    units = ("time [s]", "x [m]", "y [m]", "h [rad]", "v [m/s]")
    for name, column in zip(units, columns, strict=True):
        if (at := _first(~np.isfinite(column))) is not None:
            raise InputError(
                f"a trajectory's {name} must be finite, got {column[at]} in state {at[1]}"
            )
    if (at := _first(columns[4] < -STILL)) is not None:
        raise InputError(
            f"a trajectory's speeds must be >= 0, reverse is not driven; got {columns[4][at]:.4g} "
            f"m/s at {columns[0][at]:.4g} s"
        )


def _refuse_times(time: Float, period: float) -> None:
    if (at := _first(np.diff(time) <= 0.0)) is not None:
        raise InputError(
            f"a trajectory's times must increase, got {time[at[0], at[1] + 1]:.6g} s after "
            f"{time[at]:.6g} s"
        )
    if (at := _first(time[:, :1] < -SAME_TIME)) is not None:
        raise InputError(
            f"a trajectory must not begin in the past, got a first time of {time[at]:.6g} s; times "
            "count from the call of act"
        )
    if (at := _first(time[:, :1] > period + SAME_TIME)) is not None:
        raise InputError(
            f"a trajectory must begin before the driver is asked again, {period:.6g} s from now, "
            f"got a first time of {time[at]:.6g} s; times count from the call of act"
        )
    if (at := _first(time[:, -1:] < period - SAME_TIME)) is not None:
        raise InputError(
            f"a trajectory must last until the driver is asked again, {period:.6g} s from now, got "
            f"a last time of {time[at[0], -1]:.6g} s"
        )


def _refuse_motion(columns: Float, now: Float) -> None:
    """Refuse jumps and what goes backwards.

    Args:
        columns: ``(5, N, K)``.
        now: ``(4, N)`` x, y, h, v of the egos.
    """
    time, x, y, h, v = columns
    # Not `elementary`: it runs in the driver's process, which must not wait for the compiler, and
    # what it decides are refusals.
    off = np.hypot(x[:, 0] - now[0], y[:, 0] - now[1])
    allowed = JUMP + ROUNDED * time[:, 0] * np.maximum(v[:, 0], now[3])
    if (at := _first(off > allowed)) is not None:
        raise InputError(
            f"a trajectory must begin at the ego, at most {allowed[at]:.2f} m from it, got a first "
            f"state {off[at]:.2f} m away"
        )
    turned = np.abs(_wrapped(h[:, 0] - now[2]))
    if (at := _first(turned > TURN)) is not None:
        raise InputError(
            f"a trajectory must begin in the ego's direction, at most {np.degrees(TURN):.0f}° off, "
            f"got a first heading {np.degrees(turned[at]):.0f}° off"
        )
    dx, dy = np.diff(x), np.diff(y)
    far = np.hypot(dx, dy)
    limit = ROUNDED * np.diff(time) * np.maximum(v[:, :-1], v[:, 1:]) + SLACK
    if (at := _first(far > limit)) is not None:
        raise InputError(
            f"a trajectory must not jump, got {far[at]:.2f} m from {time[at]:.4g} s to "
            f"{time[at[0], at[1] + 1]:.4g} s, where its speeds allow {limit[at]:.2f} m"
        )
    middle = h[:, :-1] + 0.5 * _wrapped(np.diff(h))
    along = dx * np.cos(middle) + dy * np.sin(middle)
    if (at := _first(along < -SLACK)) is not None:
        raise InputError(
            f"a trajectory must not go backwards, got {-along[at]:.2f} m against its heading from "
            f"{time[at]:.4g} s to {time[at[0], at[1] + 1]:.4g} s"
        )


def _wrapped(angle: Float) -> Float:
    wrapped: Float = angle - 2.0 * np.pi * np.round(angle / (2.0 * np.pi))
    return wrapped


def _first(bad: npt.NDArray[np.bool_]) -> tuple[int, ...] | None:
    """Return where an array is first true."""
    found = np.argwhere(bad)
    return tuple(found[0].tolist()) if len(found) else None


class Follower:
    """A car in each of N scenarios that follows the plan made for it.

    Args:
        plans: those of N scenarios.
        time_step: [s].
    """

    def __init__(self, plans: Plans, time_step: float) -> None:
        from bridgegen.drivers._trajectory_kernels import lay_rows  # numba is slow to import

        self._states, self._time_step = plans.states.copy(), time_step
        lay_rows(self._states)

    def demand(self, since: float, states: Float, running: Bool) -> tuple[Float, Float]:
        """Return what the cars demand: ``(N,)`` [m/s²] and ``(N,)`` [1/m], 0 where not running.

        Args:
            since: the time since the plans were made [s].
            states: ``(N, 4)`` float64, C-contiguous: x, y [m], heading [rad], speed [m/s].
            running: ``(N,)``.
        """
        from bridgegen.drivers._trajectory_kernels import follow_rows

        demanded, curvature = np.zeros(len(states)), np.zeros(len(states))
        follow_rows(self._states, since, self._time_step, states, running, demanded, curvature)
        return demanded, curvature
