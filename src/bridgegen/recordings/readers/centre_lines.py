"""Lanelets of maps that give lanes as centre lines, as those of motion data sets do.

Centre lines of neighbours begin and end anywhere along each other. They are cut where a neighbour
begins or ends, so that lanelets side by side are of the same length; the bounds of each are at the
borders that its map names, else half way to the nearest parallel centre line or at the nearest
parallel line or edge of the road, whichever is nearer.
"""

import itertools
from collections.abc import Mapping, Sequence

import numpy as np
from scipy.spatial import cKDTree

from bridgegen.base.arrays import Float
from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.readers.road_lines import (
    NEIGHBOURS,
    PARALLEL,
    SAME_PLACE,
    STEP,
    USUAL,
    CentreLine,
    LineField,
    cuts_of,
    half_widths,
)
from bridgegen.recordings.readers.table import FARTHEST, Lanelet

JOINED = 1.0
"""Largest distance between the end of a centre line and the start of the one that follows it
[m]."""
MOST_POINTS = 1_000_000
SHORTEST = 0.5  # m


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
    used = [line for line in lines if _length(line.points, place, line.name) > SHORTEST]
    if not used:
        return (), ()
    edges = [(name, points) for name, points in road.items() if _length(points, place, name) > 0.0]
    outlines = [
        (f"outline {k}", line.outline)
        for k, line in enumerate(used)
        if line.outline is not None and _length(line.outline, place, line.name) > 0.0
    ]
    total = sum(_length(edge, place, "") for _, edge in (*edges, *outlines))
    total += sum(_length(line.points, place, "") for line in used)
    # Lines are sampled at this step, so their length bounds memory; a stranger's map may have any.
    if total > MOST_POINTS * STEP:
        raise FileFormatError(
            f"{place}: a map's lines may have {MOST_POINTS * STEP / 1000:,.0f} km in all, got "
            f"{total / 1000:,.0f}"
        )
    # Geometry decides who is beside whom, not the neighbours that a map names: half of the formats
    # name none, and where they do, indices of ranges are off by a point.
    field = LineField(used, edges, outlines, place)
    # A cross-section with stations needs lanes of one length, and lanes of data sets begin and end
    # anywhere along each other.
    pieces = cuts_of(field)
    widths, measured = half_widths(field)
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


def _linked(
    field: LineField, lines: Sequence[CentreLine], pieces: list[list[int]], half: Float
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
        lanelets.append(
            Lanelet(
                name=names[index],
                left=points + half[0, a : b + 1, None] * normal,
                right=points - half[1, a : b + 1, None] * normal,
                left_same=_name(names, left[index]),
                right_same=_name(names, right[index]),
                left_opposite=_name(names, opposite[index]),
                successors=successors,
                kinds=lines[k].kinds,
            )
        )
    return tuple(lanelets)


def _name(names: list[str], index: int) -> str:
    return names[index] if index >= 0 else ""


def _beside(
    field: LineField, spans: list[tuple[int, int, int, int]]
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


def _abreast(field: LineField, a: int, b: int) -> float:
    """Return how far one point is to the left of another [m]; 0 if they are not side by side."""
    step, along = field.points[b] - field.points[a], field.along[a]
    if abs(float(step @ along)) > SAME_PLACE or abs(float(field.along[b] @ along)) < PARALLEL:
        return 0.0
    left = float(along[0] * step[1] - along[1] * step[0])
    return left if NEIGHBOURS[0] <= abs(left) <= NEIGHBOURS[1] else 0.0


def _keep(
    kind: dict[tuple[str, int], tuple[float, int]],
    sides: tuple[str, str],
    i: int,
    j: int,
    near: tuple[float, float],
) -> None:
    if near[0] * near[1] <= 0.0:
        return
    side, away = sides[0] if near[0] > 0.0 else sides[1], abs(near[0] + near[1])
    if side and away < kind.get((side, i), (np.inf, -1))[0]:
        kind[side, i] = away, j


def _followers(field: LineField, lines: Sequence[CentreLine]) -> list[tuple[str, ...]]:
    """Return the names of those that each leads to: the map's, else those that begin at its end."""
    starts = field.first[:-1]
    tree = cKDTree(field.points[starts])
    found = []
    for k, line in enumerate(lines):
        if line.successors is not None:
            found.append(line.successors)
            continue
        end = int(field.first[k + 1]) - 1
        at = sorted(tree.query_ball_point(field.points[end], JOINED))
        found.append(
            tuple(
                lines[j].name
                for j in at
                if j != k and field.along[starts[j]] @ field.along[end] >= PARALLEL
            )
        )
    return found
