"""Scenarios that ship: searched, handed over, and the files give the same metrics.

All of them with BRIDGEGEN_EXPLORE; else those that together say all that scenarios say.
"""

import os

import numpy as np
import pytest
from tests.covering import covering

import bridgegen as bg
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.validate import validate_file
from bridgegen.results.store import Store
from bridgegen.scenario.language.reader import load, names

pytestmark = pytest.mark.thorough

each = pytest.mark.parametrize(
    "name", names() if os.environ.get("BRIDGEGEN_EXPLORE") else covering()
)


@each
def test_a_smoke_search(tmp_path, name):
    triage = "short" if name in covering() else "none"  # words of the language, once each
    run = bg.run_search(
        name, algorithm="random", budget=20, keep=1, triage=triage, out=tmp_path / "run"
    )
    with Store.open(run.folder) as store:
        rows = store.read()
    assert len(rows) == 20
    assert (rows.status == 0).all()
    assert run.report.stat().st_size > 10_000
    # What is handed over is what was searched, critical or not.
    scenario = load(name)
    pipeline = Pipeline(scenario, scenario.space())
    files = write_scenario(pipeline, rows.X[7], tmp_path, "one")
    assert [problem for file in files for problem in validate_file(file)] == []
    result = simulate_file(files[2])
    # Files do not state criteria, so their margins are of a search alone.
    there = [m in result.metrics for m in pipeline.metrics]
    assert sum(there) == len(there) - len(scenario.criteria)
    found = [result.metrics.get(m) for m in pipeline.metrics]
    np.testing.assert_array_equal(np.compress(there, found), np.compress(there, rows.metrics[7]))


@each
def test_neither_driver_is_never_or_always_at_risk(name):
    """A scenario in which nothing can go wrong, or nothing else, tells nobody anything."""
    scenario = load(name)
    shares = []
    for ego in ("route-follower", "reference"):
        space = scenario.space()
        pipeline = Pipeline(scenario, space, PipelineOptions(ego=ego))
        pipeline.choose_objective()
        X = space.decode(np.random.default_rng(1).random((300, space.n_var)))
        shares.append(float(pipeline.evaluate(X).critical.mean()))
    careless, careful = shares
    assert careful < 0.7
    if scenario.story.ghosts:  # which only a driver that perceives meets
        assert careless == 0.0 < careful
        return
    assert careless > 0.0
    assert careful <= careless + 0.05
