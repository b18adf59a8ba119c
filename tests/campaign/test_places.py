"""The places of a map: which of them a scenario fits, and that what fits can be searched."""

import json
import re
from dataclasses import replace
from functools import cache
from pathlib import Path
from xml.etree import ElementTree

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import BridgeGenError, InputError, StorageError, UnsupportedError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.search import Run
from bridgegen.jobs.search.places import PlaceFit, places_of
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.validate import validate_file
from bridgegen.openx.on_map import on_map, searchable
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.rings import rings
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.pages.map_picture import write_map_picture
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.individuals import build_static

TOWN05 = Path(__file__).parents[3] / "shared" / "data" / "Town05.xodr"


@cache
def places_of_town05(name: str | None = None) -> tuple[list[PlaceFit], OpenDrive, list[str]]:
    """Return the places of Town05; with a scenario's name, whether it fits them."""
    return places_of(TOWN05, load(name) if name else None)


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
    (one,), _, _ = places_of(crossroads, load("crossroads-s4"))
    assert (one.rotations, one.size, one.lacks) == (4, "4 legs, 0 lights", "")
    assert len(one.legs) == 4


def test_lanes_that_are_missing_are_named(crossroads: Path) -> None:
    text = crossroads.read_text().replace('type="sidewalk"', 'type="none"')
    crossroads.write_text(text)
    (one,), _, _ = places_of(crossroads, load("pedestrian-at-night"))
    assert one.rotations == 0
    assert "sidewalk" in one.lacks


@needs_town05
def test_what_is_said_to_fit_can_be_simulated() -> None:
    scenario = load("crossroads-s4")
    found, model, _ = places_of_town05("crossroads-s4")
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
    found, _, _ = places_of_town05("left-across-path")
    (three,) = [one for one in found if one.id == "224"]
    assert (three.rotations, three.lacks) == (0, "3 legs; the scenario has 4")
    assert sorted(three.legs) == ["19", "20", "48"]


@needs_town05
def test_the_picture_marks_each_junction(tmp_path: Path) -> None:
    found, model, _ = places_of_town05()
    path = tmp_path / "town.svg"
    write_map_picture(path, model, {"965"})
    root = ElementTree.parse(path).getroot()
    space = "{http://www.w3.org/2000/svg}"
    names = {one.text for one in root.iter(f"{space}text")}
    assert {one.id for one in found if one.legs and one.kind == "junction"} <= names
    assert len([one for one in root.iter(f"{space}ellipse") if one.get("class") == "fits"]) == 1
    with pytest.raises(StorageError, match="exists already"):
        write_map_picture(path, model, None)
    with refuses(InputError):
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
    assert space.variables[0] == "place"
    X = space.decode(np.random.default_rng(1).random((40, space.n_var)))
    where = X[:, space.index("place")].astype(int)
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


@pytest.mark.thorough
def test_what_a_town_s_search_exports_keeps_its_constraints(
    crossroads: Path, tmp_path: Path
) -> None:
    run = bg.run_search(
        "crossroads-s4", budget=300, algorithm="random", road_map=crossroads, junction="all",
        triage="short", out=tmp_path / "run",
    )  # fmt: skip
    assert run.settings.junction == "all"
    words = {
        json.loads(path.read_text())["parameters"]["place"]["value"]
        for path in sorted((run.folder / "critical").glob("0*.json"))
    }
    assert len(words) > 1
    for path in sorted((run.folder / "critical").glob("*.owl")):
        assert validate_file(path) == []
    again, _, roads = searched(Run(run.folder))
    assert roads is not None
    assert len(roads.sites) == 4
    assert "place" in again.parameters


def test_all_junctions_need_their_axis(crossroads: Path, tmp_path: Path) -> None:
    with refuses(InputError, "--place"):
        bg.run_search(
            "crossroads-s4", budget=10, axes=["weather"], road_map=crossroads, junction="all",
            triage="none", out=tmp_path / "run",
        )  # fmt: skip


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
    approve(warning, "bv_start")
    alone = searchable(scenario, replace(roads, sites=(roads.sites[0], tight)))
    assert (alone.site, alone.sites) == (roads.sites[0], ())
    with refuses(InputError):
        searchable(scenario, replace(roads, sites=(tight, tight)))


def test_the_name_of_the_junction_is_taken(crossroads: Path) -> None:
    scenario = load("crossroads-s4")
    mine = replace(scenario.parameters["bv_start"], name="place")
    scenario = replace(scenario, parameters=scenario.parameters | {"place": mine})
    with refuses(InputError, "--place"):
        on_map(scenario, load_map(crossroads, "all", load("crossroads-s4")))


def test_a_scenario_that_fits_nowhere(crossroads: Path) -> None:
    crossroads.write_text(crossroads.read_text().replace('type="sidewalk"', 'type="none"'))
    with refuses(UnsupportedError):
        load_map(crossroads, "all", load("pedestrian-at-night"))


ROADS = ("cut-in", "lead-brakes", "stopped-after-curve", "bus-pulls-out", "road-works")


@pytest.mark.parametrize("name", [*ROADS, "roundabout-entry", "motorway-merge"])
def test_on_a_map_of_its_own_a_scenario_is_what_it_is_at_home(name: str, tmp_path: Path) -> None:
    """The map is its own road, or roundabout, as if it came from elsewhere."""
    scenario = load(name)
    home = Pipeline(scenario, scenario.space())
    row = home.space.row({})
    path = tmp_path / "road.xodr"
    path.write_bytes(to_xml(home.runner.concrete(row).roads))
    place = "1" if name in ROADS else None
    roads = searchable(scenario, load_map(path, place, scenario))
    there = on_map(scenario, roads)
    away = Pipeline(there, there.space(), road_map=roads)
    one, other = home.rollout(row[None]), away.rollout(away.space.row({})[None])
    assert not other.messages
    np.testing.assert_allclose(other.x, one.x, atol=1e-6)
    np.testing.assert_allclose(other.y, one.y, atol=1e-6)


@needs_town05
@pytest.mark.parametrize("name", ROADS)
def test_what_is_said_to_fit_of_a_road_can_be_simulated(name: str) -> None:
    scenario = load(name)
    found, _, _ = places_of_town05(name)
    fits = [one.id for one in found if one.rotations]
    assert fits
    for place in (fits[0], fits[-1]):
        roads = searchable(scenario, load_map(TOWN05, place, scenario))
        there = on_map(scenario, roads)
        pipeline = Pipeline(there, there.space(), road_map=roads)
        rows = pipeline.space.decode(np.random.default_rng(3).random((20, pipeline.space.n_var)))
        rollout = pipeline.rollout(rows)
        assert not rollout.messages
        start, towards = rollout.x[:, 0, 0], rollout.x[:, 0, 5]
        leg = roads.site.legs[0]
        way = np.cos(np.radians(leg.heading_deg))
        assert (np.sign(towards - start) == np.sign(way)).all() or abs(way) < 0.7


@needs_town05
def test_the_best_stretch_and_all_of_them(tmp_path: Path) -> None:
    """A row of a search of all roads is, to the last bit, that of a search of its road."""
    scenario = load("lead-brakes")
    best = searchable(scenario, load_map(TOWN05, "best", scenario))
    assert best.site.place_id in {
        one.id for one in places_of_town05("lead-brakes")[0] if one.rotations
    }
    roads = searchable(scenario, load_map(TOWN05, "all", scenario))
    *left_out, more = roads.warnings
    assert [" is left out: " in one for one in left_out] == [True] * 3
    assert re.match(r"\d+ more places are left out", more)
    there = on_map(scenario, roads)
    pipeline = Pipeline(there, there.space(), road_map=roads)
    rows = pipeline.space.decode(np.random.default_rng(5).random((30, pipeline.space.n_var)))
    together = pipeline.rollout(rows)
    index = pipeline.space.index("place")
    number = int(np.bincount(rows[:, index].astype(int)).argmax())
    alone = roads.at(roads.sites[number])
    here = on_map(scenario, alone)
    single = Pipeline(here, here.space(), road_map=alone)
    at = np.flatnonzero(rows[:, index] == number)
    names = [single.space.names.index(name) for name in single.space.names]
    columns = [pipeline.space.index(name) for name in single.space.names]
    same = single.space.decode(np.zeros((len(at), single.space.n_var)))
    same[:, names] = rows[np.ix_(at, columns)]
    found = single.rollout(same)
    np.testing.assert_array_equal(found.x, together.x[at])
    np.testing.assert_array_equal(found.v, together.v[at])


def test_a_roundabout_is_found_by_its_ring(tmp_path: Path) -> None:
    """Of four legs, once; it can be turned four times, and is drawn with what touches it."""
    scenario = load("roundabout-entry")
    home = Pipeline(scenario, scenario.space())
    path = tmp_path / "ring.xodr"
    path.write_bytes(to_xml(home.runner.concrete(home.space.row({})).roads))
    found, model, _ = places_of(path)
    (ring,) = [one for one in found if one.kind == "roundabout"]
    assert (ring.id, ring.size) == ("100+101+102+103", "4 legs, 8 roads around")
    assert sorted(ring.legs) == ["1", "2", "3", "4"]
    ((fit,), _, _) = places_of(path, scenario)
    assert (fit.rotations, fit.lacks) == (4, "")
    turned = replace(
        model,
        roads=tuple(replace(road, rule="LHT") for road in model.roads),
    )
    assert list(rings(turned)) == []  # traffic would drive around the wrong way


def test_a_merge_is_found_by_its_ramp(tmp_path: Path) -> None:
    scenario = load("motorway-merge")
    home = Pipeline(scenario, scenario.space())
    path = tmp_path / "merge.xodr"
    path.write_bytes(to_xml(home.runner.concrete(home.space.row({})).roads))
    (fit,), _, _ = places_of(path, scenario)
    assert (fit.id, fit.kind, fit.lacks) == ("100", "merge", "")
    approve(fit.size, "260 m")
    knobs = dict(scenario.roads.knobs) | {"merge_length": 50.0, "taper_length": 20.0}
    short = replace(scenario, roads=replace(scenario.roads, knobs=knobs))
    made = Pipeline(short, short.space())
    other = tmp_path / "short.xodr"
    other.write_bytes(to_xml(made.runner.concrete(made.space.row({})).roads))
    (late,), _, _ = places_of(other, scenario)
    approve(late.lacks, "150 m", "130")
    for name, text in (("crossroads-s4", "junction"), ("cut-in", "named")):
        wanted = load(name)
        with refuses(BridgeGenError, text):
            load_map(path, "best" if name == "crossroads-s4" else "x", wanted)
