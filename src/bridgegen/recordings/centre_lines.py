"""Lanelets of maps that give lanes as centre lines, as those of motion data sets do.

Centre lines of neighbours begin and end anywhere along each other. They are cut where a neighbour
begins or ends, so that lanelets side by side are of the same length; the bounds of each are at the
borders that its map names, else half way to the nearest parallel centre line or at the nearest
parallel line or edge of the road, whichever is nearer.
"""

import itertools
from collections import deque
from collections.abc import Mapping, Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from bridgegen.arrays import Float
from bridgegen.errors import FileFormatError
from bridgegen.recordings.lanelets import Lanelet
from bridgegen.recordings.table import FARTHEST

STEP = 1.0
"""Between points of centre lines [m]; half of it between points of the road's lines."""
NARROWEST, WIDEST = 2.5, 4.5
"""Widths that a lane may get [m]."""
USUAL = 3.5
"""Width where nothing says more [m]."""
NEIGHBOURS = (2.0, 6.0)
"""Distance of the centre lines of lanes side by side [m]."""
NEAREST_LINE = 0.5  # m
PARALLEL = np.cos(np.radians(30.0))
SAME_PLACE = 3.0
"""How far the ends of neighbours may be apart along the lanes [m]."""
JOINED = 1.0
"""How far a centre line may begin from where another one ends, to follow it [m]."""
MOST_POINTS = 1_000_000
MOST_PAIRS = 20_000_000
"""Of points within reach of each other."""
SHORTEST = 0.5  # m


@dataclass(frozen=True, eq=False)
class CentreLine:
    """A lane as its centre line, in the direction of travel.

    Attributes:
        name: the recording's own.
        points: ``(n, 2)`` [m].
        borders: names of the lines at its borders.
        outline: ``(n, 2)`` around it [m], if the map has one.
        successors: names of those that it leads to; None where the map does not say.
        kinds: what it is for, in the words of `Lanelet`.
    """

    name: str
    points: Float
    borders: tuple[str, ...] = ()
    outline: Float | None = None
    successors: tuple[str, ...] | None = None
    kinds: tuple[str, ...] = ()


def lanelets_of_centre_lines(
    lines: Sequence[CentreLine], road: Mapping[str, Float], place: str
) -> tuple[tuple[Lanelet, ...], tuple[str, ...]]:
    """Return the lanelets of centre lines, and what was assumed.

    Args:
        lines: the lanes.
        road: by name, ``(n, 2)`` each [m], the lines and edges of the road.
        place: the file, for messages.

    Raises:
        FileFormatError: the map is too large, or a point is no number.
    """
    used = [one for one in lines if _length(one.points, place, one.name) > SHORTEST]
    if not used:
        return (), ()
    edges = [(name, points) for name, points in road.items() if _length(points, place, name) > 0.0]
    outlines = [
        (f"outline {k}", one.outline)
        for k, one in enumerate(used)
        if one.outline is not None and _length(one.outline, place, one.name) > 0.0
    ]
    total = sum(_length(one, place, "") for _, one in (*edges, *outlines))
    total += sum(_length(one.points, place, "") for one in used)
    if total > MOST_POINTS * STEP:
        raise FileFormatError(
            f"{place}: a map's lines may have {MOST_POINTS * STEP / 1000:,.0f} km in all, got "
            f"{total / 1000:,.0f}"
        )
    field = _Field(used, edges, outlines, place)
    pieces = _pieces(field)
    widths, measured = _half_widths(field)
    lanelets = _linked(field, used, pieces, widths)
    notes = [
        f"lanes are those of the map's {len(used)} centre lines; borders: {measured[0]:.0%} as "
        f"named, {measured[1]:.0%} by lines and lanes beside them, the rest {USUAL / 2:g} m away"
    ]
    return lanelets, tuple(notes)


def _length(points: Float, place: str, name: str) -> float:
    if not (np.abs(points) <= FARTHEST).all():
        raise FileFormatError(f"{place}: x and y [m] of '{name[:40]}' must be within ±{FARTHEST:g}")
    return float(np.hypot(*np.diff(points, axis=0).T).sum()) if len(points) > 1 else 0.0


def _resampled(points: Float, step: float) -> Float:
    """Return points of a line, a step apart at most [m], its ends included."""
    steps = np.hypot(*np.diff(points, axis=0).T)
    keep = np.concatenate([[True], steps > 1e-6])
    points = points[keep]
    station = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(points, axis=0).T))])
    at = np.linspace(0.0, station[-1], int(np.ceil(station[-1] / step)) + 1)
    return np.column_stack([np.interp(at, station, points[:, k]) for k in (0, 1)])


def _directions(points: Float) -> Float:
    steps = np.gradient(points, axis=0)
    return steps / np.maximum(np.hypot(steps[:, 0], steps[:, 1]), 1e-12)[:, None]


class _Field:
    """The points of all lines, and which of them are beside each other.

    Attributes:
        first: ``(L + 1,)`` the points of centre line l are ``first[l]:first[l + 1]``.
        points: ``(n, 2)`` of all lines, those of centre lines first [m].
        along: ``(n, 2)`` their directions.
        line: ``(n,)`` the line of each.
        centres: the number of points of centre lines.
        near: ``(k, 2)`` pairs of a centre line's point and one of another line beside it.
        left: ``(k,)`` distance to the left of the former [m].
        course: ``(k,)`` cosine of the angle between them.
        named: ``(k,)`` whether the other is a border that the map names.
    """

    def __init__(
        self, lines: Sequence[CentreLine], edges: Sequence[tuple[str, Float]],
        outlines: Sequence[tuple[str, Float]], place: str,
    ) -> None:  # fmt: skip
        parts = [_resampled(one.points, STEP) for one in lines]
        counts = [len(one) for one in parts]
        self.first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        self.centres = int(self.first[-1])
        parts += [_resampled(one, STEP / 2) for _, one in (*edges, *outlines)]
        self.points = np.concatenate(parts)
        self.along = np.concatenate([_directions(one) for one in parts])
        self.line = np.repeat(np.arange(len(parts)), [len(one) for one in parts])
        others, own = cKDTree(self.points), self.points[: self.centres]
        reach = NEIGHBOURS[1] + STEP
        pairs = int(cKDTree(own).count_neighbors(others, reach))
        if pairs > MOST_PAIRS:
            raise FileFormatError(f"{place}: too many lines of the map lie upon each other")
        found: list[list[int]] = list(others.query_ball_point(own, reach))  # type: ignore[arg-type]
        p = np.repeat(np.arange(self.centres), [len(one) for one in found])
        q = np.fromiter(itertools.chain.from_iterable(found), dtype=np.int64, count=len(p))
        apart = self.line[p] != self.line[q]
        p, q = p[apart], q[apart]
        step = self.points[q] - self.points[p]
        ahead = (step * self.along[p]).sum(axis=1)
        course = (self.along[q] * self.along[p]).sum(axis=1)
        beside = (np.abs(ahead) <= STEP) & (np.abs(course) >= PARALLEL)
        self.near = np.column_stack([p, q])[beside]
        step, along = step[beside], self.along[p[beside]]
        self.left = along[:, 0] * step[:, 1] - along[:, 1] * step[:, 0]
        self.course = course[beside]
        number = {name: len(lines) + k for k, (name, _) in enumerate((*edges, *outlines))}
        allowed = [
            (k, number[name])
            for k, one in enumerate(lines)
            for name in (*one.borders, f"outline {k}")
            if name in number
        ]
        count = len(parts)
        keys = np.array([k * count + name for k, name in allowed], dtype=np.int64)
        a, b = self.line[self.near[:, 0]], self.line[self.near[:, 1]]
        self.named = np.isin(a * count + b, keys)
        if outlines:  # that of another lane is none of the road's lines
            keep = self.named | (b < len(lines) + len(edges))
            self.near, self.left = self.near[keep], self.left[keep]
            self.course, self.named = self.course[keep], self.named[keep]


def _half_widths(field: _Field) -> tuple[Float, tuple[float, float]]:
    """Return how far the bounds are, ``(2, centres)`` left and right [m]; and measured shares."""
    found = np.full((2, field.centres), np.inf)
    named = np.full((2, field.centres), np.inf)
    p, q = field.near.T
    away = np.abs(field.left)
    side = (field.left < 0.0).astype(np.int64)
    is_lane = q < field.centres
    is_line = ~is_lane & (away >= NEAREST_LINE)
    is_lane &= (away >= NEIGHBOURS[0]) & (away <= NEIGHBOURS[1])
    for mask, scale in ((is_lane, 0.5), (is_line, 1.0)):
        np.minimum.at(found, (side[mask], p[mask]), scale * away[mask])
    mask = is_line & field.named
    np.minimum.at(named, (side[mask], p[mask]), away[mask])
    has_name, has_other = np.isfinite(named), np.isfinite(found)
    half = np.where(has_name, named, np.where(has_other, found, np.nan))
    for k in range(2):
        for begin, end in itertools.pairwise(field.first.tolist()):
            half[k, begin:end] = _completed(half[k, begin:end])
    share = float(has_name.mean())
    return (
        np.clip(half, NARROWEST / 2, WIDEST / 2),
        (share, float((has_name | has_other).mean()) - share),
    )


def _completed(values: Float) -> Float:
    """Return a side's distances, linear between those that are known, without single jumps."""
    known = np.flatnonzero(np.isfinite(values))
    if not len(known):
        return np.full(len(values), USUAL / 2)
    whole: Float = np.interp(np.arange(len(values)), known, values[known])
    padded = np.pad(whole, 2, mode="edge")
    return np.median([padded[k : k + len(whole)] for k in range(5)], axis=0)


def _pieces(field: _Field) -> list[list[int]]:
    """Return where each centre line is cut, as numbers of points, its ends included."""
    away = np.abs(field.left)
    p, q = field.near.T
    lanes = (q < field.centres) & (field.course > 0.0)
    lanes &= (away >= NEIGHBOURS[0]) & (away <= NEIGHBOURS[1])
    p, q = p[lanes], q[lanes]
    begin = np.searchsorted(p, np.arange(field.centres + 1))
    cuts = [[a, b - 1] for a, b in itertools.pairwise(field.first.tolist())]
    waiting = deque(itertools.chain.from_iterable(cuts))
    least = int(np.ceil(SAME_PLACE / STEP))
    while waiting:
        at = waiting.popleft()
        beside = q[begin[at] : begin[at + 1]]
        ahead = ((field.points[beside] - field.points[at]) * field.along[at]).sum(axis=1)
        for other in beside[np.argsort(np.abs(ahead), kind="stable")].tolist():
            there = cuts[int(field.line[other])]
            if min(abs(other - cut) for cut in there) >= least:
                there.append(other)
                waiting.append(other)
    return [sorted(one) for one in cuts]


def _linked(
    field: _Field, lines: Sequence[CentreLine], pieces: list[list[int]], half: Float
) -> tuple[Lanelet, ...]:
    spans = [
        (k, j, a, b)
        for k, cuts in enumerate(pieces)
        for j, (a, b) in enumerate(itertools.pairwise(cuts))
    ]
    names = [
        lines[k].name if len(pieces[k]) == 2 else f"{lines[k].name}#{j + 1}" for k, j, _, _ in spans
    ]
    first: dict[str, str] = {}
    for (k, _, _, _), name in zip(spans, names, strict=True):
        first.setdefault(lines[k].name, name)
    left, right, opposite = _beside(field, spans)
    follows = _followers(field, lines)
    lanelets = []
    for index, (k, j, a, b) in enumerate(spans):
        points, along = field.points[a : b + 1], field.along[a : b + 1]
        normal = np.column_stack([-along[:, 1], along[:, 0]])
        is_last = j == len(pieces[k]) - 2
        successors = (
            tuple(first[name] for name in follows[k] if name in first)
            if is_last
            else (names[index + 1],)
        )
        lanelets.append(Lanelet(
            name=names[index],
            left=points + half[0, a : b + 1, None] * normal,
            right=points - half[1, a : b + 1, None] * normal,
            left_same=_name(names, left[index]), right_same=_name(names, right[index]),
            left_opposite=_name(names, opposite[index]),
            successors=successors, kinds=lines[k].kinds,
        ))  # fmt: skip
    return tuple(lanelets)


def _name(names: list[str], index: int) -> str:
    return names[index] if index >= 0 else ""


def _beside(
    field: _Field, spans: list[tuple[int, int, int, int]]
) -> tuple[list[int], list[int], list[int]]:
    """Return the piece to the left of each, to its right, and to its left in the other direction.

    Both ends must be side by side, and each must be the nearest one of the other.
    """
    starts = np.array([a for _, _, a, _ in spans])
    ends = np.array([b for _, _, _, b in spans])
    kind: dict[tuple[str, int], tuple[float, int]] = {}
    tree = cKDTree(field.points[starts])
    last = cKDTree(field.points[ends])
    reach = float(np.hypot(NEIGHBOURS[1], SAME_PLACE))
    for i in range(len(spans)):
        a, b = starts[i], ends[i]
        for j in tree.query_ball_point(field.points[a], reach):
            if spans[j][0] != spans[i][0]:
                near = _abreast(field, a, starts[j]), _abreast(field, b, ends[j])
                _keep(kind, ("left", "right"), i, j, near)
        for j in last.query_ball_point(field.points[a], reach):
            near = _abreast(field, a, ends[j]), _abreast(field, b, starts[j])
            _keep(kind, ("opposite", ""), i, j, near)

    def mutual(name: str, back: str) -> list[int]:
        found = []
        for i in range(len(spans)):
            j = kind.get((name, i), (0.0, -1))[1]
            found.append(j if j >= 0 and kind.get((back, j), (0.0, -1))[1] == i else -1)
        return found

    return mutual("left", "right"), mutual("right", "left"), mutual("opposite", "opposite")


def _abreast(field: _Field, a: int, b: int) -> float:
    """Return how far one point is to the left of another [m]; 0 if they are not side by side."""
    step, along = field.points[b] - field.points[a], field.along[a]
    if abs(float(step @ along)) > SAME_PLACE or abs(float(field.along[b] @ along)) < PARALLEL:
        return 0.0
    left = float(along[0] * step[1] - along[1] * step[0])
    return left if NEIGHBOURS[0] <= abs(left) <= NEIGHBOURS[1] else 0.0


def _keep(
    kind: dict[tuple[str, int], tuple[float, int]], sides: tuple[str, str], i: int, j: int,
    near: tuple[float, float],
) -> None:  # fmt: skip
    if near[0] * near[1] <= 0.0:
        return
    side, away = sides[0] if near[0] > 0.0 else sides[1], abs(near[0] + near[1])
    if side and away < kind.get((side, i), (np.inf, -1))[0]:
        kind[side, i] = away, j


def _followers(field: _Field, lines: Sequence[CentreLine]) -> list[tuple[str, ...]]:
    """Return the names of those that each leads to: the map's, else those that begin at its end."""
    starts = field.first[:-1]
    tree = cKDTree(field.points[starts])
    found = []
    for k, one in enumerate(lines):
        if one.successors is not None:
            found.append(one.successors)
            continue
        end = int(field.first[k + 1]) - 1
        at = sorted(tree.query_ball_point(field.points[end], JOINED))
        found.append(tuple(
            lines[j].name for j in at
            if j != k and field.along[starts[j]] @ field.along[end] >= PARALLEL
        ))  # fmt: skip
    return found
