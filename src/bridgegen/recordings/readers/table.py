"""Recorded traffic: one table of trajectories, whatever format it was recorded in.

Lengths and angles are SI; positions are those of the bodies' centres in a right-handed frame, x
east (or as the recording's frame says), heading counter-clockwise from x.
"""

import itertools
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import NAMES

# --- Traffic lights that come with a recording, as it describes them ---


RED = "red"


@dataclass(frozen=True, eq=False)
class RecordedLight:
    """A traffic light of one lane.

    Attributes:
        changes: the instants [s] and from then on its state: "red", "yellow", "green", "red and
            yellow", "flashing red", "flashing yellow", "off" or "unknown".
        lane: name of the lane that it governs; "" if unknown.
        path: ``(n, 2)`` of that lane's centre line from the stop line on, in the direction of
            travel [m]: two points at least, the first of them on the stop line; ``(0, 2)`` if
            unknown.
    """

    changes: tuple[tuple[float, str], ...]
    lane: str = ""
    path: Float = field(default_factory=lambda: np.zeros((0, 2)))

    def red_since(self, time: float) -> float:
        """Return since when it has been red at an instant [s]; NaN if it is not."""
        since, is_red = np.nan, False
        for at, state in self.changes:
            if at > time:
                break
            if state == RED and not is_red:
                since = at
            is_red = state == RED
        return since if is_red else np.nan

    def is_seen_to_turn_red(self, since: float) -> bool:
        """Return whether it had another state before an instant."""
        return bool(self.changes and self.changes[0][0] < since)


def changes_of(times: Sequence[float], states: Sequence[str]) -> tuple[tuple[float, str], ...]:
    """Return the changes of a light whose state is known at some instants [s]."""
    return tuple(
        (float(time), state)
        for k, (time, state) in enumerate(zip(times, states, strict=False))
        if k == 0 or state != states[k - 1]
    )


# --- Lanes that come with a recording, as it describes them ---


@dataclass(frozen=True, eq=False)
class Lanelet:
    """A piece of a lane between two bounds, which run in the direction of travel.

    Attributes:
        name: the recording's own.
        left: ``(n, 2)`` of the left bound [m].
        right: ``(m, 2)`` of the right bound [m].
        left_same: name of the neighbour to the left in the same direction; "" for none.
        right_same: to the right.
        left_opposite: to the left in the other direction.
        successors: names of those that it leads to.
        kinds: what it is for, in the recording's words.
        is_marked: it lies between painted markings that the recording gives, and has its name.
    """

    name: str
    left: Float
    right: Float
    left_same: str = ""
    right_same: str = ""
    left_opposite: str = ""
    successors: tuple[str, ...] = ()
    kinds: tuple[str, ...] = ()
    is_marked: bool = False


MOST_STATES = 40_000_000
MOST_PARTICIPANTS = 1_000_000
FARTHEST = 1e9
"""Largest coordinate [m]: larger than any place on Earth."""
LONGEST_BODY = 100.0  # m

REQUIRED = ("time", "x", "y")
OPTIONAL = ("heading", "vx", "vy", "acceleration")
UNKNOWN_KIND = -1
NO_LANE = -1


@dataclass(frozen=True)
class Facts:
    """What a recording says of itself.

    Attributes:
        name: of the recording, unique among those of a file.
        format: name of the format that it was read from.
        source: the file.
        time_step: between its states [s].
        frame: what x and y are, in words.
        map: the map that it names; "" for none.
        lights: traffic lights, by id.
        notes: what was assumed in reading.
        lanelets: the lanes that come with it, in its coordinates.
    """

    name: str
    format: str
    source: str
    time_step: float
    frame: str
    map: str = ""
    lights: Mapping[str, RecordedLight] = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()
    lanelets: tuple[Lanelet, ...] = ()


@dataclass(frozen=True)
class RecordedTraffic:
    """Trajectories, sorted by participant and time; all arrays are read-only.

    A participant is one rigid body with one box. What a format does not say is NaN (heading,
    velocities, acceleration, box), `UNKNOWN_KIND` or `NO_LANE`;
    `bridgegen.recordings.readers.clean` completes all but the lane.

    Attributes:
        facts: of the recording.
        names: ``(P,)`` what the recording calls the participants.
        kind: ``(P,)`` int64, numbers of `bridgegen.drivers.kinds`.
        length: ``(P,)`` [m].
        width: ``(P,)`` [m].
        first: ``(P + 1,)`` int64; the states of participant p are ``first[p]:first[p + 1]``.
        time: ``(S,)`` [s], strictly increasing within a participant.
        x: ``(S,)`` of the body's centre [m].
        y: ``(S,)`` of the body's centre [m].
        heading: ``(S,)`` in (−π, π] [rad].
        vx: ``(S,)`` [m/s].
        vy: ``(S,)`` [m/s].
        acceleration: ``(S,)`` along the heading [m/s²].
        lane: ``(S,)`` int32, the recording's own number of the lane.
        where: the place of a state in the file, by its number here; of a cleaned state, the file.
    """

    facts: Facts
    names: tuple[str, ...]
    kind: Int
    length: Float
    width: Float
    first: Int
    time: Float
    x: Float
    y: Float
    heading: Float
    vx: Float
    vy: Float
    acceleration: Float
    lane: npt.NDArray[np.int32]
    where: "Where"

    def __post_init__(self) -> None:
        for value in vars(self).values():
            # Arrays are shared by all analyses of a recording; read-only, none can change what
            # others see.
            if isinstance(value, np.ndarray):
                value.flags.writeable = False

    @property
    def participant(self) -> Int:
        """``(S,)`` int64, the participant of each state."""
        return np.repeat(np.arange(len(self.names)), np.diff(self.first))

    @property
    def speed(self) -> Float:
        """``(S,)`` [m/s], ≥ 0."""
        return np.hypot(self.vx, self.vy)

    @property
    def hours(self) -> float:
        """Hours driven or walked, summed over participants."""
        last, first = self.time[self.first[1:] - 1], self.time[self.first[:-1]]
        return float((last - first).sum()) / 3600.0

    @property
    def kilometres(self) -> float:
        """Length of all paths [km]."""
        steps = np.hypot(np.diff(self.x), np.diff(self.y))
        steps[self.first[1:-1] - 1] = 0.0  # from one participant to the next
        return float(steps.sum()) / 1000.0

    def states(self) -> Iterator[slice]:
        """Yield each participant's states, as a slice of the columns."""
        for begin, end in zip(self.first[:-1].tolist(), self.first[1:].tolist(), strict=True):
            yield slice(begin, end)


Where = Callable[[int], str]
"""The place of a state in its file, by its number in the order of reading."""


def line_of_table(source: str, head: int = 1) -> Where:
    """Return the places of states that stand a line each, below a head of some lines."""
    return lambda i: f"{source}, line {i + head + 1}"


def build(
    facts: Facts,
    ids: npt.NDArray[Any],
    columns: Mapping[str, npt.NDArray[Any]],
    where: Where,
    *,
    names: Sequence[str] | None = None,
    kind: npt.ArrayLike | None = None,
    length: npt.ArrayLike | None = None,
    width: npt.ArrayLike | None = None,
) -> RecordedTraffic:
    """Make the table of what a reader has found, in the order of its file.

    Args:
        facts: of the recording.
        ids: ``(S,)`` the participant of each state, from 0.
        columns: ``(S,)`` each: time, x and y [m] and, if they are known, heading, vx, vy,
            acceleration and lane; not finite where a state does not say.
        where: the place of a state, for messages.
        names: of the participants; their numbers by default.
        kind: per participant.
        length: per participant [m]; NaN or ≤ 0 where unknown.
        width: per participant [m].

    Raises:
        FileFormatError: no states, too many, not finite or too large, or time that runs backwards.
    """
    n = len(ids)
    if not n:
        raise FileFormatError(f"{facts.source}: holds no states")
    if n > MOST_STATES:
        raise FileFormatError(f"{facts.source}: may hold {MOST_STATES:,} states, got {n:,}")
    for name in REQUIRED:
        # Negated, so that NaN is refused, too: every comparison with it is false.
        bad = np.flatnonzero(~(np.abs(columns[name]) <= FARTHEST))
        if len(bad):
            unit = "s" if name == "time" else "m"
            raise FileFormatError(
                f"{where(int(bad[0]))}: {name} [{unit}] must be a number within ±{FARTHEST:g}, got "
                f"{columns[name][bad[0]]:g}"
            )
    count = int(ids.max()) + 1
    if count > MOST_PARTICIPANTS:
        raise FileFormatError(
            f"{facts.source}: may hold {MOST_PARTICIPANTS:,} participants, got {count:,}"
        )
    names = tuple(names) if names is not None else tuple(str(p) for p in range(count))
    # Stable: within a participant the file's order stays, and time that runs backwards is found as
    # such.
    order = None if (np.diff(ids) >= 0).all() else np.argsort(ids, kind="stable")
    ids = ids if order is None else ids[order]
    first = np.searchsorted(ids, np.arange(count + 1)).astype(np.int64)
    time = _column(columns["time"], order)
    _refuse_backwards(time, ids, names, order, where)
    rest = {
        name: _column(columns[name], order) if name in columns else np.full(n, np.nan)
        for name in ("x", "y", *OPTIONAL)
    }
    for name in OPTIONAL:
        # What is optional and absurd is unknown, and is completed like what is missing.
        rest[name][~(np.abs(rest[name]) <= FARTHEST)] = np.nan
    rest["heading"] = wrap(rest["heading"])
    lane = np.full(n, NO_LANE, np.int32)
    if "lane" in columns:
        lane = (columns["lane"] if order is None else columns["lane"][order]).astype(np.int32)
    return RecordedTraffic(
        facts=facts,
        names=names,
        kind=np.full(count, UNKNOWN_KIND) if kind is None else np.array(kind, dtype=np.int64),
        length=_sizes(length, count),
        width=_sizes(width, count),
        first=first,
        time=time,
        lane=lane,
        where=where if order is None else lambda i: where(int(order[i])),
        **rest,
    )


def wrap(angle: Float) -> Float:
    """Return angles in (−π, π] [rad]."""
    # In this order the result is in (−π, π]: a plain modulo would give −π for π.
    return np.pi - (np.pi - angle) % (2.0 * np.pi)


def median_step(time: Float, first: Int) -> float:
    """Return the most usual time between two states of a participant [s]; 0 if there are none."""
    steps = np.diff(time)
    within = np.ones(len(steps), dtype=np.bool_)
    within[first[1:-1] - 1] = False
    return float(np.median(steps[within])) if within.any() else 0.0


def numbered(values: npt.NDArray[Any]) -> tuple[npt.NDArray[Any], Int]:
    """Return the distinct values in the order of appearance, and each value's number."""
    distinct, at, inverse = np.unique(values, return_index=True, return_inverse=True)
    order = np.argsort(at)
    rank = np.empty(len(order), dtype=np.int64)
    rank[order] = np.arange(len(order))
    return distinct[order], rank[inverse]


def per_participant(ids: Int, values: Float) -> Float:
    """Return each participant's median of a column that should be constant; NaN if not given."""
    order = np.argsort(ids, kind="stable")
    bounds = np.searchsorted(ids[order], np.arange(int(ids.max()) + 2))
    found = []
    for begin, end in itertools.pairwise(bounds):
        known = values[order[begin:end]]
        known = known[np.isfinite(known)]
        found.append(float(np.median(known)) if len(known) else np.nan)
    return np.array(found)


def kind_in_words(kind: int) -> str:
    """Return a kind's name."""
    return "unknown" if kind == UNKNOWN_KIND else NAMES[kind]


def _column(values: npt.NDArray[Any], order: Int | None) -> Float:
    values = values if order is None else values[order]
    return np.array(values, dtype=np.float64)


def _sizes(values: npt.ArrayLike | None, count: int) -> Float:
    sizes = np.full(count, np.nan) if values is None else np.array(values, dtype=np.float64)
    sizes[~((sizes > 0.0) & (sizes <= LONGEST_BODY))] = np.nan
    return sizes


def _refuse_backwards(
    time: Float, ids: Int, names: Sequence[str], order: Int | None, where: Where
) -> None:
    bad = np.flatnonzero((np.diff(time) <= 0.0) & (np.diff(ids) == 0))
    if not len(bad):
        return
    i = int(bad[0])
    at = i + 1 if order is None else int(order[i + 1])
    what = "comes twice" if time[i + 1] == time[i] else f"comes after {time[i]:g}"
    raise FileFormatError(
        f"{where(at)}: the times of participant '{names[int(ids[i])]}' must increase, "
        f"{time[i + 1]:g} s {what}"
    )
