"""What shapes the storyboard must not vary: the lights' timing, and delays after an event."""

from importlib.resources import files

import pytest
from tests.approval import approve

from bridgegen.base.errors import ScenarioError
from bridgegen.scenario.language.reader import load

LONG = """
parameters:
  long_green:
    axis: static
    unit: s
    low: 20.0
    high: 40.0
    default: 30.0
    description: How long green lasts.
    source: ours.
"""
DELAY = """
parameters:
  delay:
    axis: participants
    unit: s
    low: 0.0
    high: 4.0
    default: 1.0
    description: How long the runner hesitates.
    source: ours.
"""
SECOND = """events:
  runner_hesitates:
    participant: runner
    speed: 5.0
    when:
      - {kind: after, event: runner_decides, value: DELAY}
"""


def problems(tmp_path, *changes):
    text = (
        files("bridgegen.scenario.catalogue").joinpath("red-light-runner.yaml").read_text("utf-8")
    )
    for old, new in changes:
        assert text.count(old) == 1
        text = text.replace(old, new)
    path = tmp_path / "own.yaml"
    path.write_text(text, encoding="utf-8")
    try:
        load(path)
    except ScenarioError as error:
        return error.problems
    return []


@pytest.mark.parametrize("knob", ["green_time", "yellow_time", "all_red_time", "signal_offset"])
def test_timing_of_lights_must_be_constant(tmp_path, knob):
    roads = "{lanes_per_direction: 2, signals: two-phase, green_time: 30.0, signal_offset: 5.0, "
    told = problems(
        tmp_path,
        ("\nparameters:\n", LONG),
        (roads, f"{{lanes_per_direction: 2, signals: two-phase, {knob}: long_green, "),
    )
    (problem,) = told
    approve(problem, knob, "long_green", "own.yaml")


def test_nor_may_a_parameter_of_the_knob_s_own_name_give_it(tmp_path):
    own = LONG.replace("long_green", "yellow_time").replace("20.0", "3.0").replace("40.0", "5.0")
    (problem,) = problems(tmp_path, ("\nparameters:\n", own.replace("30.0", "4.0")))
    approve(problem, "yellow_time")


def test_a_delay_must_be_constant(tmp_path):
    second = SECOND.replace("DELAY", "1.5")
    assert problems(tmp_path, ("events:\n", second)) == []
    second = SECOND.replace("DELAY", "delay")
    (problem,) = problems(tmp_path, ("events:\n", second), ("\nparameters:\n", DELAY))
    approve(problem, "after", "delay", "own.yaml")
