"""Tags of exported scenarios: terms of ASAM OpenLABEL's ontology, and what they say of a row."""

import json
import os
import re
from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.errors import StorageError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.simulate import simulate_file
from bridgegen.jobs.search.export import export_beside
from bridgegen.jobs.search.openlabel import openlabel
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.openx.openscenario.read import read
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.odd.states import states_of, table

_NAMES = """
Communication: SignalEmergency SignalHazard SignalLeft SignalRight SignalSlowing
Motion: Accelerate Decelerate Drive LaneChangeLeft LaneChangeRight Reverse Run Stop TurnLeft
Motion: TurnRight UTurn Walk
Edge: LineMarkers ShoulderPavedOrGravel
LaneSpecification: Dimensions LaneCount Marking
Signs: Regulatory Warning
SurfaceCondition: StandingWater Wet
RoadType: Motorway Slip
SubjectVehicle: Speed
Traffic: SpecialVehicle
Illumination: Cloudiness
Particulates: Water
Weather: Rain Wind
Horizontal: Curves Straights
Longitudinal: DownSlope LevelPlane UpSlope
Transverse: Divided Pavements Undivided
Day: SunElevation
LowLight: Ambient Night
Intersection: Crossroad TJunction
Roundabout: Compact Large Mini Normal
TravelDirection: Left Right
LaneType: Emergency Traffic
RoadUser: Animal
Human: Cyclist Motorcyclist Pedestrian
Vehicle: Bus Car Cycle Emergency Motorcycle Truck
SpecialStructure: PedestrianCrossing
TemporaryStructure: RoadWorks
"""
TERMS = {
    prefix + suffix
    for prefix, _, suffixes in (line.partition(": ") for line in _NAMES.split("\n"))
    for suffix in suffixes.split()
}
"""Terms of openlabel_ontology_scenario_tags.ttl without narrower ones among them: a name is that of
the broader term and a suffix."""

PROPERTIES = {
    "scenarioName", "scenarioDescription", "scenarioDefinition", "scenarioUniqueReference",
}  # fmt: skip
WHOLE = {"LaneSpecificationLaneCount", "SubjectVehicleSpeed"}  # xsd:positiveInteger and the like


def default(name):
    """A scenario that ships, what it states, and the values of its row of defaults."""
    scenario = load(name)
    space = scenario.space()
    return scenario, states_of(scenario), space.values(space.row({}))


@pytest.fixture(scope="module", params=["crosses-on-red", "cyclist-right-turn"])
def tagged(request, tmp_path_factory):
    """A file of tags, parsed; the folder; and the simulation."""
    folder = tmp_path_factory.mktemp(request.param)
    pipeline = Pipeline(load(request.param), load(request.param).space())
    xosc = write_scenario(pipeline, pipeline.space.row({}), folder, "one")[2]
    result = simulate_file(xosc)
    _, states, row = default(request.param)
    return json.loads(openlabel("one", read(xosc), states, row, result.rollout)), folder, result


@pytest.mark.parametrize("name", names())
def test_each_scenario_that_ships_has_tags_of_the_ontology_only(name):
    _, states, row = default(name)
    tags = states.tags(row)
    assert {*table().tags} <= TERMS
    held = {tag for tag, value in tags.items() if value is not False}
    # Each states its roads, weather and the ego's speed; of what excludes each other, one at most.
    assert "SubjectVehicleSpeed" in held
    for one in ("TravelDirection", "Longitudinal", "Horizontal", "Roundabout"):
        assert sum(tag.startswith(one) for tag in held) <= 1
    assert sum(tag in held for tag in ("DaySunElevation", "LowLightAmbient", "LowLightNight")) < 2


@pytest.mark.parametrize(
    ("name", "there", "not_there"),
    [
        ("cut-in", "RoadTypeMotorway", "IntersectionCrossroad"),
        ("crossroads-s4", "IntersectionCrossroad", "RoadTypeMotorway"),
        ("crosses-on-red", "SpecialStructurePedestrianCrossing", "LaneTypeEmergency"),
        ("roundabout-entry", "RoundaboutNormal", "TravelDirectionLeft"),
        ("road-works", "TemporaryStructureRoadWorks", "RoundaboutMini"),
    ],
)
def test_the_roads_are_those_of_the_scenario(name, there, not_there):
    _, states, row = default(name)
    tags = states.tags(row)
    assert tags[there] is not False
    assert tags[not_there] is False


def test_numbers_are_in_the_units_of_the_ontology():
    _, states, row = default("cut-in")
    row |= {"ego_speed": 30.0, "fog_density": 50.0, "precipitation": 0.0, "cloudiness": 50.0}
    row |= {"sun_altitude_angle": 30.0, "wind_intensity": 100.0}
    tags = states.tags(row)
    assert tags["SubjectVehicleSpeed"] == pytest.approx(108.0)  # km/h
    assert tags["IlluminationCloudiness"] == pytest.approx(4.0)  # okta
    assert tags["DaySunElevation"] == pytest.approx(30.0)  # degrees
    assert tags["ParticulatesWater"] == pytest.approx(10_000 / 200**0.5)  # m, optical range
    assert tags["WeatherWind"] == pytest.approx(20.0)  # m/s
    assert (tags["WeatherRain"], tags["LowLightNight"]) == (False, False)


def test_a_file_has_what_the_schema_asks(tagged):
    """Facts of openlabel_json_schema.json, and of chapter 8.2 of the standard."""
    data, folder, _ = tagged
    assert [*data] == ["openlabel"]
    content = data["openlabel"]
    assert content["metadata"]["schema_version"] == "1.0.0"
    assert (folder / content["metadata"]["tagged_file"]).is_file()
    (uid, ontology), *_ = content["ontologies"].items()
    boundary = ontology["boundary_list"]
    assert ontology["boundary_mode"] == "include"
    kinds = [tag["type"] for tag in content["tags"].values()]
    assert len({*kinds}) == len(kinds)  # none is repeated
    assert {*kinds} - {*boundary} == PROPERTIES  # which are never part of a boundary
    assert {*boundary} <= TERMS
    for number, tag in content["tags"].items():
        assert re.fullmatch("[0-9]+", number)
        assert tag["ontology_uid"] == uid
        for kind, entries in tag.get("tag_data", {}).items():
            (entry,) = entries
            assert isinstance(entry["val"], str if kind == "text" else int | float)
            assert entry["type"] in ({"value"} if kind == "text" else {"value", "min", "max"})
        if tag["type"] in WHOLE:
            assert isinstance(tag["tag_data"]["num"][0]["val"], int)


def test_road_users_do_what_they_did(tagged):
    data, _, result = tagged
    rollout, n = result.rollout, int(result.rollout.n_steps[0])
    tags = {tag["type"]: tag for tag in data["openlabel"]["tags"].values()}
    assert "VehicleCar" in tags
    assert ("HumanCyclist" in tags) == ("VehicleCycle" in tags) == (4 in rollout.kinds)
    assert ("HumanPedestrian" in tags) == (5 in rollout.kinds)
    assert ("MotionWalk" in tags) == ("HumanPedestrian" in tags)
    slowest = rollout.a[0, :, :n].min()
    if slowest < -0.5:
        most = tags["MotionDecelerate"]["tag_data"]["num"][0]
        assert most["val"] == pytest.approx(-slowest, abs=1e-6)
    assert ("MotionDecelerate" in tags) == (slowest < -0.5)


def test_asams_own_schema_and_ontology_agree(tagged):
    folder = os.environ.get("BRIDGEGEN_OPENLABEL")
    if not folder:
        pytest.skip("BRIDGEGEN_OPENLABEL, a folder with ASAM's two files, is not set")
    import jsonschema
    import rdflib

    data, *_ = tagged
    schema = json.loads((Path(folder) / "openlabel_json_schema.json").read_bytes())
    jsonschema.Draft7Validator(schema).validate(data)
    graph = rdflib.Graph().parse(Path(folder) / "openlabel_ontology_scenario_tags.ttl")
    known = {str(term).rpartition("/")[2] for term in graph.subjects(rdflib.RDF.type)}
    assert known >= TERMS | PROPERTIES
    broader = {
        str(child).rpartition("/")[2]: str(parent).rpartition("/")[2]
        for child, parent in graph.subject_objects(rdflib.RDFS.subClassOf)
    }
    for term in TERMS:
        while term := broader.get(term):
            assert term not in TERMS  # no tag is implied by another one


def test_files_of_a_run_and_alone(tmp_path, finished):
    written = export_beside(finished, "openlabel", scenarios=["0001"], out=tmp_path)
    alone = export_beside(finished / "critical/0001.xosc", "openlabel", out=tmp_path / "alone")
    assert [path.name for path in written] == ["0001.openlabel.json"]
    of_run, of_file = (
        {
            tag["type"]: tag.get("tag_data")
            for tag in json.loads(path.read_bytes())["openlabel"]["tags"].values()
        }
        for path in (*written, *alone)
    )
    # Of a file's map nothing is read; what both state is the same.
    common = (
        (of_run.keys() & of_file.keys()) - PROPERTIES - {"IlluminationCloudiness"}
    )  # whole oktas
    assert {"VehicleCar", "MotionDrive"} <= common
    assert {name: of_run[name] for name in common} == {name: of_file[name] for name in common}
    assert "RoadTypeMotorway" in of_run.keys() - of_file.keys()
    (finished / "critical/0001.json").write_text("{}")
    with refuses(StorageError, "0001.json"):
        export_beside(finished, "openlabel", scenarios=["0001"], out=tmp_path)


@pytest.fixture
def finished(tmp_path):
    from bridgegen.jobs.search.campaign import run_search

    return run_search(
        "cut-in", ego="route-follower", budget=40, seed=0, out=tmp_path / "run", causes=False
    ).folder
