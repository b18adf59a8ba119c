"""Rows on a pretend GPU, by the PTX that ships: the same bits as on the processor, row by row."""

import os
from dataclasses import fields

import numpy as np
import pytest
from tests.covering import covering

from bridgegen.assess.conflict import quantities
from bridgegen.assess.conflict._measure_kernels import IOU, MAP, MEASURED
from bridgegen.assess.conflict.analysis import analyse, encounters
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.base.cuda import DEVICE
from bridgegen.engine.judged import judge
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load, names
from bridgegen.simulation.embedded import device

DRIVERS = ("route-follower", "careful", "fsm", "reference")
SEVERAL = {"two-at-crossroads"}
SOME = [("crossroads-s4", "reference"), ("crossroads-s2", "route-follower")]


def made(name, ego, n=4, seed=1):
    scenario = load(name)
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego))
    space = pipeline.space
    return pipeline, space.decode(np.random.default_rng(seed).random((n, space.n_var)))


def bits(array):
    return array.shape, array.dtype, np.ascontiguousarray(array).tobytes()


def unequal(one, other):
    """Return the names of the arrays of two rollouts, or conflicts, that differ in a bit."""
    pairs = (
        (item.name, getattr(one, item.name), getattr(other, item.name)) for item in fields(one)
    )
    return [name for name, a, b in pairs if isinstance(a, np.ndarray) and bits(a) != bits(b)]


def compare(name, ego, gpu, monkeypatch):
    pipeline, X = made(name, ego)
    rollout = pipeline.runner.run(X)
    monkeypatch.setenv(DEVICE, "cuda")
    launches = gpu.launches
    there = pipeline.runner.run(X)
    assert gpu.launches > launches
    assert unequal(rollout, there) == []
    # Of a driver that perceives false positives, pages count them in "map", too.
    last = IOU if not rollout.detections.size else MAP if rollout.ghosts.size else len(MEASURED)
    metrics = MEASURED[:last]
    for at, runner in pipeline.runner.by_variant(X):
        part = rollout.take(at)
        judged = judge(runner, X[at], metrics=metrics)
        assert judged.status.tolist() == part.status.tolist()
        assert judged.n_steps.tolist() == part.n_steps.tolist()
        assert judged.code.tolist() == plausibility(part).code.tolist()
        ok = np.flatnonzero(judged.status == 0)
        want = encounters(part).take(ok)
        assert unequal(want, judged.conflicts(ok)) == []
        assert judged.worst[ok].tolist() == want.kind.max(axis=1).tolist()
        touches = (part.distance <= 0.0) & (np.arange(part.shape[2]) < part.n_steps[:, None, None])
        assert judged.touches[ok].tolist() == touches.any(axis=(1, 2))[ok].tolist()
        assert bits(judged.metrics[ok]) == bits(quantities.evaluate(part, metrics)[ok])
        roads, _ = runner.roads_of(X[at])
        if not roads.turnings:
            judged = judge(runner, X[at], violations=True)
            assert unequal(analyse(part).take(ok), judged.conflicts(ok)) == []


@pytest.mark.thorough
@pytest.mark.parametrize(("name", "ego"), SOME)
def test_rows_have_the_same_bits(name, ego, gpu, monkeypatch):
    compare(name, ego, gpu, monkeypatch)


@pytest.mark.thorough
@pytest.mark.parametrize("ego", DRIVERS)
def test_rows_of_the_catalogue_have_the_same_bits(ego, gpu, monkeypatch):
    # A law of the code; all of the catalogue was compared before this was committed.
    for name in names() if os.environ.get("BRIDGEGEN_EXPLORE") else covering():
        monkeypatch.delenv(DEVICE, raising=False)
        if load(name).name not in SEVERAL:
            compare(name, ego, gpu, monkeypatch)


@pytest.mark.thorough
def test_with_little_memory_fewer_threads_do_the_same(gpu, monkeypatch):
    pipeline, X = made("crossroads-s1", "route-follower", 160)
    want = pipeline.runner.run(X)
    monkeypatch.setenv(DEVICE, "cuda")
    blocks = []
    for free in (2**30, 26 * 2**20):
        gpu.free = free
        gpu.blocks.clear()
        device._opened.cache_clear()
        assert unequal(want, pipeline.runner.run(X)) == []
        blocks.append(gpu.widest)
        gpu.widest = 0
    assert blocks[1] < blocks[0]


@pytest.mark.thorough
def test_a_row_that_needs_more_memory_than_a_thread_has_is_simulated_here(gpu, monkeypatch):
    pipeline, X = made("cut-in", "fsm")
    want = pipeline.runner.run(X)
    monkeypatch.setenv(DEVICE, "cuda")
    monkeypatch.setattr(device, "HEAP", 16)
    monkeypatch.setattr(device, "HEAP_EACH", 0)
    assert judge(pipeline.runner, X) is None
    assert unequal(want, pipeline.runner.run(X)) == []
