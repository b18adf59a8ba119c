import math

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.drivers.kinds import CAR, PEDESTRIAN
from bridgegen.drivers.sight import HEAD, Sky, detection_range, table


@given(st.sampled_from([CAR, PEDESTRIAN]), st.floats(20.0, 10_000.0), st.floats(0.0, 50.0))
def test_two_sensors_see_at_least_as_far_as_one(kind, fog, rain):
    found = detection_range(Sky(fog, rain), kind)
    assert found.fused >= max(found.camera, found.lidar) * (1.0 - 1e-9)


def test_half_of_the_frames_of_a_rollout_show_a_car_at_the_range_that_is_told():
    """Against the sensors themselves, looking north with the sun behind: azimuth 180°."""
    from .scenes import Scene, weather

    sky = Sky(visual_range=150.0)
    d = detection_range(sky, CAR).fused
    numbers = weather(visual_range=150.0)
    north = math.pi / 2
    bodies = ((0.0, 0.0, north, 0.0, CAR), (0.0, d, north, 0.0, CAR))
    detections, _ = Scene(*bodies, n_steps=20_000, dt=0.1).perceive(numbers)
    assert (detections[1, :, 0] > 0).mean() == pytest.approx(0.5, abs=0.06)


def test_the_table_has_a_line_per_weather_and_no_empty_place():
    lines = list(table())
    assert {len(line) for line in lines} == {len(HEAD)}
    assert len({line[0] for line in lines}) == len(lines)
    clear = lines[0]
    for line in lines[1:]:
        assert all(0.0 < far <= 1.01 * most for far, most in zip(line[1:], clear[1:], strict=True))


@pytest.mark.parametrize(
    ("name", "value"),
    [("visual_range", 0.0), ("rain", -1.0), ("sun_altitude", 91.0), ("cloud", math.nan),
     ("snow", math.inf)],
)  # fmt: skip
def test_no_such_sky(name, value):
    with refuses(InputError, name):
        Sky(**{name: value})
