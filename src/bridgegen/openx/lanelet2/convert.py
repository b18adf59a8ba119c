"""Lanelet2 → OpenDRIVE: which lanelets are one road, where junctions are, what links to what."""

import math
from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import lru_cache

import numpy as np
from scipy.spatial import cKDTree

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.openx.lanelet2.furniture import add_furniture
from bridgegen.openx.lanelet2.read import DRIVEN, Bound, Lanelet, LaneletMap, read_lanelets
from bridgegen.openx.lanelet2.strips import Cut, Key, Shape, Strip, cut_of, dense, shape
from bridgegen.openx.opendrive.lanes import borders, points
from bridgegen.openx.opendrive.mirror import mirrored
from bridgegen.openx.opendrive.model import (
    CONTACTS,
    NO_JUNCTION,
    Connection,
    Junction,
    Lane,
    LaneLink,
    LaneSection,
    LaneSpeed,
    OpenDrive,
    Priority,
    Road,
    RoadLink,
    RoadMark,
    Width,
)
from bridgegen.openx.opendrive.notes import Notes
from bridgegen.openx.opendrive.plan_view import Cubic
from bridgegen.openx.opendrive.user_data import user_datum, values_of
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.openx.xml import parse_xml

LANELET = "lanelet"
"""The ``userData`` of a lane that says which lanelet is where: its id, s at its start and end, and
its length."""
MARKS = {
    "solid": "solid",
    "dashed": "broken",
    "solid_solid": "solid solid",
    "solid_dashed": "solid broken",
    "dashed_solid": "broken solid",
}
"""OpenDRIVE's type of a line, by Lanelet2's subtype."""
SHORT = 2.0  # m, length of a road that keeps its heading
COMPARED = 0.25  # m, between points at which a lane is compared with its lanelets
AWAY = 1.0  # m, from which on they are said to lie apart; ends that are cut square are nearer
CLEARANCE = 3.0  # m, between the heights of lanelets that cross on two levels
MOST_PATHS = 5000  # through the junctions of a map

End = tuple[str, str]
"""An end of a road: its id, and "start" or "end"."""


def opendrive_of(data: bytes, place: str, warnings: list[str] | None = None) -> bytes:
    """Return the OpenDRIVE text of a Lanelet2 map.

    Args:
        data: the ``.osm``.
        place: what to call it in messages.
        warnings: takes a sentence for each kind of thing that is not represented, with the line.

    Raises:
        FileFormatError: not a Lanelet2 map, or one with lanelets that cannot be.
    """
    text, said = _converted(data, place)
    if warnings is not None:
        warnings += said
    return text


@lru_cache(maxsize=4)
def _converted(data: bytes, place: str) -> tuple[bytes, tuple[str, ...]]:
    root = parse_xml(data, place)
    if root.tag != "osm":
        raise FileFormatError(f"{place}: the root element must be osm, got {root.tag!s} (line 1)")
    notes = Notes()
    model = _Network(read_lanelets(root, place, notes), place, notes).model()
    return to_xml(model), tuple(notes.sentences(place))


def lanelets_of(model: OpenDrive) -> dict[str, tuple[str, int, float, float, float]]:
    """Return where lanelets are: road, lane, s at their start and end, and their length [m]."""
    found: dict[str, tuple[str, int, float, float, float]] = {}
    for road in model.roads:
        for lane in road.sections[0].lanes:
            for value in values_of(lane.user_data, LANELET):
                key, *numbers = value.split()
                start, end, length = map(float, numbers)
                found.setdefault(key, (road.id, lane.id, start, end, length))
    return found


class _Sets:
    """Disjoint sets of numbers or pairs, each known by one of its members."""

    def __init__(self) -> None:
        self._parent: dict[object, object] = {}

    def find(self, item: object) -> object:
        """Return the member that a set is known by."""
        while (parent := self._parent.setdefault(item, item)) != item:
            self._parent[item] = self._parent[parent]
            item = parent
        return item

    def join(self, a: object, b: object) -> None:
        """Make the sets of two items one."""
        self._parent[self.find(b)] = self.find(a)


@dataclass
class _Network:
    map: LaneletMap
    place: str
    notes: Notes
    lanes: dict[str, Lanelet] = field(init=False)
    strips: dict[str, Strip] = field(init=False)

    def __post_init__(self) -> None:
        self.lanes = {
            key: item for key, item in self.map.lanelets.items() if item.type != "crosswalk"
        }
        starts, ends = defaultdict(list), defaultdict(list)
        for key, item in self.lanes.items():
            starts[item.start].append(key)
            ends[item.end].append(key)
        self.after = {key: starts.get(item.end, []) for key, item in self.lanes.items()}
        self.before = {key: ends.get(item.start, []) for key, item in self.lanes.items()}

    # -- junctions ---------------------------------------------------------------------------------

    def _clusters(self) -> tuple[_Sets, set[str]]:
        """Return the lanelets that cross, begin or end together, and those within junctions."""
        sets, inside = _Sets(), set()
        driven = [key for key, item in self.lanes.items() if item.type in DRIVEN]
        known = set(driven)
        for key in driven:
            for side in (self.after[key], self.before[key]):
                together = [other for other in side if other in known]
                for other in together[1:]:
                    sets.join(together[0], other)
        crossed = {key for key in driven if "turn_direction" in self.lanes[key].tags}
        for a, b in self._crossings(driven):
            sets.join(a, b)
            crossed.add(a)
        heads = {sets.find(key) for key in crossed}
        inside = {key for key in driven if sets.find(key) in heads}
        return sets, inside

    def _crossings(self, keys: list[str]) -> Iterator[tuple[str, str]]:
        lines = [self.lanes[key].centre for key in keys]
        low = np.array([line[:, :2].min(axis=0) for line in lines]).reshape(-1, 2)
        high = np.array([line[:, :2].max(axis=0) for line in lines]).reshape(-1, 2)
        for i, line in enumerate(lines):
            near = np.nonzero(
                np.all((low[i + 1 :] <= high[i]) & (high[i + 1 :] >= low[i]), axis=1)
            )[0]
            for j in (near + i + 1).tolist():
                if _cross(line, lines[j]):
                    yield keys[i], keys[j]

    def _groups(self, inside: set[str]) -> list[Strip]:
        """Return the roads outside junctions: lanelets that share bounds side by side."""
        left: dict[tuple[str, bool], list[str]] = defaultdict(list)
        right: dict[tuple[str, bool], list[str]] = defaultdict(list)
        outside = [key for key in self.lanes if key not in inside]
        for key in outside:
            left[_key(self.lanes[key].left)].append(key)
            right[_key(self.lanes[key].right)].append(key)

        def only(
            table: dict[tuple[str, bool], list[str]],
            other: dict[tuple[str, bool], list[str]],
            bound: Bound,
            flip: bool,
        ) -> str | None:
            way, forward = _key(bound)
            here, there = other.get((way, forward), []), table.get((way, forward != flip), [])
            return there[0] if len(here) == len(there) == 1 else None

        def rightmost(key: str) -> list[str]:
            row = [key]
            while (
                beside := only(left, right, self.lanes[row[-1]].right, False)
            ) and beside not in row:
                row.append(beside)
            return row

        strips: list[Strip] = []
        taken: set[str] = set()
        for key in outside:
            if key in taken:
                continue
            first = key
            seen = {key}
            while (
                beside := only(right, left, self.lanes[first].left, False)
            ) and beside not in seen:
                first = beside
                seen.add(beside)
            along = rightmost(first)
            facing = only(left, left, self.lanes[first].left, True)
            against = rightmost(facing)[::-1] if facing else []
            lanes = [((self.lanes[k],), False) for k in against] + [
                ((self.lanes[k],), True) for k in along
            ]
            taken.update(against, along)
            strips.append(Strip(key, tuple(lanes)))
        return strips

    def _partition(self) -> list[Strip]:
        sets, inside = self._clusters()
        while True:
            groups = self._groups(inside)
            moved = set()
            for strip in groups:
                for contact in CONTACTS:
                    linked = {
                        key
                        for index in range(len(strip.lanes))
                        for key in self._linked(strip, index, contact)
                    }
                    within = sorted(linked & inside)
                    for key in within[1:]:
                        sets.join(within[0], key)
                    # At an end of a road is a junction or another road: not both.
                    if within:
                        beyond = {key for key in linked - inside if self.lanes[key].type in DRIVEN}
                        moved |= beyond
                        for key in beyond:
                            sets.join(within[0], key)
            inside |= moved
            for key in sorted(inside):
                for other in self.after[key]:
                    if other in inside:
                        sets.join(key, other)
            if not moved:
                break
        numbers: dict[object, int] = {}
        paths = []
        covered: set[str] = set()
        within = [key for key in self.lanes if key in inside]
        # Those without an entry go round in a circle.
        entries = [key for key in within if not any(other in inside for other in self.before[key])]
        for start in dict.fromkeys((*entries, *within)):
            if start in covered:
                continue
            for path in self._paths(start, inside):
                covered.update(path)
                number = numbers.setdefault(sets.find(start), len(numbers))
                paths.append(
                    Strip("+".join(path), ((tuple(self.lanes[k] for k in path), True),), number)
                )
                if len(paths) > MOST_PATHS:
                    line = self.lanes[start].line
                    raise FileFormatError(
                        f"{self.place}, line {line}: a map may have {MOST_PATHS} ways through its "
                        f"junctions, lanelet {start} begins more"
                    )
        return groups + paths

    def _paths(self, start: str, inside: set[str]) -> Iterator[list[str]]:
        stack = [[start]]
        while stack:
            path = stack.pop()
            following = [key for key in self.after[path[-1]] if key in inside and key not in path]
            if not following or len(path) > 30:
                yield path
            stack += [[*path, key] for key in reversed(following)]

    def _linked(self, strip: Strip, index: int, contact: str) -> list[str]:
        lanelets, along = strip.lanes[index]
        return (
            self.before[lanelets[0].id]
            if along == (contact == "start")
            else self.after[lanelets[-1].id]
        )

    # -- where roads meet --------------------------------------------------------------------------

    def _cuts(self, strips: list[Strip]) -> dict[End, Cut]:
        sets, alike = _Sets(), _Sets()
        for strip in strips:
            for contact in CONTACTS:
                edges = [strip.key(k, contact) for k in range(len(strip.lanes))]
                for edge in edges:
                    sets.join(edges[0], edge)
        ends: dict[object, dict[tuple[str, bool], tuple[Lanelet, bool, bool]]] = defaultdict(dict)
        drawn: dict[object, list[tuple[Key, Float]]] = defaultdict(list)
        for strip in strips:
            for contact in CONTACTS:
                head = sets.find(strip.key(0, contact))
                # Lanes fold in a road that is too short to turn from one heading to another.
                if min(item[0].length for item, _ in strip.lanes) < SHORT:
                    alike.join(head, sets.find(strip.key(0, CONTACTS[contact == "start"])))
                for lanelets, along in strip.lanes:
                    starts = along == (contact == "start")
                    lanelet = lanelets[0 if starts else -1]
                    ends[head][lanelet.id, starts] = (lanelet, starts, strip.junction is not None)
                keyed: list[tuple[Key, Float]] = [
                    (line.ends[contact == "end"], line.points) for line in strip.borders()
                ]
                keyed += [(strip.key(k, contact), line) for k, line in enumerate(strip.centres())]
                drawn[head] += [
                    (key, points if contact == "start" else points[::-1]) for key, points in keyed
                ]
        turned: dict[object, dict[tuple[str, bool], tuple[Lanelet, bool, bool]]] = defaultdict(dict)
        for head, there in ends.items():
            turned[alike.find(head)] |= there
        known = {
            head: cut_of(list(turned[alike.find(head)].values()), drawn[head]) for head in ends
        }
        found = {}
        for strip in strips:
            for contact in CONTACTS:
                cut = known[sets.find(strip.key(0, contact))]
                # A lane's left bound is on the left of its right one, seen along the lane.
                sense = 0.0
                for index, (_, along) in enumerate(strip.lanes):
                    left, right = strip.edge(index, contact)
                    sense += (cut.at[left] - cut.at[right]) * (1.0 if along else -1.0)
                found[strip.id, contact] = cut if sense >= 0.0 else cut.turned()
        return found

    # -- the model ---------------------------------------------------------------------------------

    def model(self) -> OpenDrive:
        """Return the road network."""
        strips = self._partition()
        cuts = self._cuts(strips)
        shapes: dict[str, Shape] = {}
        problems = []
        for strip in strips:
            made = shape(strip, cuts[strip.id, "start"], cuts[strip.id, "end"])
            shapes[strip.id] = made
            first = strip.lanes[0][0][0]
            if made.length < 0.05:
                problems.append(
                    (
                        first.line,
                        f"lanelet {first.id} must be longer than 0.05 m, got {made.length:.3g} m",
                    )
                )
            elif made.stretch < 0.0:
                self.notes.add(
                    "fold",
                    first.line,
                    f"lanelet {first.id}: lanes lie beyond the centre of its bend",
                )
        if problems:
            raise FileFormatError(
                *(f"{self.place}, line {line}: {problem}" for line, problem in sorted(problems))
            )
        names = {strip.id: str(number) for number, strip in enumerate(strips, start=1)}
        links = self._links(strips)
        junctions = _Junctions(strips, names, links)
        roads = [self._road(strip, shapes[strip.id], names, links, junctions) for strip in strips]
        for strip, road in zip(strips, roads, strict=True):
            self._compare(strip, road)
        header = mirrored(self.map.header) if self.map.left_hand else self.map.header
        roads = add_furniture(self.map, strips, shapes, roads, self.notes)
        crossings = junctions.made(self._priorities(strips, names))
        return OpenDrive(header, tuple(roads), (), crossings, left_hand=self.map.left_hand)

    def _compare(self, strip: Strip, road: Road) -> None:
        """Note lanes that are not where their lanelets are, as where a road is a closed loop."""
        s = np.linspace(0.0, road.length, max(2, math.ceil(road.length / COMPARED)))
        t = borders(road, 0, s)
        for index, line in enumerate(strip.centres()):
            lane = strip.lane_id(index)
            ours = points(road, s, 0.5 * (t[lane] + t[lane - (1 if lane > 0 else -1)]))
            theirs = dense(line, COMPARED)[:, :2]
            off = max(
                float(np.max(cKDTree(a).query(b)[0])) for a, b in ((ours, theirs), (theirs, ours))
            )
            if off > AWAY:
                first = strip.lanes[index][0][0]
                self.notes.add(
                    "away",
                    first.line,
                    f"lanelet {first.id}: its lane lies up to {off:.1f} m beside it",
                )

    def _links(self, strips: list[Strip]) -> dict[End, list[tuple[int, End, int]]]:
        """Return per end of a road: a lane, the end that it is joined to, and the lane there."""
        where: dict[str, list[tuple[Strip, int, str]]] = defaultdict(list)
        for strip in strips:
            for index, (lanelets, along) in enumerate(strip.lanes):
                for lanelet, contact in (
                    (lanelets[0], CONTACTS[not along]),
                    (lanelets[-1], CONTACTS[along]),
                ):
                    where[lanelet.id].append((strip, index, contact))
        found: dict[End, list[tuple[int, End, int]]] = {}
        for strip in strips:
            for contact in CONTACTS:
                row = found.setdefault((strip.id, contact), [])
                for index, (_, along) in enumerate(strip.lanes):
                    starts = along == (contact == "start")
                    for key in self._linked(strip, index, contact):
                        for other, k, there in where[key]:
                            lanelets, forward = other.lanes[k]
                            enters = forward == (there == "start")
                            if (
                                enters != starts
                                and lanelets[0 if enters else -1].id == key
                                and not (strip.junction is not None and other.junction is not None)
                            ):
                                row.append(
                                    (strip.lane_id(index), (other.id, there), other.lane_id(k))
                                )
        return found

    def _road(
        self,
        strip: Strip,
        line: Shape,
        names: dict[str, str],
        links: dict[End, list[tuple[int, End, int]]],
        junctions: "_Junctions",
    ) -> Road:
        borders = strip.borders()
        marks = [_marks(border.way.tags) for border in borders]
        lanes = []
        for index, (lanelets, along) in enumerate(strip.lanes):
            lane_id = strip.lane_id(index)
            inner, outer = (index, index + 1) if lane_id < 0 else (index + 1, index)
            sign = 1.0 if lane_id < 0 else -1.0
            widths = line.cubics(
                sign * (line.values[inner] - line.values[outer]),
                sign * (line.slopes[inner] - line.slopes[outer]),
                Width,
                least=0.0,
            )
            stops = [0.0 if along else line.length]
            for lanelet in lanelets[:-1]:
                end = np.mean([lanelet.left.points[-1, :2], lanelet.right.points[-1, :2]], axis=0)
                stops.append(float(np.clip(line.project(end[None])[0][0], 0.0, line.length)))
            stops.append(line.length if along else 0.0)
            said = tuple(
                user_datum(
                    LANELET, f"{lanelet.id} {stops[k]:.3f} {stops[k + 1]:.3f} {lanelet.length:.3f}"
                )
                for k, lanelet in enumerate(lanelets)
            )
            speeds = (
                [
                    LaneSpeed(s, lanelet.speed)
                    for s, lanelet in zip(stops, lanelets, strict=False)
                    if lanelet.speed
                ]
                if along
                else [LaneSpeed(0.0, item.speed) for item in lanelets if item.speed]
            )
            ahead, behind = (
                tuple(
                    sorted(
                        {
                            to
                            for lane, end, to in links[strip.id, contact]
                            if lane == lane_id and junctions.joins((strip.id, contact), end)
                        },
                        key=abs,
                    )
                )
                for contact in ("end", "start")
            )
            lanes.append(
                Lane(
                    lane_id,
                    lanelets[0].type,
                    False,
                    behind,
                    ahead,
                    widths=tuple(widths),
                    road_marks=marks[outer],
                    speeds=tuple(speeds),
                    user_data=said,
                )
            )
        centre = marks[strip.centre]
        section = LaneSection(
            0.0,
            False,
            tuple(lane for lane in lanes if lane.id > 0),
            (Lane(0, "none", False, road_marks=centre),),
            tuple(lane for lane in lanes if lane.id < 0),
        )
        slopes = np.diff(line.heights[:, 1]) / np.diff(line.heights[:, 0])
        high = [
            Cubic(float(s), float(z), float(b), 0.0, 0.0)
            for (s, z), b in zip(line.heights, slopes, strict=False)
        ]
        offsets = line.cubics(line.values[strip.centre], line.slopes[strip.centre], Cubic)
        flat = all(abs(value) < 5e-4 for value in line.values[strip.centre]) and all(
            abs(value) < 1e-3 for value in line.slopes[strip.centre]
        )
        ids = [lanelet.id for lanelets, _ in strip.lanes for lanelet in lanelets]
        return Road(
            names[strip.id],
            line.length,
            NO_JUNCTION if strip.junction is None else junctions.name(strip.junction),
            name=f"lanelets {' '.join(ids)}",
            predecessor=junctions.link(strip.id, "start"),
            successor=junctions.link(strip.id, "end"),
            plan_view=line.plan_view,
            elevations=tuple(high) if any(cubic.a or cubic.b for cubic in high) else (),
            lane_offsets=() if flat else tuple(offsets),
            sections=(section,),
        )

    def _priorities(self, strips: list[Strip], names: dict[str, str]) -> dict[int, list[Priority]]:
        """Return the right of way between the roads of each junction."""
        through: dict[str, list[Strip]] = defaultdict(list)
        for strip in strips:
            if strip.junction is not None:
                for lanelet in strip.lanes[0][0]:
                    through[lanelet.id].append(strip)
        for key, item in self.lanes.items():
            if not through[key] and item.type in DRIVEN:
                through[key] = [
                    strip for other in self.after[key] for strip in through.get(other, [])
                ]
        found: dict[int, list[Priority]] = defaultdict(list)
        for rule in self.map.rules.values():
            if rule.subtype != "right_of_way":
                continue
            sides = [
                [strip for key in rule.lanelets.get(role, []) for strip in through.get(key, [])]
                for role in ("right_of_way", "yield")
            ]
            pairs = [
                (high, low)
                for high in sides[0]
                for low in sides[1]
                if high.junction == low.junction and high is not low
            ]
            for high, low in pairs:
                made = Priority(names[high.id], names[low.id])
                if made not in found[high.junction or 0]:
                    found[high.junction or 0].append(made)
            if not pairs:
                self.notes.add(
                    "right of way",
                    rule.line,
                    f"regulatory element {rule.id}: its right of way is not within a junction, and "
                    "is left out",
                )
        return found


class _Junctions:
    """What roads are joined to at their ends, and the junctions, also without roads within."""

    def __init__(
        self,
        strips: list[Strip],
        names: dict[str, str],
        links: dict[End, list[tuple[int, End, int]]],
    ) -> None:
        self._strips = {strip.id: strip for strip in strips}
        self._names, self._links = names, links
        self._numbers: dict[End, int] = {}
        count = 1 + max(
            (strip.junction for strip in strips if strip.junction is not None), default=-1
        )
        self._common, sets = count, _Sets()
        split: list[End] = []
        for end, row in links.items():
            if self._strips[end[0]].junction is not None:
                continue
            others = {other for _, other, _ in row}
            inside = {self._strips[key].junction for key, _ in others} - {None}
            if inside:
                self._numbers[end] = min(number for number in inside if number is not None)
            else:
                for other in others:
                    sets.join(end, other)
                if len(others) > 1:
                    split.append(end)
        heads: dict[object, int] = {}
        for end in split:
            heads.setdefault(sets.find(end), count + len(heads))
        for end in links:
            if (
                sets.find(end) in heads
                and end not in self._numbers
                and self._strips[end[0]].junction is None
            ):
                self._numbers[end] = heads[sets.find(end)]
        self._count = count + len(heads)

    def name(self, number: int) -> str:
        """Return the id of a junction; no road has it."""
        return str(len(self._names) + 1 + number)

    def joins(self, end: End, other: End) -> bool:
        """Return whether an end of a road is joined to a road's, and not to a junction."""
        inside = self._strips[end[0]].junction is not None
        return end not in self._numbers and (inside or other not in self._numbers)

    def link(self, key: str, contact: str) -> RoadLink | None:
        """Return what a road is joined to at an end."""
        if (key, contact) in self._numbers:
            return RoadLink("junction", self.name(self._numbers[key, contact]))
        for _, (other, there), _ in self._links[key, contact]:
            if self.joins((key, contact), (other, there)):
                return RoadLink("road", self._names[other], there)
        return None

    def made(self, priorities: dict[int, list[Priority]]) -> tuple[Junction, ...]:
        """Return the junctions."""
        found = []
        for number in range(self._count):
            connections: list[Connection] = []
            direct = number >= self._common
            for end in [end for end, own in self._numbers.items() if own == number]:
                ways: dict[End, list[LaneLink]] = defaultdict(list)
                for lane, other, to in self._links[end]:
                    # What is not driven on ends where a junction with roads of its own begins.
                    if self._leaves(end, lane) and direct == (
                        self._strips[other[0]].junction is None
                    ):
                        ways[other].append(LaneLink(lane, to))
                for (entered, there), pairs in ways.items():
                    connections.append(
                        Connection(
                            str(len(connections)),
                            self._names[end[0]],
                            None if direct else self._names[entered],
                            there,
                            tuple(pairs),
                            self._names[entered] if direct else None,
                        )
                    )
            found.append(
                Junction(
                    self.name(number),
                    None,
                    tuple(connections),
                    tuple(priorities.get(number, ())),
                    type="direct" if direct else None,
                )
            )
        return tuple(junction for junction in found)

    def _leaves(self, end: End, lane: int) -> bool:
        return (lane < 0) == (end[1] == "end")


def _key(bound: Bound) -> tuple[str, bool]:
    return bound.way.id, bound.forward


def _marks(tags: dict[str, str]) -> tuple[RoadMark, ...]:
    """Return the marking of a bound, if it has one that OpenDRIVE knows."""
    kind, color = tags.get("type", ""), tags.get("color", "standard")
    drawn = "curb" if kind == "curbstone" else MARKS.get(tags.get("subtype", ""))
    if drawn is None or kind not in ("line_thin", "line_thick", "curbstone"):
        return ()
    change = {"yes": "both", "no": "none"}.get(tags.get("lane_change", ""))
    weight = "bold" if kind == "line_thick" else "standard"
    color = color if color in ("white", "yellow", "red", "blue", "green") else "standard"
    return (RoadMark(0.0, drawn, color, weight, lane_change=change),)


def _cross(a: Float, b: Float) -> bool:
    """Return whether two lines cross on one level; lines that begin or end together do not."""
    u, v = a[1:] - a[:-1], b[1:] - b[:-1]
    w = b[None, :-1] - a[:-1, None]
    det = u[:, None, 0] * v[None, :, 1] - u[:, None, 1] * v[None, :, 0]
    with np.errstate(divide="ignore", invalid="ignore"):
        s = (w[..., 0] * v[None, :, 1] - w[..., 1] * v[None, :, 0]) / det
        t = (w[..., 0] * u[:, None, 1] - w[..., 1] * u[:, None, 0]) / det
    for i, j in np.argwhere((s >= 0.0) & (s <= 1.0) & (t >= 0.0) & (t <= 1.0)):
        at = a[i] + s[i, j] * u[i]
        over = b[j, 2] + t[i, j] * v[j, 2]
        apart = [float(np.max(np.abs((at - end)[:2]))) for end in (a[0], a[-1], b[0], b[-1])]
        if min(apart) > 0.5 and abs(float(at[2] - over)) < CLEARANCE:
            return True
    return False
