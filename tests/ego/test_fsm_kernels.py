"""The fuzzy safety model: its two measures by hand, and what its driver does with them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers._fsm_kernels import braking, critical, drive_fsm, proactive

from .straight import DT, Road, ahead, path


def test_the_proactive_measure_at_20_m_s():
    # safe: 20·0.75 + 400/8 − 400/14 + 2 = 38.4286; unsafe: 15 + 400/12 − 400/14 = 19.7619
    assert proactive(2.0 + 38.4286, 20.0, 20.0) == pytest.approx(0.0, abs=1e-5)
    assert proactive(2.0 + 19.7619, 20.0, 20.0) == pytest.approx(1.0, abs=1e-5)
    assert proactive(2.0 + 0.5 * (38.4286 + 19.7619), 20.0, 20.0) == pytest.approx(0.5, abs=1e-5)


def test_the_critical_measure_at_20_behind_10_m_s():
    # lost: (20 − 10)·0.75 = 7.5; safe: 7.5 + 100/8 = 20; unsafe: 7.5 + 100/12 = 15.8333
    assert critical(20.0, 20.0, 10.0, 0.0) == 0.0
    assert critical(15.8, 20.0, 10.0, 0.0) == 1.0
    assert critical(0.5 * (20.0 + 15.8333), 20.0, 10.0, 0.0) == pytest.approx(0.5, abs=1e-4)
    # braking by 2 m/s² already: (19.25 − 10)·0.75 = 6.9375, and (18.5 − 10)² = 72.25 over 8
    assert critical(15.97, 20.0, 10.0, -2.0) == 0.0
    assert critical(15.96, 20.0, 10.0, -2.0) > 0.0


def test_the_critical_measure_where_the_present_braking_does_it():
    # from 20 to 17 m/s within the reaction time, past 19: 1²/8 m are needed
    assert critical(0.2, 20.0, 19.0, -4.0) == 0.0
    assert critical(0.1, 20.0, 19.0, -4.0) == 1.0
    assert critical(5.0, 19.0, 20.0, 0.0) == 0.0  # the gap opens


def test_braking_is_comfortable_by_the_first_and_hard_by_the_second():
    assert braking(80.0, 20.0, 20.0, 0.0, 0.0) == 0.0
    assert braking(2.0 + 0.5 * (38.4286 + 19.7619), 20.0, 20.0, 0.0, 0.0) == pytest.approx(
        2.0, abs=1e-4
    )
    assert braking(1.0 + 0.5 * (20.0 + 15.8333), 20.0, 10.0, 0.0, 1.0) == pytest.approx(
        5.0, abs=1e-3
    )
    assert braking(5.0, 20.0, 0.0, 0.0, 0.0) == 6.0


@given(st.floats(0.0, 40.0), st.floats(0.0, 40.0), st.floats(-6.0, 2.0), st.floats(0.0, 200.0))
def test_a_shorter_gap_is_never_safer(v, w, a, gap):
    for measure in (lambda g: proactive(g, v, w), lambda g: critical(g, v, w, a)):
        assert 0.0 <= measure(gap + 1.0) <= measure(gap) <= 1.0


def test_it_reacts_after_0_75_s_and_within_its_jerk():
    road = Road(drive_fsm, 20.0, ahead(12.0)).run(3.0, lambda t: 10.0)
    assert road.brakes_at == pytest.approx(0.75, abs=DT)
    assert (np.diff(road.a) >= -12.65 * DT - 1e-9).all()
    assert road.a.min() >= -6.0 - 1e-9


@given(st.floats(2.0, 30.0), st.floats(0.5, 10.0))
def test_it_stops_behind_who_stands_from_any_speed_in_time(v, seconds):
    # it begins where stopping at 4 to 6 m/s² is enough; from nearer, nobody promises anything
    gap = v * 0.75 + v * v / (2.0 * 4.0) + 4.0 + 5.0 * seconds
    road = Road(drive_fsm, v, ahead(gap)).run(40.0, lambda t: 0.0)
    assert road.gap.min() > 0.0
    assert road.v[0, -1] < 0.5


def test_it_comes_to_follow_at_the_distance_that_it_holds_for_safe():
    road = Road(drive_fsm, 20.0, ahead(80.0)).run(34.0, lambda t: 15.0)
    # 15·0.75 + 225/8 − 225/14 + 2 + 2 = 27.30
    assert road.v[0, -40:].mean() == pytest.approx(15.0, abs=0.3)
    assert road.gap[-40:].mean() == pytest.approx(27.3, abs=0.5)
    assert road.a.min() > -4.0


def test_who_drifts_towards_it_but_will_be_behind_is_no_concern():
    lane = path(5.0, -3.5, 0.0)
    road = Road(drive_fsm, 25.0, lane).run(2.0, lambda t: 10.0, lambda t: 0.3 * t)
    assert (road.a == 0.0).all()


def test_a_cut_in_counts_once_it_will_be_there_before_the_ego_is_past():
    # 1.6 m across at 1 m/s: there after 1.6 s; past after (20 + 4.6 + 4.6 m) / 10 m/s = 2.92 s.
    lane = path(20.0 + 4.6, -3.5, 0.0)
    road = Road(drive_fsm, 20.0, lane).run(3.0, lambda t: 10.0, lambda t: 1.0 * t)
    assert road.brakes_at == pytest.approx(0.75, abs=2.0 * DT)
    # At 0.5 m/s it is there after 3.2 s, later than that by more than the 0.1 s of slack.
    road = Road(drive_fsm, 20.0, lane).run(1.5, lambda t: 10.0, lambda t: 0.5 * t)
    assert (road.a == 0.0).all()


def test_it_does_not_look_through_the_vehicle_ahead_until_that_is_0_375_m_aside():
    # At 25 m/s its unsafe distance to who stands is 25·0.75 + 625/8 + 4 = 100.9 m.
    stays = Road(drive_fsm, 25.0, ahead(60.0), standing=80.0).run(0.7, lambda t: 25.0)
    assert (stays.a == 0.0).all()
    leaves = Road(drive_fsm, 25.0, ahead(60.0), standing=150.0)
    leaves.run(3.0, lambda t: 25.0, lambda t: 1.0 * max(t - 1.0, 0.0))
    # It is beyond 0.375 m at 1.4 s, with 150 − 35 m left, unsafe from (150 − 100.9)/25 = 1.96 s on.
    assert leaves.brakes_at == pytest.approx(1.96 + 0.75, abs=2.0 * DT)


def test_once_it_has_reacted_it_brakes_again_without_waiting():
    v = 20.0
    road = Road(drive_fsm, v, ahead(60.0)).run(6.0, lambda t: max(20.0 - 6.0 * t, 0.0))
    braking_at = np.flatnonzero(road.a < -1e-9)
    first = braking_at[0]
    free = np.flatnonzero(road.a[first:] >= 0.0)
    moving = road.v[0, first:][free] > 0.5
    assert not moving.any()  # from the first touch of the brake it keeps braking to the end
