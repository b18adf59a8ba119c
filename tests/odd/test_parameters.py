import math

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import ScenarioError, UnknownNameError
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.kinds import INTEGER, TOLERANCE, slack
from bridgegen.scenario.language.parameters import UNITS, Axis, Bound, Derived, Parameter, read_axes

GOOD = {
    "name": "speed",
    "axis": Axis.PARTICIPANTS,
    "unit": "m/s",
    "low": 1,
    "high": 3,
    "default": 2,
}

BAD = {
    "low <= high must hold for speed [m/s], got low=4, high=3": {"low": 4},
    "low <= default <= high must hold for speed [m/s], got low=1, default=9, high=3": {
        "default": 9
    },
    "low of speed [m/s] must be finite, got nan": {"low": math.nan},
    "high of speed [m/s] must be finite, got inf": {"high": math.inf},
    "default of speed [m/s] must be finite, got -inf": {"default": -math.inf},
    "unknown unit 'mph' of speed; known: " + ", ".join(UNITS): {"unit": "mph"},
    "default of speed [m/s] must be a whole number, got 2.5": {"default": 2.5, "kind": INTEGER},
    "a name is lower case letters, digits and '_', 64 at most, got 'Speed'": {"name": "Speed"},
    "'sqrt' has a meaning in formulas and cannot name a parameter": {"name": "sqrt"},
    "'if' has a meaning in formulas and cannot name a parameter": {"name": "if"},
    "'pi' has a meaning in formulas and cannot name a parameter": {"name": "pi"},
}  # fmt: skip


@pytest.mark.parametrize(("message", "change"), BAD.items())
def test_parameter_refused(message, change):
    with pytest.raises(ScenarioError) as caught:
        Parameter(**GOOD | change, place="s.yaml, line 3")
    assert caught.value.problems == (f"{message} (s.yaml, line 3)",)


def test_parameter_says_all_that_is_wrong_at_once():
    with pytest.raises(ScenarioError) as caught:
        Parameter("Speed", Axis.STATIC, "mph", math.nan, 1.0, 2.0)
    assert len(caught.value.problems) == 3


def test_place_is_no_part_of_what_a_parameter_is():
    assert Parameter(**GOOD, place="a") == Parameter(**GOOD, place="b")


def test_bound_needs_a_side_and_a_reason():
    with pytest.raises(ScenarioError) as caught:
        Bound("a", None, None, " ", "")
    assert caught.value.problems == (
        "the bound on a must say its why",
        "the bound on a must say its source",
        "the bound on a needs lo or hi",
    )


def test_derived_needs_a_reason_and_a_unit():
    with pytest.raises(ScenarioError) as caught:
        Derived("a", Axis.WEATHER, "Pa", parse("b"), "", "x")
    assert [problem[:20] for problem in caught.value.problems] == [
        "unknown unit 'Pa' of",
        "the derived a must s",
    ]


def test_rules_read_as_written():
    lo, hi = parse("b + 1"), parse("2*c")
    assert str(Bound("a", lo, hi, "w", "s")) == "a >= b + 1 and a <= 2*c"
    assert str(Bound("a", None, hi, "w", "s")) == "a <= 2*c"
    assert Bound("a", lo, hi, "w", "s").names == {"b", "c"}
    assert str(Derived("a", Axis.WEATHER, "m", hi, "w", "s")) == "a = 2*c"


def test_axes_by_name_in_their_order():
    assert read_axes(["weather", "static", "weather"]) == (Axis.STATIC, Axis.WEATHER)
    assert read_axes("weather") == (Axis.WEATHER,)
    assert read_axes([]) == ()
    with refuses(UnknownNameError, "wether", "weather"):
        read_axes(["wether"])


def test_values_rounded_to_four_decimals_keep_their_bounds():
    # Twice 50.00005, rounded to four decimals, beside 50.0000: off by 1e-4.
    assert np.abs(100.0001 - 2 * 50.0) <= slack(100.0)
    assert slack(0.0) == TOLERANCE == 1e-4
    assert slack(9.0) == pytest.approx(1e-3)
    assert slack(-100.0) == slack(100.0)


def test_shares_of_an_interval_by_hand():
    """Of 2.0 to 2.5, 2.1 to 2.2 has the shares 0.2 to 0.4; of no width, all or nothing."""
    one = Parameter("p", Axis.EXTENSION, "1", 0.0, 9.0, 0.0)
    assert one.shares(2.1, 2.2, 2.0, 2.5) == (pytest.approx(0.2), pytest.approx(0.4))
    assert one.shares(0.0, 9.0, 2.0, 2.5) == (0.0, 1.0)
    for low, high, expected in ((1.0, 3.0, (0.0, 1.0)), (2.0, 2.0, (0.0, 1.0))):
        assert one.shares(low, high, 2.0, 2.0) == expected
    for low, high in ((0.0, 1.5), (2.5, 3.0)):  # beside it: nothing between first and last
        first, last = one.shares(low, high, 2.0, 2.0)
        assert first >= last


def test_whole_numbers_in_a_range_by_hand():
    """Of 1 to 4, 1.2 to 3.9 holds 2 and 3: the second and the third quarter."""
    one = Parameter("n", Axis.EXTENSION, "1", 0, 9, 0, INTEGER)
    assert one.shares(1.2, 3.9, 1.0, 4.0) == (0.25, 0.75)
    assert one.ends(1.2, 3.9) == (2.0, 3.0)
    assert one.ends(2.0, 2.0) == (2.0, 2.0)
    assert Parameter("p", Axis.EXTENSION, "1", 0, 9, 0).ends(1.2, 3.9) is None
