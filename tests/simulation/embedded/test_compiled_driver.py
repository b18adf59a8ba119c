"""Compiled drivers of a user's own in the simulator."""

from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.assess.cause import Cause, counterfactuals
from bridgegen.base.errors import InputError
from bridgegen.drivers.driver_process import DriverError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

DRIVERS = Path(__file__).parents[2] / "ego"
FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status", "detections", "lights", "began")
N = 12


def made(name, scenario="crossroads-s1", *, file="compiled_drivers.py", **kwargs):
    logical = load(scenario)
    return Pipeline(
        logical, logical.space(), PipelineOptions(ego=f"{DRIVERS / file}:{name}", **kwargs)
    )


def rows(pipeline, n=N):
    return pipeline.space.decode(np.random.default_rng(4).random((n, pipeline.space.n_var)))


@pytest.fixture(scope="module")
def cruising():
    pipeline = made("cruises")
    return pipeline, pipeline.rollout(rows(pipeline))


def test_it_gives_the_bits_of_the_same_driver_written_as_a_class(cruising):
    pipeline, rollout = cruising
    other = made("Cruises", file="drivers.py").rollout(rows(pipeline))
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(rollout, name), getattr(other, name), name)


@pytest.mark.parametrize(
    ("scenario", "ideal"), [("cut-in", ()), ("red-light-runner", ("perception",))]
)
def test_it_is_told_what_a_class_is_told(scenario, ideal):
    """Sines may differ in their last bit between NumPy and numba."""
    one = made("looks_ahead", scenario, ideal=ideal)
    other = made("LooksAhead", scenario, file="drivers.py", ideal=ideal)
    one, other = one.rollout(rows(one)), other.rollout(rows(other))
    assert (one.a[:, 0] < -3.0).any()
    for name in FIELDS:
        np.testing.assert_allclose(
            getattr(one, name), getattr(other, name), rtol=1e-9, atol=1e-9, err_msg=name
        )


def test_a_row_s_result_is_the_same_in_any_batch_and_thread():
    pipeline = made("looks_ahead", "cut-in")
    pipeline.choose_objective()
    X = rows(pipeline, 300)
    whole, order = pipeline.evaluate(X), np.random.default_rng(1).permutation(300)
    np.testing.assert_array_equal(pipeline.evaluate(X[order]).metrics, whole.metrics[order])
    np.testing.assert_array_equal(pipeline.evaluate(X[7:8]).metrics, whole.metrics[7:8])


def test_memory_is_zeros_at_each_scenario_s_start_and_then_kept():
    pipeline = made("counts")
    for _ in range(2):
        rollout = pipeline.rollout(rows(pipeline, 5))
        assert (rollout.a[:, 0, :40] == 0.0).all()
        np.testing.assert_allclose(rollout.a[:, 0, 40], -1.0)


def test_what_it_is_told_are_copies(cruising):
    pipeline, rollout = cruising
    other = made("meddles").rollout(rows(pipeline))
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(rollout, name), getattr(other, name), name)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "status", "message"),
    [
        ("raises_fast", 20, "ValueError: too fast for me (compiled_drivers.py:"),
        ("reads_beyond_fast", 20, "IndexError: index is out of bounds"),
        ("hangs_fast", 21, "no answer within 0.5 s"),
        ("nan_fast", 23, "acceleration must be finite, got nan"),
    ],
)
def test_a_failure_costs_the_row_that_it_belongs_to(cruising, name, status, message):
    good, rollout = cruising
    n = 4 if name == "hangs_fast" else N
    X = rows(good)[:n]
    fast = X[:, good.space.names.index("ego_speed")] > 7.5
    assert 0 < fast.sum() < n
    failed = made(name, time_limit=0.5).rollout(X)
    np.testing.assert_array_equal(failed.status, np.where(fast, status, 0))
    assert sorted(failed.messages) == np.flatnonzero(fast).tolist()
    assert all(text.startswith(message) for text in failed.messages.values())
    for field in FIELDS:
        one, other = getattr(failed, field), getattr(rollout, field)[:n]
        np.testing.assert_array_equal(one[~fast], other[~fast], field)
        assert np.isfinite(one).all()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "message"),
    [
        ("misspelt", "compiled_drivers"),
        ("answers_one_number", "acceleration"),
        ("not_a_driver", "not_a_driver"),
        ("nothing", "compiled"),
    ],
)
def test_what_is_no_driver_is_refused(name, message):
    with refuses(InputError, message):
        made(name).warm_up()


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("file", "name"), [("compiled_drivers.py", "looks_ahead"), ("drivers.py", "LooksAhead")]
)
def test_a_replay_with_ideal_perception_is_just_that(file, name):
    pipeline = made(name, "jam-tail-in-fog", file=file)
    X = rows(pipeline, 6)
    replay = counterfactuals(pipeline.driver)[0]
    assert replay.cause == Cause.PERCEPTION
    simulator, columns = pipeline.runner.simulator, pipeline.runner.columns(X)
    roads = simulator.roads([pipeline.runner.concrete(X[0]).roads])
    replayed = simulator.run(roads, np.zeros(6, np.int64), columns, driver=replay.driver)
    other = made(name, "jam-tail-in-fog", file=file, ideal=["perception"]).rollout(X)
    foggy = pipeline.rollout(X)
    assert not np.array_equal(foggy.detections, replayed.detections)
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(replayed, field), getattr(other, field), field)


@pytest.mark.thorough
def test_causes_are_found():
    pipeline = made("looks_ahead", causes=True)
    pipeline.choose_objective()
    found = pipeline.evaluate(rows(pipeline, 40))
    assert found.critical.any()
    np.testing.assert_array_equal(found.cause > 0, found.critical)


@pytest.mark.parametrize(
    ("file", "name"), [("compiled_drivers.py", "hangs_fast"), ("drivers.py", "HangsFast")]
)
def test_a_driver_that_hangs_can_be_stopped(file, name):
    pipeline = made(name, file=file, time_limit=100.0)
    X = rows(pipeline, 4)
    slow = X[X[:, pipeline.space.names.index("ego_speed")] < 7.5]
    assert (pipeline.rollout(slow).status == 0).all()
    with ThreadPoolExecutor(1) as threads:
        hangs = threads.submit(pipeline.rollout, X)
        with pytest.raises(TimeoutError):
            hangs.result(timeout=1.0)
        pipeline.runner.simulator.stop()
        with refuses(DriverError):
            hangs.result(timeout=20.0)


def test_no_rows_at_all(cruising):
    pipeline, _ = cruising
    assert pipeline.rollout(rows(pipeline, 0)).shape[0] == 0


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("name", "of_class", "scenario"),
    [("lanes", "Lanes", "cut-in"), ("everything", "All", "red-light-runner")],
)
def test_it_gets_what_it_wants_as_a_class_does(name, of_class, scenario):
    one = made(name, scenario, file="wanting_drivers.py")
    other = made(of_class, scenario, file="wanting_drivers.py")
    one, other = one.rollout(rows(one)), other.rollout(rows(other))
    assert (one.status == 0).all()
    assert np.ptp(one.v[:, 0]) > 5.0
    for field in FIELDS:
        np.testing.assert_allclose(
            getattr(one, field), getattr(other, field), rtol=1e-9, atol=1e-9, err_msg=field
        )


@pytest.mark.thorough
def test_a_row_s_result_with_the_map_is_the_same_in_any_batch():
    pipeline = made("All", "crossroads-s4", file="wanting_drivers.py")
    X = rows(pipeline)
    whole, order = pipeline.rollout(X), np.random.default_rng(1).permutation(N)
    other, alone = pipeline.rollout(X[order]), pipeline.rollout(X[7:8])
    for field in FIELDS:
        np.testing.assert_array_equal(getattr(other, field), getattr(whole, field)[order])
        np.testing.assert_array_equal(getattr(alone, field)[0], getattr(whole, field)[7])
