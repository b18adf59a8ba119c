import math

import numpy as np
import pytest

from bridgegen.drivers import _tracking_kernels as track
from bridgegen.drivers.kinds import BOTH, CAR, HEADING, NO_FRAME, PEDESTRIAN, SEEN_BY, X, Y

from .scenes import Scene, ahead, weather


def test_ideal_perception_is_the_truth():
    scene = Scene((0, 0, 0.3, 8, CAR), (30, 5, 2.0, 6, CAR), (900, -5, -1.0, 1, PEDESTRIAN))
    detections, tracks = scene.perceive(weather(visual_range=20.0), ideal=True)
    frames = np.arange(scene.n_steps) % 2 == 0
    for e in (1, 2):
        x, y = scene.centre(e)
        assert (detections[e, frames, SEEN_BY] == BOTH).all()
        assert (detections[e, ~frames, SEEN_BY] == NO_FRAME).all()
        assert (detections[e, frames, X] == x[frames]).all()
        assert (tracks[:, e, track.X] == x).all()
        assert (tracks[:, e, track.Y] == y).all()
        assert (tracks[:, e, track.VX] == scene.v[e] * np.cos(scene.h[e])).all()
        assert (tracks[:, e, track.STATE] == track.CONFIRMED).all()
    assert (detections[0] == 0.0).all()


def test_a_car_close_by_on_a_clear_day_is_tracked_where_it_is():
    scene = ahead(20.0, speed=5.0)
    detections, tracks = scene.perceive(weather())
    x, _ = scene.centre(1)
    assert (tracks[10:, 1, track.STATE] >= track.CONFIRMED).all()
    assert tracks[40:, 1, track.X] == pytest.approx(x[40:], abs=0.5)
    assert tracks[40:, 1, track.VX] == pytest.approx(5.0, abs=0.7)
    assert tracks[40:, 1, track.Y] == pytest.approx(0.0, abs=0.5)
    assert detections[1, ::2, HEADING] == pytest.approx(0.0, abs=4 * 0.1)
    assert math.isfinite(detections[1:].sum())
    assert (detections[1, 1::2, SEEN_BY] == NO_FRAME).all()
    assert (detections[1, 1::2, Y] == 0.0).all()


@pytest.mark.parametrize("size", [(4.5, 1.8, 0.0), (0.0, 0.0, 0.0), (4.5, 0.0, 1.5)])
def test_bodies_without_extent_break_nothing(size):
    """Files in circulation have boxes of no height, the ego's own included."""
    scene = Scene((0, 0, 0.0, 8, CAR), (30, 0, 0.0, 6, CAR), (50, 0, 0.0, 6, CAR))
    scene.bodies[:, [0, 1, 7]] = size
    for numbers in (weather(), weather(visual_range=0.0), weather(rain=1e6, snow=1e6)):
        detections, tracks = scene.perceive(numbers)
        assert np.isfinite(detections).all()
        assert np.isfinite(tracks).all()


def test_bodies_at_the_same_place_break_nothing():
    scene = Scene((0, 0, 0.0, 8, CAR), (0, 0, 0.0, 8, CAR), (0, 0, 1.0, 8, PEDESTRIAN))
    detections, tracks = scene.perceive(weather())
    assert np.isfinite(detections).all()
    assert np.isfinite(tracks).all()
