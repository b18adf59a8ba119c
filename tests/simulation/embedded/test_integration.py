"""Distances under SpeedActions agree with the closed form at every instant, whatever the step."""

import math

import numpy as np
import pytest

from .storyboards import after, crossroads, events, lane, run, scenario, speeding, start

DT = 0.05
ROADS = crossroads(arm_length=300.0)
BEGINS = 1.0  # s
TIMES = np.arange(int(5.0 / DT)) * DT


def travelled(dynamics, before, target):
    """Return how far a car has come at each instant; at 1 s its speed begins to change [m]."""
    privates = start("ego", lane(3, -1, 5.0), 0.0) + start("bv", lane(1, 1, 290.0), before)
    story = events(("e", "bv", speeding(target, dynamics), after(BEGINS)))
    rollout = run(scenario(("ego", "bv"), privates, story), roads=ROADS)
    x, y = rollout.x[0, 1], rollout.y[0, 1]
    return np.hypot(x - x[0], y - y[0])[: len(TIMES)]


def after_change(change, lasts, before, target):
    """Return the closed form: ``change`` is the integral of a shape from 0 to u, of 1 over 1."""
    t = np.clip(TIMES - BEGINS, 0.0, lasts) if lasts else np.zeros(len(TIMES))
    during = before * t + (target - before) * lasts * (change(t / lasts) if lasts else 0.0)
    rest = np.maximum(TIMES - BEGINS - lasts, 0.0)
    return before * np.minimum(TIMES, BEGINS) + during + target * rest


def test_a_step_of_the_speed_acts_from_its_instant():
    """10 m/s for 1 s, 30 m/s for 1 s: 40 m."""
    way = travelled("step time 0", 10.0, 30.0)
    assert way[round(2.0 / DT)] == pytest.approx(40.0, abs=1e-9)
    assert way == pytest.approx(after_change(None, 0.0, 10.0, 30.0), abs=1e-9)


@pytest.mark.parametrize("rate", [1.0, 3.0, 4.7])
@pytest.mark.parametrize(("before", "target"), [(5.0, 12.0), (12.0, 5.0), (8.0, 0.0), (0.0, 6.3)])
def test_a_ramp_that_ends_between_two_instants(before, target, rate):
    lasts = abs(target - before) / rate
    way = travelled(f"linear rate {rate}", before, target)
    wanted = after_change(lambda u: 0.5 * u**2, lasts, before, target)
    assert way == pytest.approx(wanted, abs=1e-9)


@pytest.mark.parametrize(
    ("shape", "integral", "tolerance"),
    [
        ("linear", lambda u: 0.5 * u**2, 1e-9),
        ("cubic", lambda u: u**3 - 0.5 * u**4, 1e-4),  # exact but in the step in which it ends
        ("sinusoidal", lambda u: 0.5 * u - np.sin(math.pi * u) / (2.0 * math.pi), 1e-4),
    ],
)
@pytest.mark.parametrize("lasts", [1.0, 2.0, 2.03])
def test_each_shape_over_a_time(shape, integral, tolerance, lasts):
    way = travelled(f"{shape} time {lasts}", 4.0, 6.0)
    assert way == pytest.approx(after_change(integral, lasts, 4.0, 6.0), abs=tolerance)
