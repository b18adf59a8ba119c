"""How likely harm is, from the rows of a search that were drawn with known chances."""

from collections.abc import Mapping
from dataclasses import dataclass, field
from typing import Literal

import numpy as np

from bridgegen.base.arrays import Bool, Int
from bridgegen.base.statistics import clopper_pearson, weighted_counts
from bridgegen.scenario.exposure.exposure import Rate
from bridgegen.search.algorithms.rate import Draws, effective, row_weights
from bridgegen.search.triage.record import Frequency

FEWEST_HITS = 12.0
"""Effective number of failures below which an interval is not believed."""

UNSEEN = 3.0
"""Expected number of failures, none of which is seen with a probability of 5 %."""


@dataclass(frozen=True)
class Drawn:
    """The rows of a run as they were drawn.

    Attributes:
        draws: the rows and their chances.
        ids: ``(n,)``, the evaluation of each; some may have been drawn twice.
        share: the feasible share of the exposure, and its interval: low, estimate, high.
        source: of the exposure; "" where rows stand for the ranges.
        met: how often the scenario is met, by the amount of driving; empty where that is not known.
        left: evaluations of the budget that were not needed.
    """

    draws: Draws
    ids: Int
    share: tuple[float, float, float]
    source: str
    met: Mapping[Literal["hour", "1,000 km"], Rate] = field(default_factory=dict)
    left: int = 0


def how_likely(drawn: Drawn, happens: Bool) -> Frequency:
    """Return how likely an event is on the road, with a 95 % interval.

    Two intervals in one: that of a sum of weights (`weighted_counts`); and what regions may have
    of which no row was seen. Such a region has less than 3 / H of the probability, if it is as
    likely on the road as those that were found, for each scenario in it that is drawn blindly: H
    of the harmful rows were, by their chances. And it has less than 3 / R, whatever it is like: R
    rows were drawn as on the road.

    Args:
        drawn: the rows.
        happens: ``(N,)``, in which evaluations.
    """
    draws, hit = drawn.draws, happens[drawn.ids]
    parts = row_weights(draws)[hit]
    road, low, high = float(draws.road.sum()), 0.0, min(UNSEEN / max(draws.road.sum(), 1e-9), 1.0)
    if not len(parts):
        return Frequency(estimate=0.0, low=low, high=high, hits=0.0)
    hits = effective(parts)
    if hits < FEWEST_HITS:
        seen = float(np.sum((draws.road * draws.weights)[hit]))
        _, high = clopper_pearson(min(seen, road), road)
        doubt = f"{len(parts)} failures, which count as {hits:.0f} of {FEWEST_HITS:.0f} at least"
        return Frequency(estimate=None, low=low, high=high, hits=hits, doubt=doubt)
    estimate, low, high, _ = weighted_counts(parts)
    blind = float(draws.blind[hit].sum())
    unseen = min(UNSEEN * estimate / max(blind, 1e-9), UNSEEN / max(road, 1e-9))
    least, middle, most = drawn.share
    return Frequency(
        estimate=min(estimate, 1.0),
        low=min(low * least / middle, 1.0),
        high=min(max(high, estimate + unseen) * most / middle, 1.0),
        hits=hits,
    )
