"""A stranger's reading of our files: `carla.Map`, which needs no server.

CARLA is left-handed: its y is ours with the other sign, and so is its yaw.
"""

import math
from collections.abc import Callable, Iterator
from typing import Any

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.opendrive.lanes import lane_pose, section_end
from bridgegen.openx.opendrive.model import Header, Lane, LaneSection, OpenDrive, Road, Width
from bridgegen.openx.opendrive.plan_view import Arc, Cubic, Geometry, Line, Spiral
from bridgegen.openx.opendrive.site import find_site
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.scenario.ontology.individuals import build_static

from .kinds import FURNISHED, KINDS
from .kinds import model as kind

carla = pytest.importorskip("carla")


def load(model: OpenDrive) -> Any:
    return carla.Map("map", to_xml(model).decode())


def places(road: Road, count: int) -> Iterator[tuple[Lane, float]]:
    """Places all along every lane with a width."""
    for index, section in enumerate(road.sections):
        low, high = section.s, section_end(road, index)
        if high - low > 0.01:
            for lane in section.lanes:
                for k in range(count):
                    yield lane, low + (high - low) * (0.01 + 0.98 * k / (count - 1))


def compare(
    model: OpenDrive, theirs: Any, roads: list[Road], count: int = 5, kink: float = 0.01
) -> int:
    """Assert that both put every lane's centre at the same place; return how many were compared."""
    compared = 0
    for road in roads:
        for lane, s in places(road, count):
            waypoint = theirs.get_waypoint_xodr(int(road.id), lane.id, s)
            ours = lane_pose(road, lane.id, s)
            where = waypoint.transform
            # carla.Map draws curves as chords: 5 cm, in tight ones of drawn junctions 6 cm
            assert math.dist((where.location.x, -where.location.y), ours[:2]) < 0.08
            assert abs(math.remainder(-math.radians(where.rotation.yaw) - ours.h, math.tau)) < kink
            assert waypoint.lane_width == pytest.approx(ours.width, abs=0.01)
            compared += 1
    return compared


def check_branches(model: OpenDrive, theirs: Any, junction_id: str) -> int:
    """Each lane into the junction has exactly the branches that the junction declares."""
    junction = model.junction(junction_id)
    lanes = 0
    for road in model.roads:
        for end in road.ends_at(junction_id):
            for lane in road.section_at(end).lanes:
                if lane.type != "driving" or (road.direction(lane.id) > 0) != (end == "end"):
                    continue
                s = 0.3 if end == "start" else road.length - 0.3
                waypoint = theirs.get_waypoint_xodr(int(road.id), lane.id, s)
                ahead = {(other.road_id, other.lane_id) for other in waypoint.next(0.6)}
                declared = {
                    (int(connection.connecting_road), link.to_lane)
                    for connection in junction.connections
                    if connection.incoming_road == road.id
                    for link in connection.lane_links
                    if link.from_lane == lane.id
                }
                assert {other[0] for other in ahead} == {other[0] for other in declared}
                assert len(ahead) == len(declared)
                assert declared
                lanes += 1
    return lanes


def check(model: OpenDrive) -> int:
    theirs = load(model)
    junction_id = model.junctions[0].id
    assert compare(model, theirs, list(model.roads)) > 0
    return check_branches(model, theirs, junction_id)


def test_corners(corners: list[dict[str, float]], crossroads: Callable[..., OpenDrive]) -> None:
    for values in corners:
        lanes = check(crossroads(*values.values()))
        assert lanes == 4 * values["lanes_per_direction"]


@given(data=st.data())
@settings(max_examples=20)
def test_any_crossroads(
    data: st.DataObject, static: Any, crossroads: Callable[..., OpenDrive]
) -> None:
    values = data.draw(static)
    assert check(crossroads(*values.values())) == 4 * values["lanes_per_direction"]


@given(data=st.data())
@settings(max_examples=20)
def test_any_four_legs(data: st.DataObject, sites: Any) -> None:
    place = data.draw(sites)
    lanes = sum(len(leg.roads[0].along("in")) for leg in place.legs)
    assert check(opendrive_from_owl(build_static(place))) == lanes


@pytest.mark.parametrize("name", [*KINDS, "furnished"])
def test_every_kind(name: str) -> None:
    model = opendrive_from_owl(build_static(FURNISHED)) if name == "furnished" else kind(name)
    theirs = load(model)
    assert compare(model, theirs, list(model.roads)) > 0
    for junction in model.junctions:
        assert check_branches(model, theirs, junction.id) > 0


def test_town05(town05_path: Any, town05: OpenDrive) -> None:
    """Their reading of the original file: every lane of junction 965 and its arms."""
    theirs = carla.Map("Town05", town05_path.read_text())
    site = find_site(town05, map_name=town05_path.name)
    arms = [town05.road(road.road_id) for leg in site.legs for road in leg.roads]
    ways = list(town05.connecting_roads(site.place_id))
    assert (len(arms), len(ways)) == (6, 12)
    assert compare(town05, theirs, arms + ways) > 500
    assert check_branches(town05, theirs, site.place_id) == 8


def test_town05_as_we_write_it(town05: OpenDrive) -> None:
    theirs = load(town05)
    assert compare(town05, theirs, [town05.road(name) for name in ("0", "17", "1010")]) > 0
    assert check_branches(town05, theirs, "965") == 8


def test_every_lane_of_town05(town05_path: Any, town05: OpenDrive) -> None:
    theirs = carla.Map("Town05", town05_path.read_text())
    assert compare(town05, theirs, list(town05.roads), count=3) > 5_000


def test_spirals_arcs_and_tapers() -> None:
    from bridgegen.openx.opendrive.geometry import pose

    shapes = (
        (Line(), 20.0),
        (Spiral(0.0, 0.02), 40.0),
        (Arc(0.02), 30.0),
        (Spiral(0.02, -0.01), 50.0),
    )
    geometries: list[Geometry] = []
    s, x, y, h = 0.0, 5.0, -3.0, 0.4
    for shape, length in shapes:
        geometries.append(Geometry(s, x, y, h, length, shape))
        x, y, h, _ = pose(geometries[-1], length)
        s += length
    taper = (
        Width(0.0, 3.0, 0.0, 0.0, 0.0),
        Width(50.0, 3.0, 0.0, 0.0075, -2.5e-4),
        Width(70.0, 4.0, 0.0, 0.0, 0.0),
    )
    lanes = {
        side: tuple(
            Lane(sign * k, "driving", widths=taper) for k in ((2, 1) if sign > 0 else (1, 2))
        )
        for side, sign in (("left", 1), ("right", -1))
    }
    road = Road(
        "1",
        s,
        plan_view=tuple(geometries),
        elevations=(Cubic(0.0, 0.0, 0.0, 0.0, 0.0),),
        lane_offsets=(Cubic(0.0, 0.0, 0.0, 0.0, 0.0), Cubic(80.0, 0.0, 0.0, 0.003, -5e-5)),
        sections=(LaneSection(0.0, center=(Lane(0),), **lanes),),
    )
    model = OpenDrive(Header(1, 7), (road,))
    # CARLA takes a taper's angle as atan(dt/ds), as if lanes were as long as the road in a bend.
    assert compare(model, load(model), [road], count=40, kink=0.02) == 160
