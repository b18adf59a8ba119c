"""What the reference driver's sensors see in a rollout: recorded, and by the row's weather."""

import numpy as np
import pytest

from bridgegen.drivers.kinds import BOTH, CAMERA, LIDAR, MISSED, NO_FRAME, SEEN_BY, X, Y
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

ROWS = 24


@pytest.fixture(scope="module")
def pipeline() -> Pipeline:
    scenario = load("crossroads-s4")
    return Pipeline(scenario, scenario.space(), PipelineOptions(ego="reference"))


@pytest.fixture(scope="module")
def X_random(pipeline) -> np.ndarray:
    U = np.random.default_rng(3).random((ROWS, pipeline.space.n_var))
    return pipeline.space.decode(U)


def frames_of(rollout):
    """Return ``(N, T)``: how many frames of body 1 the sensors took before the end."""
    real = np.arange(rollout.shape[2]) < rollout.n_steps[:, None]
    return real & (rollout.detections[:, 1, :, SEEN_BY] != NO_FRAME)


def test_every_tenth_of_a_second_somebody_looks(pipeline, X_random):
    rollout = pipeline.rollout(X_random)
    n, e, t = rollout.shape
    assert rollout.detections.shape == (n, e, t, 8)
    assert rollout.time_step == 0.05
    looked = rollout.detections[:, 1, :, SEEN_BY] != NO_FRAME
    for row in range(n):
        assert looked[row, : rollout.n_steps[row] : 2].all()
        assert not looked[row, 1 : rollout.n_steps[row] : 2].any()
    assert np.isin(
        rollout.detections[:, 1:, :, SEEN_BY], (NO_FRAME, MISSED, CAMERA, LIDAR, BOTH)
    ).all()


def test_detections_are_near_the_truth(pipeline, X_random):
    rollout = pipeline.rollout(X_random)
    seen = frames_of(rollout) & (rollout.detections[:, 1, :, SEEN_BY] == BOTH)
    ahead = rollout.box[1, 2]
    dx = rollout.x[:, 1] + ahead * np.cos(rollout.h[:, 1]) - rollout.detections[:, 1, :, X]
    dy = rollout.y[:, 1] + ahead * np.sin(rollout.h[:, 1]) - rollout.detections[:, 1, :, Y]
    assert seen.any()
    assert np.median(np.hypot(dx, dy)[seen]) < 0.5


def test_detections_do_not_depend_on_the_batch(pipeline, X_random):
    whole = pipeline.rollout(X_random).detections
    order = np.random.default_rng(0).permutation(ROWS)
    assert np.array_equal(pipeline.rollout(X_random[order]).detections, whole[order])
    for row in (0, ROWS - 1):
        assert np.array_equal(pipeline.rollout(X_random[row : row + 1]).detections[0], whole[row])


def test_thick_fog_hides_the_other(pipeline):
    """At 10 km of visibility nearly all frames show it; at 50 m most of those far away do not."""
    space = pipeline.space
    assert "fog_density" in space.variables
    shares = []
    for fog in (0.0, 100.0):
        rollout = pipeline.rollout(space.row({"fog_density": fog})[np.newaxis])
        frames = frames_of(rollout)
        gap = np.hypot(rollout.x[:, 1] - rollout.x[:, 0], rollout.y[:, 1] - rollout.y[:, 0])
        far = frames & (gap > 35.0)
        assert far.sum() > 5
        shares.append((rollout.detections[:, 1, :, SEEN_BY][far] > MISSED).mean())
    assert shares[0] > 0.95
    assert shares[1] < 0.5


def test_ideal_perception_misses_nothing(pipeline, X_random):
    scenario = load("crossroads-s4")
    ideal = Pipeline(
        scenario, scenario.space(), PipelineOptions(ego="reference", ideal=("perception",))
    )
    rollout = ideal.rollout(X_random)
    frames = frames_of(rollout)
    assert (rollout.detections[:, 1, :, SEEN_BY][frames] == BOTH).all()
    ahead = rollout.box[1, 2]
    x = rollout.x[:, 1] + ahead * np.cos(rollout.h[:, 1])
    assert rollout.detections[:, 1, :, X][frames] == pytest.approx(x[frames], abs=1e-9)


def test_a_driver_without_sensors_records_nothing():
    scenario = load("crossroads-s4")
    follower = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    rollout = follower.rollout(follower.space.row({})[np.newaxis])
    assert rollout.detections.size == 0
