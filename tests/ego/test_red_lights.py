"""Who drives the ego stops for a red light, the careful drivers of the counterfactuals included."""

from importlib import resources
from pathlib import Path

import numpy as np
import pytest

from bridgegen.assess import metrics as measures
from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.types import Responsible, Rule
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


def test_an_offset_within_a_phase_shifts_the_whole_cycle(tmp_path: Path) -> None:
    """A controller once began that phase anew, and contradicted the changes beside it."""
    text = (
        resources.files("bridgegen.scenario.catalogue")
        .joinpath("red-light-runner.yaml")
        .read_text()
    )
    found = {}
    for offset in (0.0, 5.0):
        path = tmp_path / f"{offset:g}.yaml"
        timing = f"green_time: 6.0, signal_offset: {offset}"
        path.write_text(text.replace("green_time: 30.0, signal_offset: 5.0", timing))
        scenario = load(path)
        pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="reference"))
        rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
        found[offset] = rollout.lights[0][:, : int(rollout.n_steps[0])]
    steps, n = 100, min(each.shape[1] for each in found.values())
    assert n > 200  # of 0.05 s: more than the shifted first phase and the next one
    assert np.array_equal(found[5.0][:, : n - steps], found[0.0][:, steps:n])


@pytest.mark.parametrize(
    ("trigger_distance", "rule", "responsible"),
    # What one may expect of a system where a car cuts in (UN R157, 5.2.5.2) is of no red light.
    [(48.89, Rule.RED_LIGHT, Responsible.OTHER), (54.0, Rule.CUT_IN_PREVENTABLE, Responsible.EGO)],
)
def test_one_that_turns_into_the_way_at_red_is_responsible_unless_the_ego_could_brake(
    trigger_distance: float, rule: Rule, responsible: Responsible
) -> None:
    scenario = load("right-turn-on-red")
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    values = {"ego_speed": 7.68, "turner_start": 7.76, "turning_speed": 4.37, "acceleration": 1.77}
    row = pipeline.space.row(values | {"trigger_distance": trigger_distance})
    found = analyse(pipeline.rollout(row[np.newaxis]))
    assert (Rule(found.rule[0].max()), Responsible(found.responsible[0].max())) == (
        rule,
        responsible,
    )
