"""The junctions of a map: which of them a scenario fits, and that what fits can be searched."""

import json
from dataclasses import replace
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest

import bridgegen as bg
from bridgegen.campaign import Run
from bridgegen.campaign.junctions import junctions_of
from bridgegen.campaign.restored import searched
from bridgegen.campaign.validate import validate_file
from bridgegen.errors import InputError, StorageError, UnsupportedError
from bridgegen.odd.parameters import Axis
from bridgegen.odd.reader import load
from bridgegen.ontology.individuals import build_static
from bridgegen.openx.on_map import on_map, searchable
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.opendrive.write import to_xml
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


def town(crossroads: Path, where: str = "all") -> Pipeline:
    scenario = load("crossroads-s4")
    roads = searchable(scenario, load_map(crossroads, where, scenario))
    there = on_map(scenario, roads)
    return Pipeline(there, there.space(), road_map=roads)


def test_all_junctions_are_one_search_space(crossroads: Path) -> None:
    """Each row is what it is where its junction is searched alone, to the last bit."""
    pipeline = town(crossroads)
    space, (_, roads) = pipeline.space, (None, load_map(crossroads, "all", load("crossroads-s4")))
    assert space.variables[0] == "junction"
    X = space.decode(np.random.default_rng(1).random((40, space.n_var)))
    where = X[:, space.index("junction")].astype(int)
    assert set(where) == {0, 1, 2, 3}
    rollout = pipeline.rollout(X)
    assert not rollout.messages
    for number, site in enumerate(roads.sites):
        scenario = load("crossroads-s4")
        there = on_map(scenario, roads.at(site))
        alone = Pipeline(there, there.space(), road_map=roads.at(site))
        rows = np.flatnonzero(where == number)
        own = np.array(
            [
                alone.space.row({n: X[i, space.index(n)] for n in alone.space.variables})
                for i in rows
            ]
        )
        other = alone.rollout(own)
        for name in ("x", "y", "h", "v", "n_steps"):
            np.testing.assert_array_equal(getattr(rollout, name)[rows], getattr(other, name))


def test_what_a_town_s_search_exports_keeps_its_constraints(
    crossroads: Path, tmp_path: Path
) -> None:
    run = bg.run_search(
        "crossroads-s4", budget=300, algorithm="random", road_map=crossroads, junction="all",
        out=tmp_path / "run",
    )  # fmt: skip
    assert run.settings.junction == "all"
    words = {
        json.loads(path.read_text())["parameters"]["junction"]["value"]
        for path in sorted((run.folder / "critical").glob("0*.json"))
    }
    assert len(words) > 1
    for path in sorted((run.folder / "critical").glob("*.owl")):
        assert validate_file(path) == []
    again, _, roads = searched(Run(run.folder))
    assert roads is not None
    assert len(roads.sites) == 4
    assert "junction" in again.parameters


def test_junctions_that_are_too_small_are_left_out(crossroads: Path) -> None:
    scenario = load("crossroads-s4")
    roads = load_map(crossroads, "all", scenario)
    tight = replace(
        roads.sites[1],
        legs=tuple(
            replace(leg, roads=(replace(leg.roads[0], length=6.0), *leg.roads[1:]))
            for leg in roads.sites[1].legs
        ),
    )
    small = replace(roads, sites=(roads.sites[0], tight, *roads.sites[2:]))
    left = searchable(scenario, small)
    assert left.sites == (roads.sites[0], *roads.sites[2:])
    (warning,) = [one for one in left.warnings if "left out" in one]
    assert "leaves no value to bv_start" in warning
    alone = searchable(scenario, replace(roads, sites=(roads.sites[0], tight)))
    assert (alone.site, alone.sites) == (roads.sites[0], ())
    with pytest.raises(InputError, match="is left out"):
        searchable(scenario, replace(roads, sites=(tight, tight)))


def test_the_name_of_the_junction_is_taken(crossroads: Path) -> None:
    scenario = load("crossroads-s4")
    mine = replace(scenario.parameters["bv_start"], name="junction")
    scenario = replace(scenario, parameters=scenario.parameters | {"junction": mine})
    with pytest.raises(InputError, match="--junction all needs the name junction"):
        on_map(scenario, load_map(crossroads, "all", load("crossroads-s4")))


def test_a_scenario_that_fits_nowhere(crossroads: Path) -> None:
    crossroads.write_text(crossroads.read_text().replace('type="sidewalk"', 'type="none"'))
    with pytest.raises(UnsupportedError, match="fits no junction"):
        load_map(crossroads, "all", load("pedestrian-at-night"))
