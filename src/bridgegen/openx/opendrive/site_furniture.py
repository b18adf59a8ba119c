"""What stands and lies at a place of a map: crosswalks, stop lines, signs and traffic lights.

It becomes part of a scenario that takes place there. A map says which lights there are and whom
they are for, but not when they change: their phases are the scenario's. Where the scenario has no
lights, those of the map are off.
"""

from collections.abc import Iterator
from dataclasses import replace

from bridgegen.openx.opendrive.furniture import Signal, SignalReference
from bridgegen.openx.opendrive.legs import governs, leads_to, signals_on
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.to_owl.furniture import box_of, class_of, sign_of
from bridgegen.scenario.language.roads import RoadsSpec
from bridgegen.scenario.ontology.site import Facility, Leg, Site
from bridgegen.scenario.ontology.templates import phases_of

NEAR = 40.0
"""A light or a sign within this distance before a junction [m] is for that junction."""


def furnished(model: OpenDrive, site: Site, roads: RoadsSpec) -> Site:
    """Return a place of a map with what stands and lies there.

    Args:
        model: the road network.
        site: a junction, or a stretch of road.
        roads: of the scenario that takes place there.
    """
    found = [one for leg in site.legs for one in _on_leg(model, leg)]
    if site.kind is not None:
        lights = [one for leg in site.legs for one in _lights(model, site, leg)]
        found += lights
        if lights and roads.signals != "none":
            lit = {one.leg for one in lights}
            offset = roads.knobs["signal_offset"]
            assert not isinstance(offset, str)  # `knob_problems` refuses it
            headings = {leg.name: leg.heading_deg for leg in site.legs if leg.name in lit}
            phases = tuple(phases_of(roads, headings))
            site = replace(site, phases=phases, signal_offset=offset)
    return replace(site, facilities=tuple(_numbered(found)))


def _numbered(found: list[Facility]) -> Iterator[Facility]:
    """Yield facilities that are told apart by a number where a leg has several of a class."""
    seen: dict[tuple[str, str], int] = {}
    for one in found:
        seen[one.cls, one.leg] = number = seen.get((one.cls, one.leg), 0) + 1
        yield replace(one, number=number)


def _on_leg(model: OpenDrive, leg: Leg) -> Iterator[Facility]:
    """Yield the crosswalks, stop lines and signs on the first road of a leg."""
    arm = leg.roads[0]
    road = model.road(arm.road_id)
    for item in road.objects:
        cls, (low, high, _, _) = class_of(item), box_of(item)
        at = arm.distance(item.s)
        if at is None or cls not in ("Crosswalk", "StopLine"):
            continue
        if cls == "Crosswalk" and high > low:
            yield Facility(
                cls, leg.name, at, width=high - low, object_id=item.id, s=item.s
            )  # fmt: skip
        elif cls == "StopLine":
            yield Facility(cls, leg.name, at, governs=("in",), object_id=item.id, s=item.s)
    for signal in road.signals:
        cls, limit = sign_of(signal)
        at = arm.distance(signal.s)
        if at is None or cls in ("TrafficLight", "Signage", "ConstructionCard"):
            continue
        if _is_for(road, signal, [lane.lane_id for lane in arm.along("in")]):
            yield Facility(
                cls, leg.name, at, None if cls == "StopLine" else signal.t, governs=("in",),
                speed_limit=limit, object_id=signal.id, s=signal.s,
            )  # fmt: skip


def _lights(model: OpenDrive, site: Site, leg: Leg) -> Iterator[Facility]:
    """Yield the traffic lights for the traffic that comes along a leg, each signal once.

    They stand on the leg, or on the junction's roads that lead from it.
    """
    dynamic = {one.id: one for road in model.roads for one in road.signals if one.dynamic == "yes"}
    arm = leg.roads[0]
    road = model.road(arm.road_id)
    inbound = [lane.lane_id for lane in arm.along("in")]
    seen: set[str] = set()
    for one in signals_on(road):
        at = arm.distance(one.s)
        if one.id not in dynamic or one.id in seen or at is None or at > NEAR:
            continue
        if _is_for(road, one, inbound):
            seen.add(one.id)
            yield Facility("TrafficLight", leg.name, at, governs=("in",), object_id=one.id, s=one.s)
    within = site.place_id.split("+") if site.kind != "Merge" else ()
    for inside in (road for one in within for road in model.connecting_roads(one)):
        for one in signals_on(inside):
            if one.id in dynamic and one.id not in seen and _comes_from(inside, one, road.id):
                seen.add(one.id)
                edge = arm.near
                yield Facility(
                    "TrafficLight", leg.name, 0.0, governs=("in",), object_id=one.id, s=edge
                )


def _is_for(road: Road, signal: Signal | SignalReference, lanes: list[int]) -> bool:
    return any(governs(road, signal, lane) for lane in lanes)


def _comes_from(inside: Road, signal: Signal | SignalReference, road_id: str) -> bool:
    """Return whether a signal on a connecting road is for lanes that a road leads to."""
    for lane in inside.sections[0].lanes:
        if lane.drivable and governs(inside, signal, lane.id):
            entry = "end" if leads_to(inside, lane, "start") else "start"
            link = inside.link(entry)
            if link is not None and link.element_type == "road" and link.element_id == road_id:
                return True
    return False
