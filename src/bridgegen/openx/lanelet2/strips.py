"""Roads in the plane: reference lines of arcs through the ends that roads share, lanes beside them.

Where roads meet, all of them begin or end on one `Cut`, with one heading and the same borders, so
that lanes meet without gap or kink. The reference line is smooth; what a bound does beside it, its
borders follow as cubics.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, field
from typing import TypeVar

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.openx.lanelet2.read import Lanelet, Way
from bridgegen.openx.opendrive.geometry import along_arc
from bridgegen.openx.opendrive.plan_view import Arc, Cubic, Geometry, Line

STEP = 0.05  # m, between two points of a border that its cubics are held against
AT_ONCE = 4096  # points that are projected at once
MANY = 2**23  # pairs of a point and an arc, up to which each is looked at
TOLERANCE = 0.005  # m, of a border's cubics
LEAST_CUBIC = 0.05  # m, length of the shortest of them
SMOOTH = 2.0  # m to both sides, over which a reference line is smoothed
LONGEST = 12.0  # m, between two nodes of a reference line
CLOSEST = 2.0  # m, likewise
TURN = 0.25  # rad, between them
END = 3.0  # m, over which the direction of a lanelet's end is taken


C = TypeVar("C", bound=Cubic)
Key = int | tuple[int, ...]
"""What begins or ends on a cut: a bound, by its node there; a centre line, by those beside it."""


@dataclass(frozen=True, eq=False)
class Cut:
    """The line across on which roads meet.

    Attributes:
        at: the t [m] of bounds and centre lines on it, in the direction of its heading.
    """

    x: float
    y: float
    h: float
    at: dict[Key, float]

    def turned(self) -> "Cut":
        """Return the same line, seen in the other direction."""
        return Cut(self.x, self.y, self.h + math.pi, {node: -t for node, t in self.at.items()})


@dataclass(frozen=True, eq=False)
class Border:
    """A line between lanes, in the direction of its road.

    Attributes:
        points: ``(P, 3)`` float64 [m].
        ends: the nodes at which it begins and ends.
        way: the way that it is, or the first of them.
    """

    points: Float
    ends: tuple[int, int]
    way: Way


@dataclass(frozen=True, eq=False)
class Strip:
    """A road to be: lanelets side by side, or one after the other in a junction.

    Attributes:
        lanes: from left to right: the lanelets one after the other, and whether they run along.
        centre: how many of the lanes lie left of the centre.
    """

    id: str
    lanes: tuple[tuple[tuple[Lanelet, ...], bool], ...]
    junction: int | None = None

    @property
    def centre(self) -> int:
        """How many of the lanes lie left of the centre: those that run against the road."""
        return sum(not along for _, along in self.lanes)

    def lane_id(self, index: int) -> int:
        """Return OpenDRIVE's id of a lane, counted from the left."""
        return self.centre - index - (index >= self.centre)

    def edge(self, index: int, contact: str) -> tuple[int, int]:
        """Return the left and the right node, in its own direction, of a lane at an end."""
        lanelets, along = self.lanes[index]
        return lanelets[0].start if along == (contact == "start") else lanelets[-1].end

    def key(self, index: int, contact: str) -> Key:
        """Return what a cut knows a lane's centre line by."""
        return tuple(sorted(self.edge(index, contact)))

    def centres(self) -> list[Float]:
        """Return the lanes' centre lines in the road's direction; ``(P, 3)`` float64 [m] each."""
        lines = [np.concatenate([item.centre for item in lanelets]) for lanelets, _ in self.lanes]
        return [
            line if along else line[::-1]
            for line, (_, along) in zip(lines, self.lanes, strict=True)
        ]

    def borders(self) -> list[Border]:
        """Return the lines between and beside the lanes, from left to right."""
        found = [self._border(0, left=True)]
        return found + [self._border(index, left=False) for index in range(len(self.lanes))]

    def _border(self, index: int, *, left: bool) -> Border:
        lanelets, along = self.lanes[index]
        bounds = [item.left if left == along else item.right for item in lanelets]
        points = np.concatenate([bound.points for bound in bounds])
        ends = (bounds[0].nodes[0], bounds[-1].nodes[-1])
        return Border(
            points if along else points[::-1], ends if along else ends[::-1], bounds[0].way
        )


def cut_of(ends: Sequence[tuple[Lanelet, bool, bool]], lines: Sequence[tuple[Key, Float]]) -> Cut:
    """Return the line on which the ends of lanelets meet.

    Args:
        ends: a lanelet, whether it starts there, and whether it is in a junction.
        lines: the bounds and centre lines that lead away from there.
    """
    x, y = np.mean([line[0, :2] for line in dict(lines).values()], axis=0)
    directions = []
    for lanelet, starts, inside in ends:
        line = lanelet.centre[:, :2] if starts else lanelet.centre[::-1, :2]
        ahead = _along(line, np.array([min(END, float(_stations(line)[-1]))]))[0] - line[0]
        # Not made a unit: what is too short to have a direction hardly counts.
        directions.append((ahead if starts else -ahead, inside))
    outside = [way for way, inside in directions if not inside]
    stems = outside or [way for way, _ in directions]
    way = sum(item if item @ stems[0] >= 0.0 else -item for item in stems)
    # Of the ways through a junction the straightest one says where a bend leads on to.
    if outside:
        through = [item if item @ way >= 0.0 else -item for item, inside in directions if inside]
        cosines = [
            float(item @ way) / math.sqrt(float(item @ item) * float(way @ way)) for item in through
        ]
        if through and max(cosines) > 0.98:
            way = way + len(outside) * through[cosines.index(max(cosines))]
    h = elementary.atan2(float(way[1]), float(way[0]))
    along = np.array([elementary.cos(h), elementary.sin(h)])
    across = np.array([-along[1], along[0]])
    at: dict[Key, float] = {}
    off: dict[Key, float] = {}
    for node, line in lines:
        local = line[:, :2] - (x, y)
        a, t = local @ along, local @ across
        straight = float(t[0])
        at.setdefault(node, straight)
        # A node before or beyond the line: the bound that crosses it says where.
        if abs(a[0]) > 1e-3:
            crossed = np.nonzero(
                (a[1:] * a[0] <= 0.0)
                & (_stations(line)[1:] < 4.0 * abs(a[0]) + 1.0 + _stations(line)[1])
            )[0]
            if len(crossed):
                k = int(crossed[0])
                met = float(t[k] + (t[k + 1] - t[k]) * a[k] / (a[k] - a[k + 1]))
                if abs(met - straight) < off.get(node, math.inf):
                    at[node], off[node] = met, abs(met - straight)
    return Cut(float(x), float(y), h, at)


@dataclass(frozen=True, eq=False)
class Shape:
    """The shape of a road.

    Attributes:
        plan_view: its reference line.
        length: [m].
        stations: where its cubics begin, and its end; ``(S,)`` float64 [m].
        values: of its borders there, from left to right; ``(B, S)`` float64 [m].
        slopes: likewise.
        heights: ``(H, 2)`` float64: s and height [m] along the road.
        stretch: the least of 1 − curvature · t; below 0 the lanes fold.
    """

    plan_view: tuple[Geometry, ...]
    length: float
    stations: Float
    values: Float
    slopes: Float
    heights: Float
    stretch: float
    arcs: Float = field(repr=False)

    def project(self, points: Float) -> tuple[Float, Float]:
        """Return the s and t [m] of points; ``(P,)`` float64 each."""
        return _project(self.arcs, points)

    def at(self, s: float) -> Float:
        """Return the t [m] of the borders at a place, from left to right; ``(B,)`` float64."""
        return np.array([np.interp(s, self.stations, row) for row in self.values])

    def cubics(
        self, values: Float, slopes: Float, kind: type[C], least: float = -math.inf
    ) -> list[C]:
        """Return a line beside the road by its values and slopes at the stations, ≥ ``least``."""
        found = []
        for k, (s, end) in enumerate(zip(self.stations[:-1], self.stations[1:], strict=True)):
            d, v0, v1 = float(end - s), float(values[k]), float(values[k + 1])
            # A cubic on [0, d] is nowhere below its two inner control points (Bernstein).
            b1 = max(v0 + d / 3.0 * float(slopes[k]), least)
            b2 = max(v1 - d / 3.0 * float(slopes[k + 1]), least)
            found.append(
                kind(
                    float(s),
                    v0,
                    3.0 * (b1 - v0) / d,
                    3.0 * (v0 - 2.0 * b1 + b2) / d**2,
                    (v1 - v0 + 3.0 * (b1 - b2)) / d**3,
                )
            )
        return found


def shape(strip: Strip, start: Cut, end: Cut) -> Shape:
    """Return the shape of a road between two cuts, both in its direction."""
    borders = strip.borders()
    # In the middle: beside a line at one of the sides, lanes fold in bends that are tight enough.
    shares = np.linspace(0.0, 1.0, max(5, math.ceil(_stations(borders[0].points)[-1])))
    sides = [
        _along(line.points, shares * _stations(line.points)[-1])
        for line in (borders[0], borders[-1])
    ]
    zero = [
        0.5 * (cut.at[borders[0].ends[k]] + cut.at[borders[-1].ends[k]])
        for k, cut in enumerate((start, end))
    ]
    arcs = _arcs(
        _nodes(
            0.5 * (sides[0] + sides[1])[:, :2], _on(start, zero[0]), _on(end, zero[1]), start, end
        )
    )
    starts = np.concatenate(([0.0], np.cumsum(arcs[:, 4])))
    length = float(starts[-1])
    count = max(math.ceil(length / STEP), 4)
    grid = np.linspace(0.0, length, count + 1)
    heights = np.zeros(count + 1)

    def beside(points: Float, first: float, last: float) -> Float:
        close = dense(points, STEP)
        s, across = _project(arcs, close[:, :2])
        s = np.maximum.accumulate(s)
        inside = (s > 1e-6) & (s < length - 1e-6)
        heights[:] += np.interp(grid, s, close[:, 2]) / (2 * len(borders) - 1)
        s = np.concatenate(([0.0], s[inside], [length]))
        return np.interp(grid, s, np.concatenate(([first], across[inside], [last])))

    t = np.array(
        [
            beside(line.points, start.at[line.ends[0]] - zero[0], end.at[line.ends[1]] - zero[1])
            for line in borders
        ]
    )
    centres = [
        beside(
            line, start.at[strip.key(k, "start")] - zero[0], end.at[strip.key(k, "end")] - zero[1]
        )
        for k, line in enumerate(strip.centres())
    ]
    # The borders of lanes are their bounds as nearly as their centres are where Lanelet2 has them:
    # t[k] = 2 · centre[k - 1] − t[k - 1] leaves one line free, which is fitted.
    fixed = [np.zeros(count + 1)]
    for line in centres:
        fixed.append(2.0 * line - fixed[-1])
    signs = np.array([(-1.0) ** k for k in range(len(borders))])[:, None]
    t = np.array(fixed) + signs * np.mean(signs * (t - np.array(fixed)), axis=0)
    for k in range(strip.centre + 1, len(borders)):
        t[k] = np.minimum(t[k], t[k - 1])
    for k in range(strip.centre - 1, -1, -1):
        t[k] = np.maximum(t[k], t[k + 1])
    window = max(1, min(round(0.5 * LEAST_CUBIC / STEP), count // 4))
    padded = np.pad(t, ((0, 0), (window, window)), mode="edge")
    spread = np.minimum(np.arange(count + 1) + window, count) - np.maximum(
        np.arange(count + 1) - window, 0
    )
    slopes = (padded[:, 2 * window :] - padded[:, : count + 1]) / (spread * (length / count))
    slopes[:, [0, -1]] = 0.0
    kept = _knots(t, slopes, length / count)
    up = _kept_heights(grid, heights)
    bend = np.repeat(arcs[:, 3], 2)
    at = np.clip(
        np.searchsorted(grid, np.stack((starts[:-1], starts[1:]), axis=1).reshape(-1)), 0, count
    )
    stretch = float(np.min(1.0 - bend * t[:, at])) if len(bend) else 1.0
    plan = tuple(
        Geometry(float(s), float(x), float(y), float(h), float(d), Arc(float(k)) if k else Line())
        for s, (x, y, h, k, d) in zip(starts, arcs, strict=False)
    )
    return Shape(plan, length, grid[kept], t[:, kept], slopes[:, kept], up, stretch, arcs)


def _on(cut: Cut, t: float) -> Float:
    return np.array([cut.x - t * elementary.sin(cut.h), cut.y + t * elementary.cos(cut.h)])


def _nodes(line: Float, first: Float, last: Float, start: Cut, end: Cut) -> Float:
    """Return the nodes of a reference line; ``(N, 3)``: x, y [m], heading [rad]."""
    fore = np.array([elementary.cos(start.h), elementary.sin(start.h)])
    aft = np.array([elementary.cos(end.h), elementary.sin(end.h)])
    line = dense(line, 0.5)
    ahead, behind = (line - first) @ fore > 0.25, (line - last) @ aft < -0.25
    low = int(np.argmax(ahead)) if ahead.any() else len(line)
    high = len(line) - int(np.argmax(behind[::-1])) if behind.any() else 0
    inner = line[low:high] if low < high else line[:0]
    line = dense(np.concatenate((first[None], inner, last[None])), 0.5)
    # Bounds jitter: a moving average leaves their course; their borders follow the rest.
    reach = round(SMOOTH / 0.5)
    total = np.cumsum(np.concatenate((np.zeros((1, 2)), line)), axis=0)
    index = np.arange(len(line))
    half = np.minimum(np.minimum(index, len(line) - 1 - index), reach)[:, None]
    line = (total[(index + half[:, 0] + 1)] - total[index - half[:, 0]]) / (2 * half + 1)
    steps = np.diff(line, axis=0)
    size = np.sqrt(np.sum(steps * steps, axis=1))
    heading = elementary.atan2(steps[:, 1], steps[:, 0])
    turned = np.abs(
        np.remainder(np.diff(np.concatenate(([start.h], heading))) + math.pi, math.tau) - math.pi
    )
    weight = np.concatenate(
        ([0.0], np.cumsum(size / LONGEST + np.minimum(turned / TURN, size / CLOSEST)))
    )
    count = max(1, math.ceil(float(weight[-1]) - 0.25))
    wanted = np.linspace(0.0, float(weight[-1]), count + 1)
    points = np.stack([np.interp(wanted, weight, line[:, k]) for k in (0, 1)], axis=1)
    points[0], points[-1] = first, last
    chords = np.diff(points, axis=0)
    sizes = np.sqrt(np.sum(chords * chords, axis=1))
    ways = elementary.atan2(chords[:, 1], chords[:, 0])
    headings = np.empty(count + 1)
    headings[0], headings[-1] = start.h, end.h
    for k in range(1, count):
        turn = math.remainder(float(ways[k] - ways[k - 1]), math.tau)
        headings[k] = ways[k - 1] + turn * sizes[k - 1] / (sizes[k - 1] + sizes[k])
    return np.concatenate((points, headings[:, None]), axis=1)


def _arcs(nodes: Float) -> Float:
    """Return two arcs between each two nodes; ``(A, 5)``: x, y, heading, curvature, length."""
    found: list[tuple[float, float, float, float, float]] = []
    for (x0, y0, h0), (x1, y1, h1) in zip(nodes[:-1].tolist(), nodes[1:].tolist(), strict=True):
        vx, vy = x1 - x0, y1 - y0
        c0, s0, c1, s1 = (
            elementary.cos(h0),
            elementary.sin(h0),
            elementary.cos(h1),
            elementary.sin(h1),
        )
        square, both = vx * vx + vy * vy, vx * (c0 + c1) + vy * (s0 + s1)
        # Tangents of the same length d: |v|² − 2 d v·(t0 + t1) − 2 d² (1 − t0·t1) = 0.
        q = 2.0 * (1.0 - (c0 * c1 + s0 * s1))
        root = math.sqrt(max(both * both + q * square, 0.0))
        d = square / (both + root) if both + root > 1e-9 else 0.5 * math.sqrt(square)
        mx, my = 0.5 * (x0 + x1 + d * (c0 - c1)), 0.5 * (y0 + y1 + d * (s0 - s1))
        x, y, h = x0, y0, h0
        for tx, ty in ((mx, my), (x1, y1)):
            chord = math.sqrt((tx - x) ** 2 + (ty - y) ** 2)
            if chord < 1e-6:
                continue
            half = math.remainder(elementary.atan2(ty - y, tx - x) - h, math.tau)
            sine = elementary.sin(half)
            curvature = 2.0 * sine / chord if abs(half) > 1e-7 else 0.0
            length = chord * half / sine if curvature else chord
            if found and not curvature and not found[-1][3] and abs(h - found[-1][2]) < 1e-7:
                found[-1] = (*found[-1][:4], found[-1][4] + length)  # one line, and not two
            else:
                found.append((x, y, h, curvature, length))
            x, y, h = along_arc(x, y, h, curvature, length)
            x, y = tx, ty
    return np.array(found).reshape(-1, 5)


def _project(arcs: Float, points: Float) -> tuple[Float, Float]:
    """Return s and t of points beside arcs, before the start and beyond the end, too."""
    starts = np.concatenate(([0.0], np.cumsum(arcs[:, 4])))[:-1]
    every = np.arange(len(arcs))
    # A lane of kilometres has 100,000 points and some hundred arcs: gigabytes, and minutes.
    is_long = len(points) * len(arcs) > MANY
    found = []
    for k in range(0, len(points), AT_ONCE):
        some = points[k : k + AT_ONCE]
        near = _near(arcs, some) if is_long else every
        found.append(_beside(arcs[near], starts[near], near == 0, near == every[-1], some))
    s, t = (np.concatenate(parts) for parts in zip(*found, strict=True))
    return s, t


def _near(arcs: Float, points: Float) -> Int:
    """Return which arcs may be the nearest one of some of the points."""
    middle = 0.5 * (points.min(axis=0) + points.max(axis=0))
    radius = float(np.max(np.sqrt(np.sum((points - middle) ** 2, axis=1))))
    away = np.sqrt(np.sum((arcs[:, :2] - middle) ** 2, axis=1))
    return np.flatnonzero(away - arcs[:, 4] <= away.min() + 2.0 * radius)


def _beside(
    arcs: Float, starts: Float, first: Bool, last: Bool, points: Float
) -> tuple[Float, Float]:
    """Return s and t of points beside arcs that start at ``starts``; see `_project`."""
    x, y, h, curvature, length = arcs.T
    c, s = elementary.cos(h), elementary.sin(h)
    dx, dy = points[:, 0, None] - x, points[:, 1, None] - y
    along, across = dx * c + dy * s, dy * c - dx * s
    bent = curvature != 0.0
    k = np.where(bent, curvature, 1.0)
    # From the arc's centre, at the angle that the arc has turned by.
    radial = np.sqrt(along * along + (across - 1.0 / k) ** 2)
    u = np.where(
        bent, elementary.atan2(along * np.sign(k), np.sign(k) * (1.0 / k - across)) / k, along
    )
    t = np.where(bent, 1.0 / k - np.sign(k) * radial, across)
    over = np.where(u < 0.0, -u, np.maximum(u - length, 0.0)) * np.where(
        bent, np.minimum(1.0, np.abs(k) * radial), 1.0
    )
    which = np.argmin(over * over + t * t, axis=1)
    row = np.arange(len(points))
    inner = np.clip(
        u[row, which],
        np.where(first[which], -np.inf, 0.0),
        np.where(last[which], np.inf, length[which]),
    )
    return starts[which] + inner, t[row, which]


def _knots(values: Float, slopes: Float, step: float) -> list[int]:
    """Return which points of a grid cubics between them suffice for: each reaches far."""
    last, kept = values.shape[1] - 1, [0]
    least = max(1, round(LEAST_CUBIC / step))

    def fits(i: int, j: int) -> bool:
        u, d = np.arange(j - i + 1) / (j - i), (j - i) * step
        fit = np.outer(values[:, i], (1 + 2 * u) * (1 - u) ** 2)
        fit += np.outer(values[:, j], u**2 * (3 - 2 * u))
        fit += np.outer(d * slopes[:, i], u * (1 - u) ** 2)
        fit += np.outer(d * slopes[:, j], u**2 * (u - 1))
        return bool(np.max(np.abs(fit - values[:, i : j + 1])) <= TOLERANCE)

    while (i := kept[-1]) < last:
        good, bad = min(least, last - i), last - i + 1
        while good * 2 < bad and fits(i, i + good * 2):
            good *= 2
        bad = min(bad, good * 2)
        while bad - good > 1:
            middle = (good + bad) // 2
            good, bad = (middle, bad) if fits(i, i + middle) else (good, middle)
        kept.append(i + good)
    return kept


def _kept_heights(s: Float, heights: Float) -> Float:
    """Return the points of a line of heights between which it is straight within 2 cm."""
    kept, stack = {0, len(s) - 1}, [(0, len(s) - 1)]
    while stack:
        i, j = stack.pop()
        line = heights[i] + (heights[j] - heights[i]) * (s[i : j + 1] - s[i]) / (s[j] - s[i])
        k = i + int(np.argmax(np.abs(line - heights[i : j + 1])))
        if abs(float(line[k - i] - heights[k])) > 0.02:
            kept.add(k)
            stack += [(i, k), (k, j)]
    order = sorted(kept)
    return np.stack((s[order], heights[order]), axis=1)


def _stations(points: Float) -> Float:
    steps = np.diff(points[:, :2], axis=0)
    return np.concatenate(([0.0], np.cumsum(np.sqrt(np.sum(steps * steps, axis=1)))))


def _along(points: Float, s: Float) -> Float:
    stations = _stations(points)
    return np.stack([np.interp(s, stations, points[:, k]) for k in range(points.shape[1])], axis=1)


def dense(points: Float, step: float) -> Float:
    """Return a line with its own points and others between them, ``step`` [m] apart or less."""
    stations = _stations(points)
    more = np.linspace(0.0, float(stations[-1]), max(2, math.ceil(float(stations[-1]) / step) + 1))
    return _along(points, np.unique(np.concatenate((stations, more))))
