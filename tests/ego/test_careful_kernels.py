"""The careful driver, held against the regulation's figures and against physics."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers import kinds
from bridgegen.drivers._careful_kernels import drive_careful

from .straight import DT, WALKER, Road, ahead, path

BRAKING, JERK = 0.774 * 9.81, 12.65
RAMP = BRAKING / JERK  # s, until the brake is full: the regulation's 0.6 s


def careful(*told: object) -> float:
    *seen, _, attention = told  # it does not ask what a body is
    return float(drive_careful(*seen, attention))


def braking_distance(v: float) -> float:
    """From the touch of the brake to standstill [m], by hand: a ramp of 0.6 s, then 0.774 g."""
    after = v - 0.5 * JERK * RAMP**2
    return v * RAMP - JERK * RAMP**3 / 6.0 + after**2 / (2.0 * BRAKING)


def test_the_jerk_reaches_full_braking_in_the_regulations_time():
    assert pytest.approx(0.6, abs=5e-4) == RAMP


def test_at_60_kmh_it_takes_the_braking_distance_of_school_physics():
    v = 60.0 / 3.6
    assert braking_distance(v) == pytest.approx(23.18, abs=0.01)
    # A car 22.3 m ahead brakes by 8 m/s² to a standstill: the risk is that deceleration.
    road = Road(careful, v, ahead(22.3)).run(6.0, lambda t: max(v - 8.0 * t, 0.0))
    assert road.brakes_at == pytest.approx(0.75, abs=2.0 * DT)
    slow = int(np.argmax(road.v[0] <= 1.0))
    travelled = road.x[0, slow] - road.x[0, round(road.brakes_at / DT)]
    assert travelled == pytest.approx(braking_distance(v) - 1.0 / (2.0 * BRAKING), abs=0.5)
    assert road.gap.min() > 0.0


def test_it_perceives_a_cut_in_evaluates_it_and_reacts():
    v, began, drift = 60.0 / 3.6, 1.0, 1.2
    aside = lambda t: min(drift * max(t - began, 0.0), 3.5)  # noqa: E731
    lane = path(40.0, -3.5, 0.0)
    road = Road(careful, v, lane).run(4.0, lambda t: 5.0, aside)
    told = began + 0.375 / drift  # 0.375 m nearer
    assert road.brakes_at == pytest.approx(told + 0.4 + 0.75, abs=2.0 * DT)
    k = round(road.brakes_at / DT)
    np.testing.assert_allclose(road.a[k : k + 5], -JERK * DT * np.arange(1, 6), atol=1e-9)
    assert road.a.min() == pytest.approx(-BRAKING)


def test_a_cut_in_far_ahead_is_no_risk_before_its_ttc_is_2_s():
    v = 20.0
    lane = path(90.0, -3.5, 0.0)
    aside = lambda t: min(1.5 * t, 3.5)  # noqa: E731
    road = Road(careful, v, lane).run(3.0, lambda t: 15.0, aside)
    assert (road.a > -2.01).all()  # it follows; it does not brake hard


def test_who_wanders_in_their_lane_is_nobodys_concern():
    lane = path(25.0, -3.5, 0.0)
    aside = lambda t: 0.3 * np.sin(t)  # noqa: E731
    road = Road(careful, 20.0, lane).run(6.0, lambda t: 16.0, aside)
    assert (road.a == 0.0).all()


@given(st.floats(3.0, 40.0), st.floats(0.0, 1.0))
def test_a_standing_car_is_reached_only_where_nobody_could_stop(v, share):
    gap = 5.0 + share * 250.0
    road = Road(careful, v, ahead(gap)).run(25.0, lambda t: 0.0)
    hit = road.gap.min() <= 0.0
    law = v * v / (2.0 * BRAKING)  # without any reaction
    if hit:
        assert gap < v * 0.75 + braking_distance(v) + v * 2.0 * DT
    assert hit or gap >= law - 0.1
    assert road.a.min() >= -BRAKING - 1e-9
    hard = road.a[1:] < -2.01  # beyond comfort, which it may ask for at once
    assert (np.diff(road.a)[hard & (road.v[0, 1:] > 0.5)] >= -JERK * DT - 1e-9).all()


@given(st.floats(4.0, 16.0), st.floats(0.8, 2.0))
def test_who_walks_across_is_stopped_for(v, pace):
    # They will be in its way after 4 s of walking: time enough for all.
    at = 4.0 * v
    across = path(at, -4.0 * pace, np.pi / 2)
    road = Road(careful, v, across, WALKER, kinds.PEDESTRIAN).run(4.0 + 2.0 / pace, lambda t: pace)
    front, flank = road.x[0] + 1.4 + 2.3, np.abs(road.y[1]) - 0.3 - 0.95
    touched = (flank < 0.0) & (front > at - 0.3) & (front - 4.6 < at + 0.3)
    assert not touched.any()


def test_who_steps_out_three_metres_ahead_is_hit():
    across = path(3.0 + 1.4 + 2.3, -1.0, np.pi / 2)
    road = Road(careful, 10.0, across, WALKER, kinds.PEDESTRIAN).run(1.0, lambda t: 1.5)
    assert road.a.min() == 0.0  # before it can react, it is over


def test_it_follows_at_a_distance_and_lets_nobody_in_its_way_stop_it_for_ever():
    road = Road(careful, 20.0, ahead(60.0)).run(30.0, lambda t: 15.0)
    assert road.v[0, -1] == pytest.approx(15.0, abs=0.2)
    assert 15.0 < road.gap[-1] < 45.0
    assert road.a.min() > -2.01
