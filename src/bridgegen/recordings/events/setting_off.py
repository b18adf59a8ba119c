"""When somebody who stood sets off: a ramp of the speed."""

from collections.abc import Sequence

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.steps import fit_steps
from bridgegen.recordings.readers.bodies import centre_ahead

STANDS = 0.3
"""It has moved by less than this [m] within `STANDS_TIME`."""
STANDS_TIME = 1.0
"""[s]."""
STILL = 0.3
"""Speed before the ramp at most [m/s]."""
RAMP = 0.6
"""First guess [s]."""


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
    x, y = (one[first : last + 1] for one in (scene.traffic.x, scene.traffic.y))
    still = np.flatnonzero(np.hypot(x[steps:] - x[:-steps], y[steps:] - y[:-steps]) < STANDS)
    if not len(still) or first + int(still[-1]) + steps >= last:
        return None
    return first + int(still[-1]) + steps


def apart(scene: Scene, one: int, other: int, instant: float) -> float:
    """Return the straight distance of two reference points [m]; NaN if one is not recorded."""
    points = []
    for who in (one, other):
        at = np.array([instant])
        ahead = centre_ahead(int(scene.traffic.kind[who]), float(scene.traffic.length[who]))
        x, y, c, s = (
            float(scene.at(values, np.array([who]), at)[0]) for values in _pose(scene)
        )  # fmt: skip
        points.append((x - ahead * c, y - ahead * s))
    (x, y), (u, v) = points
    return float(np.hypot(u - x, v - y))


def _pose(scene: Scene) -> tuple[Float, Float, Float, Float]:
    traffic = scene.traffic
    return traffic.x, traffic.y, scene.cosine, scene.sine
