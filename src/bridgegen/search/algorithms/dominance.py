"""Pareto dominance among rows of objectives, all of them minimised."""

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int


def non_dominated(F: Float) -> Bool:
    """Return which rows no other row dominates: ``(n,)`` bool; equal rows get equal values.

    A row dominates another if it is nowhere worse and somewhere better.

    Args:
        F: ``(n, n_obj)`` float64, finite.
    """
    front = np.zeros(len(F), np.bool_)
    left = np.lexsort(F.T[::-1])  # a row is dominated only by rows before it
    while len(left):
        first = F[left[0]]
        same = (F[left] == first).all(axis=1)
        front[left[same]] = True
        left = left[~same & (F[left] < first).any(axis=1)]
    return front


def by_merit(F: Float) -> Int:
    """Return the rows, best first: ``(n,)`` int64.

    With many objectives, non-dominated rows come first; then the sum of objectives decides, each
    scaled to [0, 1] over the rows.

    Args:
        F: ``(n, n_obj)`` float64, finite.
    """
    low, span = F.min(axis=0, initial=np.inf), np.ptp(F, axis=0) if len(F) else 1.0
    total = ((F - low) / np.where(span > 0.0, span, 1.0)).sum(axis=1)
    merit: Int = np.lexsort((*F.T[::-1], total))  # by F where rounding leaves the sums equal
    if F.shape[1] == 1:
        return merit
    front = non_dominated(F)[merit]
    return np.concatenate([merit[front], merit[~front]])


def crowding(F: Float) -> Float:
    """Return each row's crowding distance: ``(n,)`` float64, +inf at the ends of an objective.

    Args:
        F: ``(n, n_obj)`` float64, finite: a front.

    Source: Deb et al. (2002), doi:10.1109/4235.996017, Section III-B.
    """
    n, distance = len(F), np.zeros(len(F))
    if n <= 2:
        return np.full(n, np.inf)
    for column in F.T:
        order = np.argsort(column, kind="stable")
        span = column[order[-1]] - column[order[0]]
        if span > 0.0:
            distance[order[1:-1]] += (column[order[2:]] - column[order[:-2]]) / span
            distance[order[[0, -1]]] = np.inf
    return distance


def thin(F: Float, size: int) -> Int:
    """Return the rows of a front that remain when it is cut to a size, in their order.

    The most crowded row is removed, one at a time, with distances recomputed; of equals the last.

    Args:
        F: ``(n, n_obj)`` float64, finite: a front.
        size: ≥ 1.
    """
    kept = np.arange(len(F))
    while len(kept) > size:
        distance = crowding(F[kept])
        kept = np.delete(kept, len(kept) - 1 - int(np.argmin(distance[::-1])))
    return kept
