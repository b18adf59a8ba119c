"""The entries of a map: junctions at which a ramp joins a carriageway, and becomes its lane."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

from bridgegen.openx.opendrive.chains import chain, run_at
from bridgegen.openx.opendrive.legs import heading, leads_to
from bridgegen.openx.opendrive.model import Junction, OpenDrive, Road
from bridgegen.openx.opendrive.routes import Stretch, next_stretches, plan_route
from bridgegen.openx.opendrive.site import map_stem
from bridgegen.scenario.ontology.site import Leg, Site

ASIDE = 45.0
"""Largest angle between the directions of a carriageway and of who joins it [deg]; ours."""

MAIN, RAMP, AFTER = "main", "ramp", "after"
"""The legs of a merge."""

_Exit = tuple[str, str, int]  # a road, its end where traffic enters it, the lane


@dataclass(frozen=True, slots=True)
class _End:
    """An end of a road at a junction, and where the ways from each of its lanes lead."""

    road: Road
    end: str
    beyond: dict[int, set[_Exit]]


def merges(model: OpenDrive, map_name: str | None = None) -> Iterator[Site]:
    """Yield the entries of a map: a carriageway, a ramp of one lane to its right, and what follows.

    The ramp's lane goes on to the right of all lanes that the carriageway's lead to.

    Args:
        model: the road network.
        map_name: the map's file name.
    """
    for junction in model.junctions:
        ends = list(_ends(model, junction))
        found = [
            (main, ramp, after)
            for main in ends
            for ramp in ends
            if ramp.road.id != main.road.id and (after := _joined(main, ramp)) is not None
        ]
        sites = []
        for main, ramp, (road_id, end) in found:
            legs = (
                _leg(model, MAIN, main.road, main.end),
                _leg(model, RAMP, ramp.road, ramp.end),
                _leg(model, AFTER, model.road(road_id), end),
            )
            from_ramp = legs[1].heading_deg - legs[0].heading_deg
            onwards = legs[2].heading_deg - legs[0].heading_deg + 180.0
            if max(abs(math.remainder(value, 360.0)) for value in (from_ramp, onwards)) < ASIDE:
                sites.append(Site(map_stem(model, map_name), map_name, "", None, legs, "Merge"))
        for number, site in enumerate(sites, start=1):
            place_id = junction.id if len(sites) == 1 else f"{junction.id}.{number}"
            yield Site(site.name, map_name, place_id, None, site.legs, kind="Merge")


def through(model: OpenDrive, site: Site) -> float:
    """Return how far the ramp's lane leads through the junction of an entry [m]."""
    _, ramp, after = (leg.roads[0] for leg in site.legs)
    (lane,) = (site_lane.lane_id for site_lane in ramp.along("in"))
    last = after.along("out")[-1].lane_id
    start, end = (ramp.road_id, lane, ramp.near), (after.road_id, last, after.near)
    steps = plan_route(model, start, (), end).steps
    return sum(abs(step.s_end - step.s) for step in steps)


def _ends(model: OpenDrive, junction: Junction) -> Iterator[_End]:
    """Yield the ends of roads from which traffic enters a junction."""
    for road in model.roads:
        if road.is_connecting:
            continue
        for end in road.ends_at(junction.id):
            lanes = [
                lane.id
                for lane in road.section_at(end).lanes
                if lane.drivable and leads_to(road, lane, end)
            ]
            if lanes:
                beyond = {lane: set(_beyond(model, road, end, lane)) for lane in lanes}
                yield _End(road, end, beyond)


def _beyond(model: OpenDrive, road: Road, end: str, lane: int) -> Iterator[_Exit]:
    """Yield where the ways from a lane leave a junction."""
    section = 0 if end == "start" else len(road.sections) - 1
    todo = [Stretch(road.id, section, lane)]
    seen: set[Stretch] = set()
    while todo:
        for following in next_stretches(model, todo.pop()):
            if following in seen:
                continue
            seen.add(following)
            there = model.road(following.road_id)
            if there.is_connecting:
                todo.append(following)
            else:
                contact = "start" if there.direction(following.lane_id) > 0 else "end"
                yield there.id, contact, following.lane_id


def _joined(main: _End, ramp: _End) -> tuple[str, str] | None:
    """Return the road, and its end, on which a ramp goes on to the right of a carriageway."""
    if len(ramp.beyond) != 1:
        return None
    (joins,) = ramp.beyond.values()
    for road_id, end, lane in sorted(joins):
        reached = [
            {abs(number) for road, at, number in ways if (road, at) == (road_id, end)}
            for ways in main.beyond.values()
        ]
        if reached and all(reached) and max(set().union(*reached)) < abs(lane):
            return road_id, end
    return None


def _leg(model: OpenDrive, name: str, road: Road, end: str) -> Leg:
    run = run_at(road, end)
    assert run is not None  # traffic drives there
    return Leg(name, heading(road, end), tuple(chain(model, run, end)))
