"""Centre lines and lines of the road: which are beside each other, and how far."""

import itertools
from collections import deque
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from scipy.spatial import cKDTree

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError

STEP = 1.0
"""Distance between points of centre lines [m]; half of it between points of the road's lines."""
NARROWEST, WIDEST = 2.5, 4.5
"""Least and greatest width that a lane may get [m]."""
USUAL = 3.5
"""Width of a lane where nothing says more [m]."""
NEIGHBOURS = (2.0, 6.0)
"""Distance of the centre lines of lanes side by side [m]."""
NEAREST_LINE = 0.5  # m
PARALLEL = np.cos(np.radians(30.0))
SAME_PLACE = 3.0
"""Largest distance between the ends of neighbouring lanes along them [m]."""
MOST_PAIRS = 20_000_000
"""Largest number of pairs of points within reach of each other."""


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


class LineField:
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
        self,
        lines: Sequence[CentreLine],
        edges: Sequence[tuple[str, Float]],
        outlines: Sequence[tuple[str, Float]],
        place: str,
    ) -> None:
        parts = [_resampled(line.points, STEP) for line in lines]
        counts = [len(part) for part in parts]
        self.first = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
        self.centres = int(self.first[-1])
        parts += [_resampled(edge, STEP / 2) for _, edge in (*edges, *outlines)]
        self.points = np.concatenate(parts)
        self.along = np.concatenate([_directions(part) for part in parts])
        self.line = np.repeat(np.arange(len(parts)), [len(part) for part in parts])
        others, own = cKDTree(self.points), self.points[: self.centres]
        reach = NEIGHBOURS[1] + STEP
        pairs = int(cKDTree(own).count_neighbors(others, reach))
        if pairs > MOST_PAIRS:
            raise FileFormatError(f"{place}: too many lines of the map lie upon each other")
        found: list[list[int]] = list(others.query_ball_point(own, reach))  # type: ignore[arg-type]
        p = np.repeat(np.arange(self.centres), [len(group) for group in found])
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
            for k, line in enumerate(lines)
            for name in (*line.borders, f"outline {k}")
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


def half_widths(field: LineField) -> tuple[Float, tuple[float, float]]:
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


def cuts_of(field: LineField) -> list[list[int]]:
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
    return [sorted(group) for group in cuts]


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
