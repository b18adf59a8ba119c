"""Lane changes: when a vehicle begins and ends to move from one lane to that beside it.

A vehicle changes lane where its centre crosses the line between two lanes of one direction. Begin
and end are those of the half wave of a cosine that fits the offset of its rear axle best, which
moves as the wheels roll; so a turning body does not move the begin.

Source: ASAM OpenSCENARIO 1.3, DynamicsShape (sinusoidal); Toledo and Zohar, Transportation Research
Record 1999 (2007) 71-78: lane changes take 1 to 13.3 s.
"""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.events.scene import Scene
from bridgegen.recordings.events.steps import fit_steps
from bridgegen.recordings.lanes.model import RecordedLanes
from bridgegen.recordings.readers.states import centre_ahead

SHORTEST, LONGEST = 1.0, 13.3
"""Least and greatest duration of a lane change [s]."""
BACK = 1.0
"""Time within which who crosses the line back only touches it, and does not change lane [s]."""
CUT = 0.5
"""Duration of a lane change that may lie outside of what is recorded [s]."""
LEAST_MOVE = 0.6
"""Least lateral movement of a lane change, as a share of the distance between the lanes'
middles."""
ONWARD, ELSEWHERE = 2, 0
"""Codes of steps from one lane to another that are none to the side."""
WORST_FIT = 0.15
"""Largest root mean square of the residual offset, as a share of the distance between the lanes'
middles."""


@dataclass(frozen=True, eq=False)
class LaneChanges:
    """The crossings of lines between lanes, by participant and time.

    Attributes:
        who: ``(K,)`` participant.
        state: ``(K,)`` its first state on the new lane.
        side: ``(K,)`` 1 to the left, -1 to the right.
        begin: ``(K,)`` instant.
        end: ``(K,)`` instant.
        move: ``(K,)`` how far it moves across [m].
        is_change: ``(K,)`` whether the path is that of a lane change.
        is_whole: ``(K,)`` whether it is recorded from begin to end.
        crossing: ``(K,)`` instant of `state`.
    """

    who: Int
    state: Int
    side: Int
    begin: Float
    end: Float
    move: Float
    is_change: Bool
    is_whole: Bool
    crossing: Float

    def __len__(self) -> int:
        return len(self.who)

    def meanwhile(self, who: Int, begin: Float, end: Float) -> Bool:
        """Return who crosses a line between two instants, ``(N,)``."""
        found = np.zeros(len(who), np.bool_)
        first, last = np.searchsorted(self.who, who), np.searchsorted(self.who, who, side="right")
        for i in np.flatnonzero(last > first).tolist():
            at = self.crossing[first[i] : last[i]]
            found[i] = bool(((at >= begin[i]) & (at <= end[i])).any())
        return found


def lane_changes(scene: Scene) -> LaneChanges:
    """Return all crossings of lines in a recording, but for those that only touch a line."""
    lane, who = scene.placed.lane.astype(np.int64), scene.participant
    steps = np.flatnonzero(
        (lane[1:] != lane[:-1]) & (who[1:] == who[:-1]) & scene.drives[1:] & scene.drives[:-1]
    )
    side = _sides(scene.lanes, lane[steps], lane[steps + 1])
    beside = np.abs(side) == 1
    jumps, steps, side = steps[side == ELSEWHERE], steps[beside], side[beside]
    state = steps + 1
    offset = np.asarray(scene.placed.offset, np.float64)
    across = np.asarray(scene.placed.across, np.float64)
    drift = 0.5 * (across[steps] + across[state]) * scene.step
    apart = offset[steps] + drift - offset[state]
    shift = np.zeros(len(lane))
    shift[state] = apart
    lateral = _of_rear_axle(scene, offset) + np.cumsum(shift)
    first, last = _pieces(scene, state, jumps)
    speed = np.abs(_mean_around(across, state, first, last, round(0.25 / scene.step)))
    duration = np.clip(0.5 * np.pi * np.abs(apart) / np.maximum(speed, 1e-3), SHORTEST, LONGEST)
    duration /= scene.step
    fit = fit_steps(
        lateral, first, last, (state - 0.5 - 0.5 * duration, duration), scene.step, "cosine"
    )
    instant = (scene.clock.instant[state] - state).astype(np.float64)
    begin = np.maximum(fit.begin, first) + instant
    end = np.minimum(fit.begin + fit.duration, last) + instant
    seconds = fit.duration * scene.step
    is_change = (fit.height * side >= LEAST_MOVE * np.abs(apart)) & (seconds <= LONGEST)
    is_change &= (seconds >= 0.5 * SHORTEST) & (fit.rms <= WORST_FIT * np.abs(apart))
    is_change &= (
        (np.abs(fit.height) < 2.0 * np.abs(apart))
        & (fit.begin < state)
        & (fit.begin + fit.duration > state - 1)
    )
    cut = CUT / scene.step
    is_whole = (fit.begin >= first - cut) & (fit.begin + fit.duration <= last + cut)
    found = LaneChanges(
        who[state],
        state,
        side,
        begin,
        end,
        np.abs(fit.height),
        is_change,
        is_whole,
        scene.clock.instant[state].astype(np.float64),
    )
    return _without(found, _touches(found, BACK / scene.step))


def _sides(lanes: RecordedLanes, a: Int, b: Int) -> Int:
    """Return 1 for a step to the left, -1 to the right, `ONWARD` or `ELSEWHERE`."""
    found = np.full(len(a), ELSEWHERE, np.int64)
    for i, (item, other) in enumerate(zip(a.tolist(), b.tolist(), strict=True)):
        onward = lanes.successors[item]
        if other in onward:
            found[i] = ONWARD
        elif lanes.left[item] == other or any(lanes.left[to] == other for to in onward):
            found[i] = 1
        elif lanes.right[item] == other or any(lanes.right[to] == other for to in onward):
            found[i] = -1
    return found


def _of_rear_axle(scene: Scene, offset: Float) -> Float:
    """Return the offset of every state's rear axle [m]; off the lanes that of the state before."""
    traffic = scene.traffic
    ahead = np.array(
        [
            centre_ahead(kind, length)
            for kind, length in zip(traffic.kind.tolist(), traffic.length.tolist(), strict=True)
        ]
    )
    heading = np.asarray(scene.placed.heading, np.float64)
    ahead_of = np.repeat(ahead, np.diff(traffic.first))
    return np.asarray(np.nan_to_num(offset - ahead_of * np.sin(heading)), np.float64)


def _pieces(scene: Scene, state: Int, jumps: Int) -> tuple[Int, Int]:
    """Return the states around each crossing in which a track drives on lanes without another."""
    ends = np.zeros(len(scene.participant) + 1, np.bool_)
    ends[scene.traffic.first] = True
    ends[:-1] |= ~scene.drives
    ends[1:] |= ~scene.drives
    ends[jumps + 1] = True
    bounds = np.flatnonzero(ends)
    at = np.searchsorted(bounds, state, side="right")
    first, last = bounds[at - 1], bounds[at] - 1
    same = scene.participant[state[1:]] == scene.participant[state[:-1]]
    first[1:] = np.where(same, np.maximum(first[1:], state[:-1]), first[1:])
    last[:-1] = np.where(same, np.minimum(last[:-1], state[1:] - 1), last[:-1])
    return first, last


def _mean_around(values: Float, at: Int, first: Int, last: Int, half: int) -> Float:
    places = np.clip(at[:, None] + np.arange(-half, half + 1), first[:, None], last[:, None])
    return np.asarray(values[places].mean(axis=1))


def _touches(found: LaneChanges, back: float) -> Bool:
    """Return which crossings are undone within a time, and those that undo them."""
    touches = np.zeros(len(found), np.bool_)
    pairs = (
        (found.who[1:] == found.who[:-1])
        & (found.side[1:] == -found.side[:-1])
        & (found.crossing[1:] - found.crossing[:-1] <= back)
    )
    touches[1:] |= pairs
    touches[:-1] |= pairs
    return touches


def _without(found: LaneChanges, left_out: Bool) -> LaneChanges:
    return LaneChanges(**{name: value[~left_out] for name, value in vars(found).items()})
