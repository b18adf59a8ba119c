"""A weather that changes in mid-scenario: searched, checked, written, played."""

import numpy as np
import pytest

from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.validate import validate_file
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.starter import start_scenario
from bridgegen.scenario.ontology.files import load as load_owl
from bridgegen.scenario.ontology.questions import ask


@pytest.fixture
def scenario(tmp_path):
    own = start_scenario("own", folder=tmp_path)
    text = own.read_text("utf-8")
    text = text.replace(
        "include: [rural, weather]", 'include: [rural, weather, "weather as later_"]'
    )
    text = text.replace(
        "events:\n",
        "events:\n  a_cloudburst:\n    weather: later_\n    when: [{kind: time, value: 2.0}]\n",
        1,
    )
    own.write_text(text, "utf-8")
    return load(own)


def test_the_road_becomes_wet_while_they_drive(scenario, tmp_path):
    space = scenario.space()
    assert {"precipitation", "later_precipitation"} <= set(space.variables)
    pipeline = Pipeline(scenario, space)
    X = space.decode(np.random.default_rng(0).random((300, space.n_var)))
    assert space.violations(X) == []
    dry, wet = space.index("friction"), space.index("later_friction")
    same = X.copy()
    for name in space.names:
        if name.startswith("later_"):
            same[:, space.index(name)] = same[:, space.index(name.removeprefix("later_"))]
    braked = pipeline.rollout(X).a[:, 0].min(axis=1)
    grip = 0.85 * 9.81 * np.maximum(X[:, dry], X[:, wet])
    assert (braked >= -grip - 1e-9).all()  # no tyre gives more than the better of both roads
    slippery = X[:, wet] < X[:, dry] - 0.1
    assert slippery.any()
    assert (pipeline.rollout(same).v[slippery] != pipeline.rollout(X).v[slippery]).any()

    row = int(np.argmax(slippery))
    files = write_scenario(pipeline, X[row], tmp_path, "one")
    assert [problem for file in files for problem in validate_file(file)] == []
    text = files[2].read_text("utf-8")
    assert text.count("<EnvironmentAction>") == 2
    assert 'frictionScaleFactor="$later_friction"' in text
    columns = ask(load_owl(files[0]), "weather-changes")
    assert len(columns.rows) >= 1
    pipeline.choose_objective()
    expected = pipeline.evaluate(X[row : row + 1]).metrics[0]
    result = simulate_file(files[2])
    np.testing.assert_array_equal([result.metrics[name] for name in pipeline.metrics], expected)
