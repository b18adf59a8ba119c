"""The choice of a simulator."""

import pytest
from tests.approval import refuses

from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.choice import EMBEDDED, SIMULATORS, SimulatorChoice


def test_the_embedded_one_is_the_default():
    logical = load("crossroads-s1")
    pipeline = Pipeline(logical, logical.space())
    assert EMBEDDED.name == "embedded"
    assert pipeline.runner.simulator is pipeline.runner.embedded


@pytest.mark.parametrize("name", SIMULATORS)
def test_every_simulator_says_what_it_is(name):
    kind = SIMULATORS[name]
    assert kind.name == name
    assert kind.description.endswith(".")
    assert all(option.startswith("--") for option in kind.access)


def test_there_is_no_other():
    with refuses(UnknownNameError, "embeded"):
        SimulatorChoice("embeded")


def test_it_takes_its_own_settings_and_options_alone():
    with refuses(UnknownNameError, "town"):
        SimulatorChoice(settings={"town": "Town05"})
    with refuses(InputError, "--where"):
        SimulatorChoice(access={"--where": 1})
