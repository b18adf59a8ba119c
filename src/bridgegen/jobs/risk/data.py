"""How much few data leave open: the same outcomes, weighted for exposures of resampled events."""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.jobs.risk.estimators.weighted import Weighted
from bridgegen.scenario.exposure import Exposure
from bridgegen.scenario.exposure.fit import Fit

FEWEST = 10.0
"""Effective hits that a resampled exposure must leave, or its weights say too little."""
MOST_LEFT_OUT = 0.1  # of the exposures
MOST_ROWS = 5000  # outcomes that are weighted


@dataclass(frozen=True)
class DataBand:
    """Between which probabilities the exposures of resampled events lie.

    Attributes:
        low: the 2.5 % quantile; None if that cannot be said.
        high: the 97.5 % quantile; likewise.
        exposures: how many there are.
        left_out: how many have their harmful encounters where too few rows were simulated.
    """

    low: float | None
    high: float | None
    exposures: int
    left_out: int


def data_band(exposure: Exposure, weighted: Weighted, threshold: float, fit: Fit) -> DataBand:
    """Return how the probability of an event varies with the exposure.

    An outcome's weight is multiplied by how much likelier its row is in an exposure than in the
    fitted one.

    Args:
        exposure: of the outcomes: the fitted one, or one like it.
        weighted: the outcomes.
        threshold: the event's.
        fit: to the events.
    """
    replicates = fit.replicates
    hits = np.flatnonzero(weighted.there(threshold))
    at = hits[:: max(1, len(hits) // MOST_ROWS)]
    if not len(at):
        return DataBand(None, None, len(replicates), len(replicates))
    X = exposure.from_normal(weighted.Z[at])
    weights, before = weighted.weights[at], fit.exposure.log_density(X)
    good = np.isfinite(before)
    X, weights, before = X[good], weights[good], before[good]
    factors = []
    for one in replicates:
        parts: Float = weights * np.exp(np.minimum(one.log_density(X) - before, 50.0))
        total, squares = float(parts.sum()), float(np.sum(parts * parts))
        if squares > 0.0 and total * total / squares >= FEWEST:
            factors.append(total / float(weights.sum()))
    left_out = len(replicates) - len(factors)
    if left_out > MOST_LEFT_OUT * len(replicates):
        return DataBand(None, None, len(replicates), left_out)
    p = weighted.probability(threshold).estimate
    low, high = np.quantile(factors, [0.025, 0.975]).tolist()
    return DataBand(p * low, min(p * high, 1.0), len(replicates), left_out)
