"""The junctions of a map: which of them a scenario fits, and that what fits can be searched."""

from pathlib import Path
from xml.etree import ElementTree

import pytest

from bridgegen.campaign.junctions import junctions_of
from bridgegen.errors import InputError, StorageError, UnsupportedError
from bridgegen.odd.parameters import Axis
from bridgegen.odd.reader import load
from bridgegen.ontology.individuals import build_static
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.openx.source import on_map
from bridgegen.pipeline import Pipeline
from bridgegen.report.map_picture import write_map_picture

TOWN05 = Path(__file__).parents[3] / "shared" / "data" / "Town05.xodr"

needs_town05 = pytest.mark.skipif(not TOWN05.exists(), reason="needs Town05.xodr")


@pytest.fixture
def crossroads(tmp_path: Path) -> Path:
    """Return the map of crossroads-s4, as if it came from elsewhere."""
    scenario = load("crossroads-s4")
    values = {
        name: one.default for name, one in scenario.parameters.items() if one.axis is Axis.STATIC
    }
    path = tmp_path / "crossroads.xodr"
    path.write_bytes(to_xml(opendrive_from_owl(build_static(values, scenario.roads))))
    return path


def test_a_symmetric_crossroads_fits_at_four_rotations(crossroads: Path) -> None:
    (one,), _, _ = junctions_of(crossroads, load("crossroads-s4"))
    assert (one.rotations, one.lights, one.lacks) == (4, 0, "")
    assert len(one.legs) == 4


def test_lanes_that_are_missing_are_named(crossroads: Path) -> None:
    text = crossroads.read_text().replace('type="sidewalk"', 'type="none"')
    crossroads.write_text(text)
    (one,), _, _ = junctions_of(crossroads, load("pedestrian-at-night"))
    assert one.rotations == 0
    assert "sidewalk" in one.lacks


@needs_town05
def test_what_is_said_to_fit_can_be_simulated() -> None:
    scenario = load("crossroads-s4")
    found, model, _ = junctions_of(TOWN05, scenario)
    assert [one.id for one in found] == [junction.id for junction in model.junctions]
    fits = {one.id: one for one in found if one.rotations}
    assert "965" in fits
    assert fits["965"].placed.startswith("A = road 18, ")  # as the paper's figure has it
    for one in fits:
        roads = load_map(TOWN05, one, scenario)
        there = on_map(scenario, roads)
        pipeline = Pipeline(there, there.space(), road_map=roads)
        rollout = pipeline.rollout(pipeline.space.row({})[None])
        assert not rollout.messages
    rest = [one for one in found if not one.rotations]
    assert rest
    assert all(one.lacks for one in rest)


@needs_town05
def test_three_legs_are_not_four() -> None:
    found, _, _ = junctions_of(TOWN05, load("left-across-path"))
    (three,) = [one for one in found if one.id == "224"]
    assert (three.rotations, three.lacks) == (0, "3 legs; the scenario has 4")
    assert sorted(three.legs) == ["19", "20", "48"]


@needs_town05
def test_no_intersection() -> None:
    with pytest.raises(UnsupportedError, match="cut-in takes place on the template road"):
        junctions_of(TOWN05, load("cut-in"))


@needs_town05
def test_the_picture_marks_each_junction(tmp_path: Path) -> None:
    found, model, _ = junctions_of(TOWN05)
    path = tmp_path / "town.svg"
    write_map_picture(path, model, {"965"})
    root = ElementTree.parse(path).getroot()
    space = "{http://www.w3.org/2000/svg}"
    names = {one.text for one in root.iter(f"{space}text")}
    assert {one.id for one in found if one.legs} <= names
    assert len([one for one in root.iter(f"{space}ellipse") if one.get("class") == "fits"]) == 1
    with pytest.raises(StorageError, match="exists already"):
        write_map_picture(path, model, None)
    with pytest.raises(InputError, match=r"must end in \.svg"):
        write_map_picture(tmp_path / "town.png", model, None)
