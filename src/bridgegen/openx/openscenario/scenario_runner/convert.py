"""A recorded scenario for CARLA's ScenarioRunner: OpenSCENARIO 1.0, with its idioms.

The ego has its recorded start and speed, and is left to the driver of ``hero``. All others are
where they were when, by a controller of ours that lies beside the file (`CONTROL`): of
ScenarioRunner's own, that for vehicles drives along lanes' centres, and that for pedestrians has no
clock.

Source: ScenarioRunner 0.9.15 and 0.9.16; each part documents what it relies on.
"""

import re
from collections.abc import Iterator, Mapping
from dataclasses import replace
from typing import Any

import numpy as np

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.opendrive.lanes import lane_pose, values
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.recorded import Recording
from bridgegen.openx.openscenario.scenario_runner import story
from bridgegen.openx.openscenario.scenario_runner.blueprints import blueprint
from bridgegen.openx.openscenario.scenario_runner.environment import (
    CLEAR,
    carla_fields,
    environment,
)
from bridgegen.openx.openscenario.scenario_runner.story import Body, Course, centred, course

CONTROL = "bridgegen_control.py"
"""The controller's module, beside the file; in this package, as ScenarioRunner loads it."""

HERO = story.HERO

_EGO = osc.Property("type", "ego_vehicle")
_FIXED = osc.Property("physics", "off")
_IN_THE_GROUND = frozenset(
    {
        osc.MiscObjectCategory.BARRIER,
        osc.MiscObjectCategory.POLE,
        osc.MiscObjectCategory.RAILING,
    }
)
"""Categories of objects that are fixed to the ground: beside a generated map's lanes there is none
that would hold them."""


def for_scenario_runner(
    scenario: osc.OpenScenario, recording: Recording, roads: OpenDrive, name: str
) -> osc.OpenScenario:
    """Return a scenario that ScenarioRunner runs as recorded, with any driver of the ego.

    A participant that disappears where the road ends stands there instead: ScenarioRunner cannot
    delete an entity.

    Args:
        scenario: without parameters (`resolve.resolved`), of version 1.2.
        recording: its own; entity 0 is the ego.
        roads: its map.
        name: of the scenario: ScenarioRunner's results are called by it.

    Raises:
        UnsupportedError: what ScenarioRunner or CARLA cannot do, by name, all of it at once.
    """
    # What leaves by an action of the file is refused further down; what only leaves where its road
    # ends is made to stand there.
    deleted = {node.entity_ref for node in walk(scenario) if isinstance(node, osc.EntityAction)}
    recording = recording.until_left(but={str(item) for item in deleted})
    by_name = {str(obj.name): obj.entity_object for obj in scenario.entities.scenario_objects}
    bodies = [by_name[item] for item in recording.names]
    if wrong := list(_impossible(recording, bodies)):
        raise UnsupportedError(*wrong)
    names = (HERO, *recording.names[1:])
    courses = {
        names[e]: course(recording, e, body, _ground(scenario, recording.names[e], roads))
        for e, body in enumerate(bodies)
        if not isinstance(body, osc.ExternalObjectReference)
    }
    weather = story.changes(scenario, recording, _weather(scenario))
    moved = {
        item: courses[item]
        for item, body in zip(names, bodies, strict=True)
        if item != HERO and (courses[item].moves or not isinstance(body, osc.MiscObject))
    }
    controllers = {item: _controller(item, {"duration": c.duration}) for item, c in moved.items()}
    controllers[HERO] = _controller(HERO, _world(recording, weather[0][1]))
    privates = tuple(
        osc.Private(item, tuple(_start(item, float(recording.v[e, 0]), courses, controllers)))
        for e, item in enumerate(names)
    )
    end = story.end(recording, _arrival(scenario, recording.names[0], bodies[0], roads))
    act = story.act(moved, recording, weather, roads, end)
    start = osc.GlobalAction(osc.EnvironmentAction(weather[0][1]))
    header = scenario.file_header
    # Version 1.0, the only one that ScenarioRunner takes. Its story has one act: of all positions
    # in an entity's Init the last is its start, so trajectories stand in the story.
    return osc.OpenScenario(
        osc.FileHeader(1, 0, header.date, _file_name(name), header.author),
        osc.RoadNetwork(scenario.road_network.logic_file),
        osc.Entities(tuple(map(_entity, names, bodies))),
        osc.Storyboard(
            osc.Init(osc.InitActions((start,), privates=privates)),
            (osc.Story("story", (act,)),),
            osc.Trigger((story.criteria(roads), end.condition_groups[0])),
        ),
        left_hand=scenario.left_hand,
    )


def _impossible(recording: Recording, bodies: list[Any]) -> Iterator[str]:
    """Yield the reasons why the scenario cannot be exported for ScenarioRunner."""
    last = recording.x.shape[1] - 1
    for e, (name, body) in enumerate(zip(recording.names, bodies, strict=True)):
        if e and name == HERO:
            yield f"the entity {name} must have another name: ScenarioRunner's ego has this one"
        if recording.stays(e) != [(0, last)]:
            yield (
                f"the entity {name} must be there from start to end, and it comes or goes: "
                "ScenarioRunner has no controller for entities that are added later"
            )
        if isinstance(body, osc.ExternalObjectReference):
            yield f"the entity {name} must have a body in the file, got a reference to {body.name}"
        elif e == 0 and not isinstance(body, osc.Vehicle):
            yield f"the ego {name} must be a vehicle for ScenarioRunner's hero"
        elif isinstance(body, osc.Vehicle) and body.trailer is not None:
            yield f"the entity {name} must have no trailer: CARLA has none (line {body.line})"
        elif blueprint(body) is None:
            yield f"the entity {name} must be of a kind that CARLA has, got {_kind(body)}"


def _kind(body: Body) -> str:
    if isinstance(body, osc.Vehicle):
        return f"vehicleCategory {body.vehicle_category}"
    if isinstance(body, osc.Pedestrian):
        return f"pedestrianCategory {body.pedestrian_category}"
    return f"miscObjectCategory {body.misc_object_category}"


def _file_name(name: str) -> str:
    """Return a name that results may have; one that began with CARLA: would turn the map over."""
    return re.sub(r"[^\w.-]+", "-", name).strip("-") or "scenario"


def _entity(name: str, body: Any) -> osc.ScenarioObject:
    made = centred(body, blueprint(body) or "")
    if name == HERO:
        made = replace(made, properties=osc.Properties((_EGO,)))
    elif isinstance(body, osc.MiscObject) and body.misc_object_category in _IN_THE_GROUND:
        made = replace(made, properties=osc.Properties((_FIXED,)))
    return osc.ScenarioObject(name, made)


def _weather(scenario: osc.OpenScenario) -> osc.Environment:
    """Return the environment at the start."""
    now = CLEAR
    for action in scenario.storyboard.init.actions.global_actions:
        if isinstance(action.action, osc.EnvironmentAction):
            now = environment(action.action.environment, now)
    return now


def _ground(scenario: osc.OpenScenario, name: str, roads: OpenDrive) -> float:
    """Return the road's height where an entity starts [m], as far as its start states it."""
    for private in scenario.storyboard.init.actions.privates:
        for node in walk(private) if private.entity_ref == name else ():
            place: Any = node.position.position if isinstance(node, osc.TeleportAction) else None
            if isinstance(place, osc.LanePosition | osc.RoadPosition):
                road = roads.road(str(place.road_id))
                return float(values(road.elevations, np.array([place.s]))[0])
            if place is not None:
                return float(getattr(place, "z", None) or 0.0)
    return 0.0


def _start(
    name: str,
    speed: float,
    courses: Mapping[str, Course],
    controllers: Mapping[str, osc.ControllerAction],
) -> Iterator[osc.PrivateAction]:
    """Yield a participant's start, speed and controller."""
    yield osc.PrivateAction(osc.TeleportAction(courses[name].position(0)))
    if name not in controllers:
        return
    at_once = osc.TransitionDynamics(osc.DynamicsShape.STEP, osc.DynamicsDimension.TIME, 0.0)
    target = osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(speed))
    yield osc.PrivateAction(osc.LongitudinalAction(osc.SpeedAction(at_once, target)))
    yield osc.PrivateAction(controllers[name])


def _world(recording: Recording, weather: osc.Environment) -> dict[str, str | float]:
    """Return what the ego's controller sets of the world."""
    lights = {"traffic_lights": "stand"} if recording.light_names else {}
    return lights | {f"weather.{name}": value for name, value in carla_fields(weather).items()}


def _controller(name: str, properties: Mapping[str, str | float]) -> osc.ControllerAction:
    said = {"module": CONTROL, **properties}
    held = osc.Properties(tuple(osc.Property(item, str(value)) for item, value in said.items()))
    return osc.ControllerAction(
        osc.AssignControllerAction(osc.Controller(f"{name}_control", held)),
        osc.OverrideControllerValueAction(  # 1.0 must have it, ScenarioRunner takes no active one
            osc.OverrideThrottleAction(False, 0.0),
            osc.OverrideBrakeAction(False, value=0.0),
            osc.OverrideClutchAction(False, 0.0),
            osc.OverrideBrakeAction(False, value=0.0),
            osc.OverrideSteeringWheelAction(False, 0.0),
            osc.OverrideGearAction(False, number=0.0),
        ),
    )


def _arrival(
    scenario: osc.OpenScenario, ego: str, body: Any, roads: OpenDrive
) -> osc.ReachPositionCondition | None:
    """Return the position at which the ego ends the scenario; None if there is none."""
    stop = scenario.storyboard.stop_trigger
    for group in stop.condition_groups if stop else ():
        reached = [node for node in walk(group) if isinstance(node, osc.ReachPositionCondition)]
        whose = {str(node.entity_ref) for node in walk(group) if isinstance(node, osc.EntityRef)}
        if len(group.conditions) != 1 or not reached or whose != {ego}:
            continue
        place: Any = reached[0].position.position
        if isinstance(place, osc.LanePosition) and not place.offset:
            where: Any = place
            pose = lane_pose(roads.road(str(place.road_id)), int(str(place.lane_id)), where.s)
            place = osc.WorldPosition(pose.x, pose.y)
        if isinstance(place, osc.WorldPosition):
            # so much farther off may the middle of the box be than the reference point
            aside = abs(body.bounding_box.center.x)
            tolerance: Any = reached[0].tolerance
            flat = osc.WorldPosition(place.x, place.y)
            return osc.ReachPositionCondition(tolerance + aside, osc.Position(flat))
    return None
