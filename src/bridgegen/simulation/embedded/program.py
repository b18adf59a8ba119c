"""An OpenSCENARIO file compiled for the rollout: integer tables, and the values that rows may vary.

``slots`` are the distinct values that the tables refer to: literals, ``$name`` references and
``${…}`` expressions. A batch of N rows of parameters fills them to an ``(N, S)`` array, and the
compiled storyboard runs over it unchanged. Roads enter only in ``network.py``.
"""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.drivers import STORYBOARD, Driver
from bridgegen.drivers._weather_columns import FRICTION_SCALE
from bridgegen.drivers.drivers import SCRIPTED, TESTED
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.simulation.embedded._codes import (
    ANGLE,
    CLEARANCE,
    DOES,
    EVENT,
    EVENT_NUMBER,
    FIRST,
    FIRST_GLOBAL,
    FOLLOW,
    KIND,
    LAST,
    OFFROAD,
    PROBE,
    RELATIVE_ANGLE,
    ROAD_SYSTEM,
    ROW,
    SWITCH,
    SYSTEM,
    WHOM,
)
from bridgegen.simulation.vehicles import KINEMATIC

UNSAID = -1  # the slot of what an environment leaves as it was


@dataclass(frozen=True)
class LanePoint:
    """A point on a lane: OpenDRIVE road id, lane id, s [m], metres left of the lane's centre."""

    road: str
    lane: int
    s: Value
    line: int
    aside: float = 0.0


@dataclass(frozen=True)
class WorldPoint:
    """A point of the world [m] that rows may not vary, and the heading [rad] if it states one."""

    x: float
    y: float
    line: int
    h: float | None = None


Point = LanePoint | WorldPoint


@dataclass(frozen=True)
class AlongLanes:
    """A path along lanes.

    Attributes:
        start: where on the first lane.
        via: the waypoints of the route; empty: on along the lane, while there is one way only.
        aside: of the lanes' centre, left of the road's direction positive [m].
    """

    start: LanePoint
    via: tuple[LanePoint, ...]
    aside: Value = 0.0


@dataclass(frozen=True)
class Bend:
    """A clothoid.

    Attributes:
        first: its curvature where it starts [1/m].
        last: where it ends [1/m].
        length: [m].
        kink: at its start [rad].
        starts: whether it starts at a place of its own, and not where the one before it ends.
    """

    first: float
    last: float
    length: float
    kink: float = 0.0
    starts: bool = False


@dataclass(frozen=True)
class AlongTrajectory:
    """A path from point to point in straight lines, or from one point along bends.

    Attributes:
        points: the vertices.
        line: of the action in the file.
        times: when to be at each vertex, or end of a bend [s], increasing; empty: at the entity's
            own speed.
        bends: one after the other.
        start: how far along it one begins [m].
    """

    points: tuple[Point, ...]
    line: int
    times: tuple[float, ...] = ()
    bends: tuple[Bend, ...] = ()
    start: float = 0.0


@dataclass(frozen=True)
class Nowhere:
    """The path of an entity whose start depends on the roads or on others; it leaves it at once."""


@dataclass(frozen=True)
class LaneSpot:
    """A lane of a road; ``s`` [m] is None where rows may vary it."""

    road: str
    lane: int
    s: float | None
    line: int


@dataclass(frozen=True)
class RoadSpot:
    """A point by its road's coordinates [m]."""

    road: str
    s: float
    t: float
    line: int


@dataclass(frozen=True)
class WorldSpot:
    """A point of the world [m], with a heading [rad]."""

    x: float
    y: float
    h: float
    line: int


@dataclass(frozen=True)
class RouteSpot:
    """A point so far along a route [m], on a lane and left of its centre, or left of the road.

    The lane is one that leads along the route, see `lane_along`.
    """

    waypoints: tuple["Spot", ...]
    path_s: float
    lane: int | None
    aside: float
    line: int


Spot = LaneSpot | RoadSpot | WorldSpot | RouteSpot


@dataclass(frozen=True)
class LaneCheck:
    """A lane change that must be possible somewhere on the way of an entity.

    Attributes:
        entity: its number.
        lanes: how many lanes to the left of the direction of travel; or None.
        lane: the lane's id, where that is given instead.
        line: of the action.
    """

    entity: int
    lanes: int | None
    lane: int | None
    line: int


PathSpec = AlongLanes | AlongTrajectory | Nowhere


# One program serves all rows, each of which may have a road network of its own: nothing in a file
# depends on the static parameters, and the roads resolve its places. So 430 networks a second are
# made ready for one compiled storyboard.
@dataclass(frozen=True)
class Program:
    """A compiled storyboard.

    Attributes:
        place: the file, for messages.
        names: E entities, the ego first.
        bodies: ``(E, 8)``: length, width, centre ahead of the reference point [m], maximum speed
            [m/s], acceleration and deceleration [m/s²], curvature at full lock [1/m], height [m].
        kinds: ``(E,)``: what they are, see `bridgegen.drivers.kinds`.
        sirens: ``(E,)``: 1 of an emergency vehicle on a call, to which all give way.
        objects: ``(E,)``: OpenSCENARIO's ObjectType of each: vehicle, pedestrian, miscellaneous.
        parameters: the numeric parameters with their declared values.
        slots: S distinct values.
        init: ``(E,)`` slot of each entity's initial speed.
        paths: E ways, entity e starts on path e, and the trajectories that events lead along.
            Others are planned as they are needed.
        trajectories: ``(M,)`` the path of each trajectory.
        follows: ``(E,)`` the trajectory by whose times an entity moves at first, -1 for none.
        starts: ``(·, 2)`` entities that start at a position, and its number.
        places: ``(·, 8)`` positions, see ``_codes``.
        layouts: ``(·, 8)`` trajectories that are laid when they begin, see ``_codes``.
        anchors: ``(·, 3)`` of these: a position, the slot of a time or -1, whether it states a
            heading.
        shapes: ``(·, W)`` of these: x, y [m], heading [rad], time [s] of vertices in the frame of
            an anchor, and its number; or the weights of the anchors.
        most_vertices: how many the longest of these has.
        spots: per position what its road network has to resolve.
        routes: ``(E,)`` the route that each starts with, 0 for none; route r has the places of
            ``waypoints[r - 1]``.
        waypoints: the places that each route passes.
        lane_checks: lane changes that are known to be asked for.
        start_slots: ``(E,)`` slot of each start's s; -1 where the path starts with the entity.
        aside_slots: ``(E,)`` slot of how far each is aside of its lane's centre; -1 of the ego,
            whose path runs there, and of who is on the centre.
        triggers: ``(·, 2)`` first and past-the-last group; trigger 0 stops the scenario.
        groups: ``(·, 2)`` first and past-the-last condition.
        conditions: ``(C, 5)`` first and past-the-last probe, quantity, edge, delay in steps.
        probes: ``(·, 11)`` kind, entity, other entity or -1 for a point, rule, slot, point,
            measure, coordinate system, whether between boxes, a second slot, whether it is one
            of those that are seldom asked for.
        points: places that probes name, which are the same whatever rows and entities do.
        marks: ``(M,)`` the other places that they name, as positions.
        clearances: ``(·, 3 + E)`` first and past-the-last range, whether lanes of the other
            direction count, and by entity whether it counts.
        ranges: ``(·, 2)`` of lanes to the left, the ends included.
        elements: ``(X, 10)`` of the storyboard: kind, parent, first element after it, start and
            stop trigger, priority, executions at most, first and past-the-last action, event.
        courses: ``(·, 12)`` what a kind of motion along the path needs besides, by kind; ``_codes``
            names the columns.
        entries: ``(·, 2)`` of speed profiles: slots of a speed and of the time to it, -1 if none.
        order: ``(2, E)``: the entities in the order in which they are moved, and the place of each.
        initial: ``(·,)`` actions that begin at the start.
        actions: ``(·, 8)`` entity, kind, shape, dimension, slot of the target, slot of its
            dynamics, row of ``laterals``, ``weathers`` or ``courses``, whether the entity is
            selected by the trigger; see ``_begin_kernels`` and ``_motion_kernels``. ``_codes``
            names the columns.
        laterals: ``(·, 3)``, see ``_across_kernels``.
        values: slots of the first values of parameters and variables that change.
        lights: the traffic lights that are set or looked at.
        first_states: ``(S,)`` int8, their states that the start sets, see `Rollout.lights`; -1:
            none.
        controllers: ``(·, 4)`` first and past-the-last phase, slot of the delay, to whom or -1.
        phases: ``(·, 3)`` slot of the duration, first and past-the-last change.
        changes: ``(·, 2)`` light, state.
        first_phases: by controller the phase that the start sets, -1 if none.
        first_time: slot of the start's date [s], -1 if it states none.
        time_passes: whether that date passes.
        absent: ``(E,)`` 1 for who is not there before it is added, else 0.
        comes_and_goes: whether there are such, or an entity is deleted or leaves.
        leaves: whether others than the ego are gone where their road ends; else they stand there.
        drives: ``(2,)`` whether the driver steers, and sets the speed, at the start.
        tows: ``(W, 2)`` which entity may tow which, each behind what it is towed by.
        towers: ``(E,)`` by which one each is towed at the start, -1 by none.
        couplings: ``(E, 2)`` where each tows and is towed, ahead of its reference point [m]; NaN
            where it cannot.
        stands_apart: ``(E,)`` whether it has a start of its own.
        weathers: ``(W, 8)`` slots of what each environment states, -1 for what it leaves as it was,
            see ``environments.py``; row 0 is the start's.
        limits: ``(K, 4)`` of the weather in the ego's operational design domain, see
            ``drivers/_odd_kernels``.
        driver: who drives the ego.
        vehicle: how its body moves, one of `bridgegen.simulation.vehicles.VEHICLES`.
        chassis: of a vehicle with dynamics, see ``_chassis_columns`` and ``_multi_body_columns``;
            else empty.
        ghosts: ``(G, 11)`` false positives of the ego's sensors, see
            `bridgegen.drivers._ghost_kernels`.
        tracker: ``(6,)`` slots, see `bridgegen.drivers._tracking_kernels`; empty if not stated.
        others: ``(E,)`` who drives each of the others, a code of
            `bridgegen.drivers.drivers`; the ego's is not looked at.
        time_step: [s].
        n_steps: recorded instants at most.
        fixed: parameters that rows may not vary, and what they are used for.
        event_names: of the V events, in the order of the file.
        notes: what runs otherwise than a reader of the file may expect, a sentence each.
        noise_key: of the driver's random numbers, if the file says it.
    """

    place: str
    names: tuple[str, ...]
    bodies: Float
    kinds: Int
    sirens: Int
    objects: Int
    parameters: Mapping[str, float]
    slots: tuple[Value, ...]
    init: Int
    paths: tuple[PathSpec, ...]
    routes: Int
    waypoints: tuple[tuple[Spot, ...], ...]
    lane_checks: tuple[LaneCheck, ...]
    start_slots: Int
    aside_slots: Int
    triggers: Int
    groups: Int
    conditions: Int
    probes: Int
    points: tuple[Point, ...]
    marks: Int
    clearances: Int
    ranges: Float
    elements: Int
    courses: Int
    entries: Int
    order: Int
    initial: Int
    actions: Int
    laterals: Int
    trajectories: Int
    follows: Int
    starts: Int
    places: Int
    layouts: Int
    anchors: Int
    shapes: Float
    most_vertices: int
    spots: tuple[Spot | None, ...]
    tows: Int
    towers: Int
    couplings: Float
    stands_apart: Int
    weathers: Int
    limits: Float
    values: Int
    lights: tuple[str, ...]
    first_states: npt.NDArray[np.int8]
    controllers: Int
    phases: Int
    changes: Int
    first_phases: Int
    first_time: int
    time_passes: int
    absent: Int
    comes_and_goes: bool
    leaves: bool
    drives: Int
    driver: Driver
    vehicle: str
    chassis: Float
    ghosts: Int
    tracker: Int
    others: Int
    time_step: float
    n_steps: int
    fixed: Mapping[str, str]
    event_names: tuple[str, ...] = ()
    noise_key: int | None = None
    notes: tuple[str, ...] = ()

    @property
    def attends(self) -> Int:
        """The numbers of the participants whose driver looks ahead."""
        return np.flatnonzero((self.others != SCRIPTED) & (self.others != TESTED))

    @property
    def tested(self) -> Int:
        """The numbers of the participants that the ego's driver drives, besides the ego."""
        return np.flatnonzero(self.others == TESTED)

    @property
    def actors(self) -> list[frozenset[int]]:
        """The entities that each of the V events moves."""
        found: list[set[int]] = [set() for _ in self.event_names]
        for element in self.elements:
            if element[KIND] == EVENT:
                for action in self.actions[element[FIRST] : element[LAST]]:
                    if action[DOES] < FIRST_GLOBAL:
                        found[element[EVENT_NUMBER]].add(int(action[WHOM]))
        return [frozenset(group) for group in found]

    @property
    def switches_lamps(self) -> bool:
        """Whether an action, or the ego's driver, switches indicators or brake lights."""
        stops = self.driver.manoeuvre and len(self.limits) > 0
        return bool(stops or (self.actions[:, DOES] == SWITCH).any())

    @property
    def looks_at_lanes(self) -> bool:
        """Whether conditions ask which lanes entities are on, or how these lie on their road."""
        kinds, systems = self.probes[:, PROBE], self.probes[:, SYSTEM]
        turns = np.isin(kinds, (ANGLE, RELATIVE_ANGLE)) & (systems == ROAD_SYSTEM)
        return bool((np.isin(kinds, (OFFROAD, CLEARANCE)) | turns).any())

    def changed(
        self, *, driver: Driver | None = None, dry: bool = False, kinematic: bool = False
    ) -> "Program":
        """Return the program with another driver, a road dry all the time, a kinematic vehicle."""
        changed = self
        if kinematic:
            changed = replace(changed, vehicle=KINEMATIC, chassis=np.zeros(0))
        if driver is not None and self.driver != STORYBOARD:
            changed = replace(changed, driver=driver)
        if dry:
            weathers = self.weathers.copy()
            weathers[:, FRICTION_SCALE] = UNSAID
            changed = replace(changed, weathers=weathers)
        return changed

    def trajectory_of(self, name: str) -> int:
        """Return the number of the one trajectory that an event has an entity follow."""
        mine = (self.actions[:, WHOM] == self.names.index(name)) & (self.actions[:, DOES] == FOLLOW)
        (number,) = self.actions[mine, ROW].tolist()
        return int(number)

    def on_course(self, courses: Mapping[str, Float]) -> "Program":
        """Return the program with other timed trajectories.

        Args:
            courses: ``(V, 4)`` time [s], x, y [m], heading [rad], by the name of an entity that
                follows one such trajectory.
        """
        paths = list(self.paths)
        for name, course in courses.items():
            path = int(self.trajectories[self.trajectory_of(name)])
            old = paths[path]
            assert isinstance(old, AlongTrajectory)
            points = tuple(WorldPoint(x, y, old.line, h) for _, x, y, h in course.tolist())
            paths[path] = replace(old, points=points, times=tuple(course[:, 0].tolist()))
        # Paths are planned for each road network by itself, so a course can differ from row to row
        # while the tables stay.
        return replace(self, paths=tuple(paths)) if courses else self

    @cached_property
    def box(self) -> Float:
        """``(E, 3)`` [m]: length, width, centre ahead of the reference point."""
        return np.ascontiguousarray(self.bodies[:, :3])

    def fill(self, values: Mapping[str, npt.ArrayLike], n_rows: int) -> Float:
        """Return the slots of N rows, ``(N, S)``.

        Args:
            values: ``(N,)`` per parameter; one that is missing keeps its declared value.
            n_rows: N.

        Raises:
            InputError: a value or an expression that is not finite, or a value for a parameter that
                rows may not vary.
        """
        columns: dict[str, Float] = {}
        for name, use in self.fixed.items():
            if name in values and np.any(np.asarray(values[name]) != self.parameters[name]):
                raise InputError(
                    f"{self.place}: parameter '{name}' is used for {use}, which must be the same "
                    f"in every row: {self.parameters[name]:g}"
                )
        for name, declared in self.parameters.items():
            given = np.asarray(values.get(name, declared), dtype=np.float64)
            if not np.isfinite(given).all():
                raise InputError(f"{self.place}: parameter '{name}' must be finite")
            columns[name] = np.ascontiguousarray(np.broadcast_to(given, n_rows))
        filled = np.empty((n_rows, len(self.slots)))
        for i, slot in enumerate(self.slots):
            if isinstance(slot, osc.ParameterRef | Expr):
                filled[:, i] = slot.resolve(columns)
                if not np.isfinite(filled[:, i]).all():
                    raise InputError(f"{self.place}: {slot} must be finite")
            else:
                filled[:, i] = float(slot)
        return filled
