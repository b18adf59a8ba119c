"""The evaluations condensed for the charts: statistics per batch, and the most relevant axes."""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.pages.data import Column, Evaluations

MAX_BATCHES = 250
"""Maximum number of batches; more are merged with their neighbours: a screen shows no more."""


@dataclass(frozen=True)
class Trend:
    """A quantity over B batches; NaN where a batch has no finite value.

    Attributes:
        median: ``(B,)`` float64 in the quantity's unit.
        lower: ``(B,)`` float64, first quartile.
        upper: ``(B,)`` float64, third quartile.
        best: ``(B,)`` float64, the most critical value of the batch.
    """

    median: Float
    lower: Float
    upper: Float
    best: Float


@dataclass(frozen=True)
class Batches:
    """The bounds of each of B batches, and its critical share.

    Attributes:
        first: ``(B,)`` int64, the first iteration in the batch, counted from 1.
        last: ``(B,)`` int64, the last; equal to ``first`` unless batches were merged.
        evaluations: ``(B,)`` int64, evaluations done when the batch was, failed ones included.
        share: ``(B,)`` float64 in [0, 1], critical share of the batch.
        cumulative: ``(B,)`` float64 in [0, 1], critical share of all evaluations so far.
        group: ``(N,)`` int64, the batch of each evaluation, in 0..B-1.
    """

    first: Int
    last: Int
    evaluations: Int
    share: Float
    cumulative: Float
    group: Int


def batches(evaluations: Evaluations, limit: int = MAX_BATCHES) -> Batches:
    """Group the evaluations by iteration, at most ``limit`` groups."""
    iteration, index, counts = np.unique(
        evaluations.iteration, return_inverse=True, return_counts=True
    )
    merge = -(-iteration.size // limit) or 1
    starts = np.arange(0, iteration.size, merge)
    group = index // merge
    size = np.add.reduceat(counts, starts) if iteration.size else np.zeros(0, dtype=np.int64)
    critical = np.bincount(group, weights=evaluations.critical, minlength=starts.size)
    done = np.cumsum(size)
    return Batches(
        first=iteration[starts] + 1,
        last=iteration[np.minimum(starts + merge, iteration.size) - 1] + 1,
        evaluations=done,
        share=critical / size,
        cumulative=np.cumsum(critical) / done,
        group=group,
    )


def trend(values: Float, group: Int, n_groups: int, *, larger_is_worse: bool) -> Trend:
    """Return the quartiles and the most critical value per group.

    Args:
        values: ``(N,)`` float64; only finite ones count.
        group: ``(N,)`` int64 in 0..n_groups-1, ascending.
        n_groups: number of groups.
        larger_is_worse: whether the largest (v_d) or the smallest (d_min) is the most critical.
    """
    table = np.full((4, n_groups), np.nan)
    edges = np.searchsorted(group, np.arange(n_groups + 1))
    for k in range(n_groups):
        part = values[edges[k] : edges[k + 1]]
        part = part[np.isfinite(part)]
        if part.size:
            lower, median, upper = np.quantile(part, (0.25, 0.5, 0.75))
            table[:, k] = median, lower, upper, part.max() if larger_is_worse else part.min()
    return Trend(*table)


def telling_parameters(columns: tuple[Column, ...], critical: Bool, ok: Bool) -> list[str]:
    """Return the names of the searched parameters that vary, the most relevant first.

    Relevance is the distance between the distributions of the critical and of the other
    evaluations (Kolmogorov–Smirnov statistic); where one of the two is empty, the order
    stays as declared.

    Args:
        columns: the parameters.
        critical: ``(N,)`` bool.
        ok: ``(N,)`` bool, the rows that count.
    """
    values = {c.name: c.values[ok] for c in columns if c.searched}
    varied = {name: x for name, x in values.items() if _varies(x)}
    hit = critical[ok]
    if not hit.any() or hit.all():
        return list(varied)
    score = {name: _smirnov(x[hit], x[~hit]) for name, x in varied.items()}
    return sorted(score, key=lambda name: -score[name])


def _varies(values: Float) -> bool:
    finite = values[np.isfinite(values)]
    return finite.size > 0 and bool(finite.min() < finite.max())


def _smirnov(a: Float, b: Float) -> float:
    # Kolmogorov and Smirnov's distance of the two samples.
    both = np.concatenate([a, b])
    rank_a = np.searchsorted(np.sort(a), both, side="right") / a.size
    rank_b = np.searchsorted(np.sort(b), both, side="right") / b.size
    return float(np.abs(rank_a - rank_b).max())
