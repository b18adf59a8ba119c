"""A storyboard and its map: the one that a file names, and routes that it leaves to chance."""

import hashlib
from collections.abc import Callable, Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridgegen.base.errors import FileFormatError, InputError
from bridgegen.openx.geo import on_plane
from bridgegen.openx.opendrive import read as opendrive_read
from bridgegen.openx.opendrive.lanes import section_end, section_index
from bridgegen.openx.opendrive.mirror import as_written, right_hand
from bridgegen.openx.opendrive.model import Header, OpenDrive
from bridgegen.openx.opendrive.road_map import map_bytes, map_path
from bridgegen.openx.opendrive.routes import Stretch, next_stretches
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import Element, rewritten, walk
from bridgegen.openx.openscenario.mirror import mirrored
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.openx.openscenario.to_owl.starts import Starts
from bridgegen.openx.openscenario.values import ParameterRef
from bridgegen.openx.traffic import populated

# --- The OpenDRIVE map that an OpenSCENARIO file names ---


def roads_of(scenario: OpenScenario, path: Path) -> OpenDrive:
    """Read the map that a scenario file names; one without roads where it names none.

    A map with left-hand traffic is mirrored, and so is its scenario by `prepared`.

    Raises:
        FileFormatError: the map cannot be read, or has both left-hand and right-hand traffic.
    """
    if scenario.road_network.logic_file is None:
        return OpenDrive(Header(1, 7))
    road = logic_path(scenario, path)
    model = opendrive_read.read(map_bytes(road), str(road), may_be_empty=True)
    return right_hand(model, str(road))


def logic_path(scenario: OpenScenario, path: Path) -> Path:
    """Return the file of the map that a scenario file names, by path or as CARLA's.

    Raises:
        FileFormatError: it names none, or one of CARLA's that is not found.
    """
    return map_path(path.parent / logic_file(scenario, path))


def logic_file(scenario: OpenScenario, path: Path) -> str:
    """Return the path of the map that a scenario file names, as it does.

    Raises:
        FileFormatError: it names none.
    """
    named = scenario.road_network.logic_file
    if named is None:
        raise FileFormatError(f"{path}: RoadNetwork needs a LogicFile, the OpenDRIVE map")
    if isinstance(named.filepath, ParameterRef):
        return str(parameters.values(scenario)[named.filepath.name])
    return named.filepath


# --- Random routes: drawn beforehand, from where an entity starts, and so the same in every row ---


LONGEST = 2000.0
"""Length of a random route from its start on [m]: at 50 km/h two minutes and a half."""

MARGIN = 0.1
"""Distance between a waypoint and the end of its lane [m]."""


def with_random_routes(
    scenario: osc.OpenScenario, roads: OpenDrive, place: str
) -> osc.OpenScenario:
    """Return a scenario in which each random route is one that was drawn.

    At each fork one of the lanes that lead on is drawn, all with the same probability. The numbers
    follow from the entity's name, so the route is always the same.

    Args:
        scenario: any scenario; one without random routes comes back as it is.
        roads: its map.
        place: what to call the scenario in messages.

    Raises:
        FileFormatError: an entity with a random route that does not start on a lane, or several
            that share one; by line.
    """
    if not any(isinstance(node, osc.RandomRouteAction) for node in walk(scenario)):
        return scenario
    init = scenario.storyboard.init.actions
    starts = Starts(scenario, init, roads)
    positions: dict[str, osc.Position] = {}
    for private in init.privates:
        for action in private.private_actions:
            if isinstance(action.action, osc.TeleportAction):
                name = starts.text(private.entity_ref)
                positions.setdefault(name, action.action.position)
    problems: list[str] = []
    change = _changer(roads, starts, positions, place, problems)
    made = rewritten(scenario, change)
    if problems:
        raise FileFormatError(*problems)
    return made


def _changer(
    roads: OpenDrive,
    starts: Starts,
    positions: Mapping[str, osc.Position],
    place: str,
    problems: list[str],
) -> Callable[[Element], Element]:
    def change(element: Element) -> Element:
        if isinstance(element, osc.Private):
            names = [starts.text(element.entity_ref)]
        elif isinstance(element, osc.ManeuverGroup):
            names = [starts.text(ref.entity_ref) for ref in element.actors.entity_refs]
        else:
            return element
        drawn = [node for node in walk(element) if isinstance(node, osc.RandomRouteAction)]
        if not drawn:
            return element
        try:
            if len(names) != 1:
                raise InputError("a RandomRouteAction is for one entity, each goes its own way")
            route = _route(roads, starts, names[0], positions.get(names[0]))
        except (InputError, ValueError) as error:
            problems.append(f"{place}: {error} (line {drawn[0].line})")
            return element

        def assign(inner: Element) -> Element:
            if isinstance(inner, osc.RoutingAction) and isinstance(
                inner.action, osc.RandomRouteAction
            ):
                line = inner.action.line
                return replace(inner, action=osc.AssignRouteAction(route, line=line))
            return inner

        return rewritten(element, assign)

    return change


def _route(roads: OpenDrive, starts: Starts, name: str, position: osc.Position | None) -> osc.Route:
    """Return the route that is drawn for an entity.

    Raises:
        InputError: it does not start on a lane.
    """
    found = None if position is None else starts.place(position)
    where = None if found is None else found.position
    if not isinstance(where, osc.LanePosition):
        raise InputError(f"a RandomRouteAction needs a start on a lane, '{name}' has none")
    road, lane = roads.road(starts.text(where.road_id)), int(starts.text(where.lane_id))
    s = starts.number(where.s)
    here = Stretch(road.id, section_index(road, s), lane)
    # By a digest of the name, not `hash`, which differs from process to process. Every row, worker
    # and resumed search then has the same route.
    seed = hashlib.sha256(name.encode()).digest()[:8]
    random = np.random.default_rng(int.from_bytes(seed, "big"))
    places, gone = [osc.LanePosition(road.id, str(lane), s)], 0.0
    # Sorted: the draw is among a list, whose order must not be that of a set.
    while gone < LONGEST and (following := sorted(set(next_stretches(roads, here)))):
        here = following[int(random.integers(len(following)))]
        begin, end = _ends(roads, here)
        gone += end - begin
        # Only behind forks: elsewhere the way is the only one, and fewer waypoints are fewer to
        # plan.
        if len(following) > 1:
            places.append(_at_its_end(roads, here))
    if places[-1] != (last := _at_its_end(roads, here)):
        places.append(last)
    shortest = osc.RouteStrategy.SHORTEST
    waypoints = tuple(osc.Waypoint(shortest, osc.Position(place)) for place in places)
    return osc.Route(f"random_{name}", False, waypoints)


def _ends(roads: OpenDrive, stretch: Stretch) -> tuple[float, float]:
    road = roads.road(stretch.road_id)
    return road.sections[stretch.section].s, section_end(road, stretch.section)


def _at_its_end(roads: OpenDrive, stretch: Stretch) -> osc.LanePosition:
    """Return a place just before a lane's end, in the direction of travel."""
    begin, end = _ends(roads, stretch)
    way = roads.road(stretch.road_id).direction(stretch.lane_id)
    margin = min(MARGIN, 0.5 * (end - begin))
    s = end - margin if way > 0 else begin + margin
    return osc.LanePosition(stretch.road_id, str(stretch.lane_id), s)


# --- A storyboard and its map together: what a file leaves to the map, said outright ---


def prepared(scenario: OpenScenario, roads: OpenDrive, place: str) -> OpenScenario:
    """Return a scenario without positions on the globe, traffic actions and random routes.

    On a map that was mirrored, it is mirrored, too.

    Args:
        scenario: as read.
        roads: its map, as of `roads_of`.
        place: what to call the scenario in messages.

    Raises:
        InputError: an extra is missing.
        FileFormatError: the map lacks what they need; by line.
    """
    # In this order: places on the globe become places of the map, on which traffic is put; and
    # traffic has random routes.
    scenario = on_plane(scenario, as_written(roads), place)
    if roads.left_hand:
        scenario = mirrored(scenario, place)
    whole = populated(scenario, roads, place)
    return with_random_routes(whole, roads, place)
