import math

import numpy as np
import pytest

from bridgegen.drivers import _tracking_kernels as track
from bridgegen.drivers.kinds import (
    BOTH,
    CAR,
    HEADING,
    MISSED,
    NO_FRAME,
    PEDESTRIAN,
    SEEN_BY,
    WIDTH,
    X,
    Y,
)

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


def beside_a_car(aside, across=0.0, *, angle=2.0, extent=1.0, **more):
    """Return detections and tracks of a pedestrian whose edge is ``aside`` [deg] left of a car's.

    The sensors are 1.4 m ahead of the ego's reference point, as is the car's centre: 40 m apart.
    """
    rear = 40.0 - 2.25  # the car's nearest corners, at which it is widest from there
    left = np.tan(np.arctan2(0.9, rear) + np.radians(aside)) * 39.75 + 0.25  # its nearest, too
    scene = Scene(
        (0.0, 0.0, 0.0, 0.0, CAR), (40.0, 0.0, 0.0, 0.0, CAR),
        (41.4, left, np.pi / 2, across, PEDESTRIAN), **more,
    )  # fmt: skip
    settings = (np.radians(angle), 1.5, extent, *track.TRACKER[3:])
    return scene.perceive(weather(), tracker=settings)


@pytest.mark.parametrize(("aside", "is_one"), [(1.9, True), (2.1, False)])
def test_bodies_within_the_resolution_are_one(aside, is_one):
    detections, tracks = beside_a_car(aside)
    frames = detections[:, ::2, SEEN_BY]
    both = (frames[1] > MISSED) & (frames[2] > MISSED)
    assert both.any() != is_one
    if is_one:  # one body, as wide as both
        there = frames[1] > MISSED
        edge = np.tan(np.arctan2(0.9, 37.75) + np.radians(aside)) * 39.75 + 0.5
        assert detections[1, ::2, WIDTH][there].mean() == pytest.approx(edge + 0.9, rel=0.15)
        assert detections[1, ::2, Y][there].mean() == pytest.approx(0.5 * (edge - 0.9), abs=0.3)
        assert (tracks[:, 2, track.STATE] == track.NONE).mean() > 0.9


def test_the_greater_one_masks_the_other_where_its_box_does_not_grow():
    detections, _ = beside_a_car(1.0, extent=0.0)
    there = detections[1, :, SEEN_BY] > MISSED
    assert detections[1, there, WIDTH].max() < 2.3  # 1.8 m, and 6 % once or twice
    assert (detections[2, there, SEEN_BY] == MISSED).all()


def test_what_is_one_parts_beyond_the_resolution_and_its_track_is_late():
    away, tracks = beside_a_car(0.5, 2.0)
    gap = np.degrees(np.arctan2(np.arange(101) * 0.05 * 2.0, 40.0)) + 0.5
    there = (away[1, :, SEEN_BY] > MISSED) & (away[2, :, SEEN_BY] > MISSED)
    assert gap[there].min() == pytest.approx(3.0, abs=0.3)  # 1.5 of 2°
    begins = np.flatnonzero(there)[0]
    confirmed = np.flatnonzero(tracks[:, 2, track.STATE] == track.CONFIRMED)[0]
    assert 0.2 <= (confirmed - begins) * 0.05 <= 0.5  # 3 of 5 frames
    back, _ = beside_a_car(5.0, -2.0)
    gap = 5.0 - np.degrees(np.arctan2(np.arange(101) * 0.05 * 2.0, 40.0))
    there = (back[1, :, SEEN_BY] > MISSED) & (back[2, :, SEEN_BY] > MISSED)
    assert gap[there & (gap > 0.0)].min() == pytest.approx(2.0, abs=0.3)
