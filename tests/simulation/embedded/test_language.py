"""What scenario files can say, as it moves; by hand-worked numbers, and there and back again."""

import re
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.base.errors import ScenarioError
from bridgegen.base.physics import GRAVITY, GRIP
from bridgegen.drivers import kinds as lamps
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.jobs.search.validate import validate_file
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.write import to_xml
from bridgegen.pages.scenario_page import story_lines
from bridgegen.scenario import participants as participant_types
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.named_models import MODELS
from bridgegen.scenario.ontology.check import check

HEAD = """
scenario: mine
title: Everything that a file can say
description: On a motorway of two lanes.
source: ours
template: road
roads: {lanes: 2, length: 1200.0, speed_limit: 36.1, road_type: motorway}
duration: 20.0
time_step: 0.05
axes: [participants]
include: [motorway, weather]
driver: reference
objective: harm
"""
PARTICIPANTS = """
participants:
  ego:
    type: car
    start: {distance: 50.0, lane: 2}
    end: {distance: 1180.0, lane: 2}
    speed: 20.0
  other:
    type: car
    start: {distance: other_at, lane: 1}
    speed: 20.0
"""
PARAMETERS = """
parameters:
  other_at: {axis: participants, unit: m, low: 90, high: 150, default: 100, description: Where., source: ours}
  turned: {axis: participants, unit: deg, low: -120, high: 120, default: 90, description: How., source: ours}
  aside: {axis: participants, unit: m, low: -1.5, high: 1.5, default: -1.0, description: How., source: ours}
"""  # noqa: E501


@pytest.fixture
def made(tmp_path):
    def make(participants: str = PARTICIPANTS, events: str = "", more: str = "") -> Pipeline:
        text = HEAD + participants + (f"events:\n{events}" if events else "") + PARAMETERS + more
        for name in ("turned", "aside"):
            if text.count(name) == 1:
                text = "\n".join(one for one in text.splitlines() if f"  {name}:" not in one)
        path = tmp_path / ("types.yaml" if more else "mine.yaml")
        path.write_text(text, "utf-8")
        scenario = load(path)
        return Pipeline(scenario, scenario.space())

    return make


def motion(pipeline: Pipeline, **values):
    x = pipeline.space.row(values)
    rollout = pipeline.rollout(x[np.newaxis])
    assert rollout.status.tolist() == [0]
    return {
        name: {key: getattr(rollout, key)[0, e] for key in "xyhv"}
        for e, name in enumerate(rollout.names)
    }


def there_and_back(pipeline: Pipeline) -> None:
    """The files say it, the constraints hold, and what is read is what was written."""
    concrete = pipeline.runner.concrete(pipeline.space.row({}), "roads.xodr")
    assert not list(check(concrete.individuals, pipeline.runner.source.constraints))
    found, lost = individuals_from_openscenario(
        concrete.storyboard, concrete.roads, "roads.xodr", ""
    )[:2]
    assert not lost
    assert to_xml(openscenario_from_owl(found, "roads.xodr")) == to_xml(concrete.storyboard)


def test_wrong_way_driving(made):
    """At 20 m/s from 700 m on: 600 m after 5 s, in its own lane's middle, face to the traffic."""
    pipeline = made(
        PARTICIPANTS
        + """
  ghost:
    type: car
    start: {distance: 700.0, lane: 1, offset: 0.5}
    speed: 72 km/h
    heading: 180°
"""
    )
    ghost = motion(pipeline)["ghost"]
    assert ghost["x"][[0, 100]] == pytest.approx([700.0, 600.0], abs=1e-9)
    assert np.abs(ghost["h"]) == pytest.approx(np.pi)
    lane = -0.5 * 3.75  # the left lane's middle, and 0.5 m to the left of the lane's own traffic
    assert ghost["y"] == pytest.approx(lane + 0.5, abs=1e-9)
    there_and_back(pipeline)
    said = " ".join(story_lines(pipeline.scenario))
    approve(said, "lane 1", "700 m")


def test_reversing(made):
    """It brakes from 20 m/s by 15 m/s² and goes on to −2 m/s: 2 m back a second, nose ahead."""
    pipeline = made(
        events="""
  backs_out:
    participant: other
    speed: -2.0
    rate: 15.0
    when:
      - {kind: time, value: 1.0}
"""
    )
    other = motion(pipeline)["other"]
    assert np.abs(other["h"]).max() < 1e-9
    assert other["v"][-1] == -2.0
    assert other["x"][200] - other["x"][300] == pytest.approx(2.0 * 5.0)
    again = made(PARTICIPANTS.replace("lane: 1}\n    speed: 20.0", "lane: 1}\n    speed: -2.0"))
    rollout = again.rollout(again.space.row({})[np.newaxis])
    assert plausibility(rollout).labels == [""]  # nothing is odd about a vehicle that reverses
    there_and_back(pipeline)
    for name, said in (("other", "at least -5"), ("ego", "at least 0")):
        text = (
            PARTICIPANTS.replace("speed: 20.0", "speed: -6.0")
            if name == "other"
            else (PARTICIPANTS.replace("speed: 20.0", "speed: -1.0", 1))
        )
        with pytest.raises(ScenarioError, match=said):
            made(text)


def test_parked_across_at_a_searched_angle(made):
    pipeline = made(
        PARTICIPANTS
        + """
  parked:
    type: van
    start: {distance: 1000.0, lane: 1}
    heading: turned
"""
    )
    for degrees in (-120.0, 90.0):
        parked = motion(pipeline, turned=degrees)["parked"]
        assert np.degrees(parked["h"]) % 360.0 == pytest.approx(degrees % 360.0)
        assert (parked["v"] == 0.0).all()
    there_and_back(pipeline)


def test_moving_aside(made):
    """To 1 m right of the lane's centre, and there it stays."""
    pipeline = made(
        events="""
  swerve:
    participant: other
    lane_offset: {offset: aside, acceleration: 2.0}
    when:
      - {kind: time, value: 2.0}
"""
    )
    other = motion(pipeline, aside=-1.0)["other"]
    lane = -0.5 * 3.75
    assert other["y"][:40] == pytest.approx(lane)
    assert other["y"][-1] == pytest.approx(lane - 1.0, abs=1e-6)
    across = np.gradient(np.gradient(other["y"], 0.05), 0.05)
    assert np.abs(across).max() < 2.1
    there_and_back(pipeline)


@pytest.mark.parametrize(("kept", "gap"), [("distance: 30 m", 30.0), ("time: 1.5 s", 33.0)])
def test_keeping_a_distance(made, kept, gap):
    """Behind a lead at 22 m/s, between the bodies: 30 m, or 1.5 s = 33 m; it brakes by 3.5 m/s²."""
    pipeline = made(PARTICIPANTS.replace("speed: 20.0", "speed: 22.0") + """
  lead:
    type: car
    start: {distance: 160.0, lane: 1}
    speed: 22.0
""", f"""
  follow:
    participant: other
    keep_distance: {{to: lead, {kept}, max_speed: 25}}
    when:
      - {{kind: time, value: 1.0}}
""")  # fmt: skip
    found = motion(pipeline, other_at=100.0)
    lead, other = found["lead"], found["other"]
    between = lead["x"] - other["x"] - 4.6  # two cars' lengths are one of them
    assert between[0] == pytest.approx(60.0 - 4.6)
    assert between[-1] == pytest.approx(gap, abs=0.3)
    assert other["v"].max() <= 25.0
    assert (np.diff(other["v"]) / 0.05).min() >= -3.5 - 1e-9
    assert (np.diff(other["v"]) / 0.05).max() <= 2.0 + 1e-9
    there_and_back(pipeline)


def test_arriving_together(made):
    """Whenever the ego is at 250 m, the other is at 300 m."""
    pipeline = made(
        events="""
  meets:
    participant: other
    arrive: {at: {distance: 300.0, lane: 1}, other: ego, place: {distance: 250.0, lane: 2}}
    when:
      - {kind: time, value: 0.0}
"""
    )
    found = motion(pipeline)
    k = int(np.argmin(np.abs(found["ego"]["x"] - 250.0)))
    assert found["other"]["x"][k] == pytest.approx(300.0, abs=1.0)
    there_and_back(pipeline)


def test_a_gap_a_contact_and_a_beginning(made):
    """The gap from a car at 100 m to one at 50 m beside it is 50 − 4.6 = 45.4 m."""
    events = """
  far:
    participant: other
    speed: 10.0
    when:
      - {kind: gap, to: ego, value: 45.3}
  touched:
    participant: other
    speed: 0.0
    rate: 6.0
    when:
      - {kind: contact, to: ego}
  near:
    participant: other
    lane_offset: {offset: 0.5}
    when:
      - {kind: gap, to: ego, value: 45.5}
  then:
    participant: other
    speed: 15.0
    rate: 2.0
    when:
      - {kind: began, event: near, value: 2.0}
"""
    pipeline = made(events=events)
    x = pipeline.space.row({"other_at": 100.0})
    rollout = pipeline.rollout(x[np.newaxis])
    began = dict(zip(rollout.event_names, rollout.began[0].tolist(), strict=True))
    assert began["near"] == 0
    assert began["then"] in (40, 41)
    assert began["touched"] == -1
    there_and_back(pipeline)


def test_a_siren_is_in_the_files(made):
    text = PARTICIPANTS.replace("other:\n    type: car", "other:\n    type: emergency")
    pipeline = made(text.replace("other_at, lane: 1}", "other_at, lane: 1}\n    siren: true"))
    assert pipeline.runner.embedded.program.sirens.tolist() == [0, 1]
    there_and_back(pipeline)
    with refuses(ScenarioError):
        made(PARTICIPANTS + "    siren: true\n")


def test_a_reason_lifts_the_limit_and_nothing_else(made):
    text = PARTICIPANTS.replace(
        "start: {distance: other_at, lane: 1}\n    speed: 20.0",
        "start: {distance: other_at, lane: 1}\n    speed: 45.0",
    )
    with refuses(ScenarioError):
        made(text)
    lifted = text.replace("speed: 45.0", 'speed: 45.0\n    exceeds_limit: "a race"')
    pipeline = made(lifted)
    assert motion(pipeline)["other"]["v"][0] == 45.0
    there_and_back(pipeline)
    with refuses(ScenarioError):
        made(lifted.replace("45.0", "95.0"))


BUILDING = """
  building:
    type: obstacle
    body: {length: 20 m, width: 8 m, height: 10 m}
    start: {distance: 125.0, lane: 2, offset: -9.0}
  parked:
    type: motorcycle
    body: {length: 2.6, max_speed: 200 km/h}
    start: {distance: 150.0, lane: 2, offset: -1.8}
    heading: 90
"""


def test_bodies_of_ones_own(made):
    """A motorcycle 2.6 m long: reference point and axles as far from its middle, in proportion."""
    pipeline = made(PARTICIPANTS + BUILDING)
    names = pipeline.runner.embedded.program.names
    box = dict(zip(names, pipeline.runner.embedded.program.box.tolist(), strict=True))
    assert box["building"] == [20.0, 8.0, 0.0]
    assert box["parked"] == pytest.approx([2.6, 0.8, 0.7 * 2.6 / 2.2])
    there_and_back(pipeline)
    for wrong, said in (
        (
            BUILDING.replace("length: 20 m", "max_speed: 5"),
            "max_speed",
        ),
        (BUILDING.replace("length: 20 m", "length: 0"), "greater"),
    ):
        with refuses(ScenarioError, said):
            made(PARTICIPANTS + wrong)


@pytest.mark.parametrize(("height", "hidden"), [("10 m", True), ("30 cm", False)])
def test_a_building_hides_who_is_behind_it(made, height, hidden):
    """From (50, −5.6) to (160, −14.6) the line passes x = 115 to 135 at y = −10.9 to −12.6.

    The building's sides are at y = −7.6 and −15.6; after 5 s the ego is beside it.
    """
    pipeline = made(
        PARTICIPANTS
        + f"""
  building:
    type: obstacle
    body: {{length: 20 m, width: 8 m, height: {height}}}
    start: {{distance: 125.0, lane: 2, offset: -6.0}}
  deer:
    type: animal
    start: {{distance: 160.0, lane: 2, offset: -9.0}}
"""
    )
    rollout = pipeline.rollout(pipeline.space.row({})[np.newaxis])
    seen = rollout.detections[0, rollout.names.index("deer"), :, 0]
    early, late = seen[1:60], seen[110:160]
    assert (early[early >= 0] == 0).all() == hidden
    assert (late > 0).any()


LEAD = """
  lead:
    type: car
    type_by: lead_type
    start: {distance: 110.0, lane: 2}
    speed: 15.0
"""
LEAD_TYPE = """
  lead_type: {axis: participants, kind: category, values: [car, truck, motorcycle],
    default: car, description: What it is., source: ours}
"""


def test_types_vary(made, tmp_path, monkeypatch):
    """Each row is that of the scenario with that type alone, to the last bit."""
    pipeline = made(PARTICIPANTS + LEAD, more=LEAD_TYPE)
    space = pipeline.space
    assert set(space.variables) == {"other_at", "lead_type"}
    X = np.array([space.row({"lead_type": float(k)}) for k in (2, 0, 1, 1)])
    pipeline.choose_objective()
    found = pipeline.evaluate(X)
    assert pipeline.runner.kinds["lead"] == "car or truck or motorcycle"
    lengths = {"car": 4.6, "truck": 10.0, "motorcycle": 2.2}
    for k, kind in enumerate(("motorcycle", "car", "truck")):
        ((_, one),) = pipeline.runner.by_variant(X[k : k + 1])
        rollout = one.run(X[k : k + 1])
        lead = rollout.names.index("lead")
        assert rollout.box[lead, 0] == pytest.approx(lengths[kind], abs=0.5)
        assert pipeline.runner.bodies(X[k])["lead"] == kind
        alone = made(
            PARTICIPANTS + LEAD.replace("    type_by: lead_type\n", "").replace("car", kind)
        )
        alone.choose_objective()
        row = alone.space.row({})[np.newaxis]
        assert alone.evaluate(row).metrics.tobytes() == found.metrics[k].tobytes()
    there_and_back(pipeline)
    said = " ".join(story_lines(pipeline.scenario))
    approve(said, "motorcycle")
    import bridgegen as bg

    run = bg.run_search(
        tmp_path / "types.yaml", algorithm="random", budget=40, keep=6, ego="route-follower",
        count="any", triage="short", out=tmp_path / "run",
    )  # fmt: skip
    assert run.scenarios
    kinds = {re.search(r'name="lead">\s*<Vehicle[^>]*vehicleCategory="(\w+)"', one.read_text())[1]
             for one in run.scenarios}  # fmt: skip
    assert len(kinds) > 1


def test_models_by_name(made):
    """A model has its own body, in the files too, and is what a reader finds again."""
    model = LEAD.replace("type_by: lead_type", "model: ncap_global_vehicle_target")
    pipeline = made(PARTICIPANTS + model)
    row = pipeline.space.row({})
    rollout = pipeline.rollout(row[np.newaxis])
    assert rollout.box[rollout.names.index("lead")] == pytest.approx([4.023, 1.712, 1.328])
    written = to_xml(pipeline.runner.concrete(row, "roads.xodr").storyboard)
    assert b'name="ncap_global_vehicle_target"' in written
    there_and_back(pipeline)
    said = " ".join(story_lines(pipeline.scenario))
    approve(said, "ncap_global_vehicle_target")


def test_models_vary(made):
    names = "[ncap_motorcycle, aashto_su, car]"
    more = LEAD_TYPE.replace("[car, truck, motorcycle]", names).replace(
        "default: car", "default: aashto_su"
    )
    lead = LEAD.replace("type: car", "type: truck\n    model: aashto_su")
    pipeline = made(PARTICIPANTS + lead, more=more)
    pipeline.choose_objective()
    for k, length in enumerate((2.08, 9.2, 4.6)):
        row = pipeline.space.row({"lead_type": float(k)})[np.newaxis]
        ((_, one),) = pipeline.runner.by_variant(row)
        rollout = one.run(row)
        assert rollout.box[rollout.names.index("lead"), 0] == pytest.approx(length, abs=0.2)
    there_and_back(pipeline)


def test_the_models_are_those_of_their_sources():
    """The axles lie below the box, and the documentation names each."""
    documented = (Path(__file__).parents[3] / "docs" / "scenarios.md").read_text("utf-8")
    for model in MODELS.values():
        assert f"`{model.name}`" in documented
        body, usual = model.body, participant_types.PARTICIPANTS[model.type].body
        assert (body.wheelbase > 0.0) == (usual.wheelbase > 0.0)
        assert body.wheelbase < body.length
        if body.wheelbase:
            rear = 0.5 * body.length - body.center_ahead
            front = 0.5 * body.length + body.center_ahead - body.wheelbase
            assert rear > 0.0
            assert front > 0.0


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("type_by: lead_type", "model: aashto_su", "aashto_su"),
        ("type_by: lead_type", "model: ncap_adlt", "ncap_adult"),
    ],
)
def test_models_that_cannot_be_are_refused(made, old, new, message):
    with refuses(ScenarioError, message):
        made((PARTICIPANTS + LEAD).replace(old, new))


@pytest.mark.parametrize(
    ("old", "new", "message"),
    [
        ("car, truck, motorcycle", "car, pedestrian", "pedestrian"),
        ("car, truck, motorcycle", "car, lorry", "lorry"),
        ("default: car", "default: truck", "lead_type"),
        ("type_by: lead_type", "type_by: lead_typ", "lead_typ"),
    ],
)
def test_types_that_cannot_vary_are_refused(made, old, new, message):
    with refuses(ScenarioError, message):
        made((PARTICIPANTS + LEAD).replace(old, new), more=LEAD_TYPE.replace(old, new))


REFUSED = {
    "its end can lie 30 m behind its start": PARTICIPANTS.replace("1180.0", "20.0"),
    "the ego drives along its route, it has no heading": PARTICIPANTS.replace(
        "speed: 20.0\n  other", "speed: 20.0\n    heading: 180\n  other"
    ),
    "heading 0 or 180 deg, got 90": PARTICIPANTS + "    heading: 90\n",
    "must be -180 to 180, got 200": PARTICIPANTS + "    heading: 200\n",
    "other has an end, so no heading": PARTICIPANTS.replace(
        "start: {distance: other_at, lane: 1}",
        "start: {distance: other_at, lane: 1}\n    end: {distance: 900, lane: 1}\n    heading: 180",
    ),
}


@pytest.mark.parametrize("message", REFUSED)
def test_what_cannot_be_is_refused(made, message):
    with pytest.raises(ScenarioError, match=message):
        made(REFUSED[message])


EVENTS = {
    "keeps a distance or a time, one of them": "keep_distance: {to: ego}",
    "must have one of speed, keep_distance and arrive": (
        "speed: 3.0\n    keep_distance: {to: ego, time: 2}"
    ),
    "keep_distance is to another participant": "keep_distance: {to: other, time: 2}",
    "unknown participant 'egg'": "keep_distance: {to: egg, time: 2}",
    r"must be -4 to 4, beyond that it changes lane, got 6": "lane_offset: {offset: 6}",
    r"acceleration \[m/s²\] must be greater than 0": "lane_offset: {offset: 1, acceleration: 0}",
    "must have an action: speed, lane_change, lane_offset": "",
    "indicate must be 'left', 'right', 'hazard' or 'off', got 'both'": "indicate: both",
}


def test_downhill_the_ego_brakes_less(made, monkeypatch):
    """At 25 m/s towards a car that stands 35 m ahead: with all that the road gives."""
    stands = PARTICIPANTS.replace("lane: 1}\n    speed: 20.0", "lane: 2}\n    speed: 0.0")
    stands = stands.replace("speed: 20.0", "speed: 25.0")
    hardest, plain = {}, HEAD
    for grade, rise in (("0 %", 0.0), ("-6 %", -0.06), ("0.06", 0.06)):
        head = plain.replace("motorway}", f"motorway, grade: {grade}}}")
        monkeypatch.setitem(globals(), "HEAD", head)
        pipeline = made(stands)
        rollout = pipeline.rollout(pipeline.space.row({"other_at": 90.0})[np.newaxis])
        hardest[grade] = -rollout.a[0, 0].min()
        there_and_back(pipeline)
        concrete = pipeline.runner.concrete(pipeline.space.row({}), "roads.xodr")
        assert concrete.roads.roads[0].elevations[0].b == rise
    angle = np.arctan(0.06)
    assert hardest["0 %"] == pytest.approx(GRIP)
    assert hardest["-6 %"] == pytest.approx(GRIP * np.cos(angle) - GRAVITY * np.sin(angle))
    assert hardest["0.06"] == pytest.approx(GRIP)  # uphill more would do, but it asks for no more


def test_indicating(made):
    """It shows from its event on, is in the files, and the ego makes room for a change of lane."""
    participants = PARTICIPANTS.replace("lane: 1}\n    speed: 20.0", "lane: 1}\n    speed: 15.0")
    events = """
  shows:
    participant: other
    indicate: right
    when:
      - {kind: time, value: 1.0}
  no_more:
    participant: other
    indicate: off
    when:
      - {kind: time, value: 5.0}
"""
    pipeline, silent = made(participants, events), made(participants)
    x = pipeline.space.row({})[np.newaxis]
    rollout = pipeline.rollout(x)
    shown = rollout.lamps[0, 1] & lamps.HAZARD
    assert np.flatnonzero(shown).tolist() == list(range(20, 100))
    assert (shown[20:100] == lamps.RIGHT).all()
    ego, free = rollout.v[0, 0], silent.rollout(x).v[0, 0]
    assert np.array_equal(ego[:20], free[:20])
    assert ego[100] < free[100] - 1.0
    there_and_back(pipeline)
    assert str(pipeline.runner.concrete(x[0], "roads.xodr").storyboard.file_header.rev_minor) == "3"
    said = " ".join(story_lines(pipeline.scenario))
    approve(said, "indicates", "indicating")


def test_who_has_no_indicators_does_not_indicate(made):
    event = """
  shows:
    participant: other
    indicate: left
    when:
      - {kind: time, value: 1.0}
"""
    participants = PARTICIPANTS.replace("other:\n    type: car", "other:\n    type: bicycle")
    with refuses(ScenarioError):
        made(participants.replace("lane: 1}\n    speed: 20.0", "lane: 1}\n    speed: 5.0"), event)


@pytest.mark.parametrize("message", EVENTS)
def test_what_cannot_happen_is_refused(made, message):
    event = f"""
  acts:
    participant: other
    {EVENTS[message]}
    when:
      - {{kind: time, value: 1.0}}
"""
    with pytest.raises(ScenarioError, match=message):
        made(events=event)


def test_a_reason_lets_pedestrians_leave_the_crosswalk_and_nothing_else(made, tmp_path):
    """Crossing, walking along the lane, and standing on it; the reason is in all files."""
    walker = PARTICIPANTS + (
        "  walker:\n    type: pedestrian\n    speed: 1.0\n"
        "    path: [{distance: 300.0, offset: -3.0}, {distance: 320.0, offset: 4.0}]\n"
    )
    with refuses(ScenarioError):
        made(walker)
    lifted = "type: pedestrian\n    off_crosswalk: \"<b>$late</b> & 'tired'\""
    pipeline = made(walker.replace("type: pedestrian", lifted))
    assert motion(pipeline)["walker"]["v"][0] == 1.0
    there_and_back(pipeline)
    files = write_scenario(pipeline, pipeline.space.row({}), tmp_path, "one")
    assert [problem for file in files for problem in validate_file(file)] == []
    assert all("late" in file.read_text("utf-8") for file in files if file.suffix != ".xodr")
    standing = (
        PARTICIPANTS + "  walker:\n    type: pedestrian\n    start: {distance: 300.0, lane: 1}\n"
    )
    with refuses(ScenarioError):
        made(standing)
    made(standing.replace("type: pedestrian", lifted))
    with refuses(ScenarioError):
        made(PARTICIPANTS + "    off_crosswalk: a car\n")
