"""A car that follows a plan: the plan's motion, whichever way it points."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.drivers._trajectory_kernels import follow, lay, pose, schedule
from bridgegen.drivers.trajectory import Follower, Plans
from bridgegen.simulation.embedded._motion_kernels import bicycle

STEP = 0.05
LIMITS = np.array([60.0, 4.0, 9.0, 0.2])  # speed, acceleration, deceleration, curvature
GRIP = 9.0

profiles = st.lists(
    st.tuples(st.floats(-4.0, 3.0), st.floats(-1.0, 1.0)), min_size=2, max_size=5
)  # acceleration [m/s²]; curvature, as a share of what 4 m/s² of lateral acceleration allow


def driven(profile, v, dt, x=0.0, y=0.0, h=0.0):
    """A bicycle's motion every ``dt``, integrated finely: a second of each pair of the profile."""
    states, t, fine = [(0.0, x, y, h, v)], 0.0, 200
    for a, share in profile:
        for _ in range(round(1.0 / dt)):
            for _ in range(fine):
                bend = share * min(0.15, 4.0 / max(v * v, 1.0))
                after = max(v + a * dt / fine, 0.0)
                s = 0.5 * (v + after) * dt / fine
                x += s * math.cos(h + 0.5 * s * bend)
                y += s * math.sin(h + 0.5 * s * bend)
                h, v = h + s * bend, after
            t += dt
            states.append((t, x, y, h, v))
    return np.array(states)


def laid(states):
    plan = np.zeros((len(states), 6))
    plan[:, :5] = states
    lay(plan)
    return plan


def followed(states, start=None, *, grip=GRIP, step=STEP):
    """The car's x, y, h, v at every step of a plan's time."""
    plan = laid(states)
    car = np.array(states[0, 1:] if start is None else start, dtype=np.float64)
    found = [car]
    for k in range(round(plan[-1, 0] / step)):
        a, bend = follow(plan, k * step, step, *car)
        assert math.isfinite(a)
        assert math.isfinite(bend)
        car = np.array(bicycle(*car, a, bend, LIMITS, grip, 0.0, 0.0, step)[:4])
        found.append(car)
    return np.array(found)


def off(car, states, step=STEP):
    """How far the car is from where the plan has it [m], at the plan's times."""
    at = np.round(states[:, 0] / step).astype(int)
    return np.hypot(*(car[at, :2] - states[:, 1:3]).T)


@settings(max_examples=60, deadline=None)
@given(profiles, st.floats(0.0, 30.0), st.sampled_from([0.05, 0.1, 0.2]), st.floats(-3.0, 3.0))
def test_a_plan_that_the_car_can_drive_is_followed_within_centimetres(profile, v, dt, h):
    states = driven(profile, v, dt, h=h)
    assert off(followed(states), states).max() < 0.1


@settings(max_examples=40, deadline=None)
@given(profiles, st.floats(0.0, 30.0), st.floats(-3.0, 3.0), st.floats(-1e4, 1e4))
def test_it_is_followed_alike_wherever_it_is_and_points(profile, v, h, x):
    states = driven(profile, v, 0.1)
    start = states[0, 1:] + (0.3, -0.2, 0.05, 0.5)
    cos, sin = math.cos(h), math.sin(h)
    turn = np.array([[cos, sin], [-sin, cos]])
    moved = states.copy()
    moved[:, 1:3] = states[:, 1:3] @ turn + (x, -x)
    moved[:, 3] += h
    begin = np.array([*(start[:2] @ turn + (x, -x)), start[2] + h, start[3]])
    one, other = followed(states, start), followed(moved, begin)
    np.testing.assert_allclose(other[:, :2], one[:, :2] @ turn + (x, -x), atol=1e-6)
    np.testing.assert_allclose(other[:, 3], one[:, 3], atol=1e-6)


@settings(max_examples=40, deadline=None)
@given(st.floats(5.0, 35.0), st.floats(-1.0, 1.0), st.floats(-0.1, 0.1), st.floats(-2.0, 2.0))
def test_a_car_beside_its_plan_comes_back(v, aside, turned, faster):
    states = driven([(0.0, 0.0)] * 8, v, 0.1)
    car = followed(states, (0.0, aside, turned, v + faster))
    gap = off(car, states)
    assert gap[-1] < 0.03
    assert gap.max() < abs(aside) + 1.0  # and does not overshoot on the way


def test_whole_turns_of_the_heading_do_not_matter():
    states = driven([(0.5, 0.8)] * 3, 8.0, 0.1, h=3.0)
    wrapped = states.copy()
    wrapped[:, 3] = np.mod(states[:, 3] + np.pi, 2.0 * np.pi) - np.pi
    assert np.abs(np.diff(wrapped[:, 3])).max() > 6.0
    np.testing.assert_allclose(followed(wrapped)[:, :2], followed(states)[:, :2], atol=1e-9)


def test_between_two_states_it_is_on_the_arc():
    turn = math.pi / 6
    end = (20.0 * math.sin(turn), 20.0 * (1.0 - math.cos(turn)))
    plan = laid(np.array([(0.0, 0.0, 0.0, 0.0, 5.0), (2.0, *end, turn, 5.0)]))
    assert plan[1, 5] == pytest.approx(20.0 * turn, rel=1e-12)
    for s in (2.0, 5.0, 9.0):
        x, y, h = pose(plan, s)
        assert math.hypot(x, y - 20.0) == pytest.approx(20.0, abs=0.01)
        assert h == pytest.approx(s / 20.0, abs=1e-12)


def test_the_schedule_is_uniformly_accelerated_motion():
    plan = laid(np.array([(0.0, 0.0, 0.0, 0.0, 4.0), (2.0, 14.0, 0.0, 0.0, 10.0)]))
    for t in (0.0, 0.5, 1.3, 2.0):
        s, v = schedule(plan, t)
        assert (s, v) == pytest.approx((4.0 * t + 1.5 * t * t, 4.0 + 3.0 * t), abs=1e-12)


@pytest.mark.parametrize("v", [0.0, 0.2])
@pytest.mark.parametrize("ahead", [-0.5, 0.0, 0.5])
def test_a_plan_that_stands_makes_a_slow_car_stand(v, ahead):
    """No division by zero, and no creeping up to the very point."""
    states = np.array([(t, 7.0, 3.0, 1.0, 0.0) for t in (0.0, 1.0, 5.0)])
    start = (7.0 + ahead * math.cos(1.0), 3.0 + ahead * math.sin(1.0), 1.0, v)
    car = followed(states, start)
    assert (car[1:, 3] == 0.0).all()
    assert np.ptp(car[1:, :3], axis=0).tolist() == [0.0, 0.0, 0.0]


def test_a_stop_at_a_point_ends_at_the_point():
    states = driven([(0.0, 0.0), *[(-2.5, 0.0)] * 4, *[(0.0, 0.0)] * 2], 10.0, 0.1)
    car = followed(states, (-0.4, 0.0, 0.0, 10.3))
    assert car[-1, 3] == 0.0
    assert car[-1, 0] == pytest.approx(states[-1, 1], abs=0.15)


def test_a_car_that_cannot_brake_as_planned_stays_on_the_path():
    """Friction of 0.3, a bend: it comes to stand far beyond, but beside the path."""
    states = driven([(0.0, 0.5)] + [(-6.0, 0.5)] * 2 + [(0.0, 0.0)] * 4, 12.0, 0.1)
    path = driven([(0.0, 0.5)] * 7, 12.0, 0.01)
    car = followed(states, grip=0.3 * 9.81)
    assert (np.diff(car[:, 3]) < 0.01).all()
    assert car[-1, 3] == 0.0
    end = states[-1, 1:3]
    assert np.hypot(*(car[-1, :2] - end)) > 5.0
    assert np.hypot(*(path[:, 1:3] - car[40, :2]).T).min() < 0.5


def test_a_car_never_hurries_after_its_plan():
    """Left behind by a plan that nothing can follow, it drives 1.5 m/s faster than that at most."""
    states = driven([(0.0, 0.0)] * 4, 20.0, 0.1)
    car = followed(states, (-30.0, 0.0, 0.0, 15.0))
    assert 20.0 < car[:, 3].max() < 21.6


def test_a_row_s_bits_are_its_own():
    rng = np.random.default_rng(5)
    n = 37
    states = np.stack([driven([(a, c)] * 2, v, 0.1, x, y, h) for a, c, v, x, y, h in zip(
        *rng.uniform(-1.0, 1.0, (2, n)), rng.uniform(0.0, 30.0, n), *rng.normal(0.0, 90.0, (3, n)),
        strict=True)])  # fmt: skip
    plans = np.concatenate([states, np.zeros((n, len(states[0]), 1))], axis=2)
    now = states[:, 0, 1:] + rng.normal(0.0, 0.2, (n, 4))
    running = rng.random(n) < 0.8
    whole = Follower(Plans(plans), STEP).demand(0.1, now, running)
    order = rng.permutation(n)
    shuffled = Follower(Plans(plans[order]), STEP).demand(0.1, now[order], running[order])
    alone = Follower(Plans(plans[7:8]), STEP).demand(0.1, now[7:8], running[7:8])
    for one, other, single in zip(whole, shuffled, alone, strict=True):
        np.testing.assert_array_equal(other, one[order])
        np.testing.assert_array_equal(single, one[7:8])
        assert (one[~running] == 0.0).all()
        assert (one[running] != 0.0).all()
