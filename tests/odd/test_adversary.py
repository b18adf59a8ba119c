import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.scenario.language.adversary import (
    PERIOD,
    adversarial,
    first_speed,
    limits,
    room,
    top_speed,
)
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load


def test_its_decisions_take_the_place_of_the_events():
    plain = load("crossroads-s4")
    scenario = adversarial(plain)
    who = scenario.adversary
    assert who is not None
    assert who.participant == "bv"
    assert not [event for event in scenario.events if event.participant == "bv"]
    assert scenario.events == tuple(e for e in plain.events if e.participant != "bv")
    n = int(plain.duration / PERIOD)
    assert len(who.paces) == len(who.offsets) == n
    assert who.controls[:2] == ("bv_pace_01", "bv_offset_01")
    searched = scenario.space().variables
    assert {*who.controls} <= {*searched}
    assert Axis.EXTENSION in scenario.axes
    # When it sets off is its own affair; how fast it may be is still the scenario's.
    assert {"bv_trigger_time", "bv_trigger_distance"} <= {*plain.space().variables} - {*searched}
    assert "bv_speed" in searched


def test_its_limits_are_the_scenario_s():
    scenario = adversarial(load("crossroads-s4"))
    who = scenario.adversary
    space = scenario.space()
    X = space.decode(np.random.default_rng(1).random((50, space.n_var)))
    for x in X:
        values = space.values(x)
        assert first_speed(who, values) == 0.0
        assert top_speed(who, values) == values["bv_speed"]
        rate, braking = limits(who, values)
        assert rate == 3.0  # of the scenario's event
        assert braking == pytest.approx(min(9.0, 0.85 * 9.81 * values["friction"]))
        assert room(who, values) == pytest.approx(0.5 * (values["lane_width"] - 1.9) - 0.1)


def test_what_it_leaves_alone_stays_as_it_was():
    plain, scenario = load("crossroads-s4"), adversarial(load("crossroads-s4"))
    assert scenario.fingerprint != plain.fingerprint
    for name, one in plain.parameters.items():
        if name not in ("bv_trigger_time", "bv_trigger_distance"):
            assert scenario.parameters[name] == one
    assert plain.adversary is None


@pytest.mark.parametrize(
    ("name", "who", "message"),
    [
        ("crossroads-s4", "ego", "may move, got 'ego'; it can drive: bv"),
        ("pedestrian-at-night", None, "needs a vehicle other than the ego"),
    ],
)
def test_who_cannot_be_driven_is_named(name, who, message):
    with pytest.raises(InputError) as error:
        adversarial(load(name), who)
    assert message in str(error.value)


def test_who_is_not_there_is_named():
    with refuses(UnknownNameError, "bv"):
        adversarial(load("crossroads-s4"), "bw")
