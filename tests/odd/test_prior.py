"""Weather as it is met: priors, how a search draws by them, and what findings say of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.base.errors import ScenarioError
from bridgegen.scenario.language.parameters import Axis, Parameter
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.prior import Band, Prior, rarities, surprise
from bridgegen.scenario.language.reader import build, load, shipped_text
from bridgegen.search.triage.conditions import _Span, _words

RAIN = Prior(0.0, 100.0, (Band("dry", 0.0, 0.9), Band("rain", 100.0, 0.1)), "made up")
SUN = Prior(-90.0, 50.0, (Band("night", 0.0, 0.25), Band("day", 50.0, 0.75)), "made up")
PRIORS = {"rain": RAIN, "sun": SUN}
NIGHT = "sun_altitude_angle"


def drawn(name: str, n: int = 20_000):
    space = load(name).space()
    X = space.decode(np.random.default_rng(3).random((n, space.n_var)))
    assert not space.violations(X)
    return lambda column: X[:, space.index(column)]


def shares(prior, lo, hi):
    return prior.at(np.linspace(0.0, 1.0, 100_001), lo, hi)


def test_shares_of_bands_are_drawn():
    assert (shares(RAIN, 0.0, 100.0) == 0.0).mean() == pytest.approx(0.9, abs=1e-4)
    assert (shares(SUN, -90.0, 50.0) < 0.0).mean() == pytest.approx(0.25, abs=1e-4)
    assert RAIN.at(np.array([0.95]), 0.0, 100.0) == pytest.approx(50.0)


def test_a_bound_on_one_side_leaves_the_other_its_share():
    assert (shares(SUN, -90.0, 12.5) < 0.0).mean() == pytest.approx(0.25, abs=1e-4)
    assert (shares(RAIN, 0.0, 10.0) == 0.0).mean() == pytest.approx(0.9, abs=1e-4)


def test_a_bound_that_leaves_no_zero_conditions():
    assert SUN.at(np.array([0.0, 0.5, 1.0]), -90.0, -6.0) == pytest.approx([-90.0, -48.0, -6.0])
    assert RAIN.at(np.array([0.0, 0.5, 1.0]), 50.0, 100.0) == pytest.approx([50.0, 75.0, 100.0])


@given(
    st.sampled_from(sorted(PRIORS)),
    st.lists(st.floats(0.0, 1.0), min_size=2, max_size=2),
    st.lists(st.floats(0.0, 1.0), min_size=1, max_size=20),
)
def test_values_have_shares_and_ascend(name, ends, at):
    prior = PRIORS[name]
    lo, hi = sorted(prior.low + share * (prior.high - prior.low) for share in ends)
    share = np.sort(np.array(at))
    value = prior.at(share, lo, hi)
    assert np.all((lo <= value) & (value <= hi))
    assert np.all(np.diff(value) >= 0.0)
    again = prior.share(value, lo, hi)
    assert np.all((again >= 0.0) & (again <= 1.0))
    np.testing.assert_allclose(prior.at(again, lo, hi), value, atol=1e-6)
    each = np.concatenate([prior.at(share[k : k + 1], lo, hi) for k in range(len(share))])
    assert np.array_equal(each, value)  # a row has the same bits alone


@given(st.lists(st.floats(0.0, 100.0), min_size=2, max_size=2))
def test_shares_of_a_range_are_those_at_which_values_lie_in_it(ends):
    low, high = sorted(ends)
    first, last = RAIN.shares(low, high, 0.0, 100.0)
    assert float(last - first) == pytest.approx(RAIN.met(low, high), abs=1e-9)
    if last > first:
        value = RAIN.at(np.stack([first, last]), 0.0, 100.0)
        assert low - 1e-6 <= value[0] or low == 0.0
        assert value[1] <= high + 1e-6


@pytest.mark.parametrize("name", ["cut-in", "crossroads-s4", "lead-brakes"])
def test_a_search_spends_its_rows_where_people_drive(name):
    column = drawn(name)
    assert (column("precipitation") == 0.0).mean() == pytest.approx(0.9, abs=0.01)
    assert (column(NIGHT) < -6.0).mean() == pytest.approx(0.184, abs=0.015)
    assert (column("fog_density") > 43.0).mean() == pytest.approx(0.016, abs=0.008)
    assert column("precipitation").max() > 74.0  # heavy rain is met, too


def test_scenarios_of_night_and_fog_stay_there():
    assert drawn("pedestrian-at-night")(NIGHT).max() <= -6.0
    assert drawn("jam-tail-in-fog")("fog_density").min() >= 50.0
    assert drawn("jam-tail-in-fog")("fog_density").max() > 85.0


def test_the_papers_scenarios_are_even():
    assert (drawn("paper/crossroads-s4")("precipitation") == 0.0).mean() < 0.01
    assert not any(item.prior for item in load("paper/crossroads-s1").parameters.values())


def edited(old: str, new: str):
    text = shipped_text("cut-in").decode()
    assert old in text
    return build(read_plain_yaml(text.replace(old, new).encode(), "mine.yaml"), None)


def test_a_file_may_ask_for_even_weather():
    axes = "axes: [participants, weather]\n"
    scenario = edited(axes, f"{axes}priors: even\n")
    assert not any(item.prior for item in scenario.parameters.values())
    assert scenario.fingerprint != load("cut-in").fingerprint


PRIOR = "    prior: {source: made up, bands: {all: [33, 1]}}\n"
SPEED = "    description: Speed at which the ego starts, and its target.\n"


def test_only_weather_has_a_prior():
    with pytest.raises(ScenarioError, match="only a float of the axis weather can have a prior"):
        edited(SPEED, SPEED + PRIOR)


@pytest.mark.parametrize(
    ("bands", "rule"),
    [
        ([("a", 0, 0.5), ("b", 0, 0.5)], "must ascend"),
        ([("a", 0, 0.5), ("b", 90, 0.5)], "must ascend from 0 to 100"),
        ([("a", 0, 0.5), ("b", 100, 0.6)], "1 together, got"),
        ([("a", 0, 0.0), ("b", 100, 1.0)], "above 0"),
        ([("a", 0, float("nan")), ("b", 100, 1.0)], "above 0"),
    ],
)
def test_bands_keep_their_rules(bands, rule):
    with pytest.raises(ScenarioError, match=rule):
        Prior(0.0, 100.0, tuple(Band(*band) for band in bands), "made up")


def test_findings_say_how_often_their_weather_is_met():
    space = load("cut-in").space()
    dark = _Span(-60.0, -6.0, below=False, above=True)
    assert _words(space, NIGHT, dark) == "≤ -6 deg (night, 18 % of driving)"
    wet = _Span(74.5, 90.0, below=True, above=False)
    assert _words(space, "precipitation", wet) == "≥ 74.5 % (heavy rain, 0.098 % of driving)"
    one = _Span(80.0, 80.0, below=True, above=True)
    assert _words(space, "precipitation", one) == "= 80 % (heavy rain, 0.1 % of driving)"
    fast = _Span(30.0, 33.0, below=True, above=False)
    assert _words(space, "ego_speed", fast) == "≥ 30 m/s"


def test_common_weather_surprises_less():
    space = load("cut-in").space()
    usual = space.values(space.row({"sun_altitude_angle": 30.0}))
    rare = usual | {"precipitation": 80.0, "sun_altitude_angle": -30.0}
    assert surprise(space.bands(usual)) < surprise(space.bands(rare))
    assert rarities(space.bands(rare)) == "heavy rain (0.1 % of driving), night (18 %)"
    assert rarities(space.bands(usual)) == ""


def test_a_parameter_without_a_prior_is_even():
    plain = Parameter("p", Axis.WEATHER, "%", 0.0, 100.0, 0.0)
    assert plain.at(np.array([0.25]), 0.0, 100.0) == pytest.approx(25.0)
