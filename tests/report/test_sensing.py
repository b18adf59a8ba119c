"""What the page calls seen and missed is what the metrics of perception count."""

import numpy as np
import pytest

from bridgegen.assess.metrics.perception import e_position, perceived
from bridgegen.drivers.kinds import DETECTION, GHOST, SEEN_BY, X, Y
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.playback_payload import playback_payload
from bridgegen.pages.playbacks import nominal_playback
from bridgegen.pages.sensing import TOLERANCE, sensed
from bridgegen.scenario.language.reader import load


@pytest.fixture(scope="module")
def rollout():
    logical = load("jam-tail-in-fog")
    space = logical.space()
    pipeline = Pipeline(logical, space, PipelineOptions(ego="reference"))
    return pipeline.rollout(space.decode(np.random.default_rng(1).random((4, space.n_var))))


def off(rollout, row, one):
    """Distance of each detection from the truth, ``(E, F)``; NaN where there is none."""
    k, box = one.steps, rollout.box
    cx = rollout.x[row][:, k] + box[:, 2:] * np.cos(rollout.h[row][:, k])
    cy = rollout.y[row][:, k] + box[:, 2:] * np.sin(rollout.h[row][:, k])
    return np.hypot(one.x - cx, one.y - cy)


def test_the_mean_error_of_what_counts_is_e_position(rollout):
    for row, one in enumerate(sensed(rollout)):
        error = off(rollout, row, one)
        told = one.counts & (one.seen_by > 0)
        assert error[told].mean() == pytest.approx(e_position(rollout)[row], rel=1e-12)


def test_what_counts_and_is_not_seen_is_missed(rollout):
    truth = perceived(rollout)
    missed = 0
    for row, one in enumerate(sensed(rollout)):
        counted = truth.counts[row][:, one.steps]
        assert (one.counts == counted).all()
        assert counted.sum() == truth.counts[row].sum()  # no frame is left out
        seen = rollout.detections[row][:, one.steps, 0] > 0
        assert (seen[1:] == (one.seen_by[1:] > 0)).all()
        assert (one.seen_by[0] == -1).all()
        missed += int((counted & ~seen).sum())
    assert missed > 10


def test_displaced_is_what_is_no_hit_at_the_strictest_threshold(rollout):
    one = sensed(rollout)[0]
    assert one.tolerance == TOLERANCE == 0.5
    assert np.isnan(one.x[one.seen_by <= 0]).all()
    assert np.isfinite(one.x[one.seen_by > 0]).all()
    assert ((one.kind >= 0) == (one.seen_by > 0)).all()


def test_without_sensors_there_is_nothing():
    logical = load("crossroads-s4")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego="route-follower"))
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    assert rollout.detections.shape[-1] == DETECTION
    assert sensed(rollout) == []


def test_a_ghost_is_drawn_where_the_sensors_report_it_and_only_then():
    """The page's whole numbers, read again: within a centimetre of the detections."""
    logical = load("phantom-braking")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego="reference"))
    played = nominal_playback(pipeline, "phantom-braking")
    packed = playback_payload(played, 0, 0)["sensed"]
    ghosts = pipeline.rollout(logical.space().row({})[np.newaxis]).ghosts[0, 0]
    steps = np.flatnonzero(ghosts[:, SEEN_BY] == GHOST)
    (told,) = packed["phantoms"]
    assert len(told) == len(steps) > 5
    at = np.cumsum(packed["steps"])[[row[0] for row in told]]
    assert at.tolist() == steps.tolist()
    there = np.array(told)[:, 1:3] / 100 + np.column_stack((played.x[0, at], played.y[0, at]))
    assert there == pytest.approx(ghosts[steps][:, [X, Y]], abs=0.01)
    assert {packed["kinds"][row[-1]] for row in told} == {"car"}
