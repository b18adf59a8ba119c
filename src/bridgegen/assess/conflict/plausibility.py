"""Plausibility of a rollout's traffic: the first motion in it that bodies cannot do."""

from dataclasses import dataclass
from enum import IntEnum
from math import inf, isfinite

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.analysis import encounters
from bridgegen.assess.metrics.metric import distance, recorded, steps
from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.physics import GRAVITY
from bridgegen.drivers.kinds import OTHER
from bridgegen.scenario.participants import OBJECT_CLASSES
from bridgegen.simulation.rollout import Rollout

SLIP = float(elementary.tan(np.radians(10.0)))
"""Largest motion across a wheeled body, as a share of its speed: tyres slide beyond 10° of slip.
Source: lateral force of tyres peaks at slip angles of 4° to 10°: Wong, Theory of Ground Vehicles
(4th edition, 2008), 1.4."""

WINDOW = 0.25
"""Time over which changes of speed and heading are judged [s].

Brakes of cars take 0.2 s to 0.4 s to build up: Breuer and Bill, Bremsenhandbuch (2017). So a change
that is done within less, as scripts do, differs little from one that a body can do."""

AFTER = 1.0
"""Time after a near miss in which motion still belongs to it, as its outcome [s]. Ours."""

LIMITS: Float = np.array(
    [
        (
            object_class.limits.acceleration,
            object_class.limits.deceleration,
            object_class.limits.curvature,
            object_class.limits.lateral_g * GRAVITY,
            inf if object_class.limits.slides else SLIP,
            object_class.limits.is_prop,
        )
        for object_class in OBJECT_CLASSES
    ]
)
LIMITS.setflags(write=False)
"""What bodies can do at most, by kind; generous, since a row that exceeds it is left out.

Columns: acceleration and deceleration [m/s²]; curvature of the path of the rear axle [1/m]; lateral
acceleration [m/s²]; motion across the body as a share of speed; 1 for props, which may touch.

Sources: cars: 0 to 100 km/h in 3.5 s (sports cars) is 8 m/s²; 100 km/h to 0 in 35 m (the best of
road tests) is 11 m/s²; a turning circle of 9 m between kerbs (small cars) leaves the rear axle a
radius of 3.1 m. Trucks and buses: EU 2015/68 and UN R13 ask for 5 m/s² at least, 8 m/s² is the
grip of truck tyres on a dry road (Wong, table 1.3); a turning circle of 17 m (city bus) leaves the
rear axle 5 m; laden, they roll over from 0.35 g to 0.5 g (Winkler, UMTRI, Rollover of heavy
commercial vehicles, 2000). Motorcycles: limited by the tyres, as cars. Bicycles: pitch over from
0.6 g to 0.7 g (Wilson, Bicycling Science, 3rd edition, 2004, chapter 7). Pedestrians: sprinters
accelerate at 8 m/s² at most over their first steps (Mero, Komi and Gregor, Sports Medicine 13
(1992) 376-392). Animals: cheetahs at 13 m/s² (Wilson et al., Nature 498 (2013) 185-189).
"""


class Implausible(IntEnum):
    """Reasons why the traffic of a row is implausible."""

    NONE = 0
    OTHERS_COLLIDE = 1
    BODIES_OVERLAP_AT_START = 2
    SIDEWAYS_MOTION = 3
    ACCELERATION = 4
    DECELERATION = 5
    CURVATURE = 6
    LATERAL_ACCELERATION = 7
    JUMP = 8

    @property
    def label(self) -> str:
        """The reason in a few words, "" for none."""
        return _LABELS[self]


_LABELS = {
    Implausible.NONE: "",
    Implausible.OTHERS_COLLIDE: "participants other than the ego collide",
    Implausible.BODIES_OVERLAP_AT_START: "bodies overlap where they start",
    Implausible.SIDEWAYS_MOTION: "sideways motion of a wheeled body",
    Implausible.ACCELERATION: "acceleration beyond the body's",
    Implausible.DECELERATION: "deceleration beyond the body's",
    Implausible.CURVATURE: "turn beyond the steering",
    Implausible.LATERAL_ACCELERATION: "turn beyond the tyres' grip",
    Implausible.JUMP: "jump",
}

_MOTION = {
    Implausible.SIDEWAYS_MOTION: "slides sideways at {value:.2f} m/s",
    Implausible.ACCELERATION: "accelerates at {value:.1f} m/s²",
    Implausible.DECELERATION: "brakes at {value:.1f} m/s²",
    Implausible.CURVATURE: "turns with a radius of {value:.1f} m",
    Implausible.LATERAL_ACCELERATION: "turns with a lateral acceleration of {value:.1f} m/s²",
    Implausible.JUMP: "jumps by {value:.2f} m",
}

_MOST = {
    Implausible.SIDEWAYS_MOTION: "at most {limit:.2f} m/s",
    Implausible.ACCELERATION: "at most {limit:.1f} m/s²",
    Implausible.DECELERATION: "at most {limit:.1f} m/s²",
    Implausible.CURVATURE: "at least {limit:.1f} m",
    Implausible.LATERAL_ACCELERATION: "at most {limit:.1f} m/s²",
    Implausible.JUMP: "at most {limit:.2f} m by its speed",
}


@dataclass(frozen=True)
class Plausibility:
    """The first implausible motion in each of N rows.

    Attributes:
        names: of the participants.
        time_step: [s].
        code: ``(N,)`` int8, an `Implausible`; 0: the traffic could happen, or the row failed.
        instant: ``(N,)`` int64, when; -1 where the code is 0, and so are the next two.
        entity: ``(N,)`` int64, the participant; of two the lower number.
        other: ``(N,)`` int64, the second of two; -1 if only one is involved.
        value: ``(N,)`` float64: depth of the overlap [m], speed across the body [m/s],
            acceleration [m/s²], curvature [1/m] (inf: on the spot), or jump [m], by the code;
            NaN where it is 0.
        limit: ``(N,)`` float64, the most that is possible, in the same unit; likewise.
    """

    names: tuple[str, ...]
    time_step: float
    code: npt.NDArray[np.int8]
    instant: Int
    entity: Int
    other: Int
    value: Float
    limit: Float

    @property
    def labels(self) -> list[str]:
        """The `Implausible.label` of each of N rows."""
        labels = [implausible.label for implausible in Implausible]
        return [labels[code] for code in self.code.tolist()]

    def reason(self, row: int) -> str:
        """Return in one sentence why a row is implausible; "" if it is plausible."""
        code = Implausible(int(self.code[row]))
        if code is Implausible.NONE:
            return ""
        name, when = self.names[self.entity[row]], f"{self.instant[row] * self.time_step:.2f} s"
        value, limit = float(self.value[row]), float(self.limit[row])
        if self.other[row] >= 0:
            other = self.names[self.other[row]]
            if code is Implausible.OTHERS_COLLIDE:
                return f"{name} and {other} collide at {when}"
            return f"{name} and {other} overlap by {value:.2f} m where they start, at {when}"
        if code is Implausible.CURVATURE:
            if not isfinite(value):
                return f"{name} turns on the spot at {when}"
            value, limit = 1.0 / value, 1.0 / limit
        does, most = _MOTION[code].format(value=value), _MOST[code].format(limit=limit)
        return f"{name} {does} at {when}; {most} is possible"


def _last_conflict(rollout: Rollout) -> Int:
    """Return the instant up to which each row's motion belongs to its conflicts, ``(N,)``."""
    from bridgegen.assess.conflict import _plausibility_kernels

    found, last = encounters(rollout), np.empty(rollout.shape[0], np.int64)
    kind, instant = (np.ascontiguousarray(a, np.int64) for a in (found.kind, found.instant))
    after = round(AFTER / rollout.time_step)
    _plausibility_kernels.last_conflicts(kind, instant, after, rollout.shape[2], last)
    return last


def window_of(rollout: Rollout) -> int:
    """Return `WINDOW` in time steps."""
    return max(1, round(WINDOW / rollout.time_step))


def towed_by_of(rollout: Rollout) -> Int:
    """Return who tows each participant, ``(E,)``; -1: no one."""
    return rollout.towed_by if len(rollout.towed_by) else np.full(rollout.shape[1], -1, np.int64)


def limits_of(rollout: Rollout) -> Float:
    """Return the `LIMITS` of each participant, ``(E, 6)``."""
    is_known = len(rollout.kinds) > 0
    limits: Float = LIMITS[rollout.kinds if is_known else np.full(rollout.shape[1], OTHER)]
    if not is_known:
        limits[:, -1] = 0.0  # they are no props
    return limits


def plausibility(rollout: Rollout) -> Plausibility:
    """Return the first implausible motion in each row.

    Participants other than the ego are judged up to the ego's first contact, or up to ``AFTER`` its
    last near miss (its last collision course, if there is no near miss): later events do not
    matter. They must not collide with each other, and must move within the limits of their kind,
    see `LIMITS`. No two bodies, the ego's included, may overlap where they start or appear. Of two
    that never move only the start counts, and props (cones, barriers, signs) may overlap, as the
    parts of a barrier do. A rollout without kinds is judged by overlaps and jumps alone.

    Of further vehicles that the ego's driver drives only the start counts, as of the ego; and the
    first contact is that of any of them.

    Args:
        rollout: N scenarios.

    Raises:
        ValueError: a state is malformed.
    """
    from bridgegen.assess.conflict import _plausibility_kernels

    n = rollout.shape[0]
    until = np.minimum(steps(rollout) - 1, _last_conflict(rollout))
    cosine, sine = rollout.direction
    apart, present = distance(rollout), rollout.present
    if rollout.egos:
        apart = np.minimum.reduce([apart, *(distance(view) for view in rollout.egos)])
        present = present.copy() if present.size else np.ones(rollout.shape, np.bool_)
        present[:, [rollout.names.index(view.names[0]) for view in rollout.egos], 1:] = False
    code = np.empty(n, np.int8)
    instant, entity, other = (np.empty(n, np.int64) for _ in range(3))
    value, limit = np.empty(n), np.empty(n)
    _plausibility_kernels.judge(
        rollout.box, limits_of(rollout), *(recorded(rollout, name) for name in "xyhv"), cosine,
        sine, apart, np.ascontiguousarray(present),
        towed_by_of(rollout), until + 1, np.asarray(rollout.status) != 0, rollout.time_step,
        window_of(rollout), code, instant, entity, other, value, limit,
    )  # fmt: skip
    return Plausibility(
        rollout.names, rollout.time_step, code, instant, entity, other, value, limit
    )
