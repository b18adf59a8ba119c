"""A whole map as individuals: they say what the model says, and are what the ontology asks for."""

import sys
from collections import Counter
from collections.abc import Callable, Mapping
from pathlib import Path
from typing import Any

import pyoxigraph as ox
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import approve

from bridgegen.base.errors import StorageError
from bridgegen.cli import main
from bridgegen.jobs.search.validate import validate_file
from bridgegen.openx.convert import import_file
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.model import Lane, OpenDrive, Road
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.to_owl import individuals_from_opendrive
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import from_bytes, load, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.vocabulary import BG, tbox

FURNISHED = b"""<OpenDRIVE><header revMajor="1" revMinor="7"/>
<road id="a:b" name="High Street" length="20" junction="-1"><type s="0" type="town">
<speed max="36" unit="km/h"/></type>
<planView><geometry s="0" x="5" y="7" hdg="0" length="20"><line/></geometry></planView>
<lanes><laneSection s="0"><left><lane id="1" type="sidewalk"><width sOffset="0" a="2" b="0" c="0"
d="0"/></lane></left><center><lane id="0"/></center><right><lane id="-1" type="driving">
<width sOffset="0" a="0" b="0.2" c="0" d="0"/></lane><lane id="-2" type="shoulder">
<width sOffset="0" a="1" b="0" c="0" d="0"/></lane><lane id="-3" type="parking">
<width sOffset="0" a="2.5" b="0" c="0" d="0"/></lane></right></laneSection></lanes>
<objects><object id="9" type="crosswalk" s="4" t="0"/><object id="8" type="pole" s="4" t="3"/>
</objects><signals><signal id="1" s="10" t="-6" dynamic="yes" orientation="+" type="1000001"/>
<signal id="2" s="12" t="-6" dynamic="no" orientation="+" type="206"/></signals></road>
</OpenDRIVE>"""


def lanes_said(individuals: Individuals) -> Counter[tuple[Any, ...]]:
    return Counter(
        (
            individuals.text(road, "has_road_id"),
            individuals.number(lane, "has_section_start"),
            individuals.integer(lane, "has_lane_id"),
            individuals.text(lane, "has_lane_type"),
            individuals.number(lane, "has_start_width"),
            individuals.optional_text(lane, "has_direction"),
        )
        for road in individuals.of_class("Road")
        for name in ("has_lane", "has_strip")
        for lane in individuals.links(road, name)
    )


def lanes_there(model: OpenDrive) -> Counter[tuple[Any, ...]]:
    """The same from the model; widths of Town05 and ours begin with the section."""
    return Counter(
        (
            road.id,
            section.s,
            lane.id,
            lane.type,
            lane.widths[0].a,
            way(model, road, lane),
        )
        for road in model.roads
        for section in road.sections
        for lane in section.lanes
    )


def way(model: OpenDrive, road: Road, lane: Lane) -> str:
    """Towards the road's junction or away from it; along the road, if it has none or two."""
    along = lane.id < 0
    start, end = (
        bool(link) and link.element_type == "junction"
        for link in (road.predecessor, road.successor)
    )
    if start != end:
        return "in" if along == end else "out"
    if not model.junctions:
        return "out" if along else "in"
    return "forward" if along else "backward"


def links_said(individuals: Individuals) -> Counter[tuple[Any, ...]]:
    def name(lane: Any) -> tuple[str, int]:
        (road,) = owners[lane]
        return individuals.text(road, "has_road_id"), individuals.integer(lane, "has_lane_id")

    owners: dict[Any, list[Any]] = {}
    for road in individuals.of_class("Road"):
        for kind in ("has_lane", "has_strip"):
            for lane in individuals.links(road, kind):
                owners.setdefault(lane, []).append(road)
    found: Counter[tuple[Any, ...]] = Counter()
    for junction in individuals.of_class("Intersection"):
        for way in individuals.links(junction, "has_connection"):
            for link in individuals.links(way, "has_lane_link"):
                left, entered = (individuals.link(link, n) for n in ("from_lane", "to_lane"))
                roads = tuple(
                    individuals.text(individuals.link(way, n), "has_road_id")
                    for n in ("has_incoming_road", "has_connecting_road")
                )
                assert roads == (name(left)[0], name(entered)[0])
                ids = individuals.text(junction, "has_junction_id"), *roads
                found[(*ids, name(left)[1], name(entered)[1])] += 1
    return found


def links_there(model: OpenDrive) -> Counter[tuple[Any, ...]]:
    return Counter(
        (junction.id, way.incoming_road, way.connecting_road, link.from_lane, link.to_lane)
        for junction in model.junctions
        for way in junction.connections
        for link in way.lane_links
    )


def roads_said(individuals: Individuals) -> dict[str, tuple[Any, ...]]:
    def ends(road: Any, name: str) -> tuple[str, str] | None:
        other = individuals.optional_link(road, name)
        if other is None:
            return None
        kind = "road" if individuals.is_a(other, "Road") else "junction"
        return kind, individuals.text(other, f"has_{kind}_id")

    return {
        individuals.text(road, "has_road_id"): (
            individuals.number(road, "has_length"),
            individuals.optional_text(road, "has_name"),
            ends(road, "has_predecessor"),
            ends(road, "has_successor"),
        )
        for road in individuals.of_class("Road")
    }


def roads_there(model: OpenDrive) -> dict[str, tuple[Any, ...]]:
    return {
        road.id: (
            road.length,
            road.name or None,
            *(
                link and (link.element_type, link.element_id)
                for link in (road.predecessor, road.successor)
            ),
        )
        for road in model.roads
    }


def says_the_same(individuals: Individuals, model: OpenDrive) -> None:
    assert roads_said(individuals) == roads_there(model)
    assert lanes_said(individuals) == lanes_there(model)
    assert links_said(individuals) == links_there(model)
    inner = {
        (individuals.text(junction, "has_junction_id"), individuals.text(road, "has_road_id"))
        for junction in individuals.of_class("Intersection")
        for road in individuals.links(junction, "has_inner_road")
    }
    assert inner == {(road.junction, road.id) for road in model.roads if road.is_connecting}
    junctions = individuals.of_class("Intersection")
    assert len(junctions) == len(model.junctions)
    ways = [way for j in junctions for way in individuals.links(j, "has_connection")]
    assert len(ways) == sum(len(junction.connections) for junction in model.junctions)


def test_town05_whole(town05: OpenDrive) -> None:
    individuals = individuals_from_opendrive(town05, "Town05.xodr")
    says_the_same(individuals, town05)
    assert len(individuals.of_class("Road")) == 259
    assert len(individuals.of_class("Intersection")) == 21
    again = from_bytes(to_bytes(individuals))
    assert set(again.quads) == set(individuals.quads)
    assert check(again) == []


def test_town05_s_known_junction(town05: OpenDrive) -> None:
    """The legs of 965 are those of the specification's table."""
    individuals = individuals_from_opendrive(town05, "Town05.xodr")
    (junction,) = (
        node
        for node in individuals.of_class("Intersection")
        if individuals.text(node, "has_junction_id") == "965"
    )
    legs = individuals.links(junction, "has_leg")
    assert {individuals.text(leg, "has_road_id") for leg in legs} == {"0", "1", "17", "18"}
    for leg in legs:
        if individuals.text(leg, "has_road_id") == "18":
            assert individuals.number(leg, "has_speed_limit") == pytest.approx(24.5872)  # 55 mph


@settings(max_examples=15)
@given(data=st.data())
def test_any_crossroads(static: st.SearchStrategy[Mapping[str, float]], data: Any) -> None:
    drawn = data.draw(static)
    made = build_static(drawn)
    model = opendrive_from_owl(made)
    individuals = individuals_from_opendrive(model, "crossroads.xodr")
    says_the_same(individuals, model)
    assert set(from_bytes(to_bytes(individuals)).quads) == set(individuals.quads)
    assert check(individuals) == []
    # Round trip: the legs that the map was made from are there again.
    intersection = individuals.one("Intersection")
    for leg in made.links(made.one("Intersection"), "has_leg"):
        (same,) = (
            road
            for road in individuals.links(intersection, "has_leg")
            if individuals.text(road, "has_road_id") == made.text(leg, "has_road_id")
        )
        for name in ("has_length", "has_speed_limit"):
            assert individuals.number(same, name) == pytest.approx(made.number(leg, name))
        assert individuals.text(same, "has_junction_end") == made.text(leg, "has_junction_end")
        widths = {
            which.integer(lane, "has_lane_id"): which.number(lane, "has_width")
            for which, road in ((made, leg), (individuals, same))
            for lane in which.links(road, "has_lane")
        }
        assert set(widths.values()) == {drawn["lane_width"]}


def test_what_stands_beside_a_road() -> None:
    individuals = individuals_from_opendrive(read(FURNISHED), "maps/furnished.xodr")
    assert check(individuals) == []
    road = individuals.one("Road")
    assert individuals.text(individuals.one("RoadNetwork"), "has_map_file") == "maps/furnished.xodr"
    assert individuals.text(road, "has_road_id") == "a:b"
    assert individuals.text(road, "has_name") == "High Street"
    assert individuals.number(road, "has_speed_limit") == pytest.approx(10.0)
    assert individuals.text(road, "has_junction_end") == "none"
    lane = individuals.one("Lane")
    assert individuals.number(lane, "has_start_width") == 0.0  # it opens
    assert individuals.number(lane, "has_width") == pytest.approx(2.0)  # 0.2 m per m, halfway
    for cls, lane_id in (("Sidewalk", 1), ("Shoulder", -2), ("RoadStrip", -3)):
        assert individuals.integer(individuals.one(cls), "has_lane_id") == lane_id
    crosswalk = individuals.one("Crosswalk")
    assert individuals.number(crosswalk, "has_s") == 4.0
    assert individuals.link(crosswalk, "on_road") == road
    light, sign = individuals.one("TrafficLight"), individuals.one("Signage")
    assert individuals.text(sign, "has_signal_type") == "206"
    # 10 m along a line from (5, 7) to the east, 6 m to its right
    assert individuals.number(light, "has_world_x") == pytest.approx(15.0)
    assert individuals.number(light, "has_world_y") == pytest.approx(1.0)


def test_terms_are_used_as_declared(crossroads: Callable[..., OpenDrive]) -> None:
    ontology = tbox()
    for model in (crossroads(), read(FURNISHED)):
        individuals = individuals_from_opendrive(model, "map.xodr")
        for subject, predicate, value, _ in individuals.quads:
            name = predicate.value.removeprefix(BG)
            if name == predicate.value:
                continue
            assert individuals.is_a(subject, ontology.domains[name]), name
            if isinstance(value, ox.Literal):
                assert value.datatype == ontology.ranges[name], name
            else:
                assert individuals.is_a(value, ontology.ranges[name].value.removeprefix(BG)), name


def run(monkeypatch: pytest.MonkeyPatch, *words: object) -> int:
    monkeypatch.setattr(sys, "argv", ["bridgegen", *map(str, words)])
    with pytest.raises(SystemExit) as end:
        main()
    return int(end.value.code or 0)


def test_the_command(
    crossroads: Callable[..., OpenDrive],
    tmp_path: Path,
    monkeypatch: pytest.MonkeyPatch,
    capsys: pytest.CaptureFixture[str],
) -> None:
    road_map = tmp_path / "map.xodr"
    road_map.write_bytes(to_xml(crossroads()))
    assert run(monkeypatch, "ontology", "import", road_map) == 0
    assert capsys.readouterr().out.strip() == str(tmp_path / "map.owl")
    assert run(monkeypatch, "validate", tmp_path / "map.owl") == 0
    assert "valid" in capsys.readouterr().out
    (tmp_path / "sub").mkdir()
    out = tmp_path / "sub" / "other.owl"
    assert run(monkeypatch, "ontology", "import", road_map, "--out", out) == 0
    network = load(out).one("RoadNetwork")
    assert load(out).text(network, "has_map_file") == "../map.xodr"


def test_the_command_refuses(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    road_map = tmp_path / "map.xodr"
    assert run(monkeypatch, "ontology", "import", road_map) == 2
    assert "cannot be read" in capsys.readouterr().err
    road_map.write_bytes(b"<OpenSCENARIO/>")
    assert run(monkeypatch, "ontology", "import", road_map) == 2
    err = capsys.readouterr().err
    assert err.count("\n") == 1
    approve(err, "OpenDRIVE")
    road_map.write_bytes(FURNISHED)
    assert run(monkeypatch, "ontology", "import", road_map, "--out", tmp_path / "no" / "x.owl") == 2
    assert "cannot be written" in capsys.readouterr().err
    (tmp_path / "map.owl").write_text("mine")
    assert run(monkeypatch, "ontology", "import", road_map) == 2
    assert "exists already" in capsys.readouterr().err
    assert (tmp_path / "map.owl").read_text() == "mine"
    with pytest.raises(StorageError):
        import_file(road_map)


def test_a_planted_violation_is_found(tmp_path: Path) -> None:
    road_map = tmp_path / "map.xodr"
    road_map.write_bytes(FURNISHED)
    owl, _ = import_file(road_map)
    text = owl.read_text("utf-8")
    assert ">town<" in text
    owl.write_text(text.replace(">town<", ">desert<"), "utf-8")
    (problem,) = validate_file(owl)
    assert "has_road_type" in problem
    assert "'desert'" in problem
