import numpy as np
import pytest
from scipy import stats

from bridgegen.base.statistics import clopper_pearson, wilson
from bridgegen.search.regions.box import Evidence


@pytest.mark.parametrize(
    ("successes", "trials", "interval"),
    [
        # R. Newcombe, Statistics in Medicine 17 (1998) 857-872, Table I, method 5 ("exact").
        (81, 263, (0.2527, 0.3676)),
        (15, 148, (0.0578, 0.1617)),
        (0, 20, (0.0, 0.1684)),
        (1, 29, (0.0009, 0.1776)),
    ],
)
def test_intervals_are_the_published_ones(successes, trials, interval):
    assert clopper_pearson(successes, trials) == pytest.approx(interval, abs=5e-5)


@pytest.mark.parametrize("trials", [1, 7, 300])
@pytest.mark.parametrize("confidence", [0.9, 0.95])
def test_intervals_are_scipy_s_and_mirror_each_other(trials, confidence):
    for successes in {*range(0, trials + 1, 1 + trials // 20), trials}:
        ours = clopper_pearson(successes, trials, confidence)
        theirs = stats.binomtest(successes, trials).proportion_ci(confidence, "exact")
        assert ours == pytest.approx((theirs.low, theirs.high), abs=1e-9)
        low, high = clopper_pearson(trials - successes, trials, confidence)
        assert (1.0 - high, 1.0 - low) == pytest.approx(ours, abs=1e-12)


def test_the_interval_misses_the_truth_in_five_of_a_hundred_cases_at_most():
    counts = np.random.default_rng(0).binomial(40, 0.3, 5000)
    missed = [not low <= 0.3 <= high for low, high in (clopper_pearson(k, 40) for k in counts)]
    assert 0.01 < np.mean(missed) <= 0.05


def test_nothing_says_nothing():
    none = Evidence(0, 0, 7)
    assert (none.share, none.interval) == (None, (0.0, 1.0))
    assert Evidence(4, 1).share == 0.25


def test_weighted_rows_need_not_be_a_whole_number():
    low, high = clopper_pearson(0.7 * 41.5, 41.5)
    assert clopper_pearson(29, 42)[0] < low < 0.7 < high < clopper_pearson(29, 41)[1]
    assert clopper_pearson(3.0000000000000004, 3.0) == pytest.approx((0.025 ** (1 / 3), 1.0))


def test_wilson_is_what_is_worked_by_hand_and_near_the_exact_one():
    low, high = wilson(10, 100)
    assert (low, high) == pytest.approx((0.05522914, 0.17436566), abs=1e-7)
    for k, n in ((0, 50), (3, 1000), (844, 1000), (50, 50)):
        low, high = wilson(k, n)
        exact = clopper_pearson(k, n)
        assert low <= k / n <= high
        assert (low, high) == pytest.approx(exact, abs=0.03)
    assert wilson(0, 0) == (0.0, 1.0)
    assert wilson(0, 9)[0] == 0.0
    assert wilson(9, 9)[1] == 1.0
