import math
import shlex

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.coverage import coverage_of
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.scenario.language.adversary import MARGIN, adversarial
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.adversary import OBSERVED
from bridgegen.simulation.embedded.motion._steering_kernels import steer

DT = 0.05


@pytest.fixture(scope="module")
def pipeline():
    scenario = adversarial(load("crossroads-s4"))
    made = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    made.choose_objective()
    return made


def rows(pipeline, n, seed=0):
    return np.random.default_rng(seed).random((n, pipeline.space.n_var))


def driven(speed, place, rate=3.0, braking=8.0, bend=0.0, v=0.0, steps=100):
    """Return the course of a vehicle on an arc of curvature ``bend``, and its state at the end."""
    s = np.linspace(0.0, 200.0, 1001)
    h = bend * s
    x, y = (np.sin(h) / bend, (1.0 - np.cos(h)) / bend) if bend else (s, np.zeros_like(s))
    path = np.stack([x, y, h, np.cos(h), np.sin(h), np.full_like(s, bend)], axis=1)
    state, course = np.array([0.0, 0.0, v, 0.0, 0.0]), np.zeros((steps + 1, 4))
    steer(path, len(path), 0.2, state, speed, place, rate, braking, DT, 0, steps, course)
    return course, state


def test_it_drives_off_as_hand_worked():
    course, state = driven(6.0, 0.0, steps=20)
    assert state[2] == pytest.approx(3.0)  # 3 m/s² for one second
    assert course[-1, 1] == pytest.approx(1.5)
    assert course[-1, 2] == course[-1, 3] == 0.0


def test_it_stops_and_stays():
    course, state = driven(0.0, 0.0, v=8.0, steps=60)
    assert state[2] == 0.0
    assert course[-1, 1] == pytest.approx(8.0**2 / (2 * 8.0), abs=0.01)
    assert (course[25:, 1] == course[-1, 1]).all()


@given(
    speed=st.floats(0.0, 15.0),
    v=st.floats(0.0, 15.0),
    place=st.floats(-0.8, 0.8),
    bend=st.sampled_from([0.0, 0.08, -0.05]),
    rate=st.floats(0.5, 5.0),
    braking=st.floats(1.0, 9.0),
)
@settings(deadline=None, max_examples=60)
def test_its_motion_keeps_to_its_limits(speed, v, place, bend, rate, braking):
    course, state = driven(speed, place, rate, braking, bend, v)
    x, y, h = course[1:, 1:].T
    # Speed over ground, from one point to the next.
    moved = np.hypot(np.diff(x), np.diff(y)) / DT
    assert (moved <= max(speed, v) * 1.002 + 1e-9).all()
    change = np.diff(moved) / DT
    assert (change <= rate + 0.05 * max(speed, v) + 1e-6).all()
    assert (change >= -braking - 0.05 * max(speed, v) - 1e-6).all()
    aside = state[1]
    # Its nose takes a while to turn back: the margin that it keeps to the edges is for that.
    assert min(0.0, place) - MARGIN <= aside <= max(0.0, place) + MARGIN
    # It goes where its nose points: no slipping sideways.
    going = np.hypot(np.diff(x), np.diff(y)) > 0.01
    course_h = np.unwrap(np.arctan2(np.diff(y), np.diff(x)))
    middle = 0.5 * (h[1:] + h[:-1])
    off = np.abs((course_h - middle + math.pi) % (2 * math.pi) - math.pi)
    assert (off[going] < 0.02).all()


def test_a_row_s_result_depends_on_that_row_alone(pipeline):
    X = pipeline.space.decode(rows(pipeline, 9))
    whole, one = pipeline.evaluate(X), pipeline.evaluate(X[4:5])
    assert (whole.status == 0).all()
    assert one.metrics.tobytes() == whole.metrics[4:5].tobytes()


def test_its_decisions_matter(pipeline):
    U = rows(pipeline, 4)
    who = pipeline.scenario.adversary
    paces = [pipeline.space.variables.index(name) for name in who.paces]
    U[:, paces] = 0.0
    waits = pipeline.rollout(pipeline.space.decode(U))
    U[:, paces] = 1.0
    goes = pipeline.rollout(pipeline.space.decode(U))
    assert (waits.v[:, 1] == 0.0).all()
    speed = pipeline.space.decode(U)[:, pipeline.space.index("bv_speed")]
    np.testing.assert_allclose(goes.v[:, 1, 60], speed, rtol=2e-4)  # chords of its way


def test_what_is_handed_over_replays_to_the_same_bits(pipeline, tmp_path):
    X = pipeline.space.decode(rows(pipeline, 3, seed=5))
    whole = pipeline.evaluate(X)
    files = write_scenario(pipeline, X[1], tmp_path, "found", None)
    (path,) = (file for file in files if file.suffix == ".xosc")
    assert "FollowTrajectoryAction" in path.read_text("utf-8")
    again = simulate_file(path, metrics=pipeline.metrics)
    assert again.driver == "route-follower"
    found = np.array([again.metrics[name] for name in pipeline.metrics])
    assert found.tobytes() == whole.metrics[1].tobytes()


def test_in_closed_loop_it_meets_the_ego_that_the_row_meets(pipeline):
    """What it saw while it decided is what happens when its row is evaluated."""
    seen, arena = [], pipeline.arena()

    def chase(observation, running):
        seen.append(np.where(running[:, None], observation, np.nan))
        hurry = (
            observation[:, OBSERVED.index("time to the conflict")]
            > observation[:, OBSERVED.index("ego's time to it")]
        )
        place = 0.5 + 0.5 * np.sin(observation[:, OBSERVED.index("time")] * 9.0)
        return np.column_stack([np.where(hurry, 1.0, 0.2), place])

    U = arena.play(rows(pipeline, 5), chase)
    rollout = pipeline.rollout(pipeline.space.decode(U))
    for number in range(arena.n_decisions):
        k = number * 10
        runs = rollout.n_steps > k
        gap = np.hypot(
            rollout.x[:, 0, k] - rollout.x[:, 1, k], rollout.y[:, 0, k] - rollout.y[:, 1, k]
        )
        told = seen[number] if number < len(seen) else np.full((5, len(OBSERVED)), np.nan)
        far = told[:, OBSERVED.index("distance from the ego")]
        np.testing.assert_allclose(far[runs], np.minimum(gap / 30.0, 3.0)[runs], atol=1e-6)
        np.testing.assert_allclose(
            told[runs, OBSERVED.index("speed")], rollout.v[runs, 1, k] / 10.0, atol=1e-6
        )


def test_a_campaign_searches_its_decisions_and_goes_on(tmp_path):
    given = {"budget": 30, "algorithm": "random", "ego": "route-follower", "keep": 1}
    run = bg.run_search(
        "crossroads-s1", adversary="bv", triage="short", out=tmp_path / "run", **given
    )
    table = run.frame()
    assert {"bv_pace_01", "bv_offset_40"} <= {*table.columns}
    assert "--adversary bv" in shlex.join(shlex.split(run.settings.command(tmp_path / "b")))
    assert bg.resume(run.folder).frame().equals(table)
    # A course is no combination of forty speeds: the report leaves the decisions out.
    assert "bv_pace_01" not in run.report.read_text("utf-8").replace("--adversary", "")
    _, covered, _ = coverage_of(run.folder, strength=2)
    assert {one.name for one in covered.parameters} == {
        *load("crossroads-s1").space().variables
    } - {
        "bv_trigger_time",
        "bv_trigger_distance",
    }


def test_who_cannot_be_asked_instant_by_instant_is_named(tmp_path):
    own = tmp_path / "own.py"
    own.write_text(
        "class Driver:\n"
        "    def reset(self, n, scene): self.n = n\n"
        "    def act(self, observation): return [0.0] * self.n, [0.0] * self.n\n",
        "utf-8",
    )
    scenario = adversarial(load("crossroads-s4"))
    made = Pipeline(scenario, scenario.space(), PipelineOptions(ego=f"{own}:Driver"))
    with refuses(InputError):
        made.arena()


def test_decisions_that_are_not_searched_are_named():
    scenario = adversarial(load("crossroads-s4"))
    made = Pipeline(
        scenario, scenario.space(["participants"]), PipelineOptions(ego="route-follower")
    )
    with refuses(InputError):
        made.arena()
    plain = load("crossroads-s4")
    with refuses(InputError):
        Pipeline(plain, plain.space()).arena()
