"""Layers 3 to 5 as individuals: participants, what happens, temporary changes, weather."""

from collections.abc import Iterable, Mapping
from typing import NamedTuple

import pyoxigraph as ox

from bridgegen.base.errors import OntologyError
from bridgegen.scenario.language.adversary import LOOKING
from bridgegen.scenario.language.story import (
    Action,
    Arrival,
    Change,
    ConditionSpec,
    EventSpec,
    Indication,
    Jam,
    KeepDistance,
    LaneChange,
    LaneOffset,
    Opening,
    Participant,
    RoadWorks,
    SpeedChange,
    Story,
    Waypoint,
    WeatherChange,
)
from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.roads import lane_name, road_name
from bridgegen.scenario.ontology.site import Site
from bridgegen.scenario.participants import PARTICIPANTS, Body
from bridgegen.scenario.weather import PARTS

WEATHER = tuple(
    (part.link, part.owl_class, names)
    for part, parameters in PARTS.items()
    if (names := tuple(parameter.name for parameter in parameters if parameter.is_declared))
)
"""The parts of the weather that scenario files describe: link, class, parameters."""

CONDITIONS = {
    "time": "SimulationTimeCondition",
    "distance": "RelativeDistanceCondition",
    "gap": "RelativeDistanceCondition",
    "ttc": "TimeToCollisionCondition",
    "headway": "TimeHeadwayCondition",
    "speed": "SpeedCondition",
    "travelled": "TraveledDistanceCondition",
    "standstill": "StandStillCondition",
    "contact": "CollisionCondition",
    "after": "StoryboardElementStateCondition",
    "began": "StoryboardElementStateCondition",
}
"""The class of each kind of condition."""

ROUTE_CHANGE = ("has_change_start", "has_change_end", "has_return_start", "has_return_end")
"""Links of a route to the places between which it changes lanes, if it does."""

EGO = "ego"

SMOOTH = 4
"""Order of the spline along which a vehicle leaves the lanes: its curvature is continuous."""
"""The name of the participant under test."""


# -- layer 4 ---------------------------------------------------------------------------------------


def add_participant(
    builder: Builder, participant: Participant, site: Site, driver: str, ideal: str
) -> ox.NamedNode:
    """Add a participant with its body, route and init actions, and its driver if it has one.

    Args:
        builder: takes the individuals.
        participant: the participant.
        site: where it is.
        driver: the ego's.
        ideal: the stages of that which are ideal, separated by commas.
    """
    put, name = builder.put, participant.name
    node = builder.node(name, PARTICIPANTS[participant.type].owl_class)
    put(node, "has_name", name)
    if participant.model:
        put(node, "has_model", participant.model)
    if participant.siren:
        put(node, "has_siren", "on")
    if participant.exceeds_limit:
        put(node, "has_reason_to_exceed", participant.exceeds_limit)
    if participant.off_crosswalk:
        put(node, "has_reason_off_crosswalk", participant.off_crosswalk)
    _add_body(builder, node, participant.body)
    driver = driver if name == EGO else participant.driver
    if (name == EGO and driver) or driver in (*LOOKING, EGO):
        controller = builder.node(f"{name}_controller", "Controller")
        put(controller, "has_name", f"{name}_driver")
        put(controller, "has_driver", driver)
        if ideal and name == EGO:
            put(controller, "has_ideal_stages", ideal)
        put(node, "has_controller", controller)
    start = add_position(builder, f"{name}_start", participant.start, site)
    if participant.heading != 0.0:
        builder.quantity(start, "has_relative_heading", participant.heading)
    if participant.is_door:  # the event in which it opens takes its place and its path
        _add_trajectory(builder, participant, start, site)
    else:
        teleport = builder.node(f"{name}_teleport", "TeleportAction")
        put(teleport, "has_position", start)
        put(node, "has_init_action", teleport)
    if participant.conduct != "obstacle" or participant.is_door:
        speed = builder.node(f"{name}_init_speed", "SpeedAction")
        builder.quantity(speed, "has_target_speed", participant.speed)
        put(node, "has_init_action", speed)
    if participant.path and not participant.is_door:
        put(node, "has_init_action", _add_trajectory(builder, participant, start, site))
    if participant.end is not None:
        route = builder.node(f"{name}_route", "Route")
        put(route, "has_start", start)
        put(
            route,
            "has_destination",
            add_position(builder, f"{name}_destination", participant.end, site),
        )
        for link, place in zip(ROUTE_CHANGE, participant.change, strict=False):
            put(route, link, add_position(builder, f"{name}{link[3:]}", place, site))
        put(node, "has_route", route)
    return node


def add_perception(builder: Builder, story: Story) -> None:
    """Add the false positives of the ego's sensors and its tracker, which its controller has."""
    controller = builder.iri(f"{EGO}_controller")
    for name, value in story.tracker.items():
        builder.quantity(controller, f"has_tracker_{name}", value)
    for ghost in story.ghosts:
        node = builder.node(ghost.name, "Ghost")
        builder.put(node, "has_name", ghost.name)
        builder.put(node, "has_ghost_type", ghost.type)
        if ghost.mirrors:
            builder.put(node, "has_ghost_mirrors", ghost.mirrors)
        for name, value in ghost.numbers.items():
            builder.quantity(node, f"has_ghost_{name}", value)
        builder.put(controller, "has_ghost", node)


def _add_body(builder: Builder, node: ox.NamedNode, body: Body) -> None:
    values = {
        "has_box_length": body.length,
        "has_box_width": body.width,
        "has_box_height": body.height,
        "has_center_ahead": body.center_ahead,
    }
    if body.wheelbase:
        values |= {
            "has_wheelbase": body.wheelbase,
            "has_max_acceleration": body.max_acceleration,
            "has_max_deceleration": body.max_deceleration,
        }
    else:
        values["has_mass"] = body.mass
    if body.max_speed:
        values["has_max_speed"] = body.max_speed
    for name, value in values.items():
        builder.put(node, name, value)


def _add_trajectory(
    builder: Builder, participant: Participant, start: ox.NamedNode, site: Site
) -> ox.NamedNode:
    """Add the following of a participant's own path, at the speed that it has at each time."""
    put, name = builder.put, participant.name
    action = builder.node(f"{name}_follow", "FollowTrajectoryAction")
    trajectory = builder.node(f"{name}_path", "Trajectory")
    put(action, "has_trajectory", trajectory)
    put(trajectory, "has_name", f"{name}_path")
    if participant.conduct in ("vehicle", "obstacle"):
        put(trajectory, "has_spline_order", min(SMOOTH, len(participant.path)))
    for number, point in enumerate(participant.path, start=1):
        vertex = builder.node(f"{name}_vertex_{number}", "Vertex")
        put(trajectory, "has_vertex", vertex)
        put(vertex, "has_index", number)
        place = start
        if number > 1:
            place = add_position(builder, f"{name}_point_{number}", point, site)
        put(vertex, "has_position", place)
    return action


def add_position(builder: Builder, name: str, waypoint: Waypoint, site: Site) -> ox.NamedNode:
    """Add the position of a waypoint.

    Raises:
        OntologyError: the road network has no such leg or lane.
    """
    leg = site.leg(waypoint.leg)
    if leg is None:
        raise OntologyError(f"{site.name}: {waypoint} needs leg {waypoint.leg}, got none")
    distance = waypoint.distance
    at = float(builder.values[distance] if isinstance(distance, str) else distance)
    index = leg.road_at(at)
    road = leg.roads[index]
    there = (
        waypoint.lane <= len(road.along(waypoint.way))
        if isinstance(waypoint.lane, int)
        else any((s.type, s.direction) == (waypoint.lane, waypoint.way) for s in road.strips)
    )
    if not there:
        raise OntologyError(f"{site.name}: there is no {waypoint} on road {road.road_id}")
    node = builder.node(name, "LanePosition")
    lane = lane_name(leg, index, waypoint.way, waypoint.lane)
    builder.put(node, "on_lane", builder.iri(lane))
    builder.quantity(node, "has_distance", distance)
    if waypoint.offset != 0.0:
        builder.quantity(node, "has_lateral_offset", waypoint.offset)
    return node


# -- events ----------------------------------------------------------------------------------------


def add_event(
    builder: Builder, event: EventSpec, declared: Mapping[str, object], site: Site
) -> ox.NamedNode:
    """Add an event: participant, actions and conditions.

    Args:
        builder: takes the individuals.
        event: what happens.
        declared: parameters and derived quantities by name.
        site: where it happens.
    """
    put = builder.put
    kind = "EnvironmentChangeEvent" if event.participant is None else "StoryboardEvent"
    node = builder.node(event.name, kind)
    put(node, "has_name", event.name)
    if event.participant is not None:
        put(node, "has_who", builder.iri(event.participant))
    number = 0
    for action in event.actions:
        parts: tuple[Action | _Switch, ...] = (action,)
        if isinstance(action, Indication):
            parts = _SWITCHES[action.side]
        elif isinstance(action, Opening):
            who = str(event.participant)
            comes = builder.node(f"{event.name}_comes", "AddEntityAction")
            put(comes, "has_entity_ref", builder.iri(who))
            put(comes, "has_position", builder.iri(f"{who}_start"))
            put(node, "has_what", comes)
            put(node, "has_what", builder.iri(f"{who}_follow"))
            continue
        for part in parts:
            number += 1
            suffix = "" if number == 1 else f"_{number}"
            name = f"{event.name}_action{suffix}"
            put(node, "has_what", _add_action(builder, name, part, declared, site))
    trigger = builder.node(f"{event.name}_trigger", "Trigger")
    for number, conditions in enumerate(event.when, start=1):
        name = f"{event.name}_condition_{number}"
        put(trigger, "has_condition", _add_alternative(builder, name, conditions))
    put(node, "has_when", trigger)
    return node


class _Switch(NamedTuple):
    """A light of a vehicle, and what it does from then on."""

    light: str
    mode: str


_SWITCHES = {
    "left": (
        _Switch("warningLights", "off"),
        _Switch("indicatorRight", "off"),
        _Switch("indicatorLeft", "flashing"),
    ),
    "right": (
        _Switch("warningLights", "off"),
        _Switch("indicatorLeft", "off"),
        _Switch("indicatorRight", "flashing"),
    ),
    "hazard": (_Switch("warningLights", "flashing"),),
    "off": (
        _Switch("warningLights", "off"),
        _Switch("indicatorLeft", "off"),
        _Switch("indicatorRight", "off"),
    ),
}


def _add_action(
    builder: Builder,
    name: str,
    action: Action | _Switch,
    declared: Mapping[str, object],
    site: Site,
) -> ox.NamedNode:
    if isinstance(action, _Switch):
        node = builder.node(name, "LightStateAction")
        builder.put(node, "has_light_type", action.light)
        builder.put(node, "has_light_mode", action.mode)
    elif isinstance(action, SpeedChange):
        node = builder.node(name, "SpeedAction")
        builder.quantity(node, "has_target_speed", action.speed)
        _add_change(builder, node, action.change)
    elif isinstance(action, LaneChange):
        node = builder.node(name, "LaneChangeAction")
        builder.put(node, "has_lane_count", action.lanes)
        _add_change(builder, node, action.change)
    elif isinstance(action, LaneOffset):
        node = builder.node(name, "LaneOffsetAction")
        builder.quantity(node, "has_target_offset", action.offset)
        builder.quantity(node, "has_max_lateral_acceleration", action.acceleration)
        if action.shape != "linear":
            builder.put(node, "has_dynamics_shape", action.shape)
    elif isinstance(action, KeepDistance):
        node = builder.node(name, "LongitudinalDistanceAction")
        builder.put(node, "has_entity_ref", builder.iri(action.to))
        if action.distance is not None:
            builder.quantity(node, "has_kept_distance", action.distance)
        if action.time is not None:
            builder.quantity(node, "has_kept_time", action.time)
        builder.quantity(node, "has_max_acceleration", action.acceleration)
        builder.quantity(node, "has_max_deceleration", action.braking)
        if action.max_speed is not None:
            builder.quantity(node, "has_max_speed", action.max_speed)
    elif isinstance(action, Arrival):
        node = builder.node(name, "SynchronizeAction")
        builder.put(node, "has_entity_ref", builder.iri(action.other))
        here = add_position(builder, f"{name}_place", action.at, site)
        there = add_position(builder, f"{name}_master_place", action.place, site)
        builder.put(node, "has_position", here)
        builder.put(node, "has_master_position", there)
    else:
        # An Indication is several switches, and an Opening several actions.
        assert isinstance(action, WeatherChange)
        node = builder.node(name, "EnvironmentAction")
        weather = add_weather(builder, declared, action.prefix)
        if weather is not None:
            builder.put(node, "has_weather", weather)
    return node


def _add_change(builder: Builder, node: ox.NamedNode, change: Change) -> None:
    for name, value in (
        ("has_rate", change.rate),
        ("has_transition_time", change.time),
        ("has_transition_distance", change.distance),
    ):
        if value is not None:
            builder.quantity(node, name, value)
    if change.jerk is not None:
        builder.put(node, "has_max_jerk", change.jerk)
    if change.shape != "linear":
        builder.put(node, "has_dynamics_shape", change.shape)


def _add_alternative(
    builder: Builder, name: str, conditions: tuple[ConditionSpec, ...]
) -> ox.NamedNode:
    if len(conditions) == 1:
        return _add_condition(builder, name, conditions[0])
    group = builder.node(name, "ConditionGroup")
    for number, condition in enumerate(conditions, start=1):
        node = _add_condition(builder, f"{name}_{number}", condition)
        builder.put(group, "has_condition", node)
    return group


def _add_condition(builder: Builder, name: str, condition: ConditionSpec) -> ox.NamedNode:
    node = builder.node(name, CONDITIONS[condition.kind])
    for link, target in (
        ("has_entity_ref", condition.to),
        ("has_subject", condition.of),
        ("has_event_ref", condition.event),
    ):
        if target is not None:
            builder.put(node, link, builder.iri(target))
    if condition.kind == "gap":
        builder.put(node, "has_distance_measure", "gap")
    if condition.kind == "began":
        builder.put(node, "has_event_state", "began")
    if condition.kind != "contact":
        builder.quantity(node, "has_value", condition.value)
    return node


# -- layer 3 ---------------------------------------------------------------------------------------


def add_jam(builder: Builder, jam: Jam, site: Site) -> ox.NamedNode:
    """Add a queue of standing vehicles, which are participants already."""
    node = builder.node(jam.name, "TrafficJam")
    builder.put(node, "has_name", jam.name)
    for name in jam.participants:
        builder.put(node, "has_who", builder.iri(name))
    leg = site.leg(jam.tail.leg)
    assert leg is not None  # its vehicles stand there
    distance = jam.tail.distance
    at = float(builder.values[distance] if isinstance(distance, str) else distance)
    lane = lane_name(leg, leg.road_at(at), jam.tail.way, jam.tail.lane)
    builder.put(node, "on_lane", builder.iri(lane))
    return node


def add_works(builder: Builder, works: RoadWorks, site: Site) -> ox.NamedNode:
    """Add a closed lane with its cones and its sign."""
    put, name = builder.put, works.name
    node = builder.node(name, "RoadWorks")
    put(node, "has_name", name)
    leg = site.leg(works.start.leg)
    if leg is None:
        raise OntologyError(f"{site.name}: {name} needs leg {works.start.leg}, got none")
    put(node, "on_road", builder.iri(road_name(leg, 0)))
    lane = lane_name(leg, 0, works.start.way, works.start.lane)
    put(node, "closes_lane", builder.iri(lane))
    elements = [(f"{name}_cone_{k}", "cone", at) for k, at in enumerate(works.cones, start=1)]
    for element, kind, place in [*elements, (f"{name}_sign", "sign", works.sign)]:
        part = builder.node(element, PARTICIPANTS[kind].owl_class)
        put(node, "has_element", part)
        put(part, "has_name", element)
        _add_body(builder, part, PARTICIPANTS[kind].body)
        put(part, "has_position", add_position(builder, f"{element}_place", place, site))
    return node


# -- layer 5 ---------------------------------------------------------------------------------------


def add_weather(
    builder: Builder, declared: Mapping[str, object], prefix: str = ""
) -> ox.NamedNode | None:
    """Add the weather, with the parts that the declared parameters describe; None if none.

    Args:
        builder: where to.
        declared: parameters and derived quantities by name.
        prefix: of the parameters' names, and of the individuals'.
    """
    parts: Iterable[tuple[str, str, list[str]]] = [
        (link, cls, [n for n in names if prefix + n in declared]) for link, cls, names in WEATHER
    ]
    if not any(names for _, _, names in parts):
        return None
    node = builder.node(f"{prefix}weather", "Weather")
    for link, cls, names in parts:
        if names:
            part = builder.node(f"{prefix}weather_{cls.lower()}", cls)
            builder.put(node, link, part)
            for name in names:
                builder.quantity(part, f"has_{name}", prefix + name)
    return node
