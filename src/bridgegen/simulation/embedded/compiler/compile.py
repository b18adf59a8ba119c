"""From an OpenSCENARIO file to a `Program`, or to all that the rollout cannot do with it."""

from collections.abc import Iterable, Sequence

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.drivers import STORYBOARD, Driver
from bridgegen.drivers.drivers import CODES, SCRIPTED, TESTED
from bridgegen.drivers.kinds import IS_VEHICLE, NAMES
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.pruning import is_empty, strays, without
from bridgegen.openx.openscenario.resolve import texts_resolved
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded._codes import (
    COURSE_WIDTH,
    DELAY,
    END_OF_ROAD,
    EVENT,
    PROBE,
)
from bridgegen.simulation.embedded.chassis.multi_body import CLASS, multi_body_of
from bridgegen.simulation.embedded.chassis.parameters import CLASSES, chassis_of
from bridgegen.simulation.embedded.compiler import declared
from bridgegen.simulation.embedded.compiler.actions import Actions
from bridgegen.simulation.embedded.compiler.controllers import Controllers
from bridgegen.simulation.embedded.compiler.declared import Node, nodes
from bridgegen.simulation.embedded.compiler.global_actions import GlobalActions
from bridgegen.simulation.embedded.compiler.layouts import (
    Body,
    Towing,
    has_siren,
    kind,
    limits_of,
    measures,
    wheelbase,
)
from bridgegen.simulation.embedded.compiler.positions import Positions
from bridgegen.simulation.embedded.compiler.probes import MAX_STEPS, Triggers
from bridgegen.simulation.embedded.compiler.start import Start
from bridgegen.simulation.embedded.compiler.tables import Tables, table
from bridgegen.simulation.embedded.program import (
    AlongLanes,
    AlongTrajectory,
    PathSpec,
    Program,
)
from bridgegen.simulation.vehicles import KINEMATIC, MULTI_BODY

# --- The storyboard as a table: stories, acts, groups, maneuvers, events, actions ---


_PRIORITIES = {
    osc.Priority.OVERWRITE: codes.OVERRIDE,
    osc.Priority.OVERRIDE: codes.OVERRIDE,
    osc.Priority.SKIP: codes.SKIP,
    osc.Priority.PARALLEL: codes.PARALLEL,
}


def elements(
    found: Sequence[Node], tables: Tables, triggers: Triggers, actions: Actions
) -> list[tuple[int, ...]]:
    """Compile all elements; return them as ``Program.elements`` has them."""
    rows: list[list[int]] = []
    group: osc.ManeuverGroup | None = None
    act_start = n_events = 0
    for node in found:
        part = node.part
        start = stop = number = -1
        priority, count, first = 0, 1, len(actions.rows)
        if isinstance(part, osc.Act | osc.Event) and is_empty(part.start_trigger):
            tables.note(
                part,
                f"the {type(part).__name__} {part.name} has an empty StartTrigger, so it never "
                "starts; esmini starts it at once, and so does --empty-trigger now",
            )
        if isinstance(part, osc.Act):
            act_start = start = triggers.add(part.start_trigger)
            if part.stop_trigger is not None and part.stop_trigger.condition_groups:
                stop = triggers.add(part.stop_trigger)
        elif isinstance(part, osc.ManeuverGroup):
            group, start = part, act_start
            count = _count(tables, part)
        elif isinstance(part, osc.Event):
            number, n_events = n_events, n_events + 1
            priority, count = _priority(tables, part), _count(tables, part)
            start = act_start if part.start_trigger is None else triggers.add(part.start_trigger)
        elif isinstance(part, osc.Action):
            assert group is not None  # actions are in events, events in groups
            count, event = 0, rows[node.parent]
            named, selected = _actors(tables, group, triggers.entities(event[codes.START]))
            actions.add(part, named, selected)
            event[codes.LAST] = len(actions.rows)
        last = len(actions.rows)
        rows.append(
            [node.kind, node.parent, node.end, start, stop, priority, count, first, last, number]
        )
    return [tuple(row) for row in rows]


def _count(tables: Tables, part: osc.ManeuverGroup | osc.Event) -> int:
    """Return how often an element may run; the standard's default is once."""
    if part.maximum_execution_count is None:
        return 1
    return int(tables.literal(part, "maximumExecutionCount", part.maximum_execution_count))


def _priority(tables: Tables, event: osc.Event) -> int:
    return _PRIORITIES[tables.choice(osc.Priority, event.priority)]


def _actors(
    tables: Tables, group: osc.ManeuverGroup, triggering: Sequence[int]
) -> tuple[list[int], list[int]]:
    """Return a group's actors, and those that act only if they make the event's trigger fire."""
    refs = group.actors.entity_refs
    named = list(dict.fromkeys(e for ref in refs for e in tables.members(ref.entity_ref)))
    selects = tables.truth(group.actors.select_triggering_entities)
    return named, [e for e in triggering if e not in named] if selects else []


DEFAULT_DURATION = 60.0  # s, of a file whose stop trigger names no simulation time


def compile_storyboard(
    scenario: osc.OpenScenario,
    place: str,
    *,
    driver: Driver | None = None,
    ideal: Iterable[str] | None = None,
    others: str | None = None,
    vehicle: str | None = None,
    time_step: float | None = None,
    skipped: list[str] | None = None,
    ego: int = 0,
) -> Program:
    """Compile a scenario file.

    Args:
        scenario: the file, validated.
        place: its name, for messages.
        driver: who drives the ego, whatever the file says.
        ideal: its stages that are ideal, whatever the driver or the file says.
        others: a name of `bridgegen.drivers.drivers.OTHERS`: who drives all other participants,
            whatever the file says; those that cannot look ahead are scripted.
        vehicle: how the ego moves, whatever the file says; see `bridgegen.simulation.vehicles`.
        time_step: [s], whatever the file says.
        skipped: takes a sentence for each thing that the rollout cannot do, which is left out then
            instead of refused, with what it is part of; never the ego.
        ego: number of an entity that changes places with the file's ego, whose driver drives it.

    Raises:
        UnsupportedError: what the rollout cannot do, by name and line, all of it at once.
        InputError: an entity without a start, or no entity at all; stages that the driver has not.
    """
    # What was cut may have been what another element waits for, so the rest is compiled again,
    # until nothing is left to cut.
    while True:
        compiler = _Compiler(scenario, place, ego)
        try:
            return compiler.compile(driver, ideal, others, vehicle, time_step)
        except InputError as error:
            left = compiler.without_culprits(scenario)
            if skipped is None or left is scenario or not compiler.has_ego(left):
                raise
            skipped += error.problems
        while astray := strays(left):
            skipped += [
                f"{place}, line {element.line}: {type(element).__name__} of an entity that is not "
                "there"
                for element in astray
            ]
            left = without(left, astray)
        scenario = left


class _Compiler:
    def __init__(self, scenario: osc.OpenScenario, place: str, ego: int) -> None:
        scenario, texts = texts_resolved(scenario)
        self.scenario = scenario
        self.place = place
        self.tables = Tables(scenario, place, ego)
        self.tables.fixed |= texts
        self.paths: list[PathSpec] = []
        self.positions = Positions(self.tables, int(str(scenario.file_header.rev_minor)))
        self.global_actions = GlobalActions(self.tables, scenario)
        self.controllers = Controllers(self.tables, scenario)
        self.towing = Towing(self.tables)
        self.actions = Actions(
            self.tables,
            self.paths,
            self.positions,
            self.global_actions,
            self.controllers,
            self.towing,
        )
        self.start = Start(
            self.tables, self.paths, self.positions, self.actions, self.controllers, self.towing
        )

    def without_culprits(self, scenario: osc.OpenScenario) -> osc.OpenScenario:
        """Return the scenario as it was given without what cannot be run."""
        culprits = {id(culprit) for culprit in self.tables.culprits}
        pairs = zip(walk(scenario), walk(self.scenario), strict=True)  # one is resolved
        return without(scenario, [pair for pair, other in pairs if id(other) in culprits])

    def has_ego(self, left: osc.OpenScenario) -> bool:
        """Return whether a scenario still has the entity that is this one's ego."""
        return self.tables.names[:1] == Tables(left, self.place).names[:1]

    def compile(
        self,
        driver: Driver | None,
        ideal: Iterable[str] | None,
        others: str | None,
        vehicle: str | None,
        time_step: float | None,
    ) -> Program:
        if not self.tables.objects:
            raise InputError(f"{self.place}: a scenario needs at least one entity, got none")
        step = declared.time_step(self.scenario, self.place, time_step)
        storyboard = self.scenario.storyboard
        found = nodes(storyboard)
        self.triggers = Triggers(self.tables, step, found, self.positions, self.global_actions)
        objects = [obj.entity_object for obj in self.tables.objects]
        bodies = np.array([measures(self.tables, obj) for obj in objects])
        has_driver = (driver or self._declared_driver()) is not STORYBOARD
        self.controllers.has_driver, self.controllers.replaces = has_driver, driver is not None
        self.towing.compile()
        self.start.compile(storyboard, has_driver)
        chosen = driver or self._declared_driver()
        self.controllers.has_driver = has_driver = chosen is not STORYBOARD
        # Positions by a timetable leave nothing to a driver.
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
        # Trigger 0 ends the scenario; without any, it never fires.
        self.triggers.add(storyboard.stop_trigger or osc.Trigger(()))
        duration = self.triggers.stop_time or DEFAULT_DURATION
        rows = elements(found, self.tables, self.triggers, self.actions)
        self.actions.refuse_driven()
        trajectories = [
            p for p, lanes in enumerate(self.paths) if isinstance(lanes, AlongTrajectory)
        ]
        follows = [
            trajectories.index(e) if self.actions.is_timed(e) else -1 for e in range(len(objects))
        ]
        others_drivers = self._others(objects, others)
        if (others_drivers == TESTED).any() and not has_driver:
            self.tables.problems.append(
                f"{self.place}: the ego's driver drives others, too, and the ego has none (--ego)"
            )
        n_steps = round(min(duration / step, MAX_STEPS)) + 1
        if not 2 <= n_steps <= MAX_STEPS:
            self.tables.problems.append(
                f"{self.place}: the stop trigger's simulation time must take 1 to {MAX_STEPS} "
                f"steps of {step} s, got {duration} s"
            )
        if self.tables.problems:
            raise UnsupportedError(*self.tables.problems)
        conditions = table(self.triggers.conditions, 5)
        # The history of conditions is as long as the longest delay; one beyond the end is never
        # over.
        conditions[:, DELAY] = np.minimum(conditions[:, DELAY], n_steps)
        global_actions, signals = self.global_actions, self.global_actions.signals
        time, tows = global_actions.first_time, self.towing.tows()
        first_time = -1 if time is None else self.tables.slot(time[0])
        waits = (table(self.triggers.probes, 11)[:, PROBE] == END_OF_ROAD).any()
        leaves = len(objects) > 1 and not waits and not declared.stands(self.scenario, self.place)
        ghosts = declared.ghosts(self.controllers, self.tables)  # before the slots are read
        tracker = declared.tracker(self.controllers, self.tables)
        moves = declared.vehicle(self.controllers, self.place, vehicle, has_driver=has_driver)
        return Program(
            place=self.place,
            names=self.tables.names,
            bodies=bodies,
            objects=np.array([self.tables.type_of(obj) for obj in objects], dtype=np.int64),
            kinds=np.array([kind(obj) for obj in objects], dtype=np.int64),
            sirens=np.array([has_siren(obj) for obj in objects], dtype=np.int64),
            parameters=self.tables.parameters,
            slots=self.tables.slots,
            init=np.array(self.start.speeds, dtype=np.int64),
            paths=tuple(self.paths),
            routes=np.array(
                [self.start.routes.get(e, 0) for e in range(len(objects))], dtype=np.int64
            ),
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
            starts=table(self.start.ordered_places(), 2),
            places=table(self.positions.rows, 8),
            layouts=self.actions.layouts.rows,
            anchors=self.actions.layouts.anchors,
            shapes=self.actions.layouts.shapes,
            most_vertices=self.actions.layouts.most_vertices,
            spots=tuple(self.positions.spots),
            tows=tows,
            towers=self.towing.towers,
            couplings=self.towing.couplings(),
            stands_apart=np.array(self.start.apart, dtype=np.int64),
            weathers=global_actions.environments.rows,
            limits=limits_of(
                objects[self.tables.ego], self.place
            ),  # of the system, not of its body
            values=np.array(global_actions.values.slots, dtype=np.int64),
            lights=tuple(signals.lights),
            first_states=np.array(signals.first_states, dtype=np.int8),
            controllers=table(signals.controllers, 4),
            phases=table(signals.phases, 3),
            changes=table(signals.changes, 2),
            first_phases=np.array(
                [global_actions.first_phases.get(c, -1) for c in range(len(signals.controllers))],
                dtype=np.int64,
            ),
            first_time=first_time,
            time_passes=int(time is not None and time[1]),
            absent=np.array([e in self.start.absent for e in range(len(objects))], dtype=np.int64),
            comes_and_goes=bool(self.start.absent)
            or self.actions.has_comings_and_goings
            or leaves
            or len(tows) > 0,
            leaves=leaves,
            drives=np.array(self.controllers.drives, dtype=np.int64),
            driver=chosen if ideal is None else chosen.idealised(ideal),
            vehicle=moves,
            chassis=self._chassis(moves, objects[0], bodies[0], tows),
            ghosts=ghosts,
            tracker=tracker,
            others=others_drivers,
            time_step=step,
            n_steps=n_steps,
            fixed=self.tables.fixed,
            event_names=tuple(node.path[-1] for node in found if node.kind == EVENT),
            noise_key=declared.noise_key(self.controllers, self.place),
            notes=tuple(self.tables.notes),
        )

    def _aside_slot(self, path: PathSpec) -> int:
        """Return the slot of how far who is on a path is beside it; -1 if on it."""
        if not isinstance(path, AlongLanes) or path.aside == 0.0:
            return -1
        return self.tables.slot(path.aside)

    def _chassis(self, vehicle: str, body: Body, measured: Float, tows: Int) -> Float:
        """Return the ego's ``Program.chassis``.

        Raises:
            InputError: there is no model with dynamics of such a body.
        """
        if vehicle == KINEMATIC:
            return np.zeros(0)
        what, has_trailer = NAMES[kind(body)], bool((tows == 0).any())
        known = [CLASS] if vehicle == MULTI_BODY else list(CLASSES)
        if what not in known or has_trailer:
            what = "vehicle with a trailer" if has_trailer else what
            raise InputError(
                f"{self.place}: the vehicle '{vehicle}' must be a {' or '.join(known)} without a "
                f"trailer, the ego is a {what} (--vehicle {KINEMATIC})"
            )
        assert isinstance(body, osc.Vehicle)
        if vehicle == MULTI_BODY:
            return multi_body_of(wheelbase(self.tables, body), measured)
        return chassis_of(what, wheelbase(self.tables, body), measured)

    def _others(self, objects: Sequence[Body], others: str | None) -> Int:
        """Return who drives each participant but the ego, see ``Program.others``."""
        found = np.full(len(objects), SCRIPTED, dtype=np.int64)
        for e, (name, body) in enumerate(zip(self.tables.names, objects, strict=True)):
            if e == 0:
                continue
            mine = e == self.tables.ego  # the file's ego, in another's place
            said = "ego" if mine else declared.other_driver(self.controllers, self.place, e, name)
            lacks = self._lacks_for_attention(e, body)
            if said == "ego" and not (lacks or IS_VEHICLE[kind(body)]):
                lacks = "it is no vehicle"
            if others is not None and said != "ego":
                found[e] = SCRIPTED if lacks else CODES[others]
            elif said not in (None, "scripted") and lacks:
                self.tables.problems.append(
                    f"{self.place}: '{name}' cannot have the driver '{said}': {lacks}"
                )
            elif said is not None:
                found[e] = CODES[said]
        return found

    def _lacks_for_attention(self, e: int, body: Body) -> str:
        """Return why a participant cannot have an attentive driver; empty if it can."""
        if isinstance(body, osc.MiscObject | osc.ExternalObjectReference):
            return "it is an object, which does not move by itself"
        if self.actions.is_timed(e):
            return "it follows a trajectory with times"
        if isinstance(body, osc.Vehicle) and (body.trailer or self.towing.towers[e] >= 0):
            return "it tows, or is towed"
        drives = IS_VEHICLE[kind(body)]
        if drives and isinstance(self.paths[e], AlongTrajectory):
            return "it follows a trajectory, and is on no lane"
        return ""

    def _declared_driver(self) -> Driver:
        """Return the file's driver; the storyboard, where the ego follows a timetable."""
        if self.actions.is_timed(0):
            return STORYBOARD
        return declared.driver(self.controllers, self.place)
