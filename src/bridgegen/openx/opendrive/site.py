"""The intersections of a map, with their legs named as a scenario names them."""

import math
from collections.abc import Iterator, Mapping

from bridgegen.errors import InputError, UnsupportedError
from bridgegen.odd.roads import HEADINGS
from bridgegen.ontology.site import ArmRoad, Leg, Site, SiteLane
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.legs import heading, leads_to
from bridgegen.openx.opendrive.model import Junction, OpenDrive, Road

KNOWN_SITES = {"Town05": "965"}
"""The default junction of a map, by the map's name.

Source: Town05 is CARLA's (version of 2019); 965 has two lanes in and out on each of four legs.
"""

ROAD_TYPES = ("town", "rural", "motorway")
"""Types of road that a scenario distinguishes."""

_KINDS = {3: "TJunction", 4: "Crossroads"}


def find_site(
    model: OpenDrive,
    junction_id: str | None = None,
    map_name: str | None = None,
    headings: Mapping[str, float] = HEADINGS["crossroads"],
) -> Site:
    """Return a junction with its legs named as a scenario names them.

    A leg is the road that touches the junction and the roads that continue it, lane by lane,
    until the next junction or the end. Legs are named as those of the scenario that they are
    most like: both are taken in their order around the junction, and matched first by the angles
    between them, then by where they lead. Of a usual crossroads, A is the leg nearest to south,
    then B, C, D clockwise; of a T-junction, the side road is the side road, however it is turned.

    Args:
        model: the road network.
        junction_id: which junction; by default the one recorded in `KNOWN_SITES` for the map, or
            else the only one that has as many legs.
        map_name: the map's file name, as in ``Town05.xodr``.
        headings: by the legs' names, outwards [deg], counter-clockwise from +x.

    Raises:
        InputError: the map has no such junction, or none is named and several would do.
        UnsupportedError: the junction (or every junction) has more or fewer legs with a driving
            lane, or a leg's lanes change on the road that touches the junction.
    """
    return turned_sites(model, junction_id, map_name, headings)[0]


def turned_sites(
    model: OpenDrive,
    junction_id: str | None = None,
    map_name: str | None = None,
    headings: Mapping[str, float] = HEADINGS["crossroads"],
) -> list[Site]:
    """Return a junction once per rotation of its legs' names, that most like a scenario's first.

    Where traffic drives on the left, the scenario's order of legs is mirrored, so that its left
    turns become right turns.

    Args:
        model: as for `find_site`, which says what is raised, too.
        junction_id: as for `find_site`.
        map_name: as for `find_site`.
        headings: as for `find_site`.
    """
    name = (map_name or model.header.name or "map").rpartition("/")[2]
    stem = name.removesuffix(".xodr")
    junction = model.junction(junction_id or _default_junction(model, stem, len(headings)))
    ends = sorted(road_ends(model, junction), key=lambda end: heading(*end))
    if len(ends) != len(headings):
        touching = {road.id for road, _ in ends}
        roads = ", ".join(road.id for road in model.roads if road.id in touching)
        raise UnsupportedError(
            f"junction {junction.id} of {name} must have {len(headings)} legs with driving lanes, "
            f"as the scenario has ({', '.join(headings)}), got {len(ends)} "
            f"(roads {roads or 'none'})"
        )
    if all(road.rule == "LHT" for road, _ in ends):
        headings = {leg: 180.0 - angle for leg, angle in headings.items()}
    names = sorted(headings, key=lambda leg: headings[leg] % 360.0)
    arms = {id(end): tuple(_arm(model, *end)) for end in ends}
    sites = []
    for k in range(len(ends)):
        found = dict(zip(names, ends[k:] + ends[:k], strict=True))
        legs = tuple(Leg(leg, heading(*found[leg]), arms[id(found[leg])]) for leg in headings)
        sites.append(
            Site(
                name=stem,
                map_file=map_name,
                junction_id=junction.id,
                size=None,
                legs=legs,
                kind=_KINDS.get(len(legs), "Intersection"),
            )
        )
    return sorted(sites, key=lambda site: unlikeness(headings, site))


def unlikeness(headings: Mapping[str, float], site: Site) -> float:
    """Return how badly legs are as wanted [deg²]: first their angles, then their directions.

    The angles between the legs make the junction's shape (which leg of a T is the side road);
    only among fits of one shape does it count how far the whole is turned.

    Args:
        headings: by the legs' names, outwards [deg].
        site: with legs of these names.
    """
    legs = sorted(site.legs, key=lambda leg: headings[leg.name] % 360.0)
    turned = [leg.heading_deg - headings[leg.name] for leg in legs]
    beside = [math.remainder(one - turned[0], 360.0) for one in turned]
    middle = sum(beside) / len(beside)
    shape = sum((one - middle) ** 2 for one in beside)
    return _SHAPE * shape + len(legs) * math.remainder(turned[0] + middle, 360.0) ** 2


_SHAPE = 100.0
"""How much more an angle between legs counts than a direction: 90° of these, 9° of those."""


def _default_junction(model: OpenDrive, stem: str, count: int) -> str:
    counts = {junction.id: len(list(road_ends(model, junction))) for junction in model.junctions}
    known = KNOWN_SITES.get(stem)
    if known and counts.get(known) == count:
        return known
    if len(model.junctions) == 1:
        return model.junctions[0].id
    fitting = [name for name, legs in counts.items() if legs == count]
    if len(fitting) == 1:
        return fitting[0]
    rule = f"a scenario takes place at a junction of {count} legs"
    listed = ", ".join(f"{name} ({legs} legs)" for name, legs in counts.items()) or "none"
    if not fitting:
        raise UnsupportedError(f"{rule}; {stem} has none such: {listed}")
    raise InputError(
        f"{rule}; {stem} has {len(fitting)} such, one of them must be named, or best: {listed}"
    )


def road_ends(model: OpenDrive, junction: Junction) -> Iterator[tuple[Road, str]]:
    """Yield the road ends with a driving lane that touch a junction."""
    for road in model.roads:
        if not road.is_connecting:
            for end in road.ends_at(junction.id):
                if any(lane.drivable for lane in road.section_at(end).lanes):
                    yield road, end


def _arm(model: OpenDrive, road: Road, end: str) -> Iterator[ArmRoad]:
    """Yield the roads of a leg, outwards from where it touches the junction."""
    lanes = [lane for lane in road.section_at(end).lanes if lane.drivable]
    ids = sorted((lane.id for lane in lanes), key=abs)
    if not _steady(road, ids):
        raise UnsupportedError(
            f"the lanes of a leg must not change along it, but on road {road.id} they do; "
            f"{len(road.sections)} lane sections"
        )
    inbound = {lane.id for lane in lanes if leads_to(road, lane, end)}
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
    kinds = [kind.type for kind in road.types if kind.type in ROAD_TYPES]
    return ArmRoad(
        road_id=road.id,
        length=road.length,
        junction_end="start" if end == "start" else "end",
        lanes=tuple(lanes),
        speed_limit=speeds[0].metres_per_second if speeds else None,
        road_type=kinds[0] if kinds else None,
    )


def _steady(road: Road, ids: list[int]) -> bool:
    """Return whether a road has the same drivable lanes in all its sections, linked one to one."""
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
    """Return the road that continues from the far end: it, its nearer end, its lane per lane.

    None if there is none, or if not every lane continues.
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
        assert lane is not None  # checked by `_steady`
        links = lane.successors if far == "end" else lane.predecessors
        if len(links) != 1:
            return None
        mapped[lane_id] = links[0]
    drivable = {lane.id for lane in onward.section_at(link.contact_point).lanes if lane.drivable}
    if set(mapped.values()) != drivable or not _steady(onward, sorted(drivable)):
        return None
    return onward, link.contact_point, mapped
