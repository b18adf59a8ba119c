"""When somebody changes pace or sets off: ramps of the speed."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.events.scene import SLOPE, Scene
from bridgegen.recordings.events.steps import fit_steps
from bridgegen.recordings.readers.states import centre_ahead

LEAST_RATE = 0.3
"""Least acceleration or deceleration of a change of pace [m/s²]."""
WORST_FIT = 0.15
"""Largest root mean square of the residual speed, as a share of the change."""
LEAST_RMS = 0.6
"""Root mean square of the residual speed that is accepted for any change [m/s]: noise of
recordings."""
KNOWN = 0.5
"""Least time for which the speed before a change is recorded [s]."""
AFTER = 4.0
"""Time after an instant up to which a change that began before it is fitted [s]."""


@dataclass(frozen=True, eq=False)
class PaceChanges:
    """Changes of pace; NaN where there is none.

    Attributes:
        begin: ``(N,)`` instant.
        before: ``(N,)`` speed [m/s].
        after: ``(N,)`` [m/s].
        rate: ``(N,)`` [m/s²], > 0.
    """

    begin: Float
    before: Float
    after: Float
    rate: Float


def pace_changes(
    scene: Scene, who: Sequence[int], until: Sequence[float], least: float
) -> PaceChanges:
    """Return the greatest change of pace of participants that begins before some instants.

    Args:
        scene: the recording.
        who: N participants.
        until: N instants at which they are recorded.
        least: change of speed [m/s].
    """
    found = np.full((4, len(who)), np.nan)
    rows, runs = [], []
    for i, (p, instant) in enumerate(zip(who, until, strict=True)):
        run = _run(scene, p, instant)
        if run is not None:
            rows.append(i)
            runs.append(run)
    if not rows:
        return PaceChanges(*found)
    first, last, low, high = np.array(runs, np.int64).T
    duration = np.maximum((high - low) - 0.6 / scene.step, 0.2 / scene.step)
    guess = (0.5 * (low + high) - 0.5 * duration, duration)
    fit = fit_steps(scene.forward, first, last, guess, scene.step, "ramp")
    seconds = fit.duration * scene.step
    rate = np.abs(fit.height) / seconds
    is_one = (np.abs(fit.height) >= least) & (rate >= LEAST_RATE)
    is_one &= fit.begin >= first + KNOWN / scene.step
    is_one &= fit.rms <= np.maximum(WORST_FIT * np.abs(fit.height), LEAST_RMS)
    is_one &= fit.begin <= _states(scene, who, until)[rows]
    columns = (
        fit.begin + scene.clock.instant[first] - first,
        fit.level,
        fit.level + fit.height,
        rate,
    )
    found[:, rows] = np.where(is_one, np.array(columns), np.nan)
    return PaceChanges(*found)


def _states(scene: Scene, who: Sequence[int], until: Sequence[float]) -> Float:
    number = np.array(who, np.int64)
    first = (scene.traffic.first[number] - scene.clock.begin[number]).astype(np.float64)
    return np.array(until, np.float64) + first


def _run(scene: Scene, who: int, until: float) -> tuple[int, int, int, int] | None:
    """Return the first and last state to fit, and those between which the speed changes most."""
    first, end = int(scene.traffic.first[who]), int(scene.traffic.first[who + 1]) - 1
    at = min(max(int(until) - int(scene.clock.begin[who]) + first, first), end)
    last = min(at + round(AFTER / scene.step), end)
    slope = scene.acceleration[first : last + 1]
    most = first + int(np.abs(slope[: at - first + 1]).argmax())
    if abs(float(scene.acceleration[most])) < 0.5 * LEAST_RATE:
        return None
    same: Bool = slope * scene.acceleration[most] > 0.5 * scene.acceleration[most] ** 2
    other: Int = np.flatnonzero(~same)
    before, after = other[other < most - first], other[other > most - first]
    low = first + (int(before[-1]) + 1 if len(before) else 0)
    high = first + (int(after[0]) - 1 if len(after) else last - first)
    around = round(SLOPE / scene.step)
    return first, last, max(low - around // 2, first), min(high + around // 2, last)


# --- When somebody who stood sets off: a ramp of the speed ---


STANDS = 0.3
"""Distance moved within `STANDS_TIME` below which a participant stands [m]."""
STANDS_TIME = 1.0
"""Time for which a participant must have stood before it sets off [s]."""
STILL = 0.3
"""Largest speed before the ramp [m/s]."""
RAMP = 0.6
"""Duration of the speed ramp with which its fit begins [s]."""


def stands(scene: Scene, who: int, begin: int, end: int) -> bool:
    """Return whether a participant is recorded at two instants and has hardly moved between."""
    clock, traffic = scene.clock, scene.traffic
    if clock.begin[who] > begin or clock.end[who] < end:
        return False
    a, b = (k - int(clock.begin[who]) + int(traffic.first[who]) for k in (begin, end))
    return bool(np.hypot(traffic.x[b] - traffic.x[a], traffic.y[b] - traffic.y[a]) < STANDS)


def set_off_instants(scene: Scene, who: Sequence[int], until: Sequence[float]) -> Float:
    """Return when participants set off last before some instants, ``(N,)``; NaN if they do not.

    They have stood before for `STANDS_TIME`.

    Args:
        scene: the recording.
        who: N participants.
        until: N instants at which they are recorded.
    """
    traffic, clock = scene.traffic, scene.clock
    found = np.full(len(who), np.nan)
    rows, first, at, last = [], list[int](), list[int](), list[int]()
    for i, (p, instant) in enumerate(zip(who, until, strict=True)):
        begin = int(traffic.first[p])
        end = begin + int(instant) - int(clock.begin[p])
        state = _last_still(scene, begin, end)
        if state is not None:
            rows.append(i)
            first.append(begin)
            at.append(state)
            last.append(end)
    if not rows:
        return found
    low, ramp = np.array(first), RAMP / scene.step
    guess = (np.array(at) - 0.5 * ramp, np.full(len(at), ramp))
    fit = fit_steps(scene.forward, low, np.array(last), guess, scene.step, "ramp")
    is_one = (np.abs(fit.level) <= STILL) & (fit.height > STILL) & (fit.begin >= low)
    of_clock = clock.instant[low] - low
    found[rows] = np.where(is_one, fit.begin + of_clock, np.nan)
    return found


def _last_still(scene: Scene, first: int, last: int) -> int | None:
    """Return the last state until which somebody has stood, but not that at the end."""
    steps = max(round(STANDS_TIME / scene.step), 1)
    x, y = (array[first : last + 1] for array in (scene.traffic.x, scene.traffic.y))
    still = np.flatnonzero(np.hypot(x[steps:] - x[:-steps], y[steps:] - y[:-steps]) < STANDS)
    if not len(still) or first + int(still[-1]) + steps >= last:
        return None
    return first + int(still[-1]) + steps


def apart(scene: Scene, number: int, other: int, instant: float) -> float:
    """Return the straight distance of two reference points [m]; NaN if one is not recorded."""
    points = []
    for who in (number, other):
        at = np.array([instant])
        ahead = centre_ahead(int(scene.traffic.kind[who]), float(scene.traffic.length[who]))
        x, y, c, s = (float(scene.at(values, np.array([who]), at)[0]) for values in _pose(scene))
        points.append((x - ahead * c, y - ahead * s))
    (x, y), (u, v) = points
    return float(np.hypot(u - x, v - y))


def _pose(scene: Scene) -> tuple[Float, Float, Float, Float]:
    traffic = scene.traffic
    return traffic.x, traffic.y, scene.cosine, scene.sine
