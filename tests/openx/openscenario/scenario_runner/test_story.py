"""Lights turn at their times, and none that ScenarioRunner could not find is named."""

from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.opendrive.model import Header, OpenDrive
from bridgegen.openx.opendrive.outline import Light
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.recorded import Recording
from bridgegen.openx.openscenario.scenario_runner import story
from bridgegen.openx.openscenario.scenario_runner.environment import CLEAR

ROADS = OpenDrive(Header(1, 7))
STEP = 0.1
THERE = [Light("1", 10.0, 5.0, 0.0), Light("2", 10.0, 7.5, 0.0), Light("3", -3.0, 0.0, 0.0)]
NAMES = ("1", "2")


def recording(lights, names=NAMES):
    still = np.zeros((1, lights.shape[1]))
    return Recording(
        ("ego",), STEP, still, still, still, still, (), light_names=names, lights=lights
    )


def act(one, there=THERE):
    with patch.object(story, "lights", return_value=there):
        return story.act({}, one, [(0.0, CLEAR)], ROADS, osc.Trigger())


def fires(clock, k):
    """Whether a clock's condition is true in ScenarioRunner's k-th tick, a little late or early."""
    rule = {osc.Rule.GREATER_THAN: np.greater, osc.Rule.LESS_THAN: np.less}[clock.rule]
    late, early = (rule(k * STEP + slip, clock.value) for slip in (1e-9, -1e-9))
    assert late == early
    return late


@given(arrays(np.int8, st.tuples(st.just(2), st.integers(1, 12)), elements=st.integers(0, 4)))
def test_at_every_tick_the_lights_show_what_they_did(lights):
    shown: dict[str, str] = {}
    events = [
        event
        for group in act(recording(lights)).maneuver_groups
        if group.name == "traffic_lights"
        for event in group.maneuvers[0].events
    ]
    waiting = list(events)
    for k in range(lights.shape[1]):
        for event in list(waiting):
            (clock,) = (c for c in walk(event) if isinstance(c, osc.SimulationTimeCondition))
            if fires(clock, k):
                waiting.remove(event)
                for one in walk(event):
                    if isinstance(one, osc.TrafficSignalStateAction):
                        assert shown.get(one.name) != one.state  # nothing is said twice
                        shown[one.name] = one.state
        expected = [("off", "red", "red", "yellow", "green")[state] for state in lights[:, k]]
        assert [shown["pos=10.000,-5.000"], shown["pos=10.000,-7.500"]] == expected
    assert not waiting


@pytest.mark.parametrize(
    ("names", "there", "state", "text"),
    [
        (("9",), THERE, 1, "traffic"),
        (("1",), [*THERE, Light("4", 11.0, 5.0, 0.0)], 1, "2 m"),
        (("1",), THERE, 5, "takes"),
    ],
)
def test_lights_that_cannot_be_set(names, there, state, text):
    lights = np.full((1, 3), state, dtype=np.int8)
    with refuses(UnsupportedError, text):
        act(recording(lights, names), there)
