from dataclasses import fields, replace

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess import metrics
from bridgegen.assess.conflict.quantities import MEASURED
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import Term
from bridgegen.simulation.embedded import simulator

ALL_AXES = ("static", "participants", "weather")


def made(axes=None, ego="route-follower", name="crossroads-s4") -> Pipeline:
    scenario = load(name)
    pipeline = Pipeline(scenario, scenario.space(axes), PipelineOptions(ego=ego))
    pipeline.choose_objective()
    return pipeline


def rows(pipeline: Pipeline, n: int, seed: int = 0) -> np.ndarray:
    return pipeline.space.decode(np.random.default_rng(seed).random((n, pipeline.space.n_var)))


@pytest.mark.parametrize("axes", [None, ALL_AXES])
@pytest.mark.parametrize("ego", ["route-follower", "reference"])
def test_a_row_s_result_is_the_same_in_any_batch_and_order(axes, ego, monkeypatch):
    pipeline = made(axes, ego)
    X = rows(pipeline, 24)
    whole = pipeline.evaluate(X)
    monkeypatch.setattr(simulator, "CHUNK", 5)
    order = np.random.default_rng(1).permutation(24)
    other = pipeline.evaluate(X[order])
    alone = pipeline.evaluate(X[7:8])
    for name in ("metrics", "F", "critical", "status"):
        assert np.array_equal(getattr(other, name), getattr(whole, name)[order], equal_nan=True)
        assert np.array_equal(getattr(alone, name), getattr(whole, name)[7:8], equal_nan=True)


def test_static_parameters_change_the_roads_and_nothing_else_does():
    pipeline = made(ALL_AXES)
    x = rows(pipeline, 1)
    wide = x.copy()
    wide[:, pipeline.space.index("intersection_size")] = 44.0
    small = pipeline.rollout(x)
    large = pipeline.rollout(wide)
    # Both start 40 m before their stop lines, which are further apart.
    apart = (44.0 - x[0, pipeline.space.index("intersection_size")]) / 2
    assert large.y[0, 0, 0] - small.y[0, 0, 0] == pytest.approx(apart)
    same = pipeline.rollout(x)
    assert np.array_equal(same.x, small.x)


def test_a_fixed_road_gives_what_the_searched_one_gives():
    searched, fixed = made(ALL_AXES), made()
    X = rows(fixed, 10)
    a, b = searched.evaluate(X), fixed.evaluate(X)
    assert np.array_equal(a.metrics, b.metrics, equal_nan=True)


def test_no_rows_no_results():
    pipeline = made()
    empty = pipeline.evaluate(np.empty((0, len(pipeline.space.names))))
    assert empty.metrics.shape == (0, len(pipeline.metrics))
    assert empty.critical.shape == (0,)


def test_on_a_slippery_road_the_ego_leaves_its_path_further():
    pipeline = made()
    x = np.repeat(rows(pipeline, 1), 2, axis=0)
    x[:, pipeline.space.index("ego_speed")] = 8.9
    x[1, pipeline.space.index("friction")] = 0.35
    offset = np.abs(pipeline.rollout(x).offset[:, 0]).max(axis=1)
    assert offset[1] > offset[0]


@pytest.mark.parametrize(("ego", "changes"), [("route-follower", False), ("reference", True)])
def test_fog_changes_the_results_of_a_driver_that_perceives_and_of_no_other(ego, changes):
    pipeline = made(ego=ego)
    clear = rows(pipeline, 8)
    clear[:, pipeline.space.index("fog_density")] = 0.0
    foggy = clear.copy()
    foggy[:, pipeline.space.index("fog_density")] = 90.0
    one, other = pipeline.evaluate(clear).metrics, pipeline.evaluate(foggy).metrics
    assert np.array_equal(one, other, equal_nan=True) is not changes


@pytest.mark.parametrize(
    "name", ["crossroads-s1", "crossroads-s2", "crossroads-s3", "crossroads-s4"]
)
def test_the_reference_driver_comes_through_the_nominal_scenario(name):
    pipeline = made(ego="reference", name=name)
    nominal = pipeline.space.row({})[None, :]
    metrics = dict(zip(pipeline.metrics, pipeline.evaluate(nominal).metrics[0], strict=True))
    assert metrics["n_collision"] == 0
    assert metrics["l_offset"] < 0.5


def test_an_unknown_driver_is_named():
    scenario = load("crossroads-s4")
    with refuses(UnknownNameError, "reference"):
        Pipeline(scenario, scenario.space(), PipelineOptions(ego="refrence"))


BLIND = tuple(name for name in metrics.TABLE_I if name not in ("iou", "e_position", "map"))


def with_objective(*terms):
    scenario = load("crossroads-s4")
    spec = replace(scenario.objective, terms=tuple(Term(name, 1.0) for name in terms))
    return replace(scenario, objective=spec)


def test_the_paper_s_metrics_are_recorded_as_far_as_the_driver_gives_rise_to_them():
    assert made().metrics == (*BLIND, *MEASURED)
    seeing = made(ego="reference")
    assert seeing.metrics == (*metrics.TABLE_I, *MEASURED)
    found = dict(zip(seeing.metrics, seeing.evaluate(rows(seeing, 4)).metrics.T, strict=True))
    # Weather may leave little to be seen, or nobody within range: then there is no share.
    for share in (found["iou"], found["map"]):
        assert (((share >= 0.0) & (share <= 1.0)) | (share == np.inf)).all()
        assert ((share > 0.0) & (share < 1.0)).any()
    assert ((found["e_position"] >= 0.0) & (found["e_position"] < 4.0)).all()
    assert (found["e_position"] > 0.0).any()


def test_a_metric_that_the_driver_gives_no_rise_to_is_refused():
    scenario = with_objective("map", "ttc", "iou")
    with pytest.raises(InputError) as caught:
        Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    first, second = caught.value.problems
    approve(first, "map", "route-follower", "--ego")
    assert "'iou'" in second


def test_some_rows_of_a_replay_are_those_of_a_replay_of_some_rows():
    pipeline = made(ALL_AXES, "reference")
    X, at = rows(pipeline, 6), np.array([4, 1])
    ((_, whole),), ((_, alone),) = pipeline.replays(X).parts, pipeline.replays(X[at]).parts
    some = whole.take(at)
    for one in fields(some.rollout):
        if one.init:
            np.testing.assert_equal(
                getattr(some.rollout, one.name), getattr(alone.rollout, one.name)
            )
    steps = len(alone.intentions.steps)  # those of the longest row
    for name in ("way", "station", "acceleration", "shift"):
        np.testing.assert_equal(
            getattr(some.intentions, name)[:, :steps], getattr(alone.intentions, name)
        )
    np.testing.assert_equal(some.ways, alone.ways)
    np.testing.assert_equal(some.weathers, alone.weathers)
