"""The single-track model: CommonRoad's own, closed forms, and laws."""

import importlib.util
import math
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.base.physics import GRAVITY
from bridgegen.simulation.embedded.chassis import _chassis_columns as columns
from bridgegen.simulation.embedded.chassis._single_track_kernels import (
    SLIPPING,
    advance,
    sub_steps,
    turned,
)
from bridgegen.simulation.embedded.chassis.parameters import CLASSES, chassis

_SPEC = importlib.util.spec_from_file_location(
    "manoeuvres", Path(__file__).with_name("manoeuvres.py")
)
manoeuvres = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(manoeuvres)

MU = 0.85
BODIES = {"car": (2.8, 1.5), "truck": (5.6, 3.6), "bus": (5.9, 3.1)}


def of(name, **changes):
    wheelbase, height = BODIES[name]
    return chassis(replace(CLASSES[name], **changes), wheelbase, height, 0.6)


CARS = {name: of(name) for name in BODIES}


def drive(car, speed, angle, force, seconds, mu=MU, uphill=0.0, aside=0.0, start=(0.0, 0.0, 0.0)):
    """Drive with wheels held at an angle and with a force; yield all states."""
    state = (start, speed, 0.0, 0.0, (math.cos(start[2]), math.sin(start[2])))
    wheels = math.cos(angle), math.sin(angle)
    yield state
    for _ in range(round(seconds / 0.05)):
        parts = sub_steps(math.hypot(state[1], state[2]), 0.05, car)
        for _ in range(parts):
            state = advance(
                *state, wheels, (0.0, 0.0), force, mu, 1.0, uphill, aside, 0.05 / parts, car
            )[:5]
        yield state


@pytest.mark.parametrize("name", manoeuvres.MANOEUVRES)
def test_standard_manoeuvres_are_as_commonroad_s_model_has_them_to_a_hundredth(name):
    what, car = manoeuvres.MANOEUVRES[name], manoeuvres.commonroad_car()
    mine, mu, gives = manoeuvres.like(car)
    expected = manoeuvres.theirs(car, what)
    found = manoeuvres.ours(mine, what, mu, gives)
    peaks = np.abs(expected).max(axis=0)
    assert peaks[manoeuvres.LATERAL] > 3.5  # it corners in earnest
    assert (np.abs(found - expected).max(axis=0) < 0.01 * peaks).all()


@pytest.mark.parametrize("name", manoeuvres.MANOEUVRES)
@pytest.mark.parametrize("car", CARS)
def test_finer_sub_steps_change_no_signal_by_a_hundredth_of_its_peak(car, name):
    what = manoeuvres.MANOEUVRES[name]
    usual, fine = (manoeuvres.ours(CARS[car], what, MU, finer=n) for n in (1, 8))
    most = 0.01 * np.abs(fine).max(axis=0)
    most[manoeuvres.SLIP] = max(most[manoeuvres.SLIP], math.radians(0.01))
    assert (np.abs(usual - fine).max(axis=0) < most).all()


@pytest.mark.parametrize("name", CARS)
def test_steady_cornering_has_the_understeer_gradient_of_the_closed_form(name):
    car, found = CARS[name], CLASSES[name]
    wheelbase = BODIES[name][0]
    gradient = (1.0 / found.k_front - 1.0 / found.k_rear) / GRAVITY  # rad per m/s²
    for speed in (10.0, 20.0):
        angle = 0.3 * wheelbase / speed**2  # some 0.3 m/s²
        *_, (_, vx, _, turn, _) = drive(car, speed, angle, 0.0, 6.0)
        expected = vx * angle / (wheelbase + gradient * vx * vx)
        assert turn == pytest.approx(expected, rel=0.01)


def test_stiff_tyres_make_a_kinematic_bicycle_and_so_does_walking_pace():
    stiff = of("car", k_front=900.0, k_rear=900.0)
    *_, (_, vx, vy, turn, _) = drive(stiff, 8.0, 0.05, 0.0, 2.0)
    assert turn == pytest.approx(vx * math.tan(0.05) / 2.8, rel=0.01)
    assert abs(vy - stiff[columns.TO_REAR] * turn) < 0.02  # its rear axle goes straight ahead
    *_, (_, vx, vy, turn, _) = drive(CARS["car"], 0.9, 0.4, 0.0, 2.0)
    assert turn == pytest.approx(vx * math.tan(0.4) / 2.8, rel=1e-6)
    assert vy == pytest.approx(CARS["car"][columns.TO_REAR] * turn, rel=1e-6)


@pytest.mark.parametrize("name", CARS)
@pytest.mark.parametrize("mu", [0.3, 0.85])
def test_full_brakes_stop_within_v_squared_over_2_mu_g(name, mu):
    *_, (place, vx, _, _, _) = drive(CARS[name], 25.0, 0.0, -20.0, 25.0**2 / mu / GRAVITY, mu)
    assert vx == 0.0
    assert place[0] == pytest.approx(25.0**2 / (2.0 * mu * GRAVITY), rel=0.005)


@pytest.mark.parametrize("speed", [-0.5, -2.0, -12.0])
def test_brakes_stop_a_car_that_rolls_backwards(speed):
    *_, (place, vx, vy, turn, _) = drive(CARS["car"], speed, 0.0, -5.0, 4.0)
    assert (vx, vy, turn) == (0.0, 0.0, 0.0)
    assert place[0] == pytest.approx(-(speed**2) / (2.0 * 5.0), rel=0.005)


def test_brakes_hold_it_on_a_slope_and_it_starts_uphill():
    for uphill in (0.8, -0.8):
        *_, (place, vx, _, _, _) = drive(CARS["car"], 0.0, 0.0, -1.0, 3.0, uphill=uphill)
        assert place == (0.0, 0.0, 0.0)
        assert vx == 0.0
    *_, (_, vx, _, _, _) = drive(CARS["car"], 0.0, 0.0, 1.8, 1.0, uphill=0.8)
    assert vx == pytest.approx(1.0, rel=0.01)


def test_beyond_friction_it_understeers():
    states = np.array([(*s[0], s[1]) for s in drive(CARS["car"], 20.0, 0.12, 0.0, 3.0, mu=0.3)])
    ways = np.unwrap(np.arctan2(*np.diff(states[:, 1::-1], axis=0).T))
    bends = np.diff(ways) / (0.05 * states[1:-1, 3])
    assert 0.5 * 0.3 * GRAVITY < (bends * states[1:-1, 3] ** 2).max() < 1.02 * 0.3 * GRAVITY
    assert bends.max() < 0.25 * math.tan(0.12) / 2.8  # of what the bicycle would do


SPEEDS = st.floats(5.0, 40.0)
ANGLES = st.floats(-0.3, 0.3)
FRICTIONS = st.floats(0.15, 1.0)


@settings(max_examples=60, deadline=None)
@given(st.sampled_from(sorted(CARS)), SPEEDS, ANGLES, st.floats(-9.0, 0.0), FRICTIONS)
def test_energy_never_grows_without_drive(name, speed, angle, force, mu):
    car, before = CARS[name], math.inf
    for _, vx, vy, turn, _ in drive(car, speed, angle, force, 3.0, mu):
        if math.hypot(vx, vy) < SLIPPING:
            break
        energy = vx * vx + vy * vy + turn * turn / car[columns.AGILITY]
        assert energy <= before * (1.0 + 1e-6)
        before = energy


@settings(max_examples=60, deadline=None)
@given(
    st.sampled_from(sorted(CARS)), st.floats(0.0, 40.0), ANGLES, st.floats(-9.0, 5.0), FRICTIONS,
    st.floats(-0.5, 0.5),
)  # fmt: skip
def test_it_is_the_same_in_a_mirror_to_the_bit(name, speed, angle, force, mu, aside):
    here = list(drive(CARS[name], speed, angle, force, 2.0, mu, aside=aside))
    there = list(drive(CARS[name], speed, -angle, force, 2.0, mu, aside=-aside))
    for ((x, y, h), vx, vy, turn, _), ((p, q, g), ux, uy, r, _) in zip(here, there, strict=True):
        assert (x, y, h, vx, vy, turn) == (p, -q, -g, ux, -uy, -r)


@settings(max_examples=30, deadline=None)
@given(SPEEDS, ANGLES, st.floats(-9.0, 5.0), st.floats(-3.0, 3.0), st.floats(-1e3, 1e3))
def test_it_does_not_depend_on_where_it_is_and_which_way_it_looks(speed, angle, force, h, there):
    here = list(drive(CARS["car"], speed, angle, force, 2.0))
    away = list(drive(CARS["car"], speed, angle, force, 2.0, start=(there, -there, h)))
    for ((x, y, head), *motion, _), ((p, q, g), *other, _) in zip(here, away, strict=True):
        assert motion == other
        c, s = math.cos(h), math.sin(h)
        assert (p, q) == pytest.approx((there + c * x - s * y, -there + s * x + c * y), abs=1e-9)
        assert g == pytest.approx(h + head, abs=1e-12)


@given(st.floats(-4.0, 4.0), st.floats(-0.2, 0.2))
def test_turned_is_the_angles_sum(angle, more):
    found = turned(math.cos(angle), math.sin(angle), more)
    assert found == pytest.approx((math.cos(angle + more), math.sin(angle + more)), abs=1e-13)
