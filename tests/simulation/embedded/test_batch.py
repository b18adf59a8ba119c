"""Rows by one instant at a time, with the driver asked in between, are the rows of a rollout."""

from typing import NamedTuple

import numba
import numpy as np
import pytest

from bridgegen.base.compiled import address_of, kernel, row_type
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.batch import Batch

from .storyboards import crossroads, lane, scenario, simulator, start

RECORDED = ("x", "y", "h", "v", "a", "offset", "lights", "began", "n_steps", "status")


def in_lock_step(batch: Batch):
    batch.start()
    for k in range(batch.record.x.shape[2]):
        batch.before_driver(k)
        batch.after_driver(k, *batch.demand(k))
    assert not batch.running.any()
    return batch.rollout()


@pytest.mark.parametrize("ego", ["route-follower", "reference"])
@pytest.mark.parametrize("name", ["crossroads-s4", "cut-in", "red-light-runner"])
def test_lock_step_gives_the_bits_of_the_rollout(name, ego):
    logical = load(name)
    space = logical.space()
    pipeline = Pipeline(logical, space, PipelineOptions(ego=ego))
    X = space.decode(np.random.default_rng(0).random((20, space.n_var)))
    columns = {parameter: X[:, i] for i, parameter in enumerate(space.names)}
    made = pipeline.runner.simulator
    roads = made.roads([pipeline.runner.concrete(space.row({})).roads])
    batch = made.batch(roads, np.zeros(len(X), dtype=np.int64), columns)
    whole, stepped = pipeline.rollout(X), in_lock_step(batch)
    assert (len(set(whole.n_steps.tolist())) > 1) == (name != "cut-in")
    for field in RECORDED:
        assert np.array_equal(getattr(whole, field), getattr(stepped, field)), field


def test_a_driver_in_python_is_asked_for_what_the_tyres_get():
    """1 m/s² for 4 s from 5 m/s: 9 m/s and 28 m."""
    made = simulator(scenario(("ego",), start("ego", lane(1, 1, 90.0), 5.0)))
    batch = made.batch(made.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})
    batch.start()
    for k in range(batch.record.x.shape[2]):
        batch.before_driver(k)
        assert batch.state.command[0, 0] == 5.0
        batch.after_driver(k, np.full(1, 1.0 if k < 80 else 0.0), np.zeros(1))
    rollout = batch.rollout()
    assert rollout.v[0, 0, 80] == pytest.approx(9.0)
    assert abs(rollout.y[0, 0, 80] - rollout.y[0, 0, 0]) == pytest.approx(28.0)


def test_a_row_that_has_ended_stays_as_it_is():
    short = start("ego", lane(1, -1, 70.0), 10.0)
    made = simulator(scenario(("ego",), short))
    batch = made.batch(made.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})
    in_lock_step(batch)
    before = batch.record.x.copy()
    batch.before_driver(100)
    batch.after_driver(100, np.ones(1), np.zeros(1))
    assert np.array_equal(batch.record.x, before)


def test_rows_of_the_same_types_have_one_type_and_kernels_one_address():
    """To derive both took longer than the rollout; kernels of other types lie elsewhere."""
    if numba.config.DISABLE_JIT:
        pytest.skip("nothing has a type")
    rows = [Pair(np.zeros((n, 2)), 1) for n in (3, 5)]
    assert row_type(rows[0]) is row_type(rows[1])
    other = row_type(Pair(np.zeros((3, 2), np.int64), 1))
    assert other != row_type(rows[0])
    assert row_type(Pair(np.zeros((3, 4))[:, ::2], 1)) not in (other, row_type(rows[0]))
    at = address_of(_first, (row_type(rows[0]),))
    assert address_of(_first, (row_type(rows[1]),)) == at
    assert address_of(_first, (other,)) != at


class Pair(NamedTuple):
    """Rows of an array, and a number."""

    values: np.ndarray
    number: int


@kernel
def _first(pair):
    return float(pair.values[0]), 0.0
