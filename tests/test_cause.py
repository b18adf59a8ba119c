"""The order of the replays, and what comes of each."""

from dataclasses import replace
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.assess.cause import CAUSES, Cause, causes, counterfactuals, require
from bridgegen.assess.objective import Objective
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.drivers import DRIVERS, STORYBOARD
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.adversary import with_others
from bridgegen.scenario.language.objectives import PAPERS
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.thresholds import Thresholds
from bridgegen.simulation.embedded import simulator

WHOLE = replace(DRIVERS["reference"], stages=frozenset({"perception", "prediction", "control"}))


def replays(driver, vehicle="kinematic"):
    return [
        (one.cause.label, one.driver.name, *sorted(one.driver.ideal), "dry" if one.dry else "")
        for one in counterfactuals(driver, vehicle)
    ]


def test_the_replays_of_a_driver_with_all_stages():
    assert replays(WHOLE) == [
        ("perception", "reference", "perception", ""),
        ("planning", "careful", ""),
        ("planning", "careful-fsm", ""),
        ("control", "reference", "control", ""),
        ("control", "reference", "dry"),
    ]


def test_a_vehicle_with_dynamics_is_made_kinematic_after_perception_and_before_planning():
    still = counterfactuals(WHOLE, "single-track")
    assert [one.cause.label for one in still] == [
        "perception", "vehicle dynamics", "planning", "planning", "control", "control",
    ]  # fmt: skip
    assert [one.kinematic for one in still] == [False, True, False, False, False, False]
    assert still[1].driver == WHOLE
    assert replays(WHOLE, "kinematic") == replays(WHOLE)


def test_what_is_ideal_already_is_not_put_right_but_stays_ideal():
    assert replays(WHOLE.idealised(["perception"])) == [
        ("planning", "careful", ""),
        ("planning", "careful-fsm", ""),
        ("control", "reference", "control", "perception", ""),
        ("control", "reference", "perception", "dry"),
    ]


def test_a_driver_without_stages_skips_them_and_is_no_judge_of_itself():
    assert [one[:2] for one in replays(DRIVERS["careful-fsm"])] == [
        ("planning", "careful"),
        ("control", "careful-fsm"),
    ]
    assert replays(STORYBOARD) == []


@given(st.lists(st.lists(st.booleans(), min_size=5, max_size=5), min_size=0, max_size=20))
def test_the_first_replay_that_helps_tells_and_only_the_unexplained_are_replayed(helps):
    table = np.array(helps, dtype=bool).reshape(-1, 5)
    critical = np.arange(len(table)) % 3 > 0
    order, asked = counterfactuals(WHOLE), []

    def harmless(at, replay):
        asked.append(at.tolist())
        return table[at, order.index(replay)]

    found = causes(order, critical, harmless)
    for row, (hit, one) in enumerate(zip(critical, table, strict=True)):
        expected = Cause.NONE
        if hit:
            expected = order[int(np.argmax(one))].cause if one.any() else Cause.UNAVOIDABLE
        assert found[row] == expected
    for before, after in pairwise(asked):
        assert set(after) <= set(before)
    assert all(asked)  # never for nothing


def test_nobody_is_to_blame_where_nobody_drives():
    found = causes(
        counterfactuals(STORYBOARD), np.array([True]), lambda at, replay: np.array([True])
    )
    assert found.tolist() == [Cause.NONE]


def test_labels_are_the_only_names():
    assert [Cause.named(one.label) for one in CAUSES] == list(CAUSES)
    for wrong in ("", "none", "Perception", "luck"):
        with pytest.raises(UnknownNameError, match="cause"):
            Cause.named(wrong)


def test_a_cause_that_cannot_be_is_refused():
    with refuses(InputError):
        require(Cause.PERCEPTION, DRIVERS["route-follower"])
    with refuses(InputError):
        require(Cause.UNAVOIDABLE, STORYBOARD)
    with refuses(InputError):
        require(Cause.VEHICLE_DYNAMICS, WHOLE)
    for one in CAUSES:
        require(one, WHOLE, "single-track")


@pytest.mark.parametrize(
    ("name", "ego"), [("crossroads-s3", "route-follower"), ("crossroads-s2", "reference")]
)
def test_a_row_s_cause_is_the_same_in_any_batch_and_order(name, ego, monkeypatch):
    scenario = replace(load(name), objective=PAPERS)  # many critical rows, of all causes
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego, causes=True))
    pipeline.choose_objective()
    n = 60
    X = pipeline.space.decode(np.random.default_rng(5).random((n, pipeline.space.n_var)))
    whole = pipeline.evaluate(X)
    assert len(set(whole.cause.tolist())) > (2 if ego == "route-follower" else 1)
    assert ((whole.cause != Cause.NONE) == whole.critical).all()
    monkeypatch.setattr(simulator, "CHUNK", 7)
    order = np.random.default_rng(1).permutation(n)
    assert (pipeline.evaluate(X[order]).cause == whole.cause[order]).all()
    hit = int(np.flatnonzero(whole.critical)[0])
    assert pipeline.evaluate(X[hit : hit + 1]).cause == whole.cause[hit]


def test_only_the_cause_that_is_asked_for_counts_and_F_is_as_ever():
    scenario = replace(load("crossroads-s3"), objective=PAPERS)
    X = scenario.space().decode(np.random.default_rng(5).random((40, scenario.space().n_var)))
    every, only = (
        Pipeline(scenario, scenario.space(), PipelineOptions(causes=True, cause=cause))
        for cause in (None, "planning")
    )
    for pipeline in (every, only):
        pipeline.choose_objective()
    all_of_them, some = every.evaluate(X), only.evaluate(X)
    assert (some.cause == all_of_them.cause).all()
    assert (some.F == all_of_them.F).all()
    assert (some.critical == (all_of_them.cause == Cause.PLANNING)).all()
    assert 0 < some.critical.sum() < all_of_them.critical.sum()


BY_THRESHOLDS = Objective.build([("d_min", 1.0)], thresholds=Thresholds(d_min_below=1.0))
"""Critical, whoever is responsible: many harms of every cause."""

CLEAR = {
    "fog_density": 0.0,
    "precipitation": 0.0,
    "cloudiness": 0.0,
    "wind_intensity": 0.0,
    "sun_altitude_angle": 20.0,
}


def test_what_the_reference_does_not_see_in_thick_fog_is_perception_s_fault():
    scenario = with_others(load("left-across-path"), "scripted")
    space, moving = scenario.space(), scenario.space(axes=("participants",))
    pipeline = Pipeline(scenario, space, PipelineOptions(ego="reference", causes=True))
    seeing = Pipeline(scenario, space, PipelineOptions(ego="reference", ideal=("perception",)))
    for one in (pipeline, seeing):
        one.choose_objective(BY_THRESHOLDS)
    # The same participants in both weathers, none faster than the fog allows.
    same = [
        {name: min(value, 7.0) if name.endswith("speed") else value for name, value in row.items()}
        for row in (
            {name: value for name, value in moving.values(x).items() if name in moving.variables}
            for x in moving.decode(np.random.default_rng(2).random((400, moving.n_var)))
        )
    ]
    clear = np.array([space.row({**row, **CLEAR}) for row in same])
    fog = np.array([space.row({**row, **CLEAR, "fog_density": 95.0}) for row in same])
    in_clear, in_fog = pipeline.evaluate(clear).cause, pipeline.evaluate(fog).cause
    by_perception = in_fog == Cause.PERCEPTION
    assert by_perception.sum() >= 8
    assert by_perception.sum() > 0.8 * (in_fog != Cause.NONE).sum()
    assert (in_clear != Cause.NONE).sum() <= 2
    assert not seeing.evaluate(fog[by_perception]).critical.any()


def test_the_reference_s_harm_has_every_cause():
    found = set()
    for name in ("jam-tail-in-fog", "paper/crossroads-s3"):
        scenario = load(name)
        pipeline = Pipeline(
            scenario, scenario.space(), PipelineOptions(ego="reference", causes=True)
        )
        pipeline.choose_objective(BY_THRESHOLDS)
        rows = np.random.default_rng(11).random((120, pipeline.space.n_var))
        rows[::2, list(pipeline.space.variables).index("precipitation")] = 0.999  # most are dry
        found |= set(pipeline.evaluate(pipeline.space.decode(rows)).cause.tolist())
    assert found == set(Cause) - {Cause.VEHICLE_DYNAMICS}
