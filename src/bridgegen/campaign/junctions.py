"""The junctions of a map, and which of them a scenario fits."""

from dataclasses import dataclass
from pathlib import Path

from bridgegen.errors import BridgeGenError, UnsupportedError
from bridgegen.odd.scenario import LogicalScenario
from bridgegen.openx.on_map import on_map, searchable
from bridgegen.openx.opendrive.carla_maps import map_path
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.road_map import RoadMap, map_of
from bridgegen.openx.opendrive.site import road_ends, turned_sites
from bridgegen.openx.opendrive.site_fit import missing, require_intersection
from bridgegen.openx.xml import read_bytes
from bridgegen.pipeline import Pipeline


@dataclass(frozen=True)
class JunctionFit:
    """A junction of a map, and how a scenario fits it.

    Attributes:
        id: of the junction.
        legs: the ids of its roads with driving lanes outside it.
        lights: how many traffic lights stand on them, or within the junction.
        rotations: how many rotations of the scenario's legs fit.
        placed: where the scenario's legs lie: "A = road 12, …"; empty where none fits.
        lacks: why it does not fit; empty where it does, or without a scenario.
    """

    id: str
    legs: tuple[str, ...]
    lights: int
    rotations: int
    placed: str
    lacks: str


def junctions_of(
    path: Path, scenario: LogicalScenario | None = None
) -> tuple[list[JunctionFit], OpenDrive, list[str]]:
    """Return the junctions of a map; with a scenario, those that it fits are built with it.

    Args:
        path: an OpenDRIVE file, or the ``.owl`` that was imported from one.
        scenario: what shall take place there.

    Returns:
        The junctions in the order of the file, the road network, and what was not read as it
        stands.

    Raises:
        FileFormatError: no map that can be read.
        UnsupportedError: the scenario is not one of an intersection.
    """
    path = map_path(path)
    if path.suffix.lower() == ".owl":
        path, _ = map_of(path)
    if scenario is not None:
        require_intersection(scenario)
    data = read_bytes(path)
    warnings: list[str] = []
    model = read(data, str(path), warnings)
    found = []
    for junction in model.junctions:
        legs = tuple(dict.fromkeys(road.id for road, _ in road_ends(model, junction)))
        lights = sum(
            signal.dynamic == "yes"
            for road in model.roads
            if road.junction == junction.id or road.id in legs
            for signal in road.signals
        )
        rotations, placed, lacks = 0, "", ""
        if scenario is not None:
            rotations, placed, lacks = _fit(scenario, model, data, path, junction.id)
        found.append(JunctionFit(junction.id, legs, lights, rotations, placed, lacks))
    return found, model, warnings


def _fit(
    scenario: LogicalScenario, model: OpenDrive, data: bytes, path: Path, junction_id: str
) -> tuple[int, str, str]:
    """Return how many rotations fit, where the legs of the best one lie, or what is missing."""
    headings = {name: leg.heading for name, leg in scenario.roads.legs.items()}
    count = len(list(road_ends(model, model.junction(junction_id))))
    if count != len(headings):
        return 0, "", f"{count} legs; the scenario has {len(headings)}"
    try:
        sites = turned_sites(model, junction_id, path.name, headings)
    except UnsupportedError as error:
        return 0, "", error.problems[0]
    fitting = [site for site in sites if not missing(scenario, model, site)]
    if not fitting:
        return 0, "", "; ".join(missing(scenario, model, sites[0]))
    try:
        turned = RoadMap(path, data, model, fitting[0], sites=tuple(fitting))
        road_map = searchable(scenario, turned)
        fitting, site = list(road_map.sites or (road_map.site,)), road_map.site
        there = on_map(scenario, road_map.at(site))
        Pipeline(there, there.space(), road_map=road_map.at(site))
    except BridgeGenError as error:
        return 0, "", error.problems[0].partition(" is left out: ")[2] or error.problems[0]
    placed = ", ".join(f"{leg.name} = road {leg.roads[0].road_id}" for leg in site.legs)
    return len(fitting), placed, ""
