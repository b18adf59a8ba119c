"""Finding the intersection of a map that a scenario can take place at, and its legs."""

import math
from collections.abc import Iterator

from bridgegen.errors import InputError, UnsupportedError
from bridgegen.ontology.site import ArmRoad, Leg, Site, SiteLane
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import Junction, Lane, OpenDrive, Road
from bridgegen.openx.opendrive.references import contacts

KNOWN_SITES = {"Town05": "965"}
"""The junction to use on a map, by the map's name, where nobody says which.

Source: Town05 is CARLA's (version of 2019); 965 has two lanes in and out on each of four legs.
"""

LEG_NAMES = ("A", "B", "C", "D")
"""Clockwise from the south, as in the paper's crossroads (Section V-A)."""

_SOUTH = 270.0


def find_site(
    model: OpenDrive, junction_id: str | None = None, map_name: str | None = None
) -> Site:
    """Return a junction of four legs, with its legs named A (nearest to south), B, C, D clockwise.

    A leg is the road that touches the junction and the roads that continue it, lane by lane,
    until the next junction or the end.

    Args:
        model: the road network.
        junction_id: which junction; by default the one recorded in `KNOWN_SITES` for the map, or
            else the only one that has four legs.
        map_name: the map's file name, as in ``Town05.xodr``.

    Raises:
        InputError: the map has no such junction, or none is named and several would do.
        UnsupportedError: the junction (or every junction) has not exactly four legs with lanes in
            and out, or a leg's lanes change on the road that touches the junction.
    """
    name = (map_name or model.header.name or "map").rpartition("/")[2]
    stem = name.removesuffix(".xodr")
    junction = model.junction(junction_id or _default_junction(model, stem))
    ends = list(_incoming(model, junction))
    if len(ends) != len(LEG_NAMES):
        roads = ", ".join(road.id for road, _ in ends) or "none"
        raise UnsupportedError(
            f"junction {junction.id} of {name} must have {len(LEG_NAMES)} legs with lanes in and "
            f"out, got {len(ends)} (roads {roads})"
        )
    first = min(
        (_heading(*end) for end in ends), key=lambda h: abs(math.remainder(h - _SOUTH, 360))
    )
    ends.sort(key=lambda end: (first - _heading(*end)) % 360.0)
    legs = tuple(
        Leg(leg, _heading(road, end), tuple(_arm(model, road, end)))
        for leg, (road, end) in zip(LEG_NAMES, ends, strict=True)
    )
    return Site(
        name=stem,
        map_file=map_name,
        junction_id=junction.id,
        size=None,
        legs=legs,
        kind="Crossroads",
    )


def _default_junction(model: OpenDrive, stem: str) -> str:
    known = KNOWN_SITES.get(stem)
    if known and any(junction.id == known for junction in model.junctions):
        return known
    if len(model.junctions) == 1:
        return model.junctions[0].id
    counts = {junction.id: len(list(_incoming(model, junction))) for junction in model.junctions}
    fitting = [name for name, count in counts.items() if count == len(LEG_NAMES)]
    if len(fitting) == 1:
        return fitting[0]
    rule = f"a scenario takes place at a junction of {len(LEG_NAMES)} legs"
    listed = ", ".join(f"{name} ({count} legs)" for name, count in counts.items()) or "none"
    if not fitting:
        raise UnsupportedError(f"{rule}; {stem} has none such: {listed}")
    raise InputError(f"{rule}; {stem} has {len(fitting)} such, one of them must be named: {listed}")


def _incoming(model: OpenDrive, junction: Junction) -> Iterator[tuple[Road, str]]:
    """Yield the road ends that touch a junction and have drivable lanes both in and out."""
    for road in model.roads:
        if road.is_connecting:
            continue
        for end in contacts(road, junction.id):
            lanes = [lane for lane in road.section_at(end).lanes if lane.drivable]
            ways = {_leads_to(road, lane, end) for lane in lanes}
            if len(ways) == 2:
                yield road, end


def _leads_to(road: Road, lane: Lane, end: str) -> bool:
    """Say whether traffic on a lane leaves its road at this end."""
    return (road.direction(lane.id) > 0) == (end == "end")


def _heading(road: Road, end: str) -> float:
    """Return the direction in which a road leads away from its end [deg], in [0, 360)."""
    h = reference_pose(road, 0.0 if end == "start" else road.length).h
    return math.degrees(h + (0.0 if end == "start" else math.pi)) % 360.0


def _arm(model: OpenDrive, road: Road, end: str) -> Iterator[ArmRoad]:
    """Yield the roads of a leg, outwards from where it touches the junction."""
    lanes = [lane for lane in road.section_at(end).lanes if lane.drivable]
    ids = sorted((lane.id for lane in lanes), key=abs)
    if not _steady(road, ids):
        raise UnsupportedError(
            f"the lanes of a leg must not change along it, but on road {road.id} they do; "
            f"{len(road.sections)} lane sections"
        )
    inbound = {lane.id for lane in lanes if _leads_to(road, lane, end)}
    seen: set[str] = set()
    while True:
        seen.add(road.id)
        yield _arm_road(road, end, ids, inbound)
        following = _continuation(model, road, end, ids)
        if following is None or following[0].id in seen:
            return
        onward, end, mapped = following
        inbound = {mapped[lane_id] for lane_id in inbound}
        ids = [mapped[lane_id] for lane_id in ids]
        road = onward


def _arm_road(road: Road, end: str, ids: list[int], inbound: set[int]) -> ArmRoad:
    s = 0.0 if end == "start" else road.length
    lanes = [
        SiteLane(lane_id, "in" if lane_id in inbound else "out", lane_pose(road, lane_id, s).width)
        for lane_id in sorted(ids, key=lambda one: (one not in inbound, abs(one)))
    ]
    speeds = [kind.speed for kind in road.types if kind.speed is not None]
    kinds = [kind.type for kind in road.types if kind.type in ("town", "rural", "motorway")]
    return ArmRoad(
        road_id=road.id,
        length=road.length,
        junction_end="start" if end == "start" else "end",
        lanes=tuple(lanes),
        speed_limit=speeds[0].metres_per_second if speeds else None,
        road_type=kinds[0] if kinds else None,
    )


def _steady(road: Road, ids: list[int]) -> bool:
    """Say whether a road has the same drivable lanes in all its sections, linked one to one."""
    last = len(road.sections) - 1
    for index, section in enumerate(road.sections):
        lanes = [lane for lane in section.lanes if lane.drivable]
        if {lane.id for lane in lanes} != set(ids):
            return False
        for lane in lanes:
            if index < last and lane.successors != (lane.id,):
                return False
            if index > 0 and lane.predecessors != (lane.id,):
                return False
    return True


def _continuation(
    model: OpenDrive, road: Road, end: str, ids: list[int]
) -> tuple[Road, str, dict[int, int]] | None:
    """Return the road that goes on from the far end: it, its nearer end, its lane per lane.

    None where there is none, or where not every lane goes on.
    """
    far = "end" if end == "start" else "start"
    link = road.link(far)
    if link is None or link.element_type != "road" or link.contact_point is None:
        return None
    onward = model.road(link.element_id)
    if onward.is_connecting:
        return None
    mapped: dict[int, int] = {}
    for lane_id in ids:
        lane = road.section_at(far).lane(lane_id)
        assert lane is not None  # as `_steady` said
        links = lane.successors if far == "end" else lane.predecessors
        if len(links) != 1:
            return None
        mapped[lane_id] = links[0]
    drivable = {lane.id for lane in onward.section_at(link.contact_point).lanes if lane.drivable}
    if set(mapped.values()) != drivable or not _steady(onward, sorted(drivable)):
        return None
    return onward, link.contact_point, mapped
