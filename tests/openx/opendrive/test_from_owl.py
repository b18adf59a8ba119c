"""OWL2OpenDRIVE: the crossroads that individuals describe, and the ones that it refuses."""

import dataclasses
import math
from collections import Counter
from collections.abc import Callable
from pathlib import Path
from typing import Any, Literal

import pyoxigraph as ox
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import BridgeGenError, InputError, OntologyError
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.from_owl.arms import Ray, joining
from bridgegen.openx.opendrive.geometry import along_arc
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.plan_view import Arc, Line
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.validate import problems
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.ontology.files import load, save
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.site import ArmRoad, Leg, Site, SiteLane
from bridgegen.scenario.ontology.templates import crossroads
from bridgegen.scenario.ontology.vocabulary import bg

# From which leg's lane to which: the default crossroads has two lanes each way, A is south.
LEFT = {"A": "B", "B": "C", "C": "D", "D": "A"}
STRAIGHT = {"A": "C", "B": "D", "C": "A", "D": "B"}
RIGHT = {"A": "D", "B": "A", "C": "B", "D": "C"}

DEFAULT = {
    "lane_width": 3.5,
    "lanes_per_direction": 2,
    "arm_length": 60.0,
    "intersection_size": 26.0,
}


def leg(
    name: str,
    road_id: str,
    heading: float,
    inbound: tuple[float, ...],
    outbound: tuple[float, ...],
    end: Literal["start", "end"] = "start",
    length: float = 60.0,
) -> Leg:
    side = 1 if end == "start" else -1
    lanes = [SiteLane(side * k, "in", width) for k, width in enumerate(inbound, start=1)]
    lanes += [SiteLane(-side * k, "out", width) for k, width in enumerate(outbound, start=1)]
    return Leg(name, heading, (ArmRoad(road_id, length, end, tuple(lanes), 13.9),))


def site(*legs: Leg, size: float = 40.0, junction_id: str = "100") -> Site:
    return Site("crossing", None, junction_id, size, legs)


@given(data=st.data())
def test_any_four_legs(data: st.DataObject, sites: st.SearchStrategy[Site]) -> None:
    place = data.draw(sites)
    model = opendrive_from_owl(build_static(place))
    assert problems(model) == []
    assert read(to_xml(model)) == model
    junction = model.junction(place.place_id)
    ids = [road.id for road in model.roads]
    assert len({*ids, place.place_id}) == len(ids) + 1
    served = Counter(
        (link.incoming_road, link.lane_links[0].from_lane) for link in junction.connections
    )
    for arm in place.legs:
        (road,) = arm.roads
        made = model.road(road.road_id)
        assert made.length == road.length
        assert {lane.id: lane.widths[0].a for lane in made.sections[0].lanes} == {
            lane.lane_id: lane.width for lane in road.lanes
        }
        count = len(road.along("in"))
        for k, lane in enumerate(road.along("in")):
            onwards = served[road.road_id, lane.lane_id]
            assert onwards >= max(1, (k == 0) + (k == count - 1))  # left, right
    for connection in junction.connections:
        way = model.road(connection.connecting_road)
        curvatures = [one.shape.curvature for one in way.plan_view if isinstance(one.shape, Arc)]
        assert all(abs(curvature) <= 0.5 for curvature in curvatures)
        (link,) = connection.lane_links
        arm, onto = model.road(connection.incoming_road), way.successor
        assert onto is not None
        s = 0.0 if way.predecessor and way.predecessor.contact_point == "start" else arm.length
        start, end = lane_pose(arm, link.from_lane, s), lane_pose(way, -1, 0.0)
        assert end == pytest.approx(turned_like(start, end), abs=1e-9)
        target = model.road(onto.element_id)
        s = 0.0 if onto.contact_point == "start" else target.length
        start = lane_pose(way, -1, way.length)
        end = lane_pose(target, way.sections[0].lanes[0].successors[0], s)
        assert start == pytest.approx(turned_like(end, start), abs=2e-4)


def turned_like(one: Any, other: Any) -> tuple[float, ...]:
    """The pose with its heading moved by whole turns, to be next to another's."""
    turns = round((other.h - one.h) / math.tau)
    return (one.x, one.y, one.h + turns * math.tau, one.width)


def test_ways_across(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads(lanes=3, size=40.0)
    names = {road.id: road.name for road in model.roads}
    ways = {
        (
            names[connection.incoming_road],
            connection.lane_links[0].from_lane,
            names[model.road(connection.connecting_road).successor.element_id],  # type: ignore[union-attr]
            model.road(connection.connecting_road).sections[0].lanes[0].successors[0],
        )
        for connection in model.junctions[0].connections
    }
    expected = {(a, 1, LEFT[a], -1) for a in "ABCD"} | {(a, 3, RIGHT[a], -3) for a in "ABCD"}
    expected |= {(a, k, STRAIGHT[a], -k) for a in "ABCD" for k in (1, 2, 3)}
    assert ways == expected


def test_one_lane_goes_all_three_ways(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads(lanes=1, size=16.0)
    assert len(model.junctions[0].connections) == 12
    assert Counter(c.incoming_road for c in model.junctions[0].connections) == {
        "1": 3, "2": 3, "3": 3, "4": 3,
    }  # fmt: skip


def test_default_crossroads_by_hand(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()  # lanes of 3.5 m, 26 m from stop line to stop line, arms of 60 m
    south = model.road("1")
    assert south.name == "A"
    # Driving on the right, traffic northwards is on the east side: inner lane 1.75 m, outer 5.25.
    assert lane_pose(south, 1, 0.0)[:3] == pytest.approx((1.75, -13.0, math.pi / 2))
    assert lane_pose(south, 2, 60.0)[:2] == pytest.approx((5.25, -73.0))
    assert lane_pose(south, -1, 0.0)[:3] == pytest.approx((-1.75, -13.0, -math.pi / 2))
    by_name = {road.name: road for road in model.roads}
    straight = by_name["A1 straight C1"]
    assert [geometry.shape for geometry in straight.plan_view] == [Line()]
    assert straight.length == pytest.approx(26.0)
    # Left: from (1.75, -13) north to (-13, 1.75) west, a quarter circle of radius 14.75.
    left = by_name["A1 left B1"]
    assert left.length == pytest.approx(14.75 * math.pi / 2)
    assert [geometry.shape for geometry in left.plan_view] == [Arc(pytest.approx(1 / 14.75))]
    # Right: from (5.25, -13) north to (13, -5.25) east, radius 7.75.
    right = by_name["A2 right D2"]
    assert [geometry.shape for geometry in right.plan_view] == [Arc(pytest.approx(-1 / 7.75))]
    speed = left.types[0].speed
    assert speed is not None
    assert speed.metres_per_second == 13.9


def test_ids_collide_with_nothing() -> None:
    headings = {"A": 270.0, "B": 180.0, "C": 90.0, "D": 0.0}
    legs = [
        leg(name, road_id, headings[name], (3.5,), (3.5,))
        for name, road_id in zip("ABCD", ("7", "101", "500", "3"), strict=True)
    ]
    model = opendrive_from_owl(build_static(site(*legs)))
    ids = [road.id for road in model.roads]
    assert ids[:4] == ["7", "101", "500", "3"]
    assert all(int(each) > 500 for each in ids[4:])
    assert len(set(ids)) == len(ids) == 16


def test_legs_that_are_offset_are_joined_by_two_arcs() -> None:
    # Three lanes in face one lane out: the centre lines are the same, the lanes are not.
    legs = [
        leg("A", "1", 270.0, (3.0,), (3.0,)),
        leg("B", "2", 180.0, (3.5,), (3.5,)),
        leg("C", "3", 90.0, (3.5,), (4.0,)),
        leg("D", "4", 0.0, (3.5,), (3.5,)),
    ]
    model = opendrive_from_owl(build_static(site(*legs)))
    (way,) = [road for road in model.roads if road.name == "A1 straight C1"]
    first, second = way.plan_view
    # 40 m ahead and 0.5 m aside: mirror arcs with h² / (4·d) of radius, h² = 40² + 0.5².
    radius = (40.0**2 + 0.5**2) / (4 * 0.5)
    assert first.shape == Arc(pytest.approx(-1 / radius))
    assert second.shape == Arc(pytest.approx(1 / radius))
    lane = way.sections[0].lanes[0]
    assert lane.widths[0].a == 3.0
    assert lane.widths[0].a + lane.widths[0].b * way.length == pytest.approx(4.0)


def test_a_way_that_leads_less_than_a_millimetre_aside_is_straight() -> None:
    """Its arcs would have radii of 10,000 km, at which single precision errs by 0.4 m."""
    (line,) = joining(Ray(0.0, 0.0, 0.0), Ray(90.0, 2e-4, 0.0), "a way")
    assert line.shape == Line()
    assert len(joining(Ray(0.0, 0.0, 0.0), Ray(90.0, 2e-3, 0.0), "a way")) == 2


def test_more_lanes_in_than_there_are_opposite() -> None:
    legs = [
        leg("A", "1", 270.0, (3.5, 3.5, 3.5, 3.5), (3.5,)),
        leg("B", "2", 180.0, (), (3.5,)),
        leg("C", "3", 90.0, (3.5,), (3.5, 3.5)),
        leg("D", "4", 0.0, (3.5,), ()),
    ]
    model = opendrive_from_owl(build_static(site(*legs)))
    assert problems(model) == []
    assert [road.name for road in model.roads[4:]] == [
        "A1 left B1", "A1 straight C1", "A2 straight C2", "A3 straight C2", "A4 straight C2",
        "C1 straight A1", "C1 right B1", "D1 left A1", "D1 straight B1", "D1 right C2",
    ]  # fmt: skip


def test_saved_and_loaded_individuals_make_the_same_file(tmp_path: Path) -> None:
    path = tmp_path / "static.owl"
    save(build_static(DEFAULT), path)
    assert to_xml(opendrive_from_owl(load(path))) == to_xml(
        opendrive_from_owl(build_static(DEFAULT))
    )


# -- what is refused -----------------------------------------------------------------------------


def changed(node: str, name: str, value: Any) -> Individuals:
    """The default crossroads with one value replaced, or taken away (None)."""
    quads = []
    hit = False
    for quad in build_static(DEFAULT).quads:
        if quad.subject.value.endswith(f"#{node}") and quad.predicate == bg(name):
            hit = True
            if value is not None:
                quads.append(ox.Quad(quad.subject, quad.predicate, ox.Literal(value)))
        else:
            quads.append(quad)
    assert hit, f"{node} has no {name}"
    return Individuals(quads)


@pytest.mark.parametrize(
    ("node", "name", "value", "said"),
    [
        ("intersection", "has_size", 13.0, "has_size [m] must be ≥ 14, or legs"),
        ("intersection", "has_size", -1.0, "has_size [m] must be 1 … 1000, got -1"),
        ("intersection", "has_size", None, "must have has_size"),
        ("intersection", "has_junction_id", "1", "must differ from each other, got '1' 2 times"),
        ("intersection", "has_junction_id", "x", "be a whole number of up to 9 digits, got 'x'"),
        ("leg_A", "has_road_id", "2", "ids must differ from each other, got '2' 2 times"),
        ("leg_A", "has_road_id", "007", "must be a whole number of up to 9 digits, got '007'"),
        ("leg_A", "has_length", 0.0, "has_length [m] must be 1 … 10000, got 0"),
        ("leg_A", "has_heading", 180.0, "overlap"),
        ("leg_A", "has_heading", None, "must have has_heading"),
        ("leg_A", "has_heading", 1e9, "has_heading [deg] must be -360 … 360, got 1e+09"),
        ("leg_A", "has_speed_limit", 0.0, "has_speed_limit [m/s] must be 0.1 … 200, got 0"),
        ("leg_A", "has_lane_width", 3.2, "must be the leg's has_lane_width, 3.2, got 3.5"),
        ("leg_A", "has_inbound_lanes", 3, "has_inbound_lanes must be its number of lanes, 2"),
        ("leg_A", "has_junction_end", "middle", "has_junction_end must be start, end or none"),
        ("leg_A", "has_junction_end", "end", "has_lane_id must be < 0 for direction 'in'"),
        ("leg_A_in_1", "has_width", 0.1, "has_width [m] must be 0.5 … 20, got 0.1"),
        ("leg_A_in_1", "has_lane_id", 5, "lanes 'in' must be numbered from 1, got [2, 5]"),
        ("leg_A_in_1", "has_lane_id", 2, "lane 2: has_lane_id must be unique on its road"),
        ("leg_A_in_1", "has_lane_id", -1, "has_lane_id must be > 0 for direction 'in'"),
        ("leg_A_in_1", "has_direction", "both", "has_direction must be in or out, got 'both'"),
    ],
)  # fmt: skip
def test_contradictions(node: str, name: str, value: Any, said: str) -> None:
    with pytest.raises(OntologyError) as caught:
        opendrive_from_owl(changed(node, name, value))
    assert any(said in problem for problem in caught.value.problems), caught.value.problems


def test_all_problems_at_once() -> None:
    individuals = changed("leg_A", "has_length", -5.0)
    worse = [
        ox.Quad(quad.subject, quad.predicate, ox.Literal(99.0))
        if quad.predicate == bg("has_width") and quad.subject.value.endswith("#leg_C_out_2")
        else quad
        for quad in individuals.quads
        if not (quad.predicate == bg("has_heading") and quad.subject.value.endswith("#leg_D"))
    ]
    with pytest.raises(OntologyError) as caught:
        opendrive_from_owl(Individuals(worse))
    text = "\n".join(caught.value.problems)
    assert all(name in text for name in ("has_length", "has_width", "has_heading"))


def test_turn_that_no_car_can_drive() -> None:
    legs = [
        leg("A", "1", 270.0, (3.5,), (3.5,)),
        leg("B", "2", 180.0, (3.5,), (3.5,)),
        leg("C", "3", 20.0, (3.5,), (3.5,)),
        leg("D", "4", 0.0, (3.5,), (3.5,)),
    ]
    with refuses(OntologyError):
        opendrive_from_owl(build_static(site(*legs, size=41.0)))


def test_lane_that_leads_nowhere() -> None:
    legs = [
        leg("A", "1", 270.0, (3.5, 3.5), ()),
        leg("B", "2", 180.0, (), ()),
        leg("C", "3", 90.0, (), ()),
        leg("D", "4", 0.0, (), ()),
    ]
    with pytest.raises(OntologyError) as caught:
        opendrive_from_owl(build_static(site(*legs)))
    assert caught.value.problems == (
        "every lane in must lead across, but lane 1 of leg A has no leg to go to",
        "every lane in must lead across, but lane 2 of leg A has no leg to go to",
    )


@pytest.mark.parametrize("count", [1, 6])
def test_two_to_five_legs(count: int) -> None:
    legs = [leg("ABCDEF"[k], str(k + 1), 60.0 * k, (3.5,), (3.5,)) for k in range(count)]
    with refuses(OntologyError, count):
        opendrive_from_owl(build_static(site(*legs)))


def test_legs_too_close_together() -> None:
    legs = [leg(n, str(k + 1), h, (3.5,), (3.5,)) for k, (n, h) in
            enumerate((("A", 270.0), ("B", 230.0), ("D", 0.0)))]  # fmt: skip
    with refuses(OntologyError, "legs", "45"):
        opendrive_from_owl(build_static(site(*legs)))


def test_map_that_exists() -> None:
    place = dataclasses.replace(crossroads(DEFAULT), map_file="Town05.xodr")
    with refuses(InputError, "Town05.xodr"):
        opendrive_from_owl(build_static(place))


@given(st.data())
def test_any_value_gives_a_road_network_or_a_clear_error(data: st.DataObject) -> None:
    node, name = data.draw(
        st.sampled_from(
            [
                ("intersection", "has_size"),
                ("leg_B", "has_length"),
                ("leg_B", "has_heading"),
                ("leg_C_in_2", "has_width"),
                ("leg_C", "has_speed_limit"),
            ]
        )
    )
    value = data.draw(st.floats())
    try:
        model = opendrive_from_owl(changed(node, name, value))
    except BridgeGenError:
        return
    assert problems(model) == []
    assert read(to_xml(model)) == model


def test_a_slight_bend_whose_corner_is_next_to_its_end_is_wide():
    """One arc there would have half a metre of radius."""
    start, end = Ray(0.0, 0.0, 0.0), Ray(90.0, -0.005, -0.13)
    line = joining(start, end, "it")
    assert all(abs(one.shape.curvature) < 0.1 for one in line if isinstance(one.shape, Arc))
    last = line[-1]
    curvature = last.shape.curvature if isinstance(last.shape, Arc) else 0.0
    there = along_arc(last.x, last.y, last.hdg, curvature, last.length)
    assert there == pytest.approx(end, abs=1e-9)
