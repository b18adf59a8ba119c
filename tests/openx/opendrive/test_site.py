"""Finding an intersection: Town05's 965 against the specification's table, and every refusal."""

import dataclasses
import itertools
import math
from collections.abc import Callable
from typing import Any

import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.errors import InputError, UnsupportedError
from bridgegen.ontology.individuals import build_static
from bridgegen.ontology.site import Site
from bridgegen.ontology.templates import crossroads
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import Junction, LaneSection, OpenDrive, Road
from bridgegen.openx.opendrive.site import find_site

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
    assert (site.name, site.map_file, site.junction_id) == ("Town05", "Town05.xodr", "965")
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
            assert [lane.width for lane in road.lanes] == [3.5] * 4
            assert [lane.direction for lane in road.lanes] == ["in", "in", "out", "out"]
            assert [abs(lane.lane_id) for lane in road.lanes] == [1, 2, 1, 2]
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
    assert "another has 13 such, one of them must be named: 53 (4 legs)" in problem
    assert "965 (4 legs)" in problem
    assert "1260 (3 legs)" in problem


def test_no_such_junction(town05: OpenDrive) -> None:
    with pytest.raises(
        InputError, match="junction '1' is not in the road network; it has 53, 139,"
    ):
        find_site(town05, "1")


def test_three_legs(town05: OpenDrive) -> None:
    with pytest.raises(UnsupportedError, match=r"224 .* 4 legs .* got 3 \(roads 19, 20, 48\)"):
        find_site(town05, "224")


def test_no_junction_at_all(crossroads: Callable[..., OpenDrive]) -> None:
    empty = dataclasses.replace(crossroads(), junctions=())
    with pytest.raises(UnsupportedError, match="crossroads has none such: none"):
        find_site(empty)


def test_several_junctions_that_all_will_not_do(town05: OpenDrive) -> None:
    few = tuple(one for one in town05.junctions if one.id in ("224", "905"))
    roads = tuple(one for one in town05.roads if one.junction in ("-1", "224", "905"))
    with pytest.raises(UnsupportedError, match=r"none such: 224 \(3 legs\), 905 \(3 legs\)"):
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
    with pytest.raises(UnsupportedError, match="on road 2 they do; 2 lane sections"):
        find_site(with_road(model, changed))


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


def test_one_way_roads_are_no_legs(crossroads: Callable[..., OpenDrive]) -> None:
    model = crossroads()
    road = model.road("2")
    section = dataclasses.replace(road.sections[0], left=())
    with pytest.raises(UnsupportedError, match=r"got 3 \(roads 1, 3, 4\)"):
        find_site(with_road(model, dataclasses.replace(road, sections=(section,))))


def test_junction_that_is_known_must_be_there(crossroads: Callable[..., OpenDrive]) -> None:
    """A map called Town05 that is not CARLA's: its only junction will do."""
    model = crossroads()
    assert find_site(model, map_name="maps/Town05.xodr").junction_id == "100"
    two = dataclasses.replace(model, junctions=(*model.junctions, Junction("7")))
    assert find_site(two, map_name="Town05.xodr").junction_id == "100"
