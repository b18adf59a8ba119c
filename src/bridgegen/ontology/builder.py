"""The individuals of a scenario, one method each; `individuals` puts them together."""

from collections.abc import Mapping
from typing import TYPE_CHECKING
from urllib.parse import quote

import pyoxigraph as ox

from bridgegen.errors import OntologyError, UnsupportedError
from bridgegen.odd.parameters import Derived, Parameter
from bridgegen.ontology.site import ArmRoad, Leg, Site
from bridgegen.ontology.vocabulary import (
    NAMED_INDIVIDUAL,
    OWL_ONTOLOGY,
    SCENARIOS,
    TYPE,
    VERSION_INFO,
    bg,
    tbox,
)

if TYPE_CHECKING:
    from bridgegen.odd.scenario import (
        ConditionSpec,
        EventSpec,
        LogicalScenario,
        Participant,
        Waypoint,
    )

STATIC_BINDINGS = {
    "lane_width": ("has_lane_width", "has_width"),
    "lanes_per_direction": ("has_inbound_lanes", "has_outbound_lanes"),
    "arm_length": ("has_length",),
    "intersection_size": ("has_size",),
}
"""The data properties that carry the static parameters' values."""

WEATHER = (
    ("has_rain", "Rain", ("precipitation", "precipitation_deposits")),
    ("has_cloud", "Cloud", ("cloudiness",)),
    ("has_wind", "Wind", ("wind_intensity",)),
    ("has_fog", "Fog", ("fog_density", "fog_distance", "fog_falloff")),
    ("hasSun", "Sun", ("sun_altitude_angle", "sun_azimuth_angle")),
    ("has_road_state", "RoadState", ("wetness", "friction")),
)
"""The parts of the weather; each parameter's data property is ``has_`` and its name."""

VEHICLES = {
    "car": ("Car", {
        "has_box_length": 4.6, "has_box_width": 1.9, "has_box_height": 1.5,
        "has_center_ahead": 1.4, "has_wheelbase": 2.8,
        "has_max_speed": 60.0, "has_max_acceleration": 5.0, "has_max_deceleration": 9.0,
    }),
}  # fmt: skip
"""Class and body [m, m/s, m/s²] per type of participant; the car is a mid-size saloon."""

EGO = "ego"
"""The name of the participant under test."""


class Builder:
    """Collects quads; each method adds one individual with all that hangs on it."""

    def __init__(self, name: str, values: Mapping[str, float]) -> None:
        iri = SCENARIOS + quote(name, safe="")
        self.base = iri + "#"
        self.values = values
        header = ox.NamedNode(iri)
        made_with = ox.Literal(f"made with the BridgeGen ontology {tbox().version}")
        self.quads = [
            ox.Quad(header, TYPE, OWL_ONTOLOGY),
            ox.Quad(header, VERSION_INFO, made_with),
        ]
        self.bound: dict[str, set[str]] = {}
        self.named: set[str] = set()

    def node(self, name: str, cls: str) -> ox.NamedNode:
        """Add an individual of a class.

        Raises:
            OntologyError: there is one of that name (an event called like a participant, say).
        """
        if name in self.named:
            raise OntologyError(f"'{name}' must name one thing only, got a second: {cls}")
        self.named.add(name)
        node = ox.NamedNode(self.base + name)
        self.quads.append(ox.Quad(node, TYPE, NAMED_INDIVIDUAL))
        self.quads.append(ox.Quad(node, TYPE, bg(cls)))
        return node

    def iri(self, name: str) -> ox.NamedNode:
        """Return the IRI of the individual of that name, whether it has been added or not."""
        return ox.NamedNode(self.base + name)

    def put(self, node: ox.NamedNode, name: str, value: str | int | float | ox.NamedNode) -> None:
        """State a value or a link; a float becomes an xsd:double."""
        term = value if isinstance(value, ox.NamedNode) else ox.Literal(value)
        self.quads.append(ox.Quad(node, bg(name), term))

    def quantity(self, node: ox.NamedNode, name: str, value: str | float) -> None:
        """State a number; a text is a parameter's name, whose value is bound to the node."""
        if isinstance(value, str):
            self.put(node, name, float(self.values[value]))
            self.bind(node, name, value)
        else:
            self.put(node, name, float(value))

    def bind(self, node: ox.NamedNode, name: str, parameter: str) -> None:
        """Bind the value of a node's property to a parameter."""
        self.put(node, "has_parameter", self.iri(f"p_{parameter}"))
        self.bound.setdefault(parameter, set()).add(name)

    # -- scenario and parameters ---------------------------------------------------------------

    def scenario(self, scenario: "LogicalScenario") -> ox.NamedNode:
        """Add the scenario itself; what it consists of is linked by the caller."""
        node = self.node("scenario", "Scenario")
        self.put(node, "has_name", scenario.name)
        self.put(node, "has_duration", float(scenario.duration))
        self.put(node, "has_time_step", float(scenario.time_step))
        return node

    def parameter(self, name: str, parameter: Parameter | Derived) -> ox.NamedNode:
        """Add a parameter, after all that binds it."""
        derived = isinstance(parameter, Derived)
        node = self.node(f"p_{name}", "DerivedParameter" if derived else "Parameter")
        self.put(node, "has_name", name)
        self.put(node, "has_axis", str(parameter.axis))
        self.put(node, "has_unit", parameter.unit)
        if isinstance(parameter, Derived):
            self.put(node, "has_expression", parameter.value.source)
        else:
            self.put(node, "has_low", float(parameter.low))
            self.put(node, "has_high", float(parameter.high))
        if name not in self.bound:  # nobody carries its value, so it does so itself
            self.quantity(node, "has_value", name)
        for property_name in sorted(self.bound[name]):
            self.put(node, "binds_property", property_name)
        return node

    def explain(self, parameter: str, constraint: str) -> None:
        """Annotate a parameter, and the properties that carry its value, with a constraint."""
        self.put(self.iri(f"p_{parameter}"), "constraint", constraint)
        for name in sorted(self.bound[parameter]):
            self.quads.append(ox.Quad(bg(name), bg("constraint"), ox.Literal(constraint)))

    # -- layer 1 -------------------------------------------------------------------------------

    def road_network(self, site: Site) -> ox.NamedNode:
        """Add the roads that meet at a site."""
        network = self.node("road_network", "RoadNetwork")
        self.put(network, "has_name", site.name)
        if site.map_file is not None:
            self.put(network, "has_map_file", site.map_file)
        crossing = self.node("intersection", "Intersection")
        self.put(network, "has_area", crossing)
        self.put(crossing, "has_junction_id", site.junction_id)
        if site.size is not None:
            self.put(crossing, "has_size", float(site.size))
        for leg in site.legs:
            previous: ox.NamedNode | None = None
            for index, road in enumerate(leg.roads):
                node = self.road(leg, index, road)
                self.put(network, "has_area", node)
                if previous is None:
                    self.put(crossing, "has_leg", node)
                    self.put(node, "has_name", leg.name)
                    self.put(node, "has_heading", float(leg.heading_deg))
                else:
                    self.put(previous, "has_continuation", node)
                previous = node
        return network

    def road(self, leg: Leg, index: int, road: ArmRoad) -> ox.NamedNode:
        """Add a road of a leg with its lanes."""
        inward, outward = road.along("in"), road.along("out")
        node = self.node(_road_name(leg, index), "Road")
        self.put(node, "has_road_id", road.road_id)
        self.put(node, "has_length", float(road.length))
        self.put(node, "has_junction_end", road.junction_end)
        self.put(node, "has_inbound_lanes", len(inward))
        self.put(node, "has_outbound_lanes", len(outward))
        widths = {lane.width for lane in road.lanes}
        if len(widths) == 1:
            self.put(node, "has_lane_width", float(widths.pop()))
        if road.speed_limit is not None:
            self.put(node, "has_speed_limit", float(road.speed_limit))
        for lanes in (inward, outward):
            for rank, lane in enumerate(lanes, start=1):
                place = self.node(_lane_name(leg, index, lane.direction, rank), "Lane")
                self.put(node, "has_lane", place)
                self.put(place, "has_lane_id", lane.lane_id)
                self.put(place, "has_direction", lane.direction)
                self.put(place, "has_width", float(lane.width))
        return node

    def bind_static(self, site: Site, declared: Mapping[str, object]) -> None:
        """Bind the static parameters to the parts of a generated road network."""
        parts: dict[str, list[ox.NamedNode]] = {"has_size": [self.iri("intersection")]}
        for leg in site.legs:
            for index, road in enumerate(leg.roads):
                node = self.iri(_road_name(leg, index))
                for name in (
                    "has_length", "has_lane_width", "has_inbound_lanes", "has_outbound_lanes",
                ):  # fmt: skip
                    parts.setdefault(name, []).append(node)
                parts.setdefault("has_width", []).extend(
                    self.iri(_lane_name(leg, index, direction, rank))
                    for direction in ("in", "out")
                    for rank in range(1, len(road.along(direction)) + 1)
                )
        for parameter, names in STATIC_BINDINGS.items():
            if parameter in declared:
                for name in names:
                    for node in parts[name]:
                        self.bind(node, name, parameter)

    # -- layer 4 -------------------------------------------------------------------------------

    def participant(self, participant: "Participant", site: Site, driver: str) -> ox.NamedNode:
        """Add a participant with its body, route and init actions; the ego with its driver."""
        try:
            cls, body = VEHICLES[participant.type]
        except KeyError:
            raise UnsupportedError(
                f"participant {participant.name}: type must be one of "
                f"{', '.join(VEHICLES)}, got '{participant.type}'"
            ) from None
        name = participant.name
        node = self.node(name, cls)
        self.put(node, "has_name", name)
        for property_name, value in body.items():
            self.put(node, property_name, value)
        if name == EGO:
            controller = self.node(f"{name}_controller", "Controller")
            self.put(controller, "has_name", f"{name}_driver")
            self.put(controller, "has_driver", driver)
            self.put(node, "has_controller", controller)
        start = self.position(f"{name}_start", participant.start, site)
        teleport = self.node(f"{name}_teleport", "TeleportAction")
        self.put(teleport, "has_position", start)
        speed = self.node(f"{name}_init_speed", "SpeedAction")
        self.quantity(speed, "has_target_speed", participant.speed)
        self.put(node, "has_init_action", teleport)
        self.put(node, "has_init_action", speed)
        route = self.node(f"{name}_route", "Route")
        self.put(route, "has_start", start)
        destination = self.position(f"{name}_destination", participant.end, site)
        self.put(route, "has_destination", destination)
        self.put(node, "has_route", route)
        return node

    def position(self, name: str, waypoint: "Waypoint", site: Site) -> ox.NamedNode:
        """Add the position of a waypoint: on the inner lane, as the paper's points are."""
        leg_name, direction = waypoint.leg, waypoint.direction
        leg = next((leg for leg in site.legs if leg.name == leg_name), None)
        if leg is None:
            raise OntologyError(f"{site.name}: {waypoint.point} needs leg {leg_name}, got none")
        distance = waypoint.distance
        at = float(self.values[distance] if isinstance(distance, str) else distance)
        node = self.node(name, "LanePosition")
        lane = _lane_name(leg, leg.road_at(at), direction, 1)
        self.put(node, "on_lane", self.iri(lane))
        self.quantity(node, "has_distance_to_junction", distance)
        return node

    # -- events --------------------------------------------------------------------------------

    def event(self, event: "EventSpec") -> ox.NamedNode:
        """Add an event: who does what, when."""
        node = self.node(event.name, "Event")
        self.put(node, "has_name", event.name)
        self.put(node, "has_who", self.iri(event.participant))
        action = self.node(f"{event.name}_action", "SpeedAction")
        self.quantity(action, "has_target_speed", event.speed)
        self.quantity(action, "has_rate", event.rate)
        self.put(node, "has_what", action)
        trigger = self.node(f"{event.name}_trigger", "Trigger")
        for number, condition in enumerate(event.when, start=1):
            name = f"{event.name}_condition_{number}"
            self.put(trigger, "has_condition", self.condition(name, condition))
        self.put(node, "has_when", trigger)
        return node

    def condition(self, name: str, condition: "ConditionSpec") -> ox.NamedNode:
        """Add a condition."""
        if condition.kind == "time":
            node = self.node(name, "SimulationTimeCondition")
        else:
            node = self.node(name, "RelativeDistanceCondition")
            self.put(node, "has_entity_ref", self.iri(str(condition.to)))
        self.quantity(node, "has_value", condition.value)
        return node

    # -- layer 5 -------------------------------------------------------------------------------

    def weather(self, declared: Mapping[str, object]) -> ox.NamedNode | None:
        """Add the weather, with the parts that the declared parameters describe; None if none."""
        parts = [(link, cls, [n for n in names if n in declared]) for link, cls, names in WEATHER]
        if not any(names for _, _, names in parts):
            return None
        node = self.node("weather", "Weather")
        for link, cls, names in parts:
            if names:
                part = self.node(f"weather_{cls.lower()}", cls)
                self.put(node, link, part)
                for name in names:
                    self.quantity(part, f"has_{name}", name)
        return node


def _road_name(leg: Leg, index: int) -> str:
    return f"leg_{leg.name}" if index == 0 else f"leg_{leg.name}_{index + 1}"


def _lane_name(leg: Leg, index: int, direction: str, rank: int) -> str:
    return f"{_road_name(leg, index)}_{direction}_{rank}"
