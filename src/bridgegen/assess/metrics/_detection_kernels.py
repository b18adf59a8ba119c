"""Compiled comparison of detections with the truth that counts, see ``perceived``."""

import math

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import HEADING, LENGTH, MISSED, SEEN_BY, WIDTH, X, Y


@kernel
def cut(points: Float, n: int, axis: int, side: float, limit: float, out: Float) -> int:
    """Write the part of a convex polygon where side · coordinate ≤ limit; return its corners.

    ``points`` and ``out`` are ``(8, 2)``: four cuts of a rectangle leave eight corners at most.
    Source: Sutherland, Hodgman, Reentrant polygon clipping, Comm. ACM 17 (1974) 32.
    """
    m = 0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        here = limit - side * points[i, axis]
        there = limit - side * points[j, axis]
        if here >= 0.0:
            out[m, 0], out[m, 1] = points[i, 0], points[i, 1]
            m += 1
        if (here > 0.0 and there < 0.0) or (here < 0.0 and there > 0.0):
            f = here / (here - there)
            out[m, 0] = points[i, 0] + f * (points[j, 0] - points[i, 0])
            out[m, 1] = points[i, 1] + f * (points[j, 1] - points[i, 1])
            m += 1
    return m


@kernel
def overlap(
    dx: float, dy: float, turn: float, la: float, wa: float, lb: float, wb: float,
    one: Float, other: Float,
) -> float:  # fmt: skip
    """Return the area [m²] that boxes A and B share.

    In A's frame, B's centre is at (dx, dy) and its heading is ``turn``; la, wa, lb, wb are half
    lengths and widths. ``one`` and ``other`` are ``(8, 2)`` scratch.
    """
    c, s = math.cos(turn), math.sin(turn)
    one[0, 0], one[0, 1] = dx + (lb * c - wb * s), dy + (lb * s + wb * c)
    one[1, 0], one[1, 1] = dx - (lb * c + wb * s), dy - (lb * s - wb * c)
    one[2, 0], one[2, 1] = dx - (lb * c - wb * s), dy - (lb * s + wb * c)
    one[3, 0], one[3, 1] = dx + (lb * c + wb * s), dy + (lb * s - wb * c)
    n = cut(one, 4, 0, 1.0, la, other)
    n = cut(other, n, 0, -1.0, la, one)
    n = cut(one, n, 1, 1.0, wa, other)
    n = cut(other, n, 1, -1.0, wa, one)
    twice = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        twice += one[i, 0] * one[j, 1] - one[j, 0] * one[i, 1]
    return 0.5 * twice


@kernel
def truth(
    box: Float, x: Float, y: Float, cosine: Float, sine: Float, detections: Float, n_steps: Int,
    reach: Float, centre_x: Float, centre_y: Float, counts: Bool,
) -> bool:  # fmt: skip
    """Write where the boxes' centres are at the instants with a frame, and which of them count.

    ``reach`` ``(E,)`` [m] is how near to the ego's reference point an entity must be. Return
    whether all detections at these instants are finite.
    """
    n_rows, n_entities, _ = x.shape
    nothing = 0.0
    for i in range(n_rows):
        counts[i] = False
        for e in range(1, n_entities):
            for k in range(n_steps[i]):
                if detections[i, e, k, SEEN_BY] < MISSED:
                    continue
                for c in range(detections.shape[3]):
                    nothing += 0.0 * detections[i, e, k, c]  # NaN if it is not finite
                centre_x[i, e, k] = x[i, e, k] + box[e, 2] * cosine[i, e, k]
                centre_y[i, e, k] = y[i, e, k] + box[e, 2] * sine[i, e, k]
                dx, dy = centre_x[i, e, k] - x[i, 0, k], centre_y[i, e, k] - y[i, 0, k]
                counts[i, e, k] = dx * dx + dy * dy < reach[e] * reach[e]
    return bool(nothing == 0.0)


@kernel
def mean_iou(
    half: Float, h: Float, cosine: Float, sine: Float, centre_x: Float, centre_y: Float,
    counts: Bool, detections: Float, n_steps: Int, out: Float,
) -> None:  # fmt: skip
    """Write each scenario's mean intersection over union; +inf where no truth counts."""
    n_rows, n_entities, _ = h.shape
    one, other = np.empty((8, 2)), np.empty((8, 2))
    for i in range(n_rows):
        total, count = 0.0, 0
        for e in range(1, n_entities):
            la, wa = half[e, 0], half[e, 1]
            for k in range(n_steps[i]):
                if not counts[i, e, k]:
                    continue
                count += 1
                seen = detections[i, e, k]
                if seen[SEEN_BY] == MISSED:
                    continue
                c, s = cosine[i, e, k], sine[i, e, k]
                dx, dy = seen[X] - centre_x[i, e, k], seen[Y] - centre_y[i, e, k]
                lb, wb = 0.5 * seen[LENGTH], 0.5 * seen[WIDTH]
                common = overlap(
                    dx * c + dy * s, dy * c - dx * s, seen[HEADING] - h[i, e, k],
                    la, wa, lb, wb, one, other,
                )  # fmt: skip
                total += common / (4.0 * (la * wa + lb * wb) - common)
        out[i] = min(total / count, 1.0) if count else np.inf  # rounding may exceed 1


@kernel
def mean_error(
    centre_x: Float, centre_y: Float, counts: Bool, detections: Float, n_steps: Int, out: Float
) -> None:
    """Write each scenario's mean distance of detections from the truth; 0 without any."""
    n_rows, n_entities, _ = counts.shape
    for i in range(n_rows):
        total, count = 0.0, 0
        for e in range(1, n_entities):
            for k in range(n_steps[i]):
                if counts[i, e, k] and detections[i, e, k, SEEN_BY] > MISSED:
                    dx = detections[i, e, k, X] - centre_x[i, e, k]
                    dy = detections[i, e, k, Y] - centre_y[i, e, k]
                    total += math.sqrt(dx * dx + dy * dy)
                    count += 1
        out[i] = total / count if count else 0.0
