"""The multi-body model: CommonRoad's own, closed forms, and laws."""

import importlib.util
import math
from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bridgegen.base.physics import GRAVITY
from bridgegen.simulation.embedded.chassis import _chassis_columns as common
from bridgegen.simulation.embedded.chassis import _multi_body_columns as columns
from bridgegen.simulation.embedded.chassis._multi_body_kernels import (
    ROLLED_OVER,
    advance_bodies,
    settle,
    sub_steps_of_bodies,
)
from bridgegen.simulation.embedded.chassis.multi_body import CARS, multi_body, multi_body_of

_SPEC = importlib.util.spec_from_file_location(
    "multi_body_manoeuvres", Path(__file__).with_name("multi_body_manoeuvres.py")
)
manoeuvres = importlib.util.module_from_spec(_SPEC)
_SPEC.loader.exec_module(manoeuvres)

MU = (0.85, 0.85)
MADE = {name: multi_body(car, 2.8, 1.8, 0.57, 0.6) for name, car in CARS.items()}
CAR = MADE["BMW 320i"]


def drive(car, speed, angle, force, seconds, mu=MU, uphill=0.0, aside=0.0, press=1.0, at=None):
    """Drive with wheels held at an angle and with a force; return all states."""
    motion = np.zeros(columns.MOTION_OF_BODIES)
    motion[common.VX] = speed
    if at is not None:
        motion[common.X], motion[common.Y], motion[common.H] = at
    settle(motion, press, car)
    states = [motion[: columns.STATES].copy()]
    for _ in range(round(seconds / 0.05)):
        parts = sub_steps_of_bodies(math.hypot(motion[0], motion[1]), 0.05, car)
        for _ in range(parts):
            advance_bodies(
                motion, (angle,) * 3, force, mu, press, uphill, aside, 0.05 / parts, car
            )  # fmt: skip
        states.append(motion[: columns.STATES].copy())
    return np.array(states)


def loads(car, state):
    """Return the loads on the wheels [N]: front left, front right, rear left, rear right."""
    found = []
    for axle in range(2):
        at = columns.AXLE_AT + axle * columns.AXLE_STATES
        lean, pressed = state[at + columns.LEAN], state[at + columns.PRESSED]
        track = car[columns.AXLE + axle * columns.AXLE_COLUMNS + columns.TRACK]
        deep = pressed + car[columns.RADIUS] * (math.cos(lean) - 1.0)
        aside = 0.5 * track * math.sin(lean)
        found += [car[columns.K_TYRE] * max(deep - s, 0.0) for s in (aside, -aside)]
    return np.array(found)


@pytest.mark.parametrize(
    ("number", "name"),
    [(2, name) for name in manoeuvres.MANOEUVRES]
    + [(1, "double lane change"), (1, "braking on split friction"), (3, "step steer")],
)
def test_standard_manoeuvres_are_as_commonroad_s_model_has_them(number, name, monkeypatch):
    """To 0.2 %: to 0.004 % but where a wheel locks, which ours does not quite."""
    what, car = manoeuvres.MANOEUVRES[name], manoeuvres.commonroad_car(number)
    mine, mu = manoeuvres.like(car)
    expected = manoeuvres.theirs(car, what, monkeypatch)
    found = manoeuvres.ours(mine, what, mu)
    peaks = np.abs(expected).max(axis=0)
    assert peaks[manoeuvres.LATERAL] > 1.2  # it corners in earnest
    assert (np.abs(found - expected)[:, :4].max(axis=0) < 2e-3 * peaks[:4]).all()
    assert math.dist(found[-1, 4:], expected[-1, 4:]) < 2e-3 * peaks[-1]  # y


@pytest.mark.parametrize("number", [1, 2, 3])
def test_cars_are_those_of_commonroad_s_parameter_sets(number):
    theirs, ours = manoeuvres.commonroad_car(number), list(CARS.values())[number - 1]
    expected = manoeuvres.multi_body_like(theirs)
    for one, other in zip((*ours.axles, ours), (*expected.axles, expected), strict=True):
        names = [each.name for each in fields(one)]
        names = [name for name in names if isinstance(getattr(one, name), float)]
        for name in set(names) - {"k_front", "k_rear"}:  # of suspension and steering, too
            assert getattr(one, name) == pytest.approx(getattr(other, name), rel=1e-5), name


HARD = {
    "brakes in a turn": manoeuvres.Manoeuvre(
        manoeuvres.steered(0.08), manoeuvres.pressed(-9.0), 25.0, 4.5
    ),
    "brakes on split friction": manoeuvres.Manoeuvre(
        lambda t: 0.0, manoeuvres.pressed(-9.0, 0.5), 22.0, 2.0, mu=(1.0, 0.35)
    ),
    "stop in a bend": manoeuvres.Manoeuvre(
        manoeuvres.steered(0.1), manoeuvres.pressed(-5.0), 12.0, 4.5
    ),
    "start on ice": manoeuvres.Manoeuvre(
        manoeuvres.steered(0.05, begin=2.0), manoeuvres.pressed(5.0, 0.5), 2.0, 4.5, mu=(0.3, 0.3)
    ),
}


@pytest.mark.parametrize("name", [*manoeuvres.MANOEUVRES, *HARD])
@pytest.mark.parametrize("car", MADE)
def test_halved_sub_steps_change_no_signal_by_a_thousandth_of_its_peak(car, name):
    what = (manoeuvres.MANOEUVRES | HARD)[name]
    usual, fine = (manoeuvres.ours(MADE[car], what, MU[0], finer=n) for n in (1, 2))
    most = 1e-3 * np.maximum(np.abs(fine).max(axis=0), (0.05, 0.5, 0.005, 1.0, 1.0, 1.0))
    assert (np.abs(usual - fine).max(axis=0) < most).all()


@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize(("press", "uphill"), [(1.0, 0.0), (0.97, 0.0), (0.97, 2.0)])
def test_at_rest_nothing_moves_and_the_wheels_carry_the_weight(name, press, uphill):
    car = MADE[name]
    first, *_, last = drive(car, 0.0, 0.1, -3.0, 5.0, uphill=uphill, press=press)
    assert loads(car, last).sum() == pytest.approx(press * GRAVITY * weight(car), rel=1e-4)
    assert (last[[common.X, common.Y, common.H, common.VX, common.VY]] == 0.0).all()
    if uphill == 0.0:
        assert last == pytest.approx(first, abs=1e-9)


def weight(car):
    """Return the sum of the masses on springs and axles [kg]."""
    axles = [columns.AXLE + i * columns.AXLE_COLUMNS for i in range(2)]
    return car[columns.SPRUNG] + sum(car[at + columns.UNSPRUNG] for at in axles)


@pytest.mark.parametrize("name", MADE)
def test_braking_moves_load_to_the_front_by_the_lever_of_the_height(name):
    car = MADE[name]
    last = drive(car, 30.0, 0.0, -4.0, 3.0)[-1]
    left, right, *_ = loads(car, last)
    rest = loads(car, drive(car, 30.0, 0.0, 0.0, 3.0)[-1])
    assert left == right
    wheelbase = car[common.TO_FRONT] + car[common.TO_REAR]
    moved = 4.0 * car[columns.MASS] * (car[common.HEIGHT] - last[columns.SUNK]) / wheelbase
    assert left + right - rest[:2].sum() == pytest.approx(moved, rel=0.01)
    assert last[columns.PITCH] < -0.01  # nose down


@pytest.mark.parametrize("name", MADE)
def test_cornering_moves_load_to_the_outside_by_the_lever_of_the_height(name):
    car = MADE[name]
    last = drive(car, 20.0, 0.015, 0.0, 5.0)[-1]
    across = last[common.VX] * last[common.YAW_RATE]
    assert last[columns.ROLL] / (across / GRAVITY) == pytest.approx(
        math.radians({"Ford Escort": 7.8, "BMW 320i": 7.1, "VW Vanagon": 5.0}[name]), rel=0.02
    )
    found = loads(car, last)
    half = [0.5 * car[columns.AXLE + i * columns.AXLE_COLUMNS + columns.TRACK] for i in range(2)]
    moment = half[0] * (found[1] - found[0]) + half[1] * (found[3] - found[2])
    sprung = car[columns.SPRUNG]
    high = sprung * car[common.HEIGHT]
    levers = high + (weight(car) - sprung) * car[columns.RADIUS]
    leans = GRAVITY * high * last[columns.ROLL]
    assert moment == pytest.approx(across * levers + leans, rel=0.05)


@pytest.mark.parametrize("name", MADE)
def test_it_understeers_as_a_car_and_a_tyre_that_leans_pushes_to_that_side(name):
    """Outwards, so the axle on which wheels lean more slips more."""
    car = MADE[name]

    def gradient(car):
        vx, turn = drive(car, 20.0, 0.01, 0.0, 6.0)[-1][[common.VX, common.YAW_RATE]]
        return math.degrees(0.01 - 2.8 * turn / vx) / (vx * turn / GRAVITY)

    assert 1.6 < gradient(car) < 1.9
    front = car.copy()
    front[columns.AXLE + columns.CAMBER] = 0.0  # no spring travel sets its wheels up
    assert gradient(front) > gradient(car) + 0.01


def test_walking_pace_makes_a_kinematic_bicycle():
    last = drive(CAR, 0.9, 0.4, 0.0, 2.0)[-1]
    turn = last[common.VX] * math.tan(0.4) / 2.8
    assert last[common.YAW_RATE] == pytest.approx(turn, rel=1e-6)
    assert last[common.VY] == pytest.approx(CAR[common.TO_REAR] * turn, rel=1e-6)


@pytest.mark.parametrize("name", MADE)
@pytest.mark.parametrize("mu", [0.3, 0.85])
def test_full_brakes_stop_on_the_peak_of_friction_and_no_wheel_locks(name, mu):
    car = MADE[name]
    states = drive(car, 25.0, 0.0, -20.0, 1.1 * 25.0 / mu / GRAVITY, (mu, mu))
    assert states[-1, common.VX] == 0.0
    assert states[-1, common.X] == pytest.approx(25.0**2 / (2.0 * mu * GRAVITY), rel=0.02)
    moving = states[states[:, common.VX] > 3.5]
    rims = car[columns.RADIUS] * moving[:, columns.SPIN : columns.SPIN + 4]
    assert (rims > 0.8 * moving[:, [common.VX]]).all()
    free = car.copy()
    free[columns.BEST] = math.inf
    front = slice(columns.SPIN, columns.SPIN + 2)
    assert (drive(free, 25.0, 0.0, -9.0, 1.0)[-1, front] < 2.0).all()  # of 60 rad/s


def test_drive_on_ice_spins_no_wheel():
    states = drive(CAR, 5.0, 0.0, 5.0, 4.0, mu=(0.2, 0.2))
    rims = CAR[columns.RADIUS] * states[:, columns.SPIN : columns.SPIN + 4]
    assert (rims < 1.1 * states[:, [common.VX]] + 0.1).all()
    gained = (states[-1, common.VX] - 5.0) / 4.0
    assert 0.4 * 0.2 * GRAVITY < gained < 0.5 * 0.2 * GRAVITY  # of the rear axle alone


@pytest.mark.parametrize("speed", [-0.5, -2.0, -12.0])
def test_brakes_stop_a_car_that_rolls_backwards(speed):
    last = drive(CAR, speed, 0.0, -5.0, 4.0)[-1]
    assert (last[:3] == 0.0).all()
    assert last[common.X] == pytest.approx(-(speed**2) / (2.0 * 5.0), rel=0.06, abs=1e-3)


def test_brakes_hold_it_on_a_slope_and_it_starts_uphill():
    for uphill in (0.8, -0.8):
        last = drive(CAR, 0.0, 0.0, -1.0, 3.0, uphill=uphill)[-1]
        assert (last[[common.X, common.Y, common.H, common.VX]] == 0.0).all()
    assert drive(CAR, 0.0, 0.0, 1.8, 1.0, uphill=0.8)[-1, 0] == pytest.approx(1.0, rel=0.01)


def test_on_a_bank_it_leans_down_standing_and_driving():
    for speed in (0.0, 12.0):
        last = drive(CAR, speed, 0.0, -1.0 if speed == 0.0 else 0.0, 4.0, aside=0.5)[-1]
        expected = 0.5 / GRAVITY * math.radians(7.1)
        assert last[columns.ROLL] == pytest.approx(expected, rel=0.2)


def test_split_friction_turns_a_braking_car_to_the_side_that_grips():
    states = drive(CAR, 22.0, 0.0, -9.0, 1.0, mu=(0.85, 0.2))
    assert states[-1, common.YAW_RATE] > 0.1
    assert np.abs(drive(CAR, 22.0, 0.0, -9.0, 1.0)[:, common.YAW_RATE]).max() == 0.0
    slows = 22.0 - math.hypot(*states[-1, :2])
    assert 0.35 * GRAVITY < slows < 0.55 * GRAVITY  # the mean is 0.525


def test_a_car_that_rolls_over_slides_to_a_stop():
    states = drive(MADE["VW Vanagon"], 20.0, 0.5, 0.0, 12.0, mu=(1.5, 1.5))
    over = states[:, columns.ROLL] == ROLLED_OVER
    assert over.any()
    assert over[np.argmax(over) :].all()
    assert np.isfinite(states).all()
    speeds = np.hypot(states[over, common.VX], states[over, common.VY])
    assert (np.diff(speeds) <= 1e-12).all()
    assert (states[-1, :3] == 0.0).all()
    path = np.hypot(*np.diff(states[over][:, [common.X, common.Y]], axis=0).T).sum()
    assert path == pytest.approx(speeds[0] ** 2 / (2.0 * 0.45 * GRAVITY), rel=0.2)


SPEEDS = st.floats(0.0, 60.0)
ANGLES = st.floats(-0.6, 0.6)
FRICTIONS = st.floats(0.0, 1.5)
FORCES = st.floats(-12.0, 8.0)
WILD = (
    st.sampled_from(sorted(MADE)), SPEEDS, ANGLES, FORCES, FRICTIONS, FRICTIONS,
    st.floats(-3.0, 3.0),
)  # fmt: skip


@settings(max_examples=60, deadline=None)
@given(*WILD)
@example("BMW 320i", 1.0, 0.5, 0.5, 1.0, 0.0, 0.0)
def test_whatever_is_asked_for_it_stays_finite_and_gains_no_speed_without_drive(
    name, speed, angle, force, left, right, aside
):
    states = drive(MADE[name], speed, angle, force, 2.0, (left, right), aside=aside)
    assert np.isfinite(states).all()
    assert np.abs(states[:, columns.ROLL]).max() <= ROLLED_OVER
    gained = np.hypot(states[:, 0], states[:, 1]) - speed
    # At walking pace, where the tyres give way to rolling wheels, one side on ice and the wheels
    # turned: up to 0.4 m/s that nothing drives.
    rest = 0.5 if speed < 2.5 else 0.1
    assert gained.max() < 2.0 * (max(force, 0.0) + abs(aside)) + 0.03 * speed + rest


@settings(max_examples=40, deadline=None)
@given(*WILD)
def test_it_is_the_same_in_a_mirror_to_the_bit(name, speed, angle, force, left, right, aside):
    here = drive(MADE[name], speed, angle, force, 1.0, (left, right), aside=aside)
    there = drive(MADE[name], speed, -angle, force, 1.0, (right, left), aside=-aside)
    odd = [common.VY, common.YAW_RATE, common.Y, common.H, columns.ROLL, columns.ROLL_RATE]
    for axle in range(2):
        at = columns.AXLE_AT + axle * columns.AXLE_STATES
        odd += [at + one for one in (columns.LEAN, columns.LEAN_RATE, columns.ASIDE, columns.OFF)]
    there[:, odd] *= -1.0
    wheels = columns.SPIN + np.array([1, 0, 3, 2])
    there[:, columns.SPIN : columns.SPIN + 4] = there[:, wheels]
    assert (here == there).all()


@settings(max_examples=20, deadline=None)
@given(st.floats(5.0, 40.0), ANGLES, FORCES, st.floats(-3.0, 3.0), st.floats(-1e3, 1e3))
def test_it_does_not_depend_on_where_it_is_and_which_way_it_looks(speed, angle, force, h, there):
    here = drive(CAR, speed, angle, force, 1.0)
    away = drive(CAR, speed, angle, force, 1.0, at=(there, -there, h))
    places = [common.X, common.Y, common.H]
    motions = [i for i in range(columns.STATES) if i not in places]
    assert (here[:, motions] == away[:, motions]).all()
    (x, y, g), (p, q, r), c, s = here[-1, places], away[-1, places], math.cos(h), math.sin(h)
    assert (p, q, r) == pytest.approx(
        (there + c * x - s * y, -there + s * x + c * y, g + h), abs=1e-8
    )


def test_a_body_has_the_car_that_is_like_it():
    def of(wheelbase, width, height):
        body = np.array([4.5, width, 1.4, 60.0, 4.0, 8.0, 0.2, height])
        return multi_body_of(wheelbase, body)

    for wheelbase, height, name in (
        (2.8, 1.5, "BMW 320i"), (2.4, 1.4, "Ford Escort"), (3.0, 2.0, "VW Vanagon"),
    ):  # fmt: skip
        made = of(wheelbase, 1.8, height)
        assert made[columns.MASS] == CARS[name].mass
        assert made[common.TO_FRONT] + made[common.TO_REAR] == pytest.approx(wheelbase)
        whole = CARS[name].height / CARS[name].sprung_height
        assert whole * made[common.HEIGHT] == pytest.approx(0.38 * height)
        assert made[columns.AXLE] / CARS[name].axles[0].track == 1.8 / CARS[name].width
