"""Which trajectories of a driver are accepted, and what a refusal says."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.interface import ROUTE_POINTS, Observation, Trajectory
from bridgegen.drivers.trajectory import checked_plans
from bridgegen.drivers.user_drivers import Traits, traits_of

N, PERIOD = 3, 0.2
TIME = np.linspace(0.0, 1.0, 11)


def observation(running=(True, True, True)):
    zeros, speeds = np.zeros(N), np.array([5.0, 10.0, 20.0])
    return Observation(
        time=3.0, running=np.array(running), x=100.0 * np.arange(N), y=zeros, h=zeros, v=speeds,
        a=zeros, target_speed=speeds, offset=zeros, route=np.zeros((N, ROUTE_POINTS, 4)),
        tracks=np.zeros((N, 1, 13)), stop_distance=np.full(N, np.inf), light=np.zeros(N, np.int8),
    )  # fmt: skip


def straight(time=TIME):
    """All go straight on at their speed."""
    seen = observation()
    times = np.broadcast_to(time, (N, np.shape(time)[-1]))
    x = seen.x[:, None] + seen.v[:, None] * times
    nothing = np.zeros(x.shape)
    return Trajectory(time, x, nothing, nothing, nothing + seen.v[:, None])


def changed(name, row, state, value):
    made = straight()
    array = np.array(getattr(made, name))
    array[row, state] = value
    return replace(made, **{name: array})


def test_a_plan_is_kept_as_it_is():
    states = checked_plans(straight(), observation(), PERIOD).states
    assert states.shape == (N, 12, 6)
    np.testing.assert_array_equal(states[:, 1:, 0], np.tile(TIME, (N, 1)))
    np.testing.assert_array_equal(states[:, 1:, 1], straight().x)
    np.testing.assert_array_equal(states[:, 0, 1:5], states[:, 1, 1:5])


def test_a_plan_that_begins_later_begins_at_the_ego():
    states = checked_plans(straight(TIME + 0.1), observation(), PERIOD).states
    assert states[:, :2, 0].tolist() == [[0.0, 0.1]] * N
    np.testing.assert_array_equal(states[:, 0, 1], observation().x)


def test_times_of_their_own_for_each_scenario():
    shared = checked_plans(straight(), observation(), PERIOD)
    own = checked_plans(straight(np.tile(TIME, (N, 1))), observation(), PERIOD)
    np.testing.assert_array_equal(own.states, shared.states)


def test_what_is_planned_for_an_ended_scenario_is_not_looked_at():
    made = changed("x", 1, 4, np.nan)
    states = checked_plans(made, observation((True, False, True)), PERIOD).states
    assert np.isfinite(states).all()
    with refuses(InputError, "x [m]", "nan in state 4"):
        checked_plans(made, observation(), PERIOD)


@pytest.mark.parametrize(
    ("planned", "what", "value"),
    [
        (straight(TIME[::-1].copy()), "times", "0.9 s after 1 s"),
        (straight(np.repeat(TIME, 2)), "times", "0 s after 0 s"),
        (straight(TIME - 0.5), "first time", "-0.5 s"),
        (straight(TIME + 3.0), "first time", "3 s"),
        (straight(TIME / 10.0), "last time", "0.1 s"),
        (straight(TIME[:1]), "last time", "0 s"),
        (straight(np.linspace(0.0, 1.0, 1001)), "1..1000", "(1001,)"),
        (straight(TIME[:0]), "1..1000", "(0,)"),
        (replace(straight(), y=np.zeros(N)), "y", "(3,)"),
        (replace(straight(), v="fast"), "a trajectory", "numbers"),
        (replace(straight(), h=None), "h", "()"),
        (replace(straight(), time=0.5), "time", "()"),
        (changed("h", 2, 10, np.inf), "h [rad]", "inf in state 10"),
        (changed("v", 0, 3, -1.0), "speeds", "-1 m/s at 0.3 s"),
        (replace(straight(), y=np.full((N, 11), 2.5)), "first state", "2.50 m"),
        (replace(straight(), h=np.full((N, 11), np.pi)), "first heading", "180°"),
        (changed("x", 2, 5, 120.0 + 200.0), "from 0.4 s to 0.5 s", "112.00 m"),
        (changed("x", 1, slice(3, None), 101.0 + np.arange(8)), "from 0.2 s to 0.3 s", "1.00 m"),
    ],
)  # fmt: skip
def test_a_bad_plan_is_refused_in_one_sentence(planned, what, value):
    with refuses(InputError, what, value) as error:
        checked_plans(planned, observation(), PERIOD)
    assert "\n" not in str(error.value)


def test_rounding_is_no_fault():
    seen = observation()
    v = np.array(straight().v)
    v[0, -1] = -1e-9
    made = replace(straight(), h=np.full((N, 11), 6.0 * np.pi), v=v)
    assert checked_plans(made, seen, PERIOD).states[0, -1, 4] == 0.0


def test_a_period_is_a_whole_number_of_steps():
    assert [Traits(period=one).steps(0.05) for one in (None, 0.05, 0.07, 0.08, 0.5)] == [
        1, 1, 1, 2, 10
    ]  # fmt: skip
    assert Traits(period=0.05).steps(0.2) == 1


@pytest.mark.parametrize("period", [0.0, -1.0, 0.04, 0.6, float("nan"), "0.1", True, 10**400])
def test_what_is_no_period(period):
    with refuses(InputError, "period"):
        traits_of({"period": period})


@pytest.mark.parametrize("wants", ["map", ["maps"], [1], 3, {"map"}])
def test_what_nobody_can_want(wants):
    with pytest.raises(InputError, match="wants"):
        traits_of({"wants": wants})
