"""What stands in the way of a bicycle."""

from dataclasses import dataclass

import numpy as np

from bridgegen.recordings.events.event import ABSENT
from bridgegen.recordings.events.pace import STANDS_TIME, apart, stands
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.lanes.placing import WALKS

FARTHEST = 50.0
"""Largest distance of an obstacle ahead [m]."""
CLEAR = 0.5
"""Lateral clearance below which an obstacle is in the way [m]."""
BEFORE = 4.0
"""Distance before an instant at which the course is taken [m], which a move that begins does not
bend."""


@dataclass(frozen=True)
class Obstacle:
    """The nearest vehicle that stands in the way.

    Attributes:
        who: participant; `ABSENT` for none.
        gap: to its nearest end along the course [m]; NaN for none.
        apart: between the reference points [m]; NaN for none.
    """

    who: int = ABSENT
    gap: float = np.nan
    apart: float = np.nan


def obstacle_ahead(scene: Scene, other: int, instant: float) -> Obstacle:
    """Return the nearest standing obstacle ahead of a participant at an instant."""
    clock, traffic = scene.clock, scene.traffic
    k = round(instant)
    there = (clock.begin <= k) & (clock.end >= k) & ~np.isin(traffic.kind, WALKS)
    there[other] = False
    who = np.flatnonzero(there)
    at = traffic.first[who] + k - clock.begin[who]
    here = int(traffic.first[other] + k - clock.begin[other])
    course = scene.paths.course(other, max(scene.paths.length(other, instant) - BEFORE, 0.0))
    c, s = np.cos(course), np.sin(course)
    dx, dy = traffic.x[at] - traffic.x[here], traffic.y[at] - traffic.y[here]
    along, aside = dx * c + dy * s, np.abs(dy * c - dx * s)
    turned = traffic.heading[at] - course
    half_length, half_width = 0.5 * traffic.length[who], 0.5 * traffic.width[who]
    reach = half_length * np.abs(np.cos(turned)) + half_width * np.abs(np.sin(turned))
    beside = half_length * np.abs(np.sin(turned)) + half_width * np.abs(np.cos(turned))
    gap = along - reach - 0.5 * traffic.length[other]
    near = (gap > 0.0) & (gap <= FARTHEST)
    near &= aside < beside + 0.5 * traffic.width[other] + CLEAR
    steps = max(round(STANDS_TIME / scene.step), 1)
    for i in np.flatnonzero(near)[np.argsort(gap[near], kind="stable")].tolist():
        number = int(who[i])
        begin = max(k - steps, int(clock.begin[number]))
        if stands(scene, number, begin, min(begin + steps, int(clock.end[number]))):
            return Obstacle(number, float(gap[i]), apart(scene, other, number, float(instant)))
    return Obstacle()
