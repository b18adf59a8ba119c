"""Every kind of participant, from a scenario file to the picture; no kind is named in the tests."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.metrics.perception import CLASSES
from bridgegen.base.errors import ScenarioError
from bridgegen.drivers.kinds import MISSED, NAMES, SEEN_BY
from bridgegen.engine.pipeline import Pipeline
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import kind_of
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.read import read
from bridgegen.openx.openscenario.scenario_runner.blueprints import SIZES
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.write import VERSIONS, to_version, to_xml
from bridgegen.pages.sketch import sketch
from bridgegen.scenario.language.json_schema import schema
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import from_bytes, to_bytes
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.vocabulary import tbox
from bridgegen.scenario.participants import (
    OBJECT_CLASSES,
    PARTICIPANTS,
    QUEUES,
    TYPE_NAMES,
    TYPES,
    canonical,
)

ALL = list(PARTICIPANTS.values())
FILE = """
scenario: kinds
title: One of a kind on the road ahead
description: It is there.
source: ours
template: road
roads: {{lanes: 2, length: 400.0, speed_limit: 13.9, road_type: town, sidewalk_width: 2.5,
  crosswalk_at: 120.0}}
driver: reference
duration: 8.0
time_step: 0.05
axes: [participants]
participants:
  ego:
    type: {ego}
    start: {{lane: 1, distance: 60.0}}
    end: {{lane: 1, distance: 380.0}}
    speed: ego_speed
{others}
parameters:
  ego_speed: {{axis: participants, unit: m/s, low: 4.0, high: 5.0, default: 5.0,
    description: Speed of the ego., source: ours}}
include: [weather]
"""
DRIVES = """  other:
    type: {name}
    start: {{lane: 1, distance: 100.0}}
    speed: 4.0"""
CROSSES = """  other:
    type: {name}
    path: [{{way: out, lane: sidewalk, distance: 120.0}}, {{way: in, lane: sidewalk,
      distance: 120.0}}]
    speed: 1.0"""
STANDS = """  other:
    type: {name}
    start: {{lane: 1, distance: 90.0}}"""
WORKS = """  other:
    type: car
    start: {lane: 1, distance: 200.0}
    speed: 4.0
road_works:
  works:
    start: {lane: 2, distance: 100.0}
    length: 20.0
    taper: 10.0
    sign_before: 20.0"""
BY_CONDUCT = {
    "vehicle": DRIVES,
    "bicycle": DRIVES,
    "pedestrian": CROSSES,
    "animal": CROSSES,
    "obstacle": STANDS,
}


def text_of(name, ego="car"):
    kind = PARTICIPANTS[canonical(name)]
    if not kind.takes_part:
        return FILE.format(ego=ego, others=WORKS)
    return FILE.format(ego=ego, others=BY_CONDUCT[kind.seen_as.conduct].format(name=name))


@pytest.fixture(scope="module", params=ALL, ids=lambda one: one.name)
def kind(request):
    return request.param


@pytest.fixture(scope="module")
def scenario(kind, tmp_path_factory):
    path = tmp_path_factory.mktemp("kinds") / "kind.yaml"
    path.write_text(text_of(kind.name), "utf-8")
    return load(path)


@pytest.fixture(scope="module")
def pipeline(scenario):
    return Pipeline(scenario, scenario.space())


@pytest.fixture(scope="module")
def rollout(pipeline):
    return pipeline.rollout(pipeline.space.row({})[np.newaxis])


@pytest.fixture(scope="module")
def entity(kind, rollout):
    """Its number among the entities: of road works, of the first that is such a thing."""
    names = list(rollout.names)
    if kind.takes_part:
        return names.index("other")
    return next(e for e, name in enumerate(names) if kind.name in name)


def test_its_entry_is_complete(kind):
    assert kind.seen_as in OBJECT_CLASSES
    assert kind.seen_as.detection_class in CLASSES
    assert kind.seen_as.mistaken_for in NAMES
    assert min(kind.body.length, kind.body.width, kind.body.height, kind.body.mass) > 0.0
    assert tbox().kinds[kind.owl_class] == "Class"
    assert {*kind.carla} <= SIZES.keys()
    assert kind.seen_as.carla
    enum = {
        "Vehicle": osc.VehicleCategory,
        "Pedestrian": osc.PedestrianCategory,
        "MiscObject": osc.MiscObjectCategory,
    }[kind.written.element]
    assert kind.written.category in list(enum)


def test_all_are_told_apart():
    assert len({one.owl_class for one in ALL}) == len(ALL)
    said = [
        (one.written.element, one.written.category, one.written.role, one.written.name)
        for one in ALL
    ]
    assert len({*said}) == len(ALL)
    assert len({*TYPE_NAMES}) == len(TYPE_NAMES)
    assert len({one.name for one in OBJECT_CLASSES}) == len(OBJECT_CLASSES)
    assert [one.mistaken_for for one in OBJECT_CLASSES if one.mistaken_for == one.name] == []


def test_codes_that_files_hold_stay():
    """Recordings of detections and detectors of others have these numbers."""
    assert NAMES[:8] == (
        "car", "truck", "bus", "motorcycle", "bicycle", "pedestrian", "animal", "other",
    )  # fmt: skip


def test_the_schema_of_files_lists_them():
    sections = schema()["definitions"]
    assert sections["ParticipantSection"]["properties"]["type"]["enum"] == list(TYPE_NAMES)
    vehicles = sections["JamSection"]["properties"]["vehicles"]
    assert vehicles["items"]["enum"] == list(QUEUES)


@pytest.mark.parametrize("name", sorted({*TYPE_NAMES} - {*TYPES}))
def test_another_name_means_the_same(name, tmp_path):
    (tmp_path / "kind.yaml").write_text(text_of(name), "utf-8")
    assert load(tmp_path / "kind.yaml").participants[1].type == canonical(name) != name


@pytest.mark.parametrize("version", VERSIONS)
def test_it_comes_back_from_openscenario(kind, scenario, entity, rollout, version, tmp_path):
    individuals = build(
        scenario, scenario.space().values(scenario.space().row({})), driver="reference"
    )
    individuals = from_bytes(to_bytes(individuals))
    assert check(individuals, scenario) == []
    roads = opendrive_from_owl(individuals)
    made = openscenario_from_owl(individuals, "road.xodr")
    path = tmp_path / "made.xosc"
    path.write_bytes(to_xml(to_version(made, version, "made")))
    again = read(path)
    one = again.entities.scenario_objects[entity]
    assert kind_of(one.entity_object) is kind
    back, lost = individuals_from_openscenario(again, roads, "road.xodr", "")
    assert lost == []
    assert one.name in {back.text(node, "has_name") for node in back.of_class(kind.owl_class)}
    rewritten = openscenario_from_owl(back, "road.xodr").entities.scenario_objects[entity]
    assert rewritten == made.entities.scenario_objects[entity]


def test_it_is_simulated(kind, pipeline, rollout, entity):
    assert rollout.status.tolist() == [0]
    assert NAMES[rollout.kinds[entity]] == kind.seen_as.name
    body = kind.body
    assert rollout.box[entity].tolist() == [body.length, body.width, body.center_ahead]
    assert plausibility(rollout).reason(0) == ""
    moves = kind.seen_as.conduct != "obstacle"
    assert (rollout.v[0, entity].max() > 0.9) == moves


def test_it_is_perceived(rollout, entity):
    assert (rollout.detections[0, entity, :, SEEN_BY] > MISSED).any()


def test_a_collision_with_it_is_analysed(kind, rollout, entity):
    """The ego's box is put onto it: severity is 0 only where no person is in either."""
    x, y, h, v = (getattr(rollout, name).copy() for name in "xyhv")
    time = rollout.time_step * np.arange(x.shape[2])
    h[0, 0] = h[0, entity] = 0.0
    x[0, entity], y[0, entity], v[0, entity] = 0.0, 0.0, 0.0
    x[0, 0], y[0, 0], v[0, 0] = -40.0 + 10.0 * time, 0.0, 10.0
    found = analyse(replace(rollout, x=x, y=y, h=h, v=v))
    assert found.severity[0, entity] > 0.0


def test_it_is_drawn(kind, pipeline, rollout, entity):
    assert pipeline.runner.source.bodies({})[rollout.names[entity]] == kind.name
    label = f">{rollout.names[entity]}</text>"
    assert (label if kind.takes_part else 'fill="#d9480f"') in sketch(pipeline.runner)


@pytest.mark.parametrize("name", [one.name for one in ALL if one.on_rails])
def test_what_runs_on_rails_is_not_steered(name, tmp_path):
    (tmp_path / "kind.yaml").write_text(text_of("car", ego=name), "utf-8")
    with refuses(ScenarioError, name):
        load(tmp_path / "kind.yaml")
    changing = text_of(name) + (
        "events:\n  moves:\n    participant: other\n    lane_change: {lanes: -1, time: 3.0}\n"
        "    when: [{kind: time, value: 1.0}]\n"
    )
    (tmp_path / "kind.yaml").write_text(changing, "utf-8")
    with refuses(ScenarioError):
        load(tmp_path / "kind.yaml")
