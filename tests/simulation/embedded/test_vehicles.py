"""The ego's vehicle: in whole scenarios, in files, and where there is none."""

import math
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

import bridgegen as bg
from bridgegen.assess.cause import Cause
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.engine.stated import with_vehicle
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.openx.openscenario.read import read
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.choice import SimulatorChoice
from bridgegen.simulation.embedded import simulator as embedded
from bridgegen.simulation.embedded.drivers._chassis_kernels import lagged
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

FIELDS = ("x", "y", "h", "v", "a", "offset", "n_steps", "status")
N = 12
DYNAMIC = ("single-track", "multi-body")


def made(scenario="stopped-after-curve", ego="route-follower", vehicle="single-track", **options):
    logical = load(scenario)
    given = PipelineOptions(ego=ego, vehicle=vehicle, **options)
    pipeline = Pipeline(logical, logical.space(), given)
    pipeline.choose_objective()
    return pipeline


def rows(pipeline, n=N):
    return pipeline.space.decode(np.random.default_rng(5).random((n, pipeline.space.n_var)))


def same(one, other, at=slice(None)):
    return all(np.array_equal(getattr(one, n), getattr(other, n)[at]) for n in FIELDS)


@pytest.mark.parametrize("vehicle", DYNAMIC)
def test_a_row_s_result_is_the_same_in_any_batch(vehicle, monkeypatch):
    pipeline = made(vehicle=vehicle)
    X = rows(pipeline)
    whole = pipeline.rollout(X)
    assert (whole.status == 0).all()
    assert same(pipeline.rollout(X[7:8]), whole, slice(7, 8))
    monkeypatch.setattr(embedded, "CHUNK", 5)
    order = np.random.default_rng(1).permutation(N)
    assert same(pipeline.rollout(X[order]), whole, order)


def test_the_default_is_kinematic_to_the_bit_and_others_are_not():
    pipeline = made(vehicle=None)
    X = rows(pipeline)
    default = pipeline.rollout(X)
    assert pipeline.runner.vehicle == "kinematic"
    assert same(made(vehicle="kinematic").rollout(X), default)
    single, multi = (made(vehicle=vehicle).rollout(X) for vehicle in DYNAMIC)
    assert not same(single, default)
    assert not same(multi, default)
    assert not same(multi, single)


@pytest.mark.parametrize("vehicle", DYNAMIC)
def test_in_a_fast_bend_it_goes_wide_and_stays_below_friction(vehicle):
    pipeline = made(vehicle=vehicle)
    X = rows(pipeline, 60)
    X[::2, pipeline.space.index("friction")] = 0.4  # most rows are dry
    wide = np.abs(pipeline.rollout(X).offset[:, 0]).max(axis=1)
    tight = np.abs(made(vehicle="kinematic").rollout(X).offset[:, 0]).max(axis=1)
    assert (wide >= tight).mean() > 0.9
    asked = (
        X[:, pipeline.space.index("ego_speed")] ** 2 * X[:, pipeline.space.index("bend_curvature")]
    )
    share = asked / pipeline.rollout(X).friction
    assert wide[share > 0.9].min() > wide[share < 0.3].max()


@pytest.mark.parametrize("vehicle", DYNAMIC)
def test_a_car_steers_fast_enough_for_its_driver_through_a_roundabout(vehicle):
    """From left to right within 0.5 s; at 0.4 rad/s it swings 4.1 m wide on the exit, on and on."""
    pipeline = made("roundabout-entry", "reference", vehicle)
    rollout = pipeline.rollout(rows(pipeline, 64 if vehicle == "single-track" else 16))
    assert (rollout.status == 0).all()
    assert np.abs(rollout.offset[:, 0]).max() < 0.5


@pytest.mark.parametrize("vehicle", DYNAMIC)
def test_a_replay_with_a_kinematic_vehicle_is_the_kinematic_rollout(vehicle):
    pipeline = made(vehicle=vehicle, causes=True)
    (fix,) = (one for one in pipeline.runner.fixes if one.cause is Cause.VEHICLE_DYNAMICS)
    X = rows(pipeline)
    assert same(pipeline.runner.run(X, fix=fix), made(vehicle="kinematic").rollout(X))


@pytest.mark.parametrize("vehicle", DYNAMIC)
def test_the_cause_is_vehicle_dynamics_where_the_kinematic_vehicle_copes(vehicle):
    dynamic, kinematic = (
        made("jam-tail-in-fog", "careful-fsm", one, causes=True) for one in (vehicle, None)
    )
    X = rows(dynamic, 100)
    found, other = dynamic.evaluate(X), kinematic.evaluate(X)
    late = found.critical & ~other.critical
    assert late.any()  # its brakes build up late
    assert (found.cause[late] == Cause.VEHICLE_DYNAMICS).all()
    assert not (found.cause[~late] == Cause.VEHICLE_DYNAMICS).any()


@pytest.mark.parametrize("vehicle", DYNAMIC)
def test_an_exported_file_states_it_and_does_the_same(vehicle, tmp_path):
    pipeline = made(vehicle=vehicle)
    x = rows(pipeline)[3]
    *_, path = write_scenario(pipeline, x, tmp_path, "one")
    here = pipeline.rollout(x[np.newaxis])
    assert same(simulate_file(path).rollout, here)
    assert same(simulate_file(path, vehicle=vehicle).rollout, here)
    kinematic = made(vehicle="kinematic")
    assert same(simulate_file(path, vehicle="kinematic").rollout, kinematic.rollout(x[np.newaxis]))
    text = path.read_text()
    assert f'"vehicle" value="{vehicle}"' in text
    path.write_text(text.replace(f'"vehicle" value="{vehicle}"', '"vehicle" value="tank"'))
    with refuses(InputError, "one.xosc", "tank"):
        simulate_file(path)
    assert vehicle not in str(with_vehicle(read(text.encode(), "one.xosc"), "kinematic"))


@pytest.mark.thorough
def test_a_run_records_it_and_resumes_with_it(tmp_path):
    given = {"ego": "route-follower", "budget": 20, "algorithm": "random", "keep": 1}
    run = bg.run_search(
        "stopped-after-curve",
        vehicle="single-track",
        triage="short",
        out=tmp_path / "whole",
        **given,
    )
    assert run.settings.vehicle == "single-track"
    assert bg.resume(tmp_path / "whole").settings.vehicle == "single-track"
    other = bg.run_search("stopped-after-curve", triage="short", out=tmp_path / "other", **given)
    assert other.settings.vehicle == "kinematic"
    assert other.summary.v_d_median != run.summary.v_d_median


def test_where_it_cannot_be():
    with refuses(UnknownNameError, "tank", "multi-body"):
        made(vehicle="tank")
    file = made().runner.concrete(rows(made())[0]).storyboard
    simulator = SimulatorChoice("esmini")
    with refuses(InputError, "single-track"):
        simulator.around(EmbeddedSimulator(file, "here", vehicle="single-track"), file)


def changed(tmp_path, old, new):
    """Return a file of the catalogue's lead-brakes that says something else."""
    path = tmp_path / "changed.yaml"
    text = files("bridgegen.scenario.catalogue").joinpath("lead-brakes.yaml").read_text("utf-8")
    assert old in text
    path.write_text(text.replace(old, new, 1), "utf-8")
    return path


def test_a_multi_body_is_a_car_s(tmp_path):
    lorry = changed(tmp_path, "type: car", "type: truck")
    with refuses(InputError, "multi-body"):
        made(lorry, vehicle="multi-body")
    single = made(lorry)
    assert (single.rollout(rows(single)).status == 0).all()


@pytest.mark.parametrize("grade", ["-12 %", "12 %"])
def test_on_a_steep_hill_it_stops_and_stays_where_it_stopped(grade, tmp_path):
    """Behind a car that stands, with a driver that keeps its distance."""
    hill = changed(tmp_path, "road_type: rural", f"road_type: rural, grade: {grade}")
    pipeline = made(hill, "reference", "multi-body")
    X = rows(pipeline)
    X[:, pipeline.space.index("low_speed")] = 0.0
    rollout = pipeline.rollout(X)
    last = rollout.n_steps - 1
    stood = 0
    for row, end in enumerate(last):
        still = rollout.v[row, 0, : end + 1] == 0.0
        if still[end]:
            begin = end - np.argmin(still[end::-1])
            stood += end - begin > 20
            x, y = rollout.x[row, 0, begin + 1 : end + 1], rollout.y[row, 0, begin + 1 : end + 1]
            assert np.ptp(x) == np.ptp(y) == 0.0
    assert stood >= N // 4


@given(st.floats(-3.0, 3.0), st.floats(-3.0, 3.0), st.floats(0.1, 5.0), st.floats(0.01, 2.0))
def test_an_actuator_is_a_first_order_lag_with_a_bounded_rate(value, target, rate, seconds):
    lag, n = 0.1, 20_000
    expected = value
    for _ in range(n):
        wanted = (target - expected) / lag
        expected += min(max(wanted, -rate), rate) * seconds / n
    found = lagged(value, target, math.exp(-seconds / lag), lag, rate)
    assert found == pytest.approx(expected, abs=2e-3 * max(1.0, abs(target - value)))
