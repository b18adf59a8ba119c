"""Lanelet2 maps as roads: where their lanes lie, which way they lead, and what is refused."""

import math
from collections.abc import Iterable
from pathlib import Path

import numpy as np
import pytest
from lxml import etree
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.jobs.search.places import places_of
from bridgegen.openx.lanelet2 import strips
from bridgegen.openx.lanelet2.convert import lanelets_of
from bridgegen.openx.lanelet2.read import read_lanelets, transverse_mercator
from bridgegen.openx.opendrive.lanes import borders, lane_pose, points
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.opendrive.notes import Notes
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.road_map import map_bytes
from bridgegen.openx.opendrive.validate import problems

Line = list[tuple[float, float]]


def osm(
    ways: dict[int, Line], lanelets: Iterable[tuple[int, int, int, dict[str, str]]], more: str = ""
) -> str:
    """Return a map in local coordinates: ways by their ids; lanelets: id, left, right, tags.

    Points at one place are one node. Lanelets that name rules do so under the tag "rules".
    """
    nodes: dict[tuple[float, float], int] = {}
    text = ""
    for key, line in ways.items():
        refs = [nodes.setdefault(point, 1000 + len(nodes)) for point in line]
        text += f'<way id="{key}">' + "".join(f'<nd ref="{ref}"/>' for ref in refs)
        text += '<tag k="type" v="line_thin"/><tag k="subtype" v="solid"/></way>\n'
    for key, left, right, tags in lanelets:
        tags = {"type": "lanelet", "subtype": "road", **tags}
        rules = tags.pop("rules", "").split()
        text += f'<relation id="{key}"><member type="way" role="left" ref="{left}"/>'
        text += f'<member type="way" role="right" ref="{right}"/>'
        text += "".join(
            f'<member type="relation" role="regulatory_element" ref="{rule}"/>' for rule in rules
        )
        text += "".join(f'<tag k="{k}" v="{v}"/>' for k, v in tags.items()) + "</relation>\n"
    places = "".join(
        f'<node id="{ref}" lat="35.9" lon="139.9"><tag k="local_x" v="{x}"/>'
        f'<tag k="local_y" v="{y}"/><tag k="ele" v="2.5"/></node>\n'
        for (x, y), ref in nodes.items()
    )
    return f"<osm>\n{places}{text}{more}</osm>"


def straight(y: float, start: float = 10.0, end: float = 110.0) -> Line:
    return [(start, y), (end, y)]


TWO_WAY = {1: straight(3.5), 2: straight(0.0), 3: straight(-3.5), 4: straight(-7.0)}
"""Bounds of a road with a lane to the west, and two to the east."""
LANES = [
    (11, 2, 3, {"speed_limit": "50"}),
    (12, 3, 4, {"speed_limit": "30 mph"}),
    (13, 2, 1, {"one_way": "yes"}),
]


def model_of(tmp_path: Path, text: str) -> OpenDrive:
    path = tmp_path / "map.osm"
    path.write_text(text)
    return read(map_bytes(path), str(path))


def test_lanes_of_both_directions_that_share_bounds_are_one_road(tmp_path: Path) -> None:
    model = model_of(tmp_path, osm(TWO_WAY, LANES))
    (road,) = model.roads
    assert road.rule == "RHT"
    assert [lane.id for lane in road.sections[0].lanes] == [1, -1, -2]
    where = {key: (place[1], *place[2:]) for key, place in lanelets_of(model).items()}
    assert where == {
        "11": (-1, 0.0, 100.0, 100.0),
        "12": (-2, 0.0, 100.0, 100.0),
        "13": (1, 100.0, 0.0, 100.0),
    }
    for lane_id, y, h in ((1, 1.75, math.pi), (-1, -1.75, 0.0), (-2, -5.25, 0.0)):
        found = lane_pose(road, lane_id, 40.0)
        assert (found.x, found.y) == pytest.approx((50.0, y), abs=1e-6)
        assert math.cos(found.h - h) == pytest.approx(1.0)
    limits = [lane.speeds[0].max for lane in road.sections[0].right]
    assert limits == pytest.approx([50 / 3.6, 30 * 0.44704])
    assert road.elevations[0].a == pytest.approx(2.5)
    assert problems(model) == []


def test_oncoming_traffic_on_the_right_is_left_hand_traffic(tmp_path: Path) -> None:
    mirrored = {key: [(x, -y) for x, y in line] for key, line in TWO_WAY.items()}
    lanes = [(key, right, left, tags) for key, left, right, tags in LANES]
    (road,) = model_of(tmp_path, osm(mirrored, lanes)).roads
    assert road.rule == "LHT"
    assert lane_pose(road, 1, 40.0).y == pytest.approx(1.75)
    assert math.cos(lane_pose(road, 1, 40.0).h) == pytest.approx(1.0)


def arc(radius: float, turn: float, count: int) -> Line:
    angles = [-0.5 * math.pi + turn * k / count for k in range(count + 1)]
    return [(round(radius * math.cos(a), 6), round(radius * math.sin(a) + 50.0, 6)) for a in angles]


@pytest.mark.parametrize("radius", [6.0, 12.0, 80.0])
def test_the_centre_of_a_bend_lies_between_its_bounds(tmp_path: Path, radius: float) -> None:
    # By geometry: the chords of a circle's points lie within 1 - cos(turn / 2) of its radius.
    count = 60
    ways = {1: arc(radius - 1.75, 1.4, count), 2: arc(radius + 1.75, 1.4, count)}
    (road,) = model_of(tmp_path, osm(ways, [(11, 1, 2, {})])).roads
    s = np.linspace(0.0, road.length, 200)
    t = borders(road, 0, s)
    away = np.hypot(*(points(road, s, 0.5 * (t[0] + t[-1])) - (0.0, 50.0)).T)
    sagitta = radius * (1.0 - math.cos(0.5 * 1.4 / count))
    assert np.all(np.abs(away - radius) < 0.006 + sagitta)


@pytest.mark.parametrize(("turn", "noted"), [(1.4, False), (1.5 * math.tau, True)])
def test_a_lane_that_is_not_where_its_lanelet_is_is_noted(
    tmp_path: Path, turn: float, noted: bool
) -> None:
    path = tmp_path / "map.osm"
    path.write_text(osm({1: arc(4.0, turn, 60), 2: arc(7.5, turn, 60)}, [(11, 1, 2, {})]))
    notes: list[str] = []
    map_bytes(path, notes)
    assert any("lies up to" in note and "lanelet 11" in note for note in notes) is noted


def crossroads(**tags: str) -> str:
    """A way to the east and one to the north, each in three lanelets; the middle ones cross."""
    ways = {}
    for k, (start, end) in enumerate(((-50.0, -5.0), (-5.0, 5.0), (5.0, 60.0))):
        ways |= {2 * k + 1: [(start, 1.75), (end, 1.75)], 2 * k + 2: [(start, -1.75), (end, -1.75)]}
        ways |= {
            2 * k + 11: [(-1.75, start), (-1.75, end)],
            2 * k + 12: [(1.75, start), (1.75, end)],
        }
    ways |= {31: [(-6.0, 1.5), (-6.0, -1.5)], 32: [(-8.0, 4.0), (-8.0, 6.0)]}
    ways |= {41: [(20.0, -4.0), (20.0, 4.0)], 42: [(24.0, -4.0), (24.0, 4.0)]}
    lanes = [
        (101, 1, 2, {}), (102, 3, 4, {"rules": "201 202"}), (103, 5, 6, {}),
        (111, 11, 12, {}), (112, 13, 14, {"rules": "202"}), (113, 15, 16, {}),
        (121, 41, 42, {"subtype": "crosswalk"}),
    ]  # fmt: skip
    rules = """
<relation id="201"><member type="way" role="ref_line" ref="31"/>
<member type="way" role="refers" ref="32"/>
<tag k="type" v="regulatory_element"/><tag k="subtype" v="traffic_light"/></relation>
<relation id="202"><member type="relation" role="yield" ref="112"/>
<member type="relation" role="right_of_way" ref="102"/>
<tag k="type" v="regulatory_element"/><tag k="subtype" v="right_of_way"/></relation>
<relation id="203"><tag k="type" v="regulatory_element"/>
<tag k="subtype" v="detection_area"/></relation>"""
    return osm(ways, lanes, rules)


def test_lanelets_that_cross_are_a_junction(tmp_path: Path) -> None:
    model = model_of(tmp_path, crossroads())
    assert problems(model) == []
    (junction,) = model.junctions
    places = {key: place[0] for key, place in lanelets_of(model).items()}
    ways = {(link.incoming_road, link.connecting_road) for link in junction.connections}
    assert ways == {(places["101"], places["102"]), (places["111"], places["112"])}
    assert model.road(places["102"]).successor.element_id == places["103"]
    (priority,) = junction.priorities
    assert (priority.high, priority.low) == (places["102"], places["112"])
    found, _, _ = places_of(tmp_path / "map.osm")
    assert [place.kind for place in found if place.kind == "junction"] == ["junction"]


def test_lights_stop_lines_and_crosswalks_are_where_they_are_drawn(tmp_path: Path) -> None:
    model = model_of(tmp_path, crossroads())
    places = {key: place[0] for key, place in lanelets_of(model).items()}
    (light,) = model.road(places["102"]).signals
    assert (light.id, light.name, light.dynamic, light.orientation) == ("201", "32", "yes", "+")
    (line,) = model.road(places["101"]).objects
    assert (line.subtype, line.s) == ("stopLine", pytest.approx(44.0))
    (crosswalk,) = model.road(places["103"]).objects
    s, t = zip(*crosswalk.corners, strict=True)
    assert (min(s), max(s), min(t), max(t)) == pytest.approx((15.0, 19.0, -4.0, 4.0))


def test_what_is_not_represented_is_said(tmp_path: Path) -> None:
    path = tmp_path / "map.osm"
    path.write_text(crossroads())
    notes: list[str] = []
    map_bytes(path, notes)
    approve(notes, "203")


def test_where_a_lane_divides_the_roads_meet_directly(tmp_path: Path) -> None:
    ways = {
        1: [(0.0, 2.0), (50.0, 2.0)], 2: [(0.0, -2.0), (50.0, -2.0)],
        3: [(50.0, 2.0), (100.0, 2.0)], 4: [(50.0, -2.0), (100.0, -2.0)],
        5: [(50.0, 2.0), (75.0, 1.0), (100.0, -3.0)],
        6: [(50.0, -2.0), (75.0, -3.0), (99.0, -7.0)],
    }  # fmt: skip
    model = model_of(tmp_path, osm(ways, [(11, 1, 2, {}), (12, 3, 4, {}), (13, 5, 6, {})]))
    (junction,) = model.junctions
    assert junction.is_direct
    assert {link.entered_road for link in junction.connections} == {"2", "3"}
    assert problems(model) == []


@pytest.mark.parametrize(
    ("edit", "named"),
    [
        (lambda text: text.replace('<nd ref="1000"/>', '<nd ref="7"/>', 1), "7"),
        (lambda text: text.replace('v="2.5"', 'v="high"', 1), "high"),
        (lambda text: text.replace('v="road"', 'v="taxiway"', 1), "taxiway"),
        (lambda text: text.replace('role="left" ref="2"', 'role="left" ref="99"', 1), "99"),
        (lambda text: text.replace('<way id="3"', '<way id="2"', 1), "way"),
        (lambda text: text.replace("osm>", "map>"), "map"),
        (lambda text: "<!DOCTYPE osm>" + text, "DOCTYPE"),
        (lambda text: "<osm></osm>", "lanelet"),
    ],
)
def test_what_is_wrong_is_refused_with_its_place(edit, named: str, tmp_path: Path) -> None:
    with refuses(FileFormatError, named):
        model_of(tmp_path, edit(osm(TWO_WAY, LANES)))


def test_bounds_that_cross_are_refused(tmp_path: Path) -> None:
    ways = {1: straight(1.75), 2: [(10.0, -1.75), (60.0, 4.0), (110.0, -1.75)]}
    with refuses(FileFormatError, "lanelet 11", "must not cross"):
        model_of(tmp_path, osm(ways, [(11, 1, 2, {})]))


def test_a_bound_of_hundreds_of_kilometres_is_refused(tmp_path: Path) -> None:
    with refuses(FileFormatError, "lanelet 11", "20 km"):
        model_of(tmp_path, osm({1: straight(3.5, end=9e5), 2: straight(0.0)}, [(11, 1, 2, {})]))


def test_of_a_long_lane_only_arcs_nearby_are_looked_at(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    bend = [(20.0 * k, round(30.0 * math.sin(k / 7), 3)) for k in range(60)]
    text = osm({1: bend, 2: [(x, y - 3.5) for x, y in bend]}, [(11, 1, 2, {})])
    every = model_of(tmp_path, text)
    monkeypatch.setattr(strips, "MANY", 0)
    assert model_of(tmp_path, text) == every


def test_ways_may_be_drawn_in_any_direction(tmp_path: Path) -> None:
    as_drawn = model_of(tmp_path, osm(TWO_WAY, LANES))
    turned = model_of(tmp_path, osm({key: line[::-1] for key, line in TWO_WAY.items()}, LANES))
    for one, other in zip(as_drawn.roads, turned.roads, strict=True):
        a, b = lane_pose(one, -1, 50.0), lane_pose(other, -1, 50.0)
        assert (a.x, a.y) == pytest.approx((b.x, b.y))


def test_a_map_gives_the_same_bytes_again(tmp_path: Path) -> None:
    path = tmp_path / "map.osm"
    path.write_text(crossroads())
    first = map_bytes(path)
    other = tmp_path / "other.osm"
    other.write_text(crossroads())
    assert map_bytes(other) == first


def test_the_projection_agrees_with_proj() -> None:
    pyproj = pytest.importorskip("pyproj")
    lat, lon = np.array([48.1, -33.9, 0.0, 35.9035]), np.array([11.6, 12.2, 9.0, 10.9334])
    to_map = pyproj.Transformer.from_crs(
        "EPSG:4326", "+proj=tmerc +lat_0=0 +lon_0=10.5 +k=0.9996 +datum=WGS84", always_xy=True
    )
    x, y = transverse_mercator(lat, lon, 10.5, 0.9996)
    np.testing.assert_allclose(np.stack((x, y)), to_map.transform(lon, lat), atol=1e-4)


def test_centre_lines_are_lanelet2s_own(tmp_path: Path) -> None:
    core = pytest.importorskip("lanelet2").core
    bent = [(10.0, 0.0), (30.0, 1.0), (42.0, 7.0), (50.0, 20.0)]
    ways = {1: bent, 2: [(11.0, -3.0), (33.0, -2.5), (48.0, 6.0), (54.0, 19.0)]}
    root = etree.fromstring(osm(ways, [(11, 1, 2, {})]).encode())
    lanelet = read_lanelets(root, "map.osm", Notes()).lanelets["11"]
    sides = [
        core.LineString3d(
            core.getId(),
            [core.Point3d(core.getId(), *map(float, point)) for point in bound.points],
        )
        for bound in (lanelet.left, lanelet.right)
    ]
    theirs = core.Lanelet(core.getId(), *sides).centerline
    np.testing.assert_array_equal(lanelet.centre[:, :2], [(point.x, point.y) for point in theirs])
