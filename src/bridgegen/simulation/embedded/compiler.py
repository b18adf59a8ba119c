"""From an OpenSCENARIO file to a `Program`, or to all that the rollout cannot do with it."""

import math

import numpy as np

from bridgegen.ego import DRIVERS, Driver
from bridgegen.errors import InputError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl import TIME_STEP
from bridgegen.simulation.embedded.program import LanePoint, Program
from bridgegen.simulation.embedded.tables import Tables, table
from bridgegen.simulation.embedded.triggers import Triggers

DEFAULT_TIME_STEP = 0.05  # s
DEFAULT_DURATION = 60.0  # s, of a file whose stop trigger names no simulation time
MAX_STEPS = 100_000

_STEP, _LINEAR_RATE, _LINEAR_TIME = 0, 1, 2


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
        self.tables = Tables(scenario, place)

    def compile(self, driver: Driver | None, time_step: float | None) -> Program:
        if not self.tables.objects:
            raise InputError(f"{self.place}: a scenario needs at least one entity, got none")
        step = time_step or self._declared_time_step()
        self.triggers = Triggers(self.tables, step)
        bodies = np.array([self._body(one.entity_object) for one in self.tables.objects])
        init, starts, routes, friction = self._init()
        if self.tables.problems:
            raise UnsupportedError(*self.tables.problems)
        start_slots = [self.tables.slot(one.s) for one in starts]
        storyboard = self.scenario.storyboard
        self.triggers.add(storyboard.stop_trigger)
        duration = self.triggers.stop_time or DEFAULT_DURATION
        acts, events = self._stories(storyboard)
        n_steps = round(duration / step) + 1
        if not 2 <= n_steps <= MAX_STEPS:
            self.tables.problems.append(
                f"{self.place}: the stop trigger's simulation time must take 1 to {MAX_STEPS} "
                f"steps of {step} s, got {duration} s"
            )
        if self.tables.problems:
            raise UnsupportedError(*self.tables.problems)
        return Program(
            place=self.place,
            names=self.tables.names,
            bodies=bodies,
            parameters=self.tables.parameters,
            slots=self.tables.slots,
            init=np.array(init, dtype=np.int64),
            starts=tuple(starts),
            start_slots=np.array(start_slots, dtype=np.int64),
            routes=tuple(routes),
            triggers=table(self.triggers.triggers, 2),
            groups=table(self.triggers.groups, 2),
            conditions=table(self.triggers.conditions, 7),
            points=tuple(self.triggers.points),
            acts=np.array(acts, dtype=np.int64),
            events=table(events, 6),
            friction_slot=friction,
            driver=driver or self._declared_driver(),
            time_step=step,
            n_steps=n_steps,
        )

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
        for controller in self.tables.objects[0].object_controllers:
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
        rear = self.tables.literal(axles.rear, "positionX", axles.rear.position_x)
        front = axles.front or axles.rear
        wheelbase = self.tables.literal(front, "positionX", front.position_x) - rear
        lock = self.tables.literal(front, "maxSteering", front.max_steering)
        if wheelbase <= 0.0:
            self.tables.unsupported(axles, "a Vehicle without a FrontAxle ahead of its RearAxle")
        return (
            self.tables.literal(box.dimensions, "length", box.dimensions.length),
            self.tables.literal(box.dimensions, "width", box.dimensions.width),
            self.tables.literal(box.center, "x", box.center.x),
            self.tables.literal(limits, "maxSpeed", limits.max_speed),
            self.tables.literal(limits, "maxAcceleration", limits.max_acceleration),
            self.tables.literal(limits, "maxDeceleration", limits.max_deceleration),
            math.tan(min(lock, 1.5)) / max(wheelbase, 0.1),
        )

    def _init(
        self,
    ) -> tuple[list[int], list[LanePoint], list[tuple[LanePoint, ...]], int]:
        actions = self.scenario.storyboard.init.actions
        friction = -1
        for one in actions.global_actions:
            road = one.action.environment.road_condition
            if road is not None:
                friction = self.tables.slot(road.friction_scale_factor)
        init = dict.fromkeys(self.tables.names, self.tables.slot(0.0))
        starts: dict[str, LanePoint] = {}
        routes: dict[str, tuple[LanePoint, ...]] = dict.fromkeys(self.tables.names, ())
        for private in actions.privates:
            name = str(private.entity_ref)
            for wrapped in private.private_actions:
                action = wrapped.action
                if isinstance(action, osc.TeleportAction):
                    point = self.tables.lane_point(action.position)
                    if point is not None:
                        starts[name] = point
                elif isinstance(action, osc.LongitudinalAction):
                    dynamics = action.action.dynamics
                    if dynamics.dynamics_shape is not osc.DynamicsShape.STEP:
                        self.tables.unsupported(dynamics, "an initial SpeedAction other than step")
                    init[name] = self.tables.slot(action.action.speed_action_target.target.value)
                else:
                    points = [
                        self.tables.lane_point(w.position) for w in action.action.route.waypoints
                    ]
                    routes[name] = tuple(point for point in points if point is not None)
        missing = [name for name in self.tables.names if name not in starts]
        if missing and not self.tables.problems:
            raise InputError(
                *(
                    f"{self.place}: entity '{name}' needs an initial TeleportAction"
                    for name in missing
                )
            )
        return (
            [init[name] for name in self.tables.names],
            [starts[name] for name in self.tables.names if name in starts],
            [routes[name] for name in self.tables.names],
            friction,
        )

    def _stories(self, storyboard: osc.Storyboard) -> tuple[list[int], list[tuple[int, ...]]]:
        acts: list[int] = []
        events: list[tuple[int, ...]] = []
        for act in (act for story in storyboard.stories for act in story.acts):
            acts.append(self.triggers.add(act.start_trigger, always=True))
            if act.stop_trigger is not None and act.stop_trigger.condition_groups:
                self.tables.unsupported(act.stop_trigger, "an Act's StopTrigger")
            for group in act.maneuver_groups:
                for maneuver in group.maneuvers:
                    for event in maneuver.events:
                        events += self._event(event, group, len(acts) - 1)
        return acts, events

    def _event(self, event: osc.Event, group: osc.ManeuverGroup, act: int) -> list[tuple[int, ...]]:
        if event.maximum_execution_count not in (None, 1):
            self.tables.unsupported(
                event, f'maximumExecutionCount="{event.maximum_execution_count}"'
            )
        if group.maximum_execution_count != 1:
            self.tables.unsupported(
                group, f'maximumExecutionCount="{group.maximum_execution_count}"'
            )
        if event.priority is osc.Priority.SKIP or isinstance(event.priority, osc.ParameterRef):
            self.tables.unsupported(event, f'priority="{event.priority}"')
        trigger = self.triggers.add(event.start_trigger, always=True)
        rows: list[tuple[int, ...]] = []
        for one in event.actions:
            private = one.action
            if not isinstance(private, osc.PrivateAction):
                self.tables.unsupported(private, "a GlobalAction in an Event")
                continue
            action = private.action
            if not isinstance(action, osc.LongitudinalAction):
                self.tables.unsupported(action, f"{type(action).__name__} in an Event")
                continue
            shape, dynamics = self._dynamics(action.action.dynamics)
            target = self.tables.slot(action.action.speed_action_target.target.value)
            if not group.actors.entity_refs:
                self.tables.unsupported(group.actors, "Actors without an EntityRef")
            for actor in group.actors.entity_refs:
                rows.append(
                    (act, trigger, self.tables.entity(actor.entity_ref), shape, target, dynamics)
                )
        return rows

    def _dynamics(self, dynamics: osc.TransitionDynamics) -> tuple[int, int]:
        slot = self.tables.slot(dynamics.value)
        if dynamics.dynamics_shape is osc.DynamicsShape.STEP:
            return _STEP, slot
        if dynamics.dynamics_shape is osc.DynamicsShape.LINEAR:
            if dynamics.dynamics_dimension is osc.DynamicsDimension.RATE:
                return _LINEAR_RATE, slot
            if dynamics.dynamics_dimension is osc.DynamicsDimension.TIME:
                return _LINEAR_TIME, slot
        self.tables.unsupported(
            dynamics,
            f"a SpeedAction of shape {dynamics.dynamics_shape} over {dynamics.dynamics_dimension}",
        )
        return _STEP, slot
