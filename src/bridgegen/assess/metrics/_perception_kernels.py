"""Compiled comparison of detections with the truth that counts; wrappers in ``perception``."""

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import CONFIDENCE, HEADING, KIND, LENGTH, MISSED, SEEN_BY, WIDTH, X, Y

# --- Compiled comparison of detections with the truth that counts, see ``perceived`` ---


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
    dx: float,
    dy: float,
    turn: float,
    la: float,
    wa: float,
    lb: float,
    wb: float,
    array: Float,
    other: Float,
) -> float:
    """Return the area [m²] that boxes A and B share.

    In A's frame, B's centre is at (dx, dy) and its heading is ``turn``; la, wa, lb, wb are half
    lengths and widths. ``array`` and ``other`` are ``(8, 2)`` scratch.
    """
    c, s = elementary.cos(turn), elementary.sin(turn)
    array[0, 0], array[0, 1] = dx + (lb * c - wb * s), dy + (lb * s + wb * c)
    array[1, 0], array[1, 1] = dx - (lb * c + wb * s), dy - (lb * s - wb * c)
    array[2, 0], array[2, 1] = dx - (lb * c - wb * s), dy - (lb * s + wb * c)
    array[3, 0], array[3, 1] = dx + (lb * c + wb * s), dy + (lb * s - wb * c)
    n = cut(array, 4, 0, 1.0, la, other)
    n = cut(other, n, 0, -1.0, la, array)
    n = cut(array, n, 1, 1.0, wa, other)
    n = cut(other, n, 1, -1.0, wa, array)
    twice = 0.0
    for i in range(n):
        j = i + 1 if i + 1 < n else 0
        twice += array[i, 0] * array[j, 1] - array[j, 0] * array[i, 1]
    return 0.5 * twice


@kernel
def truth(
    box: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    detections: Float,
    n_steps: Int,
    reach: Float,
    centre_x: Float,
    centre_y: Float,
    counts: Bool,
) -> bool:
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
    half: Float,
    h: Float,
    cosine: Float,
    sine: Float,
    centre_x: Float,
    centre_y: Float,
    counts: Bool,
    detections: Float,
    n_steps: Int,
    out: Float,
) -> None:
    """Write each scenario's mean intersection over union; +inf where no truth counts."""
    n_rows, n_entities, _ = h.shape
    array, other = np.empty((8, 2)), np.empty((8, 2))
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
                    dx * c + dy * s,
                    dy * c - dx * s,
                    seen[HEADING] - h[i, e, k],
                    la,
                    wa,
                    lb,
                    wb,
                    array,
                    other,
                )
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


# --- Compiled average precision; public wrapper: ``mean_average_precision`` ---


FIRST_RECALL, LAST_RECALL = 11, 100  # per cent; recalls up to 10 % are left out
LEAST_PRECISION = 0.1


@kernel
def classify(kind: float, class_of_kind: Int) -> int:
    """Return the class of a kind; the last class if the kind does not exist."""
    if 0.0 <= kind < len(class_of_kind):
        return int(class_of_kind[int(kind)])
    return int(class_of_kind[-1])


@kernel
def gather(
    wanted: int, centre_x: Float, centre_y: Float, x: Float, y: Float, detections: Float, n: int,
    class_of_kind: Int, reach: float, entity: Int, frame: Int, confidence: Float, error: Float,
) -> int:  # fmt: skip
    """List one class's detections in range, in each frame by error; return their number."""
    m = 0
    for k in range(n):
        first = m
        for e in range(1, detections.shape[0]):
            seen = detections[e, k]
            if seen[SEEN_BY] <= MISSED or classify(seen[KIND], class_of_kind) != wanted:
                continue
            gx, gy = seen[X] - x[k], seen[Y] - y[k]
            if gx * gx + gy * gy >= reach:
                continue
            dx, dy = seen[X] - centre_x[e, k], seen[Y] - centre_y[e, k]
            off = dx * dx + dy * dy
            at = m
            while at > first and error[at - 1] > off:
                entity[at], frame[at] = entity[at - 1], k
                confidence[at], error[at] = confidence[at - 1], error[at - 1]
                at -= 1
            entity[at], frame[at], confidence[at], error[at] = e, k, seen[CONFIDENCE], off
            m += 1
    return m


@kernel
def order_of(confidence: Float, n: int) -> Int:
    """Return the order of descending confidence of the first n; equal ones keep their order."""
    for i in range(1, n):
        if confidence[i] > confidence[i - 1]:
            return np.argsort(-confidence[:n], kind="mergesort")
    return np.arange(n)


@kernel
def mark_hits(
    order: Int,
    entity: Int,
    frame: Int,
    centre_x: Float,
    centre_y: Float,
    detections: Float,
    wanted: Bool,
    threshold: float,
    taken: Bool,
    hit: Bool,
) -> None:
    """Write which detections, by descending confidence, match a box that is still unmatched.

    ``wanted`` and ``taken`` are ``(E, T)``: boxes of this class within range, and matched ones.
    """
    n_entities = wanted.shape[0]
    for j in range(len(order)):
        k = frame[order[j]]
        seen = detections[entity[order[j]], k]
        nearest, at = threshold * threshold, -1
        for e in range(1, n_entities):
            if wanted[e, k] and not taken[e, k]:
                dx, dy = seen[X] - centre_x[e, k], seen[Y] - centre_y[e, k]
                squared = dx * dx + dy * dy
                if squared < nearest:
                    nearest, at = squared, e
        hit[j] = at >= 0
        if at >= 0:
            taken[at, k] = True


@kernel
def average_precision(hit: Bool, n: int, n_truth: int) -> float:
    """Return the average precision of n detections, hits or not, by descending confidence."""
    if n == 0:
        return 0.0
    total = 0.0
    hits = 1 if hit[0] else 0  # among detections 0 .. j
    j = 0
    for percent in range(FIRST_RECALL, LAST_RECALL + 1):
        # The last detection at which recall is no more than this; whole numbers, so no rounding.
        while j + 1 < n and 100 * (hits + (1 if hit[j + 1] else 0)) <= percent * n_truth:
            j += 1
            hits += 1 if hit[j] else 0
        here = hits / (j + 1)
        if 100 * hits < percent * n_truth:
            if j + 1 == n:
                break  # this recall is never reached
            then = (hits + 1) / (j + 2)
            here += (0.01 * percent * n_truth - hits) * (then - here)
        total += max(here - LEAST_PRECISION, 0.0)
    return total / ((LAST_RECALL - FIRST_RECALL + 1) * (1.0 - LEAST_PRECISION))


@kernel
def mean_average_precision(
    x: Float,
    y: Float,
    centre_x: Float,
    centre_y: Float,
    counts: Bool,
    classes: Int,
    detections: Float,
    n_steps: Int,
    class_of_kind: Int,
    ranges: Float,
    thresholds: Float,
    out: Float,
) -> None:
    """Write each scenario's mean over classes and thresholds; +inf where no truth counts."""
    n_rows, n_entities, n_instants = x.shape
    size = n_entities * n_instants
    wanted = np.empty((n_entities, n_instants), dtype=np.bool_)
    taken = np.empty((n_entities, n_instants), dtype=np.bool_)
    entity, frame = np.empty(size, dtype=np.int64), np.empty(size, dtype=np.int64)
    confidence, error = np.empty(size), np.empty(size)
    hit = np.empty(size, dtype=np.bool_)
    for i in range(n_rows):
        n = n_steps[i]
        total, n_classes = 0.0, 0
        for c in range(len(ranges)):
            n_truth = 0
            for e in range(1, n_entities):
                if classes[e] != c:
                    wanted[e, :n] = False
                    continue
                for k in range(n):
                    wanted[e, k] = counts[i, e, k]
                    n_truth += 1 if wanted[e, k] else 0
            if n_truth == 0:
                continue
            n_classes += 1
            m = gather(
                c, centre_x[i], centre_y[i], x[i, 0], y[i, 0], detections[i], n, class_of_kind,
                ranges[c] ** 2, entity, frame, confidence, error,
            )  # fmt: skip
            order = order_of(confidence, m)
            for threshold in thresholds:
                taken[:, :n] = False
                mark_hits(
                    order,
                    entity,
                    frame,
                    centre_x[i],
                    centre_y[i],
                    detections[i],
                    wanted,
                    threshold,
                    taken,
                    hit,
                )
                total += average_precision(hit, m, n_truth) / len(thresholds)
        out[i] = min(total / n_classes, 1.0) if n_classes else np.inf  # rounding may exceed 1
