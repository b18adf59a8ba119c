"""The places of a map, and which of them a scenario fits: junctions, and stretches of road."""

from dataclasses import dataclass, replace
from pathlib import Path

from bridgegen.base.errors import BridgeGenError, UnsupportedError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.on_map import on_map, searchable
from bridgegen.openx.opendrive.merges import merges
from bridgegen.openx.opendrive.mirror import as_written, right_hand
from bridgegen.openx.opendrive.model import Junction, OpenDrive
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.rings import Ring, rings
from bridgegen.openx.opendrive.road_map import RoadMap, as_opendrive, map_bytes, map_of, map_path
from bridgegen.openx.opendrive.site import road_ends, stretches
from bridgegen.openx.opendrive.site_fit import candidates, kind_of_place, missing, sites_at
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.site import Site


@dataclass(frozen=True)
class PlaceFit:
    """A place of a map, and how a scenario fits it.

    Attributes:
        id: of the junction, the roundabout or the stretch of road.
        kind: "junction", "roundabout", "merge" or "road".
        legs: the ids of its roads with driving lanes; outside of it, of a junction.
        size: "4 legs, 8 lights", "2 lanes, 1 against, 312 m": what there is, in words.
        rotations: how many rotations of the scenario's legs fit.
        placed: where the scenario's legs lie: "A = road 12, …"; empty where none fits.
        lacks: why it does not fit; empty where it does, or without a scenario.
    """

    id: str
    kind: str
    legs: tuple[str, ...]
    size: str
    rotations: int = 0
    placed: str = ""
    lacks: str = ""


def places_of(
    path: Path, scenario: LogicalScenario | None = None
) -> tuple[list[PlaceFit], OpenDrive, list[str]]:
    """Return the places of a map; with a scenario, those of its kind, and whether it fits them.

    Those that it fits are built with it.

    Args:
        path: an OpenDRIVE file, or the ``.owl`` that was imported from one.
        scenario: what shall take place there.

    Returns:
        The junctions and the stretches in the order of the file, the road network, and what was
        not read as it stands.

    Raises:
        FileFormatError: no map that can be read.
        UnsupportedError: the scenario cannot take place on a map.
    """
    path = map_path(path)
    if path.suffix.lower() == ".owl":
        path, _ = map_of(path)
    warnings: list[str] = []
    data = map_bytes(path, warnings)
    model = right_hand(read(data, str(path), warnings), str(path))
    path = as_opendrive(path)
    found: list[PlaceFit] = []
    wanted = None if scenario is None else kind_of_place(scenario)
    if wanted in (None, "junction"):
        found += [_junction(model, junction) for junction in model.junctions]
    if wanted in (None, "roundabout"):
        found += [_ring(ring) for ring in rings(model)]
    if wanted in (None, "merge"):
        found += [_merge(site) for site in merges(model, path.name)]
    if wanted in (None, "road"):
        found += [_stretch(site) for site in stretches(model, path.name)]
    if scenario is not None:
        known = {}
        if wanted in ("merge", "road"):
            every = candidates(scenario, model, path.name)
            known = {sites[0].place_id: sites for sites in every}
        for i, fit in enumerate(found):
            rotations, placed, lacks = _fit(fit, scenario, model, data, path, known.get(fit.id))
            found[i] = replace(fit, rotations=rotations, placed=placed, lacks=lacks)
    return found, as_written(model), warnings


def _junction(model: OpenDrive, junction: Junction) -> PlaceFit:
    legs = tuple(dict.fromkeys(road.id for road, _ in road_ends(model, junction)))
    lights = sum(
        signal.dynamic == "yes"
        for road in model.roads
        if road.junction == junction.id or road.id in legs
        for signal in road.signals
    )
    return PlaceFit(junction.id, "junction", legs, f"{len(legs)} legs, {lights} lights")


def _ring(ring: Ring) -> PlaceFit:
    legs = tuple(dict.fromkeys(road.id for road, _ in ring.ends))
    return PlaceFit(
        ring.id, "roundabout", legs, f"{len(legs)} legs, {len(ring.roads)} roads around"
    )


def _merge(site: Site) -> PlaceFit:
    main, _, after = site.legs
    lanes, beyond = len(main.roads[0].along("in")), len(after.roads[0].along("out"))
    roads = tuple(road.road_id for leg in site.legs for road in leg.roads)
    size = f"{lanes} lanes and a ramp, {beyond} for {after.roads[0].length:.0f} m"
    return PlaceFit(site.place_id, "merge", roads, size)


def _stretch(site: Site) -> PlaceFit:
    (leg,) = site.legs
    ahead, against = (len(leg.roads[0].along(way)) for way in ("out", "in"))
    lanes = f"{ahead} lane{'s' * (ahead != 1)}" + (f", {against} against" if against else "")
    roads = tuple(road.road_id for road in leg.roads)
    return PlaceFit(site.place_id, "road", roads, f"{lanes}, {leg.length:.0f} m")


def _fit(
    place: PlaceFit,
    scenario: LogicalScenario,
    model: OpenDrive,
    data: bytes,
    path: Path,
    sites: list[Site] | None,
) -> tuple[int, str, str]:
    """Return how many rotations fit, where the legs of the best one lie, or what is missing.

    Args:
        place: one of the map's.
        scenario: what shall take place there.
        model: the map.
        data: its file's content.
        path: its file.
        sites: the place in its rotations; None if they are still to be found.
    """
    wanted = len(scenario.roads.legs)
    if place.kind in ("junction", "roundabout") and len(place.legs) != wanted:
        return 0, "", f"{len(place.legs)} legs; the scenario has {wanted}"
    try:
        sites = sites or sites_at(scenario, model, place.id, path.name)
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
