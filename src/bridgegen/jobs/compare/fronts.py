"""Objectives of all algorithms in one space, and measures there.

Whether an algorithm minimises a weighted sum or several objectives, its run records the metrics of
the scenario's objective. They are positivised (larger is more critical, at most the metric's cap
away) and scaled over all runs of a scenario: 0 is the most critical value of all runs, 1 the least
critical. All of them are minimised.

So hypervolumes, distances and spreads are comparable within one comparison, not between different
ones.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float


@dataclass(frozen=True)
class Scale:
    """From positivised terms to objectives in [0, 1], the same for all runs of a scenario.

    Attributes:
        worst: ``(m,)`` float64, the least critical value of each term.
        best: ``(m,)`` float64, the most critical one.
    """

    worst: Float
    best: Float

    @classmethod
    def pooled(cls, ranges: Sequence[tuple[Float, Float]], m: int) -> "Scale":
        """Return the scale of runs, by the least and the most critical values of each.

        Args:
            ranges: of each run that has results, ``(m,)`` and ``(m,)``.
            m: terms.
        """
        if not ranges:
            return cls(np.zeros(m), np.zeros(m))
        worst = np.min([low for low, _ in ranges], axis=0)
        return cls(worst, np.max([high for _, high in ranges], axis=0))

    def objectives(self, x: Float) -> Float:
        """Return positivised terms ``(n, m)`` as objectives; 0 of a term that never varies."""
        span = self.best - self.worst
        scaled: Float = (self.best - x) / np.where(span > 0.0, span, 1.0)
        return scaled


def front(F: Float) -> Float:
    """Return the rows that no other dominates, each once, in ascending order.

    Args:
        F: ``(n, m)`` float64, minimised, finite.
    """
    F = np.unique(F, axis=0)  # sorted by the first column, then by the next
    if len(F) < 2:
        return F
    if F.shape[1] <= 2:
        if F.shape[1] == 1:
            return F[:1]
        best = np.minimum.accumulate(F[:, 1])
        kept: Float = F[np.concatenate([[True], F[1:, 1] < best[:-1]])]
        return kept
    kept_rows: list[int] = []
    for i, row in enumerate(F):  # a row that dominates another comes before it
        if not (F[kept_rows] <= row).all(axis=1).any():
            kept_rows.append(i)
    alone: Float = F[kept_rows]
    return alone


def hypervolume(F: Float) -> float:
    """Return the share of the unit box that a front dominates; the reference point is (1, …, 1).

    Args:
        F: ``(n, m)`` float64 in [0, 1]; none: 0.

    Source: Zitzler and Thiele (1999), doi:10.1109/4235.797969; computed by pymoo.
    """
    if not len(F):
        return 0.0
    from pymoo.indicators.hv import HV

    return float(HV(ref_point=np.ones(F.shape[1]))(F))


def generational_distance(F: Float, reference: Float) -> float:
    """Return the mean Euclidean distance of a front's points from the nearest of a reference.

    Args:
        F: ``(n, m)`` float64; none: NaN.
        reference: ``(k, m)`` float64, here the front of all runs of the scenario together.

    Source: Van Veldhuizen and Lamont (2000), with p = 1; computed by pymoo.
    """
    if not len(F):
        return float("nan")
    from pymoo.indicators.gd import GD

    return float(GD(reference)(F))


def spread(F: Float, reference: Float) -> float:
    """Return how unevenly a front is spread, and how far from the reference's ends; 0 is best.

    For two objectives Deb's Δ: with d_f and d_l from the reference's two ends to the front's, and
    d_i between neighbours of the front, of mean d̄, n − 1 of them:
    Δ = (d_f + d_l + Σ|d_i − d̄|) / (d_f + d_l + (n − 1)·d̄).
    For more, its generalisation: d_i from each point to the nearest other one, n of them, and from
    each of the reference's extreme points (the worst in one objective) to the front.

    Args:
        F: ``(n, m)`` float64, a front; none: NaN.
        reference: ``(k, m)`` float64. NaN if it and the front are one point.

    Source: Deb et al. (2002), doi:10.1109/4235.996017; the generalisation: Zhou et al. (2006),
    doi:10.1109/CEC.2006.1688406.
    """
    if not len(F) or F.shape[1] < 2:
        return float("nan")
    if F.shape[1] == 2:
        F, reference = front(F), front(reference)
        ends = np.linalg.norm(F[[0, -1]] - reference[[0, -1]], axis=1)
        gaps = np.linalg.norm(np.diff(F, axis=0), axis=1)
    else:
        extreme = reference[np.argmax(reference, axis=0)]
        ends = np.linalg.norm(F[np.newaxis] - extreme[:, np.newaxis], axis=2).min(axis=1)
        apart = np.linalg.norm(F[np.newaxis] - F[:, np.newaxis], axis=2)
        np.fill_diagonal(apart, np.inf)
        gaps = apart.min(axis=1) if len(F) > 1 else np.zeros(1)
    total = float(ends.sum() + gaps.sum())
    uneven = float(np.abs(gaps - gaps.mean()).sum()) if len(gaps) else 0.0
    return (float(ends.sum()) + uneven) / total if total > 0.0 else float("nan")
