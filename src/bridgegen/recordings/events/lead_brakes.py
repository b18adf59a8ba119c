"""The ego's leader brakes: a ramp of its speed."""

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.events.changes import LaneChanges
from bridgegen.recordings.events.event import ABSENT, NOT_WHOLE, OVERLAP, Events, events_of
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.steps import MARGIN, fit_steps
from bridgegen.recordings.lanes.model import NONE
from bridgegen.recordings.readers.states import usual

ONSET = 1.0
"""Deceleration over 2 s from which on the leader may brake [m/s²]."""
LEAST_DECELERATION = 2.0
"""Least mean deceleration of the leader's braking [m/s²]."""
LEAST_DROP = 2.0
"""Least decrease of the leader's speed [m/s]."""
CUT = 0.5
"""Duration of the braking that may lie outside of what is recorded [s]."""


def find(scene: Scene, changes: LaneChanges) -> Events:
    """Return the events in which a leader brakes."""
    first, last = _runs(scene)
    step, who = scene.step, scene.participant[first]
    begin_of, end_of = scene.traffic.first[who], scene.traffic.first[who + 1] - 1
    duration = np.maximum((last - first) - 0.6 / step, 0.2 / step)
    middle = 0.5 * (first + last)
    # From the end of the braking before to the beginning of the next one.
    same = who[1:] == who[:-1]
    low, high = begin_of.copy(), end_of.copy()
    low[1:] = np.where(same, np.minimum(last[:-1] + round(MARGIN / step), first[1:]), low[1:])
    high[:-1] = np.where(same, np.maximum(first[1:] - round(MARGIN / step), last[:-1]), high[:-1])
    fit = fit_steps(
        scene.traffic.speed, low, high, (middle - 0.5 * duration, duration), step, "ramp"
    )
    instant = (scene.clock.instant[first] - first).astype(np.float64)
    begin = np.maximum(fit.begin, low) + instant
    end = np.minimum(fit.begin + fit.duration, high) + instant
    rate = -fit.height / (fit.duration * step)
    brakes = (rate >= LEAST_DECELERATION) & (-fit.height >= LEAST_DROP)
    state = scene.state(who, begin)
    state = np.where(state == NONE, first, state)
    behind = scene.follower[state]
    ego = np.where(behind >= 0, scene.participant[behind], ABSENT)
    picked = np.flatnonzero(brakes & (behind >= 0) & scene.is_ego[ego])
    ego, lead, begin, end = ego[picked], who[picked], begin[picked], end[picked]
    state = state[picked]
    ahead = scene.ahead.state[state]
    after = np.where(ahead >= 0, scene.ahead.state[ahead], NONE)
    gap = scene.gap(ego, lead, begin)
    speed = scene.at(scene.speed, ego, begin)
    least, stays = _together(scene, ego, lead, begin, end)
    hardest = np.array(
        [usual(kind).seen_as.limits.deceleration for kind in scene.traffic.kind.tolist()]
    )
    cut = CUT / step
    whole = (fit.begin >= low - cut) & (fit.begin + fit.duration <= high + cut)
    return events_of(
        "lead-brakes",
        ego,
        {"lead": lead, "next": np.where(ahead >= 0, scene.participant[ahead], ABSENT)},
        (scene.seconds(begin), scene.seconds(end)),
        {
            "ego_speed": speed,
            "lead_speed": fit.level[picked],
            "relative_speed": speed - fit.level[picked],
            "gap": gap,
            "deceleration": rate[picked],
            "low_speed": np.maximum((fit.level + fit.height)[picked], 0.0),
            "next_speed": np.where(ahead >= 0, scene.speed[ahead], np.nan),
            "next_gap": _or_nan(scene.ahead.gap[state]),
            "queue_gap": np.where(after >= 0, _or_nan(scene.ahead.gap[ahead]), np.nan),
            "lane_width": scene.lane_width(ego, begin),
            "lead_time": scene.led_time(ego, lead, begin),
        },
        {
            OVERLAP: least <= 0.0,
            NOT_WHOLE: ~whole[picked] | np.isnan(gap),
            "it is not the ego's leader throughout": ~stays,
            "it brakes harder than its kind can": rate[picked] > hardest[lead],
        },
    )


def _or_nan(gap: Float) -> Float:
    return np.where(np.isfinite(gap), gap, np.nan)


def _runs(scene: Scene) -> tuple[Int, Int]:
    """Return the first and the last state of each time in which a vehicle may brake."""
    slows = (scene.acceleration <= -ONSET) & scene.drives
    who = scene.participant
    edge = np.ones(len(slows) + 1, np.bool_)
    edge[1:-1] = (slows[1:] != slows[:-1]) | (who[1:] != who[:-1])
    bounds = np.flatnonzero(edge)
    first, last = bounds[:-1], bounds[1:] - 1
    speed = scene.speed
    enough = slows[first] & (speed[first] - speed[last] >= 0.5 * LEAST_DROP)
    return first[enough], last[enough]


def _together(scene: Scene, ego: Int, lead: Int, begin: Float, end: Float) -> tuple[Float, Bool]:
    """Return the least gap from begin to end, and whether one stays the other's leader."""
    least, stays = np.full(len(ego), np.inf), np.zeros(len(ego), np.bool_)
    low, high = scene.state(ego, np.ceil(begin)), scene.state(ego, np.floor(end))
    for i in np.flatnonzero((low >= 0) & (high >= low)).tolist():
        states = slice(low[i], high[i] + 1)
        stays[i] = bool((scene.leader[states] == lead[i]).all())
        least[i] = scene.ahead.gap[states].min()
    return least, stays
