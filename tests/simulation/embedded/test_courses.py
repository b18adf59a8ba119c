"""Courses of a speed, against closed forms worked by hand and the laws that they must keep."""

import math

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st

from bridgegen.simulation.embedded._motion_kernels import progress
from bridgegen.simulation.embedded.motion._course_kernels import (
    change_time,
    changed,
    lay_out,
    meeting_speed,
    profile_speed,
    spring,
)

STEP, LINEAR, CUBIC, SINUSOIDAL = range(4)
RATE, TIME, DISTANCE = range(3)
INF = math.inf

# (shape, dimension, value, before, after, most): seconds.
TIMES = {
    (STEP, TIME, 5.0, 10.0, 20.0, 2.0): 0.0,
    (LINEAR, TIME, 5.0, 10.0, 20.0, INF): 5.0,
    (LINEAR, TIME, 5.0, 10.0, 20.0, 1.0): 10.0,  # no more than 1 m/s²
    (LINEAR, RATE, 2.0, 10.0, 20.0, INF): 5.0,
    (LINEAR, RATE, -2.0, 20.0, 10.0, INF): 5.0,  # a rate has no sign
    (LINEAR, RATE, 8.0, 20.0, 10.0, 4.0): 2.5,
    (LINEAR, DISTANCE, 75.0, 10.0, 20.0, INF): 5.0,  # 15 m/s on average
    (LINEAR, DISTANCE, 50.0, 20.0, 0.0, INF): 5.0,  # v²/(2·s) = 4 m/s²
    # A cubic's slope is 3/2 in the middle, a sinusoidal's π/2.
    (CUBIC, TIME, 5.0, 10.0, 20.0, INF): 5.0,
    (CUBIC, TIME, 5.0, 10.0, 20.0, 2.0): 7.5,
    (CUBIC, RATE, 3.0, 10.0, 20.0, INF): 5.0,
    (CUBIC, DISTANCE, 75.0, 10.0, 20.0, INF): 5.0,
    (SINUSOIDAL, RATE, math.pi, 10.0, 20.0, INF): 5.0,
    (SINUSOIDAL, RATE, math.pi, 10.0, 20.0, math.pi / 2): 10.0,
    (SINUSOIDAL, DISTANCE, 75.0, 20.0, 10.0, INF): 5.0,
    (CUBIC, TIME, 5.0, 10.0, 10.0, INF): 0.0,  # nothing to change
}


@pytest.mark.parametrize("case", TIMES)
def test_how_long_a_change_takes(case):
    assert change_time(*case) == pytest.approx(TIMES[case])


# Speeds from 10 to 20 m/s at shares of the time, by hand: 3u² − 2u³ and (1 − cos πu)/2.
@pytest.mark.parametrize(
    ("shape", "share", "speed"),
    [
        (LINEAR, 0.25, 12.5),
        (CUBIC, 0.25, 10.0 + 10.0 * 0.15625),
        (CUBIC, 0.5, 15.0),
        (SINUSOIDAL, 0.25, 10.0 + 10.0 * 0.1464466094067262),
        (SINUSOIDAL, 1.5, 20.0),
    ],
)
def test_speeds_on_the_way(shape, share, speed):
    assert changed(shape, 10.0, 20.0, share) == pytest.approx(speed)


shapes = st.sampled_from([LINEAR, CUBIC, SINUSOIDAL])
speeds = st.floats(0.0, 60.0)


@given(shapes, st.floats(0.0, 1.0))
def test_a_shape_reversed_in_time_is_itself_upside_down(shape, share):
    assert progress(shape, 1.0 - share)[0] == pytest.approx(1.0 - progress(shape, share)[0])


@given(shapes, speeds, speeds, st.floats(0.0, 2.0))
def test_a_speed_stays_between_its_ends(shape, before, after, share):
    v = changed(shape, before, after, share)
    assert min(before, after) - 1e-9 <= v <= max(before, after) + 1e-9


@given(shapes, speeds, speeds, st.floats(1.0, 500.0))
def test_a_change_over_a_distance_covers_it(shape, before, after, distance):
    assume(abs(after - before) > 0.1)
    time = change_time(shape, DISTANCE, distance, before, after, INF)
    u = np.linspace(0.0, 1.0, 2001)
    v = [changed(shape, before, after, share) for share in u]
    assert np.trapezoid(v, u * time) == pytest.approx(distance, rel=1e-6)


@given(shapes, speeds, speeds, st.floats(0.1, 10.0))
def test_a_rate_is_the_steepest_slope(shape, before, after, rate):
    assume(abs(after - before) > 0.1)
    time = change_time(shape, RATE, rate, before, after, INF)
    u = np.linspace(0.0, 1.0, 1001)
    v = np.array([changed(shape, before, after, share) for share in u])
    slope = np.abs(np.diff(v) / np.diff(u * time)).max()
    assert slope == pytest.approx(rate, rel=1e-3)


@given(shapes, st.sampled_from([RATE, TIME, DISTANCE]), st.floats(0.5, 50.0), speeds, speeds,
       st.floats(0.5, 10.0))  # fmt: skip
def test_no_change_is_steeper_than_the_body_can(shape, dimension, value, before, after, most):
    assume(abs(after - before) > 0.1)
    time = change_time(shape, dimension, value, before, after, most)
    u = np.linspace(0.0, 1.0, 501)
    v = np.array([changed(shape, before, after, share) for share in u])
    assert np.abs(np.diff(v) / np.diff(u * time)).max() <= most * (1.0 + 1e-6)


def drive(left, time, v, final, dt=0.01):
    """Follow ``meeting_speed`` while a master comes at constant speed; return the speeds."""
    course, s, n = [v], left, round(time / dt)
    for k in range(n):
        to_go = time - k * dt
        if s <= 0.0:
            break
        has = final is not None
        v = meeting_speed(s, to_go, course[-1], final if has else 0.0, has, dt)
        s -= 0.5 * (course[-1] + v) * dt
        course.append(v)
    return np.array(course), s


def test_meeting_by_constant_acceleration():
    # 100 m in 10 s from 5 m/s: a = 2·(100 − 50)/100 = 1 m/s², so 15 m/s there.
    course, missed = drive(100.0, 10.0, 5.0, None)
    assert np.diff(course) == pytest.approx(0.01, abs=1e-6)
    assert course[-1] == pytest.approx(15.0, abs=1e-3)
    assert missed == pytest.approx(0.0, abs=1e-3)


# (way, time, speed, final): apex by hand from vx² − 2(s/t)vx + s(v0+v1)/t − (v0²+v1²)/2 = 0.
MEETINGS = {
    (100.0, 10.0, 10.0, 10.0): 10.0,  # it is just right
    (120.0, 10.0, 10.0, 10.0): 14.0,  # rush: half the time up by 0.8 m/s², half of it down
    (80.0, 10.0, 10.0, 10.0): 6.0,  # linger
    (75.0, 10.0, 5.0, 10.0): 10.0,  # straight to the final speed
}


@pytest.mark.parametrize("case", MEETINGS)
def test_meeting_with_a_final_speed(case):
    course, missed = drive(*case)
    assert missed == pytest.approx(0.0, abs=0.02)
    assert course[-1] == pytest.approx(case[3], abs=0.05)
    apex = course[np.abs(course - case[3]).argmax()]
    if case[2] == case[3]:
        assert apex == pytest.approx(MEETINGS[case], abs=0.02)
    rates = np.abs(np.diff(course)) / 0.01
    assert rates.max() == pytest.approx(np.median(rates), abs=0.1)  # equally strong, both ways


def test_who_would_be_too_early_stops_and_waits():
    # 20 m in 20 s from 10 to 10 m/s: both halves at 100/20 = 5 m/s², 2 s each; 16 s at rest.
    course, missed = drive(20.0, 20.0, 10.0, 10.0)
    assert (course == 0.0).sum() * 0.01 == pytest.approx(16.0, abs=0.1)
    assert missed == pytest.approx(0.0, abs=0.05)
    assert course[-1] == pytest.approx(10.0, abs=0.1)


@given(st.floats(20.0, 300.0), st.floats(3.0, 30.0), st.floats(0.0, 20.0), st.floats(1.0, 20.0))
@example(246.0, 3.125, 0.0, 1.0)
def test_everybody_meets_in_time_and_at_speed(left, time, v, final):
    course, missed = drive(left, time, v, final)
    assert missed == pytest.approx(0.0, abs=0.2)
    # A step of 0.01 s at the 77 m/s² of 246 m in 3.125 s is most of it.
    assert course[-1] == pytest.approx(final, abs=0.8)
    assert course.min() >= 0.0


def test_nobody_is_sent_past_its_place_while_the_master_stands():
    v, s = 10.0, 30.0
    for _ in range(3000):
        after = meeting_speed(s, INF, v, 5.0, True, 0.01)
        s -= 0.5 * (v + after) * 0.01
        v = after
    assert v == 0.0
    assert 0.0 < s < 30.0


LIMITS = np.array([2.0, 3.0, 40.0, INF, INF])


@given(st.floats(-30.0, 60.0), st.floats(-5.0, 5.0))
def test_a_spring_closes_a_gap_within_the_limits(error, closing):
    v, other, dt, a = 20.0 + closing, 20.0, 0.02, 0.0
    for _ in range(4000):
        a = spring(error, v - other, a, LIMITS, dt)
        assert -3.0 <= a <= 2.0
        error -= (v - other + 0.5 * a * dt) * dt
        v += a * dt
    assert error == pytest.approx(0.0, abs=0.02)
    assert v == pytest.approx(other, abs=0.02)


def test_a_spring_is_as_stiff_as_the_end_of_the_approach_allows():
    """Behind its place a body ends by braking; in front of it, by accelerating."""
    limits = np.array([1.0, 4.0, 50.0, math.inf, math.inf])
    assert spring(0.1, 0.0, 0.0, limits, 0.1) == pytest.approx(0.1 * 0.4 * 4.0)
    assert spring(-0.1, 0.0, 0.0, limits, 0.1) == pytest.approx(-0.1 * 0.4 * 1.0)


def test_a_spring_s_jerk_is_limited():
    limits = np.array([2.0, 3.0, 40.0, 1.0, 1.5])
    assert spring(50.0, 0.0, 0.0, limits, 0.1) == pytest.approx(0.1)
    assert spring(-50.0, 0.0, 0.0, limits, 0.1) == pytest.approx(-0.15)
    assert spring(-50.0, 0.0, 2.0, limits, 0.1) == pytest.approx(1.85)


def profile(v, entries, follow=False, limits=LIMITS, a=0.0):
    values = np.array(entries, dtype=float).reshape(-1, 2)
    rows = np.zeros((3 * len(values) + 5, 4))
    n = lay_out(v, a, values[:, 0].copy(), values[:, 1].copy(), len(values), follow, limits, rows)
    return rows, n


def at(rows, n, times):
    return [profile_speed(rows, n, t) for t in times]


def test_a_profile_is_straight_between_its_entries():
    rows, n = profile(10.0, [(14.0, 4.0), (14.0, 2.0), (11.0, 3.0)])
    assert at(rows, n, [0, 2, 4, 5, 6, 7.5, 9, 20]) == pytest.approx(
        [10, 12, 14, 14, 14, 12.5, 11, 11]
    )


def test_entries_without_a_time_come_as_soon_as_can_be():
    rows, n = profile(10.0, [(14.0, math.nan), (8.0, math.nan)])
    # 4 m/s at 2 m/s², then 6 m/s at 3 m/s².
    assert at(rows, n, [1, 2, 3, 4, 5]) == pytest.approx([12, 14, 11, 8, 8])


def test_an_entry_that_comes_too_soon_comes_later():
    rows, n = profile(10.0, [(14.0, 1.0), (14.0, 1.0)])
    assert at(rows, n, [1, 2, 3]) == pytest.approx([12, 14, 14])


def test_a_first_entry_at_once():
    rows, n = profile(10.0, [(12.0, 0.0), (14.0, 2.0)])
    assert at(rows, n, [0, 1, 2]) == pytest.approx([12, 13, 14])
    rows, n = profile(10.0, [(12.0, 0.0), (14.0, 2.0)], follow=True)
    assert at(rows, n, [0, 1, 2]) == pytest.approx([10, 12, 14])


SMOOTH = np.array([2.0, 3.0, 40.0, 1.0, 1.0])


def test_one_change_at_a_limited_jerk_is_in_time():
    # 4 m/s in 6 s at 1 m/s³: the held acceleration solves k·6 − k² = 4: k = 3 − √5.
    rows, n = profile(10.0, [(14.0, 6.0)], follow=True, limits=SMOOTH)
    held = 3.0 - math.sqrt(5.0)
    assert rows[1, 2] == pytest.approx(held)
    assert at(rows, n, [0, 3, 6, 9]) == pytest.approx([10, 12, 14, 14])
    # In 3 s it cannot be done: k = √4 = 2, and it takes 4 s.
    rows, n = profile(10.0, [(14.0, 3.0)], follow=True, limits=SMOOTH)
    assert at(rows, n, [2, 4, 9]) == pytest.approx([12, 14, 14])


def test_corners_are_rounded_about_where_they_were():
    entries = [(14.0, 4.0), (14.0, 4.0), (11.0, 6.0)]
    rows, n = profile(10.0, entries, follow=True, limits=SMOOTH)
    t = np.linspace(0.0, 20.0, 4001)
    v = np.array(at(rows, n, t))
    a = np.diff(v) / np.diff(t)
    assert np.abs(np.diff(a) / np.diff(t)[1:]).max() <= 1.0 + 1e-3  # the jerk
    assert a.max() == pytest.approx(1.0, abs=1e-2)
    # Starting from no acceleration, it is 0.5·1²/1 m/s late on the first slope.
    assert at(rows, n, [2.0, 6.0, 17.0]) == pytest.approx([11.5, 14.0, 11.0])


@example([(0.0, 1.0)], 1e-146, True, 1.0)  # a change that a difference of squares would lose
@given(
    st.lists(st.tuples(st.floats(0.0, 30.0), st.floats(0.5, 10.0) | st.just(math.nan)), min_size=1,
             max_size=5),
    st.floats(0.0, 30.0), st.booleans(), st.floats(0.5, 5.0),
)  # fmt: skip
def test_a_profile_keeps_its_limits_and_ends_where_it_is_to(entries, v, follow, jerk):
    limits = np.array([2.0, 3.0, 40.0, jerk, jerk])
    rows, n = profile(v, entries, follow=follow, limits=limits)
    assert (np.diff(rows[:n, 0]) >= -1e-9).all()
    t = np.linspace(0.0, rows[n - 1, 0] + 5.0, 3001)
    speed = np.array(at(rows, n, t))
    slope = np.diff(speed) / np.diff(t)
    assert slope.max() <= 2.0 + 1e-6
    assert slope.min() >= -3.0 - 1e-6
    assert speed[0] == pytest.approx(v)
    assert speed[-1] == pytest.approx(entries[-1][0], abs=1e-6)
