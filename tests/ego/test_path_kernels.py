import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers._path_kernels import pose, project, pursue


def circle(radius: float, turn: float, ds: float = 0.2) -> tuple[np.ndarray, int, float]:
    """A left-hand circular path of the given radius from the origin, heading +x."""
    n = math.ceil(radius * turn / ds) + 1
    step = radius * turn / (n - 1)
    h = np.arange(n) * step / radius
    path = np.stack(
        [
            radius * np.sin(h),
            radius * (1.0 - np.cos(h)),
            h,
            np.cos(h),
            np.sin(h),
            np.full(n, 1.0 / radius),
        ],
        axis=1,
    )
    return path, n, step


@given(st.floats(6.0, 200.0), st.floats(0.1, 0.9), st.floats(-2.0, 2.0), st.floats(-0.4, 0.4))
def test_project_finds_station_and_offset_of_a_point_beside_a_circle(radius, share, d, guess):
    path, n, ds = circle(radius, 2.0)
    s = share * 2.0 * radius
    x, y = (radius - d) * math.sin(s / radius), radius - (radius - d) * math.cos(s / radius)
    station, offset = project(path, n, ds, s + guess, x, y)
    assert station == pytest.approx(s, abs=2e-3)
    assert offset == pytest.approx(d, abs=2e-3)


@given(st.floats(6.0, 200.0), st.floats(0.0, 1.0))
def test_pose_lies_on_the_circle_to_a_millimetre(radius, share):
    path, n, ds = circle(radius, 2.0)
    x, y, h = pose(path, n, ds, share * 2.0 * radius)
    assert math.hypot(x, y - radius) == pytest.approx(radius, abs=1e-3)
    assert h == pytest.approx(share * 2.0, abs=1e-9)


def test_pose_beyond_the_end_goes_on_along_the_tangent():
    path = np.array([[0, 0, 0, 1, 0, 0], [1, 0, 0, 1, 0, 0]], dtype=float)
    assert pose(path, 2, 1.0, 3.5) == (3.5, 0.0, 0.0)


def test_pursuit_of_its_own_circle_is_that_circle():
    path, n, ds = circle(20.0, 2.0, ds=0.01)
    assert pursue(path, n, ds, 0.0, 0.0, 0.0, 0.0, 8.0) == pytest.approx(1 / 20.0, rel=1e-3)
