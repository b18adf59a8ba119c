"""One row together with another simulator: what is imposed, and what comes of it."""

from pathlib import Path

import numpy as np
import pytest

from bridgegen.drivers.driver_process import DriverError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

EGO = Path(__file__).parents[2] / "ego"
FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status", "detections", "lights", "began")


def made(scenario, ego):
    logical = load(scenario)
    return Pipeline(logical, logical.space(), PipelineOptions(ego=ego))


def begun(pipeline, seed=4):
    X = pipeline.space.decode(np.random.default_rng(seed).random((1, pipeline.space.n_var)))
    roads, rows = pipeline.runner.roads_of(X)
    values = pipeline.space.values(X[0])
    return X, pipeline.runner.embedded.co_simulation(roads, int(rows[0]), values)


def driven(joint, between=lambda joint, k: None):
    for k in range(joint.n_steps):
        if not joint.runs:
            break
        between(joint, k)
        joint.decide(k)
        joint.move(k, *joint.demand(k))
    return joint.rollout()


@pytest.mark.parametrize(
    ("scenario", "ego"),
    [
        ("crossroads-s1", "route-follower"),
        ("cut-in", "reference"),
        ("red-light-runner", "reference"),
        ("pedestrian-at-night", "careful"),
        ("crossroads-s3", f"{EGO / 'drivers.py'}:LooksAhead"),
        ("crossroads-s3", f"{EGO / 'compiled_drivers.py'}:looks_ahead"),
    ],
)
def test_alone_it_is_the_embedded_simulator_to_the_bit(scenario, ego):
    pipeline = made(scenario, ego)
    X, joint = begun(pipeline)
    alone, expected = driven(joint), pipeline.rollout(X)
    assert expected.status[0] == 0
    for name in FIELDS:
        np.testing.assert_array_equal(getattr(alone, name), getattr(expected, name), name)


@pytest.mark.thorough
@pytest.mark.parametrize(
    ("scenario", "ego"), [("cut-in", "reference"), ("crossroads-s4", "careful")]
)
def test_imposing_what_is_so_changes_nothing(scenario, ego):
    """What is worked out anew (stations, distances) differs by roundings."""
    pipeline = made(scenario, ego)
    X, joint = begun(pipeline)
    everybody = range(len(joint.names))
    imposed = driven(joint, lambda joint, k: joint.impose(k, everybody, joint.states(k)))
    expected = pipeline.rollout(X)
    assert imposed.n_steps[0] == expected.n_steps[0]
    for name in ("x", "y", "h", "v", "a", "offset"):
        np.testing.assert_allclose(
            getattr(imposed, name), getattr(expected, name), atol=1e-6, err_msg=name
        )
    np.testing.assert_array_equal(imposed.began, expected.began)


def test_a_driver_sees_those_who_are_imposed():
    """Somebody who is put in the ego's way is braked for."""
    pipeline = made("cut-in", "reference")
    X, joint = begun(pipeline)
    other = joint.names.index("bv")

    def stand_ahead(joint, k):
        ego = joint.states(0)[0]
        ahead = 60.0
        joint.impose(
            k,
            [other],
            [ego[0] + ahead * np.cos(ego[2]), ego[1] + ahead * np.sin(ego[2]), ego[2], 0.0],
        )

    rollout = driven(joint, stand_ahead)
    free = pipeline.rollout(X)
    assert rollout.v[0, 0].min() < 0.5 < free.v[0, 0].min()
    assert np.ptp(rollout.x[0, other, : rollout.n_steps[0]]) == 0.0
    assert (rollout.a[0, other, : rollout.n_steps[0] - 1] == 0.0).all()


def test_states_that_are_imposed_are_recorded_and_measured():
    """A circle at 5 m/s: heading continuous, speed and acceleration those of the motion."""
    pipeline = made("crossroads-s1", "route-follower")
    _, joint = begun(pipeline)
    dt, radius, speed = joint.time_step, 10.0, 5.0

    def state(k):
        turn = speed / radius * k * dt
        return [
            radius * np.sin(turn), radius * (1 - np.cos(turn)),
            (turn + np.pi) % (2 * np.pi) - np.pi, speed,
        ]  # fmt: skip

    def circle(joint, k):
        joint.impose(k, [1], [state(k)])

    rollout = driven(joint, circle)
    n = int(rollout.n_steps[0])
    expected = np.array([state(k) for k in range(n)])
    np.testing.assert_array_equal(rollout.x[0, 1, :n], expected[:, 0])
    np.testing.assert_array_equal(rollout.y[0, 1, :n], expected[:, 1])
    assert np.abs(np.diff(rollout.h[0, 1, :n])).max() < 0.1
    np.testing.assert_allclose(np.cos(rollout.h[0, 1, :n]), np.cos(expected[:, 2]), atol=1e-12)
    np.testing.assert_array_equal(rollout.a[0, 1, : n - 1], 0.0)


def test_the_stop_trigger_can_be_overruled():
    pipeline = made("crossroads-s1", "route-follower")
    X, joint = begun(pipeline)
    n = int(pipeline.rollout(X).n_steps[0])
    assert n < joint.n_steps
    for k in range(joint.n_steps):
        joint.decide(k)
        assert joint.stops == (k >= n - 1)
        joint.go_on()
        if k == n + 5:
            joint.end()
        joint.move(k, *joint.demand(k))
        if not joint.runs:
            break
    assert joint.rollout().n_steps[0] == n + 6


@pytest.mark.parametrize(
    ("file", "name", "kind"),
    [
        ("drivers.py", "FailsFast", "raised"),
        ("compiled_drivers.py", "raises_fast", "raised"),
    ],
)
def test_a_driver_that_fails_says_so(file, name, kind):
    pipeline = made("crossroads-s1", f"{EGO / file}:{name}")
    x = pipeline.space.row({"ego_speed": 8.5})
    roads, rows = pipeline.runner.roads_of(x[np.newaxis])
    values = pipeline.space.values(x)
    with pytest.raises(DriverError) as caught:
        driven(pipeline.runner.embedded.co_simulation(roads, int(rows[0]), values))
    assert caught.value.kind == kind
    assert "Error" in str(caught.value)
