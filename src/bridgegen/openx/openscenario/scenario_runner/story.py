"""What happens when, and what the ego is judged by, in the parts that ScenarioRunner knows.

What begins at time 0 begins in the first tick. What ScenarioRunner stops at is an act's end; of the
storyboard's own stop trigger it reads the criteria.

Source: ScenarioRunner 0.9.16, srunner/scenarios/open_scenario.py and
srunner/tools/openscenario_parser.py; atomic_criteria.py for what the criteria take.
"""

from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.outline import Light, lights
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.recorded import Recording, recorded
from bridgegen.openx.openscenario.scenario_runner.environment import environment

# --- Timed poses of participants for ScenarioRunner ---
# Its frame is the standard's: it turns y and headings to CARLA's left-handed frame itself, in files
# whose description does not begin with ``CARLA:``. A place is CARLA's: of a vehicle or an object
# the # middle of its box on the ground, of a walker the middle of its capsule.
#
# Source: ScenarioRunner 0.9.16, srunner/tools/openscenario_parser.py,
# convert_position_to_transform.


Body = osc.Vehicle | osc.Pedestrian | osc.MiscObject


@dataclass(frozen=True)
class Course:
    """The positions of a box's middle at K evenly spaced instants.

    Attributes:
        x: ``(K,)`` [m].
        y: ``(K,)`` [m].
        z: of CARLA's reference point [m], as at the start.
        h: ``(K,)`` [rad], continuous.
        time_step: between two instants [s].
    """

    x: Float
    y: Float
    z: float
    h: Float
    time_step: float

    @property
    def moves(self) -> bool:
        """Whether it leaves its start."""
        return any(np.ptp(array) > 0.0 for array in (self.x, self.y, self.h))

    @property
    def duration(self) -> float:
        """From the first instant to the last [s]."""
        return (len(self.x) - 1) * self.time_step

    def position(self, k: int) -> osc.Position:
        """Return the place at an instant."""
        x, y, h = (float(array[k]) for array in (self.x, self.y, self.h))
        return osc.Position(osc.WorldPosition(x, y, z=self.z, h=h))

    def trajectory(self, name: str) -> osc.FollowTrajectoryAction:
        """Return the action that follows it: a vertex for each instant, two where nothing moves."""
        shape = osc.Shape(osc.Polyline(tuple(self._vertices())))
        return osc.FollowTrajectoryAction(
            osc.TimeReference(osc.Timing(osc.ReferenceContext.RELATIVE, 1.0, 0.0)),
            osc.TrajectoryFollowingMode(osc.FollowingMode.POSITION),
            osc.TrajectoryRef(osc.Trajectory(name, False, shape)),
        )

    def _vertices(self) -> Iterator[osc.Vertex]:
        last = len(self.x) - 1
        for k in range(last + 1) if self.moves else (0, last):
            yield osc.Vertex(self.position(k), k * self.time_step)


def course(recording: Recording, e: int, body: Body, ground: float = 0.0) -> Course:
    """Return an entity's course: the one place where reference points become boxes' middles.

    Args:
        recording: of reference points.
        e: which entity.
        body: its own, without references to parameters.
        ground: how high its start lies [m]; recordings are flat.
    """
    centre: Any = body.bounding_box.center
    x, y, h = recording.x[e], recording.y[e], recording.h[e]
    cos, sin = elementary.cos(h), elementary.sin(h)
    return Course(
        x + centre.x * cos - centre.y * sin,
        y + centre.x * sin + centre.y * cos,
        ground + (float(centre.z) if isinstance(body, osc.Pedestrian) else 0.0),
        h,
        recording.time_step,
    )


def centred(body: Body, name: str) -> Body:
    """Return a body of version 1.0 whose reference point is the middle of its box on the ground.

    Args:
        body: without references to parameters.
        name: CARLA's blueprint.
    """
    centre: Any = body.bounding_box.center
    z = 0.0 if isinstance(body, osc.Pedestrian) else centre.z
    box = replace(body.bounding_box, center=osc.Center(0.0, 0.0, z))
    none = osc.Properties()
    if isinstance(body, osc.Vehicle):
        axles = _moved(body.axles, -centre.x)
        return osc.Vehicle(name, body.vehicle_category, box, body.performance, axles, none)
    if isinstance(body, osc.Pedestrian):
        kind = body.pedestrian_category
        return osc.Pedestrian(name, kind, body.mass, box, none, model=name)
    return osc.MiscObject(name, body.misc_object_category, body.mass, box, none)


def _moved(axles: osc.Axles, by: float) -> osc.Axles:
    def moved(axle: osc.Axle) -> osc.Axle:
        x: Any = axle.position_x
        return replace(axle, position_x=x + by)

    return osc.Axles(
        moved(axles.front or axles.rear), moved(axles.rear), tuple(map(moved, axles.additional))
    )


HERO = "hero"
"""The ego's name, which CARLA's agents look for."""

STATES = ("off", "red", "red", "yellow", "green")
"""States of a light in CARLA, by the code in `Rollout.lights`; CARLA has no red with yellow."""

LIGHT_REACH = 2.0
"""Largest distance of a light from its ``pos=x,y`` [m]; the first that is nearer is taken."""

_STOP_SIGN = "206"  # VzKat; CARLA makes a traffic.stop of it


def act(
    courses: Mapping[str, Course],
    recording: Recording,
    changes: Sequence[tuple[float, osc.Environment]],
    roads: OpenDrive,
    stop: osc.Trigger,
) -> osc.Act:
    """Return the one act: everybody's course, the lights and the weather.

    Args:
        courses: of the participants that have one, by name; not the ego's.
        recording: for its lights.
        changes: of the environment, each with its time [s]; the first is the start's.
        roads: the map, for where its lights are.
        stop: when it ends.

    Raises:
        UnsupportedError: a light that ScenarioRunner cannot find or set.
    """
    start = _at(0.0, recording.time_step, "start")
    groups = [
        _group(f"{name}_group", name, [_event(f"{name}_moves", start, [_follow(name, item)])])
        for name, item in courses.items()
    ]
    if events := list(_light_events(recording, roads)):
        groups.append(_group("traffic_lights", HERO, events))
    later = list(changes[1:])
    if not courses:  # nothing keeps the act alive to its end: stating the weather again does
        later.append((_duration(recording), changes[-1][1]))
    if events := [
        _event(
            f"weather_{i}",
            _at(time, recording.time_step, f"weather_{i}_at"),
            [osc.GlobalAction(osc.EnvironmentAction(item))],
        )
        for i, (time, item) in enumerate(later, 1)
    ]:
        groups.append(_group("environment", HERO, events))
    return osc.Act("act", tuple(groups), start, stop)


def changes(
    scenario: osc.OpenScenario, recording: Recording, start: osc.Environment
) -> list[tuple[float, osc.Environment]]:
    """Return the environment at the start and after each change, with their times [s]."""
    found = [(0.0, start)]
    for node in walk(recorded(scenario, recording).storyboard):
        if isinstance(node, osc.Event):
            (time,) = (c for c in walk(node) if isinstance(c, osc.SimulationTimeCondition))
            for below in walk(node):
                if isinstance(below, osc.EnvironmentAction):
                    found.append((float(time.value), below.environment))  # type: ignore[arg-type]
    found[1:] = sorted(found[1:], key=lambda change: change[0])
    for i, (seconds, new) in enumerate(found[1:], 1):
        found[i] = seconds, environment(new, found[i - 1][1])
    return found


def end(recording: Recording, arrival: osc.ReachPositionCondition | None) -> osc.Trigger:
    """Return when it is over: after the recorded time, or when the ego arrives."""
    over = _at(_duration(recording), recording.time_step, "duration")
    if arrival is None:
        return over
    triggering = osc.TriggeringEntities(osc.TriggeringEntitiesRule.ANY, (osc.EntityRef(HERO),))
    arrives = osc.ByEntityCondition(triggering, osc.EntityCondition(arrival))
    condition = osc.Condition("ego_arrives", 0.0, osc.ConditionEdge.NONE, arrives)
    return osc.Trigger((*over.condition_groups, osc.ConditionGroup((condition,))))


def criteria(roads: OpenDrive) -> osc.ConditionGroup:
    """Return what the ego is judged by: collisions, leaving the road; lights and stop signs."""
    names = ["CollisionTest", "OffRoadTest"]
    if lights(roads):
        names.append("RunningRedLightTest")
    if any(signal.type == _STOP_SIGN for road in roads.roads for signal in road.signals):
        names.append("RunningStopTest")
    return osc.ConditionGroup(tuple(_criterion(name) for name in names))


def _criterion(name: str) -> osc.Condition:
    # ScenarioRunner reads the names of these conditions and no more.
    nothing = osc.ParameterCondition("", "", osc.Rule.LESS_THAN)  # the criterion's own defaults
    condition = osc.ByValueCondition(nothing)
    return osc.Condition(f"{osc.CRITERIA}{name}", 0.0, osc.ConditionEdge.NONE, condition)


def _follow(name: str, course: Course) -> osc.PrivateAction:
    return osc.PrivateAction(osc.RoutingAction(course.trajectory(f"{name}_course")))


def _group(name: str, actor: str, events: Sequence[osc.Event]) -> osc.ManeuverGroup:
    """Return a group; its name must be its own, for ScenarioRunner keeps what is done by it."""
    actors = osc.Actors(False, (osc.EntityRef(actor),))
    return osc.ManeuverGroup(name, 1, actors, (osc.Maneuver("maneuver", tuple(events)),))


def _duration(recording: Recording) -> float:
    return float((recording.x.shape[1] - 1) * recording.time_step)


def _at(seconds: float, time_step: float, name: str) -> osc.Trigger:
    """Return a trigger that fires in the tick of a time [s].

    Version 1.0 has no ``greaterOrEqual``: it fires after half a step before. At the start that is
    no time, but time is less than a step.
    """
    clock = osc.SimulationTimeCondition(seconds - 0.5 * time_step, osc.Rule.GREATER_THAN)
    if seconds == 0.0:
        clock = osc.SimulationTimeCondition(time_step, osc.Rule.LESS_THAN)
    condition = osc.Condition(name, 0.0, osc.ConditionEdge.NONE, osc.ByValueCondition(clock))
    return osc.Trigger((osc.ConditionGroup((condition,)),))


def _event(
    name: str, start: osc.Trigger, parts: Sequence[osc.GlobalAction | osc.PrivateAction]
) -> osc.Event:
    actions = tuple(osc.Action(f"{name}_{i}", part) for i, part in enumerate(parts, 1))
    return osc.Event(name, osc.Priority.PARALLEL, actions, start, 1)


def _light_events(recording: Recording, roads: OpenDrive) -> Iterator[osc.Event]:
    """Yield an event for each instant at which lights change, the first for the start."""
    known = {light.id: light for light in lights(roads)}
    wrong = list(_misplaced(recording, known))
    if wrong:
        raise UnsupportedError(*wrong)
    now: dict[str, str] = {}
    for k in range(recording.lights.shape[1]):
        parts = []
        for name, state in zip(recording.light_names, recording.lights[:, k].tolist(), strict=True):
            if now.get(name) != STATES[state]:
                now[name] = STATES[state]
                parts.append(_light_action(known[name], STATES[state]))
        if parts:
            step = recording.time_step
            yield _event(f"lights_{k}", _at(k * step, step, f"lights_{k}_at"), parts)


def _light_action(light: Light, state: str) -> osc.GlobalAction:
    named = osc.TrafficSignalStateAction(carla_name(light), state)
    return osc.GlobalAction(osc.InfrastructureAction(osc.TrafficSignalAction(named)))


def carla_name(light: Light) -> str:
    """Return what a light is called by: its place in CARLA's frame [m]."""
    return f"pos={light.x:.3f},{0.0 - light.y:.3f}"


def _misplaced(recording: Recording, known: Mapping[str, Light]) -> Iterator[str]:
    """Yield why lights cannot be set."""
    for s, name in enumerate(recording.light_names):
        value: Any = known.get(name)
        if value is None:
            yield f"the traffic light {name} must be on the map, for it is found by its place"
            continue
        near = [
            other.id
            for other in known.values()
            if other.id != name
            and elementary.hypot(other.x - value.x, other.y - value.y) < LIGHT_REACH
        ]
        if near:
            yield (
                f"the traffic light {name} must stand {LIGHT_REACH:g} m or more from all others, "
                f"got {', '.join(near)} nearer: ScenarioRunner could not distinguish them"
            )
        if (recording.lights[s] >= len(STATES)).any():
            yield f"the traffic light {name} takes up a state that CARLA has not"
