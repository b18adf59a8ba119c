"""A category chooses where a participant starts and goes: rows are those of that place alone."""

import numpy as np
import pytest

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
    assert "ego, a car, starts at ego_speed; side chooses its place: from near on lane 1" in said
    assert "from 40 m on lane 1 of leg C in to" in said


def test_what_a_place_lacks_is_told_of_that_place(made):
    """Only in the rows that choose it: 10 m behind who stands there at the other place."""
    south = SOUTH.replace("40.0", "4.0")
    with pytest.raises(ScenarioError, match=r"'140\.0' can lie \d+ m beyond"):
        made(edits=((SOUTH, SOUTH.replace("40.0", "140.0")),))
    with pytest.raises(ScenarioError, match=r"ego and bv start 2 m apart on leg B in"):
        made(edits=((SOUTH, "start: {point: P3, distance: 42.0}, end: {point: P8, distance: 60}"),))
    made(edits=((SOUTH, south),))


@pytest.mark.parametrize(
    ("old", "new", "problem"),
    [
        ("values: [north, south]", "values: [north, south, east]",
         "places of ego must be one for each value of side, north, south, east, got south, north"),
        ("    place_by: side\n", "", "ego has places, so it needs place_by"),
        ("place_by: side", "place_by: sid", "place_by must name a category, got 'sid'; did you"),
        ("    place_by: side\n", "    place_by: side\n    start: {point: P5, distance: 3}\n",
         "ego has places, so it has no start, end or path of its own"),
        (", end: {point: P2, distance: 60.0}", "", "the ego's route must have an end"),
        ("end: {point: P2", "end: {point: P3", "a route ends where an outbound lane does"),
    ],
)  # fmt: skip
def test_what_cannot_be_chosen_is_refused(made, old, new, problem):
    with pytest.raises(ScenarioError, match=problem):
        made(edits=((old, new),))


def test_a_map_has_no_such_choice(made):
    pipeline = made()
    model = pipeline.runner.source.roads({})
    with pytest.raises(
        UnsupportedError, match=r"roads of the scenario's own \(side chooses where ego"
    ):
        site_for(pipeline.scenario, model)
