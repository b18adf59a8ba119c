"""Forms against scipy.stats, and laws that all of them keep."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy import integrate, special, stats
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.scenario.exposure.candidates import Recipe, estimate, fit, usual_bandwidth
from bridgegen.scenario.exposure.families import FAMILIES
from bridgegen.scenario.exposure.forms import Naming, build_marginal
from bridgegen.scenario.exposure.marginals import Conditional, Spliced, Truncated
from bridgegen.scenario.language.exposure_schema import MarginalSection
from bridgegen.scenario.language.parameters import Axis, Parameter

GAP = Parameter("gap", Axis.PARTICIPANTS, "m", 5.0, 80.0, 30.0)
NAMING = Naming(frozenset({"gap", "ego_speed"}), {}, None)

SCIPY = {
    "normal": (stats.norm(loc=30.0, scale=12.0), (30.0, 12.0)),
    "lognormal": (stats.lognorm(0.7, scale=25.0), (25.0, 0.7)),
    "exponential": (stats.expon(scale=20.0), (20.0,)),
    "gamma": (stats.gamma(2.3, scale=11.0), (2.3, 11.0)),
    "weibull": (stats.weibull_min(1.7, scale=28.0), (1.7, 28.0)),
    "beta": (stats.beta(2.0, 3.5, loc=5.0, scale=75.0), (2.0, 3.5)),
    "pareto": (stats.genpareto(0.3, loc=4.0, scale=9.0), (4.0, 0.3, 9.0)),
}
"""By family: scipy's distribution before it is cut off, and our numbers of it."""

SECTIONS = {
    "uniform": {"distribution": "uniform", "low": 10.0},
    "normal far out": {"distribution": "normal", "mean": -40.0, "deviation": 7.0},
    "lognormal with unit": {"distribution": "lognormal", "median": "0.02 km", "log_deviation": 0.4},
    "exponential tail": {"distribution": "pareto", "threshold": 5.0, "shape": 0.0, "scale": 9.0},
    "ends": {"distribution": "pareto", "threshold": 5.0, "shape": -0.4, "scale": 25.0},
    "beta": {"distribution": "beta", "alpha": 0.7, "beta": 2.0, "high": 60.0},
    "weibull": {"distribution": "weibull", "shape": 2.5, "scale": 30.0},
    "histogram": {"distribution": "histogram", "edges": [5, 20, 30, 80], "weights": [1, 3, 0.5]},
    "polygon": {"distribution": "polygon", "at": [6, 20, 50, 70], "density": [0, 2, 2, 0.5]},
    "mixture": {
        "distribution": "mixture",
        "parts": [
            {"distribution": "normal", "mean": 20.0, "deviation": 4.0, "weight": 2.0},
            {"distribution": "gamma", "shape": 9.0, "scale": 6.0, "low": 30.0, "weight": 1.0},
        ],
    },
    "tails": {
        "distribution": "normal",
        "mean": 35.0,
        "deviation": 11.0,
        "lower_tail": {"threshold": 15.0, "share": 0.05, "scale": 3.0, "shape": -0.2},
        "upper_tail": {"threshold": 55.0, "share": 0.1, "scale": 6.0, "shape": 0.2},
    },
    "beta with tail": {
        "distribution": "beta",
        "alpha": 2.0,
        "beta": 2.0,
        "upper_tail": {"threshold": 70.0, "share": 0.01, "scale": 3.0, "shape": 0.0},
    },
}


MIXED_BADLY = {"distribution": "mixture", "parts": [{"distribution": "uniform", "weight": 0}]}


def tail(threshold, share):
    return {"threshold": threshold, "share": share, "scale": 1, "shape": 0}


def made(section):
    return build_marginal(MarginalSection.model_validate(section), GAP, NAMING, "here")


@pytest.mark.parametrize("name", SCIPY)
def test_families_are_those_of_scipy_within_the_range(name):
    whole, numbers = SCIPY[name]
    low, high = (5.0, 80.0) if name == "beta" else (8.0, 70.0)  # beta's support is its range
    ours = Truncated(FAMILIES[name], numbers, low, high)
    mass = whole.cdf(high) - whole.cdf(low)
    x = np.linspace(low, high, 41)
    below, above = ours.tails(x)
    assert np.allclose(below, (whole.cdf(x) - whole.cdf(low)) / mass, atol=1e-14)
    assert np.allclose(above, (whole.sf(x) - whole.sf(high)) / mass, atol=1e-14)
    inner = x[1:-1]
    assert np.allclose(ours.log_density(inner), whole.logpdf(inner) - np.log(mass), rtol=1e-10)
    assert np.all(np.isneginf(ours.log_density(np.array([low - 0.1, high + 0.1]))))


@pytest.mark.parametrize("name", SCIPY)
def test_the_far_tails_keep_their_digits(name):
    whole, numbers = SCIPY[name]
    ends = (5.0, 80.0) if name == "beta" else ()
    p = np.array([1e-30, 1e-12, 1e-3])
    above = FAMILIES[name].value_above(p, *numbers, *ends)
    assert np.allclose(above, whole.isf(p), rtol=1e-8)
    assert np.allclose(FAMILIES[name].value_below(p, *numbers, *ends), whole.ppf(p), rtol=1e-8)
    near = above if name != "beta" else above[1:]  # 1e-30 of it is nearer to 80 than doubles are
    assert np.allclose(FAMILIES[name].above(near, *numbers, *ends), p[-len(near) :], rtol=1e-3)


@pytest.mark.parametrize("name", SECTIONS)
def test_a_density_integrates_to_the_share_between(name):
    form = made(SECTIONS[name])
    corners = np.linspace(form.low, form.high, 7)
    breaks = [5, 6, 10, 15, 20, 30, 50, 55, 60, 70]
    for low, high in pairwise(corners):
        inside = [one for one in breaks if low < one < high]
        area, _ = integrate.quad(
            lambda x: float(np.exp(form.log_density(np.array([x])))[0]),
            low, high, points=inside or None, limit=200,
        )  # fmt: skip
        below, _ = form.tails(np.array([low, high]))
        assert area == pytest.approx(below[1] - below[0], abs=2e-6)
    below, above = form.tails(np.array([form.low, form.high]))
    assert (below[0], above[1]) == (0.0, 0.0)
    assert (below[1], above[0]) == (pytest.approx(1.0), pytest.approx(1.0))


@pytest.mark.parametrize("name", SECTIONS)
@settings(deadline=None, max_examples=60)
@given(z=st.lists(st.floats(-6.0, 6.0), min_size=1, max_size=20))
def test_a_value_has_the_tail_that_it_was_asked_for(name, z):
    form = made(SECTIONS[name])
    z = np.array(z)
    tail, upper = special.ndtr(-np.abs(z)), z > 0.0
    x = form.value(tail, upper)
    assert np.all((form.low <= x) & (x <= form.high))
    below, above = form.tails(x)
    # As far as doubles go: a value is known to its spacing, a share of the plain forms to 1e-16.
    density = np.exp(np.where(np.isfinite(log := form.log_density(x)), log, 0.0))
    known = 4.0 * np.spacing(np.abs(x)) * np.maximum(density, 1.0) + 4e-16
    known += 4e-14 if name == "normal far out" else 0.0  # 6 deviations out: 41 times the spacing
    assert np.all(np.abs(np.where(upper, above, below) - tail) <= 1e-10 * tail + known)


@pytest.mark.parametrize("name", SECTIONS)
def test_values_have_the_same_bits_in_any_batch(name):
    form = made(SECTIONS[name])
    random = np.random.default_rng(3)
    tail, upper = 0.5 * random.random(257), random.random(257) < 0.5
    whole = form.value(tail, upper)
    for k in (0, 1, 100, 256):
        one = form.value(tail[k : k + 1], upper[k : k + 1])
        assert one[0] == whole[k]
        assert form.log_density(one)[0] == form.log_density(whole)[k]
        assert form.tails(one)[0][0] == form.tails(whole)[0][k]


def test_a_tail_has_its_share_beyond_its_threshold():
    form = made(SECTIONS["tails"])
    assert isinstance(form, Spliced)
    below, above = form.tails(np.array([15.0, 55.0]))
    assert below[0] == pytest.approx(0.05, abs=1e-15)
    assert above[1] == pytest.approx(0.1, abs=1e-15)
    beyond = stats.genpareto(0.2, loc=55.0, scale=6.0)
    x = np.linspace(56.0, 79.0, 9)
    assert np.allclose(form.tails(x)[1], 0.1 * (1 - beyond.cdf(x) / beyond.cdf(80.0)))
    short = stats.genpareto(-0.2, scale=3.0)  # ends at 15 m below the threshold
    y = np.linspace(0.5, 9.5, 9)
    assert np.allclose(form.tails(15.0 - y)[0], 0.05 * (1 - short.cdf(y) / short.cdf(10.0)))


def test_a_kernel_density_is_that_of_scipy_reflected():
    values = np.random.default_rng(5).gamma(1.0, 12.0, 300)  # many of them near 0
    values = values[values < 60.0]
    h = usual_bandwidth(values)
    ours = estimate(values, h, 0.0, 60.0)
    x = np.linspace(0.0, 60.0, 61)
    images = [values, -values, 120.0 - values]
    exact = sum(stats.norm.pdf((x[:, None] - one) / h).sum(axis=1) for one in images)
    exact /= len(values) * h
    assert np.allclose(np.exp(ours.log_density(x)), exact, rtol=5e-3, atol=1e-5)


@pytest.mark.parametrize(
    ("section", "rule"),
    [
        ({"distribution": "normal", "mean": 3.0}, "must have the key 'deviation'"),
        ({"distribution": "normal", "mean": 3.0, "deviation": -1.0}, "deviation must be above 0"),
        ({"distribution": "normal", "mean": 3.0, "deviation": 1, "scale": 2}, "no key 'scale'"),
        ({"distribution": "normal", "mean": -900.0, "deviation": 1.0}, "must have probability"),
        ({"distribution": "normal", "mean": "3 s", "deviation": 1.0}, "mean must be a number in m"),
        ({"distribution": "uniform", "low": 1.0}, "low must be in the range of gap"),
        ({"distribution": "uniform", "low": 50, "high": 20}, "low < high must hold"),
        ({"distribution": "histogram", "edges": [5, 90]}, "edges must be in the range"),
        ({"distribution": "histogram", "edges": [9, 8]}, "edges must ascend"),
        ({"distribution": "histogram", "edges": [5, 9], "weights": [1, 2]}, "as many weights"),
        ({"distribution": "histogram", "edges": [5, 9], "weights": [-1]}, "at least 0"),
        ({"distribution": "polygon", "at": [5, 9], "density": [0, 0]}, "integral above 0"),
        ({"distribution": "polygon", "at": [5, 9], "density": [-1, 3]}, "at least 0"),
        ({"distribution": "discrete", "values": [100.0]}, "the value 100.0 must be in the range"),
        (MIXED_BADLY, "above 0"),
        ({"distribution": "normal", "mean": "2*speed", "deviation": 1}, "unknown 'speed'"),
        ({"distribution": "normal", "mean": "2*gap", "deviation": 1}, "depends on gap itself"),
        ({"distribution": "normal", "mean": "2*", "deviation": 1}, "cannot read the formula"),
        ({"distribution": "kde", "file": "../x.csv", "bandwidth": 1}, "lies beside the file"),
        (
            {**SECTIONS["normal far out"], "upper_tail": tail(90, 0.1)},
            "threshold of a tail must be between 5 and 80",
        ),
        (
            {**SECTIONS["uniform"], "upper_tail": tail(60, 0.1)},
            "no key 'upper_tail'",
        ),
        (
            {**SECTIONS["weibull"], "upper_tail": tail(60, 1.1)},
            "shares of tails must be above 0, and below 1",
        ),
    ],
)  # fmt: skip
def test_what_is_no_distribution_is_refused_in_one_sentence(section, rule):
    with pytest.raises(InputError) as error:
        made(section)
    assert rule in str(error.value)


def test_a_formula_gives_each_row_its_own_distribution():
    one = made({"distribution": "normal", "mean": "2 * ego_speed", "deviation": "0.1*ego_speed"})
    assert isinstance(one, Conditional)
    speeds = np.array([10.0, 20.0, 30.0])
    given_ = one.given({"ego_speed": speeds})
    x = np.array([20.0, 45.0, 50.0])
    for k, speed in enumerate(speeds):
        alone = Truncated(FAMILIES["normal"], (2.0 * speed, 0.1 * speed), 5.0, 80.0)
        assert given_.tails(x)[0][k] == alone.tails(x[k : k + 1])[0][0]
    with refuses(InputError, "deviation", "-0.5"):
        one.given({"ego_speed": np.array([10.0, -5.0])})


@pytest.mark.parametrize("name", [one for one in SCIPY if one != "pareto"])
def test_a_fit_finds_what_was_planted(name):
    numbers = SCIPY[name][1]
    planted = Truncated(FAMILIES[name], numbers, 5.0, 80.0)
    share = np.random.default_rng(11).random(4000)
    values = planted.value(np.minimum(share, 1.0 - share), share > 0.5)
    found = fit(values, Recipe(name), 5.0, 80.0)
    fitted = [found.section[key] for key in FAMILIES[name].keys]
    assert fitted == pytest.approx(numbers, rel=0.12)
    # No other numbers nearby are likelier: it is a maximum.
    best = planted_log(name, fitted, values)
    for k in range(len(fitted)):
        for factor in (0.98, 1.02):
            other = [one * (factor if i == k else 1.0) for i, one in enumerate(fitted)]
            assert planted_log(name, other, values) <= best + 1e-3


def planted_log(name, numbers, values):
    return float(Truncated(FAMILIES[name], tuple(numbers), 5.0, 80.0).log_density(values).sum())
