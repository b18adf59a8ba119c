"""The roads of a compiled storyboard: P road networks, and the paths on them that are known."""

from collections.abc import Iterable, Mapping, Sequence
from threading import Lock
from typing import Any

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.drivers.interface import RoadMap
from bridgegen.drivers.kinds import IS_CYCLE, IS_PEDESTRIAN
from bridgegen.drivers.lane_tables import CORRIDOR, LANE, corridor_along, lanes_along
from bridgegen.drivers.map_grid import grid_of, no_grid
from bridgegen.drivers.right_of_way import PASSES
from bridgegen.drivers.road_map import road_map
from bridgegen.drivers.scene import Scene, beside, kerbs, stacked, stop_lines, survey
from bridgegen.openx.opendrive.lane_graph import Cells, Ground
from bridgegen.openx.opendrive.lanes import section_index
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.routes import Stretch
from bridgegen.simulation.embedded._memory_kernels import Roads
from bridgegen.simulation.embedded.compiler.trajectories import timetable
from bridgegen.simulation.embedded.places.meetings import meetings
from bridgegen.simulation.embedded.places.ways import UNKNOWN, Ways, padded, position
from bridgegen.simulation.embedded.program import Program

NO_GROUND = Ground(np.empty((0, 4)), np.empty(0, np.int64))
NO_CELLS = Cells(np.empty((0, 8)), np.empty(0, np.int64))


class Network:
    """P road networks as the rollout reads them; it grows as rows ask for ways.

    What is planned depends on the road network and on what is asked for, not on when or by which
    row; so rows may share it between threads.

    Attributes:
        tables: all arrays, as they are now; a newer one holds all that an older one does.
        station: ``(P, E, 2)`` float64: an entity that starts at s on its road starts a + b·s along
            its path.
        station: ``(P, E, 2)`` float64 [m, 1]: where entities start along their first paths, and
            how it grows with where they start along the road; see ``stations``.
        sides: ``(P, E)`` float64: 1 for an entity that starts along its road's direction, -1
            against it; what is to its left, then, of what is to the road's.
        scene: what a driver with stages knows of them.
        stop_entities: ``(L,)`` int64, whose first route crosses each stop line of a light.
        stop_lights: ``(L,)`` int64, the light of each; see `Rollout.stop_lights`.
        stop_lines: ``(P, L, 3)`` float64, where: x, y [m] and heading [rad], NaN in a road network
            where the route does not cross it.
        turnings: the ways of the ego whose route changes lanes; see `Ways.turnings`.
        crosswalks: ``(P, C, 5)`` float64 of the ego's first route; see `Rollout.crosswalks`.
        maps: P road maps, if a driver wants them.
        partners: the same of storyboards in which other vehicles are the ego; see `together`.
        left_hand: whether they are the mirror image of left-hand traffic.
        country: by whose law they are judged, a code of ISO 3166-1; "" where it is not one.
    """

    def __init__(
        self,
        program: Program,
        models: Sequence[OpenDrive],
        courses: Sequence[Mapping[str, Float]] = (),
    ) -> None:
        self._program = program
        self.partners: tuple[Network, ...] = ()
        self.left_hand = any(model.left_hand for model in models)
        stated = {kind.country for model in models for road in model.roads for kind in road.types}
        self.country = str(stated.pop() or "") if len(stated) == 1 else ""
        given = courses or [{}] * len(models)
        self._ways = [
            Ways(program.on_course(course), model)
            for model, course in zip(models, given, strict=True)
        ]
        # Threads share a network. ``tables`` is replaced as a whole and holds all that an older one
        # does, so a thread that still reads the older one reads nothing wrong.
        self._lock = Lock()
        self._corridors: dict[int, Float] = {}
        self._points = np.zeros((len(models), len(program.points), 2))
        for p, model in enumerate(models):
            for i, point in enumerate(program.points):
                self._points[p, i] = position(program, model, point)
        most = max(len(ways.changes) for ways in self._ways)
        # Padded by the last place, which kernels look up by its row.
        self._changes = np.array(
            [
                np.pad(ways.changes, ((0, most - len(ways.changes)), (0, 0)), mode="edge")
                if most
                else ways.changes
                for ways in self._ways
            ]
        )
        self.turnings = sorted({number for ways in self._ways for number in ways.turnings})
        e = len(program.names)
        self.station: Float = np.array([each.station[:e] for each in self._ways])
        self.sides: Float = np.array([each.sides[:e] for each in self._ways], dtype=np.float64)
        self._zones: list[list[Float]] = [[] for _ in models]
        pairs = zip(models, self._ways, strict=True)
        self.scene = stacked([_scene(program, model, ways) for model, ways in pairs])
        self._meetings = meetings(program, models, self._ways)
        self._models = tuple(models)
        self._provided: frozenset[str] = frozenset()
        self._lanes = np.empty((len(models), 0, LANE))
        self._grid = no_grid(len(models))
        self.maps: tuple[RoadMap, ...] = ()
        self.stop_entities, self.stop_lights, self.stop_lines = _stop_lines(
            program, models, self._ways
        )
        self.crosswalks = _crosswalks(self.scene, self._ways)
        self.tables = self._tables()

    def __getstate__(self) -> dict[str, Any]:
        """Another process has the same ways, and plans more of them by itself."""
        with self._lock:
            return {name: var for name, var in vars(self).items() if name != "_lock"}

    def __setstate__(self, state: Mapping[str, Any]) -> None:
        vars(self).update(state, _lock=Lock())

    def stations(self, rows: Int, s: Float) -> Float:
        """Return where entities start along their first paths, ``(N, E)`` float64 [m].

        Args:
            rows: ``(N,)`` number of each row's road network.
            s: ``(N, E)`` along the roads on which they start [m].
        """
        found = self.station[rows, :, 0] + self.station[rows, :, 1] * s
        for p, ways in enumerate(self._ways):
            for e, road in ways.uneven.items():
                at = np.flatnonzero(rows == p)
                route = ways.routes[e]
                assert route is not None
                found[at, e] = route.stations(road, s[at, e])
        return np.ascontiguousarray(found)

    def starts(self, p: int) -> list[list[dict[str, Any]]]:
        """Return what gives `stations` elsewhere: for each entity pieces, see `Piece.as_json`.

        Raises:
            InputError: an entity may start beside a cubic.
        """
        even = self.station[p].tolist()
        found = [[{"low": 0.0, "high": 0.0, "first": a, "each": b}] for a, b in even]
        for e, road in self._ways[p].uneven.items():
            route = self._ways[p].routes[e]
            assert route is not None
            found[e] = [piece.as_json() for piece in route.on_road(road)]
        return found

    @property
    def n_networks(self) -> int:
        """P."""
        return len(self._ways)

    def way(self, p: int, number: int) -> Float:
        """Return the samples x, y of a way on road network p, ``(n, 2)`` float64 [m]."""
        way: Float = self.tables.paths[p, number, : self.tables.counts[p, number], :2]
        return way

    def roads_ahead(self, p: int) -> tuple[str, ...]:
        """Return the ids of the roads of the ego's first path on road network p, in its order."""
        route = self._ways[p].routes[0]
        return tuple(dict.fromkeys(step.road_id for step in route.steps)) if route else ()

    def in_junctions(self, p: int) -> Float:
        """Return where the ego's first path leads through junctions on road network p.

        Returns:
            ``(J, 2)`` float64 [m], stations along the path, in its order; without rows where it
            leads through none, or along no lanes.
        """
        found: list[list[float]] = []
        ways, at = self._ways[p], 0.0
        route = ways.routes[0]
        for step in route.steps if route is not None else ():
            end = at + abs(step.s_end - step.s)
            if ways.is_in_junction(step.road_id):
                if found and found[-1][1] == at:
                    found[-1][1] = end
                else:
                    found.append([at, end])
            at = end
        return np.array(found, dtype=np.float64).reshape(len(found), 2)

    def corridors(self, networks: Iterable[int]) -> Float:
        """Return the room beside the ego's first path on some road networks, ``(P, L, 8)``.

        See `Rollout.corridors`; it has no samples off the lanes.
        """
        from bridgegen.drivers._speed_kernels import FAST_ROAD  # numba is slow to import

        found: list[Float] = []
        for p in networks:
            ways = self._ways[p]
            route, path = ways.routes[0], ways.paths[0]
            if p not in self._corridors:
                self._corridors[p] = (
                    np.empty((0, CORRIDOR))
                    if route is None
                    else corridor_along(self._models[p], route, path.table, path.step, FAST_ROAD)
                )
            found.append(self._corridors[p])
        whole = np.full((len(found), max(map(len, found), default=0), CORRIDOR), np.inf)
        for table, array in zip(whole, found, strict=True):
            table[: len(array)] = array
        return whole

    def amend(self, name: str, first: int, part: Float) -> None:
        """Change a stretch of an entity's timed trajectory on each road network.

        Args:
            name: of the entity, which follows one.
            first: the vertex that the stretch begins at.
            part: ``(P, S + 1, 4)`` time [s], x, y [m], heading [rad] of its vertices.
        """
        m = self._program.trajectory_of(name)
        with self._lock:
            for p, (ways, course) in enumerate(zip(self._ways, part.tolist(), strict=True)):
                corners = [(x, y, h) for _, x, y, h in course]
                rows = timetable(corners, [t for t, *_ in course])
                table = ways.timetables[m]
                rows[:, 8:] += table[first, 8]
                table[first : first + len(rows)] = rows
                self.tables.timetables[p, m, : len(table)] = table

    def zones(self, name: str) -> Float:
        """Return where the ego's way meets the timed trajectory of an entity, ``(P, ZONE)``."""
        path = self._program.trajectories[self._program.trajectory_of(name)]
        zones: Float = self.tables.zones[:, path]
        return zones

    def provide(self, wants: Iterable[str]) -> None:
        """Make the tables that a driver wants, once; see `bridgegen.drivers.interface.WANTS`."""
        with self._lock:
            new = frozenset(wants) - self._provided
            if not new:
                return
            if "lanes" in new:
                pairs = zip(self._models, self._ways, strict=True)
                self._lanes = padded([[_lanes_along(model, ways)] for model, ways in pairs], LANE)[
                    :, 0
                ]
            if "map" in new:
                self.maps = tuple(
                    road_map(model, ways.routes[0], self._program.lights)
                    for model, ways in zip(self._models, self._ways, strict=True)
                )
                self._grid = grid_of(self.maps)
            self._provided |= new
            self.tables = self._tables()

    def plan(self, wanted: Iterable[tuple[int, int, int]]) -> None:
        """Plan what rows have asked for.

        Args:
            wanted: road network, route and node of each way; see `Ways.plan`.
        """
        with self._lock:
            # Ways are numbered in the order of planning, and that is not the same in any batch: so
            # no result may depend on a way's number.
            for p, route, node in sorted(set(wanted)):
                self._ways[p].plan(route, node)
            self.tables = self._tables()

    def _tables(self) -> Roads:
        ways = self._ways
        paths = padded([[path.table for path in each.paths] for each in ways], 6)
        spans = padded([[path.spans for path in each.paths] for each in ways], 11)
        slopes = padded([[path.slopes for path in each.paths] for each in ways], 3)
        counts = _numbers([[len(path.table) for path in each.paths] for each in ways])
        steps = padded([[np.full((1, 1), path.step) for path in each.paths] for each in ways], 1)
        lanes = [each.lanes for each in ways]
        known = int(any(lanes))  # that there are none is known, too
        grounds = [
            each.lanes.graph.ground if each.lanes and each.has_ground else NO_GROUND
            for each in ways
        ]
        cells = [
            each.graph.cells if each and self._program.looks_at_lanes else NO_CELLS
            for each in lanes
        ]
        nodes = max(each.numbers.shape[1] for each in ways)
        return Roads(
            paths=paths,
            bends=next_bends(paths),
            drops=next_drops(self.scene.road),
            counts=counts,
            steps=np.ascontiguousarray(steps[:, :, 0, 0]),
            follows=_numbers([[path.follows for path in each.paths] for each in ways]),
            spans=spans,
            slopes=slopes,
            span_counts=_numbers([[len(path.spans) for path in each.paths] for each in ways]),
            zones=self._find_zones(paths, counts, steps[:, :, 0, 0]),
            points=self._points,
            spots=np.array([each.spots for each in ways]),
            timetables=padded([each.timetables for each in ways], 10),
            timetable_counts=_numbers([list(map(len, each.timetables)) for each in ways]),
            nodes=_stacked(
                [each.nodes if each else np.empty((0, 7), np.int64) for each in lanes], known
            ),
            ends=_stacked([each.graph.ends if each else np.empty((0, 2)) for each in lanes], known),
            ways=np.stack(
                [
                    np.pad(
                        each.numbers,
                        ((0, 0), (0, nodes - each.numbers.shape[1])),
                        constant_values=UNKNOWN,
                    )
                    for each in ways
                ]
            ),
            ground=_stacked([ground.points for ground in grounds]),
            ground_nodes=_stacked([ground.nodes for ground in grounds]),
            cells=_stacked([each.corners for each in cells]),
            cell_nodes=_stacked([each.nodes for each in cells]),
            **self.scene._asdict(),
            **self._meetings._asdict(),
            changes=self._changes,
            lanes=self._lanes,
            pieces=self._grid.pieces,
            middles=self._grid.middles,
            grid_box=self._grid.box,
            grid_starts=self._grid.starts,
            grid_order=self._grid.order,
        )

    def _find_zones(self, paths: Float, counts: Int, steps: Float) -> Float:
        """Return where the ego's first path meets each other one, ``(P, K, ZONE)``."""
        from bridgegen.drivers._yielding_kernels import ZONE, find_zone  # numba is slow to import

        bodies = self._program.bodies
        widest = bodies[int(np.argmax(bodies[:, 1]))]
        for p, found in enumerate(self._zones):
            for k in range(len(found), len(self._ways[p].paths)):
                zone = np.full(ZONE, np.inf)
                if k > 0 and k not in self._ways[p].turnings:
                    find_zone(
                        paths[p, 0],
                        counts[p, 0],
                        steps[p, 0],
                        bodies[0],
                        paths[p, k],
                        counts[p, k],
                        steps[p, k],
                        bodies[k] if k < len(bodies) else widest,
                        zone,
                    )
                found.append(zone)
        whole = np.full((*counts.shape, ZONE), np.inf)
        for p, found in enumerate(self._zones):
            whole[p, : len(found)] = found
        return whole


def next_bends(paths: Float) -> Int:
    """Return the first row from each on that is in a bend, ``(P, K, L)`` int64; L: none is."""
    from bridgegen.drivers._path_kernels import CURVATURE  # numba is slow to import
    from bridgegen.drivers._speed_kernels import STRAIGHT

    length = paths.shape[2]
    found = np.where(np.abs(paths[..., CURVATURE]) > STRAIGHT, np.arange(length), length)
    first: Int = np.minimum.accumulate(found[..., ::-1], axis=-1)[..., ::-1]
    return np.ascontiguousarray(first)


def next_drops(roads: Float) -> Int:
    """Return the first row after each with a lower speed limit, ``(P, L)`` int64; L: none has."""
    from bridgegen.drivers._speed_kernels import LIMIT

    limits = roads[..., LIMIT]
    length = limits.shape[1]
    found = np.full(limits.shape, length, dtype=np.int64)
    for row, limit in zip(found, limits, strict=True):
        changes = np.flatnonzero(limit[1:] != limit[:-1]) + 1
        end, lower = length, list[int]()  # first rows of lower limits ahead, the nearest last
        for first in (*changes[::-1].tolist(), 0):
            while lower and limit[lower[-1]] >= limit[first]:
                lower.pop()
            row[first:end] = lower[-1] if lower else length
            lower.append(first)
            end = first
    return found


def _stop_lines(
    program: Program, models: Sequence[OpenDrive], each: Sequence[Ways]
) -> tuple[Int, Int, Float]:
    """Return the stop lines of lights that the participants' first routes cross, the ego's first.

    Off the lanes, these are the kerbs of crosswalks whose traffic has lights.

    Returns:
        ``(L,)`` int64, whose route crosses each; ``(L,)`` int64, its light, ``~light`` of a kerb;
        ``(P, L, 3)`` float64,
        where: x, y [m] and heading [rad], NaN in a road network where it does not.
    """
    found: list[dict[tuple[int, int], Float]] = []
    for model, ways in zip(models, each, strict=True):
        lines: dict[tuple[int, int], Float] = {}
        for entity, route in enumerate(ways.routes if program.lights else ()):
            path = ways.paths[entity]
            stations = np.arange(len(path.table)) * path.step
            crossed: list[tuple[int, float]] = []
            if route is not None:
                for line in reversed(stop_lines(model, route, program.lights)):
                    crossed.append((program.lights.index(line.light), line.station))
            elif entity < len(program.names) and (
                IS_PEDESTRIAN[program.kinds[entity]] or IS_CYCLE[program.kinds[entity]]
            ):
                for kerb in reversed(kerbs(model, path.table, path.step, program.lights)):
                    crossed += ((~program.lights.index(it), kerb.station) for it in kerb.lights)
            for light, station in crossed:
                pose = [np.interp(station, stations, path.table[:, i]) for i in range(3)]
                lines[entity, light] = np.array(pose)
        found.append(lines)
    keys = sorted({key for lines in found for key in lines})
    poses = np.full((len(found), len(keys), 3), np.nan)
    for p, lines in enumerate(found):
        for j, key in enumerate(keys):
            poses[p, j] = lines.get(key, np.nan)
    entities, lights = np.array(keys, dtype=np.int64).reshape(len(keys), 2).T
    return entities, lights, poses


def _crosswalks(scene: Scene, each: Sequence[Ways]) -> Float:
    """Return the crosswalks that the ego's route leads over, see `Rollout.crosswalks`; ``(P, …)``.

    What pads has NaN.
    """
    found = np.full((*scene.crosswalks.shape[:2], 5), np.nan)
    for p, ways in enumerate(each):
        path = ways.paths[0]
        stations = np.arange(len(path.table)) * path.step
        for j, (enters, leaves, right, left) in enumerate(scene.crosswalks[p]):
            if np.isfinite(enters):
                middle = 0.5 * (enters + leaves)
                x, y, c, s = (np.interp(middle, stations, path.table[:, i]) for i in (0, 1, 3, 4))
                aside = 0.5 * (left + right)
                half = 0.5 * (leaves - enters + path.step)
                found[p, j] = (
                    x - aside * s,
                    y + aside * c,
                    elementary.atan2(s, c),
                    half,
                    0.5 * (left - right),
                )
    return found


def _scene(program: Program, model: OpenDrive, ways: Ways) -> Scene:
    """Return what the driver knows of a road network; without stages, nothing of the others."""
    starts: list[list[tuple[Stretch, float]]] = [[] for _ in program.names]
    for entity, route in enumerate(ways.routes if program.driver.stages else ()):
        if route is not None and entity > 0:
            step = route.steps[0]
            road = model.road(step.road_id)
            section = section_index(road, 0.5 * (step.s + step.s_end))
            starts[entity] = [
                (Stretch(step.road_id, section, lane), step.s)
                for lane in beside(road, section, step.lane_id)
            ]
    path = ways.paths[0]
    ranks = np.zeros(len(ways.routes), np.int64)  # others than entities have none
    ranks[: len(program.sirens)] = program.sirens - ways.off_road
    found = survey(
        model, ways.routes, path.table, path.step, program.lights, starts, program.bodies, ranks
    )
    found.claims[:, 0, 0] += PASSES * any(each.against for each in ways.turnings.values())
    return found


def _lanes_along(model: OpenDrive, ways: Ways) -> Float:
    """Return the lanes along the ego's first path, see ``lane_tables``."""
    path = ways.paths[0]
    return lanes_along(model, ways.routes[0], path.table, path.step)


def _numbers(rows: Sequence[Sequence[int]]) -> Int:
    """Return rows of numbers as one array, shorter ones filled up with 0."""
    whole = np.zeros((len(rows), max(map(len, rows))), dtype=np.int64)
    for row, each in zip(whole, rows, strict=True):
        row[: len(each)] = each
    return whole


def _stacked(tables: Sequence[np.ndarray], least: int = 0) -> np.ndarray:
    """Return tables as one array; shorter ones are padded with rows of -1."""
    longest = max(least, *map(len, tables))
    return np.stack(
        [
            np.concatenate(
                [table, np.full((longest - len(table), *table.shape[1:]), -1, table.dtype)]
            )
            for table in tables
        ]
    )
