"""Reference points become the middles of boxes, and trajectories keep every instant."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.recorded import Recording
from bridgegen.openx.openscenario.scenario_runner.story import centred, course

from .test_blueprints import box, vehicle

CAR = vehicle(osc.VehicleCategory.CAR, 4.6, 1.9, 1.5)
floats = arrays(np.float64, (1, 7), elements=st.floats(-500.0, 500.0))


def recording(x, y, h, step=0.05):
    return Recording(("a",), step, x, y, h, np.zeros_like(x), ())


def vertices(made):
    shape = made.trajectory("t").trajectory_ref.trajectory.shape.shape
    return [(v.time, v.position.position) for v in shape.vertices]


@given(floats, floats, floats)
def test_the_box_stays_where_it_was(x, y, h):
    made = course(recording(x, y, h), 0, CAR)
    ahead = np.stack([np.cos(h[0]), np.sin(h[0])])
    back = np.stack([made.x, made.y]) - 1.4 * ahead
    assert np.abs(back - np.stack([x[0], y[0]])).max() < 1e-9
    assert centred(CAR, "b").bounding_box.center == osc.Center(0.0, 0.0, 0.75)
    assert centred(CAR, "b").axles.rear.position_x == pytest.approx(1.4)  # 2.8 − 1.4


def test_a_vertex_for_each_instant_of_who_moves_and_two_of_who_stands():
    x, y, h = (np.zeros((1, 401)) for _ in range(3))
    still = vertices(course(recording(x, y, h), 0, CAR))
    assert [time for time, _ in still] == [0.0, 400 * 0.05]
    x[0, 200:] = 1e-6  # hardly
    moves = vertices(course(recording(x, y, h), 0, CAR))
    assert [time for time, _ in moves] == [k * 0.05 for k in range(401)]


def test_a_walker_s_place_is_its_middle_and_a_car_s_the_ground():
    walker = osc.Pedestrian("p", osc.PedestrianCategory.PEDESTRIAN, 75.0, box(0.5, 0.6, 1.8))
    still = recording(*(np.zeros((1, 3)) for _ in range(3)))
    assert course(still, 0, walker).position(0).position.z == 0.9
    assert centred(walker, "b").bounding_box.center.z == 0.0
    assert course(still, 0, CAR).position(0).position.z == 0.0
    assert course(still, 0, CAR, ground=12.5).position(0).position.z == 12.5
