"""Right-handed and left-handed."""

import carla
import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.adapters.carla import frame

metres = st.floats(-500.0, 500.0)
turns = st.floats(-np.pi + 1e-3, np.pi - 1e-3)


def box_of(x, y, z, height):
    return carla.BoundingBox(
        carla.Location(x=x, y=y, z=z), carla.Vector3D(x=2.4, y=1.0, z=height / 2)
    )


@given(
    x=metres, y=metres, h=turns, v=st.floats(0.0, 60.0), centre=st.floats(-1.0, 4.0),
    at=st.tuples(st.floats(-1, 1), st.floats(-0.5, 0.5), st.floats(0, 1)),
    ground=st.floats(-50.0, 50.0),
)  # fmt: skip
def test_there_and_back(x, y, h, v, centre, at, ground):
    """CARLA's numbers are single precision: 3e-5 m at 500 m, 2e-7 rad times 60 m/s."""
    box = box_of(*at, 1.5)
    state = np.array([x, y, h, v])
    spot = frame.placed(state, centre, box, ground)
    back = frame.seen(spot, frame.velocity(h, v), centre, box)
    np.testing.assert_allclose(back[:2], state[:2], atol=2e-4)
    np.testing.assert_allclose(back[2:], state[2:], atol=2e-5, rtol=1e-5)


@given(x=metres, y=metres, h=turns, centre=st.floats(-1.0, 4.0))
def test_boxes_have_the_same_middle(x, y, h, centre):
    """As CARLA itself works the middle of a body's box out."""
    box = box_of(0.3, -0.1, 0.7, 1.4)
    spot = frame.placed(np.array([x, y, h, 0.0]), centre, box, 3.0)
    middle = spot.transform(box.location)
    expected = (x + centre * np.cos(h), -(y + centre * np.sin(h)), 3.0 + 0.7)
    np.testing.assert_allclose((middle.x, middle.y, middle.z), expected, atol=2e-4)


def test_left_is_left():
    """A quarter turn to the left, from east to north: CARLA's y falls, its yaw too."""
    north = frame.rotation(np.pi / 2)
    assert north.yaw == pytest.approx(-90.0)
    ahead = carla.Transform(frame.location(1.0, 2.0), north).get_forward_vector()
    np.testing.assert_allclose((ahead.x, ahead.y), (0.0, -1.0), atol=1e-6)
    assert frame.point(frame.location(1.0, 2.0)) == (1.0, 2.0)
    assert frame.steering(1.0) == -1.0
    assert frame.velocity(np.pi / 2, 3.0).y == pytest.approx(-3.0)


def test_backwards_is_no_speed():
    box = box_of(0, 0, 0, 1)
    state = frame.seen(carla.Transform(), carla.Vector3D(x=-2.0), 1.4, box)
    assert state[3] == 0.0
