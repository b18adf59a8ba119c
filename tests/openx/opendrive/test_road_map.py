"""A map by its import: the same map, or one clear error."""

from dataclasses import replace
from pathlib import Path

import pytest
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.convert import import_file
from bridgegen.openx.opendrive.road_map import load_map
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.language.reader import load as load_scenario
from bridgegen.scenario.ontology.files import load, save
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import bg

from .kinds import individuals, model


@pytest.fixture
def road_map(tmp_path: Path) -> Path:
    path = tmp_path / "town" / "map.xodr"
    path.parent.mkdir()
    path.write_bytes(to_xml(model("signals")))
    return path


def test_an_import_is_its_map(road_map: Path, tmp_path: Path) -> None:
    (tmp_path / "owl").mkdir()
    owl, losses = import_file(road_map, tmp_path / "owl" / "other.owl")
    assert losses == []
    one, other = load_map(road_map), load_map(owl)
    assert (one.data, one.model, one.site) == (other.data, other.model, other.site)
    assert other.path.samefile(road_map)
    there = load_map(owl, scenario=load_scenario("crossroads-s4")).site
    assert replace(there, facilities=()) == one.site


def test_the_map_must_be_there(road_map: Path) -> None:
    owl, _ = import_file(road_map)
    road_map.rename(road_map.with_name("elsewhere.xodr"))
    with refuses(FileFormatError, "map.owl"):
        load_map(owl)


def test_the_map_must_be_what_it_was(road_map: Path) -> None:
    owl, _ = import_file(road_map)
    road_map.write_bytes(road_map.read_bytes() + b"\n")
    with refuses(FileFormatError):
        load_map(owl)


def test_what_is_no_import(road_map: Path, tmp_path: Path) -> None:
    owl, _ = import_file(road_map)
    silent = tmp_path / "silent.owl"
    digest = bg("has_map_digest")
    save(Individuals(q for q in load(owl).quads if q.predicate != digest), silent)
    with pytest.raises(FileFormatError, match="has_map_digest"):
        load_map(silent)
    for name, these in (("made", individuals("signals")), ("nothing", Individuals([]))):
        save(these, tmp_path / f"{name}.owl")
        with refuses(FileFormatError):
            load_map(tmp_path / f"{name}.owl")
    with refuses(FileFormatError):
        load_map(tmp_path / "nowhere.owl")
