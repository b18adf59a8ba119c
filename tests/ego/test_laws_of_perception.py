"""What must hold in any weather: worse is never better, and nobody sees through anybody."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.drivers import _camera_kernels as camera
from bridgegen.drivers import _lidar_kernels as lidar
from bridgegen.drivers import _weather_columns as column
from bridgegen.drivers.kinds import (
    BOTH,
    CAMERA,
    CAR,
    HEADING,
    KIND,
    LIDAR,
    MISSED,
    NO_FRAME,
    PEDESTRIAN,
    SEEN_BY,
    X,
    Y,
)

from .scenes import Scene, ahead, weather

WORSE = {
    "visual_range": (5000.0, 20.0),
    "rain": (0.0, 50.0),
    "snow": (0.0, 10.0),
    "sun_elevation": (math.radians(60.0), math.radians(-30.0)),
}
"""What each quantity runs between, from good to bad; the sun is behind."""

KINDS = st.sampled_from([CAR, PEDESTRIAN])


def seen_by(detections: np.ndarray, which: int) -> np.ndarray:
    """Return when a sensor saw body 1, ``(T,)`` bool."""
    return (detections[1, :, SEEN_BY] == which) | (detections[1, :, SEEN_BY] == BOTH)


@settings(max_examples=30)
@pytest.mark.parametrize("name", WORSE)
@given(
    shares=st.tuples(st.floats(0.0, 1.0), st.floats(0.0, 1.0)), distance=st.floats(5.0, 120.0),
    kind=KINDS, key=st.integers(0, 2**63),
)  # fmt: skip
def test_worse_weather_never_shows_what_better_weather_hides(name, shares, distance, kind, key):
    good, bad = WORSE[name]
    scene = ahead(distance, kind, n_steps=41)
    better, worse = (
        scene.perceive(weather(**{"sun_azimuth": 1.5 * math.pi} | {name: value}), key)[0]
        for value in (good + share * (bad - good) for share in sorted(shares))
    )
    for sensor in (CAMERA, LIDAR):
        assert (seen_by(worse, sensor) <= seen_by(better, sensor)).all()


@settings(max_examples=30)
@given(
    st.tuples(st.floats(0.0, 80.0), st.floats(0.0, 80.0)), st.floats(2.0, 60.0),
    st.floats(5.0, 120.0), KINDS,
)  # fmt: skip
def test_nearer_to_the_sun_the_camera_never_sees_more(offs, elevation, distance, kind):
    """The ego looks east (+x), where azimuth is 90°; the sun stands off to the side."""
    far, near = (
        ahead(distance, kind, n_steps=41).perceive(
            weather(sun_elevation=math.radians(elevation), sun_azimuth=math.radians(90.0 + off))
        )[0]
        for off in sorted(offs, reverse=True)
    )
    assert (seen_by(near, CAMERA) <= seen_by(far, CAMERA)).all()
    assert (seen_by(near, LIDAR) == seen_by(far, LIDAR)).all()


@given(st.floats(2.0, 200.0), st.floats(2.0, 200.0), st.floats(20.0, 10_000.0))
def test_farther_is_never_clearer(a, b, fog):
    near, far = sorted((a, b))
    for numbers in (weather(visual_range=fog), weather(visual_range=fog, sun_elevation=-0.7)):
        nearer, farther = (
            camera.pixels(1.6, d, camera.clarity(numbers, d, 0.0, 0.0, 1.0)) for d in (near, far)
        )
        assert camera.detection(nearer) >= camera.detection(farther)
        nearer, farther = (
            lidar.returns(2.7, 0.3, numbers[column.ATTENUATION], d)[0] for d in (near, far)
        )
        assert lidar.detection(nearer) >= lidar.detection(farther)


@settings(max_examples=30)
@given(st.floats(20.0, 80.0), st.floats(0.3, 0.7), st.floats(-3.0, 3.0), st.integers(0, 2**63))
def test_who_is_hidden_is_never_detected(distance, where, side, key):
    """A pedestrian behind the side of a car that is as tall and twice as long as it hides."""
    walker = (distance, where * side, 0.0, 0.0, PEDESTRIAN)
    hides = (where * distance, where * where * side, math.pi / 2, 0.0, CAR)
    scene = Scene((0.0, 0.0, 0.0, 0.0, CAR), walker, hides, n_steps=41)
    scene.x[0] -= scene.bodies[0, 2]  # the sensors at the origin, …
    scene.y[2] -= scene.bodies[2, 2]  # … and the car's middle on the line of sight
    scene.bodies[2, 7] = 2.5
    detections, tracks = scene.perceive(weather(), key)
    assert (detections[1, ::2, SEEN_BY] == MISSED).all()
    assert (tracks[:, 1] == 0.0).all()
    assert (detections[2, ::2, SEEN_BY] != MISSED).any()


@settings(max_examples=20)
@given(
    st.floats(-math.pi, math.pi), st.floats(-500.0, 500.0), st.floats(-500.0, 500.0),
    st.integers(0, 2**63),
)  # fmt: skip
def test_turning_and_moving_the_world_with_its_sun_changes_nothing(turn, dx, dy, key):
    bodies = [
        (0.0, 0.0, 0.2, 7.0, CAR), (35.0, 4.0, 3.0, 5.0, CAR), (30.0, 1.5, 1.4, 1.0, PEDESTRIAN),
        (20.0, -3.0, 0.1, 2.0, CAR),
    ]  # fmt: skip
    c, s = math.cos(turn), math.sin(turn)
    turned = [
        (c * x - s * y + dx, s * x + c * y + dy, h + turn, v, kind) for x, y, h, v, kind in bodies
    ]
    low_sun = {"sun_elevation": 0.1, "visual_range": 120.0}
    here, tracks = Scene(*bodies).perceive(weather(sun_azimuth=1.2, **low_sun), key)
    there, moved = Scene(*turned).perceive(weather(sun_azimuth=1.2 - turn, **low_sun), key)
    assert (here[:, :, SEEN_BY] == there[:, :, SEEN_BY]).all()
    assert (here[:, :, KIND] == there[:, :, KIND]).all()
    x = np.where(here[:, :, SEEN_BY] > 0, c * here[:, :, X] - s * here[:, :, Y] + dx, 0.0)
    y = np.where(here[:, :, SEEN_BY] > 0, s * here[:, :, X] + c * here[:, :, Y] + dy, 0.0)
    h = np.where(here[:, :, SEEN_BY] > 0, here[:, :, HEADING] + turn, 0.0)
    assert there[:, :, X] == pytest.approx(x, abs=1e-6)
    assert there[:, :, Y] == pytest.approx(y, abs=1e-6)
    assert there[:, :, HEADING] == pytest.approx(h, abs=1e-9)
    assert there[:, :, HEADING + 1 : KIND] == pytest.approx(
        here[:, :, HEADING + 1 : KIND], abs=1e-9
    )
    assert (moved[:, :, 0] == tracks[:, :, 0]).all()


def test_who_is_out_of_sight_changes_nothing_for_the_others():
    """Neither somebody far away nor somebody behind: same bits."""
    bodies = [(0.0, 0.0, 0.0, 0.0, CAR), (60.0, 2.0, 0.0, 3.0, CAR)]
    alone, track = Scene(*bodies).perceive(weather(visual_range=300.0))
    for other in ((400.0, 0.0, 0.0, 0.0, CAR), (-30.0, 0.0, 0.0, 0.0, CAR)):
        with_other, tracks = Scene(*bodies, other).perceive(weather(visual_range=300.0))
        assert np.array_equal(with_other[1], alone[1])
        assert np.array_equal(tracks[:, 1], track[:, 1])


def test_a_key_and_a_number_make_the_noise():
    scene = ahead(60.0)
    numbers = weather(visual_range=300.0)
    one, again, other = (scene.perceive(numbers, key)[0] for key in (1, 1, 2))
    assert np.array_equal(one, again)
    assert not np.array_equal(one, other)


def test_frames_do_not_depend_on_the_time_step():
    numbers = weather(visual_range=150.0)
    start = ((0.0, 0.0, 0.0, 0.0, CAR), (50.0, 0.0, 0.0, 0.0, CAR))
    coarse, _ = Scene(*start, n_steps=51, dt=0.1).perceive(numbers)
    for parts in (2, 5, 10):
        fine, _ = Scene(*start, n_steps=50 * parts + 1, dt=0.1 / parts).perceive(numbers)
        assert np.array_equal(fine[:, ::parts], coarse)
        assert (np.delete(fine[1], np.s_[::parts], axis=0)[:, SEEN_BY] == NO_FRAME).all()


def test_a_step_longer_than_a_frame_has_a_frame_each():
    start = ((0.0, 0.0, 0.0, 0.0, CAR), (30.0, 0.0, 0.0, 0.0, CAR))
    detections, _ = Scene(*start, n_steps=50, dt=0.25).perceive(weather())
    assert (detections[1, :, SEEN_BY] != NO_FRAME).all()
