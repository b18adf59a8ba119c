"""What the participants' behaviour brought about in a rollout: queues.

Paper, Section III-B: layer 4 brings about layer 3; for collisions see
`bridgegen.simulation.accidents`.
"""

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.openx.opendrive.lanes import borders, section_end
from bridgegen.openx.opendrive.lanes import points as road_points
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.simulation.rollout import Rollout

CRAWL = 1.0
QUEUE_GAP = 10.0
QUEUE_TIME = 2.0
QUEUE_SIZE = 3
"""A queue: at least so many vehicles on one lane below ``CRAWL`` [m/s], behind one another with
gaps below ``QUEUE_GAP`` [m] from bumper to bumper, for at least ``QUEUE_TIME`` [s].

Ours. A vehicle has joined a queue when it is within a car's length of a standing one and about to
stop (Highway Capacity Manual 2000, chapter 16, appendix A): 1 m/s is about to stop, and 10 m leave
room for one vehicle's length and its usual gap. Two vehicles are one that waits for another; what
lasts less than 2 s is a hesitation.
"""

_STEP = 1.0  # m, along lanes
_AT_ONCE = 4_000_000  # distances


@dataclass(frozen=True)
class Queue:
    """A queue, when it had the most vehicles.

    Attributes:
        time: since when three of them stood [s].
        road_id: OpenDRIVE's id.
        lane_id: OpenDRIVE's id.
        length: from the last one's rear to the first one's front [m].
        who: its vehicles, in the rollout's order.
    """

    time: float
    road_id: str
    lane_id: int
    length: float
    who: tuple[str, ...]


def queues(
    rollout: Rollout,
    row: int,
    vehicles: Iterable[str],
    model: OpenDrive,
    lanes: set[tuple[str, int]],
) -> tuple[Queue, ...]:
    """Return the queues (see ``QUEUE_SIZE``), in the order of time.

    Args:
        rollout: N scenarios.
        row: which of them; it must not have failed.
        vehicles: names of the entities that can queue.
        model: the road network that it took place on.
        lanes: road id and lane id of the lanes on which vehicles can queue.
    """
    wanted = set(vehicles)
    who = [k for k, name in enumerate(rollout.names) if name in wanted]
    steps = int(rollout.n_steps[row])
    slow = rollout.v[row, who, :steps] < CRAWL
    if rollout.present.size:
        slow &= rollout.present[row, who, :steps]
    if (slow.sum(axis=0) >= QUEUE_SIZE).sum() * rollout.time_step < QUEUE_TIME:
        return ()
    length, ahead = rollout.box[who, 0], rollout.box[who, 2, np.newaxis]
    h = rollout.h[row, who, :steps]
    x = rollout.x[row, who, :steps] + ahead * elementary.cos(h)
    y = rollout.y[row, who, :steps] + ahead * elementary.sin(h)
    known = sorted(lanes)
    lane, station = _on_lanes(
        x, y, slow, [_line(model.road(road), number) for road, number in known]
    )
    found = []
    for index, members, first, metres in find_queues(lane, station, length, rollout.time_step):
        names = tuple(rollout.names[who[k]] for k in members)
        found.append(Queue(round(first * rollout.time_step, 9), *known[index], metres, names))
    return tuple(sorted(found, key=lambda queue: (queue.time, queue.who)))


def find_queues(
    lane: Int, station: Float, length: Float, time_step: float
) -> list[tuple[int, tuple[int, ...], int, float]]:
    """Return each queue: its lane, its members, the first step, its length [m].

    Args:
        lane: ``(E, T)`` int64, on which lane a vehicle stands or crawls; -1: on none, or it drives.
        station: ``(E, T)`` float64 [m], where its box's centre is along the lane.
        length: ``(E,)`` float64 [m], of its box.
        time_step: [s].
    """
    span = math.ceil(QUEUE_TIME / time_step - 1e-9)
    found = []
    for item in np.unique(lane[lane >= 0]).tolist():
        on = lane == item
        held = _held(_together(on, station, length), span)
        size = held.sum(axis=1)
        open_: list[tuple[int, set[int], int]] = []  # last step, members when most, first step
        for step in np.flatnonzero((size >= QUEUE_SIZE).any(axis=0)).tolist():
            groups = {
                tuple(np.flatnonzero(held[k, :, step]).tolist())
                for k in np.flatnonzero(size[:, step] >= QUEUE_SIZE)
            }
            for members in sorted(groups):
                known = next((q for q in open_ if q[0] >= step - 1 and q[1] & set(members)), None)
                if known is None:
                    open_.append((step, set(members), step - span))
                else:
                    most = known[1] if len(known[1]) >= len(members) else set(members)
                    open_[open_.index(known)] = (step, most, known[2])
        for last, most, first in open_:
            inside = np.array(sorted(most))
            together = held[np.ix_(inside, inside)].all(axis=(0, 1)).nonzero()[0]
            at = int(together[0]) if len(together) else last
            rear = station[inside, at] - 0.5 * length[inside]
            front = station[inside, at] + 0.5 * length[inside]
            found.append((item, tuple(sorted(most)), first, float(front.max() - rear.min())))
    return found


def _together(on: Bool, station: Float, length: Float) -> Bool:
    """Return who is in one row with whom: ``(E, E, T)`` bool."""
    at = np.where(on, station, np.inf)
    order = np.argsort(at, axis=0, kind="stable")
    at = np.take_along_axis(at, order, axis=0)
    half = 0.5 * length[order]
    with np.errstate(invalid="ignore"):  # inf - inf: none of the two is on the lane
        gap = (at[1:] - half[1:]) - (at[:-1] + half[:-1])
    row = np.zeros(at.shape, dtype=np.int64)
    row[1:] = np.cumsum(~(gap < QUEUE_GAP), axis=0)
    back = np.empty_like(row)
    np.put_along_axis(back, order, row, axis=0)
    both = on[:, np.newaxis] & on[np.newaxis]
    together: Bool = both & (back[:, np.newaxis] == back[np.newaxis])
    return together


def _held(state: Bool, span: int) -> Bool:
    """Return where a state has held for ``span`` steps: ``(…, T)`` bool, at the last of them."""
    count = np.cumsum(state, axis=-1)
    held = np.zeros(state.shape, dtype=bool)
    if state.shape[-1] > span:
        earlier = np.concatenate([np.zeros_like(count[..., :1]), count[..., : -span - 1]], axis=-1)
        held[..., span:] = count[..., span:] - earlier == span + 1
    return held


# -- lanes -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class _Line:
    """A lane's centre at every metre of travel: ``(P,)`` float64 each, [m], [rad]."""

    x: Float
    y: Float
    h: Float
    station: Float
    width: Float


def _line(road: Road, lane_id: int) -> _Line:
    parts = []
    for index, section in enumerate(road.sections):
        end = section_end(road, index)
        s = np.linspace(section.s, end, max(2, math.ceil((end - section.s) / _STEP) + 1))
        edges = borders(road, index, s)
        inner = edges[lane_id - int(np.sign(lane_id))]
        middle, width = 0.5 * (inner + edges[lane_id]), np.abs(edges[lane_id] - inner)
        parts.append(np.column_stack([road_points(road, s, middle), width]))
    x, y, width = np.concatenate(parts)[:: road.direction(lane_id)].T
    station = np.concatenate([[0.0], np.cumsum(elementary.hypot(np.diff(x), np.diff(y)))])
    h = elementary.atan2(np.gradient(y), np.gradient(x))
    return _Line(x, y, h, station, width)


def _on_lanes(x: Float, y: Float, asked: Bool, lines: Sequence[_Line]) -> tuple[Int, Float]:
    """Return on which lane each point is (-1: none), and where along it.

    Args:
        x: ``(E, T)`` float64 [m].
        y: ``(E, T)`` float64 [m].
        asked: ``(E, T)`` bool; others are on none.
        lines: the lanes.
    """
    lane, station = np.full(x.shape, -1), np.zeros(x.shape)
    which = np.flatnonzero(asked)
    for number, line in enumerate(lines):
        # Each point is compared with each sample of a lane: in chunks, for a long lane would need
        # gigabytes.
        chunk = max(1, _AT_ONCE // len(line.x))
        for some in (which[i : i + chunk] for i in range(0, len(which), chunk)):
            px, py = x.flat[some], y.flat[some]
            away = (px[:, np.newaxis] - line.x) ** 2 + (py[:, np.newaxis] - line.y) ** 2
            at = away.argmin(axis=1)
            dx, dy = px - line.x[at], py - line.y[at]
            cosine, sine = elementary.cos(line.h[at]), elementary.sin(line.h[at])
            along, aside = cosine * dx + sine * dy, cosine * dy - sine * dx
            here = (np.abs(along) <= _STEP) & (np.abs(aside) <= 0.5 * line.width[at])
            lane.flat[some[here]] = number
            station.flat[some[here]] = (line.station[at] + along)[here]
    return lane, station
