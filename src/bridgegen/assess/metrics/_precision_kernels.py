"""Compiled average precision; public wrapper: ``mean_average_precision``."""

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel
from bridgegen.drivers.kinds import CONFIDENCE, KIND, MISSED, SEEN_BY, X, Y

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
    order: Int, entity: Int, frame: Int, centre_x: Float, centre_y: Float, detections: Float,
    wanted: Bool, threshold: float, taken: Bool, hit: Bool,
) -> None:  # fmt: skip
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
    x: Float, y: Float, centre_x: Float, centre_y: Float, counts: Bool, classes: Int,
    detections: Float, n_steps: Int, class_of_kind: Int, ranges: Float, thresholds: Float,
    out: Float,
) -> None:  # fmt: skip
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
                    order, entity, frame, centre_x[i], centre_y[i], detections[i], wanted,
                    threshold, taken, hit,
                )  # fmt: skip
                total += average_precision(hit, m, n_truth) / len(thresholds)
        out[i] = min(total / n_classes, 1.0) if n_classes else np.inf  # rounding may exceed 1
