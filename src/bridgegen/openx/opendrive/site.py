"""The intersections of a map, with their legs named as a scenario names them."""

import math
from collections.abc import Iterator, Mapping
from dataclasses import replace

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.openx.opendrive.chains import Run, chain, run_at, runs
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.legs import heading, leads_to
from bridgegen.openx.opendrive.model import Junction, OpenDrive, Road
from bridgegen.openx.opendrive.rings import Ring
from bridgegen.scenario.language.roads import HEADINGS
from bridgegen.scenario.ontology.site import ArmRoad, Leg, Site

KNOWN_SITES = {"Town05": "965"}
"""The default junction of a map, by the map's name.

Source: Town05 is CARLA's (version of 2019); 965 has two lanes in and out on each of four legs.
"""

_KINDS = {3: "TJunction", 4: "Crossroads"}


def find_site(
    model: OpenDrive,
    junction_id: str | None = None,
    map_name: str | None = None,
    headings: Mapping[str, float] = HEADINGS["crossroads"],
) -> Site:
    """Return a junction with its legs named as a scenario names them.

    A leg is the road that touches the junction and the roads that continue it, lane by lane,
    until the next junction, the end, or where driving lanes begin or end. Legs are named as those
    of the scenario that they are most like: both are taken in their order around the junction, and
    matched first by the angles between them, then by where they lead. Of a usual crossroads, A is
    the leg nearest to south, then B, C, D clockwise; of a T-junction, the side road is the side
    road, however it is turned.

    Args:
        model: the road network.
        junction_id: which junction; by default the one recorded in `KNOWN_SITES` for the map, or
            else the only one that has as many legs.
        map_name: the map's file name, as in ``Town05.xodr``.
        headings: by the legs' names, outwards [deg], counter-clockwise from +x.

    Raises:
        InputError: the map has no such junction, or none is named and several would do.
        UnsupportedError: the junction (or every junction) has more or fewer legs with a driving
            lane.
    """
    return turned_sites(model, junction_id, map_name, headings)[0]


def turned_sites(
    model: OpenDrive,
    junction_id: str | None = None,
    map_name: str | None = None,
    headings: Mapping[str, float] = HEADINGS["crossroads"],
) -> list[Site]:
    """Return a junction once per rotation of its legs' names, that most like a scenario's first.

    Args:
        model: as for `find_site`, which says what is raised, too.
        junction_id: as for `find_site`.
        map_name: as for `find_site`.
        headings: as for `find_site`.
    """
    stem = map_stem(model, map_name)
    junction = model.junction(junction_id or _default_junction(model, stem, len(headings)))
    ends = list(road_ends(model, junction))
    what = f"junction {junction.id} of {stem}"
    direct = "DirectJunction" if junction.is_direct else None
    kind = direct or _KINDS.get(len(ends), "Intersection")
    site = Site(stem, map_name, junction.id, None, (), kind=kind)
    return _turned(model, site, ends, headings, what)


def ring_sites(
    model: OpenDrive,
    ring: Ring,
    map_name: str | None = None,
    headings: Mapping[str, float] = HEADINGS["roundabout"],
) -> list[Site]:
    """Return a roundabout once per rotation of its legs' names, as `turned_sites` a junction.

    Raises:
        UnsupportedError: it has more or fewer legs with a driving lane.
    """
    stem = map_stem(model, map_name)
    site = Site(stem, map_name, ring.id, None, (), kind="Roundabout")
    return _turned(model, site, list(ring.ends), headings, f"roundabout {ring.id} of {stem}")


def map_stem(model: OpenDrive, map_name: str | None) -> str:
    """Return what a map is called: its file's name without the suffix, or its header's."""
    name = (map_name or model.header.name or "map").rpartition("/")[2]
    return name.removesuffix(".xodr")


def _turned(
    model: OpenDrive,
    site: Site,
    ends: list[tuple[Road, str]],
    headings: Mapping[str, float],
    what: str,
) -> list[Site]:
    """Return a place once per rotation of its legs' names."""
    ends = sorted(ends, key=lambda end: heading(*end))
    if len(ends) != len(headings):
        touching = {road.id for road, _ in ends}
        roads = ", ".join(road.id for road in model.roads if road.id in touching)
        raise UnsupportedError(
            f"{what} must have {len(headings)} legs with driving lanes, "
            f"as the scenario has ({', '.join(headings)}), got {len(ends)} "
            f"(roads {roads or 'none'})"
        )
    names = sorted(headings, key=lambda leg: headings[leg] % 360.0)
    arms = {id(end): _arm(model, *end) for end in ends}
    sites = []
    # Every rotation: the best-looking one may lack a lane that the scenario uses.
    for k in range(len(ends)):
        found = dict(zip(names, ends[k:] + ends[:k], strict=True))
        legs = tuple(Leg(leg, heading(*found[leg]), arms[id(found[leg])]) for leg in headings)
        sites.append(replace(site, legs=legs))
    return sorted(sites, key=lambda item: unlikeness(headings, item))


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
    beside = [math.remainder(value - turned[0], 360.0) for value in turned]
    middle = sum(beside) / len(beside)
    shape = sum((value - middle) ** 2 for value in beside)
    return _SHAPE * shape + len(legs) * math.remainder(turned[0] + middle, 360.0) ** 2


_SHAPE = 100.0
"""Weight of the angles between legs, relative to their direction: 9° of them count as 90° of it."""


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
    listed = ", ".join(f"{name} ({legs} legs)" for name, legs in counts.items())
    if not fitting:
        has = f"has none of that kind: {listed}" if counts else "has no junctions"
        raise UnsupportedError(f"{rule}; {stem} {has}")
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


def _arm(model: OpenDrive, road: Road, end: str) -> tuple[ArmRoad, ...]:
    """Return the roads of a leg, outwards from where it touches the junction."""
    run = run_at(road, end)
    assert run is not None  # `road_ends` yields those with driving lanes
    return tuple(chain(model, run, end))


# --- The stretches of road of a map that a scenario of a road can take place on ---
# A stretch begins at the start of a road, or where driving lanes begin or end along it, and leads
# in # one direction of travel as long as the same lanes lead on. It is called by the road's id;
# where it # begins further along, with the number of its first lane section (``12.2``); against the
# road's # reference line with ``-back`` (``12-back``, ``12.2-back``).


SHORTEST = 20.0
"""Length below which stretches are left out [m]: the shortest road of a scenario file."""

MAIN = "main"
"""Name of the only leg of a scenario of a road."""


def stretches(model: OpenDrive, map_name: str | None = None) -> Iterator[Site]:
    """Yield every stretch of a map, in the order of the file, junctions left out.

    Args:
        model: the road network.
        map_name: the map's file name, as in ``Town05.xodr``.
    """
    name = map_stem(model, map_name)
    for road in model.roads:
        if road.is_connecting:
            continue
        for run in runs(road):
            lanes = [road.sections[run.sections[0]].lane(number) for number in run.ids]
            for end in ("start", "end"):
                if all(lane is None or leads_to(road, lane, end) for lane in lanes):
                    continue  # all traffic comes towards one
                roads = tuple(chain(model, run, end, meets=False))
                leg = Leg(MAIN, _heading(run, end), roads)
                if leg.length >= SHORTEST:
                    yield Site(name, map_name, _id(run, end), None, (leg,), kind=None)


def _id(run: Run, end: str) -> str:
    """Return what a stretch is called."""
    part = f".{run.sections[0]}" if run.sections[0] else ""
    return f"{run.road.id}{part}{'' if end == 'start' else '-back'}"


def _heading(run: Run, end: str) -> float:
    """Return the direction of travel at the beginning of a stretch [deg], in [0, 360)."""
    forward = end == "start"
    h = math.degrees(reference_pose(run.road, run.low if forward else run.high).h)
    return (h if forward else h + 180.0) % 360.0
