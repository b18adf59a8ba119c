"""Findings evaluated again, with planted probabilities of failing."""

from types import SimpleNamespace

import numpy as np
import pytest

from bridgegen.assess.conflict.findings import Findings
from bridgegen.base.statistics import beta_binomial, clopper_pearson, confidence_sequence
from bridgegen.search.triage.record import Repeated, repeats_needed
from bridgegen.search.triage.repeats import repeated


def test_the_interval_is_where_the_density_exceeds_a_twentieth():
    # By hand: 11 p^10 = 0.05 where ten of ten fail, 9 (1 - p)^8 = 0.05 where none of eight does.
    assert confidence_sequence(10, 10) == (pytest.approx((0.05 / 11) ** 0.1), 1.0)
    assert confidence_sequence(0, 8) == (0.0, pytest.approx(1 - (0.05 / 9) ** 0.125))
    assert confidence_sequence(0, 0) == (0.0, 1.0)
    assert [repeats_needed(0, n) for n in (0, 1, 8)] == [None, 8, 8]
    assert repeats_needed(5, 10) is None
    low, high = confidence_sequence(3, 10)
    exact_low, exact_high = clopper_pearson(3, 10)
    assert low < exact_low < exact_high < high


def missed(p, most, interval, stops):
    """Return, exactly, how likely an interval misses p where repeats stop once it decides."""
    going, miss = {0: 1.0}, 0.0
    for n in range(1, most + 1):
        after = {}
        for k, weight in going.items():
            after[k] = after.get(k, 0.0) + weight * (1 - p)
            after[k + 1] = after.get(k + 1, 0.0) + weight * p
        going = {}
        for k, weight in after.items():
            low, high = interval(k, n)
            if n == most or (stops and (low > 0.5 or high < 0.5)):
                miss += weight * (not low <= p <= high)
            else:
                going[k] = weight
    return miss


def test_the_interval_holds_though_results_decide_when_to_stop():
    at = (0.05, 0.2, 0.35, 0.5, 0.51, 0.7, 0.95)
    assert all(missed(p, 100, confidence_sequence, True) <= 0.05 for p in at)
    assert missed(0.5, 100, clopper_pearson, True) > 0.1  # which is for a number that is stated


def test_the_mean_of_rows_is_that_of_all_repeats_only_if_they_are_alike():
    mean, low, high = beta_binomial([2] * 20, [10] * 20)
    assert mean == pytest.approx(0.2, abs=0.02)
    assert 0.12 < low < 0.2 < high < 0.3
    _, low, high = beta_binomial([0, 10], [10, 10])  # two rows say little of how rows differ
    assert low < 0.15
    assert high > 0.85
    assert sum(beta_binomial([3], [7])[1:]) == pytest.approx(
        2.0 - sum(beta_binomial([4], [7])[1:]), abs=0.01
    )


class Planted:
    """Evaluates rows that hold how likely each fails, and how likely it has no result."""

    def __init__(self):
        self.asked = []

    def evaluate(self, X, number):
        self.asked.append(len(X))
        draws = [np.random.default_rng([number, int(row[0])]).random(2) for row in X]
        a, b = np.array(draws).T
        return SimpleNamespace(
            status=(b < X[:, 2]).astype(np.int8), fails=a < X[:, 1], findings=Findings.none(len(X))
        )


def driven(rows, most, known=()):
    world, X = Planted(), np.array(rows, dtype=np.float64)
    known = {item.evaluation: item for item in known}
    first = [known.get(int(i)) or Repeated(evaluation=int(i), failed=True) for i in X[:, 0]]
    found = repeated(world, X, first, most, lambda evaluation: evaluation.fails)
    return found, world


def test_repeats_are_spent_where_they_decide():
    rows = [(0, 1.0, 0.0), (1, 0.0, 0.0), (2, 0.5, 0.0), (3, 1.0, 0.4), (4, 1.0, 1.0)]
    found, world = driven(rows, 20)
    assert (found[0].fails, found[0].repeats) == (8, 8)
    assert found[0].agrees
    assert (found[1].fails, found[1].repeats) == (0, 8)
    assert not found[1].agrees
    assert 0 < found[2].fails < found[2].repeats <= 20
    assert found[3].fails == found[3].repeats == 8
    assert found[3].lost > 0
    assert found[3].sentence.endswith(f"{found[3].lost} more without a result")
    assert (found[4].repeats, found[4].lost, found[4].probability) == (0, 20, 0.5)
    assert world.asked[:8] == [5] * 8
    assert world.asked[-1] <= 2
    # A row's result depends on that row alone, and what is known is not evaluated again.
    assert driven(rows[::-1], 20)[0] == found
    assert driven(rows[:3], 20, found.values())[1].asked == []


def test_planted_probabilities_lie_in_their_intervals():
    p = np.random.default_rng(3).random(300)
    found, _ = driven([(i, value, 0.0) for i, value in enumerate(p)], 10)
    inside = [
        low <= value <= high
        for value, item in zip(p, found.values(), strict=True)
        for low, high in [confidence_sequence(item.fails, item.repeats)]
    ]
    assert np.mean(inside) >= 0.93
    assert sum(item.repeats for item in found.values()) < 3000
