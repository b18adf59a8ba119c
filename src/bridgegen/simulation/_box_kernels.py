"""Compiled distance between oriented boxes; public wrapper: ``boxes.box_distance``.

Row by row, without fastmath, so a row's result depends on that row alone.
"""

import math

import numpy as np
from numba import njit

from bridgegen.arrays import Float, Int


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def directions(heading: Float, n: int, cosine: Float, sine: Float) -> None:
    """Write the cosine and sine of the first n headings; a heading that stays costs nothing."""
    cosine[0] = math.cos(heading[0])
    sine[0] = math.sin(heading[0])
    for k in range(1, n):
        if heading[k] == heading[k - 1]:
            cosine[k] = cosine[k - 1]
            sine[k] = sine[k - 1]
        else:
            cosine[k] = math.cos(heading[k])
            sine[k] = math.sin(heading[k])


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)  # type: ignore[untyped-decorator]
def corner_to_box(px: float, py: float, half_length: float, half_width: float) -> float:
    """Squared distance from a point, in the box's own frame, to the box."""
    gx = max(abs(px) - half_length, 0.0)
    gy = max(abs(py) - half_width, 0.0)
    return gx * gx + gy * gy


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)  # type: ignore[untyped-decorator]
def corners_to_box(
    px: float, py: float, c: float, s: float, la: float, wa: float, lb: float, wb: float
) -> float:
    """Least squared distance from the four corners of box B to box A, in A's frame.

    B's centre is at (px, py), its direction (c, s); la, wa, lb, wb are half lengths and widths.
    """
    ux = lb * c
    uy = lb * s
    vx = wb * s
    vy = wb * c
    front = min(
        corner_to_box(px + (ux + vx), py + (uy - vy), la, wa),
        corner_to_box(px + (ux - vx), py + (uy + vy), la, wa),
    )
    rear = min(
        corner_to_box(px - (ux - vx), py - (uy + vy), la, wa),
        corner_to_box(px - (ux + vx), py - (uy - vy), la, wa),
    )
    return min(front, rear)


@njit(cache=True, nogil=True, error_model="numpy", forceinline=True)  # type: ignore[untyped-decorator]
def gap(
    dx: float, dy: float, ca: float, sa: float, cb: float, sb: float,
    la: float, wa: float, lb: float, wb: float,
) -> float:  # fmt: skip
    """Distance between boxes A and B, 0 where they touch or overlap.

    (dx, dy) leads from A's centre to B's. Overlap is decided by the separating-axis theorem; the
    distance of disjoint boxes is attained at a corner of one of them. Swapping A and B negates
    or permutes the operands of every sum only, so the result is symmetric to the last bit.
    """
    c = ca * cb + sa * sb
    s = ca * sb - sa * cb
    ax = dx * ca + dy * sa
    ay = dy * ca - dx * sa
    bx = -(dx * cb + dy * sb)
    by = -(dy * cb - dx * sb)
    ac = abs(c)
    as_ = abs(s)
    apart_a = max(abs(ax) - (la + (ac * lb + as_ * wb)), abs(ay) - (wa + (as_ * lb + ac * wb)))
    apart_b = max(abs(bx) - (lb + (ac * la + as_ * wa)), abs(by) - (wb + (as_ * la + ac * wa)))
    squared = min(
        corners_to_box(ax, ay, c, s, la, wa, lb, wb),
        corners_to_box(bx, by, c, -s, lb, wb, la, wa),
    )
    return math.sqrt(squared) if max(apart_a, apart_b) > 0.0 else 0.0


@njit(cache=True, nogil=True, error_model="numpy")  # type: ignore[untyped-decorator]
def box_distance(box: Float, x: Float, y: Float, h: Float, n_steps: Int, out: Float) -> None:
    """Fill ``out`` (N, E, T) with the distances from entity 0's box to each other's."""
    n_rows, n_entities, n_instants = x.shape
    ca = np.empty(n_instants)
    sa = np.empty(n_instants)
    cb = np.empty(n_instants)
    sb = np.empty(n_instants)
    dx = np.empty(n_instants)
    dy = np.empty(n_instants)
    la = 0.5 * box[0, 0]
    wa = 0.5 * box[0, 1]
    ahead_a = box[0, 2]
    for i in range(n_rows):
        n = n_steps[i]
        out[i, 0, :] = np.inf
        if n_entities > 1:
            directions(h[i, 0], n, ca, sa)
        for e in range(1, n_entities):
            directions(h[i, e], n, cb, sb)
            lb = 0.5 * box[e, 0]
            wb = 0.5 * box[e, 1]
            ahead_b = box[e, 2]
            for k in range(n):
                # Differences first: far from the origin they lose no digits.
                dx[k] = (x[i, e, k] - x[i, 0, k]) + (ahead_b * cb[k] - ahead_a * ca[k])
                dy[k] = (y[i, e, k] - y[i, 0, k]) + (ahead_b * sb[k] - ahead_a * sa[k])
            for k in range(n):
                out[i, e, k] = gap(dx[k], dy[k], ca[k], sa[k], cb[k], sb[k], la, wa, lb, wb)
            out[i, e, n:] = out[i, e, n - 1]
