"""What a scenario file may say wrongly: one mistake each in crossroads-s4, and what is said of it.

What stands in the file, what is written instead, how the problem begins, and what stands on the
line that it names (``None``: the file is named, no line).
"""

import pytest
from tests.approval import approve

from bridgegen.base.errors import InputError, ScenarioError
from bridgegen.scenario.language.criteria import read_criterion
from bridgegen.scenario.language.reader import load

MISTAKES = [
    (
        "objective: #",
        "defaults: {fog_densty: 20}\n\nobjective: #",
        "defaults names the unknown parameter 'fog_densty'; did you mean 'fog_density'?",
        "defaults: {fog_densty: 20}",
    ),
    (
        "objective: #",
        "defaults: {fog_density: 120}\n\nobjective: #",
        "low <= default <= high must hold for fog_density [%], got low=0.0, default=120.0, "
        "high=100.0",
        "defaults: {fog_density: 120}",
    ),
    (
        "objective: #",
        "defaults: {friction: 0.5}\n\nobjective: #",
        "friction is derived: it has no default",
        "defaults: {friction: 0.5}",
    ),
    (
        "objective: #",
        "defaults: {bv_speed: 2}\n\nobjective: #",
        "bv_speed is this file's own: its default stands there",
        "defaults: {bv_speed: 2}",
    ),
    (
        "objective: #",
        "defaults: {fog_density: much}\n\nobjective: #",
        "defaults.fog_density must be a number, got 'much'",
        "defaults: {fog_density: much}",
    ),
    (
        "duration: 20.0",
        "duratoin: 20.0",
        "unknown key 'duratoin'; did you mean 'duration'?",
        "duratoin: 20.0",
    ),
    (
        "high: 3.6",
        "hihg: 3.6",
        "unknown key 'hihg' in parameters.bv_speed; did you mean 'high'?",
        "hihg: 3.6",
    ),
    (
        "high: 3.6",
        "high: 0.1",
        "low <= high must hold for bv_speed [m/s], got low=0.5, high=0.1",
        "bv_speed:",
    ),
    (
        "high: 3.6",
        "high: .nan",
        "high of bv_speed [m/s] must be finite, got nan",
        "bv_speed:",
    ),
    (
        "high: 3.6",
        "high: fast",
        "parameters.bv_speed.high must be a number, got 'fast'",
        "high: fast",
    ),
    (
        "high: 3.6",
        "high: true",
        "parameters.bv_speed.high must be a number, got True",
        "high: true",
    ),
    (
        "high: 3.6",
        "high: '3.6'",
        "parameters.bv_speed.high must be a number, got '3.6'",
        "high: '3.6'",
    ),
    (
        "default: 1.8",
        "default: 9",
        "low <= default <= high must hold for bv_speed [m/s], got low=0.5, default=9.0, high=3.6",
        "bv_speed:",
    ),
    (
        "unit: m/s",
        "unit: km/h",
        "unknown unit 'km/h' of bv_speed; known: ",
        "bv_speed:",
    ),
    (
        "unit: m/s",
        "unit: s",
        "events.bv_sets_off.speed needs a parameter in m/s, 'bv_speed' is in s",
        "speed: bv_speed",
    ),
    (
        "axis: participants",
        "axis: participant",
        "parameters.bv_speed.axis must be 'static', 'temporary', 'participants', 'weather' "
        "or 'extension', got 'participant'; did you mean 'participants'?",
        "axis: participant",
    ),
    (
        "axis: participants",
        "axis: static",
        "events.bv_sets_off.speed must not depend on the static axis",
        "speed: bv_speed",
    ),
    (
        "low: 0.5",
        "low: -5.5",
        "events.bv_sets_off.speed [m/s] must be at least -5, 'bv_speed' goes down to -5.5",
        "speed: bv_speed",
    ),
    (
        "speed: bv_speed",
        "speed: bv_sped",
        "events.bv_sets_off.speed names the unknown parameter 'bv_sped'; did you mean 'bv_speed'?",
        "speed: bv_sped",
    ),
    (
        "speed: ego_speed",
        "speed: wetness",
        "participants.ego.speed needs a parameter in m/s, 'wetness' is in %",
        "speed: wetness",
    ),
    (
        "value: bv_trigger_time}",
        "value: bv_trigger_distance}",
        "events.bv_sets_off.when.0.value needs a parameter in s, 'bv_trigger_distance' is in m",
        "value: bv_trigger_distance}",
    ),
    (
        "rate: 3.0",
        "rate: true",
        "events.bv_sets_off.rate must be a number or the name of a parameter, got True",
        "rate: true",
    ),
    (
        "rate: 3.0",
        "rate: 0",
        "events.bv_sets_off.rate [m/s²] must be greater than 0 and finite, got 0",
        "rate: 0",
    ),
    (
        "rate: 3.0",
        "rate: .inf",
        "events.bv_sets_off.rate [m/s²] must be greater than 0 and finite, got inf",
        "rate: .inf",
    ),
    (
        "    rate: 3.0 # m/s²\n",
        "",
        "a jerk is for a rate, without a shape",
        "jerk: 5.0",
    ),
    (
        "jerk: 5.0",
        "jerk: 0",
        "events.bv_sets_off.jerk [m/s³] must be greater than 0 and finite, got 0",
        "jerk: 0",
    ),
    (
        "jerk: 5.0",
        "jerk: 5.0\n    shape: cubic",
        "a jerk is for a rate, without a shape",
        "jerk: 5.0",
    ),
    (
        "rate: 3.0",
        "rate: [3]",
        "events.bv_sets_off.rate must be a number or the name of a parameter, got [3]",
        "rate: [3]",
    ),
    (
        "distance: 40.0} # m before",
        "distance: -1.0} # m before",
        "participants.ego.start.distance [m] must be at least 0",
        "distance: -1.0} # m before",
    ),
    (
        "duration: 20.0",
        "duration: 20.01",
        "duration must be a whole number of time steps, 1 to 100000, got 20.01 s / 0.05 s = 400.2",
        "duration: 20.01",
    ),
    (
        "duration: 20.0",
        "duration: -20",
        "duration [s] must be greater than 0 and finite, got -20",
        "duration: -20",
    ),
    (
        "time_step: 0.05",
        "time_step: 0",
        "time_step [s] must be greater than 0 and finite, got 0",
        "time_step: 0",
    ),
    (
        "time_step: 0.05",
        "time_step: 1e-9",
        "duration must be a whole number of time steps, 1 to 100000",
        "duration: 20.0",
    ),
    (
        "template: crossroads",
        "template: crossroad",
        "template must be 'crossroads', 't-junction', ",
        "template: crossroad",
    ),
    (
        "scenario: crossroads-s4",
        "scenario: '4'",
        "scenario must be a word of letters, digits, '_' and '-', got '4'",
        "scenario: '4'",
    ),
    (
        "title: Merging into one exit",
        "title: ''",
        "title must not be empty, got ''",
        "title: ''",
    ),
    (
        "axes: [participants, weather]",
        "axes: []",
        "axes must not be empty, got []",
        "axes: []",
    ),
    (
        "axes: [participants, weather]",
        "axes: [temporary]",
        "the axes temporary hold nothing to search",
        None,
    ),
    (
        "participant: bv",
        "participant: bvv",
        "unknown participant 'bvv'; did you mean 'bv'?",
        "participant: bvv",
    ),
    (
        "participant: bv",
        "participant: ego",
        "events move the others; the ego's driver is under test",
        "bv_sets_off:",
    ),
    (
        "kind: time,",
        "kind: tim,",
        "events.bv_sets_off.when.0.kind must be 'time', 'distance', 'gap', 'ttc', 'headway', "
        "'speed', 'travelled', 'standstill', 'contact', 'after' or 'began', got 'tim'; did you "
        "mean 'time'?",
        "kind: tim,",
    ),
    (
        "{kind: time,",
        "{kind: time, to: ego,",
        "a time condition has no 'to', got 'ego'",
        "{kind: time, to: ego,",
    ),
    (
        "{kind: distance, to: ego,",
        "{kind: distance,",
        "a distance condition needs 'to', the other participant",
        "{kind: distance,",
    ),
    (
        "to: ego,",
        "to: egg,",
        "unknown participant 'egg'; did you mean 'ego'?",
        "to: egg,",
    ),
    (
        "to: ego,",
        "to: bv,",
        "a distance is to another participant, got 'bv' twice",
        "to: bv,",
    ),
    (
        "weight: 0.8297",
        "weight: -1",
        "fixed weights need one greater than 0 for d_min, got -1.0",
        "weight: -1",
    ),
    (
        "{metric: d_min, weight: 0.8297}",
        "{metric: d_min}",
        "fixed weights need one greater than 0 for d_min, got None",
        "{metric: d_min}",
    ),
    (
        "weights: fixed",
        "weights: entropy",
        "weights by entropy leave no weight to d_min",
        "metric: d_min",
    ),
    (
        "metric: v_d",
        "metric: d_min",
        "the metric 'd_min' occurs twice",
        "metric: d_min",
    ),
    (
        "scale: raw",
        "scale: row",
        "objective.scale must be 'raw' or 'standardised', got 'row'; did you mean 'raw'?",
        "scale: row",
    ),
    (
        "d_min_below: 2.0",
        "d_min_below: -2",
        "d_min_below must be at least 0 and finite, got -2.0",
        "d_min_below: -2",
    ),
    (
        "point: P8",
        "point: P9",
        "a place lies on one of the legs A, B, C, D (P1, P2, P3, P4, P5, P6, P7, P8), got 'P9'",
        "point: P9",
    ),
    (
        "point: P8",
        "point: P7",
        "a route ends where an outbound lane does: P2, P4, P6, P8, got P7",
        "point: P7",
    ),
    (
        "point: P5",
        "point: P6",
        "a route starts where an inbound lane does: P1, P3, P5, P7, got P6",
        "point: P6",
    ),
    (
        "point: P8",
        "point: P6",
        "a route must not turn back: P5 to P6 is one leg",
        "  ego:",
    ),
    (
        "distance: 40.0} # m behind",
        "distance: 46.0} # m behind",
        "ego must stay on leg D: distance <= arm_length [m], '46.0' can lie 1 m beyond",
        None,
    ),
    (
        "point: P5, distance: 40.0",
        "point: P3, distance: 7.0",
        "ego and bv start 0 m apart on leg B in, lane 1, at least 5 m is needed",
        None,
    ),
    (
        "type: car",
        "type: lorry",
        "participants.ego.type must be 'car', 'van', 'truck', ",
        "type: lorry",
    ),
    (
        "include: [crossroads, weather, encounter]",
        "include: [crossroads, wether, encounter]",
        "unknown fragment 'wether'; did you mean 'weather'?",
        "include: [crossroads, wether, encounter]",
    ),
    (
        "include: [crossroads, weather, encounter]",
        "include: [crossroads, weather, ../encounter.yaml]",
        "a file to include lies beside the scenario, got '../encounter.yaml'",
        "include: [crossroads, weather, ../encounter.yaml]",
    ),
    (
        "include: [crossroads, weather, encounter]",
        "include: [crossroads, encounter]",
        "a scenario needs precipitation [%], precipitation_deposits [%], ",
        None,
    ),
]


@pytest.mark.parametrize(("old", "new", "message", "line"), MISTAKES)
def test_mistake_is_named_with_its_place(tmp_path, papers_text, old, new, message, line):
    assert old in papers_text
    text = papers_text.replace(old, new, 1)
    path = tmp_path / "mine.yaml"
    path.write_text(text, "utf-8")
    with pytest.raises(ScenarioError) as caught:
        load(path)
    (found,) = [problem for problem in caught.value.problems if problem.startswith(message)]
    if line is None:
        assert found.endswith(f"({path})")
    else:
        before, _, number = found.removesuffix(")").rpartition(f" ({path}, line ")
        assert before
        assert line in text.splitlines()[int(number) - 1]


PLACES = """
scenario: lanes
title: Lanes
description: The ego starts on either lane.
source: Ours.
template: road
roads: {lanes: 2, length: 400.0, grade: road_grade}
duration: 20.0
time_step: 0.05
axes: [static, participants]
include: [weather]
driver: route-follower
participants:
  ego:
    type: car
    place_by: ego_lane
    places:
      LEFT: {start: {lane: 1, distance: 50.0}, end: {lane: 1, distance: 380.0}}
      right: {start: {lane: 2, distance: 50.0}, end: {lane: 2, distance: 380.0}}
    speed: ego_speed
  bv: {type: car, start: {lane: 1, distance: 120.0}, speed: 4.0}
parameters:
  ego_lane: {axis: participants, kind: category, values: [LEFT, right], default: right,
             description: The ego's lane., source: Ours.}
  ego_speed: {axis: participants, unit: m/s, low: 5, high: 9, default: 8, description: S.,
              source: Ours.}
  road_grade: {axis: static, unit: UNIT, low: LOW, high: 0.0, default: 0.0, description: G.,
               source: Ours.}
"""


def problems_of(tmp_path, **edits):
    text = PLACES
    for old, new in edits.items():
        text = text.replace(old, new)
    path = tmp_path / "lanes.yaml"
    path.write_text(text, "utf-8")
    try:
        load(path)
    except ScenarioError as error:
        return [one.replace(str(path), "FILE") for one in error.problems]
    return []


def test_a_place_of_two_words_is_the_only_mistake_named_with_its_category(tmp_path):
    """What the section uses that cannot be read is not said to be unused."""
    assert problems_of(tmp_path, LEFT="left", UNIT='"1"', LOW="-0.06") == []
    problems = problems_of(tmp_path, LEFT="left lane", UNIT='"1"', LOW="-0.06")
    approve(problems[0], "_", "-")
    assert [one for one in problems if "nothing in" in one] == []


def test_a_share_says_how_per_cent_are_written(tmp_path):
    (problem,) = problems_of(tmp_path, LEFT="left", UNIT='"%"', LOW="-6.0")
    approve(problem, "road_grade", "0.05")


@pytest.mark.parametrize("id", ["R 12", ".R", "R" * 65])
def test_an_id_says_what_it_may_be(id):
    with pytest.raises(InputError) as refused:
        read_criterion({"id": id, "formula": "ttc >= 1 s"})
    (problem,) = refused.value.problems
    approve(problem, "_", "-")
    assert read_criterion({"id": "R" * 60 + ".1_a", "formula": "ttc >= 1 s"}).id.endswith(".1_a")
