"""A Lanelet2 file (OSM's XML) → lanelets with bounds in metres, and what governs them.

Source: Poggenhans et al. 2018, "Lanelet2: a high-definition map framework", and the format's
documentation (Lanelet2, lanelet2_core/doc/LaneletPrimitives.md, RegulatoryElementTagging.md).
"""

import math
import re
from collections.abc import Iterator
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
from lxml import etree

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import FileFormatError
from bridgegen.openx.opendrive.model import SPEED_UNITS, Header, Offset
from bridgegen.openx.opendrive.notes import SHOWN, Notes

LANE_TYPES = {
    "road": "driving",
    "highway": "driving",
    "play_street": "driving",
    "exit": "driving",
    "bus_lane": "bus",
    "bicycle_lane": "biking",
    "emergency_lane": "shoulder",
    "road_shoulder": "shoulder",
    "pedestrian_lane": "sidewalk",
    "walkway": "sidewalk",
    "shared_walkway": "sidewalk",
    "stairs": "sidewalk",
    "rail": "rail",
    "crosswalk": "crosswalk",
}
"""OpenDRIVE's type of lane, by Lanelet2's or Autoware's subtype; a crosswalk becomes an object."""

DRIVEN = ("driving", "bus", "bidirectional")
SPEED_WORDS = {
    "kmh": "km/h",
    "kph": "km/h",
    "km/h": "km/h",
    "mps": "m/s",
    "m/s": "m/s",
    "mph": "mph",
}
LONGEST = 2e4  # m, a bound of a lanelet
LEAST_LOOP = 2.0  # m, along a bound that crosses itself
BESIDE = 8.0  # m, between the middles of lanelets with traffic in both directions
_MGRS = 1e5  # m, the side of a square of MGRS, in which Autoware's maps count


@dataclass(frozen=True, eq=False)
class Way:
    """A line string.

    Attributes:
        nodes: the numbers of its nodes.
        points: ``(P, 3)`` float64 [m].
    """

    id: str
    line: int
    nodes: tuple[int, ...]
    points: Float
    tags: dict[str, str]


@dataclass(frozen=True, eq=False)
class Bound:
    """A way, in the direction of a lanelet."""

    way: Way
    forward: bool

    @property
    def nodes(self) -> tuple[int, ...]:
        """The numbers of its nodes."""
        return self.way.nodes if self.forward else self.way.nodes[::-1]

    @property
    def points(self) -> Float:
        """``(P, 3)`` float64 [m]."""
        return self.way.points if self.forward else self.way.points[::-1]


@dataclass(frozen=True, eq=False)
class Lanelet:
    """A piece of a lane between its left and its right bound, in the direction of traffic.

    Attributes:
        type: of an OpenDRIVE lane, or "crosswalk".
        speed: its limit [m/s], if any.
        rules: the ids of its regulatory elements.
    """

    id: str
    line: int
    left: Bound
    right: Bound
    type: str
    speed: float | None
    tags: dict[str, str]
    rules: tuple[str, ...]

    @cached_property
    def centre(self) -> Float:
        """Its centre line as Lanelet2 has it; ``(P, 3)`` float64 [m]."""
        return centre_line(self.left.points, self.right.points)

    @property
    def length(self) -> float:
        """Of its centre line [m]."""
        steps = np.diff(self.centre[:, :2], axis=0)
        return float(np.sum(np.sqrt(np.sum(steps * steps, axis=1)))) or 1e-3

    @property
    def start(self) -> tuple[int, int]:
        """The nodes at its start, left and right."""
        return self.left.nodes[0], self.right.nodes[0]

    @property
    def end(self) -> tuple[int, int]:
        """The nodes at its end, left and right."""
        return self.left.nodes[-1], self.right.nodes[-1]


@dataclass(frozen=True, eq=False)
class Rule:
    """A regulatory element; its members by their roles."""

    id: str
    line: int
    subtype: str
    ways: dict[str, list[Way]]
    lanelets: dict[str, list[str]]
    tags: dict[str, str]


@dataclass(frozen=True, eq=False)
class LaneletMap:
    """A Lanelet2 map.

    Attributes:
        left_hand: traffic drives on the left; y and both sides are mirrored then.
        stop_lines: those that no regulatory element names included.
    """

    header: Header
    left_hand: bool
    lanelets: dict[str, Lanelet]
    rules: dict[str, Rule]
    stop_lines: tuple[Way, ...]


def read_lanelets(root: etree._Element, place: str, notes: Notes) -> LaneletMap:
    """Return the lanelets and the rules of a Lanelet2 file.

    Args:
        root: ``<osm>``.
        place: what to call it in messages.
        notes: takes what is not read.

    Raises:
        FileFormatError: elements without ids or members that exist, coordinates or bounds that
            cannot be, subtypes of lanelets that are not known; with their lines.
    """
    reader = _Reader(root, notes)
    found = reader.read()
    if reader.problems or not found.lanelets:
        problems = sorted(reader.problems) or [
            (root.sourceline or 0, "a lanelet is required; OpenStreetMap itself has none")
        ]
        more = [f"{place}: and {len(problems) - SHOWN} more"] if len(problems) > SHOWN else []
        raise FileFormatError(
            *(f"{place}, line {line}: {problem}" for line, problem in problems[:SHOWN]), *more
        )
    return found


@dataclass
class _Reader:
    root: etree._Element
    notes: Notes
    problems: list[tuple[int, str]] = field(default_factory=list)
    left_hand: bool = False

    def read(self) -> LaneletMap:
        places, header = self._places()
        ways = {item[0]: way for item in self._items("way") if (way := self._way(item, places))}
        # What is wrong with these would be said again of all that is made of them.
        relations = [] if self.problems else list(self._items("relation"))
        rules = {
            key: self._rule(key, element, tags, ways)
            for key, element, tags in relations
            if tags.get("type") == "regulatory_element"
        }
        bounds = {}
        for key, element, tags in relations:
            kind = tags.get("type", "")
            if kind == "lanelet":
                if pair := self._bounds(key, element, ways):
                    bounds[key] = (element, tags, *pair)
            elif kind != "regulatory_element":
                self._note(element, f"relation of type '{kind}' is not read", key)
        self.left_hand = _drives_left([pair[2:] for pair in bounds.values() if _drivable(pair[1])])
        if self.left_hand:
            # The converter knows traffic on the right only: the other one is its mirror image.
            flipped = {key: _mirrored(way) for key, way in ways.items()}
            ways = flipped
            bounds = {
                key: (
                    element,
                    tags,
                    Bound(flipped[right.way.id], right.forward),
                    Bound(flipped[left.way.id], left.forward),
                )
                for key, (element, tags, left, right) in bounds.items()
            }
            for rule in rules.values():
                for role, named in rule.ways.items():
                    rule.ways[role] = [flipped[way.id] for way in named]
        lanelets = {}
        for key, (element, tags, left, right) in bounds.items():
            if made := self._lanelet(key, element, tags, left, right, rules):
                lanelets[key] = made
        lines = tuple(way for way in ways.values() if way.tags.get("type") == "stop_line")
        return LaneletMap(header, self.left_hand, lanelets, rules, lines)

    def _items(self, tag: str) -> Iterator[tuple[str, etree._Element, dict[str, str]]]:
        seen: set[str] = set()
        for element in self.root.iterchildren(tag):
            key = element.get("id")
            if element.get("action") == "delete":
                continue
            if key is None or key in seen:
                self._wrong(element, f"{tag} must have an id of its own, got {key}")
                continue
            seen.add(key)
            tags = {item.get("k", ""): item.get("v", "") for item in element.iterchildren("tag")}
            yield key, element, tags

    def _places(self) -> tuple[dict[str, tuple[int, tuple[float, float, float]]], Header]:
        """Return the nodes, with a number for each place, and where the plane is on the globe."""
        raw: dict[str, dict[str, float]] = {}
        given: set[str] = set()
        for key, element, tags in self._items("node"):
            values = {}
            for name, limit in (("lat", 85.0), ("lon", 180.0), ("ele", 1e4)):
                text = tags.get("ele", "0") if name == "ele" else element.get(name, "nan")
                values[name] = self._number(element, f"{name} of node {key}", text or "nan", limit)
            if {"local_x", "local_y"} <= tags.keys():
                values |= {
                    name: self._number(element, f"{name} of node {key}", tags[name], 1e7)
                    for name in ("local_x", "local_y")
                }
                given.add(key)
            raw[key] = values
        if not raw or self.problems:
            return {}, Header(1, 7)
        lat = [value["lat"] for value in raw.values()]
        lon = [value["lon"] for value in raw.values()]
        local = len(given) >= len(raw) - 1 and any(
            raw[key]["local_x"] or raw[key]["local_y"] for key in given
        )
        autoware = local or self.root.find("MetaInfo") is not None
        middle = 0.5 * (min(lat) + max(lat)), 0.5 * (min(lon) + max(lon))
        if autoware:
            zone = min(int((middle[1] + 180.0) // 6.0) + 1, 60)
            south = " +south" if middle[0] < 0.0 else ""
            reference = f"+proj=utm +zone={zone}{south} +datum=WGS84 +units=m +no_defs"
            x, y = transverse_mercator(np.array(lat), np.array(lon), 6.0 * zone - 183.0, 0.9996)
            x, y = x + 5e5, y + (1e7 if south else 0.0)
            corner = (
                _MGRS * math.floor(float(x.min()) / _MGRS),
                _MGRS * math.floor(float(y.min()) / _MGRS),
            )
        else:
            y0, x0 = (round(value, 6) for value in middle)
            reference = f"+proj=tmerc +lat_0={y0} +lon_0={x0} +k=1 +datum=WGS84 +units=m"
            x, y = transverse_mercator(np.array(lat), np.array(lon), x0, 1.0)
            y -= transverse_mercator(np.array([y0]), np.array([x0]), x0, 1.0)[1]
            corner = 0.0, 0.0
        x, y = x - corner[0], y - corner[1]
        if local:
            own = np.array(
                [[raw[k].get("local_x", np.nan), raw[k].get("local_y", np.nan)] for k in raw]
            )
            off = np.nanmax(np.abs(own - np.stack((x, y), axis=1)))
            x, y = np.where(np.isnan(own), np.stack((x, y), axis=1), own).T
            if not off < 1.0:  # a frame of its own, which no projection is known for
                reference = ""
        merged: dict[tuple[int, int, int], int] = {}
        places = {}
        for index, key in enumerate(raw):
            point = (float(x[index]), float(y[index]), raw[key]["ele"])
            # Tools that write a node for each end of a way: within a millimetre it is one place.
            grid = (round(1e3 * point[0]), round(1e3 * point[1]), round(10.0 * point[2]))
            places[key] = (merged.setdefault(grid, len(merged)), point)
        header = Header(
            1,
            7,
            vendor="BridgeGen",
            geo_reference=reference or None,
            offset=Offset(*corner, 0.0, 0.0) if reference and any(corner) else None,
        )
        return places, header

    def _way(
        self,
        item: tuple[str, etree._Element, dict[str, str]],
        places: dict[str, tuple[int, tuple[float, float, float]]],
    ) -> Way | None:
        key, element, tags = item
        refs = [nd.get("ref", "") for nd in element.iterchildren("nd")]
        missing = [ref for ref in refs if ref not in places]
        if missing and not self.problems:
            self._wrong(element, f"way {key}: node '{missing[0]}' is not in the file")
        if missing or not refs:
            return None
        # A point that is there twice in a row has no direction to go on.
        kept = [
            places[ref]
            for k, ref in enumerate(refs)
            if not k or places[ref][0] != places[refs[k - 1]][0]
        ]
        points = np.array([point for _, point in kept])
        points.flags.writeable = False
        return Way(key, element.sourceline or 0, tuple(number for number, _ in kept), points, tags)

    def _rule(
        self, key: str, element: etree._Element, tags: dict[str, str], ways: dict[str, Way]
    ) -> Rule:
        named: dict[str, list[Way]] = {}
        lanelets: dict[str, list[str]] = {}
        for member in element.iterchildren("member"):
            role, ref = member.get("role", ""), member.get("ref", "")
            if member.get("type") == "way" and ref in ways:
                named.setdefault(role, []).append(ways[ref])
            elif member.get("type") == "relation":
                lanelets.setdefault(role, []).append(ref)
        return Rule(key, element.sourceline or 0, tags.get("subtype", ""), named, lanelets, tags)

    def _bounds(
        self, key: str, element: etree._Element, ways: dict[str, Way]
    ) -> tuple[Bound, Bound] | None:
        sides = []
        for role in ("left", "right"):
            refs = [
                m.get("ref", "") for m in element.iterchildren("member") if m.get("role") == role
            ]
            way = ways.get(refs[0]) if len(refs) == 1 else None
            if way is None or len(way.nodes) < 2:
                got = f"way {', '.join(refs)}" if refs else "none"
                self._wrong(
                    element,
                    f"lanelet {key} must have one {role} bound of two points or more, got {got}",
                )
                return None
            steps = np.diff(way.points[:, :2], axis=0)
            length = float(np.sum(np.sqrt(np.sum(steps * steps, axis=1))))
            if length > LONGEST:
                self._wrong(
                    element,
                    f"lanelet {key}: its {role} bound, way {way.id}, must not be longer than "
                    f"{LONGEST / 1e3:g} km, and is {length / 1e3:,.1f} km long",
                )
                return None
            sides.append(way)
        left, right = (way.points[:, :2] for way in sides)
        # Ways are drawn in any direction: the bounds are those between which a lane is, with the
        # left one on its left.
        along = np.hypot(*(left[0] - right[0])) + np.hypot(*(left[-1] - right[-1]))
        across = np.hypot(*(left[0] - right[-1])) + np.hypot(*(left[-1] - right[0]))
        same = bool(along <= across)
        ring = np.concatenate((left, right[::-1] if same else right))
        ring = ring - ring[0]
        following = np.roll(ring, -1, axis=0)
        area = float(np.sum(ring[:, 0] * following[:, 1] - ring[:, 1] * following[:, 0]))
        forward = area < 0.0
        return Bound(sides[0], forward), Bound(sides[1], forward == same)

    def _lanelet(
        self,
        key: str,
        element: etree._Element,
        tags: dict[str, str],
        left: Bound,
        right: Bound,
        rules: dict[str, Rule],
    ) -> Lanelet | None:
        subtype = tags.get("subtype", "")
        if subtype not in LANE_TYPES:
            if subtype:
                known = ", ".join(LANE_TYPES)
                self._wrong(
                    element,
                    f"subtype of lanelet {key} must be one of {known}, got '{subtype[:40]}'",
                )
                return None
            self._note(element, "has no subtype, and is read as a road", f"lanelet {key}")
        kind = LANE_TYPES.get(subtype, "driving")
        if kind == "driving" and tags.get("participant:vehicle") == "no":
            kind = "restricted"
        elif kind == "driving" and tags.get("one_way") == "no":
            kind = "bidirectional"
        if kind != "crosswalk" and (crossing := _crossing(left.points, right.points)):
            x, y = crossing
            self._wrong(
                element,
                f"lanelet {key}: its bounds, ways {left.way.id} and {right.way.id}, must not "
                f"cross, and do at x={x:.2f} m, y={-y if self.left_hand else y:.2f} m",
            )
            return None
        named = [
            m.get("ref", "")
            for m in element.iterchildren("member")
            if m.get("role") == "regulatory_element"
        ]
        for ref in named:
            if ref not in rules:
                self._note(
                    element, "a regulatory element is not in the file", f"lanelet {key}, '{ref}'"
                )
        if any(m.get("role") == "centerline" for m in element.iterchildren("member")):
            self._note(element, "has a centerline of its own, which is not used", f"lanelet {key}")
        known_rules = tuple(ref for ref in named if ref in rules)
        texts = (
            [tags["speed_limit"]]
            if "speed_limit" in tags
            else [
                rule.tags.get("sign_type")
                or next((way.tags.get("subtype", "") for way in rule.ways.get("refers", ())), "")
                for rule in map(rules.__getitem__, known_rules)
                if rule.subtype == "speed_limit"
            ]
        )
        # CommonRoad's tool writes the number of its own scenarios, which is in m/s.
        unit = (
            "m/s"
            if "commonroad" in self.root.get("generator", "") and "speed_limit" not in tags
            else "km/h"
        )
        speed = None
        for text in texts:
            speed = _speed(text, unit)
            if speed is None:
                self._note(
                    element,
                    "has a speed limit that is not understood",
                    f"lanelet {key}, '{text[:40]}'",
                )
        return Lanelet(key, element.sourceline or 0, left, right, kind, speed, tags, known_rules)

    def _number(self, element: etree._Element, what: str, text: str, limit: float) -> float:
        try:
            value = float(text)
        except ValueError:
            value = math.nan
        if not abs(value) <= limit:
            self._wrong(element, f"{what} must be a number within ±{limit:g}, got '{text[:40]}'")
        return value

    def _wrong(self, element: etree._Element, problem: str) -> None:
        self.problems.append((element.sourceline or 0, problem))

    def _note(self, element: etree._Element, kind: str, what: str) -> None:
        self.notes.add(kind, element.sourceline or 0, f"{what}: {kind}")


def _speed(text: str, unit: str) -> float | None:
    """Return a speed limit [m/s]: "50", "50 km/h", "30mph", "de274-50"."""
    match = re.fullmatch(r"(?:\w*-)?(\d{1,3}(?:\.\d{1,20})?)\s?([a-z/]*)", text.strip().lower())
    word = SPEED_WORDS.get(match[2] or unit) if match else None
    return float(match[1]) * SPEED_UNITS[word] if match and word and float(match[1]) else None


def _drivable(tags: dict[str, str]) -> bool:
    return LANE_TYPES.get(tags.get("subtype", ""), "driving") == "driving"


def _drives_left(pairs: list[tuple[Bound, Bound]]) -> bool:
    """Return whether more lanelets have oncoming traffic beside them on their right than left."""
    places = np.array(
        [
            [sum(bound.points[k, axis] for bound in pair for k in (0, -1)) / 4.0 for axis in (0, 1)]
            + [
                sum(bound.points[-1, axis] - bound.points[0, axis] for bound in pair)
                for axis in (0, 1)
            ]
            for pair in pairs
        ]
    ).reshape(-1, 4)
    votes = 0
    for x, y, dx, dy in places:
        away, way = places[:, :2] - (x, y), places[:, 2:]
        sizes = np.sqrt(np.sum(way * way, axis=1) * (dx * dx + dy * dy))
        facing = (way @ (dx, dy) < -0.9 * sizes) & (np.sum(away * away, axis=1) < BESIDE**2)
        votes += int(np.sum(np.sign(dx * away[facing, 1] - dy * away[facing, 0])))
    return votes < 0


def _mirrored(way: Way) -> Way:
    return Way(way.id, way.line, way.nodes, way.points * (1.0, -1.0, 1.0), way.tags)


def _crossing(left: Float, right: Float) -> tuple[float, float] | None:
    """Return a place where two bounds cross each other, or one itself; not where they only meet."""
    for a, b in ((left, right), (left, left), (right, right)):
        p, q = a[:-1, None, :2], b[None, :-1, :2]
        u, v = (a[1:] - a[:-1])[:, None, :2], (b[1:] - b[:-1])[None, :, :2]
        w = q - p
        det = u[..., 0] * v[..., 1] - u[..., 1] * v[..., 0]
        with np.errstate(divide="ignore", invalid="ignore"):
            s = (w[..., 0] * v[..., 1] - w[..., 1] * v[..., 0]) / det
            t = (w[..., 0] * u[..., 1] - w[..., 1] * u[..., 0]) / det
        met = (s > 1e-6) & (s < 1 - 1e-6) & (t > 1e-6) & (t < 1 - 1e-6)
        if a is b:  # points drawn a little backwards are a jitter of the bound, and no loop
            size = elementary.hypot(u[:, 0, 0], u[:, 0, 1])
            run = np.cumsum(size) - size
            i, j = np.nonzero(met)
            loop = run[i] + s[i, j] * size[i] - run[j] - t[i, j] * size[j]
            met[i, j] = np.abs(loop) > LEAST_LOOP
        hits = np.argwhere(met)
        if len(hits):
            i, j = hits[0]
            where = a[i, :2] + s[i, j] * (a[i + 1] - a[i])[:2]
            return float(where[0]), float(where[1])
    return None


def centre_line(left: Float, right: Float) -> Float:
    """Return the line between two bounds that Lanelet2 has; ``(P, 3)`` float64 [m].

    It leads through the middles of straight connections of points of both bounds: on from one of
    them, the next point of the one or the other bound is taken, whichever is nearer to the opposite
    one, as long as neither the connection nor the line crosses a bound or leaves by an end.

    Source: lanelet2_core 1.2.3, documentation of ``Lanelet::centerline``; compared in
    tests/openx/lanelet2/test_centre_line.py.
    """
    sides = (left[:, :2], right[:, :2])
    found = [0.5 * (left[0] + right[0])]
    at = [int((left[0, :2] == right[0, :2]).all()), 0]
    ends = ((sides[1][0], sides[0][0]), (sides[0][-1], sides[1][-1]))

    def leaves(p: Float, q: Float) -> bool:
        if any(np.any(_meets(p, q, side) & np.any(side[:-1] != p, axis=1)) for side in sides):
            return True
        return any(bool(_meets(p, q, np.stack(end))[0]) and _side(*end, q) > 0.0 for end in ends)

    def crosses(p: Float, q: Float, side: Float) -> bool:
        touched = np.all(side[:-1] == q, axis=1) | np.all(side[1:] == q, axis=1)
        return bool(np.any(_meets(p, q, side) & ~touched))

    while True:
        best: tuple[float, int, int] | None = None
        for k in (0, 1):
            here, opposite = sides[k], sides[1 - k][at[1 - k]]
            ahead = here[at[k] + 1 :]
            away = np.sqrt(np.sum((ahead - opposite) ** 2, axis=1))
            for n in np.argsort(away, kind="stable"):
                if best is not None and away[n] >= best[0]:
                    break
                if not (
                    leaves(found[-1][:2], 0.5 * (ahead[n] + opposite))
                    or crosses(opposite, ahead[n], here)
                    or crosses(ahead[n], opposite, sides[1 - k])
                ):
                    best = float(away[n]), k, at[k] + 1 + int(n)
                    break
        if best is None:
            break
        at[best[1]] = best[2]
        found.append(0.5 * (left[at[0]] + right[at[1]]))
    if at != [len(left) - 1, len(right) - 1]:
        found.append(0.5 * (left[-1] + right[-1]))
    return np.array(found)


def _side(a: Float, b: Float, p: Float) -> float:
    return float((b[0] - a[0]) * (p[1] - a[1]) - (b[1] - a[1]) * (p[0] - a[0]))


def _meets(p: Float, q: Float, line: Float) -> Bool:
    """Return which pieces of a line touch or cross a segment; ``(P - 1,)``."""
    ways, d = line[1:] - line[:-1], q - p
    a = d[0] * (line[:, 1] - p[1]) - d[1] * (line[:, 0] - p[0])
    b = ways[:, 0] * (p[1] - line[:-1, 1]) - ways[:, 1] * (p[0] - line[:-1, 0])
    c = ways[:, 0] * (q[1] - line[:-1, 1]) - ways[:, 1] * (q[0] - line[:-1, 0])
    met = (a[:-1] * a[1:] <= 0.0) & (b * c <= 0.0)
    flat = (a[:-1] == 0.0) & (a[1:] == 0.0)
    if np.any(flat & met):  # on one line: they meet where their extents do
        low, high = np.minimum(line[:-1], line[1:]), np.maximum(line[:-1], line[1:])
        met &= ~flat | np.all((low <= np.maximum(p, q)) & (high >= np.minimum(p, q)), axis=1)
    return np.asarray(met)


def transverse_mercator(lat: Float, lon: Float, lon_0: float, scale: float) -> tuple[Float, Float]:
    """Return x and y [m] of latitudes and longitudes [°] of WGS 84; ``(P,)`` float64 each.

    Source: Karney 2011, "Transverse Mercator with an accuracy of a few nanometers", eqs. 7-12, 35.
    """
    a, f = 6378137.0, 1.0 / 298.257223563
    n, e = f / (2.0 - f), math.sqrt(f * (2.0 - f))
    sin = elementary.sin(np.radians(lat))
    cos, away = elementary.cos(np.radians(lat)), np.radians(lon - lon_0)
    tau = sin / cos
    sigma = _sinh(0.5 * e * elementary.log((1.0 + e * sin) / (1.0 - e * sin)))
    tau = tau * np.sqrt(1.0 + sigma * sigma) - sigma * np.sqrt(1.0 + tau * tau)
    xi = elementary.atan2(tau, elementary.cos(away))
    sine = elementary.sin(away) / np.hypot(tau, elementary.cos(away))
    eta = elementary.log(np.abs(sine) + np.sqrt(1.0 + sine * sine)) * np.sign(sine)
    alphas = (
        n * (1 / 2 + n * (-2 / 3 + n * (5 / 16 + n * 41 / 180))),
        n**2 * (13 / 48 + n * (-3 / 5 + n * 557 / 1440)),
        n**3 * (61 / 240 - n * 103 / 140),
        n**4 * 49561 / 161280,
    )
    x, y = eta, xi
    for j, alpha in enumerate(alphas, start=1):
        grow = 0.5 * (elementary.exp(2 * j * eta) + elementary.exp(-2 * j * eta))
        x = x + alpha * elementary.cos(2 * j * xi) * _sinh(2 * j * eta)
        y = y + alpha * elementary.sin(2 * j * xi) * grow
    radius = scale * a / (1.0 + n) * (1.0 + n**2 / 4.0 + n**4 / 64.0)
    return radius * x, radius * y


def _sinh(x: Float) -> Float:
    return 0.5 * (elementary.exp(x) - elementary.exp(-x))
