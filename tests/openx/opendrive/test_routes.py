"""Routes over lanes: which way they go, and where the lanes' centre line runs."""

import dataclasses
import math
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lanes import borders, lane_pose, points
from bridgegen.openx.opendrive.model import (
    Connection,
    Header,
    Junction,
    Lane,
    LaneLink,
    LaneSection,
    OpenDrive,
    Road,
    RoadLink,
    Width,
)
from bridgegen.openx.opendrive.path import LanePath
from bridgegen.openx.opendrive.plan_view import (
    Arc,
    Cubic,
    Geometry,
    Line,
    ParamPoly3,
    Poly3,
    Spiral,
)
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.routes import Route, plan_route
from bridgegen.openx.opendrive.write import to_xml

# Ego and other vehicle of S1 to S4: from leg to leg, legs A (south) … D (east) being roads 1 … 4.
WAYS = [("3", "1"), ("2", "4"), ("1", "2"), ("1", "3"), ("3", "4"), ("4", "2")]
COLUMNS = ("s", "x", "y", "h", "curvature", "lane_width")


def road(*shapes: tuple[Any, float], **more: Any) -> Road:
    """A road from the origin eastwards; each geometry begins at the end of the one before."""
    from bridgegen.openx.opendrive.geometry import pose

    geometries: list[Geometry] = []
    s, x, y, h = 0.0, 0.0, 0.0, 0.0
    for shape, length in shapes:
        geometries.append(Geometry(s, x, y, h, length, shape))
        x, y, h, _ = pose(geometries[-1], length)
        s += length
    return Road("1", s, plan_view=tuple(geometries), **more)


def lanes(*widths: Width, beside: tuple[Width, ...] = (Width(0.0, 3.0, 0.0, 0.0, 0.0),)) -> Any:
    """Two lanes each way; the outer ones have the given widths."""
    outer, inner = widths or (Width(0.0, 3.5, 0.0, 0.0, 0.0),), beside
    return (
        LaneSection(
            0.0,
            left=(Lane(2, "driving", widths=outer), Lane(1, "driving", widths=inner)),
            center=(Lane(0),),
            right=(Lane(-1, "driving", widths=inner), Lane(-2, "driving", widths=outer)),
        ),
    )


def alone(one: Road) -> OpenDrive:
    return OpenDrive(Header(1, 7), (one,))


def check_path(path: LanePath, tolerance: float = 2e-3) -> None:
    """The step is uniform, and position, heading and curvature are each other's derivatives."""
    np.testing.assert_array_equal(path.s, np.arange(len(path.s)) * path.ds)
    assert path.s[-2] < path.length - 1e-9 <= path.s[-1] < path.length + path.ds

    def slope(values: np.ndarray) -> np.ndarray:
        return (values[2:] - values[:-2]) / (2 * path.ds)

    jumps = np.abs(np.diff(path.curvature)) > 1e-2  # from line to arc, at either end of a taper
    smooth = ~(jumps[1:] | jumps[:-1])
    for values, wanted in (
        (path.x, np.cos(path.h)),
        (path.y, np.sin(path.h)),
        (path.h, path.curvature),
    ):
        np.testing.assert_allclose(slope(values)[smooth], wanted[1:-1][smooth], atol=tolerance)
    assert jumps.sum() <= 8
    assert np.abs(np.diff(path.h)).max() < 1.0


def brute(model: OpenDrive, lane_id: int, low: float, high: float) -> tuple[np.ndarray, ...]:
    """The lane's centre point by point, with the distance travelled by summing chords."""
    one = model.roads[0]
    s = np.linspace(low, high, 20_001)
    t = borders(one, 0, s)
    inner = t[lane_id - (1 if lane_id > 0 else -1)]
    x, y = points(one, s, 0.5 * (inner + t[lane_id])).T
    width = np.abs(t[lane_id] - inner)
    if one.direction(lane_id) < 0:
        x, y, width = x[::-1], y[::-1], width[::-1]
    return np.concatenate(([0.0], np.hypot(np.diff(x), np.diff(y)).cumsum())), x, y, width


# -- over the crossroads ---------------------------------------------------------------------------


def test_straight_on_by_hand(crossroads: Callable[..., OpenDrive]) -> None:
    # S1, the ego: from the north, 40 m before its stop line, straight on, 40 m beyond; 26 m across.
    route = plan_route(crossroads(), ("3", 1, 40.0), [], ("1", -1, 40.0))
    assert route.length == pytest.approx(40.0 + 26.0 + 40.0)
    path = route.sample(0.5)
    assert len(path.s) == 213
    np.testing.assert_allclose(path.x, -1.75, atol=1e-9)
    np.testing.assert_allclose(path.y, 53.0 - path.s, atol=1e-9)
    np.testing.assert_allclose(path.curvature, 0.0, atol=1e-12)
    np.testing.assert_array_equal(path.lane_width, 3.5)
    assert [step.road_id for step in route.steps] == ["3", "110", "1"]


def test_left_turn_by_hand(crossroads: Callable[..., OpenDrive]) -> None:
    # S2, the other vehicle: from the south to the west, a quarter of a circle of radius 14.75 m.
    route = plan_route(crossroads(), ("1", 1, 10.0), [], ("2", -1, 20.0))
    assert route.length == pytest.approx(10.0 + 14.75 * math.pi / 2 + 20.0)
    path = route.sample(0.1)
    assert path.h[0] == pytest.approx(math.pi / 2)
    assert path.h[-1] == pytest.approx(math.pi)
    turning = (path.s > 10.01) & (path.s < 10.0 + 14.75 * math.pi / 2 - 0.01)
    np.testing.assert_allclose(path.curvature[turning], 1 / 14.75)
    radius = np.hypot(path.x + 13.0, path.y + 13.0)[turning]  # the arc's centre is (-13, -13)
    np.testing.assert_allclose(radius, 14.75)
    check_path(path)


@given(data=st.data())
def test_any_crossroads(
    data: st.DataObject, static: Any, crossroads: Callable[..., OpenDrive]
) -> None:
    values = data.draw(static)
    model = crossroads(*values.values())
    origin, target = data.draw(st.sampled_from(WAYS))
    start, end = data.draw(st.floats(2.0, 40.0)), data.draw(st.floats(2.0, 40.0))
    route = plan_route(model, (origin, 1, start), [], (target, -1, end))
    path = route.sample(data.draw(st.sampled_from((0.1, 0.2, 0.5))))
    check_path(path, tolerance=0.05 * path.ds)
    # Where the stop line and the end of the junction are along the path.
    inside = route.length - start - end
    size = values["intersection_size"]
    straight = (origin, target) in (("3", "1"), ("2", "4"), ("1", "3"), ("4", "2"))
    quarter = (size + values["lane_width"]) / 2 * math.pi / 2
    assert inside == pytest.approx(size if straight else quarter)
    for road_id, s, station in (
        (origin, start, 0.0),
        (origin, 0.0, start),
        (target, 0.0, start + inside),
    ):
        a, b = route.station(road_id, s)
        assert a + b * s == pytest.approx(station)
    np.testing.assert_allclose(path.lane_width, values["lane_width"])


@given(data=st.data())
def test_same_bits_from_individuals_and_from_file(
    data: st.DataObject, static: Any, crossroads: Callable[..., OpenDrive]
) -> None:
    made = crossroads(*data.draw(static).values())
    again = read(to_xml(made))
    for origin, target in WAYS:
        ends = (origin, 1, 40.0), (target, -1, 40.0)
        one, other = (plan_route(model, ends[0], [], ends[1]) for model in (made, again))
        assert one.length == other.length
        assert one.station(origin, 7.0) == other.station(origin, 7.0)
        for name in COLUMNS:
            a, b = getattr(one.sample(0.1), name), getattr(other.sample(0.1), name)
            assert a.tobytes() == b.tobytes(), name


def test_start_that_is_an_expression_of_a_parameter(crossroads: Callable[..., OpenDrive]) -> None:
    """a + b·s from a route over the whole arm tells where any start on it is."""
    model = crossroads()
    whole = plan_route(model, ("2", 2, 60.0), [], ("4", -2, 60.0))
    a, b = whole.station("2", 33.0)
    path = whole.sample(0.25)
    for s in (60.0, 33.0, 2.5):
        at = lane_pose(model.road("2"), 2, s)
        assert np.interp(a + b * s, path.s, path.x) == pytest.approx(at.x)
        assert np.interp(a + b * s, path.s, path.y) == pytest.approx(at.y)


SPIRAL = b"""<OpenDRIVE><header revMajor="1" revMinor="7"/>
<road id="1" length="400" junction="-1"><planView>
<geometry s="0" x="0" y="0" hdg="0" length="100"><line/></geometry>
<geometry s="100" x="100" y="0" hdg="0" length="300">
<spiral curvStart="0" curvEnd="-0.02"/></geometry>
</planView><lanes><laneSection s="0"><left>
<lane id="1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane></left>
<center><lane id="0" type="none"/></center><right>
<lane id="-1" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
<lane id="-2" type="driving"><width sOffset="0" a="3.5" b="0" c="0" d="0"/></lane>
</right></laneSection></lanes></road></OpenDRIVE>"""


@pytest.mark.parametrize(("lane", "t"), [(-1, -1.75), (-2, -5.25), (1, 1.75)])
def test_stations_along_a_spiral_are_those_of_the_lane(lane: int, t: float) -> None:
    """A lane at t advances by 1 - curvature t: s - t k' (s - 100)^2 / 2 with k' = -0.02 / 300."""
    ends = (("1", lane, 0.0), ("1", lane, 400.0))
    route = plan_route(read(SPIRAL), ends[lane > 0], [], ends[lane < 0])
    s = np.array([0.0, 60.0, 100.0, 165.0, 250.0, 333.3, 400.0])
    bent = np.maximum(s - 100.0, 0.0)
    wanted = s - t * (-0.02 / 300.0) * bent**2 / 2.0
    found = route.stations("1", s)
    if lane > 0:
        found = route.length - found
    assert found == pytest.approx(wanted, abs=1e-9)
    for place in s.tolist():  # exact where it is asked for
        a, b = route.station("1", place)
        assert a + b * place == pytest.approx(route.stations("1", np.array([place]))[0], abs=1e-9)
    assert not route.is_even("1")


# -- over Town05 -----------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("start", "end", "roads"),
    [
        (("47", -1, 30.0), ("40", -1, 10.0), ["47", "17", "1038", "18", "40"]),  # straight on
        (("1", 1, 40.0), ("0", 1, 20.0), ["1", "974", "0"]),  # straight on, against s
        (("18", 1, 20.0), ("17", 1, 5.0), ["18", "1037", "17"]),  # from end to end
        (("17", -1, 5.0), ("0", 1, 20.0), ["17", "996", "0"]),  # left
        (("1", 1, 40.0), ("17", 1, 5.0), ["1", "1006", "17"]),  # left
        (("17", -2, 5.0), ("1", -2, 20.0), ["17", "1010", "1"]),  # right, lane 1 to 2 on the way
    ],
)
def test_town05(town05: OpenDrive, start: Any, end: Any, roads: list[str]) -> None:
    route = plan_route(town05, start, [], end)
    assert list(dict.fromkeys(step.road_id for step in route.steps)) == roads
    path = route.sample(0.1)
    check_path(path, tolerance=0.03)  # the map's joints leave gaps of millimetres
    np.testing.assert_allclose(path.lane_width, 3.5, atol=0.02)
    assert (
        math.dist((path.x[0], path.y[0]), lane_pose(town05.road(start[0]), *start[1:])[:2]) < 1e-9
    )
    a, b = route.station(end[0], end[2])
    assert a + b * end[2] == pytest.approx(route.length)


# -- curves and tapers -----------------------------------------------------------------------------

# From 3.5 m to 3.5 + 108 · 0.04 = 7.82 m over 18 m, level at both ends.
TAPER = (
    Width(0.0, 3.5, 0.0, 0.0, 0.0),
    Width(12.0, 3.5, 0.0, 0.04, -0.04 / 27),
    Width(30.0, 7.82, 0.0, 0.0, 0.0),
)
ROADS = {
    "spiral": road((Line(), 10.0), (Spiral(0.0, 0.03), 30.0), (Arc(0.03), 20.0), sections=lanes()),
    "taper": road((Line(), 15.0), (Arc(-0.02), 45.0), sections=lanes(*TAPER)),
    "offset": road(
        (Arc(0.01), 60.0),
        lane_offsets=(Cubic(0.0, 0.0, 0.0, 0.0, 0.0), Cubic(20.0, 0.0, 0.0, 0.01, -1e-4)),
        sections=lanes(),
    ),
    "poly3": road((Poly3(0.0, 0.0, 0.01, -1e-4), 50.0), sections=lanes()),
    "paramPoly3": road(
        (ParamPoly3(0, 49.5, 3.0, -7.0, 0, 0, 30.0, -18.0, "normalized"), 50.0),
        sections=lanes(*TAPER),
    ),
}  # fmt: skip


@pytest.mark.parametrize("name", ROADS)
@pytest.mark.parametrize("lane_id", [-2, -1, 1, 2])
def test_curves_and_tapers_against_summation(name: str, lane_id: int) -> None:
    model = alone(ROADS[name])
    low, high = 3.0, model.roads[0].length - 2.0
    start, end = (low, high) if lane_id < 0 else (high, low)
    route = plan_route(model, ("1", lane_id, start), [], ("1", lane_id, end))
    path = route.sample(0.25)
    travelled, x, y, width = brute(model, lane_id, low, high)
    assert route.length == pytest.approx(travelled[-1], rel=1e-6)
    inside = path.s <= route.length
    for got, wanted in ((path.x, x), (path.y, y), (path.lane_width, width)):
        np.testing.assert_allclose(
            got[inside], np.interp(path.s, travelled, wanted)[inside], atol=1e-4
        )
    check_path(path)


@pytest.mark.parametrize("name", ROADS)
def test_there_and_back_are_the_same_line(name: str) -> None:
    """A lane of the left side runs the other way on the mirror image of a lane of the right."""
    there = ROADS[name]
    length = there.length
    swapped = dataclasses.replace(there, rule="LHT")
    for lane_id in (-2, 1):
        ends = [("1", lane_id, 1.0), ("1", lane_id, length - 1.0)]
        if lane_id > 0:
            ends.reverse()
        forth = plan_route(alone(there), ends[0], [], ends[1])
        back = plan_route(alone(swapped), ends[1], [], ends[0])
        assert back.length == pytest.approx(forth.length)
        step = forth.length / 100
        a, b = forth.sample(step), back.sample(step)
        np.testing.assert_allclose(a.x, b.x[::-1], atol=1e-5)
        np.testing.assert_allclose(a.y, b.y[::-1], atol=1e-5)
        np.testing.assert_allclose(a.curvature[1:-1], -b.curvature[::-1][1:-1], atol=2e-3)
        turn = np.array([math.remainder(angle - math.pi, math.tau) for angle in a.h - b.h[::-1]])
        np.testing.assert_allclose(turn, 0.0, atol=1e-4)


def test_headings_do_not_jump_by_whole_turns() -> None:
    circle = road((Arc(0.1), 40.0), (Arc(0.1), 40.0), sections=lanes())  # 8 rad in all
    moved = dataclasses.replace(
        circle,
        plan_view=(
            circle.plan_view[0],
            dataclasses.replace(circle.plan_view[1], hdg=circle.plan_view[1].hdg - math.tau),
        ),
    )
    path = plan_route(alone(moved), ("1", -1, 0.0), [], ("1", -1, 80.0)).sample(0.1)
    assert path.h[-1] - path.h[0] == pytest.approx(8.0, abs=0.02)
    check_path(path)


def test_lane_inside_a_bend_that_folds_over() -> None:
    bend = road((Arc(0.4), 5.0), sections=lanes())  # its centre is 2.5 m to the left
    with refuses(InputError, "lane 2", "road 1"):
        plan_route(alone(bend), ("1", 2, 5.0), [], ("1", 2, 0.0))


# -- the network -----------------------------------------------------------------------------------


def ring() -> OpenDrive:
    """A road east, and a way back to its start: one lane, a loop of 100 m."""
    width = (Width(0.0, 3.0, 0.0, 0.0, 0.0),)
    lane = Lane(-1, "driving", predecessors=(-1,), successors=(-1,), widths=width)
    section = (LaneSection(0.0, center=(Lane(0),), right=(lane,)),)
    shape = Arc(math.tau / 100)
    half = road((shape, 50.0))
    end = road((shape, 50.0), (Line(), 1.0)).plan_view[1]
    second = dataclasses.replace(half.plan_view[0], x=end.x, y=end.y, hdg=end.hdg)
    first = dataclasses.replace(
        half,
        sections=section,
        predecessor=RoadLink("road", "2", "end"),
        successor=RoadLink("road", "2", "start"),
    )
    other = dataclasses.replace(
        first,
        id="2",
        plan_view=(second,),
        predecessor=RoadLink("road", "1", "end"),
        successor=RoadLink("road", "1", "start"),
    )
    return OpenDrive(Header(1, 7), (first, other))


def test_place_behind_is_reached_by_going_round() -> None:
    model = ring()
    ahead = plan_route(model, ("1", -1, 10.0), [], ("1", -1, 30.0))
    behind = plan_route(model, ("1", -1, 30.0), [], ("1", -1, 10.0))
    assert [step.road_id for step in behind.steps] == ["1", "2", "1"]
    circle = ahead.length + behind.length
    assert circle == pytest.approx(100.0 * (1 + math.tau / 100 * 1.5))  # 1.5 m outside the line
    twice = plan_route(model, ("1", -1, 10.0), [("2", -1, 5.0), ("1", -1, 30.0)], ("1", -1, 20.0))
    assert twice.length == pytest.approx(2 * circle + 10.0 / 100.0 * circle)
    check_path(twice.sample(0.1))


def test_shortest_of_two_ways() -> None:
    """From road 1 over 2 or 3, which is longer, to 4."""
    model = ring()
    first = model.roads[0]

    def way(name: str, length: float, junction: str = "-1", **links: Any) -> Road:
        return dataclasses.replace(
            road((Line(), length)), id=name, junction=junction, sections=first.sections,
            predecessor=links.get("before"), successor=links.get("after"),
        )  # fmt: skip

    roads = (
        way("1", 10.0, after=RoadLink("junction", "9")),
        way(
            "2",
            30.0,
            "9",
            before=RoadLink("road", "1", "end"),
            after=RoadLink("road", "4", "start"),
        ),
        way(
            "3",
            20.0,
            "9",
            before=RoadLink("road", "1", "end"),
            after=RoadLink("road", "4", "start"),
        ),
        way("4", 10.0, before=RoadLink("junction", "9")),
    )
    connections = tuple(
        Connection(name, "1", name, "start", (LaneLink(-1, -1),)) for name in ("2", "3")
    )
    model = OpenDrive(Header(1, 7), roads, junctions=(Junction("9", connections=connections),))
    route = plan_route(model, ("1", -1, 4.0), [], ("4", -1, 1.0))
    assert [step.road_id for step in route.steps] == ["1", "3", "4"]
    around = plan_route(model, ("1", -1, 4.0), [("2", -1, 3.0)], ("4", -1, 1.0))
    assert [step.road_id for step in around.steps] == ["1", "2", "2", "4"]
    assert (route.length, around.length) == pytest.approx((27.0, 37.0))


@pytest.mark.parametrize(
    ("start", "via", "end", "said"),
    [
        (("9", 1, 1.0), [], ("1", -1, 40.0), "network"),
        (("3", 7, 1.0), [], ("1", -1, 40.0), "lane"),
        (("3", 1, 61.0), [], ("1", -1, 1.0), "road 3"),
        (("3", 1, math.nan), [], ("1", -1, 1.0), "road 3"),
        (("3", 1, 40.0), [("3", 2, 30.0)], ("1", -1, 1.0), "change"),
        (
            ("3", 1, 40.0),
            [],
            ("1", -2, 1.0),
            "road 3",
        ),
        (("3", -1, 40.0), [], ("1", -1, 1.0), "leads"),  # it leads away
        (("3", 1, 40.0), [], ("3", 1, 40.0), "length"),
        (("3", 1, 30.0), [], ("3", 1, 40.0), "leads"),  # behind, and no way round
    ],
)
def test_routes_that_are_not(
    crossroads: Callable[..., OpenDrive], start: Any, via: Any, end: Any, said: str
) -> None:
    with refuses(InputError, said):
        plan_route(crossroads(), start, via, end)


@pytest.fixture
def route(crossroads: Callable[..., OpenDrive]) -> Route:
    return plan_route(crossroads(), ("3", 1, 40.0), [], ("1", -1, 40.0))


@pytest.mark.parametrize("ds", [0.0, -1.0, math.nan, 1e-9])
def test_step_that_cannot_be(route: Route, ds: float) -> None:
    with refuses(InputError, "106 m"):
        route.sample(ds)


def test_station_of_a_road_that_is_not_on_the_route(route: Route) -> None:
    with refuses(InputError, "road", "road 2"):
        route.station("2", 1.0)


def test_no_places_have_no_stations() -> None:
    """A part of a batch may hold no row of one of its road networks."""
    route = plan_route(read(SPIRAL), ("1", -1, 0.0), [], ("1", -1, 400.0))
    assert route.stations("1", np.empty(0)).shape == (0,)
