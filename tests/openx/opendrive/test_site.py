"""Finding an intersection: Town05's 965 against the specification's table, and every refusal."""

import dataclasses
import itertools
import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import Junction, LaneSection, OpenDrive, Road
from bridgegen.openx.opendrive.site import find_site
from bridgegen.openx.opendrive.site_adapted import adapted
from bridgegen.openx.opendrive.site_fit import missing, site_for
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.roads import LegSpec
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.scenario.ontology.site import Site
from bridgegen.scenario.ontology.templates import crossroads, site_of

from .kinds import KINDS
from .kinds import model as kind

# Leg, its roads, outward heading [deg], arm [m], in and out: the inner lane's (x, y) [m].
TABLE = [
    ("A", ["18", "40"], 271.1, 64, (-47.1, -13.3), (-50.6, -13.3)),
    ("B", ["1"], 180.1, 51, (-61.6, -2.7), (-61.6, 0.8)),
    ("C", ["17", "47"], 90.4, 66, (-51.0, 11.3), (-47.5, 11.3)),
    ("D", ["0"], 0.1, 55, (-37.0, 0.9), (-37.0, -2.6)),
]


def inner(model: OpenDrive, site: Site, leg: int, direction: Any) -> tuple[float, float]:
    road = site.legs[leg].roads[0]
    s = 0.0 if road.junction_end == "start" else road.length
    return lane_pose(model.road(road.road_id), road.along(direction)[0].lane_id, s)[:2]


def test_town05_is_the_table(town05: OpenDrive) -> None:
    site = find_site(town05, map_name="Town05.xodr")
    assert (site.name, site.map_file, site.place_id) == ("Town05", "Town05.xodr", "965")
    for k, (name, roads, heading, arm, into, out) in enumerate(TABLE):
        leg = site.legs[k]
        assert leg.name == name
        assert [road.road_id for road in leg.roads] == roads
        assert leg.heading_deg == pytest.approx(heading, abs=0.05)
        assert leg.length == pytest.approx(arm, abs=0.6)
        # The table has one decimal; the inner lane inbound is at C and D at s = length.
        assert math.dist(inner(town05, site, k, "in"), into) < 0.15
        assert math.dist(inner(town05, site, k, "out"), out) < 0.15
        for road in leg.roads:
            lanes = [*road.along("in"), *road.along("out")]
            assert [lane.width for lane in lanes] == [3.5] * 4
            assert [abs(lane.lane_id) for lane in lanes] == [1, 2, 1, 2]
            strips = [(one.type, one.direction) for one in road.strips]
            assert sorted(strips) == [
                (kind, way) for kind in ("shoulder", "sidewalk") for way in ("in", "out")
            ]
            assert road.speed_limit == pytest.approx(24.5872)  # 55 mph


def test_arms_of_town05_hang_together(town05: OpenDrive) -> None:
    """Each lane of a leg goes on, at the same place, on the next road outwards."""
    site = find_site(town05, "965")
    for leg in (site.legs[0], site.legs[2]):
        near, far = leg.roads
        for direction in ("in", "out"):
            for a, b in zip(near.along(direction), far.along(direction), strict=True):
                s = near.length if near.junction_end == "start" else 0.0
                t = 0.0 if far.junction_end == "start" else far.length
                one = lane_pose(town05.road(near.road_id), a.lane_id, s)
                other = lane_pose(town05.road(far.road_id), b.lane_id, t)
                assert math.dist(one[:2], other[:2]) < 0.01
                assert abs(math.remainder(one.h - other.h, math.tau)) < 1e-3


@given(data=st.data())
def test_generated_crossroads_is_found_again(data: st.DataObject, static: Any) -> None:
    wanted = crossroads(data.draw(static))
    found = find_site(opendrive_from_owl(build_static(wanted)), map_name="crossroads")
    assert found == dataclasses.replace(wanted, map_file="crossroads", size=None)


@given(data=st.data(), turn=st.floats(-180.0, 180.0))
def test_names_follow_the_compass(data: st.DataObject, static: Any, turn: float) -> None:
    """Turn the crossroads as you like: A is the leg nearest to the south, B to D clockwise."""
    straight = crossroads(data.draw(static))
    legs = tuple(
        dataclasses.replace(leg, heading_deg=math.remainder(leg.heading_deg + turn, 360.0))
        for leg in straight.legs
    )
    turned = dataclasses.replace(straight, legs=legs)
    found = find_site(opendrive_from_owl(build_static(turned)))
    headings = [leg.heading_deg for leg in found.legs]
    assert abs(math.remainder(headings[0] - 270.0, 360.0)) <= 45.0 + 1e-9
    for one, following in itertools.pairwise(headings):
        assert math.remainder(one - 90.0 - following, 360.0) == pytest.approx(0.0, abs=1e-9)


def test_several_and_none_is_named(town05: OpenDrive) -> None:
    with pytest.raises(InputError) as caught:
        find_site(town05, map_name="another.xodr")
    (problem,) = caught.value.problems
    approve(problem, "13", "53", "965", "1260")


def test_no_such_junction(town05: OpenDrive) -> None:
    with refuses(InputError, "53", "139"):
        find_site(town05, "1")


def test_three_legs(town05: OpenDrive) -> None:
    with refuses(UnsupportedError, "224", "19"):
        find_site(town05, "224")


def test_no_junction_at_all(crossroads: Callable[..., OpenDrive]) -> None:
    empty = dataclasses.replace(crossroads(), junctions=())
    with refuses(UnsupportedError):
        find_site(empty)


def test_several_junctions_that_all_will_not_do(town05: OpenDrive) -> None:
    few = tuple(one for one in town05.junctions if one.id in ("224", "905"))
    roads = tuple(one for one in town05.roads if one.junction in ("-1", "224", "905"))
    with refuses(UnsupportedError, "224", "905"):
        find_site(dataclasses.replace(town05, junctions=few, roads=roads))


def with_road(model: OpenDrive, road: Road) -> OpenDrive:
    roads = tuple(road if one.id == road.id else one for one in model.roads)
    return dataclasses.replace(model, roads=roads)


def test_lanes_that_change_along_a_leg(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.road("2")
    first = road.sections[0]
    narrower = LaneSection(30.0, left=first.left[1:], center=first.center, right=first.right)
    changed = dataclasses.replace(road, sections=(first, narrower))
    leg = next(
        leg for leg in find_site(with_road(model, changed)).legs if leg.roads[0].road_id == "2"
    )
    assert [(one.road_id, one.length) for one in leg.roads] == [("2", 30.0)]


def test_sections_with_the_same_lanes_are_one_leg(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.road("2")
    first = road.sections[0]

    def linked(name: str) -> LaneSection:
        sides = {
            side: tuple(
                dataclasses.replace(lane, **{name: (lane.id,)}) for lane in getattr(first, side)
            )
            for side in ("left", "right")
        }
        return dataclasses.replace(first, **sides)

    sections = (linked("successors"), dataclasses.replace(linked("predecessors"), s=30.0))
    found = find_site(with_road(model, dataclasses.replace(road, sections=sections)))
    assert found == find_site(model)


def test_one_way_roads_are_legs(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.road("2")
    section = dataclasses.replace(road.sections[0], left=())
    site = find_site(with_road(model, dataclasses.replace(road, sections=(section,))))
    road_b = site.legs[1].roads[0]
    assert (len(road_b.along("in")), len(road_b.along("out"))) == (0, 2)
    assert site.measures([])["lanes_per_direction"] == 2.0


def test_a_junction_without_lanes_has_no_legs(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.road("2")
    section = dataclasses.replace(road.sections[0], left=(), right=())
    with pytest.raises(UnsupportedError, match=r"got 3 \(roads 1, 3, 4\)"):
        find_site(with_road(model, dataclasses.replace(road, sections=(section,))))


def test_junction_that_is_known_must_be_there(crossroads: Callable[..., OpenDrive]) -> None:
    """A map called Town05 that is not CARLA's: its only junction will do."""
    model = crossroads()
    assert find_site(model, map_name="maps/Town05.xodr").place_id == "100"
    two = dataclasses.replace(model, junctions=(*model.junctions, Junction("7")))
    assert find_site(two, map_name="Town05.xodr").place_id == "100"


JUNCTIONS = ("signals", "turn-lanes", "t-junction", "skewed-t", "bend", "five")


@pytest.mark.parametrize("name", JUNCTIONS)
def test_two_to_five_legs_are_found_again(name: str) -> None:
    """With the scenario's own names, headings, and numbers and widths of lanes."""
    headings = {leg: one.heading for leg, one in KINDS[name].legs.items()}
    wanted = site_of(KINDS[name], {})
    found = find_site(kind(name), headings=headings)
    assert found.kind == wanted.kind
    for leg, same in zip(wanted.legs, found.legs, strict=True):
        assert (leg.name, leg.roads[0].road_id) == (same.name, same.roads[0].road_id)
        assert math.remainder(leg.heading_deg - same.heading_deg, 360.0) == pytest.approx(0.0)
        for way in ("in", "out"):
            lanes, others = leg.roads[0].along(way), same.roads[0].along(way)
            assert [(one.lane_id, one.width) for one in lanes] == [
                (one.lane_id, one.width) for one in others
            ]


@given(turn=st.floats(-180.0, 180.0), skew=st.floats(-20.0, 20.0))
@settings(max_examples=20)
def test_the_side_road_of_a_t_is_the_side_road(turn: float, skew: float) -> None:
    """However the junction is turned, for its legs are told by the angles between them."""
    headings = {"A": 270.0, "B": 180.0, "D": 0.0}
    angles = {n: h + turn + (skew if n == "A" else 0.0) for n, h in headings.items()}
    legs = {name: LegSpec(angle % 360.0) for name, angle in angles.items()}
    turned = dataclasses.replace(KINDS["skewed-t"], legs=legs)
    found = find_site(opendrive_from_owl(build_static({}, turned)), headings=headings)
    assert [(leg.name, leg.roads[0].road_id) for leg in found.legs] == [
        ("A", "1"), ("B", "2"), ("D", "3"),
    ]  # fmt: skip


def test_town05_has_t_junctions(town05: OpenDrive) -> None:
    """Junction 224: legs to the north, south and west; the side road leads west."""
    found = find_site(town05, "224", headings={"A": 270.0, "B": 180.0, "D": 0.0})
    assert found.kind == "TJunction"
    assert [(leg.name, leg.roads[0].road_id) for leg in found.legs] == [
        ("A", "48"), ("B", "19"), ("D", "20"),
    ]  # fmt: skip


def test_what_a_junction_lacks_is_one_error(town05: OpenDrive) -> None:
    with pytest.raises(UnsupportedError) as caught:
        site_for(load("red-light-runner"), town05, "685", "Town05.xodr")
    (problem,) = caught.value.problems
    approve(problem, "685", "red-light-runner")
    with refuses(InputError, "motorway-merge"):
        site_for(load("motorway-merge"), town05, "685", "Town05.xodr")
    with refuses(UnsupportedError):
        site_for(load("pedestrian-at-night"), town05, "965")


def unlit(name: str) -> LogicalScenario:
    """Return a scenario of the catalogue without its traffic lights."""
    scenario = load(name)
    assert isinstance(scenario, LogicalScenario)
    return dataclasses.replace(scenario, roads=dataclasses.replace(scenario.roads, signals="none"))


def test_the_rotation_at_which_a_scenario_fits(crossroads: Callable[..., OpenDrive]) -> None:
    """Without the way from A straight on, a scenario that needs it lies a quarter turn further."""
    model = crossroads()
    scenario = unlit("red-light-runner")
    site = site_for(scenario, model)
    start, end = (site.leg(name) for name in ("A", "C"))
    assert start is not None
    assert end is not None
    (junction,) = model.junctions
    beyond = {
        road.id for road in model.connecting_roads(junction.id)
        if {link.element_id for link in (road.predecessor, road.successor) if link}
        == {start.roads[0].road_id, end.roads[0].road_id}
    }  # fmt: skip
    blocked = dataclasses.replace(
        junction,
        connections=tuple(
            one for one in junction.connections
            if not (one.incoming_road == start.roads[0].road_id and one.entered_road in beyond)
        ),
    )  # fmt: skip
    turned = site_for(scenario, dataclasses.replace(model, junctions=(blocked,)))
    assert turned.legs[0].roads[0].road_id != start.roads[0].road_id
    assert {leg.roads[0].road_id for leg in turned.legs} == {
        leg.roads[0].road_id for leg in site.legs
    }
    in_order = [math.remainder(leg.heading_deg - turned.legs[0].heading_deg, 360.0) % 360.0
                for leg in turned.legs]  # fmt: skip
    assert in_order == pytest.approx([0.0, 270.0, 180.0, 90.0], abs=1e-6)  # clockwise, as A to D


def test_the_best_junction_of_a_town(town05: OpenDrive) -> None:
    best = site_for(unlit("red-light-runner"), town05, "best", "Town05.xodr")
    assert missing(unlit("red-light-runner"), town05, best) == []
    with refuses(UnsupportedError, "pedestrian-at-night"):
        site_for(load("pedestrian-at-night"), town05, "best", "Town05.xodr")


def test_a_route_that_ends_beyond_its_leg_is_shortened(town05: OpenDrive) -> None:
    scenario = load("crossroads-s4")
    site = site_for(scenario, town05, "965")
    leg = site.leg("D")
    assert leg is not None
    far = scenario.story.participants[0]
    assert far.end is not None
    far = dataclasses.replace(far, end=dataclasses.replace(far.end, distance=leg.length + 500.0))
    story = dataclasses.replace(
        scenario.story, participants=(far, *scenario.story.participants[1:])
    )
    beyond = dataclasses.replace(scenario, story=story)
    placed, (note,) = adapted(beyond, town05, site_for(beyond, town05, "965"))
    end = placed.story.participants[0].end
    assert end is not None
    assert end.distance == pytest.approx(leg.length - 1.0)
    approve(note, "route")
    assert adapted(scenario, town05, site) == (scenario, [])
