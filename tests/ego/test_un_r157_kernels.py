"""The regulation's driver, held against the regulation, the Commission's code, and physics.

The table is what the code of the European Commission's Joint Research Centre gives (JRC-FSM, its
"CC human driver" in the cut-in, cars of 4.3 m by 1.9 m, constant lateral speed): the least and the
greatest of the gaps 1, 2, 3 … m (above 60 km/h: 1, 3, 5 … m) at which it crashes.
"""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers import kinds
from bridgegen.drivers._un_r157_kernels import drive_un_r157

from .straight import DT, WALKER, Road, ahead, path

BRAKING, JERK = 0.774 * 9.81, 12.65
RAMP = BRAKING / JERK  # s, until the brake is full: the regulation's 0.6 s
JRC_CAR = np.array([4.3, 1.9, 0.0])

CRASHES = [  # ego and other [km/h], lateral [m/s], least and greatest gap that ends in a crash [m]
    (60, 20, 0.5, 29, 53), (60, 20, 1.0, 11, 35), (60, 20, 1.5, 4, 30),
    (50, 10, 0.5, 29, 53), (50, 10, 1.0, 11, 35), (50, 10, 1.5, 4, 30),
    (90, 40, 0.5, 39, 69), (90, 40, 1.0, 17, 47), (90, 40, 1.5, 7, 39),
    (130, 70, 0.5, 47, 85), (130, 70, 1.0, 21, 59), (130, 70, 1.5, 11, 51),
]  # fmt: skip


def regulation(*told: object) -> float:
    return float(drive_un_r157(*told[:7], *told[8:]))  # it does not ask where anybody changes to


def cuts_in(v: float, w: float, gap: float, drift: float, seconds: float = 20.0) -> Road:
    """A car from the next lane, 1.6 m beside the ego's flank and ``gap`` ahead of it."""
    lane = path(gap + 4.6, -3.5, 0.0)
    aside = lambda t: min(drift * t, 3.5)  # noqa: E731
    return Road(regulation, v, lane).run(seconds, lambda t: w, aside)


def crashes(road: Road) -> bool:
    beside = np.abs(road.y[1] - road.y[0]) - 1.9
    along = np.abs(road.x[1] - road.x[0]) - 4.6
    return bool(((beside < 0.0) & (along < 0.0)).any())


def test_the_jerk_reaches_full_braking_in_the_regulations_time():
    assert pytest.approx(0.6, abs=5e-4) == RAMP


@pytest.mark.parametrize(("ego", "other", "drift", "least", "greatest"), CRASHES)
def test_it_crashes_in_the_cut_ins_in_which_the_commissions_code_does(
    ego, other, drift, least, greatest
):
    step = 2 if ego <= 60 else 4  # a cell and more: theirs has steps of 0.1 s, this one of 0.05 s
    longer = 4.6 - 4.3  # our car
    hit = {gap: crashes(cuts_in(ego / 3.6, other / 3.6, gap - longer, drift))
           for gap in (least - step, least + step, greatest - step, greatest + step)}  # fmt: skip
    assert list(hit.values()) == [False, True, True, False]


def test_it_reacts_where_the_bodies_overlap():
    v, drift = 60.0 / 3.6, 1.2
    road = cuts_in(v, 5.0, 38.0, drift, 4.0)  # 38 m − 1.33 s · 11.7 m/s = 22.4 m: a TTC of 1.9 s
    overlap = 1.6 / drift
    assert road.brakes_at == pytest.approx(overlap, abs=DT)
    k = round(road.brakes_at / DT)
    np.testing.assert_allclose(road.a[k : k + 15], -0.4, atol=1e-9)  # for 0.75 s, foot off
    np.testing.assert_allclose(
        road.a[k + 15 : k + 20], -0.4 - JERK * DT * np.arange(1, 6), atol=1e-9
    )
    assert road.a.min() == pytest.approx(-BRAKING)


def test_a_cut_in_at_a_ttc_of_more_than_2_s_is_followed_without_an_emergency():
    road = cuts_in(20.0, 15.0, 90.0, 1.5)
    assert not crashes(road)
    assert road.a.min() > -2.01
    assert road.v[0, -1] == pytest.approx(15.0, abs=0.8)


def test_who_stays_in_the_next_lane_is_no_concern():
    lane = path(25.0, -3.5, 0.0)
    road = Road(regulation, 20.0, lane).run(6.0, lambda t: 16.0, lambda t: 0.3 * np.sin(t))
    assert (road.a == 0.0).all()


def test_the_vehicle_ahead_that_brakes_hard_is_reacted_to_after_0_75_s():
    v = 60.0 / 3.6
    road = Road(regulation, v, ahead(2.0 * v)).run(8.0, lambda t: max(v - 8.0 * t, 0.0))
    first = int(np.argmax(road.a < -1.0)) * DT
    assert first == pytest.approx(0.75, abs=2.0 * DT)
    assert road.a.min() == pytest.approx(-BRAKING)
    assert road.gap.min() > 0.0


@given(st.floats(12.0, 128.0), st.floats(0.05, 0.95))
def test_no_deceleration_of_the_vehicle_ahead_is_too_hard_at_2_s(speed, share):
    """The Commission's code crashes in none of its 1,121 cells of this; a formula tells why.

    From 2 s behind, v·(0.75 + 0.3) m pass until the brake is full, and v²/(2·7.6) m more.
    """
    v = speed / 3.6
    assert 2.0 * v + v * v / (2.0 * 9.81 * 0.95) > 1.06 * v + v * v / (2.0 * BRAKING)
    road = Road(regulation, v, ahead(2.0 * v)).run(
        15.0, lambda t: max(v - 9.81 * share * max(t - DT, 0.0), 0.0)
    )
    assert road.gap.min() > 0.0


def test_a_cut_out_is_reacted_to_once_it_is_0_375_m_aside():
    v, drift = 20.0, 1.0
    road = Road(regulation, v, ahead(2.0 * v), standing=100.0)
    road.run(10.0, lambda t: v, lambda t: drift * t)
    assert road.brakes_at == pytest.approx(0.375 / drift, abs=2.0 * DT)
    first = int(np.argmax(road.a < -1.0)) * DT
    assert first == pytest.approx(0.375 / drift + 0.75, abs=2.0 * DT)
    # 0.4 s · 20 m/s until then, 14.9 m in 0.75 s at 0.4 m/s², 10.7 m in the 0.57 s until the brake
    # is full, and (17.4 m/s)² / (2 · 0.774 g) = 20.0 m
    stops = int(np.argmax(road.v[0] == 0.0))
    assert road.x[0, stops] == pytest.approx(53.6, abs=0.7)


def test_it_does_not_look_beyond_the_vehicle_ahead():
    v = 20.0
    road = Road(regulation, v, ahead(2.0 * v), standing=100.0)
    road.run(2.0, lambda t: v, lambda t: 0.3 * np.sin(t))
    assert (road.a == 0.0).all()


def test_crossing_traffic_and_who_walks_are_not_its_disturbances():
    across = path(40.0, -12.0, np.pi / 2)
    car = Road(regulation, 15.0, across).run(4.0, lambda t: 4.0)
    walker = Road(regulation, 15.0, across, WALKER, kinds.PEDESTRIAN).run(6.0, lambda t: 1.5)
    along = Road(regulation, 15.0, path(30.0, 0.0, 0.0), WALKER, kinds.PEDESTRIAN)
    along.run(6.0, lambda t: 1.5)
    for road in (car, walker, along):
        assert (road.a == 0.0).all()


def test_it_follows_at_a_distance():
    road = Road(regulation, 20.0, ahead(60.0)).run(30.0, lambda t: 15.0)
    assert road.v[0, -1] == pytest.approx(15.0, abs=0.2)
    assert 15.0 < road.gap[-1] < 45.0
    assert road.a.min() > -2.01


@given(st.floats(3.0, 40.0), st.floats(0.0, 1.0))
def test_it_never_brakes_harder_than_0_774_g(v, share):
    road = Road(regulation, v, ahead(5.0 + share * 250.0)).run(15.0, lambda t: 0.0)
    assert road.a.min() >= -BRAKING - 1e-9
