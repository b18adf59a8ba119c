"""severity against published points, collisions worked by hand, and laws."""

from math import exp, sqrt

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.assess.conflict.severity import (
    DIRECTIONS,
    FRONT,
    MASS,
    REAR,
    SIDE,
    delta_v,
    effective_speed,
    injuries,
    p_mais3,
    severity,
)
from bridgegen.drivers.kinds import (
    ANIMAL,
    BICYCLE,
    BUS,
    CAR,
    MOTORCYCLE,
    NAMES,
    OTHER,
    PEDESTRIAN,
    TRUCK,
)
from bridgegen.scenario.participants import PARTICIPANTS

KMH, MPH = 1 / 3.6, 0.44704  # m/s

# Masses.


@pytest.mark.parametrize(
    ("kind", "body"),
    [
        (CAR, "car"),
        (TRUCK, "truck"),
        (BUS, "bus"),
        (MOTORCYCLE, "motorcycle"),
        (BICYCLE, "bicycle"),
        (PEDESTRIAN, "pedestrian"),
        (ANIMAL, "animal"),
        (OTHER, "obstacle"),
    ],
)
def test_masses_are_those_of_the_exported_storyboards(kind, body):
    assert MASS[kind] == PARTICIPANTS[body].body.mass


# Published points.


@pytest.mark.parametrize(("kind", "kmh"), [(PEDESTRIAN, 29.0), (BICYCLE, 44.0), (MOTORCYCLE, 48.0)])
def test_ten_percent_of_lubbe(kind, kmh):
    """Lubbe et al. (2022), abstract: 10 % MAIS3+ at these closing speeds, in whole km/h."""
    below, above = p_mais3(kind, np.array([kmh - 1.0, kmh + 1.0]) * KMH, FRONT)
    assert below < 0.10 < above


@pytest.mark.parametrize("kmh", [30.0, 40.0, 50.0, 60.0, 70.0])
def test_pedestrians_agree_with_another_study(kmh):
    """Rosén et al. (2010), Accid. Anal. Prev. 42(6), Table 1: logit -4.6 + 0.078 v [km/h]."""
    other = 1.0 / (1.0 + exp(4.6 - 0.078 * kmh))
    assert p_mais3(PEDESTRIAN, kmh * KMH, FRONT) == pytest.approx(other, abs=0.05)


@pytest.mark.parametrize("kind", [CAR, TRUCK, BUS])
@pytest.mark.parametrize(
    ("direction", "mph", "expected"),
    [
        # Wang (2022): logit -6.9774 + 0.1620 dv [mph], frontal; -8.0329 + 0.1793 dv, rear-end
        (FRONT, 20.0, 0.02327),  # -3.7374
        (FRONT, 40.0, 0.37815),  # -0.4974
        (FRONT, 60.0, 0.93951),  # 2.7426
        (REAR, 20.0, 0.01158),  # -4.4469
        (REAR, 40.0, 0.29715),  # -0.8609
        (REAR, 60.0, 0.93849),  # 2.7251
    ],
)
def test_occupants_by_delta_v(kind, direction, mph, expected):
    assert p_mais3(kind, mph * MPH, direction) == pytest.approx(expected, abs=2e-5)


@pytest.mark.parametrize(
    ("direction", "target", "tolerance"),
    [
        (FRONT, 99.0, 5.0),  # Lubbe et al. (2022) for car drivers: 112 km/h
        (REAR, 126.0, 22.0),
        (SIDE, 73.0, 0.01),
    ],
)
def test_ten_percent_of_target(direction, target, tolerance):
    """TARGET (Traffic Safety Research 27552), abstract: closing speeds [km/h] of 10 % MAIS3+.

    Between equal masses; frontal and rear are Wang's, an independent study.
    """
    kmh = np.arange(1.0, 200.0, 0.001)
    ten = kmh[np.searchsorted(p_mais3(CAR, 0.5 * kmh * KMH, direction), 0.10)]
    assert ten == pytest.approx(target, abs=tolerance)


def test_a_side_is_weaker_than_a_front_and_a_rear_safer():
    v = np.linspace(1.0, 25.0, 49)  # Wang's curves cross at 27 m/s
    front, rear, side = (p_mais3(CAR, v, direction) for direction in (FRONT, REAR, SIDE))
    assert (rear < front).all()
    assert (front < side).all()


def test_ranking_of_pedestrians_cyclists_and_drivers():
    """The ranking of Lubbe et al. (2022), section 4.3, at speeds of towns, of equal age."""
    v = np.array([40.0, 50.0, 60.0]) * KMH
    walks, rides = (p_mais3(kind, v, FRONT) for kind in (PEDESTRIAN, BICYCLE))
    drives = p_mais3(CAR, 0.5 * v, FRONT)
    assert (walks > rides).all()
    assert (rides > drives).all()


def test_what_low_speeds_change_of_the_published_values():
    """Nothing is left of a logistic's floor at 0, and 99.9 % of its value from 19 km/h on."""
    v = np.array([0.0, 4.0, 5.3])
    published = 1.0 / (1.0 + np.exp(6.190 - 0.038 * 46.0 - 0.078 * 3.6 * v))
    assert p_mais3(PEDESTRIAN, v, FRONT)[0] == 0.0
    assert (p_mais3(PEDESTRIAN, v, FRONT)[1:] / published[1:] > [0.98, 0.999]).all()


# Delta-v by hand.


def test_equal_cars_share_the_closing_speed():
    assert delta_v(CAR, CAR, 20.0, 0.0) == (10.0, 10.0)


def test_a_truck_hits_a_car():
    """1,500 kg and 16,000 kg at 17.5 m/s: common velocity after 16 m/s of the car's 0."""
    assert delta_v(CAR, TRUCK, 17.5, 0.0) == pytest.approx((16.0, 1.5))


def test_a_pedestrian_takes_nearly_all_of_it():
    """1,500 kg and 75 kg at 10.5 m/s."""
    assert delta_v(PEDESTRIAN, CAR, 10.5, 0.0) == pytest.approx((10.0, 0.5))


def test_a_barrier_does_not_move():
    assert delta_v(CAR, OTHER, 12.0, 0.0, True, False) == (12.0, 0.0)
    assert delta_v(OTHER, OTHER, 12.0, 0.0, False, False) == (0.0, 0.0)


def test_an_obstacle_is_pushed_away():
    """1,500 kg and 50 kg at 15.5 m/s."""
    assert delta_v(CAR, OTHER, 15.5, 0.0) == pytest.approx((0.5, 15.0))


def test_a_standing_car_or_person_is_not_a_barrier():
    assert delta_v(CAR, CAR, 20.0, 0.0, True, False) == (10.0, 10.0)
    assert delta_v(PEDESTRIAN, CAR, 10.5, 0.0, False, True) == pytest.approx((10.0, 0.5))


@pytest.mark.parametrize(
    ("normal", "tangential", "expected"),
    [
        (4.0, 0.0, 4.0),
        (4.0, 1.0, sqrt(17.0)),  # less than friction could stop: 2.2 m/s
        (4.0, -1.0, sqrt(17.0)),
        (4.0, 30.0, sqrt(20.84)),  # slides on: 16 + 2.2²
        (0.0, 30.0, 0.0),  # surfaces that pass each other without pressure
        (-3.0, 30.0, 0.0),  # they separate
    ],
)
def test_friction_limits_the_tangential_part(normal, tangential, expected):
    assert effective_speed(normal, tangential) == pytest.approx(expected)


# Collisions by hand.


def test_head_on():
    """Two cars at 50 km/h each: 50 km/h (31.069 mph) of delta-v, logit -1.9443."""
    assert severity(CAR, CAR, 100.0 * KMH, 0.0, FRONT, FRONT) == pytest.approx(0.12518, abs=2e-5)


def test_the_struck_side_counts():
    p_a, p_b = injuries(CAR, CAR, 20.0, 0.0, FRONT, SIDE)
    assert p_b > p_a
    assert severity(CAR, CAR, 20.0, 0.0, FRONT, SIDE) == p_b


def test_the_lighter_party_counts():
    p_truck, p_car = injuries(TRUCK, CAR, 20.0, 0.0, FRONT, FRONT)
    assert p_car > 10.0 * p_truck


def test_a_struck_pedestrian_counts_and_not_the_car():
    """By the front at 50 km/h: logit -6.190 + 3.9 + 1.748 = -0.542."""
    p_car, p_pedestrian = injuries(CAR, PEDESTRIAN, 50.0 * KMH, 0.0, FRONT, SIDE)
    assert p_pedestrian == pytest.approx(0.36772, abs=2e-5)
    assert p_car < 0.001


def test_a_pedestrian_who_walks_into_a_passing_car():
    """At 1.4 m/s into a car that passes at 50 km/h: much less than struck by its front."""
    assert severity(CAR, PEDESTRIAN, 1.4, 50.0 * KMH, SIDE, FRONT) < 0.02


def test_a_bicycle_harms_a_pedestrian_less_than_a_car_does():
    bicycle, car, truck = severity(
        np.array([BICYCLE, CAR, TRUCK]), PEDESTRIAN, 7.0, 0.0, FRONT, SIDE
    )
    assert bicycle < car < truck


def test_animals_and_objects_carry_no_persons():
    assert severity(OTHER, ANIMAL, 30.0, 0.0, FRONT, FRONT) == 0.0
    assert injuries(CAR, ANIMAL, 30.0, 0.0, FRONT, FRONT)[1] == 0.0


def test_rows_without_contact_stay_nan():
    found = severity([CAR, CAR], [CAR, CAR], [np.nan, 10.0], [0.0, 0.0], FRONT, FRONT)
    assert np.isnan(found).tolist() == [True, False]


# What is refused.


@pytest.mark.parametrize("kind", [-1, len(NAMES)])
def test_a_kind_that_does_not_exist(kind):
    with refuses(ValueError, "kind_b", kind):
        delta_v(CAR, kind, 1.0, 0.0)


def test_a_direction_that_does_not_exist():
    with refuses(ValueError, "direction_a"):
        severity(CAR, CAR, 1.0, 0.0, 3, FRONT)


def test_a_speed_below_zero():
    with refuses(ValueError, "speed", "-1.0"):
        p_mais3(CAR, -1.0, FRONT)


# Laws.

KINDS = st.integers(0, len(NAMES) - 1)
WITH_PERSONS = st.sampled_from([CAR, TRUCK, BUS, MOTORCYCLE, BICYCLE, PEDESTRIAN])
SIDES = st.integers(0, len(DIRECTIONS) - 1)
SPEEDS = st.floats(0.0, 80.0)  # m/s
TANGENTIAL = st.floats(-80.0, 80.0)


@given(KINDS, KINDS, SPEEDS, TANGENTIAL, SIDES, SIDES, st.booleans(), st.booleans())
def test_a_probability_and_symmetric(a, b, normal, tangential, on_a, on_b, moves_a, moves_b):
    found = severity(a, b, normal, tangential, on_a, on_b, moves_a, moves_b)
    assert 0.0 <= found <= 1.0
    assert found == severity(b, a, normal, -tangential, on_b, on_a, moves_b, moves_a)


@given(WITH_PERSONS, KINDS, SPEEDS, st.floats(0.01, 20.0), TANGENTIAL, SIDES, SIDES)
def test_strictly_increasing_in_normal_closing_speed(a, b, normal, more, tangential, on_a, on_b):
    slow, fast = severity(a, b, np.array([normal, normal + more]), tangential, on_a, on_b)
    assert slow < fast or fast > 1.0 - 1e-9


@given(WITH_PERSONS, KINDS, st.floats(0.1, 50.0), TANGENTIAL, st.floats(1.01, 2.0), SIDES, SIDES)
def test_strictly_increasing_in_the_closing_velocity(a, b, normal, tangential, factor, on_a, on_b):
    """Both parts grow alike: the same collision, faster."""
    scale = np.array([1.0, factor])
    slow, fast = severity(a, b, normal * scale, tangential * scale, on_a, on_b)
    assert slow < fast or fast > 1.0 - 1e-9


@given(KINDS, KINDS, SPEEDS, TANGENTIAL, st.floats(1.0, 3.0), SIDES, SIDES)
def test_sliding_faster_is_never_less_severe(a, b, normal, tangential, factor, on_a, on_b):
    slow, fast = severity(a, b, normal, tangential * np.array([1.0, factor]), on_a, on_b)
    assert slow <= fast


@given(KINDS, KINDS, TANGENTIAL, SIDES, SIDES)
def test_zero_at_closing_speed_zero(a, b, tangential, on_a, on_b):
    assert severity(a, b, 0.0, tangential, on_a, on_b) == 0.0


@given(KINDS, KINDS, SPEEDS, TANGENTIAL)
def test_momentum_is_conserved(a, b, normal, tangential):
    dv_a, dv_b = delta_v(a, b, normal, tangential)
    assert MASS[a] * dv_a == pytest.approx(MASS[b] * dv_b, rel=1e-12, abs=1e-300)
    assert dv_a + dv_b == pytest.approx(effective_speed(normal, tangential), rel=1e-12)


@given(WITH_PERSONS, WITH_PERSONS, st.floats(1.0, 40.0), TANGENTIAL, SIDES, SIDES)
def test_a_heavier_partner_is_never_safer(a, b, normal, tangential, on_a, on_b):
    other = CAR if b in (TRUCK, BUS) else b
    heavy = injuries(a, TRUCK, normal, tangential, on_a, on_b)[0]
    assert injuries(a, other, normal, tangential, on_a, on_b)[0] <= heavy


@given(st.lists(st.tuples(KINDS, KINDS, SPEEDS, TANGENTIAL, SIDES, SIDES), min_size=1, max_size=9))
def test_a_row_depends_on_that_row_alone(rows):
    columns = [np.array(column) for column in zip(*rows, strict=True)]
    assert severity(*columns).tolist() == [float(severity(*row)) for row in rows]
