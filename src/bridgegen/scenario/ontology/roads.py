"""Layers 1 and 2 as individuals: roads, lanes, where they meet, what stands beside them."""

import pyoxigraph as ox

from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.site import (
    ArmRoad,
    Direction,
    Facility,
    Leg,
    Searched,
    Site,
    SiteLane,
)

_WAYS: tuple[Direction, ...] = ("in", "out")
_NAMES = {
    "Crosswalk": "crosswalk",
    "StopLine": "stop_line",
    "TrafficLight": "light",
    "YieldSign": "yield_sign",
    "StopSign": "stop_sign",
    "SpeedLimitSign": "speed_sign",
    "StreetLight": "street_light",
    "ConstructionCard": "construction_sign",
    "Signage": "sign",
}


def add_road_network(builder: Builder, site: Site) -> ox.NamedNode:
    """Add the roads of a site, the area in which they meet, and their facilities."""
    put = builder.put
    network = builder.node("road_network", "RoadNetwork")
    put(network, "has_name", site.name)
    if site.map_file is not None:
        put(network, "has_map_file", site.map_file)
    if site.left_hand:
        put(network, "has_driving_side", "left")
    if site.country:
        put(network, "has_country", site.country)
    crossing: ox.NamedNode | None = None
    if site.kind is not None:
        crossing = builder.node("intersection", site.kind)
        put(network, "has_area", crossing)
        put(crossing, "has_junction_id", site.place_id)
        if site.size is not None:
            builder.quantity(crossing, "has_size", site.size)
        for name, value in site.measures_of.items():
            builder.quantity(crossing, name, value)
    for leg in site.legs:
        previous: ox.NamedNode | None = None
        for index, road in enumerate(leg.roads):
            node = _add_road(builder, leg, index, road)
            put(network, "has_area", node)
            if previous is not None:
                put(previous, "has_continuation", node)
            else:
                put(node, "has_name", leg.name)
                if crossing is not None:
                    put(crossing, "has_leg", node)
                    put(node, "has_heading", float(leg.heading_deg))
            previous = node
    for facility in site.facilities:
        _add_facility(builder, network, site, facility)
    if site.phases:
        put(network, "has_signal_controller", _add_controller(builder, site))
    return network


def _add_road(builder: Builder, leg: Leg, index: int, road: ArmRoad) -> ox.NamedNode:
    """Add a road of a leg with its lanes."""
    put, quantity = builder.put, builder.quantity
    lanes = {way: road.along(way) for way in _WAYS}
    node = builder.node(road_name(leg, index), "Road")
    put(node, "has_road_id", road.road_id)
    quantity(node, "has_length", road.length)
    put(node, "has_junction_end", road.junction_end)
    if road.station is not None:
        put(node, "has_station", float(road.station))
    builder.count(node, "has_inbound_lanes", len(lanes["in"]), road.counts.get("in"))
    builder.count(node, "has_outbound_lanes", len(lanes["out"]), road.counts.get("out"))
    widths = {lane.width for lane in road.lanes if lane.type == "driving"}
    if len(widths) == 1:
        quantity(node, "has_lane_width", next(iter(widths)))
    if road.speed_limit is not None:
        quantity(node, "has_speed_limit", road.speed_limit)
    if road.road_type is not None:
        put(node, "has_road_type", road.road_type)
    if road.grade != 0.0 or isinstance(road.grade, Searched):
        quantity(node, "has_grade", road.grade)
    if road.change is not None:
        quantity(node, "has_change_at", road.change[0])
        for name, later in zip(("road", "marking"), road.change[1:], strict=True):
            if later:
                put(node, f"has_later_{name}_type", later)
    for name, limit in road.closes.items():
        quantity(node, f"closes_above_{name}", limit)
    for number, segment in enumerate(road.segments, start=1):
        part = builder.node(f"{road_name(leg, index)}_segment_{number}", "GeometrySegment")
        put(node, "has_segment", part)
        put(part, "has_index", number)
        quantity(part, "has_length", segment.length)
        for name, curvature in (
            ("has_start_curvature", segment.start_curvature),
            ("has_end_curvature", segment.end_curvature),
        ):
            if curvature != 0.0 or isinstance(curvature, Searched):
                quantity(part, name, curvature)
    for way in _WAYS:
        for rank, lane in enumerate(lanes[way], start=1):
            place = _add_lane(builder, lane, lane_name(leg, index, way, rank), "Lane")
            put(node, "has_lane", place)
            for turn in lane.turns:
                put(place, "allows_turn", turn)
    for strip in road.strips:
        name = lane_name(leg, index, strip.direction, strip.type)
        place = _add_lane(builder, strip, name, strip.type.capitalize())
        put(place, "has_lane_type", strip.type)
        put(node, "has_strip", place)
    return node


def _add_lane(builder: Builder, lane: SiteLane, name: str, cls: str) -> ox.NamedNode:
    node = builder.node(name, cls)
    builder.put(node, "has_lane_id", lane.lane_id)
    builder.put(node, "has_direction", lane.direction)
    builder.quantity(node, "has_width", lane.width)
    return node


def _add_facility(
    builder: Builder, network: ox.NamedNode, site: Site, facility: Facility
) -> ox.NamedNode:
    """Add a crosswalk, line, light or sign on the first road of a leg."""
    put = builder.put
    leg = site.leg(facility.leg)
    assert leg is not None  # the template that made the site made both
    node = builder.node(facility_name(facility), facility.cls)
    put(network, "has_area" if facility.cls == "Crosswalk" else "has_facility", node)
    put(node, "has_name", facility_name(facility))
    put(node, "on_road", builder.iri(road_name(leg, 0)))
    put(node, "has_distance", float(facility.distance))
    own_id = f"{leg.roads[0].road_id}{_OBJECTS.index(facility.cls) + 1:02}"
    put(node, "has_object_id", facility.object_id or own_id)
    if facility.s is not None:
        put(node, "has_s", float(facility.s))
    if facility.t is not None:
        put(node, "has_t", float(facility.t))
    if facility.width is not None:
        builder.quantity(node, "has_width", facility.width)
    if facility.speed_limit is not None:
        put(node, "has_speed_limit", float(facility.speed_limit))
    link = "marks_lane" if facility.cls == "StopLine" else "governs_lane"
    for way in facility.governs:
        for rank in range(1, len(leg.roads[0].along(way)) + 1):
            put(node, link, builder.iri(lane_name(leg, 0, way, rank)))
    return node


_OBJECTS = tuple(_NAMES)


def _add_controller(builder: Builder, site: Site) -> ox.NamedNode:
    """Add the controller of all lights with its phases."""
    put = builder.put
    controller = builder.node("signals", "SignalController")
    put(controller, "has_name", "signals")
    put(controller, "has_object_id", "1")
    builder.quantity(controller, "has_offset", site.signal_offset)
    lights = [facility for facility in site.facilities if facility.cls == "TrafficLight"]
    for light in lights:
        put(controller, "has_light", builder.iri(facility_name(light)))
    for number, phase in enumerate(site.phases, start=1):
        node = builder.node(f"signals_phase_{number}", "SignalPhase")
        put(controller, "has_phase", node)
        put(node, "has_index", number)
        put(node, "has_name", phase.name)
        builder.quantity(node, "has_duration", phase.duration)
        for link, legs in (("gives_green_to", phase.green), ("gives_yellow_to", phase.yellow)):
            for leg in legs:
                for light in (facility for facility in lights if facility.leg == leg):
                    put(node, link, builder.iri(facility_name(light)))
    return controller


def facility_name(facility: Facility) -> str:
    """Return the name of the individual of a crosswalk, line, light or sign."""
    number = f"_{facility.number}" if facility.number > 1 else ""
    return f"{_NAMES[facility.cls]}_{facility.leg}{number}"


def road_name(leg: Leg, index: int) -> str:
    """Return the name of the individual of a leg's road."""
    return f"leg_{leg.name}" if index == 0 else f"leg_{leg.name}_{index + 1}"


def lane_name(leg: Leg, index: int, direction: str, rank: int | str) -> str:
    """Return the name of the individual of a lane (by rank), or of a strip (by kind)."""
    return f"{road_name(leg, index)}_{direction}_{rank}"
