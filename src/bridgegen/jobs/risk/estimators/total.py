"""Sums of rates over scenarios, each its rate of encounters times a probability, with one interval.

Draws of the parts' confidence distributions are multiplied and added. The lower end is a quantile
of sums of lower ones. For the upper end one more encounter and one more hit are added, where they
weigh most, and not everywhere: upper ends of many parts with few hits would add up to far more than
the sum can be. With one part this is melding; with equal weights, the exact interval of all counts.

Sources: Fay and Feuer, Statistics in Medicine 16 (1997) 791-801 (one more event of the largest
weight); Fay, Proschan and Brittain, Biometrics 71 (2015) 146-156 (melding: functions of several
parameters by draws of confidence distributions).
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float

DRAWS = 10_000
"""Number of draws: the level of an end, 2.5 %, is off by 0.16 % then."""


@dataclass(frozen=True)
class Part:
    """A scenario's part of a sum.

    Attributes:
        rate: encounters per unit.
        rates: ``(DRAWS,)`` two: their lower and upper confidence distributions.
        probability: of the event per encounter.
        probabilities: ``(DRAWS,)`` three, see `Weighted.draws`.
    """

    rate: float
    rates: tuple[Float, ...]
    probability: float
    probabilities: tuple[Float, ...]


@dataclass(frozen=True)
class Total:
    """A sum of rates.

    Attributes:
        estimate: per unit.
        low: lower end of the 95 % interval.
        high: upper end.
        upper: it is below this with 95 % confidence (one-sided).
        shares: each part's share of the estimate; of nothing each has 0.
        simulated: variance of each part that is due to its simulations.
        counted: likewise, due to the encounters that were counted.
    """

    estimate: float
    low: float
    high: float
    upper: float
    shares: tuple[float, ...]
    simulated: tuple[float, ...]
    counted: tuple[float, ...]


def rates_of(
    count: int, amount: float, random: np.random.Generator, n: int = DRAWS
) -> tuple[Float, ...]:
    """Return draws of a rate of encounters: of its lower and upper confidence distribution.

    Args:
        count: encounters that were counted.
        amount: hours or kilometres in which they were.
        random: all random numbers.
        n: how many draws.
    """
    low = random.standard_gamma(count, n) if count else np.zeros(n)
    return low / amount, (low + random.standard_exponential(n)) / amount


def total_of(parts: Sequence[Part]) -> Total:
    """Return the sum of independent parts, at least one."""
    low = np.sum([part.rates[0] * part.probabilities[0] for part in parts], axis=0)
    # One more encounter where it adds most, and one more hit where it does.
    more = [_mean(part.rates) * float(part.probabilities[2].mean()) for part in parts]
    hit = [float(part.rates[1].mean()) * _mean(part.probabilities[1:]) for part in parts]
    met, there = int(np.argmax(more)), int(np.argmax(hit))
    high = np.sum(
        [
            part.rates[int(k == met)] * part.probabilities[1 + int(k == there)]
            for k, part in enumerate(parts)
        ],
        axis=0,
    )
    estimates = [part.rate * part.probability for part in parts]
    estimate = float(sum(estimates))
    upper, end = np.quantile(high, [0.95, 0.975]).tolist()
    return Total(
        estimate,
        min(float(np.quantile(low, 0.025)), estimate),
        max(end, estimate),
        max(upper, estimate),
        tuple(item / estimate if estimate > 0.0 else 0.0 for item in estimates),
        tuple(
            float(part.rates[1].mean()) ** 2
            * float(max(part.probabilities[0].var(), part.probabilities[2].var()))
            for part in parts
        ),
        tuple(
            float(part.rates[1].var()) * float(part.probabilities[2].mean()) ** 2 for part in parts
        ),
    )


def _mean(pair: Sequence[Float]) -> float:
    """Return by how much the second draws exceed the first ones."""
    return float((pair[1] - pair[0]).mean())


def shared_out(budget: int, spreads: Sequence[float], least: int) -> list[int]:
    """Return how many evaluations each part gets by Neyman's rule.

    Args:
        budget: of all together, at least ``least`` for each.
        spreads: of each part, the standard deviation that one evaluation would leave.
        least: number for each.

    Source: Cochran, Sampling Techniques (1977), chapter 5.
    """
    total = sum(spreads)
    rest = max(budget - least * len(spreads), 0)
    return [least + int(rest * (item / total if total else 1.0 / len(spreads))) for item in spreads]
