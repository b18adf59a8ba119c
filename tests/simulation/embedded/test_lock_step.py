"""Drivers of a user's own in the simulator: what they do, and what their failures cost."""

from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

DRIVERS = Path(__file__).parents[2] / "ego" / "drivers.py"
FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status")
N = 12


def made(name, scenario="crossroads-s1", **kwargs):
    logical = load(scenario)
    return Pipeline(logical, logical.space(), PipelineOptions(ego=f"{DRIVERS}:{name}", **kwargs))


def rows(pipeline, n=N):
    return pipeline.space.decode(np.random.default_rng(4).random((n, pipeline.space.n_var)))


def asked_speed(pipeline, X):
    return X[:, pipeline.space.names.index("ego_speed")]


@pytest.mark.parametrize("scenario", ["crossroads-s1", "cut-in", "red-light-runner"])
def test_a_row_s_result_is_the_same_in_any_batch(scenario):
    pipeline = made("LooksAhead", scenario)
    X = rows(pipeline)
    whole = pipeline.rollout(X)
    order = np.random.default_rng(1).permutation(N)
    other, alone = pipeline.rollout(X[order]), pipeline.rollout(X[7:8])
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(other, name), getattr(whole, name)[order])
        np.testing.assert_array_equal(getattr(alone, name)[0], getattr(whole, name)[7])


def test_a_driver_that_looks_stays_on_its_lane():
    rollout = made("LooksAhead", "crossroads-s4").rollout(rows(made("LooksAhead", "crossroads-s4")))
    assert (rollout.status == 0).all()
    assert np.abs(rollout.offset[:, 0]).max() < 0.6


@pytest.mark.parametrize(
    ("name", "got"),
    [("AnswersOneForAll", "(1,)"), ("AnswersOneNumber", "()"), ("AnswersAColumn", "(2, 1)")],
)
def test_one_answer_for_all_rows_is_none_for_one_row_either(name, got):
    pipeline = made(name)
    alone = pipeline.rollout(rows(pipeline)[:1])
    assert alone.status.tolist() == [23]
    approve(alone.messages[0], "acceleration", got)


@pytest.mark.parametrize(
    ("name", "status", "message"),
    [
        ("FailsFast", 20, "ValueError: too fast for me"),
        ("HangsFast", 21, "no answer within 0.3 s"),
        ("DiesFast", 22, "ended with status 3"),
        ("NaNFast", 23, "acceleration must be finite, got nan"),
    ],
)
def test_a_failure_costs_the_row_that_it_belongs_to(name, status, message):
    pipeline = made(name, time_limit=0.3)
    X = rows(pipeline)
    fast = asked_speed(pipeline, X) > 7.5
    assert 0 < fast.sum() < N
    rollout = pipeline.rollout(X)
    np.testing.assert_array_equal(rollout.status, np.where(fast, status, 0))
    assert sorted(rollout.messages) == np.flatnonzero(fast).tolist()
    assert all(message in text for text in rollout.messages.values())
    good = made("Cruises").rollout(X)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(rollout, field)[~fast], getattr(good, field)[~fast])
        assert np.isfinite(getattr(rollout, field)).all()


def test_a_batch_of_failures_is_evaluated():
    pipeline = made("FailsFast")
    pipeline.choose_objective()
    X = rows(pipeline)
    found = pipeline.evaluate(X)
    fast = asked_speed(pipeline, X) > 7.5
    np.testing.assert_array_equal(np.isnan(found.metrics).any(axis=1), fast)
    assert not found.critical[fast].any()
    assert sorted(found.messages) == np.flatnonzero(fast).tolist()


def test_no_rows_at_all():
    pipeline = made("Cruises")
    assert pipeline.rollout(rows(pipeline, 0)).shape[0] == 0


@pytest.mark.parametrize("name", ["Plans", "PlansAtOnce", "PlansAndControls", "HoldsControl"])
def test_a_row_that_is_planned_is_the_same_in_any_batch(name):
    pipeline = made(name)
    X = rows(pipeline)
    whole = pipeline.rollout(X)
    assert (whole.status == 0).all()
    order = np.random.default_rng(1).permutation(N)
    other, alone = pipeline.rollout(X[order]), pipeline.rollout(X[7:8])
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(other, field), getattr(whole, field)[order])
        np.testing.assert_array_equal(getattr(alone, field)[0], getattr(whole, field)[7])


def test_a_plan_is_followed_to_where_it_leads():
    pipeline = made("Plans")
    X = rows(pipeline)
    planned, controlled = pipeline.rollout(X), made("Cruises").rollout(X)
    for row in range(N):  # straight on, with the same acceleration at each call
        last = min(planned.n_steps[row], controlled.n_steps[row]) - 1
        apart = planned.x[row, 0] - controlled.x[row, 0], planned.y[row, 0] - controlled.y[row, 0]
        assert np.hypot(*apart)[:last].max() < 0.5
        np.testing.assert_allclose(planned.h[row, 0, :last], planned.h[row, 0, 0], atol=1e-9)
    assert np.ptp(planned.v[:, 0]) > 1.0


def test_a_control_is_held_for_the_period():
    pipeline = made("HoldsControl")
    alone = pipeline.rollout(rows(pipeline)[:1])
    assert alone.time_step == 0.05
    done = alone.a[0, 0, :12]  # the first call is at t = 0
    np.testing.assert_allclose(done, np.repeat([0.1, 0.2, 0.3], 4), atol=1e-9)


def test_the_sensors_look_at_every_instant_whatever_the_period():
    pipeline = made("Plans", "cut-in")
    X = rows(pipeline, 2)
    seen = pipeline.rollout(X).detections
    assert seen.shape[0] == 2
    each = made("Cruises", "cut-in").rollout(X).detections
    frames = [(one[0, 1:, :20] != 0.0).any(axis=(0, 2)) for one in (seen, each)]
    np.testing.assert_array_equal(*frames)
    assert frames[0].sum() >= 8


def test_a_history_has_the_instants_at_which_the_driver_is_not_asked():
    """Asked every 0.2 s, it decides as one does that is asked always and decides as often."""
    pipeline = made("DecidesByHistory", "cut-in")
    X = rows(pipeline, 3)
    each, held = pipeline.rollout(X), made("IsAskedForHistory", "cut-in").rollout(X)
    assert (held.status == 0).all()
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(held, field), getattr(each, field))
    assert len(np.unique(held.a[:, 0, :80])) > 20


def test_a_bad_plan_costs_the_row_that_it_belongs_to():
    pipeline = made("PlansThePastFast")
    X = rows(pipeline)
    fast = asked_speed(pipeline, X) > 7.5
    rollout, good = pipeline.rollout(X), made("Plans").rollout(X)
    np.testing.assert_array_equal(rollout.status, np.where(fast, 23, 0))
    assert {*rollout.messages.values()} == {
        "a trajectory must not begin in the past, got a first time of -2 s; times count from the "
        "call of act"
    }
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(rollout, field)[~fast], getattr(good, field)[~fast])


def test_a_driver_with_no_such_period_is_an_error_of_the_users():
    pipeline = made("PeriodOfAnHour")
    with refuses(InputError, "period"):
        pipeline.rollout(rows(pipeline, 1))
