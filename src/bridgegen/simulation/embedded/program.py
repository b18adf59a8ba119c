"""An OpenSCENARIO file compiled for the rollout: integer tables, and the values that rows may vary.

``slots`` are the distinct values that the tables refer to: literals, ``$name`` references and
``${…}`` expressions. A batch of N rows of parameters fills them to an ``(N, S)`` array, and the
compiled storyboard runs over it unchanged. Roads enter only in ``network.py``.
"""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Float, Int
from bridgegen.ego import DRIVERS, Driver
from bridgegen.errors import InputError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.from_owl import TIME_STEP
from bridgegen.openx.openscenario.values import Expr, Value

DEFAULT_TIME_STEP = 0.05  # s
DEFAULT_DURATION = 60.0  # s, of a file whose stop trigger names no simulation time
MAX_STEPS = 100_000

_RULES = {
    osc.Rule.GREATER_THAN: 0, osc.Rule.LESS_THAN: 1, osc.Rule.EQUAL_TO: 2,
    osc.Rule.GREATER_OR_EQUAL: 3, osc.Rule.LESS_OR_EQUAL: 4, osc.Rule.NOT_EQUAL_TO: 5,
}  # fmt: skip
_EDGES = {
    osc.ConditionEdge.NONE: 0, osc.ConditionEdge.RISING: 1,
    osc.ConditionEdge.FALLING: 2, osc.ConditionEdge.RISING_OR_FALLING: 3,
}  # fmt: skip
_SIMULATION_TIME, _RELATIVE_DISTANCE, _REACH_POSITION = 0, 1, 2
_STEP, _LINEAR_RATE, _LINEAR_TIME = 0, 1, 2


@dataclass(frozen=True)
class LanePoint:
    """A point on a lane: OpenDRIVE road id, lane id, and a slot or a number for s [m]."""

    road: str
    lane: int
    s: Value
    line: int


@dataclass(frozen=True)
class Program:
    """A compiled storyboard.

    Attributes:
        place: the file, for messages.
        names: E entities, the ego first.
        bodies: ``(E, 7)``: length, width, centre ahead of the reference point, wheelbase [m],
            maximum speed [m/s], acceleration and deceleration [m/s²].
        parameters: the numeric parameters with their declared values.
        slots: S distinct values.
        init: ``(E,)`` slot of each entity's initial speed.
        starts: where each entity starts.
        start_slots: ``(E,)`` slot of each start's s.
        routes: the waypoints of each entity's route; empty: straight on from its start.
        triggers: ``(·, 2)`` first and past-the-last group; trigger 0 stops the scenario.
        groups: ``(·, 2)`` first and past-the-last condition.
        conditions: ``(C, 7)`` kind, entity, other entity, rule, slot, edge, delay in steps.
        points: per condition the position to be reached, or None.
        acts: ``(A,)`` start trigger.
        events: ``(·, 6)`` act, trigger, entity, shape, slot of the target, slot of its dynamics.
        friction_slot: of the road's friction scale factor, -1 if the file has none.
        driver: who drives the ego.
        time_step: [s].
        n_steps: recorded instants at most.
    """

    place: str
    names: tuple[str, ...]
    bodies: Float
    parameters: Mapping[str, float]
    slots: tuple[Value, ...]
    init: Int
    starts: tuple[LanePoint, ...]
    start_slots: Int
    routes: tuple[tuple[LanePoint, ...], ...]
    triggers: Int
    groups: Int
    conditions: Int
    points: tuple[LanePoint | None, ...]
    acts: Int
    events: Int
    friction_slot: int
    driver: Driver
    time_step: float
    n_steps: int

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
            InputError: an expression that has no finite value.
        """
        columns: dict[str, Float] = {}
        for name, declared in self.parameters.items():
            given = np.asarray(values.get(name, declared), dtype=np.float64)
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


def compile_storyboard(
    scenario: osc.OpenScenario,
    place: str,
    *,
    driver: Driver | None = None,
    time_step: float | None = None,
) -> Program:
    """Compile a scenario file.

    Args:
        scenario: the file, validated.
        place: its name, for messages.
        driver: who drives the ego, whatever the file says.
        time_step: [s], whatever the file says.

    Raises:
        UnsupportedError: what the rollout cannot do, by name and line, all of it at once.
        InputError: an entity without a start, or no entity at all.
    """
    return _Compiler(scenario, place).compile(driver, time_step)


class _Compiler:
    def __init__(self, scenario: osc.OpenScenario, place: str) -> None:
        self.scenario = scenario
        self.place = place
        self.problems: list[str] = []
        self.slots: dict[tuple[type, Value], int] = {}
        self.groups: list[tuple[int, int]] = []
        self.conditions: list[tuple[int, ...]] = []
        self.points: list[LanePoint | None] = []
        self.triggers: list[tuple[int, int]] = []
        self.stop_time = 0.0
        objects = scenario.entities.scenario_objects
        self.objects = sorted(objects, key=lambda one: not _is_ego(one))
        self.names = tuple(str(one.name) for one in self.objects)
        declared = scenario.parameter_declarations
        self.parameters: dict[str, float] = {}
        for one in declared.parameters if declared else ():
            try:
                self.parameters[str(one.name)] = float(one.value)
            except ValueError:
                continue  # a text, a date or a truth value: no number of the rollout
        self.time_step = DEFAULT_TIME_STEP

    def compile(self, driver: Driver | None, time_step: float | None) -> Program:
        if not self.objects:
            raise InputError(f"{self.place}: a scenario needs at least one entity, got none")
        self.time_step = time_step or self._declared_time_step()
        bodies = np.array([self._body(one.entity_object) for one in self.objects])
        init, starts, routes, friction = self._init()
        if self.problems:
            raise UnsupportedError(*self.problems)
        start_slots = [self.slot(one.s) for one in starts]
        storyboard = self.scenario.storyboard
        self._trigger(storyboard.stop_trigger)
        duration = self.stop_time or DEFAULT_DURATION
        acts, events = self._stories(storyboard)
        n_steps = round(duration / self.time_step) + 1
        if not 2 <= n_steps <= MAX_STEPS:
            self.problems.append(
                f"{self.place}: the stop trigger's simulation time must take 1 to {MAX_STEPS} "
                f"steps of {self.time_step} s, got {duration} s"
            )
        if self.problems:
            raise UnsupportedError(*self.problems)
        return Program(
            place=self.place,
            names=self.names,
            bodies=bodies,
            parameters=self.parameters,
            slots=tuple(value for _, value in self.slots),
            init=np.array(init, dtype=np.int64),
            starts=tuple(starts),
            start_slots=np.array(start_slots, dtype=np.int64),
            routes=tuple(routes),
            triggers=_table(self.triggers, 2),
            groups=_table(self.groups, 2),
            conditions=_table(self.conditions, 7),
            points=tuple(self.points),
            acts=np.array(acts, dtype=np.int64),
            events=_table(events, 6),
            friction_slot=friction,
            driver=driver or self._declared_driver(),
            time_step=self.time_step,
            n_steps=n_steps,
        )

    # -- values ----------------------------------------------------------------------------------

    def slot(self, value: Value) -> int:
        """Return the number of a value's slot, a new one if it is new."""
        key = value if isinstance(value, osc.ParameterRef | Expr) else float(value)
        return self.slots.setdefault((type(key), key), len(self.slots))

    def unsupported(self, element: Element, what: str) -> None:
        line = f", line {element.line}" if element.line else ""
        self.problems.append(f"{self.place}{line}: {what} is not supported")

    def literal(self, element: Element, name: str, value: Value) -> float:
        """Return a number that rows may not vary."""
        if isinstance(value, osc.ParameterRef | Expr):
            if isinstance(value, osc.ParameterRef) and value.name in self.parameters:
                return self.parameters[value.name]
            self.unsupported(element, f'{name}="{value}" (a number is needed)')
            return 0.0
        return float(value)

    # -- the file's parts ------------------------------------------------------------------------

    def _declared_time_step(self) -> float:
        properties = self.scenario.file_header.properties
        text = properties.get(TIME_STEP) if properties else None
        if text is None:
            return DEFAULT_TIME_STEP
        try:
            value = float(str(text))
        except ValueError:
            value = 0.0
        if not 1e-4 <= value <= 1.0:
            raise InputError(
                f"{self.place}: 0.0001 <= time_step <= 1 [s] must hold, got '{text}' (FileHeader)"
            )
        return value

    def _declared_driver(self) -> Driver:
        for controller in self.objects[0].object_controllers:
            properties = controller.controller.properties
            name = properties.get("driver") if properties else None
            if name is not None:
                if str(name) not in DRIVERS:
                    raise UnsupportedError(
                        f"{self.place}, line {controller.line}: unknown ego driver '{name}'; "
                        f"known: {', '.join(DRIVERS)} (choose one with --ego)"
                    )
                return DRIVERS[str(name)]
        return DRIVERS["route-follower"]

    def _body(self, vehicle: osc.Vehicle) -> tuple[float, ...]:
        box, limits, axles = vehicle.bounding_box, vehicle.performance, vehicle.axles
        rear = self.literal(axles.rear, "positionX", axles.rear.position_x)
        front = axles.front or axles.rear
        wheelbase = self.literal(front, "positionX", front.position_x) - rear
        return (
            self.literal(box.dimensions, "length", box.dimensions.length),
            self.literal(box.dimensions, "width", box.dimensions.width),
            self.literal(box.center, "x", box.center.x),
            wheelbase if wheelbase > 0.0 else 2.8,
            self.literal(limits, "maxSpeed", limits.max_speed),
            self.literal(limits, "maxAcceleration", limits.max_acceleration),
            self.literal(limits, "maxDeceleration", limits.max_deceleration),
        )

    def _init(
        self,
    ) -> tuple[list[int], list[LanePoint], list[tuple[LanePoint, ...]], int]:
        actions = self.scenario.storyboard.init.actions
        friction = -1
        for one in actions.global_actions:
            road = one.action.environment.road_condition
            if road is not None:
                friction = self.slot(road.friction_scale_factor)
        init = dict.fromkeys(self.names, self.slot(0.0))
        starts: dict[str, LanePoint] = {}
        routes: dict[str, tuple[LanePoint, ...]] = dict.fromkeys(self.names, ())
        for private in actions.privates:
            name = str(private.entity_ref)
            for wrapped in private.private_actions:
                action = wrapped.action
                if isinstance(action, osc.TeleportAction):
                    point = self._lane_point(action.position)
                    if point is not None:
                        starts[name] = point
                elif isinstance(action, osc.LongitudinalAction):
                    dynamics = action.action.dynamics
                    if dynamics.dynamics_shape is not osc.DynamicsShape.STEP:
                        self.unsupported(dynamics, "an initial SpeedAction other than step")
                    init[name] = self.slot(action.action.speed_action_target.target.value)
                else:
                    points = [self._lane_point(w.position) for w in action.action.route.waypoints]
                    routes[name] = tuple(point for point in points if point is not None)
        missing = [name for name in self.names if name not in starts]
        if missing and not self.problems:
            raise InputError(
                *(
                    f"{self.place}: entity '{name}' needs an initial TeleportAction"
                    for name in missing
                )
            )
        return (
            [init[name] for name in self.names],
            [starts[name] for name in self.names if name in starts],
            [routes[name] for name in self.names],
            friction,
        )

    def _lane_point(self, position: osc.Position) -> LanePoint | None:
        where = position.position
        if not isinstance(where, osc.LanePosition):
            self.unsupported(where, f"{type(where).__name__} here")
            return None
        if where.offset is not None and where.offset != 0.0:
            self.unsupported(where, f'offset="{where.offset}" (other than 0)')
        turned = where.orientation
        if turned is not None and any(
            value not in (None, 0.0) for value in (turned.h, turned.p, turned.r)
        ):
            self.unsupported(turned, "an Orientation other than the lane's")
        try:
            lane = int(str(where.lane_id))
        except ValueError:
            self.unsupported(where, f'laneId="{where.lane_id}" (a whole number is needed)')
            return None
        return LanePoint(str(where.road_id), lane, where.s, where.line)

    def _stories(self, storyboard: osc.Storyboard) -> tuple[list[int], list[tuple[int, ...]]]:
        acts: list[int] = []
        events: list[tuple[int, ...]] = []
        for act in (act for story in storyboard.stories for act in story.acts):
            acts.append(self._trigger(act.start_trigger, always=True))
            if act.stop_trigger is not None and act.stop_trigger.condition_groups:
                self.unsupported(act.stop_trigger, "an Act's StopTrigger")
            for group in act.maneuver_groups:
                for maneuver in group.maneuvers:
                    for event in maneuver.events:
                        events += self._event(event, group, len(acts) - 1)
        return acts, events

    def _event(self, event: osc.Event, group: osc.ManeuverGroup, act: int) -> list[tuple[int, ...]]:
        if event.maximum_execution_count not in (None, 1):
            self.unsupported(event, f'maximumExecutionCount="{event.maximum_execution_count}"')
        if group.maximum_execution_count != 1:
            self.unsupported(group, f'maximumExecutionCount="{group.maximum_execution_count}"')
        if event.priority is osc.Priority.SKIP or isinstance(event.priority, osc.ParameterRef):
            self.unsupported(event, f'priority="{event.priority}"')
        trigger = self._trigger(event.start_trigger, always=True)
        rows: list[tuple[int, ...]] = []
        for one in event.actions:
            private = one.action
            if not isinstance(private, osc.PrivateAction):
                self.unsupported(private, "a GlobalAction in an Event")
                continue
            action = private.action
            if not isinstance(action, osc.LongitudinalAction):
                self.unsupported(action, f"{type(action).__name__} in an Event")
                continue
            shape, dynamics = self._dynamics(action.action.dynamics)
            target = self.slot(action.action.speed_action_target.target.value)
            if not group.actors.entity_refs:
                self.unsupported(group.actors, "Actors without an EntityRef")
            for actor in group.actors.entity_refs:
                rows.append((act, trigger, self._entity(actor), shape, target, dynamics))
        return rows

    def _dynamics(self, dynamics: osc.TransitionDynamics) -> tuple[int, int]:
        slot = self.slot(dynamics.value)
        if dynamics.dynamics_shape is osc.DynamicsShape.STEP:
            return _STEP, slot
        if dynamics.dynamics_shape is osc.DynamicsShape.LINEAR:
            if dynamics.dynamics_dimension is osc.DynamicsDimension.RATE:
                return _LINEAR_RATE, slot
            if dynamics.dynamics_dimension is osc.DynamicsDimension.TIME:
                return _LINEAR_TIME, slot
        self.unsupported(
            dynamics,
            f"a SpeedAction of shape {dynamics.dynamics_shape} over {dynamics.dynamics_dimension}",
        )
        return _STEP, slot

    def _entity(self, reference: osc.EntityRef) -> int:
        return self.names.index(str(reference.entity_ref))

    # -- triggers --------------------------------------------------------------------------------

    def _trigger(self, trigger: osc.Trigger | None, *, always: bool = False) -> int:
        """Append a trigger and return its number; a missing one fires at once if ``always``."""
        first = len(self.groups)
        # Conditions are numbered before the next group's, so that each group is a range.
        for group in trigger.condition_groups if trigger else ():
            start = len(self.conditions)
            for condition in group.conditions:
                self._condition(condition)
            self.groups.append((start, len(self.conditions)))
        if trigger is None and always:
            start = len(self.conditions)
            self._append(_SIMULATION_TIME, 0, 0, _RULES[osc.Rule.GREATER_OR_EQUAL], 0.0, 0, 0)
            self.groups.append((start, start + 1))
        self.triggers.append((first, len(self.groups)))
        return len(self.triggers) - 1

    def _append(
        self, kind: int, entity: int, other: int, rule: int, value: Value, edge: int, delay: int,
        point: LanePoint | None = None,
    ) -> None:  # fmt: skip
        self.conditions.append((kind, entity, other, rule, self.slot(value), edge, delay))
        self.points.append(point)

    def _condition(self, condition: osc.Condition) -> None:
        edge = _EDGES.get(condition.condition_edge, -1)  # type: ignore[arg-type]
        if edge < 0:
            self.unsupported(condition, f'conditionEdge="{condition.condition_edge}"')
        delay = round(self.literal(condition, "delay", condition.delay) / self.time_step)
        kind = condition.condition
        if isinstance(kind, osc.ByValueCondition):
            clock = kind.condition
            self._append(
                _SIMULATION_TIME, 0, 0, self._rule(clock, clock.rule), clock.value, edge, delay
            )
            if not self.triggers:  # the storyboard's own stop trigger is the first
                self.stop_time = max(
                    self.stop_time,
                    self.literal(clock, "value", clock.value) + delay * self.time_step,
                )
            return
        entities = kind.triggering_entities.entity_refs
        if len(entities) != 1:
            self.unsupported(kind.triggering_entities, "TriggeringEntities other than one entity")
        entity = self._entity(entities[0])
        inner = kind.entity_condition.condition
        if isinstance(inner, osc.ReachPositionCondition):
            point = self._lane_point(inner.position)
            if point is not None and isinstance(point.s, osc.ParameterRef | Expr):
                self.unsupported(inner, f's="{point.s}" of a position to be reached')
            self._append(_REACH_POSITION, entity, 0, 0, inner.tolerance, edge, delay, point)
            return
        other = self.names.index(str(inner.entity_ref))
        kinds = osc.RelativeDistanceType
        euclidian = (kinds.EUCLIDIAN_DISTANCE, kinds.CARTESIAN_DISTANCE)
        if inner.relative_distance_type not in euclidian:
            self.unsupported(inner, f'relativeDistanceType="{inner.relative_distance_type}"')
        if inner.freespace is not False:
            self.unsupported(inner, f'freespace="{str(inner.freespace).lower()}"')
        rule = self._rule(inner, inner.rule)
        self._append(_RELATIVE_DISTANCE, entity, other, rule, inner.value, edge, delay)

    def _rule(self, element: Element, rule: osc.Rule | osc.ParameterRef) -> int:
        if isinstance(rule, osc.ParameterRef):
            self.unsupported(element, f'rule="{rule}"')
            return 0
        return _RULES[rule]


def _is_ego(one: osc.ScenarioObject) -> bool:
    return str(one.name).lower() == "ego"


def _table(rows: Sequence[tuple[int, ...]], width: int) -> Int:
    return np.array(rows, dtype=np.int64).reshape(len(rows), width)
