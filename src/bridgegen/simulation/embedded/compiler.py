"""From an OpenSCENARIO file to a `Program`, or to all that the rollout cannot do with it."""

from collections.abc import Iterable, Iterator

import numpy as np

from bridgegen.ego import DRIVERS, STORYBOARD, Driver, is_spec, split
from bridgegen.errors import InputError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import (
    DEFAULT_TIME_STEP,
    DRIVER,
    IDEAL,
    NOISE_KEY,
    TIME_STEP,
)
from bridgegen.openx.openscenario.element import Element, walk
from bridgegen.openx.openscenario.pruning import strays, without
from bridgegen.openx.openscenario.resolve import texts_resolved
from bridgegen.simulation.embedded._codes import COURSE_WIDTH, DELAY, EVENT, WHOSE
from bridgegen.simulation.embedded.actions import CONTROLLING, Actions
from bridgegen.simulation.embedded.bodies import kind, measures
from bridgegen.simulation.embedded.controllers import Controllers
from bridgegen.simulation.embedded.courses import LONGITUDINAL, first_speed
from bridgegen.simulation.embedded.global_actions import GlobalActions
from bridgegen.simulation.embedded.positions import Positions
from bridgegen.simulation.embedded.program import (
    AlongLanes,
    AlongTrajectory,
    LanePoint,
    LaneSpot,
    Nowhere,
    PathSpec,
    Program,
)
from bridgegen.simulation.embedded.storyboard import elements, nodes
from bridgegen.simulation.embedded.tables import Tables, table
from bridgegen.simulation.embedded.trajectories import compile_trajectory
from bridgegen.simulation.embedded.triggers import MAX_STEPS, Triggers

DEFAULT_DURATION = 60.0  # s, of a file whose stop trigger names no simulation time
LEAST_STEP, MOST_STEP = 1e-4, 1.0  # s

Way = osc.AssignRouteAction | osc.AcquirePositionAction
"""What gives an entity a route."""


def compile_storyboard(
    scenario: osc.OpenScenario,
    place: str,
    *,
    driver: Driver | None = None,
    ideal: Iterable[str] | None = None,
    time_step: float | None = None,
    skipped: list[str] | None = None,
) -> Program:
    """Compile a scenario file.

    Args:
        scenario: the file, validated.
        place: its name, for messages.
        driver: who drives the ego, whatever the file says.
        ideal: its stages that are ideal, whatever the driver or the file says.
        time_step: [s], whatever the file says.
        skipped: takes a sentence for each thing that the rollout cannot do, which is left out then
            instead of refused, with what it is part of; never the ego.

    Raises:
        UnsupportedError: what the rollout cannot do, by name and line, all of it at once.
        InputError: an entity without a start, or no entity at all; stages that the driver has not.
    """
    while True:
        compiler = _Compiler(scenario, place)
        try:
            return compiler.compile(driver, ideal, time_step)
        except InputError as error:
            left = compiler.without_culprits(scenario)
            if skipped is None or left is scenario or not compiler.has_ego(left):
                raise
            skipped += error.problems
        while astray := strays(left):
            skipped += [
                f"{place}, line {one.line}: {type(one).__name__} of an entity that is not there"
                for one in astray
            ]
            left = without(left, astray)
        scenario = left


class _Compiler:
    def __init__(self, scenario: osc.OpenScenario, place: str) -> None:
        scenario, texts = texts_resolved(scenario)
        self.scenario = scenario
        self.place = place
        self.tables = Tables(scenario, place)
        self.tables.fixed |= texts
        self.paths: list[PathSpec] = []
        self.positions = Positions(self.tables, int(str(scenario.file_header.rev_minor)))
        self.everywhere = GlobalActions(self.tables, scenario)
        self.controllers = Controllers(self.tables, scenario)
        self.actions = Actions(
            self.tables, self.paths, self.positions, self.everywhere, self.controllers
        )
        self.starts: dict[int, int] = {}
        self.absent: list[int] = []
        self.routes: dict[int, int] = {}

    def without_culprits(self, scenario: osc.OpenScenario) -> osc.OpenScenario:
        """Return the scenario as it was given without what cannot be run."""
        culprits = {id(one) for one in self.tables.culprits}
        pairs = zip(walk(scenario), walk(self.scenario), strict=True)  # one is resolved
        return without(scenario, [one for one, other in pairs if id(other) in culprits])

    def has_ego(self, left: osc.OpenScenario) -> bool:
        """Say whether a scenario still has the entity that is this one's ego."""
        return self.tables.names[:1] == Tables(left, self.place).names[:1]

    def compile(
        self, driver: Driver | None, ideal: Iterable[str] | None, time_step: float | None
    ) -> Program:
        if not self.tables.objects:
            raise InputError(f"{self.place}: a scenario needs at least one entity, got none")
        step = self._declared_time_step() if time_step is None else time_step
        if not LEAST_STEP <= step <= MOST_STEP:
            raise InputError(
                f"{self.place}: {LEAST_STEP:g} <= time_step <= {MOST_STEP:g} [s] must hold, got "
                f"{step:g}"
            )
        storyboard = self.scenario.storyboard
        found = nodes(storyboard)
        self.triggers = Triggers(self.tables, step, found, self.positions, self.everywhere)
        objects = [one.entity_object for one in self.tables.objects]
        bodies = np.array([measures(self.tables, one) for one in objects])
        has_driver = (driver or self._declared_driver()) is not STORYBOARD
        self.controllers.has_driver, self.controllers.replaces = has_driver, driver is not None
        init = self._init(has_driver)
        chosen = driver or self._declared_driver()
        self.controllers.has_driver = has_driver = chosen is not STORYBOARD
        if driver and self.actions.is_timed(0):
            self.tables.problems.append(
                f"{self.place}: the driver '{driver.name}' cannot drive an ego that follows a "
                "trajectory with times"
            )
        if self.tables.problems:
            raise UnsupportedError(*self.tables.problems)
        start_slots = [
            self.tables.slot(path.start.s) if isinstance(path, AlongLanes) else -1
            for path in self.paths
        ]
        aside_slots = [self._aside_slot(path) for path in self.paths]
        if has_driver:  # its path runs there
            aside_slots[0] = -1
        self.triggers.add(storyboard.stop_trigger)
        duration = self.triggers.stop_time or DEFAULT_DURATION
        rows = elements(found, self.tables, self.triggers, self.actions)
        self.actions.refuse_driven()
        trajectories = [p for p, one in enumerate(self.paths) if isinstance(one, AlongTrajectory)]
        follows = [
            trajectories.index(e) if self.actions.is_timed(e) else -1 for e in range(len(objects))
        ]
        n_steps = round(duration / step) + 1
        if not 2 <= n_steps <= MAX_STEPS:
            self.tables.problems.append(
                f"{self.place}: the stop trigger's simulation time must take 1 to {MAX_STEPS} "
                f"steps of {step} s, got {duration} s"
            )
        if self.tables.problems:
            raise UnsupportedError(*self.tables.problems)
        conditions = table(self.triggers.conditions, 5)
        conditions[:, DELAY] = np.minimum(conditions[:, DELAY], n_steps)
        everywhere, signals = self.everywhere, self.everywhere.signals
        time = everywhere.first_time
        first_time = -1 if time is None else self.tables.slot(time[0])
        return Program(
            place=self.place,
            names=self.tables.names,
            bodies=bodies,
            objects=np.array([self.tables.type_of(one) for one in objects], dtype=np.int64),
            kinds=np.array([kind(one) for one in objects], dtype=np.int64),
            parameters=self.tables.parameters,
            slots=self.tables.slots,
            init=np.array(init, dtype=np.int64),
            paths=tuple(self.paths),
            routes=np.array([self.routes.get(e, 0) for e in range(len(objects))], dtype=np.int64),
            waypoints=tuple(self.actions.routes),
            lane_checks=tuple(self.actions.lane_checks),
            start_slots=np.array(start_slots, dtype=np.int64),
            aside_slots=np.array(aside_slots, dtype=np.int64),
            triggers=table(self.triggers.triggers, 2),
            groups=table(self.triggers.groups, 2),
            conditions=conditions,
            probes=table(self.triggers.probes, 11),
            points=tuple(self.positions.points),
            marks=np.array(self.triggers.looks.marks, dtype=np.int64),
            clearances=table(self.triggers.looks.clearances, 3 + len(objects)),
            ranges=np.array(self.triggers.looks.ranges, dtype=np.float64).reshape(-1, 2),
            elements=table(rows, 10),
            courses=table(self.actions.courses.rows, COURSE_WIDTH),
            entries=table(self.actions.courses.entries, 2),
            order=np.array(self.actions.courses.order(), dtype=np.int64),
            initial=np.array(self.actions.initial, dtype=np.int64),
            actions=table(self.actions.rows, 8),
            laterals=table(self.actions.laterals, 3),
            trajectories=np.array(trajectories, dtype=np.int64),
            follows=np.array(follows, dtype=np.int64),
            starts=table(self._ordered_starts(), 2),
            places=table(self.positions.rows, 8),
            spots=tuple(self.positions.spots),
            weathers=everywhere.environments.rows,
            values=np.array(everywhere.values.slots, dtype=np.int64),
            lights=tuple(signals.lights),
            first_states=np.array(signals.first_states, dtype=np.int8),
            controllers=table(signals.controllers, 4),
            phases=table(signals.phases, 3),
            changes=table(signals.changes, 2),
            first_phases=np.array(
                [everywhere.first_phases.get(c, -1) for c in range(len(signals.controllers))],
                dtype=np.int64,
            ),
            first_time=first_time,
            time_passes=int(time is not None and time[1]),
            absent=np.array([e in self.absent for e in range(len(objects))], dtype=np.int64),
            comes_and_goes=bool(self.absent) or self.actions.has_comings_and_goings,
            drives=np.array(self.controllers.drives, dtype=np.int64),
            driver=chosen if ideal is None else chosen.idealised(ideal),
            time_step=step,
            n_steps=n_steps,
            fixed=self.tables.fixed,
            event_names=tuple(one.path[-1] for one in found if one.kind == EVENT),
            noise_key=self._declared_noise_key(),
        )

    def _ordered_starts(self) -> list[tuple[int, int]]:
        """Return who starts at which position, after those whose place it counts from."""
        found: list[tuple[int, int]] = []
        left = dict(self.starts)
        while left:
            ready = [
                e for e, place in left.items() if self.positions.rows[place][WHOSE] not in left
            ]
            if not ready:
                names = ", ".join(f"'{self.tables.names[e]}'" for e in left)
                raise InputError(f"{self.place}: the starts of {names} depend on one another")
            found += [(e, left.pop(e)) for e in ready]
        return found

    def _aside_slot(self, path: PathSpec) -> int:
        """Return the slot of how far who is on a path is beside it; -1 if on it."""
        if not isinstance(path, AlongLanes) or path.aside == 0.0:
            return -1
        return self.tables.slot(path.aside)

    def _declared_time_step(self) -> float:
        properties = self.scenario.file_header.properties
        text = properties.get(TIME_STEP) if properties else None
        if text is None:
            return DEFAULT_TIME_STEP
        try:
            value = float(str(text))
        except ValueError:
            value = 0.0
        if not LEAST_STEP <= value <= MOST_STEP:
            raise InputError(
                f"{self.place}: {LEAST_STEP:g} <= time_step <= {MOST_STEP:g} [s] must hold, got "
                f"'{text}' (FileHeader)"
            )
        return value

    def _declared_driver(self) -> Driver:
        if self.actions.is_timed(0):
            return STORYBOARD
        for controller in self.controllers.of_ego():
            properties = controller.properties
            name = properties.get(DRIVER) if properties else None
            if name is not None:
                if is_spec(str(name)):
                    raise UnsupportedError(
                        f"{self.place}, line {controller.line}: the ego is driven by '{name}', "
                        f"which is code; to run it, name it: --ego {name}"
                    )
                if str(name) not in DRIVERS:
                    raise UnsupportedError(
                        f"{self.place}, line {controller.line}: unknown ego driver '{name}'; "
                        f"known: {', '.join(DRIVERS)} (choose one with --ego)"
                    )
                stages = split(str(properties.get(IDEAL) or "")) if properties else ()
                try:
                    return DRIVERS[str(name)].idealised(stages)
                except InputError as error:
                    raise InputError(
                        f"{self.place}, line {controller.line}: property {IDEAL}: {error}"
                    ) from None
        return STORYBOARD

    def _declared_noise_key(self) -> int | None:
        for controller in self.controllers.of_ego():
            properties = controller.properties
            text = properties.get(NOISE_KEY) if properties else None
            if text is not None:
                if not (str(text).isdecimal() and int(str(text)) < 2**64):
                    raise InputError(
                        f"{self.place}, line {controller.line}: property {NOISE_KEY} must be a "
                        f"whole number from 0 to 2^64 - 1, got '{text}'"
                    )
                return int(str(text))
        return None

    def _init(self, has_driver: bool) -> list[int]:
        """Compile the start; return the slots of the entities' speeds."""
        actions = self.scenario.storyboard.init.actions
        for command in actions.user_defined_actions:
            self.tables.unsupported(command, "UserDefinedAction")
        for one in actions.global_actions:
            if not isinstance(one.action, osc.EntityAction):
                self.actions.begin_with_all(one.action)
        init = dict.fromkeys(self.tables.names, self.tables.slot(0.0))
        starts = dict(self._added(actions.global_actions))
        routes: dict[str, Way] = {}
        tracks: dict[str, AlongTrajectory] = {}
        first: list[tuple[osc.PrivateAction, int]] = []
        for private in actions.privates:
            name = str(private.entity_ref)
            for wrapped in private.private_actions:
                action = wrapped.action
                if isinstance(action, osc.TeleportAction):
                    whose = getattr(action.position.position, "entity_ref", None)
                    if name in starts and whose is not None and self.tables.text(whose) == name:
                        first.append((wrapped, self.tables.entity(name)))  # from where it is put
                    else:
                        starts[name] = action.position
                    continue
                if isinstance(action, CONTROLLING):
                    self.controllers.begin(action, self.tables.entity(name))
                    continue
                inner = getattr(action, "action", action)
                if isinstance(inner, LONGITUDINAL):
                    speed = first_speed(inner)
                    if speed is None:
                        first.append((wrapped, self.tables.entity(name)))
                    else:
                        init[name] = self.tables.slot(speed)
                elif isinstance(action, osc.LateralAction):
                    first.append((wrapped, self.tables.entity(name)))
                elif isinstance(inner, osc.FollowTrajectoryAction):
                    tracks[name] = compile_trajectory(self.tables, inner)
                elif isinstance(inner, Way):
                    routes[name] = inner
                else:
                    self.tables.unsupported(inner, f"an initial {type(inner).__name__}")
        later = dict(self._added(walk(self.scenario.storyboard)))
        self.absent = [
            e
            for e, name in enumerate(self.tables.names)
            if name not in {*starts, *tracks} and name in later and not (e == 0 and has_driver)
        ]
        waiting = {self.tables.names[e] for e in self.absent}
        self.absent += self._deleted(actions.global_actions)
        missing = [name for name in self.tables.names if name not in {*starts, *tracks, *waiting}]
        if missing and not self.tables.problems:
            self.tables.culprits += [one for one in self.tables.objects if str(one.name) in missing]
            raise InputError(
                *(
                    f"{self.place}: entity '{name}' needs an initial TeleportAction, or "
                    "an AddEntityAction"
                    for name in missing
                )
            )
        for e, name in enumerate(self.tables.names):
            if name in tracks:  # there it starts
                self.paths.append(tracks[name])
            elif name in starts:
                self.paths.append(self._start(e, starts[name], routes.get(name), has_driver))
            elif name in waiting:
                self.paths.append(self._nowhere(e, routes.get(name)))
        for one_more, entity in first:
            self.actions.begin(one_more, entity)
        return [init[name] for name in self.tables.names]

    def _added(self, elements: Iterable[Element]) -> Iterator[tuple[str, osc.Position]]:
        """Yield whom actions among some elements add, and where."""
        for one in elements:
            action = one.action if isinstance(one, osc.GlobalAction) else None
            if isinstance(action, osc.EntityAction) and isinstance(
                action.action, osc.AddEntityAction
            ):
                yield self.tables.text(action.entity_ref), action.action.position

    def _deleted(self, actions: Iterable[osc.GlobalAction]) -> list[int]:
        """Return the entities that are deleted at the start."""
        return [
            self.tables.entity(one.action.entity_ref)
            for one in actions
            if isinstance(one.action, osc.EntityAction)
            and isinstance(one.action.action, osc.DeleteEntityAction)
        ]

    def _nowhere(self, e: int, route: Way | None) -> Nowhere:
        """Return the path of an entity that is not there yet; it keeps the route that it gets."""
        if route is not None and (spots := self.actions.waypoints(route)):
            self.routes[e] = self.actions.add_route(spots)
        return Nowhere()

    def _start(
        self,
        e: int,
        position: osc.Position,
        route: Way | None,
        has_driver: bool,
    ) -> PathSpec:
        """Return the path that an entity starts on: along its lane, as far as the file tells."""
        where = position.position
        spots = () if route is None else self.actions.waypoints(route)
        if spots:
            self.routes[e] = self.actions.add_route(spots)
        if not isinstance(where, osc.LanePosition) or not _faces_ahead(where.orientation):
            self.starts[e] = self.positions.add(position)
            return Nowhere()
        point, aside = self.tables.point(position)
        if has_driver and e == 0:  # it keeps to its path
            aside = self.tables.literal(where, "offset", aside)
        if not isinstance(point, LanePoint):
            return Nowhere()
        via = tuple(
            LanePoint(one.road, one.lane, one.s, one.line)
            for one in spots
            if isinstance(one, LaneSpot) and one.s is not None
        )
        if len(via) < len(spots):
            self.starts[e] = self.positions.add(position)
            return Nowhere()
        return AlongLanes(point, via, aside)


def _faces_ahead(turned: osc.Orientation | None) -> bool:
    """Say whether an orientation on a lane is the lane's."""
    if turned is None or turned.h is None:
        return True
    return turned.h == 0.0 and turned.type is not osc.ReferenceContext.ABSOLUTE
