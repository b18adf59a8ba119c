"""Dropouts and errors have the statistics that they are said to have."""

import math

import numpy as np
import pytest

from bridgegen.drivers import _camera_kernels as camera
from bridgegen.drivers import _lidar_kernels as lidar
from bridgegen.drivers import _weather_columns as column
from bridgegen.drivers._physics_kernels import DROPOUT_TIME, ERROR_TIME, HEADING_ERROR, MOUNT, veil
from bridgegen.drivers.kinds import (
    BOTH,
    CAMERA,
    CAR,
    HEADING,
    KIND,
    LAMPS,
    LENGTH,
    LIDAR,
    PEDESTRIAN,
    REFLECTANCE,
    SEEN_BY,
    X,
    Y,
)

from .scenes import BOX, Scene, weather

FRAMES = 20_000
STEP = 0.1
INDEPENDENT = FRAMES * STEP / (2.0 * DROPOUT_TIME)
"""How many independent samples the frames are worth."""


def stand(distance: float, numbers: np.ndarray, kind: int = CAR) -> np.ndarray:
    """Return the detections ``(T, 8)`` of somebody who stands ahead, every 0.1 s."""
    ahead = distance + BOX[CAR][2] - BOX[kind][2]
    bodies = ((0.0, 0.0, 0.0, 0.0, CAR), (ahead, 0.0, 0.0, 0.0, kind))
    scene = Scene(*bodies, n_steps=FRAMES, dt=STEP)
    return scene.perceive(numbers)[0][1]


def correlation(series: np.ndarray, lag: int) -> float:
    return float(np.corrcoef(series[:-lag], series[lag:])[0, 1])


def probabilities(distance: float, numbers: np.ndarray, kind: int) -> tuple[float, float]:
    """Return the stationary probabilities of camera and LiDAR, put together by hand."""
    box = BOX[kind]
    area = box[1] * box[7]
    dazzle = veil(numbers[column.GLARE], numbers[column.SUN_X])
    clear = camera.clarity(numbers, distance, dazzle, LAMPS[kind] / area, 1.0)
    by_camera = camera.detection(camera.pixels(math.sqrt(area), distance, clear))
    echoes, _ = lidar.returns(area, REFLECTANCE[kind], numbers[column.ATTENUATION], distance)
    return by_camera, lidar.detection(echoes)


@pytest.mark.parametrize(
    ("distance", "fog", "kind"),
    [(60.0, 230.0, CAR), (45.0, 150.0, CAR), (70.0, 10_000.0, PEDESTRIAN), (25.0, 60.0, CAR)],
)
def test_a_body_is_seen_as_often_as_its_probability_says_and_misses_come_in_runs(
    distance, fog, kind
):
    numbers = weather(visual_range=fog)
    seen = stand(distance, numbers, kind)[:, SEEN_BY]
    for sensor, p in zip((CAMERA, LIDAR), probabilities(distance, numbers, kind), strict=True):
        by = (seen == sensor) | (seen == BOTH)
        assert by.mean() == pytest.approx(p, abs=4.0 * math.sqrt(p * (1.0 - p) / INDEPENDENT))
        if 0.1 < p < 0.9:
            for lag in (1, 5):
                expected = math.exp(-lag * STEP / DROPOUT_TIME)
                assert correlation(by.astype(float), lag) == pytest.approx(expected, abs=0.1)
    both = np.prod(probabilities(distance, numbers, kind))
    assert (seen == BOTH).mean() == pytest.approx(both, abs=0.06)


def test_errors_of_lidar_and_camera_fused_have_their_variance_and_last():
    """At 30 m in clear air both see; weights are inverse variances, so 1/σ² = 1/σc² + 1/σl²."""
    numbers = weather()
    found = stand(30.0, numbers)
    found = found[found[:, SEEN_BY] == BOTH]
    assert len(found) > 0.95 * FRAMES
    clear = camera.clarity(
        numbers, 30.0, veil(numbers[column.GLARE], numbers[column.SUN_X]), 3.7, 1
    )
    by_camera = camera.position_errors(30.0, MOUNT * BOX[CAR][7], clear)
    _, ratio = lidar.returns(2.7, REFLECTANCE[CAR], numbers[column.ATTENUATION], 30.0)
    by_lidar = lidar.position_errors(30.0, ratio)
    truth = 30.0 + BOX[CAR][2]
    for axis, series in enumerate((found[:, X] - truth, found[:, Y])):
        sigma = (by_camera[axis] ** -2 + by_lidar[axis] ** -2) ** -0.5
        assert series.mean() == pytest.approx(0.0, abs=5.0 * sigma / math.sqrt(INDEPENDENT))
        assert series.std() == pytest.approx(sigma, rel=0.06)
        assert correlation(series, 3) == pytest.approx(math.exp(-0.3 / ERROR_TIME), abs=0.06)
    assert found[:, HEADING].std() == pytest.approx(HEADING_ERROR, rel=0.06)


def test_a_camera_alone_is_unsure_of_distance():
    """In fog of 60 m at 33 m the LiDAR hardly sees a pedestrian; the camera's error along the line
    of sight is d²/(f·height) a pixel, across it d/f."""
    numbers = weather(visual_range=90.0)
    found = stand(33.0, numbers, PEDESTRIAN)
    alone = found[found[:, SEEN_BY] == CAMERA]
    assert len(alone) > 500
    clear = camera.clarity(numbers, 33.0, veil(numbers[column.GLARE], numbers[column.SUN_X]), 0, 1)
    along, across = camera.position_errors(33.0, MOUNT * BOX[CAR][7], clear)
    assert alone[:, X].std() == pytest.approx(along, rel=0.25)
    assert alone[:, Y].std() == pytest.approx(across, rel=0.25)
    assert along > 3.0 * across


def test_sizes_are_right_on_average():
    found = stand(30.0, weather())
    found = found[found[:, SEEN_BY] > 0]
    assert found[:, LENGTH].mean() == pytest.approx(BOX[CAR][0], rel=0.01)


def test_classes_are_mistaken_where_little_is_seen():
    near, far = (stand(d, weather(visual_range=200.0), CAR) for d in (10.0, 55.0))
    wrong = [(one[one[:, SEEN_BY] > 0, KIND] != CAR).mean() for one in (near, far)]
    assert wrong[0] < 0.01
    assert 0.1 < wrong[1] < 0.5
