import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy import stats

from bridgegen.base.errors import InputError
from bridgegen.scenario.language.distributions import (
    TAIL,
    Discrete,
    Histogram,
    LogNormal,
    Normal,
    shares_within,
)

# Ours, and the same distribution as scipy knows it.
CONTINUOUS = {
    "normal": (Normal(10.0, 2.0), stats.norm(10.0, 2.0)),
    "normal, cut": (Normal(10.0, 2.0, (7.0, 11.0)), stats.truncnorm(-1.5, 0.5, 10.0, 2.0)),
    "normal, upper tail": (Normal(0.0, 1.0, (9.0, 12.0)), stats.truncnorm(9.0, 12.0)),
    "normal, lower tail": (Normal(0.0, 1.0, (-12.0, -9.0)), stats.truncnorm(-12.0, -9.0)),
    # Of a log-normal distribution with σ of the logarithm, mean = exp(μ + σ²/2) and
    # variance = (exp(σ²) − 1)·mean².
    "log-normal": (
        LogNormal.of(math.exp(0.58), (math.exp(0.16) - 1.0) * math.exp(1.16)),
        stats.lognorm(0.4, scale=math.exp(0.5)),
    ),
    "histogram": (
        Histogram.of([(2.0, 3.0), (0.0, 1.0)], [1.0, 3.0]),
        stats.rv_histogram((np.array([3.0, 0.0, 1.0]), np.array([0.0, 1.0, 2.0, 3.0]))),
    ),
}  # fmt: skip
DISCRETE = {
    "poisson": (Discrete.poisson(4.0), stats.poisson(4.0).pmf),
    "poisson, many": (Discrete.poisson(900.0), stats.poisson(900.0).pmf),
    "poisson, cut": (
        Discrete.poisson(4.0, (2.5, 6.0)),
        lambda k: stats.poisson(4.0).pmf(k) / stats.poisson(4.0).pmf([3, 4, 5, 6]).sum(),
    ),
    "set": (Discrete.of([70.0, 50.0, 60.0]), lambda k: np.full(len(k), 1.0 / 3.0)),
    "weights": (Discrete.of([1.0, 2.0], [1.0, 3.0]), lambda k: np.where(k == 1.0, 0.25, 0.75)),
}
EVERY = {**CONTINUOUS, **DISCRETE}


@pytest.mark.parametrize("name", CONTINUOUS)
def test_random_shares_are_distributed_as_stated(name):
    ours, theirs = CONTINUOUS[name]
    values = ours.value(np.random.default_rng(1).random(20_000))
    assert stats.kstest(values, theirs.cdf).pvalue > 0.01
    shifted = values + 0.05 * theirs.std()  # the test can tell
    assert stats.kstest(shifted, theirs.cdf).pvalue < 0.01


@pytest.mark.parametrize("name", CONTINUOUS)
def test_shares_are_those_of_scipy_s_inverse_distribution_function(name):
    ours, theirs = CONTINUOUS[name]
    share = np.linspace(0.001, 0.999, 97)
    cut = 3e-6 / theirs.pdf(theirs.ppf(share)).min()  # what TAIL moves a quantile by, at most
    assert ours.value(share) == pytest.approx(theirs.ppf(share), rel=1e-9, abs=cut)


@pytest.mark.parametrize("name", DISCRETE)
def test_values_come_as_often_as_stated(name):
    ours, pmf = DISCRETE[name]
    values = ours.value(np.random.default_rng(2).random(50_000))
    found, counts = np.unique(values, return_counts=True)
    expected = pmf(found) * 50_000
    usual = expected > 10.0
    p = stats.chisquare(
        counts[usual], expected[usual] * counts[usual].sum() / expected[usual].sum()
    )
    assert p.pvalue > 0.01
    assert set(found) <= set(ours.values)
    assert pmf(np.array(ours.values)).sum() == pytest.approx(1.0, abs=3 * TAIL)


@pytest.mark.parametrize("name", EVERY)
@given(share=st.lists(st.floats(0.0, 1.0), min_size=2, max_size=20))
def test_values_rise_with_their_shares_within_the_ends(name, share):
    ours = EVERY[name][0]
    values = ours.value(np.sort(share))
    assert (np.diff(values) >= 0.0).all()
    assert ours.low <= values[0]
    assert values[-1] <= ours.high
    ends = ours.value(np.array([0.0, 1.0]))
    assert ends == pytest.approx([ours.low, ours.high])
    back = ours.value(ours.share(values))
    assert back == pytest.approx(values, rel=1e-6, abs=1e-6)


def test_a_row_has_the_same_bits_in_any_batch():
    share = np.random.default_rng(3).random(37)
    for ours, _ in EVERY.values():
        alone = np.array([ours.value(share[k : k + 1])[0] for k in range(37)])
        assert np.array_equal(ours.value(share), alone)


BAD = {
    "a normal distribution needs a finite expected value and a variance above 0, got 1 and 0":
        lambda: Normal(1.0, 0.0),
    "a normal distribution (expected value 0, standard deviation 1) has no probability from 50 "
    "to 60":
        lambda: Normal(0.0, 1.0, (50.0, 60.0)),
    "a log-normal distribution needs an expected value and a variance above 0, got -1 and 1":
        lambda: LogNormal.of(-1.0, 1.0),
    "a log-normal distribution is above 0, got the limit 0":
        lambda: LogNormal.of(1.0, 1.0, (0.0, 2.0)),
    "a Poisson distribution needs an expected value above 0, at most 1e+08, got 0":
        lambda: Discrete.poisson(0.0),
    "a Poisson distribution (expected value 2) has a probability below 1e-06 from 90 to 99":
        lambda: Discrete.poisson(2.0, (90.0, 99.0)),
    "weights must be at least 0 and finite, and one above 0, got 0, 0":
        lambda: Discrete.of([1.0, 2.0], [0.0, 0.0]),
    "weights must be at least 0 and finite, and one above 0, got -1":
        lambda: Histogram.of([(0.0, 1.0)], [-1.0]),
    "the values must be finite, got 1.0, inf": lambda: Discrete.of([1.0, math.inf]),
    "low < high must hold for a bin, got 2 and 1": lambda: Histogram.of([(2.0, 1.0)], [1.0]),
    "bins must not overlap, got 0 to 2 and 1 to 3":
        lambda: Histogram.of([(1.0, 3.0), (0.0, 2.0)], [1.0, 1.0]),
}  # fmt: skip


@pytest.mark.parametrize("message", BAD)
def test_what_is_no_distribution_is_refused(message):
    with pytest.raises(InputError) as caught:
        BAD[message]()
    assert str(caught.value) == message


@pytest.mark.parametrize("name", EVERY)
@given(ends=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), off=st.floats(-0.5, 0.5))
def test_shares_within_a_range_are_those_of_its_values(name, ends, off):
    ours, _ = EVERY[name]
    low, high = sorted(ours.low + end * (ours.high - ours.low) + off for end in ends)
    first, last = map(float, shares_within(ours, low, high))
    shares = np.concatenate([np.linspace(0.0, 1.0, 500), np.linspace(first, last, 50)])
    value, bits = ours.value(shares), 1e-9  # of the special functions
    between = (first <= shares) & (shares < last)
    assert ((low - bits <= value) & (value <= high + bits))[between].all()
    outside = (shares < first) | (shares > last)
    assert not ((low + bits < value) & (value < high - bits))[outside].any()


@pytest.mark.parametrize("name", CONTINUOUS)
def test_a_density_is_the_slope_of_the_share(name):
    ours, theirs = CONTINUOUS[name]
    inner = np.linspace(ours.low, ours.high, 23)[1:-1]
    mass = theirs.cdf(ours.high) - theirs.cdf(ours.low)
    assert ours.density(inner) == pytest.approx(theirs.pdf(inner) / mass, rel=1e-9)
    outside = np.array([ours.low - 1e-3, ours.high + 1e-3])
    assert ours.density(outside).tolist() == [0.0, 0.0]


def test_a_density_of_single_values_and_of_bins():
    single = Discrete.of([3.0, 1.0, 3.0], [1.0, 2.0, 1.0])
    assert single.density(np.array([1.0, 2.0, 3.0, 4.0])).tolist() == [0.5, 0.0, 0.5, 0.0]
    bins = Histogram.of([(0.0, 2.0), (3.0, 4.0)], [1.0, 3.0])
    x = np.array([-1.0, 1.0, 2.5, 3.5, 4.5])
    assert bins.density(x).tolist() == [0.0, 0.125, 0.0, 0.75, 0.0]
