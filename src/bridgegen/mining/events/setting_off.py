"""When somebody who stood sets off: a ramp of the speed."""

import numpy as np

from bridgegen.arrays import Float
from bridgegen.mining.events.scene import Scene
from bridgegen.mining.events.steps import fit_steps
from bridgegen.recordings.bodies import centre_ahead

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


def sets_off(scene: Scene, who: int, until: float) -> float:
    """Return the instant at which a participant sets off last before another; NaN if it does not.

    It has stood before for `STANDS_TIME`.
    """
    clock, traffic = scene.clock, scene.traffic
    first = int(traffic.first[who])
    last = first + int(until) - int(clock.begin[who])
    steps = max(round(STANDS_TIME / scene.step), 1)
    if last - first <= steps:
        return float("nan")
    x, y = traffic.x[first : last + 1], traffic.y[first : last + 1]
    still = np.flatnonzero(np.hypot(x[steps:] - x[:-steps], y[steps:] - y[:-steps]) < STANDS)
    if not len(still) or still[-1] + steps >= last - first:
        return float("nan")
    at = first + int(still[-1]) + steps
    heading = traffic.heading[first : last + 1]
    speed = traffic.vx[first : last + 1] * np.cos(heading)
    speed += traffic.vy[first : last + 1] * np.sin(heading)
    fit = fit_steps(
        speed, np.zeros(1, np.int64), np.array([last - first]),
        (np.array([float(at - first) - 0.5 * RAMP / scene.step]), np.array([RAMP / scene.step])),
        scene.step, "ramp",
    )  # fmt: skip
    if abs(fit.level[0]) > STILL or fit.height[0] <= STILL or fit.begin[0] < 0.0:
        return float("nan")
    return float(fit.begin[0]) + int(clock.begin[who])


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
