"""The course beside the route: where it leads, and how comfortably."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers._path_kernels import (
    LATERAL_COMFORT,
    UNSHIFTED,
    aside_at,
    pursue,
    pursue_beside,
    shift_length,
    shift_speed,
)

GRIP = 0.85 * 9.81
LANES = st.floats(2.5, 4.0) | st.floats(-4.0, -2.5)


@given(before=st.floats(-4.0, 4.0), after=st.floats(-4.0, 4.0), length=st.floats(10.0, 200.0))
def test_a_shift_leads_steadily_from_one_offset_to_the_other(before, after, length):
    shift = (before, after, 30.0, length)
    at = np.array([aside_at(shift, s) for s in np.linspace(20.0, 40.0 + length, 200)])
    assert at[0] == before
    assert at[-1] == after
    assert (np.diff(at) * np.sign(after - before) >= -1e-12).all()
    assert aside_at(shift, 30.0 + 0.5 * length) == pytest.approx(0.5 * (before + after))


@given(across=LANES, v=st.floats(0.0, 40.0), grip=st.floats(1.0, 9.0))
def test_a_change_is_comfortable_at_its_speed_and_may_be_sped_up_a_little(across, v, grip):
    length = shift_length(across, v, grip)
    s = np.linspace(0.0, length, 2001)
    shift = (0.0, across, 0.0, length)
    aside = np.array([aside_at(shift, one) for one in s])
    bend = np.abs(np.diff(aside, 2)).max() / (s[1] - s[0]) ** 2
    comfort = min(LATERAL_COMFORT, 0.15 * grip)
    assert v * v * bend < comfort * 1.01
    assert bend < 0.081  # of the 0.2/m that a car's steering has
    fastest = shift_speed(shift, 0.5 * length, grip)
    assert fastest**2 * bend == pytest.approx(1.5 * comfort, rel=0.01)
    assert math.isinf(shift_speed(shift, length, grip))


def test_the_lateral_acceleration_gives_the_time_that_drivers_take():
    # Toledo and Zohar (2007): 4.6 s on average.
    assert shift_length(3.5, 25.0, GRIP) / 25.0 == pytest.approx(4.5, abs=0.1)


@given(x=st.floats(10.0, 50.0), y=st.floats(-3.0, 3.0), h=st.floats(-0.5, 0.5))
def test_without_a_shift_it_is_the_route_that_is_pursued(x, y, h):
    s = np.arange(0.0, 100.5, 0.5)
    one = np.ones_like(s)
    path = np.stack([s, 0.0 * s, 0.0 * s, one, 0.0 * s, 0.0 * s], axis=1)
    plain = pursue(path, len(path), 0.5, x, x, y, h, 8.0)
    assert pursue_beside(path, len(path), 0.5, x, UNSHIFTED, x, y, h, 8.0) == plain
    moved = pursue_beside(path, len(path), 0.5, x, (2.0, 2.0, 0.0, 0.0), x, y + 2.0, h, 8.0)
    assert moved == pytest.approx(plain, abs=1e-12)
