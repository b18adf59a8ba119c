"""From an OpenSCENARIO file to a `Program`, or to all that the rollout cannot do with it."""

import math

import numpy as np

from bridgegen.ego import DRIVERS, TRAJECTORY, Driver
from bridgegen.errors import InputError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.notes import TIME_STEP
from bridgegen.openx.openscenario.values import Value
from bridgegen.simulation.embedded.program import (
    AlongLanes,
    AlongTrajectory,
    BesideLanes,
    LanePoint,
    PathSpec,
    Point,
    Program,
)
from bridgegen.simulation.embedded.tables import Tables, table
from bridgegen.simulation.embedded.trajectories import compile_trajectory
from bridgegen.simulation.embedded.triggers import Triggers

DEFAULT_TIME_STEP = 0.05  # s
DEFAULT_DURATION = 60.0  # s, of a file whose stop trigger names no simulation time
MAX_STEPS = 100_000

_SPEED_CHANGE, _LANE_CHANGE, _FRICTION, _LIGHT = 0, 1, 2, 3

LIGHT_STATES = {
    "off;off;off": 0, "on;off;off": 1, "on;on;off": 2, "off;on;off": 3, "off;off;on": 4,
}  # fmt: skip
"""The states of a traffic light's three lamps as `Rollout.lights` has them."""

_SHAPES = {
    osc.DynamicsShape.STEP: 0, osc.DynamicsShape.LINEAR: 1,
    osc.DynamicsShape.CUBIC: 2, osc.DynamicsShape.SINUSOIDAL: 3,
}  # fmt: skip
_DIMENSIONS = {
    osc.DynamicsDimension.RATE: 0, osc.DynamicsDimension.TIME: 1,
    osc.DynamicsDimension.DISTANCE: 2,
}  # fmt: skip


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
        self.paths: list[PathSpec] = []
        self.actions: list[tuple[int, ...]] = []
        self.lane_paths: dict[int, int] = {}
        self.lights: list[str] = []
        self.first_states: list[int] = []

    def compile(self, driver: Driver | None, time_step: float | None) -> Program:
        if not self.tables.objects:
            raise InputError(f"{self.place}: a scenario needs at least one entity, got none")
        step = time_step or self._declared_time_step()
        storyboard = self.scenario.storyboard
        event_names = [str(one.name) for one in _events(storyboard)]
        self.triggers = Triggers(self.tables, step, event_names)
        bodies = np.array([self._body(one.entity_object) for one in self.tables.objects])
        init, friction = self._init()
        if driver and self._is_timed(0):
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
        aside_slots = [-1, *(self._aside_slot(path) for path in self.paths[1:])]
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
            paths=tuple(self.paths),
            start_slots=np.array(start_slots, dtype=np.int64),
            aside_slots=np.array(aside_slots, dtype=np.int64),
            triggers=table(self.triggers.triggers, 2),
            groups=table(self.triggers.groups, 2),
            conditions=table(self.triggers.conditions, 7),
            points=tuple(self.triggers.points),
            acts=np.array(acts, dtype=np.int64),
            events=table(events, 4),
            actions=table(self.actions, 7),
            friction_slot=friction,
            lights=tuple(self.lights),
            first_states=np.array(self.first_states, dtype=np.int8),
            driver=driver or self._declared_driver(),
            time_step=step,
            n_steps=n_steps,
            fixed=self.tables.fixed,
            event_names=tuple(event_names),
        )

    def _is_timed(self, entity: int) -> bool:
        """Say whether an entity follows a trajectory with times, which rules out all else."""
        path = self.paths[entity] if entity < len(self.paths) else None
        return isinstance(path, AlongTrajectory) and bool(path.times)

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
        if not 1e-4 <= value <= 1.0:
            raise InputError(
                f"{self.place}: 0.0001 <= time_step <= 1 [s] must hold, got '{text}' (FileHeader)"
            )
        return value

    def _declared_driver(self) -> Driver:
        if self._is_timed(0):
            return TRAJECTORY
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

    def _body(self, body: osc.Vehicle | osc.Pedestrian | osc.MiscObject) -> tuple[float, ...]:
        box = body.bounding_box
        measures = (
            self.tables.literal(box.dimensions, "length", box.dimensions.length),
            self.tables.literal(box.dimensions, "width", box.dimensions.width),
            self.tables.literal(box.center, "x", box.center.x),
        )
        if not isinstance(body, osc.Vehicle):
            return (*measures, math.inf, math.inf, math.inf, math.inf)
        limits, axles = body.performance, body.axles
        rear = self.tables.literal(axles.rear, "positionX", axles.rear.position_x)
        front = axles.front or axles.rear
        wheelbase = self.tables.literal(front, "positionX", front.position_x) - rear
        lock = self.tables.literal(front, "maxSteering", front.max_steering)
        if wheelbase <= 0.0:
            self.tables.unsupported(axles, "a Vehicle without a FrontAxle ahead of its RearAxle")
        return (
            *measures,
            self.tables.literal(limits, "maxSpeed", limits.max_speed),
            self.tables.literal(limits, "maxAcceleration", limits.max_acceleration),
            self.tables.literal(limits, "maxDeceleration", limits.max_deceleration),
            math.tan(min(lock, 1.5)) / max(wheelbase, 0.1),
        )

    def _init(self) -> tuple[list[int], int]:
        """Compile the start; return the slots of the entities' speeds, and of the friction."""
        actions = self.scenario.storyboard.init.actions
        friction = -1
        for one in actions.global_actions:
            if isinstance(one.action, osc.EntityAction):
                self.tables.unsupported(one.action, type(one.action.action).__name__)
                continue
            if not isinstance(one.action, osc.EnvironmentAction):
                light, state = self._light(one.action)
                if light >= 0:
                    self.first_states[light] = state
                continue
            road = one.action.environment.road_condition
            if road is not None:
                friction = self.tables.slot(road.friction_scale_factor)
        init = dict.fromkeys(self.tables.names, self.tables.slot(0.0))
        starts: dict[str, tuple[Point, Value]] = {}
        routes: dict[str, tuple[osc.Waypoint, ...]] = dict.fromkeys(self.tables.names, ())
        tracks: dict[str, AlongTrajectory] = {}
        for private in actions.privates:
            name = str(private.entity_ref)
            for wrapped in private.private_actions:
                action = wrapped.action
                if isinstance(action, osc.TeleportAction):
                    point, aside = self.tables.point(action.position)
                    if name == self.tables.names[0]:  # the ego's driver keeps to its path
                        aside = self.tables.literal(action.position.position, "offset", aside)
                    if point is not None:
                        starts[name] = point, aside
                elif isinstance(action, osc.LongitudinalAction):
                    dynamics = action.action.dynamics
                    if dynamics.dynamics_shape is not osc.DynamicsShape.STEP:
                        self.tables.unsupported(dynamics, "an initial SpeedAction other than step")
                    init[name] = self._speed(action.action.speed_action_target)
                elif isinstance(action, osc.LateralAction):
                    what = type(action.action).__name__
                    self.tables.unsupported(action.action, f"an initial {what}")
                elif isinstance(action, osc.SynchronizeAction):
                    self.tables.unsupported(action, "an initial SynchronizeAction")
                elif isinstance(action.action, osc.FollowTrajectoryAction):
                    tracks[name] = compile_trajectory(self.tables, action.action)
                else:
                    routes[name] = action.action.route.waypoints
        missing = [name for name in self.tables.names if name not in starts]
        if missing and not self.tables.problems:
            raise InputError(
                *(
                    f"{self.place}: entity '{name}' needs an initial TeleportAction"
                    for name in missing
                )
            )
        for name in self.tables.names:
            if name not in starts:
                continue
            point, aside = starts[name]
            if name in tracks:
                self.paths.append(tracks[name])
            elif isinstance(point, LanePoint):
                via = [self.tables.lane_point(one.position, aside) for one in routes[name]]
                known = tuple(one for one in via if one is not None)
                self.paths.append(AlongLanes(point, known, aside))
            else:
                self.tables.problems.append(
                    f"{self.place}, line {point.line}: a WorldPosition is supported for an entity "
                    "that follows a trajectory, and for no other"
                )
        return [init[name] for name in self.tables.names], friction

    def _speed(self, target: osc.SpeedActionTarget) -> int:
        if isinstance(target.target, osc.RelativeTargetSpeed):
            self.tables.unsupported(target.target, "RelativeTargetSpeed")
            return self.tables.slot(0.0)
        return self.tables.slot(target.target.value)

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
                        events.append(self._event(event, group, len(acts) - 1))
        return acts, events

    def _event(self, event: osc.Event, group: osc.ManeuverGroup, act: int) -> tuple[int, ...]:
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
        first = len(self.actions)
        for one in event.actions:
            if isinstance(one.action, osc.GlobalAction):
                self._global(one.action)
                continue
            if not group.actors.entity_refs:
                self.tables.unsupported(group.actors, "Actors without an EntityRef")
            for actor in group.actors.entity_refs:
                self._private(one.action, self.tables.entity(actor.entity_ref))
        return act, trigger, first, len(self.actions)

    def _global(self, wrapped: osc.GlobalAction) -> None:
        action = wrapped.action
        if isinstance(action, osc.EntityAction):
            self.tables.unsupported(action, type(action.action).__name__)
            return
        if not isinstance(action, osc.EnvironmentAction):
            light, state = self._light(action)
            slot = self.tables.slot(float(state))
            self.actions.append((max(light, 0), _LIGHT, 0, 0, slot, slot, 0))
            return
        road = action.environment.road_condition
        if road is not None:
            slot = self.tables.slot(road.friction_scale_factor)
            self.actions.append((0, _FRICTION, 0, 0, slot, slot, 0))

    def _light(self, action: osc.InfrastructureAction) -> tuple[int, int]:
        """Return the number of the light that an action sets, and its state; -1 if it sets none."""
        set_ = action.traffic_signal_action.action
        if not isinstance(set_, osc.TrafficSignalStateAction):
            self.tables.unsupported(set_, type(set_).__name__)
            return -1, 0
        state = LIGHT_STATES.get(str(set_.state))
        if state is None:
            known = ", ".join(LIGHT_STATES)
            self.tables.unsupported(set_, f'state="{set_.state}" (other than {known})')
            return -1, 0
        name = str(set_.name)
        if name not in self.lights:
            self.lights.append(name)
            self.first_states.append(0)
        return self.lights.index(name), state

    def _private(self, wrapped: osc.PrivateAction, entity: int) -> None:
        action = wrapped.action
        if self._is_timed(entity):
            what = f"{type(action).__name__} of one that follows a trajectory with times"
            self.tables.unsupported(action, what)
        elif isinstance(action, osc.LongitudinalAction):
            shape, dimension, value = self._dynamics(action.action.dynamics)
            target = self._speed(action.action.speed_action_target)
            self.actions.append((entity, _SPEED_CHANGE, shape, dimension, target, value, 0))
        elif isinstance(action, osc.LateralAction):
            if isinstance(action.action, osc.LaneChangeAction):
                self._lane_change(action.action, entity)
            else:
                self.tables.unsupported(action.action, type(action.action).__name__)
        else:
            self.tables.unsupported(action, f"{type(action).__name__} in an Event")

    def _lane_change(self, action: osc.LaneChangeAction, entity: int) -> None:
        shape, dimension, value = self._dynamics(action.dynamics)
        if dimension == 0 and shape != 0:
            self.tables.unsupported(action.dynamics, "a LaneChangeAction by a rate")
        if entity == 0:
            self.tables.unsupported(action, "a LaneChangeAction of the ego")
        if action.target_lane_offset not in (None, 0.0):
            self.tables.unsupported(action, f'targetLaneOffset="{action.target_lane_offset}"')
        target = action.lane_change_target.target
        lanes = lane = None
        if isinstance(target, osc.RelativeTargetLane):
            if self.tables.entity(target.entity_ref) != entity:
                self.tables.unsupported(target, "a RelativeTargetLane of another entity")
            lanes = int(self.tables.literal(target, "value", target.value))
        else:
            try:
                lane = int(str(target.value))
            except ValueError:
                self.tables.unsupported(target, f'value="{target.value}" (a lane id is needed)')
        before = self.lane_paths.get(entity, entity)
        self.lane_paths[entity] = len(self.paths)
        self.paths.append(BesideLanes(before, lanes, lane, action.line))
        slot = self.tables.slot(0.0) if shape == 0 else value
        self.actions.append(
            (entity, _LANE_CHANGE, shape, dimension, slot, slot, len(self.paths) - 1)
        )

    def _dynamics(self, dynamics: osc.TransitionDynamics) -> tuple[int, int, int]:
        slot = self.tables.slot(dynamics.value)
        shape, dimension = dynamics.dynamics_shape, dynamics.dynamics_dimension
        if isinstance(shape, osc.ParameterRef) or isinstance(dimension, osc.ParameterRef):
            self.tables.unsupported(dynamics, f'"{shape}" over "{dimension}"')
            return 0, 0, slot
        return _SHAPES[shape], _DIMENSIONS[dimension], slot


def _events(storyboard: osc.Storyboard) -> list[osc.Event]:
    """Return all events in the order in which they are compiled."""
    return [
        event
        for story in storyboard.stories
        for act in story.acts
        for group in act.maneuver_groups
        for maneuver in group.maneuvers
        for event in maneuver.events
    ]
