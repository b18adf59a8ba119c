"""Recordings for Rerun: what Rerun's own reader finds in them."""

import json

import numpy as np
import pytest

from bridgegen.assess.conflict.summary import summarise
from bridgegen.assess.criteria.signals import read
from bridgegen.drivers import kinds
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.export import export_beside
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.pages.rerun import BEFORE, TIME, TO_CONFLICT
from bridgegen.scenario.language.reader import load

pytestmark = pytest.mark.rerun
reader = pytest.importorskip("rerun.chunk")


@pytest.fixture(scope="module")
def written(tmp_path_factory):
    """A file, the chunks in it by entity, and the simulation that it is of."""
    scenario, folder = load("crosses-on-red"), tmp_path_factory.mktemp("rerun")
    pipeline = Pipeline(scenario, scenario.space())
    xosc = write_scenario(pipeline, pipeline.space.row({}), folder, "one")[2]
    (path,) = export_beside(xosc, "rerun", ego="reference")
    return path, entities(path), simulate_file(xosc, ego="reference")


def entities(path):
    """The record batches of each entity of a file."""
    found = {}
    for chunk in reader.RrdReader(path).stream():
        found.setdefault(str(chunk.entity_path), []).append(chunk.to_record_batch())
    return found


def column(batches, name, timeline=TIME):
    """Times [s] and values of a component, in the order of time."""
    rows = [
        (time, value)
        for batch in batches
        if name in batch.schema.names and timeline in batch.schema.names
        for time, value in zip(
            batch.column(timeline).cast("int64").to_pylist(),
            batch.column(name).to_pylist(),
            strict=True,
        )
        if value is not None
    ]
    rows.sort(key=lambda row: row[0])
    return np.array([time for time, _ in rows]) * 1e-9, [value for _, value in rows]


def test_positions_are_the_rollout_s(written):
    _, found, result = written
    rollout, n = result.rollout, int(result.rollout.n_steps[0])
    for e, name in enumerate(rollout.names):
        batches = found[f"/participants/{name}"]
        times, places = column(batches, "Transform3D:translation")
        x, y = rollout.x[0, e, :n], rollout.y[0, e, :n]
        np.testing.assert_allclose(times, np.arange(n) * rollout.time_step, atol=1e-9)
        np.testing.assert_allclose(np.array(places)[:, 0, :2], np.stack([x, y], 1), atol=1e-4)
        _, turns = column(batches, "Transform3D:quaternion")
        qz, qw = np.array(turns)[:, 0, 2:].T  # a turn by h about z: (0, 0, sin h/2, cos h/2)
        h = rollout.h[0, e, :n]
        np.testing.assert_allclose(2 * qw * qz, np.sin(h), atol=1e-6)
        np.testing.assert_allclose(qw**2 - qz**2, np.cos(h), atol=1e-6)
        ((size,),) = column(batches, "Boxes3D:half_sizes")[1]
        np.testing.assert_allclose(size[:2], 0.5 * rollout.box[e, :2], rtol=1e-6)
        assert column(batches, "Boxes3D:labels")[1] == [[name]]


def test_metrics_are_lines_over_time(written):
    _, found, result = written
    rollout, n = result.rollout, int(result.rollout.n_steps[0])
    expected = {
        "/metrics/distance/walker": read(rollout, "gap", ("ego", "walker")),
        "/metrics/time\\ to\\ collision/walker": read(rollout, "ttc", ("ego", "walker")),
        "/metrics/speed/ego": rollout.v[:, 0],
        "/metrics/acceleration/ego": rollout.a[:, 0],
    }
    for path, values in expected.items():
        times, rows = column(found[path], "Scalars:scalars")
        known = np.isfinite(values[0, :n])
        assert [value for (value,) in rows] == values[0, :n][known].tolist()
        np.testing.assert_allclose(times, np.flatnonzero(known) * rollout.time_step, atol=1e-9)


def test_lights_and_detections_are_those_of_the_rollout(written):
    _, found, result = written
    rollout, n = result.rollout, int(result.rollout.n_steps[0])
    words = ("off", "red", "red and yellow", "yellow", "green")
    for s, light in enumerate(rollout.light_names):
        times, states = column(found[f"/lights/{light}"], "StateChange:state")
        steps = np.round(times / rollout.time_step).astype(int)
        held = np.searchsorted(steps, np.arange(n), side="right") - 1
        assert [states[k][0] for k in held] == [words[k] for k in rollout.lights[0, s, :n]]
    seen = rollout.detections[0, 1, :n]
    frames = np.flatnonzero(seen[:, kinds.SEEN_BY] != kinds.NO_FRAME)
    times, centres = column(found["/detections"], "Boxes3D:centers")
    np.testing.assert_allclose(times, frames * rollout.time_step, atol=1e-9)
    for k, places in zip(frames, centres, strict=True):
        there = seen[k, kinds.SEEN_BY] >= kinds.CAMERA
        assert len(places) == there
        if there:
            np.testing.assert_allclose(places[0][:2], seen[k, [kinds.X, kinds.Y]], atol=1e-4)


def test_it_opens_shortly_before_the_conflict_which_the_verdict_is_at(written):
    path, found, result = written
    conflict = summarise(result.conflicts)
    times, texts = column(found["/verdict"], "TextLog:text")
    assert texts[0] == [conflict.sentence]
    assert times[0] == pytest.approx(conflict.time, abs=1e-6)
    assert column(found["/verdict"], "TextLog:text", TO_CONFLICT)[0][0] == 0.0
    # A recording opens where the blueprint's timeline begins, which nothing is before.
    begins = [
        column(batches, name, TO_CONFLICT)[0]
        for batches in found.values()
        for name in {name for batch in batches for name in batch.schema.names if ":" in name}
    ]
    assert min(times.min() for times in begins if times.size) == pytest.approx(-BEFORE)
    (blueprint,) = reader.RrdReader(path).blueprints()
    assert blueprint is not None


def test_who_is_absent_is_cleared(tmp_path):
    """The map, too: a door that opens is there from then on only."""
    scenario = load("child-between-parked")
    pipeline = Pipeline(scenario, scenario.space())
    xosc = write_scenario(pipeline, pipeline.space.row({}), tmp_path, "one")[2]
    (path,) = export_beside(xosc, "rerun", ego="reference")
    rollout, found = simulate_file(xosc, ego="reference").rollout, entities(path)
    assert {"/map/edge", "/map/solid", "/map/broken", "/map/centre"} & found.keys()
    for e, name in enumerate(rollout.names):
        there = rollout.present[0, e] if rollout.present.size else np.ones(1, bool)
        boxes = column(found[f"/participants/{name}"], "Boxes3D:half_sizes")[1]
        assert len(boxes) == there[0] + (np.diff(there.astype(int)) > 0).sum()
    assert json.dumps(sorted(found))  # names are plain texts
