"""A category chooses where a participant starts and goes: rows are those of that place alone."""

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import ScenarioError, UnsupportedError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.opendrive.site_fit import site_for
from bridgegen.pages.scenario_page import story_lines
from bridgegen.scenario.language.reader import load

HEAD = """
scenario: two
title: The ego comes from either side
description: Another one crosses.
source: ours
template: crossroads
duration: 8.0
time_step: 0.05
axes: [participants]
include: [weather]
driver: route-follower
participants:
  ego:
    type: car
"""
SOUTH = "start: {point: P5, distance: 40.0}, end: {point: P2, distance: 60.0}"
NORTH = "start: {point: P1, distance: near}, end: {point: P4, distance: 60.0}"
CHOSEN = f"""
    place_by: side
    places:
      south: {{{SOUTH}}}
      north: {{{NORTH}}}
"""
TAIL = """
    speed: ego_speed
  bv:
    type: car
    start: {point: P3, distance: 40.0}
    end: {point: P8, distance: 60.0}
    speed: 8.0
parameters:
  near: {axis: participants, unit: m, low: 20, high: 45, default: 30, description: N., source: s}
  ego_speed: {axis: participants, unit: m/s, low: 5, high: 9, default: 8,
    description: V., source: s}
"""
SIDE = """
  side: {axis: participants, kind: category, values: [north, south], default: south,
    description: Which., source: s}
"""


@pytest.fixture
def made(tmp_path):
    def make(ego: str = CHOSEN, edits: tuple[tuple[str, str], ...] = ()) -> Pipeline:
        text = HEAD + ego + TAIL + (SIDE if "place_by" in ego else "")
        for old, new in edits:
            assert old in text
            text = text.replace(old, new)
        path = tmp_path / "two.yaml"
        path.write_text(text, "utf-8")
        scenario = load(path)
        return Pipeline(scenario, scenario.space())

    return make


def alone(place: str) -> str:
    """Return a place as a participant's own keys."""
    return "    " + place.replace("}, end", "}\n    end") + "\n"


NEAR = next(line + "\n" for line in TAIL.splitlines() if line.startswith("  near"))


def test_each_row_is_that_of_its_place_alone(made):
    pipeline = made()
    space = pipeline.space
    assert set(space.variables) == {"near", "ego_speed", "side"}
    X = np.array([space.row({"side": float(k), "ego_speed": 6.0 + k}) for k in (0, 1, 0)])
    pipeline.choose_objective()
    found = pipeline.evaluate(X).metrics
    for k, place in enumerate((NORTH, SOUTH)):
        one = made(alone(place), () if k == 0 else ((NEAR, ""),))
        one.choose_objective()
        row = one.space.row({"ego_speed": 6.0 + k})[np.newaxis]
        assert one.evaluate(row).metrics.tobytes() == found[k].tobytes()
    assert found[2].tobytes() == found[0].tobytes()
    said = " ".join(story_lines(pipeline.scenario))
    approve(said, "ego_speed", "lane 1", "40 m")


def test_what_a_place_lacks_is_told_of_that_place(made):
    """Only in the rows that choose it: 10 m behind who stands there at the other place."""
    south = SOUTH.replace("40.0", "4.0")
    with refuses(ScenarioError, "140.0"):
        made(edits=((SOUTH, SOUTH.replace("40.0", "140.0")),))
    with refuses(ScenarioError, "2 m"):
        made(edits=((SOUTH, "start: {point: P3, distance: 42.0}, end: {point: P8, distance: 60}"),))
    made(edits=((SOUTH, south),))


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("values: [north, south]", "values: [north, south, east]",
         "south"),
        ("    place_by: side\n", "", "place_by"),
        ("place_by: side", "place_by: sid", "sid"),
        ("    place_by: side\n", "    place_by: side\n    start: {point: P5, distance: 3}\n",
         "places"),
        (", end: {point: P2, distance: 60.0}", "", "ego's"),
        ("end: {point: P2", "end: {point: P3", "outbound"),
    ],
)  # fmt: skip
def test_what_cannot_be_chosen_is_refused(made, old, new, problem):
    with refuses(ScenarioError, problem):
        made(edits=((old, new),))


def test_a_map_has_no_such_choice(made):
    pipeline = made()
    model = pipeline.runner.source.roads({})
    with refuses(UnsupportedError):
        site_for(pipeline.scenario, model)
