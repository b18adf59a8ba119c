"""pet by hand, and against every pair of instants."""

from math import pi

import numpy as np
import pytest
import shapely

from bridgegen.assess.metrics.times import pet

# By hand. Boxes are 4 m × 2 m about the reference point; 0.05 s a step.


def drive(rollout_of, *ways, t=200, **settings):
    """Bodies (x, y, heading, speed) at instant 0, which go straight on."""
    k = 0.05 * np.arange(t)
    x, y, h, v = (np.array([way[i] for way in ways])[:, None] for i in range(4))
    return rollout_of(
        x=x + v * k * np.cos(h), y=y + v * k * np.sin(h), h=h + 0 * k, v=v + 0 * k, **settings
    )


def test_from_leaving_to_entering_where_they_cross(rollout_of):
    """The ego's rear leaves the other's lane (x = 1) at 3 s, the other's front is there at 5 s."""
    ego, other = (-27.0, 0.0, 0.0, 10.0), (0.0, -28.0, pi / 2, 5.0)
    assert pet(drive(rollout_of, ego, other)) == pytest.approx([2.0], abs=0.051)
    assert pet(drive(rollout_of, other, ego)) == pytest.approx([2.0], abs=0.051)


def test_the_time_gap_of_one_that_follows(rollout_of):
    """Bumper to bumper 11 m at 10 m/s: just before 1.15 s its box reaches where the other was."""
    found = pet(drive(rollout_of, (0.0, 0.0, 0.0, 10.0), (15.25, 0.0, 0.0, 10.0)))
    assert found == pytest.approx([1.15])


def test_paths_that_have_no_point_in_common(rollout_of):
    assert pet(drive(rollout_of, (0, 0, 0.0, 10.0), (0, 3.5, 0.0, 12.0))) == [np.inf]
    assert pet(drive(rollout_of, (0, 0, 0.0, 10.0), (-30.0, 3.5, 0.0, 12.0))) == [np.inf]
    assert pet(drive(rollout_of, (0, 0, 0.0, 10.0))) == [np.inf]
    assert pet(drive(rollout_of, (0, 0, 0.0, 0.0), (6.0, 0.0, 0.0, 0.0))) == [np.inf]


def test_a_contact_is_zero(rollout_of):
    assert pet(drive(rollout_of, (0, 0, 0.0, 10.0), (30.0, 0.0, 0.0, 0.0))) == [0.0]


def test_one_that_stands_where_the_ego_was(rollout_of):
    """Nobody was where it stands; then the ego's rear goes away from it: never the same point."""
    assert pet(drive(rollout_of, (0, 0, 0.0, 10.0), (-6.0, 0.0, 0.0, 0.0))) == [np.inf]
    crawls = pet(drive(rollout_of, (0, 0, 0.0, 10.0), (-6.0, 0.0, 0.0, 1.0)))
    assert crawls == pytest.approx([2.0], abs=0.051)  # its front needs 2 s to where our rear was


@pytest.mark.parametrize(("later", "expected"), [(9.8, True), (10.3, False)])
def test_what_is_longer_than_ten_seconds_is_none(rollout_of, later, expected):
    ego, other = (-27.0, 0.0, 0.0, 10.0), (0.0, -3.0 - 2.0 * (3.0 + later), pi / 2, 2.0)
    found = pet(drive(rollout_of, ego, other, t=400))
    assert np.isfinite(found) == [expected]
    if expected:
        assert found == pytest.approx([later], abs=0.051)


def plain(rollout, i):
    n = rollout.n_steps[i]
    corners = []
    for e in range(rollout.shape[1]):
        length, width, ahead = rollout.box[e]
        h = rollout.h[i, e, :n]
        u, w = np.stack([np.cos(h), np.sin(h)]), np.stack([-np.sin(h), np.cos(h)])
        centre = np.stack([rollout.x[i, e, :n], rollout.y[i, e, :n]]) + ahead * u
        rings = [
            centre + 0.5 * a * length * u + 0.5 * b * width * w
            for a, b in ((1, 1), (-1, 1), (-1, -1), (1, -1))
        ]
        corners.append(shapely.polygons(np.stack(rings, axis=0).transpose(2, 0, 1)))
    lag = np.abs(np.subtract.outer(np.arange(n), np.arange(n)))
    best = np.inf
    for other in corners[1:]:
        touch = shapely.intersects(corners[0][:, None], other[None, :])
        if touch.any():
            best = min(best, lag[touch].min())
    return best * rollout.time_step


@pytest.mark.parametrize(
    ("shape", "within"), [((90, 2, 150), 15), ((25, 5, 100), 25), ((90, 2, 120), 20)]
)
def test_agrees_with_every_pair_of_instants(driven, shape, within):
    rollout = driven(*shape, seed=shape[2], within=within)
    expected = [plain(rollout, i) for i in range(shape[0])]
    np.testing.assert_allclose(pet(rollout), expected, rtol=1e-12)
    finite = np.array(expected)[np.isfinite(expected)]
    assert 0 < len(finite) < len(expected)
    assert (finite > 0).sum() >= 2
