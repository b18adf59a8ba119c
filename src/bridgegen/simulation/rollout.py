"""The result of a simulator: the motion of every entity of every scenario of a batch."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int, opposite
from bridgegen.drivers import kinds

STATUS_MESSAGES = {
    0: "ok",
    1: "a state became NaN or infinite",
    2: "a parameter value puts an entity off its route",
    3: "a lane change where there is no such lane",
    9: "the values of the parameters make no scenario",
    20: "the driver raised an error",
    21: "the driver did not answer in time",
    22: "the driver's process ended",
    23: "the driver answered what is no control",
    4: "a position that is not on the road network",
    5: "no lane leads from where an entity is to its route",
    6: "a position that counts from an entity which is not there",
    7: "the ego's driver is on no lane",
    8: "the times of a trajectory's vertices do not increase",
    30: "the worker's process ended",
    40: "the simulator reported an error",
    41: "the simulator's process ended",
    42: "the simulator did not answer in time",
}

FAILURES = {"raised": 20, "timed out": 21, "died": 22, "answered nonsense": 23}
"""The status of a row whose driver failed, by `DriverError.kind`."""

SIMULATOR_FAILURES = {"raised": 40, "died": 41, "timed out": 42}
"""The status of a row whose simulator failed, by `CallError.kind`."""

NO_SCENARIO = 9
"""The status of a row whose storyboard cannot be made or run."""

WORKER_ENDED = 30
"""The status of a row whose simulation ended its worker, twice."""


@dataclass(frozen=True)
class Incident:
    """An event that the simulator itself reported.

    Attributes:
        step: the instant.
        kind: "collision", "lane invasion" or "red light".
        what: the other entity, the marking, the light.
    """

    step: int
    kind: str
    what: str


@dataclass(frozen=True)
class Rollout:
    """N simulated scenarios of E entities over T recorded instants; the ego is entity 0.

    A position is the OpenSCENARIO reference point: the rear axle's centre on the ground.
    After a scenario has stopped, its arrays repeat the last recorded state; ``n_steps``
    counts the real instants.

    Attributes:
        time_step: seconds between two recorded instants; instant k is at k · time_step.
        names: E entity names, ``names[0]`` is the ego's.
        box: ``(E, 3)`` float64 [m]: length, width, and the distance of the box's centre ahead
            of the reference point.
        x: ``(N, E, T)`` float64 [m].
        y: ``(N, E, T)`` float64 [m].
        h: ``(N, E, T)`` float64 [rad], heading, counter-clockwise from +x, continuous.
        v: ``(N, E, T)`` float64 [m/s], forward speed; < 0 of a body that reverses.
        a: ``(N, E, T)`` float64 [m/s²], forward acceleration applied from this instant on.
        offset: ``(N, E, T)`` float64 [m], signed lateral distance of the reference point from the
            entity's route (the lane's centre), left positive; where the ego's route changes lanes,
            from the lane that it changes from.
        n_steps: ``(N,)`` int64, in 1..T, the recorded instants before the stop trigger fired.
        status: ``(N,)`` int8, a key of ``STATUS_MESSAGES``; 0 is success. Arrays of a failed
            scenario are finite but meaningless.
        light_names: S ids of the traffic lights that change.
        lights: ``(N, S, T)`` int8, their states: 0 off, 1 red, 2 red and yellow, 3 yellow, 4 green.
        event_names: of the V events of the storyboard, in the order of the file.
        began: ``(N, V)`` int64, the instant at which each began; -1 if it never did.
        event_actors: the entities that each of the V events moves; empty where unknown.
        present: ``(N, E, T)`` bool, which entity is present at which instant; where one is
            absent, its states are finite but meaningless. ``(0, 0, 0)`` where all always are.
        lamps: ``(N, E, T)`` int8, indicators and brake lights that show, see
            `bridgegen.drivers.kinds`; ``(0, 0, 0)`` where no scenario switches any.
        kinds: ``(E,)`` int64, what each entity is, as `bridgegen.drivers.kinds` numbers it; empty
            where unknown.
        detections: ``(N, E, T, 8)`` float64, what the ego's sensors made of each entity at each
            instant, in the columns of `bridgegen.drivers.kinds`; rows of the ego itself
            are zeros. ``(0, 0, 0, 8)`` where its driver perceives nothing.
        ghosts: ``(N, G, T, 8)`` float64, likewise its false positives, where nothing is;
            ``(0, 0, 0, 8)`` where a scenario states none.
        stop_lines: ``(N, L, 3)`` float64: x, y [m] and heading [rad] of each point where a route
            crosses the stop line of a traffic light, the heading in travel direction.
        stop_lights: ``(L,)`` int64, each stop line's light, an index into ``light_names``; of the
            kerb of a crosswalk ~index of the light for the traffic that goes over it: who crosses
            there has red unless that light is red or off.
        stop_entities: ``(L,)`` int64, whose route it is.
        claims: ``(N, E, E)`` int64, which of two participants' routes goes first; see
            `bridgegen.drivers.right_of_way.claim`. ``(0, 0, 0)`` where no map is known.
        crosswalks: ``(N, C, 5)`` float64, the crosswalks that the ego's route leads over: x, y of
            the centre [m], the route's heading [rad], half the extent along and across the route
            [m]; NaN where a road network has fewer.
        friction: ``(N,)`` float64 [m/s²], what the tyres could give (mu g) as the scenario ended;
            ``(0,)`` where unknown.
        towed_by: ``(E,)`` int64, which entity tows each at any time; -1: none. Empty where there
            are no trailers. Coupled entities do not collide.
        progress: ``(N, 2)`` float64 [m], how far the ego's driver drove, and how far it then was
            from the end of its route; ``(0, 2)`` where unknown.
        transitions: ``(N, 2)`` int64, the instants at which the ego's operational design domain
            was left, and at which its driver demanded that a human takes over; -1: never.
            ``(0, 2)`` where the ego states no such domain.
        corridors: ``(P, L, 8)`` float64, the room beside the ego's route on each road network, at
            every sample of it, see `bridgegen.drivers.lane_tables.corridor_along`; +inf beyond its
            end.
        corridor_of: ``(N,)`` int64, the one of each row; -1 where it is unknown, and where the ego
            has stayed so near to its route that it does not matter. Empty where all are unknown.
        left_hand: whether it is the mirror image of left-hand traffic; see `as_driven`.
        country: by whose law it is judged, a code of ISO 3166-1; "" where none is stated.
        egos: the same scenarios as rollouts of each further vehicle that the ego's driver drives:
            it is their entity 0, and the ego has its number. A row ends where its route does.
        messages: details of failures, by row.
        incidents: by row, those that the simulator itself reported.
        derived: intermediate results that several metrics share; see `metrics.metric.shared`.
    """

    time_step: float
    names: tuple[str, ...]
    box: Float
    x: Float
    y: Float
    h: Float
    v: Float
    a: Float
    offset: Float
    n_steps: Int
    status: npt.NDArray[np.int8]
    light_names: tuple[str, ...] = ()
    lights: npt.NDArray[np.int8] = field(default_factory=lambda: np.zeros((0, 0, 0), np.int8))
    event_names: tuple[str, ...] = ()
    began: Int = field(default_factory=lambda: np.zeros((0, 0), np.int64))
    event_actors: tuple[frozenset[int], ...] = ()
    present: Bool = field(default_factory=lambda: np.zeros((0, 0, 0), np.bool_))
    lamps: npt.NDArray[np.int8] = field(default_factory=lambda: np.zeros((0, 0, 0), np.int8))
    kinds: Int = field(default_factory=lambda: np.zeros(0, np.int64))
    detections: Float = field(default_factory=lambda: np.zeros((0, 0, 0, 8)))
    ghosts: Float = field(default_factory=lambda: np.zeros((0, 0, 0, 8)))
    stop_lines: Float = field(default_factory=lambda: np.zeros((0, 0, 3)))
    stop_lights: Int = field(default_factory=lambda: np.zeros(0, np.int64))
    stop_entities: Int = field(default_factory=lambda: np.zeros(0, np.int64))
    claims: Int = field(default_factory=lambda: np.zeros((0, 0, 0), np.int64))
    crosswalks: Float = field(default_factory=lambda: np.zeros((0, 0, 5)))
    friction: Float = field(default_factory=lambda: np.zeros(0))
    towed_by: Int = field(default_factory=lambda: np.zeros(0, np.int64))
    progress: Float = field(default_factory=lambda: np.zeros((0, 2)))
    transitions: Int = field(default_factory=lambda: np.zeros((0, 2), np.int64))
    corridors: Float = field(default_factory=lambda: np.zeros((0, 0, 8)))
    corridor_of: Int = field(default_factory=lambda: np.zeros(0, np.int64))
    left_hand: bool = False
    country: str = ""
    egos: "tuple[Rollout, ...]" = ()
    messages: Mapping[int, str] = field(default_factory=dict)
    incidents: Mapping[int, tuple[Incident, ...]] = field(default_factory=dict)
    derived: dict[Any, Any] = field(default_factory=dict, init=False, repr=False, compare=False)

    @property
    def shape(self) -> tuple[int, int, int]:
        """(N, E, T)."""
        n, e, t = self.x.shape
        return n, e, t

    @cached_property
    def direction(self) -> tuple[Float, Float]:
        """Cosine and sine of the headings, each ``(N, E, T)`` float64; padding is unset."""
        from bridgegen.simulation.boxes import directions

        return directions(self.h, self.n_steps)

    @cached_property
    def distance(self) -> Float:
        """``(N, E, T)`` float64 [m]: from the ego's oriented box to each other's, 0 at contact.

        Row 0 of axis E, the ego's distance to itself, is +inf, and so is that to (or from) who is
        not present. Trailers of the ego's are part of it. Padded instants repeat the last.
        """
        distance = self._distance_from(0)
        own = [e for e in range(1, len(self.names)) if self.is_ego_s(e)]
        for e in own:
            np.minimum(distance, self._distance_from(e), out=distance)
        distance[:, [0, *own]] = np.inf
        return distance

    def _distance_from(self, e: int) -> Float:
        """Return the distances from one body to all, as ``distance``."""
        from bridgegen.simulation.boxes import box_distance, leave_out

        order = [e, *(other for other in range(len(self.names)) if other != e)]
        box, x, y, h = self.box, self.x, self.y, self.h
        direction: tuple[Float, Float] | None = self.direction
        if e:
            box, x, y, h = box[order], x[:, order], y[:, order], h[:, order]
            direction = None
        found = box_distance(box, x, y, h, self.n_steps, direction)
        if e:
            found = found[:, np.argsort(order)]
        if self.present.size:
            found = leave_out(self.present, e, found)
        return found

    def is_ego_s(self, e: int) -> bool:
        """Return whether an entity is the ego, or a trailer of its own."""
        while e > 0:
            e = int(self.towed_by[e]) if len(self.towed_by) else -1
        return e == 0

    def coupled(self, a: int, b: int) -> bool:
        """Return whether one of two entities tows the other some time."""
        return bool(len(self.towed_by)) and (self.towed_by[a] == b or self.towed_by[b] == a)

    def as_driven(self) -> "Rollout":
        """Return the motion in the world: with left-hand traffic, y and left are not mirrored.

        What is measured and judged is `Rollout` itself, which drives on the right.
        """
        if not self.left_hand:
            return self
        changed: dict[str, Any] = {n: opposite(getattr(self, n)) for n in ("y", "h", "offset")}
        seen = opposite(self.detections, columns=(kinds.Y, kinds.HEADING))
        lines = opposite(self.stop_lines, columns=(1, 2))
        return replace(
            self,
            **changed,
            detections=seen,
            stop_lines=lines,
            crosswalks=opposite(self.crosswalks, columns=(1, 2)),
            lamps=kinds.other_side(self.lamps),
            left_hand=False,
        )

    def take(self, at: Int) -> "Rollout":
        """Return some of the scenarios, in the order of their positions ``at``."""
        arrays = {name: getattr(self, name) for name in _BY_ROW}
        taken = {name: array[at] for name, array in arrays.items() if len(array)}
        rows = list(enumerate(at.tolist()))
        return replace(
            self,
            **taken,
            egos=tuple(rollout.take(at) for rollout in self.egos),
            messages={k: self.messages[row] for k, row in rows if row in self.messages},
            incidents={k: self.incidents[row] for k, row in rows if row in self.incidents},
        )


_BY_ROW = (
    "x", "y", "h", "v", "a", "offset", "n_steps", "status", "lights", "began", "detections",
    "ghosts", "stop_lines", "present", "lamps", "claims", "crosswalks", "friction", "progress",
    "transitions", "corridor_of",
)  # fmt: skip

_BY_INSTANT = (
    "x", "y", "h", "v", "a", "offset", "lights", "present", "lamps", "detections", "ghosts",
)  # fmt: skip


def joined(parts: Sequence[tuple[Int, Rollout]]) -> Rollout:
    """Return the rollout of N scenarios from those of parts of them.

    Args:
        parts: the rows ``(n,)`` of each, every one of 0 … N − 1 once, and its rollout.

    Raises:
        ValueError: the entities of one are not as large as those of another.
    """
    first = parts[0][1]
    if len(parts) == 1:
        return first
    # A rollout has one box for each entity. Storyboards of one search may differ in bodies; their
    # rows stay apart.
    if any(not np.array_equal(part.box, first.box) for _, part in parts):
        raise ValueError("rollouts of bodies of different sizes are no one rollout")
    most = max(part.shape[2] for _, part in parts)
    parts = [(each, _lengthened(part, most)) for each, part in parts]
    rows = np.concatenate([each for each, _ in parts])
    order = np.argsort(rows)
    parts, whole = _with_corridors(parts)
    for name in _BY_ROW:
        arrays = [getattr(part, name) for _, part in parts]
        # A part in which all are always there does not record it.
        if name == "present" and any(len(array) for array in arrays):
            arrays = [
                array if len(array) else np.ones(rollout.shape, np.bool_)
                for array, (_, rollout) in zip(arrays, parts, strict=True)
            ]
        if len(arrays[0]):  # else it is not recorded
            whole[name] = np.concatenate(arrays)[order]
    whole["egos"] = tuple(
        joined([(each, part.egos[i]) for each, part in parts]) for i in range(len(first.egos))
    )
    messages = {int(each[row]): text for each, part in parts for row, text in part.messages.items()}
    incidents = {
        int(each[row]): what for each, part in parts for row, what in part.incidents.items()
    }
    return replace(parts[0][1], **whole, messages=messages, incidents=incidents)


def _with_corridors(
    parts: Sequence[tuple[Int, Rollout]],
) -> tuple[list[tuple[Int, Rollout]], dict[str, Any]]:
    """Return parts whose ``corridor_of`` counts through the corridors of all, and these."""
    shape = np.max([part.corridors.shape for _, part in parts], axis=0)
    found, tables = list[tuple[Int, Rollout]](), list[Float]()
    for each, part in parts:
        of = part.corridor_of if len(part.corridor_of) else np.full(part.shape[0], -1)
        first = sum(map(len, tables))
        found.append((each, replace(part, corridor_of=np.where(of < 0, -1, of + first))))
        table = np.full((len(part.corridors), *shape[1:]), np.inf)
        table[:, : part.corridors.shape[1]] = part.corridors
        tables.append(table)
    return found, {"corridors": np.concatenate(tables)}


def _lengthened(rollout: Rollout, most: int) -> Rollout:
    """Return a rollout over more instants; each scenario's last state is repeated."""
    missing = most - rollout.shape[2]
    if not missing:
        return rollout
    longer: dict[str, Any] = {
        name: np.concatenate([array, np.repeat(array[:, :, -1:], missing, axis=2)], axis=2)
        for name in _BY_INSTANT
        if len(array := getattr(rollout, name))
    }
    return replace(rollout, **longer)
