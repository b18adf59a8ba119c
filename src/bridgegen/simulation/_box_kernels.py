"""Compiled distance between oriented boxes; public wrapper: ``boxes.box_distance``.

One scenario after the other, each from its own numbers alone. Trigonometry comes first, so that
the loop over instants is plain arithmetic without branches, which the compiler vectorises.
"""

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel


@kernel
def directions(heading: Float, n: int, cosine: Float, sine: Float) -> None:
    """Write the cosine and sine of the first n headings; one that stays the same is reused."""
    cosine[0] = elementary.cos(heading[0])
    sine[0] = elementary.sin(heading[0])
    for k in range(1, n):
        if heading[k] == heading[k - 1]:
            cosine[k] = cosine[k - 1]
            sine[k] = sine[k - 1]
        else:
            cosine[k] = elementary.cos(heading[k])
            sine[k] = elementary.sin(heading[k])


@kernel
def outside(px: float, py: float, half_length: float, half_width: float) -> float:
    """Squared distance from a point, in the box's own frame, to the box."""
    gx = max(abs(px) - half_length, 0.0)
    gy = max(abs(py) - half_width, 0.0)
    return gx * gx + gy * gy


@kernel
def corners_outside(
    px: float, py: float, c: float, s: float, la: float, wa: float, lb: float, wb: float
) -> float:
    """Least squared distance from the four corners of box B to box A, in A's frame.

    B's centre is at (px, py), its direction (c, s); la, wa, lb, wb are half lengths and widths.
    """
    ux, uy, vx, vy = lb * c, lb * s, wb * s, wb * c
    front: float = min(
        outside(px + (ux + vx), py + (uy - vy), la, wa),
        outside(px + (ux - vx), py + (uy + vy), la, wa),
    )
    rear: float = min(
        outside(px - (ux - vx), py - (uy + vy), la, wa),
        outside(px - (ux + vx), py - (uy - vy), la, wa),
    )
    return min(front, rear)


@kernel
def gaps(
    box_a: Float,
    box_b: Float,
    dx: Float,
    dy: Float,
    cos_a: Float,
    sin_a: Float,
    cos_b: Float,
    sin_b: Float,
    n: int,
    out: Float,
) -> None:
    """Write the first n distances between boxes A and B, 0 where they touch or overlap.

    (dx, dy) leads from A's centre to B's. Overlap is decided by the separating-axis theorem; the
    distance of disjoint boxes is attained at a corner of one of them. Swapping A and B negates
    or permutes the operands of every sum only, so the result is symmetric to the last bit.
    """
    la, wa = 0.5 * box_a[0], 0.5 * box_a[1]
    lb, wb = 0.5 * box_b[0], 0.5 * box_b[1]
    for k in range(n):
        ca, sa, cb, sb = cos_a[k], sin_a[k], cos_b[k], sin_b[k]
        # Each centre in the other box's frame, and B's direction in A's frame.
        ax = dx[k] * ca + dy[k] * sa
        ay = dy[k] * ca - dx[k] * sa
        bx = -(dx[k] * cb + dy[k] * sb)
        by = -(dy[k] * cb - dx[k] * sb)
        c = ca * cb + sa * sb
        s = ca * sb - sa * cb
        ac, az = abs(c), abs(s)
        apart_a = max(abs(ax) - (la + (ac * lb + az * wb)), abs(ay) - (wa + (az * lb + ac * wb)))
        apart_b = max(abs(bx) - (lb + (ac * la + az * wa)), abs(by) - (wb + (az * la + ac * wa)))
        squared = min(
            corners_outside(ax, ay, c, s, la, wa, lb, wb),
            corners_outside(bx, by, c, -s, lb, wb, la, wa),
        )
        out[k] = math.sqrt(squared) if max(apart_a, apart_b) > 0.0 else 0.0


@kernel
def box_gap(
    box_a: Float,
    box_b: Float,
    dx: float,
    dy: float,
    cos_a: float,
    sin_a: float,
    cos_b: float,
    sin_b: float,
) -> float:
    """Return the distance of two boxes whose reference points are (dx, dy) apart, as ``gaps``."""
    la, wa, lb, wb = 0.5 * box_a[0], 0.5 * box_a[1], 0.5 * box_b[0], 0.5 * box_b[1]
    dx += box_b[2] * cos_b - box_a[2] * cos_a
    dy += box_b[2] * sin_b - box_a[2] * sin_a
    ax, ay = dx * cos_a + dy * sin_a, dy * cos_a - dx * sin_a
    bx, by = -(dx * cos_b + dy * sin_b), -(dy * cos_b - dx * sin_b)
    c, s = cos_a * cos_b + sin_a * sin_b, cos_a * sin_b - sin_a * cos_b
    ac, az = abs(c), abs(s)
    apart_a = max(abs(ax) - (la + (ac * lb + az * wb)), abs(ay) - (wa + (az * lb + ac * wb)))
    apart_b = max(abs(bx) - (lb + (ac * la + az * wa)), abs(by) - (wb + (az * la + ac * wa)))
    if max(apart_a, apart_b) <= 0.0:
        return 0.0
    return math.sqrt(
        min(
            corners_outside(ax, ay, c, s, la, wa, lb, wb),
            corners_outside(bx, by, c, -s, lb, wb, la, wa),
        )
    )


@kernel
def directions_of(h: Float, n_steps: Int, cosine: Float, sine: Float) -> None:
    """Fill ``cosine`` and ``sine`` (N, E, T) up to each scenario's last real instant."""
    for i in range(h.shape[0]):
        for e in range(h.shape[1]):
            directions(h[i, e], n_steps[i], cosine[i, e], sine[i, e])


@kernel
def row_distance(
    box: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    n: int,
    dx: Float,
    dy: Float,
    out: Float,
) -> None:
    """Fill ``out`` (E, T) with a row's distances; ``dx`` and ``dy`` (T,) are scratch."""
    ahead_a = box[0, 2]
    out[0, :] = np.inf
    for e in range(1, x.shape[0]):
        ahead_b = box[e, 2]
        for k in range(n):
            # Differences first: far from the origin they lose no digits.
            dx[k] = (x[e, k] - x[0, k]) + (ahead_b * cosine[e, k] - ahead_a * cosine[0, k])
            dy[k] = (y[e, k] - y[0, k]) + (ahead_b * sine[e, k] - ahead_a * sine[0, k])
        gaps(box[0], box[e], dx, dy, cosine[0], sine[0], cosine[e], sine[e], n, out[e])
        out[e, n:] = out[e, n - 1]


@kernel
def box_distance(
    box: Float, x: Float, y: Float, cosine: Float, sine: Float, n_steps: Int, out: Float
) -> None:
    """Fill ``out`` (N, E, T) with the distances from entity 0's box to each other's."""
    dx, dy = np.empty(x.shape[2]), np.empty(x.shape[2])
    for i in range(x.shape[0]):
        row_distance(box, x[i], y[i], cosine[i], sine[i], n_steps[i], dx, dy, out[i])


@kernel
def leave_out(present: Bool, e: int, out: Float) -> None:
    """Set a row's distances from body e to +inf where one of the two is not present."""
    for other in range(out.shape[0]):
        for k in range(out.shape[1]):
            if not (present[other, k] and present[e, k]):
                out[other, k] = np.inf


@kernel
def leave_out_of_rows(present: Bool, e: int, out: Float) -> None:
    """Do in N rows what ``leave_out`` does in one."""
    for i in range(out.shape[0]):
        leave_out(present[i], e, out[i])
