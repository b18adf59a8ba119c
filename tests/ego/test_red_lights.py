"""Who drives the ego stops for a red light, the careful drivers of the counterfactuals included."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from bridgegen.assess import metrics as measures
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load


@pytest.fixture(scope="module")
def red(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The red-light runner's crossroads, but the ego comes at red."""
    text = (
        resources.files("bridgegen.scenario.catalogue")
        .joinpath("red-light-runner.yaml")
        .read_text()
    )
    assert "green_time: 30.0, signal_offset: 5.0" in text
    path: Path = tmp_path_factory.mktemp("red") / "red.yaml"
    path.write_text(
        text.replace("green_time: 30.0, signal_offset: 5.0", "green_time: 8.0, signal_offset: 12.0")
    )
    return path


@pytest.mark.parametrize(
    "ego", ["reference", "un-r157", "fsm", "careful", "careful-fsm", "route-follower"]
)
def test_it_stops_before_the_line_and_goes_on_at_green(red: Path, ego: str) -> None:
    scenario = load(red)
    space = scenario.space()
    pipeline = Pipeline(scenario, space, PipelineOptions(ego=ego))
    rollout = pipeline.rollout(space.row({"runner_start": 20.0, "runner_speed": 13.0})[np.newaxis])
    (crossed,) = measures.evaluate(rollout, ("r_red",))[:, 0]
    v = rollout.v[0, 0, : rollout.n_steps[0]]
    if ego == "route-follower":
        assert crossed == 1  # it would have been red
        return
    assert crossed == 0
    assert v.min() < 0.5
    assert v[-1] > 3.0
