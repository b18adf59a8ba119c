"""Against hand-worked and published values, scipy, and laws."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.stats import mannwhitneyu

from bridgegen.base.statistics import a12, effect, holm, mann_whitney, quartiles

INF, NAN = math.inf, math.nan
values = st.lists(st.integers(-5, 5).map(float) | st.just(INF), min_size=1, max_size=9)


def better(x, y, *, larger=True) -> float:
    return a12(np.array(x, float), np.array(y, float), larger_is_better=larger)


def test_a12_by_hand():
    # 1 ties once; 2 beats one and ties one; 4 beats all three.
    assert better([1, 2, 4], [1, 2, 3]) == pytest.approx((0.5 + 1.5 + 3.0) / 9)
    assert better([5, 6], [1, 2]) == 1.0
    assert better([5, 6], [1, 2], larger=False) == 0.0
    assert better([3, 3], [3]) == 0.5


def test_a12_takes_what_never_came_as_the_worst_of_what_should_be_small():
    # inf ties inf and loses to 100; 90 beats both.
    assert better([INF, 90.0], [INF, 100.0], larger=False) == pytest.approx((0.5 + 2.0) / 4)
    assert math.isnan(better([], [1.0]))
    assert better([NAN, 2.0], [1.0]) == 1.0


@settings(max_examples=30)
@given(values, values)
def test_a12_is_the_u_statistic_over_the_pairs(x, y):
    ranks = np.unique(np.array([*x, *y]), return_inverse=True)[1]
    u = mannwhitneyu(ranks[: len(x)], ranks[len(x) :]).statistic
    assert better(x, y) == pytest.approx(u / (len(x) * len(y)))


@settings(max_examples=30)
@given(values, values)
def test_a12_changes_sides_with_the_samples_and_with_what_is_better(x, y):
    assert better(x, y) == pytest.approx(1.0 - better(y, x))
    assert better(x, y) == pytest.approx(1.0 - better(x, y, larger=False))
    assert better(sorted(x), y) == better(x, y)


def test_effects_by_the_thresholds_of_their_authors():
    names = [effect(share) for share in (0.5, 0.559, 0.56, 0.64, 0.71, 0.29, 0.36, 0.44)]
    assert names == [
        "negligible", "negligible", "small", "medium", "large", "large", "medium", "small",
    ]  # fmt: skip


def test_holm_by_hand():
    # Sorted 0.01, 0.02, 0.03, 0.04, times 4, 3, 2, 1: 0.04, 0.06, 0.06, and never less again.
    assert holm([0.04, 0.01, 0.03, 0.02]) == pytest.approx([0.06, 0.04, 0.06, 0.06])
    assert holm([0.5, 0.6]) == [1.0, 1.0]
    corrected = holm([NAN, 0.02, 0.04])
    assert math.isnan(corrected[0])
    assert corrected[1:] == pytest.approx([0.04, 0.04])
    assert holm([]) == []


@settings(max_examples=30)
@given(st.lists(st.floats(0.0, 1.0), min_size=1, max_size=8), st.randoms())
def test_holm_keeps_the_order_and_never_makes_surer(p, random):
    corrected = holm(p)
    assert all(before <= after <= 1.0 for before, after in zip(p, corrected, strict=True))
    places = list(range(len(p)))
    random.shuffle(places)
    assert holm([p[k] for k in places]) == [corrected[k] for k in places]
    by_p = [one for _, one in sorted(zip(p, corrected, strict=True))]
    assert by_p == sorted(by_p)


def test_mann_whitney_by_hand_and_by_scipy():
    # All of x below all of y: the two outermost of C(9, 4) = 126 orders.
    x, y = [1.1, 2.2, 3.3, 4.0], [4.4, 5.5, 6.6, 7.7, 8.8]
    assert mann_whitney(np.array(x), np.array(y)) == pytest.approx(2 / 126)
    mixed = [1.1, 5.0, 7.0, 9.0]
    assert mann_whitney(np.array(mixed), np.array(y)) == mannwhitneyu(mixed, y).pvalue
    assert mann_whitney(np.array([INF, INF]), np.array([INF, INF])) == 1.0
    assert math.isnan(mann_whitney(np.array([NAN]), np.array([1.0])))


@settings(max_examples=30)
@given(values, values)
def test_mann_whitney_knows_only_ranks(x, y):
    p = mann_whitney(np.array(x), np.array(y))
    assert p == mann_whitney(np.array(x) ** 3 * 2.0, np.array(y) ** 3 * 2.0)
    assert p == pytest.approx(mann_whitney(np.array(y), np.array(x)))
    assert 0.0 <= p <= 1.0


@settings(max_examples=30)
@given(st.lists(st.floats(-1e6, 1e6), min_size=1, max_size=12))
def test_quartiles_are_numpy_s_where_all_is_finite(x):
    q = quartiles(np.array([*x, NAN]))
    assert (q.low, q.median, q.high) == pytest.approx(
        tuple(np.quantile(x, (0.25, 0.5, 0.75))), abs=1e-9
    )


def test_quartiles_with_what_never_came():
    q = quartiles(np.array([10.0, INF, 20.0, INF]))
    assert (q.low, q.median, q.high) == (17.5, INF, INF)
    assert quartiles(np.array([1.0, 2.0, INF])).median == 2.0
    assert math.isnan(quartiles(np.array([NAN])).median)
