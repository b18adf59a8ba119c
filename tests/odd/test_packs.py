"""The packs that ship: names, sources, plausible motion, and figures of the regulation."""

import re

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.base.errors import FileFormatError, UnknownNameError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.convert import scenario_of
from bridgegen.scenario.language.reader import load, names, pack_names
from bridgegen.scenario.language.starter import start_scenario

R157 = [name for name in pack_names() if name.startswith("r157/")]


def rollouts(name: str, ego: str, rows: int = 64):
    """Random rows of a scenario: the rollout of each storyboard and its rows."""
    scenario = load(name)
    space = scenario.space()
    X = space.decode(np.random.default_rng(2).random((rows, space.n_var)))
    pipeline = Pipeline(scenario, space, PipelineOptions(ego=ego))
    return space, [(X[at], one.run(X[at])) for at, one in pipeline.runner.by_variant(X)]


def test_the_pack_has_each_kind_of_test_of_the_regulation():
    assert {
        "r157/cut-in", "r157/cut-out", "r157/deceleration", "r157/following",
        "r157/crossing-pedestrian", "r157/stationary-vehicle", "r157/lane-keeping-side-vehicle",
    } <= set(R157)  # fmt: skip
    assert not set(names()) & set(R157)


@pytest.mark.parametrize("name", R157)
def test_a_scenario_names_its_clause_and_runs_are_named_after_it(name):
    scenario = load(name)
    assert scenario.name == name.replace("/", "-")
    assert re.search(r"UN Regulation No\. 157.*(Annex 5|5\.2\.5)", scenario.source)


@pytest.mark.thorough
@pytest.mark.parametrize("name", R157)
def test_the_traffic_of_random_rows_could_happen(name):
    _, parts = rollouts(name, "route-follower")
    for _, rollout in parts:
        assert (rollout.status == 0).all()
        assert set(plausibility(rollout).labels) == {""}


def test_the_cut_in_has_the_regulations_distance_and_lateral_speed():
    space, ((X, rollout),) = rollouts("r157/cut-in", "route-follower")
    k = round(1.0 / rollout.time_step)  # the instant at which it begins
    bumpers = rollout.x[:, 1, k] - rollout.x[:, 0, k] - 4.3
    np.testing.assert_allclose(bumpers, X[:, space.index("gap")], atol=1e-6)
    np.testing.assert_allclose(
        rollout.v[:, 0, k] - rollout.v[:, 1, k], X[:, space.index("relative_speed")], atol=1e-9
    )
    beside = np.abs(rollout.y[:, 1] - rollout.y[:, 0])
    np.testing.assert_allclose(beside[:, 0], 3.5, atol=1e-9)  # 1.6 m between bodies 1.9 m wide
    lateral = X[:, space.index("lateral_speed")]
    half = np.array([np.interp(1.75, -row, np.arange(len(row))) for row in -beside[:, ::-1]])
    seconds = (beside.shape[1] - 1 - half) * rollout.time_step - 1.0
    free = X[:, space.index("other_speed")] > 3.0 * lateral  # slower, the steering sets the time
    assert free.sum() > 32
    np.testing.assert_allclose(seconds[free], 1.75 / lateral[free], rtol=0.02, atol=0.05)


def test_the_cut_out_reveals_at_the_regulations_distance():
    space, parts = rollouts("r157/cut-out", "route-follower")
    assert len(parts) == 2  # a car, a motorcycle
    for X, rollout in parts:
        k = round(1.0 / rollout.time_step)
        front, rear = (
            rollout.x[:, e, k] + rollout.box[e, 2] + sign * 0.5 * rollout.box[e, 0]
            for e, sign in ((1, 1.0), (2, -1.0))
        )
        np.testing.assert_allclose(rear - front, X[:, space.index("gap")], atol=0.01)
        headway = (rollout.x[:, 1, 0] - rollout.x[:, 0, 0] - 4.3) / rollout.v[:, 0, 0]
        np.testing.assert_allclose(headway, X[:, space.index("headway")], atol=1e-9)


def test_the_pedestrian_meets_the_middle_of_a_front_that_keeps_its_speed():
    space, ((X, rollout),) = rollouts("r157/crossing-pedestrian", "route-follower")
    front = rollout.x[:, 0] + 3.7
    for row, x in enumerate(X):
        k = int(np.argmax(front[row] >= 400.0))
        y = rollout.y[row, 1, k] - rollout.y[row, 0, k]
        assert y == pytest.approx(-x[space.index("impact_offset")], abs=0.1)  # a step is 0.07 m
        assert rollout.v[row, 1, k] <= 5.0 / 3.6 + 1e-9


def test_an_unknown_name_of_a_pack_is_a_name_and_another_folder_a_path():
    with refuses(UnknownNameError, "r157/cut-in"):
        load("r157/cut-inn")
    with refuses(FileFormatError):
        load("elsewhere/cut-in")


def test_a_scenario_of_a_pack_can_be_copied(tmp_path):
    path = start_scenario("mine", like="r157/cut-in", folder=tmp_path)
    mine = load(path)
    assert mine.name == "mine"
    assert mine.parameters.keys() == load("r157/cut-in").parameters.keys()


def test_individuals_of_a_pack_s_scenario_find_it_again():
    scenario = load("r157/deceleration")
    pipeline = Pipeline(scenario, scenario.space())
    individuals = pipeline.runner.concrete(scenario.space().row({})).individuals
    found = scenario_of(individuals)
    assert found is not None
    assert found.place == "r157/deceleration.yaml"
