"""Who drives ahead and behind, in the own lane and in those beside it, at every instant."""

from dataclasses import dataclass
from typing import Literal

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError
from bridgegen.recordings.lanes._neighbour_kernels import nearest
from bridgegen.recordings.lanes.model import NONE, RecordedLanes
from bridgegen.recordings.lanes.placing import Placed, flattened
from bridgegen.recordings.readers.table import RecordedTraffic

HORIZON = 200.0
"""Distance within which neighbours are sought [m]."""
Side = Literal["left", "own", "right"]


@dataclass(frozen=True, eq=False)
class Nearest:
    """The nearest neighbour of every state in one lane and one direction.

    Attributes:
        state: ``(S,)`` int64, the neighbour's state at the same instant; -1 for none. Its
            participant is ``traffic.participant[state]``.
        gap: ``(S,)`` float64 from bumper to bumper along the carriageway [m], negative where both
            overlap along it; inf for none.
    """

    state: Int
    gap: Float


class Neighbours:
    """The participants of a recording that are near each other along lanes.

    They are looked for along the lane and those that follow it (or lead to it), whatever the fork,
    at most `HORIZON` far; in the lane beside, whoever's centre is level is ahead.

    Args:
        traffic: cleaned, so that all are at the same instants.
        placed: where its states are.
        lanes: on which.
        among: ``(P,)`` who counts as a neighbour; all by default.
    """

    def __init__(
        self,
        traffic: RecordedTraffic,
        placed: Placed,
        lanes: RecordedLanes,
        among: Bool | None = None,
    ) -> None:
        step = traffic.facts.time_step
        if not step > 0.0:
            raise InputError(f"time_step > 0 [s] must hold, got {step:g}")
        self._traffic, self._placed, self._lanes = traffic, placed, lanes
        self._instant = np.rint(traffic.time / step).astype(np.int64)
        self._instant -= self._instant.min()
        counts = placed.on_lane
        if among is not None:
            counts = counts & np.repeat(among, np.diff(traffic.first))
        states = np.flatnonzero(counts)
        key = self._instant[states] * len(lanes) + placed.lane[states]
        by_key = np.lexsort((placed.station[states], key))
        self._order = states[by_key]
        self._keys, begin = np.unique(key[by_key], return_index=True)
        self._first = np.append(begin, len(states)).astype(np.int64)
        self._rank = np.full(len(counts), NONE, np.int64)
        self._rank[self._order] = np.arange(len(states))
        last = lanes.first[1:] - 1
        self._ends = np.column_stack([lanes.station[lanes.first[:-1]], lanes.station[last]])
        led: list[list[int]] = [[] for _ in lanes.names]
        for lane, onward in enumerate(lanes.successors):
            for to in onward:
                led[to].append(lane)
        self._onward = {True: flattened(lanes.successors), False: flattened(tuple(map(tuple, led)))}

    def ahead(self, side: Side = "own") -> Nearest:
        """Return each state's leader in the own lane, or in that to the left or right."""
        return self._nearest(side, ahead=True)

    def behind(self, side: Side = "own") -> Nearest:
        """Return each state's follower."""
        return self._nearest(side, ahead=False)

    def _nearest(self, side: Side, *, ahead: bool) -> Nearest:
        lanes, placed = self._lanes, self._placed
        target = {"left": lanes.left, "own": np.arange(len(lanes)), "right": lanes.right}[side]
        n = len(placed.lane)
        state, gap = np.full(n, NONE, np.int64), np.full(n, np.inf)
        nearest(
            placed.lane, target, self._instant, placed.station, self._rank, self._order,
            self._keys, self._first, self._ends, *self._onward[ahead], ahead, HORIZON, state, gap,
        )  # fmt: skip
        half = 0.5 * np.repeat(self._traffic.length, np.diff(self._traffic.first))
        gap -= half + np.where(state >= 0, half[state], 0.0)
        return Nearest(state, gap)
