"""A recording on lanes, as detectors look at it: places, speeds and leaders at any instant.

Instants are counted in time steps by the recording's clock, and may lie between two states.
"""

from functools import cached_property

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.conflicts.find import EGOS
from bridgegen.recordings.events.paths import Crossings, Joins, Paths
from bridgegen.recordings.events.stop_lines import Passing, passings
from bridgegen.recordings.excerpt import clock_of
from bridgegen.recordings.lanes.find import Located
from bridgegen.recordings.lanes.model import NONE
from bridgegen.recordings.lanes.neighbours import Nearest, Neighbours
from bridgegen.recordings.lanes.placing import WALKS
from bridgegen.recordings.readers.table import RecordedTraffic

AVERAGED = 0.5
"""Time before and after an instant over which a speed is averaged [s]."""
SLOPE = 1.0
"""Time before and after an instant over which an acceleration is measured [s]."""
LONGEST_LEAD = 30.0
"""Longest time before an event that is stated [s]."""


class Scene:
    """A recording on lanes.

    Args:
        traffic: cleaned.
        located: where it is.

    Attributes:
        traffic: the recording.
        placed: its states on lanes.
        lanes: those lanes.
        step: between two instants [s].
        clock: the instants.
        participant: ``(S,)`` of each state.
        is_ego: ``(P,)`` who can be the ego.
        drives: ``(S,)`` who is on a lane, and in its direction.
    """

    def __init__(self, traffic: RecordedTraffic, located: Located) -> None:
        self.traffic, self.placed, self.lanes = traffic, located.placed, located.lanes
        self.step = traffic.facts.time_step
        self.clock = clock_of(traffic)
        self.participant = traffic.participant
        self.is_ego: Bool = np.isin(traffic.kind, EGOS)
        on, vehicle = located.placed.on_lane, ~np.isin(traffic.kind, WALKS)
        with np.errstate(invalid="ignore"):
            along = np.abs(located.placed.heading) < 0.5 * np.pi
        self.drives: Bool = on & along & vehicle[self.participant]

    @cached_property
    def ahead(self) -> Nearest:
        """The leader of every state in its own lane."""
        vehicles = ~np.isin(self.traffic.kind, WALKS)
        found = Neighbours(self.traffic, self.placed, self.lanes, vehicles).ahead()
        follows = self.drives & (found.state != NONE)
        follows[follows] = self.drives[found.state[follows]]
        return Nearest(np.where(follows, found.state, NONE), np.where(follows, found.gap, np.inf))

    @cached_property
    def follower(self) -> Int:
        """``(S,)`` state of the nearest that has this state as its leader; -1 for none."""
        states = np.flatnonzero(self.ahead.state != NONE)
        states = states[np.argsort(-self.ahead.gap[states], kind="stable")]
        found = np.full(len(self.participant), NONE, np.int64)
        found[self.ahead.state[states]] = states
        return found

    @cached_property
    def leader(self) -> Int:
        """``(S,)`` participant that is the leader; -1 for none."""
        state = self.ahead.state
        return np.where(state != NONE, self.participant[state], NONE)

    @cached_property
    def led_since(self) -> Int:
        """``(S,)`` the participant's first state from which on it has had this leader."""
        leader, who = self.leader, self.participant
        begins = np.ones(len(who), np.bool_)
        begins[1:] = (leader[1:] != leader[:-1]) | (who[1:] != who[:-1])
        return np.maximum.accumulate(np.where(begins, np.arange(len(who)), 0))

    @cached_property
    def paths(self) -> Paths:
        """Of all participants."""
        return Paths(self.traffic, self.clock)

    @cached_property
    def crossings(self) -> Crossings:
        """Where these cross."""
        return self.paths.crossings()

    @cached_property
    def joins(self) -> Joins:
        """Where these join."""
        return self.paths.joins()

    @cached_property
    def passings(self) -> list[Passing]:
        """Who passes the stop lines of traffic lights."""
        return passings(self.paths, self.is_ego)

    @cached_property
    def cosine(self) -> Float:
        """``(S,)`` of the headings."""
        return np.cos(self.traffic.heading)

    @cached_property
    def sine(self) -> Float:
        """``(S,)`` of the headings."""
        return np.sin(self.traffic.heading)

    @cached_property
    def forward(self) -> Float:
        """``(S,)`` speed along the heading; of who stands, its noise has the mean 0 [m/s]."""
        return self.traffic.vx * self.cosine + self.traffic.vy * self.sine

    @cached_property
    def _pace(self) -> Float:
        """``(S,)`` speed of the rear axle; of who walks, that of the body [m/s]."""
        walks = np.repeat(np.isin(self.traffic.kind, WALKS), np.diff(self.traffic.first))
        return np.where(walks, self.traffic.speed, self.forward)

    @cached_property
    def _travelled(self) -> Float:
        speed = self._pace
        steps = np.empty(len(speed))
        steps[0], steps[1:] = 0.0, 0.5 * (speed[1:] + speed[:-1]) * self.step
        return np.cumsum(steps)

    def _around(self, seconds: float) -> tuple[Int, Int]:
        """Return the states that lie so long before and after each, or as far as is recorded."""
        first = np.repeat(self.traffic.first[:-1], np.diff(self.traffic.first))
        last = np.repeat(self.traffic.first[1:] - 1, np.diff(self.traffic.first))
        here, most = np.arange(len(first)), max(round(seconds / self.step), 1)
        return np.maximum(here - most, first), np.minimum(here + most, last)

    @cached_property
    def speed(self) -> Float:
        """``(S,)`` averaged over `AVERAGED` before and after, or as far as is recorded [m/s]."""
        low, high = self._around(AVERAGED)
        path = self._travelled
        mean = (path[high] - path[low]) / (np.maximum(high - low, 1) * self.step)
        return np.abs(np.where(high > low, mean, self._pace))

    @cached_property
    def acceleration(self) -> Float:
        """``(S,)`` over `SLOPE` before and after; 0 where less is recorded [m/s²]."""
        low, high = self._around(SLOPE)
        most, path = max(round(SLOPE / self.step), 1), self._travelled
        bend = path[high] - 2.0 * path + path[low]
        return np.where(high - low == 2 * most, bend / (most * self.step) ** 2, 0.0)

    def state(self, who: Int, instant: Float) -> Int:
        """Return the state at the nearest instant, ``(N,)``; -1 where it is not recorded."""
        k = np.rint(instant).astype(np.int64)
        there = (who >= 0) & (k >= self.clock.begin[who]) & (k <= self.clock.end[who])
        return np.where(there, k - self.clock.begin[who] + self.traffic.first[who], NONE)

    def at(self, values: Float, who: Int, instant: Float) -> Float:
        """Return a column at instants between states, ``(N,)``; NaN where it is not recorded."""
        low = np.floor(instant)
        share = instant - low
        array, other = self.state(who, low), self.state(who, low + (share > 0.0))
        found = values[array] * (1.0 - share) + values[other] * share
        return np.where((array != NONE) & (other != NONE), found, np.nan)

    def gap(self, behind: Int, ahead: Int, instant: Float) -> Float:
        """Return the gap between two along their carriageway, ``(N,)``; NaN if they share none."""
        a, b = self.state(behind, instant), self.state(ahead, instant)
        way = self.lanes.carriageway
        lane_a, lane_b = self.placed.lane[a], self.placed.lane[b]
        same = (a != NONE) & (b != NONE) & (lane_a != NONE) & (lane_b != NONE)
        same &= way[lane_a] == way[lane_b] if len(way) else False
        station = self.placed.station
        apart = self.at(station, ahead, instant) - self.at(station, behind, instant)
        half = 0.5 * (self.traffic.length[behind] + self.traffic.length[ahead])
        return np.where(same, apart - half, np.nan)

    def lane_width(self, who: Int, instant: Float) -> Float:
        """Return how wide the lane is on which each is, ``(N,)``; NaN off the lanes."""
        found = np.full(len(who), np.nan)
        for i, state in enumerate(self.state(who, instant).tolist()):
            if state != NONE and (lane := int(self.placed.lane[state])) != NONE:
                points = self.lanes.points(lane)
                found[i] = np.interp(
                    self.placed.station[state], self.lanes.station[points], self.lanes.width[points]
                )
        return found

    def led_time(self, ego: Int, lead: Int, instant: Float) -> Float:
        """Return how long the ego has had a leader [s], ``(N,)``; NaN where it has another."""
        state = self.state(ego, np.floor(instant))
        is_led = (state != NONE) & (self.leader[state] == lead) & (lead >= 0)
        since = self.clock.instant[self.led_since[state]]
        before = (instant - since) * self.step
        return np.where(is_led, np.minimum(before, LONGEST_LEAD), np.nan)

    def together(self, array: Int, other: Int, instant: Float) -> Float:
        """Return how long two have been recorded [s], ``(N,)``."""
        first = np.maximum(self.clock.begin[array], self.clock.begin[other])
        return np.clip((instant - first) * self.step, 0.0, LONGEST_LEAD)

    def seconds(self, instant: Float) -> Float:
        """Return instants by the recording's clock [s]."""
        return instant * self.step
