"""Positions of NGSIM are those of fronts; the axle behind follows them."""

import numpy as np
import pytest

from bridgegen.recordings.readers.formats import read
from bridgegen.recordings.readers.states import centre_ahead

from . import writers as w

LENGTH = 10.0
ARM = LENGTH / 2 + centre_ahead(1, LENGTH)  # of a truck


def on_a_circle(radius, turn, course=0.0, speed=8.0):
    """A truck whose front is on a circle, ``turn`` 1 to the left, and its rear axle on another."""
    t = w.STEP * np.arange(200)
    inner = np.sqrt(radius**2 - ARM**2)
    at = turn * speed * t / inner + course  # the direction from the middle to the rear axle
    heading = at + turn * np.pi / 2
    rear = inner * np.column_stack([np.cos(at), np.sin(at)])
    along = np.column_stack([np.cos(heading), np.sin(heading)])
    x, y = (rear + centre_ahead(1, LENGTH) * along).T
    still = np.zeros_like(t)
    states = np.column_stack([t, x, y, heading, speed * np.cos(heading), speed * np.sin(heading),
                              still])  # fmt: skip
    return w.Track("1", "truck", LENGTH, 2.5, states)


@pytest.mark.parametrize(("radius", "turn"), [(15.0, 1), (30.0, -1), (200.0, 1)])
@pytest.mark.parametrize("course", [0.0, 2.0])
def test_the_centre_is_where_the_rear_axle_following_the_front_puts_it(
    tmp_path, radius, turn, course
):
    track = on_a_circle(radius, turn, course)
    (found,) = read(w.write_ngsim(tmp_path, [track]))
    settled = slice(100, None)  # the first direction is known roughly, and forgotten in 8 m each
    off = np.angle(np.exp(1j * (found.heading - track.states[:, 3])))
    assert np.abs(off[settled]).max() < 2e-3
    assert found.x[settled] == pytest.approx(track.states[settled, 1], abs=0.02)
    assert found.y[settled] == pytest.approx(track.states[settled, 2], abs=0.02)


def test_who_stands_among_noise_keeps_its_heading(tmp_path):
    rng = np.random.default_rng(3)
    t = w.STEP * np.arange(600)
    x = np.minimum(8.0 * t, 80.0)
    y, still = np.zeros_like(t), np.zeros_like(t)
    states = np.column_stack([t, x, y, still, np.where(t < 10.0, 8.0, 0.0), still, still])
    states[:, 1:3] += rng.normal(0.0, 0.1, (len(t), 2))
    (found,) = read(w.write_ngsim(tmp_path, [w.Track("1", "truck", LENGTH, 2.5, states)]))
    assert np.abs(found.heading[150:]).max() < 0.05
