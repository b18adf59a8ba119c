"""Where the ego meant to go, asked afterwards, is where it was going."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest

from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.pages.playbacks import _plans
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.batch import Batch
from bridgegen.simulation.embedded.intentions import EVERY

DRIVERS = Path(__file__).parents[2] / "ego" / "drivers.py"
N = 6


def replayed(name: str, ego: str, ideal=()):
    logical = load(name)
    space = logical.space()
    pipeline = Pipeline(logical, space, PipelineOptions(ego=ego, ideal=ideal))
    X = space.decode(np.random.default_rng(4).random((N, space.n_var)))
    ((_, replay),) = pipeline.replays(X).parts
    return pipeline, X, replay


def real(replay, row):
    """The instants asked about at which a row was still running, and their numbers."""
    steps = replay.intentions.steps
    at = np.flatnonzero(steps < replay.rollout.n_steps[row] - 1)
    return at, steps[at]


def test_what_is_asked_up_to_an_instant_is_the_rollout_up_to_there():
    pipeline, X, replay = replayed("cut-in", "reference")
    made = pipeline.runner.simulator
    roads = made.roads([pipeline.runner.concrete(X[0]).roads])
    columns = {name: X[:, i] for i, name in enumerate(pipeline.space.names)}
    for k in (0, 37, 200):
        batch = Batch(replace(made.program, n_steps=k + 1), roads, np.zeros(N, np.int64), columns)
        part = batch.run()
        for field in ("x", "y", "h", "v", "detections"):
            whole = getattr(replay.rollout, field)[:, :, : k + 1]
            assert np.array_equal(getattr(part, field), whole), (field, k)


@pytest.mark.parametrize("name", ["crossroads-s2", "cut-in"])
def test_with_ideal_control_it_does_what_it_planned(name):
    """Only tyres, its own limits and standing come between."""
    pipeline, _, replay = replayed(name, "reference", ("control",))
    most_speed_up, most_braking = pipeline.runner.simulator.program.bodies[0, 4:6]
    compared = changed = 0
    for row in range(N):
        at, k = real(replay, row)
        planned = replay.intentions.acceleration[row, at]
        done, v = replay.rollout.a[row, 0, k], replay.rollout.v[row, 0, k]
        free = (planned < most_speed_up) & (planned > -most_braking) & (v > 1.0)
        free &= np.abs(planned) < 4.0  # wet tyres give that much
        assert done[free] == pytest.approx(planned[free], abs=1e-9)
        compared += int(free.sum())
        changed += int((np.abs(planned[free]) > 0.2).sum())
    assert compared > 100
    assert changed > 5


@pytest.mark.parametrize(
    ("name", "ego"),
    [("crossroads-s2", "reference"), ("crossroads-s4", "route-follower"), ("cut-in", "careful")],
)
def test_it_is_beside_its_way_by_its_offset(name, ego):
    _, _, replay = replayed(name, ego)
    rollout, meant = replay.rollout, replay.intentions
    assert np.diff(meant.steps).tolist() == [round(EVERY / rollout.time_step)] * (
        len(meant.steps) - 1
    )
    for row in range(N):
        at, k = real(replay, row)
        on = meant.way[row, at] == 0
        assert on.mean() > 0.9  # until the route ends
        way = replay.ways[row][0]
        along = np.concatenate([[0.0], np.cumsum(np.hypot(*np.diff(way, axis=0).T))])
        spot = [np.interp(meant.station[row, at[on]], along, way[:, i]) for i in (0, 1)]
        gap = np.hypot(rollout.x[row, 0, k[on]] - spot[0], rollout.y[row, 0, k[on]] - spot[1])
        assert gap == pytest.approx(np.abs(rollout.offset[row, 0, k[on]]), abs=0.3)
        assert (np.diff(meant.station[row, at[on]]) > -0.3).all()
        assert np.isnan(meant.acceleration[row]).all() == (ego != "reference")


def test_the_trajectories_of_a_user_s_driver_are_those_that_it_made():
    """Each begins where the ego is at that instant, and leads where the ego then is."""
    _, _, replay = replayed("crossroads-s1", f"{DRIVERS}:Plans")
    rollout, made = replay.rollout, replay.intentions.plans
    assert len(made) == N
    for row, plans in enumerate(made):
        assert sorted(plans) == list(range(0, max(plans) + 1, 4))  # every 0.2 s
        assert rollout.n_steps[row] - 5 <= max(plans) < rollout.n_steps[row]
        for k, states in plans.items():
            here = [getattr(rollout, name)[row, 0, k] for name in "xyhv"]
            assert states[1, 1:5].tolist() == here
            if k + 4 < rollout.n_steps[row]:
                there = [getattr(rollout, name)[row, 0, k + 4] for name in "xy"]
                assert states[3, 1:3] == pytest.approx(there, abs=0.05)
    some = replay.take(np.array([4, 1])).intentions.plans
    assert [one is made[row] for one, row in zip(some, (4, 1), strict=True)] == [True, True]
    shown = _plans(replay, 2)
    assert [one.step for one in shown] == sorted(made[2])
    assert shown[0].points[[0, -1]].tolist() == made[2][0][[1, -1], 1:3].tolist()


@pytest.mark.parametrize("name", ["Cruises", "PlansAtOnce"])
def test_few_of_many_trajectories_are_shown_and_none_of_a_driver_that_plans_none(name):
    _, _, replay = replayed("crossroads-s1", f"{DRIVERS}:{name}")
    steps = [one.step for one in _plans(replay, 0)]
    assert bool(steps) == (name == "PlansAtOnce")
    assert set(np.diff(steps)) <= {4}


def test_who_has_no_driver_means_nothing():
    from .storyboards import crossroads, lane, scenario, simulator, start

    made = simulator(scenario(("ego",), start("ego", lane(1, 1, 90.0), 5.0)), None)
    roads, rows = made.roads([crossroads()]), np.zeros(1, dtype=np.int64)
    meant = made.intentions(roads, rows, {}, made.run(roads, rows, {}))
    assert (meant.way == -1).all()
