"""Intervals of weighted outcomes, against other people's formulas."""

import subprocess
import sys

import numpy as np
import pytest
import scipy.stats
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.jobs.risk.estimators.weighted import Weighted, of_counts, of_repetitions, of_weights

NONE = np.empty(0, np.int64)


def weighted(scores, weights, rows, share=(1.0, 1.0, 1.0)):
    outcomes = np.asarray(scores, float)[:, np.newaxis]
    return Weighted(outcomes, outcomes, np.asarray(weights), rows, NONE, 0, 1.0, share, rows)


@given(st.integers(1, 400), st.data())
def test_counts_have_the_exact_interval(rows, data):
    hits = data.draw(st.integers(0, rows))
    found = of_counts(hits, rows, 1.0 / rows)
    exact = scipy.stats.binomtest(hits, rows).proportion_ci(0.95, "exact")
    assert (found.low, found.high) == pytest.approx((exact.low, exact.high), abs=1e-12)
    bound = scipy.stats.binomtest(hits, rows, alternative="less").proportion_ci(0.95, "exact")
    assert found.upper == pytest.approx(bound.high, abs=1e-12)
    assert found.low <= found.estimate <= found.high


@given(st.integers(1, 300), st.floats(1e-9, 1.0))
def test_equal_weights_are_a_poisson_count_with_mid_p(hits, weight):
    found = of_weights(np.full(hits, weight))
    low, high = found.low / weight, found.high / weight
    poisson = scipy.stats.poisson
    assert poisson.sf(hits, low) + 0.5 * poisson.pmf(hits, low) == pytest.approx(0.025, abs=1e-6)
    assert poisson.cdf(hits - 1, high) + 0.5 * poisson.pmf(hits, high) == pytest.approx(
        0.025, abs=1e-6
    )


@given(st.lists(st.floats(1e-6, 1.0), min_size=2, max_size=50), st.floats(1e-3, 1e3))
def test_intervals_scale_with_weights_and_hold_the_sum(weights, factor):
    one, other = of_weights(np.array(weights)), of_weights(factor * np.array(weights))
    assert one.low < one.estimate < one.high
    assert one.upper < one.high
    assert (other.low, other.high) == pytest.approx((factor * one.low, factor * one.high), rel=1e-6)


def test_repetitions_that_agree_leave_nothing_open():
    found = of_repetitions(np.full(20, 1e-6))
    assert (found.low, found.estimate, found.high) == pytest.approx((1e-6, 1e-6, 1e-6))
    none = of_repetitions(np.zeros(20))
    assert (none.estimate, none.high) == (0.0, 1.0)


@pytest.mark.parametrize(("repetitions", "variation"), [(20, 0.3), (40, 1.0), (160, 1.5)])
def test_intervals_of_skewed_repetitions_hold_the_mean(repetitions, variation):
    """Lognormal ones of mean 1; the upper end misses it in at most as many cases as it should."""
    spread = np.sqrt(np.log(1.0 + variation**2))
    random = np.random.default_rng(3)
    sums = random.lognormal(-0.5 * spread**2, spread, (3000, repetitions))
    found = [of_repetitions(one) for one in sums]
    most = scipy.stats.binom.ppf(0.999, len(sums), 0.025)
    assert sum(one.low > 1.0 for one in found) <= most
    assert sum(one.high < 1.0 for one in found) <= most
    assert sum(one.upper < 1.0 for one in found) <= scipy.stats.binom.ppf(0.999, len(sums), 0.05)


def test_an_unsure_factor_widens_the_interval():
    sure = weighted([1.0] * 40, [1e-3] * 40, 1000)
    unsure = weighted([1.0] * 40, [2e-3] * 40, 1000, share=(1.6, 2.0, 2.5))
    p, q = sure.probability(0.5), unsure.probability(0.5)
    assert q.estimate == pytest.approx(2.0 * p.estimate)
    assert q.low == pytest.approx(2.0 * p.low * 0.8)
    assert q.high == pytest.approx(2.0 * p.high * 1.25)


def test_hits_are_what_equal_weights_would_be():
    assert weighted([1.0] * 7, [0.1] * 7, 10).hits(np.ones(7)) == pytest.approx(7.0)
    one = weighted([1.0, 1.0], [1.0, 1e-9], 10)
    assert one.hits(np.ones(2)) == pytest.approx(1.0)


def test_estimators_load_without_a_simulator():
    """They know points of normal space and scores alone: 12 modules of the package."""
    code = (
        "import sys, bridgegen.jobs.risk.estimators.subset as one; "
        "print(sum(name.startswith('bridgegen') for name in sys.modules))"
    )
    found = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert int(found.stdout) < 20
