"""Mined scenarios hold what was seen, keep their constraints, and say how often they are met."""

import math
import re
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve
from tests.mining.scenarios.planted import HOURS, KM, approaches, events, met, sought

from bridgegen.recordings.events.event import NOT_WHOLE
from bridgegen.recordings.scenarios import mined
from bridgegen.recordings.scenarios.mined import MinedScenario, Unmade, mined_scenario
from bridgegen.recordings.scenarios.ranges import (
    Range,
    around,
    bounds_of_speeds,
    held_in_words,
    with_room,
)
from bridgegen.scenario.exposure import exposure_of
from bridgegen.scenario.language.constraints import Constraints
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Axis, Bound, Parameter
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.space import SearchSpace

DOCS = Path(__file__).parents[3] / "docs"
SLOWER = DOCS / "examples" / "slower-lead.yaml"


@pytest.fixture(autouse=True)
def _few_replicates(monkeypatch):
    monkeypatch.setattr(mined, "REPLICATES", 20)


def make(one, found, folder):
    made, table = met(one, found, folder)
    return mined_scenario(one, made, [found], table, 0.05), made


def read(result, folder):
    path = folder / f"{result.name}.yaml"
    path.write_text(result.text, encoding="utf-8")
    return load(path)


def test_it_holds_what_was_seen_and_no_more(tmp_path):
    result, made = make(sought(SLOWER), approaches(90), tmp_path)
    assert isinstance(result, MinedScenario)
    scenario = read(result, tmp_path)
    assert scenario.name == "slower-lead-mined"
    for name in ("ego_speed", "slower_by", "gap"):
        seen, one = made.rows[name], scenario.parameters[name]
        step = 0.1 * np.ptp(seen)
        assert seen.min() - step < one.low <= seen.min()
        assert seen.max() <= one.high < seen.max() + step
        assert seen.min() <= one.default <= seen.max()
    space = scenario.space()
    X = space.decode(np.random.default_rng(1).random((2000, space.n_var)))
    lead = X[:, space.index("lead_speed")]
    speeds = made.rows["ego_speed"] - made.rows["slower_by"]
    assert lead.min() >= speeds.min() - 0.1
    assert lead.max() <= speeds.max() + 0.1
    assert not space.violations(X)


def test_its_exposure_counts_the_events_that_keep_its_constraints(tmp_path):
    found = approaches(90)
    quantities = dict(found.kinds[0].quantities)
    quantities["gap"][:7] = 1.0 + 0.5 * quantities["relative_speed"][:7]  # too near
    found = events("approach", quantities, {NOT_WHOLE: 30})
    result, _ = make(sought(SLOWER), found, tmp_path)
    exposure = exposure_of(read(result, tmp_path))
    assert exposure.encounters.count == 83
    share = 90 / 120  # the others are cut off
    assert exposure.encounters.hours == pytest.approx(share * HOURS)
    assert exposure.encounters.km == pytest.approx(share * KM)
    assert exposure.feasible_share.estimate > 0.5
    assert "1 recording (a recording)" in exposure.source
    approve(exposure.source, "30")


def test_the_same_events_give_the_same_bytes(tmp_path):
    texts = [make(sought(SLOWER), approaches(60), tmp_path)[0].text for _ in range(2)]
    assert texts[0] == texts[1]


def test_few_events_make_ranges_that_say_what_they_hold(tmp_path):
    result, made = make(sought(SLOWER), approaches(20), tmp_path)
    assert isinstance(result, MinedScenario)
    assert result.fit is None
    scenario = read(result, tmp_path)
    for name in ("ego_speed", "slower_by", "gap"):
        assert scenario.parameters[name].low <= made.rows[name].min()
        assert scenario.parameters[name].high >= made.rows[name].max()
    # Wilks's own table: 93 for 95 %; of 20, the root of 1 - 20 p^19 + 19 p^20 = 0.95 is 0.784.
    assert "holds at least 78 % of such encounters with 95 % confidence" in scenario.source
    assert not any("at least" in fact for fact in make(
        sought(SLOWER), approaches(60), tmp_path)[0].facts())  # fmt: skip
    assert "exposure:" not in result.text


@given(st.integers(2, 46), st.integers(0, 2**32 - 1))
def test_ranges_hold_that_share_with_that_confidence(count, seed):
    told = float(re.search(r"at least ([\d.]+) %", held_in_words(count))[1]) / 100.0
    # Shares of a uniform distribution, without loss of generality: 4,000 samples of so many.
    values = np.random.default_rng(seed).random((4000, count))
    kept = (np.ptp(values, axis=1) >= told - 0.005).mean()
    assert kept >= 0.95 - 4.5 * math.sqrt(0.95 * 0.05 / 4000)


def test_too_few_events_make_none_and_say_how_many_are_needed(tmp_path):
    result, _ = make(sought(SLOWER), approaches(4), tmp_path)
    enough = "5 are needed for ranges, 47 for a distribution"
    assert result == Unmade("slower-lead", f"4 events; {enough}")
    close = approaches(60, gap=np.full(60, 3.0))
    result, _ = make(sought(SLOWER), close, tmp_path)
    assert result == Unmade("slower-lead", f"0 of 60 events keep its constraints; {enough}")


def test_a_range_ends_where_the_scenario_cannot_hold_more(tmp_path):
    """Of lead-brakes, nothing keeps the gap from being none, but bodies must not overlap."""
    rng = np.random.default_rng(3)
    n = 120
    found = events("lead-brakes", {
        "ego_speed": rng.uniform(10.0, 24.0, n), "gap": np.linspace(0.05, 50.0, n),
        "deceleration": rng.uniform(2.0, 6.0, n), "low_speed": rng.uniform(0.0, 6.0, n),
        "lead_time": rng.uniform(0.5, 8.0, n), "lane_width": np.full(n, 3.5),
    })  # fmt: skip
    result, _ = make(sought("lead-brakes"), found, tmp_path)
    (gap,) = [one for one in result.ranges if one.parameter == "gap"]
    assert gap.mined == Range(12.0, 50.0)
    approve(gap.remark, "source")
    assert result.fit.outside


def test_a_scenario_with_files_beside_it_is_left_to_update(tmp_path):
    text = SLOWER.read_text(encoding="utf-8")
    (tmp_path / "more.yaml").write_text("fragment: more\ndescription: Nothing.\n")
    path = tmp_path / "mine.yaml"
    path.write_text(text.replace("[motorway, weather]", "[motorway, weather, more.yaml]"))
    result, _ = make(sought(path), approaches(60), tmp_path)
    assert result == Unmade("slower-lead", "more.yaml lies beside its file: use --update")


@given(st.floats(-1e3, 1e3), st.floats(1e-3, 1e3))
def test_ends_are_rounded_outwards_by_a_hundredth_of_the_width_or_less(low, width):
    one = around(low, low + width)
    assert low - 0.1 * width <= one.low <= low + 1e-6 * width
    assert low + width - 1e-6 * width <= one.high <= low + 1.1 * width


def parameter(name, low, high):
    return Parameter(name, Axis.PARTICIPANTS, "m", low, high, low)


@given(st.floats(-5, 5), st.floats(0.1, 9), st.floats(-5, 5), st.floats(0.1, 9), st.floats(0.5, 2))
def test_ranges_leave_room_for_constraints(a, wide_a, b, wide_b, factor):
    parameters = {"a": parameter("a", a, a + wide_a), "b": parameter("b", b, b + wide_b)}
    bounds = [
        Bound("b", parse(f"{factor!r} * a - 1"), None, "Because.", "Ours."),
        Bound("b", None, parse(f"{factor!r} * a + 20"), "Because.", "Ours."),
    ]
    made = with_room(parameters, bounds, [], ["a", "b"])
    SearchSpace(Constraints(made, tuple(bounds), (), (Axis.PARTICIPANTS,)))
    assert made["a"] == parameters["a"]
    assert made["b"].low <= b
    assert made["b"].high >= b + wide_b
    if factor * (a + wide_a) - 1 <= b + wide_b and factor * a + 20 >= b:
        assert made["b"] == parameters["b"]


@pytest.mark.parametrize("formula", [
    "ego_speed - slower_by", "ego_speed + slower_by", "2 * slower_by + ego_speed",
    "slower_by - ego_speed", "(ego_speed - 3*slower_by) / 2",
])  # fmt: skip
def test_speeds_stay_within_what_was_seen(formula):
    scenario = load(SLOWER)
    speed = replace(scenario.derived[-2], name="lead_speed", value=parse(formula))
    derived = tuple(speed if one.name == "lead_speed" else one for one in scenario.derived)
    scenario = replace(scenario, derived=derived)
    rng = np.random.default_rng(5)
    rows = {"ego_speed": rng.uniform(17.0, 30.0, 50), "slower_by": rng.uniform(2.0, 9.0, 50)}
    (bound,) = bounds_of_speeds(scenario, rows, ["ego_speed", "slower_by"], "Seen.")
    seen = speed.value.evaluate(rows)
    table = {"ego_speed": rng.uniform(0.0, 60.0, 4000), "slower_by": rng.uniform(-9.0, 40.0, 4000)}
    value, target = speed.value.evaluate(table), table[bound.target]
    kept = (target >= bound.lo.evaluate(table)) & (target <= bound.hi.evaluate(table))
    slack = 0.1 * np.ptp(seen)
    assert kept[(value >= seen.min()) & (value <= seen.max())].all()
    assert not kept[(value < seen.min() - slack) | (value > seen.max() + slack)].any()
