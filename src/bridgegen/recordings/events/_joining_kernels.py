"""Compiled search for places where recorded paths join; wrapper: ``paths.Paths.joins``."""

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel
from bridgegen.recordings.events._crossing_kernels import passed


@kernel
def foot(
    x: Float, y: Float, first: int, last: int, at: int, px: float, py: float
) -> tuple[float, int]:
    """Return the distance of a point from a line [m], and the vertex of the line next to it.

    The line is followed from one of its vertices on, as long as it comes nearer.

    Args:
        x: of the vertices of all lines [m].
        y: likewise.
        first: the line's first vertex.
        last: its last.
        at: where to begin.
        px: of the point [m].
        py: likewise.
    """
    here = elementary.hypot(x[at] - px, y[at] - py)
    for way in (-1, 1):
        while first <= at + way <= last:
            onward = elementary.hypot(x[at + way] - px, y[at + way] - py)
            if onward > here:
                break
            here, at = onward, at + way
    for k in range(max(at - 1, first), min(at + 1, last)):
        ux, uy = x[k + 1] - x[k], y[k + 1] - y[k]
        share = ((px - x[k]) * ux + (py - y[k]) * uy) / max(ux * ux + uy * uy, 1e-12)
        share = min(max(share, 0.0), 1.0)
        here = min(here, elementary.hypot(x[k] + share * ux - px, y[k] + share * uy - py))
    return here, at


@kernel
def joined(
    x: Float,
    y: Float,
    number: int,
    first: int,
    other: int,
    other_first: int,
    other_last: int,
    near: float,
) -> tuple[int, float, int]:
    """Return where a line comes nearer than a distance to another, and stays so up to a vertex.

    Args:
        x: of the vertices of all lines [m].
        y: likewise.
        number: that vertex.
        first: of its line.
        other: vertex of the other line near it.
        other_first: of that line.
        other_last: of that line.
        near: the distance [m].

    Returns:
        The last vertex before, or -1 if it has been near from its beginning; the share of the way
        to the next one; the other line's vertex next to it.
    """
    inside, other = foot(x, y, other_first, other_last, other, x[number], y[number])
    while number > first:
        outside, at = foot(x, y, other_first, other_last, other, x[number - 1], y[number - 1])
        if outside > near:
            return number - 1, (outside - near) / max(outside - inside, 1e-12), other
        number, inside, other = number - 1, outside, at
    return -1, 0.0, other


@kernel
def mark_joins(
    cells: Int, first: Int, row: int, entries: Int, cell: Int, lines: Int, who: Int, x: Float,
    y: Float, length: Float, vertex: Int, state_x: Float, state_y: Float, instant: Int, role: Int,
    window: float, near: float, least_cosine: float, pairs: Int, places: Float,
) -> int:  # fmt: skip
    """Write where the paths of two motor vehicles come together, and lead the same way for a while.

    Args:
        cells: ``(C,)`` numbers of the cells with vertices, increasing; the next row is ``row`` on.
        first: ``(C + 1,)`` where each cell's vertices begin.
        row: see ``cells``.
        entries: ``(V,)`` the vertices by cell, then by instant.
        cell: ``(V,)`` of each vertex.
        lines: ``(P + 1,)`` where each participant's vertices begin.
        who: ``(V,)`` participant.
        x: ``(V,)`` [m].
        y: ``(V,)`` [m].
        length: ``(V,)`` along the paths [m].
        vertex: ``(V,)`` state.
        state_x: ``(S,)`` [m].
        state_y: ``(S,)`` [m].
        instant: ``(S,)``.
        role: ``(P,)`` 1: motor vehicle; others take no part.
        window: longest time between two that pass the same place [time steps].
        near: between two paths that are one [m].
        least_cosine: of the angle between them.
        pairs: ``(M, 2)`` takes the participants, the lesser number first; what exceeds it is
            counted, not written.
        places: ``(M, 5)`` takes the instants and the lengths of path at which each comes to the
            shared part, and how long that is [m].

    Returns:
        How many there are.
    """
    count = 0
    until = np.full(len(lines) - 1, -1, np.int64)
    for k in range(len(who)):
        p = who[k]
        if role[p] != 1:
            continue
        p_first, p_last = lines[p], lines[p + 1] - 1
        a, b = max(k - 2, p_first), min(k + 2, p_last)
        ux, uy = x[b] - x[a], y[b] - y[a]
        time = instant[vertex[k]]
        for beside in range(9):
            key = cell[k] + (beside // 3 - 1) * row + beside % 3 - 1
            n = np.searchsorted(cells, key)
            if n == len(cells) or cells[n] != key:
                continue
            low, high = first[n], first[n + 1]
            while low < high:
                middle = (low + high) // 2
                if instant[vertex[entries[middle]]] < time - window:
                    low = middle + 1
                else:
                    high = middle
            for i in range(low, first[n + 1]):
                j = entries[i]
                if instant[vertex[j]] > time + window:
                    break
                q = who[j]
                if q <= p or role[q] != 1 or k <= until[q]:
                    continue
                if elementary.hypot(x[j] - x[k], y[j] - y[k]) > near:
                    continue
                q_first, q_last = lines[q], lines[q + 1] - 1
                a, b = max(j - 2, q_first), min(j + 2, q_last)
                vx, vy = x[b] - x[a], y[b] - y[a]
                if ux * vx + uy * vy < least_cosine * elementary.hypot(ux, uy) * elementary.hypot(
                    vx, vy
                ):
                    continue
                end, at = k, j
                while end < p_last:
                    apart, onward = foot(x, y, q_first, q_last, at, x[end + 1], y[end + 1])
                    if apart > near:
                        break
                    end, at = end + 1, onward
                until[q] = end
                item, share, at = joined(x, y, k, p_first, j, q_first, q_last, near)
                if item < 0:
                    continue
                begin = item + 1
                while at < q_last:
                    apart, begin = foot(x, y, p_first, p_last, begin, x[at], y[at])
                    if apart <= near:
                        break
                    at += 1
                other, other_share, begin = joined(x, y, at, q_first, begin, p_first, p_last, near)
                if other < 0:
                    continue
                if count < len(pairs):
                    pairs[count, 0], pairs[count, 1] = p, q
                    s, t = vertex[item], vertex[item + 1]
                    places[count, 0] = passed(state_x, state_y, s, t, share) - s + instant[s]
                    s, t = vertex[other], vertex[other + 1]
                    places[count, 1] = passed(state_x, state_y, s, t, other_share) - s + instant[s]
                    places[count, 2] = (
                        length[item] + share * (length[item + 1] - length[item]) - length[p_first]
                    )
                    places[count, 3] = (
                        length[other]
                        + other_share * (length[other + 1] - length[other])
                        - length[q_first]
                    )
                    places[count, 4] = length[end] - length[p_first] - places[count, 2]
                count += 1
    return count
