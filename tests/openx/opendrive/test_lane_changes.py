"""Routes that change lanes where no lane leads on: where they run, worked by hand, and by law."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lane_changes import USUAL, coming, plan_with_changes, turnings
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import OpenDrive, Width
from bridgegen.openx.opendrive.plan_view import Arc, Line, Spiral
from bridgegen.openx.opendrive.routes import Place, Route

from .test_routes import alone, check_path, lanes, road


def straight(length: float = 200.0) -> OpenDrive:
    return alone(road((Line(), length), sections=lanes()))


def sampled(route: Route) -> np.ndarray:
    path = route.sample(0.1)
    return np.stack((path.x, path.y))


def test_half_way_is_half_way() -> None:
    """Lanes of 3 and 3.5 m: centres at t = -1.5 and -4.75, changed between s = 20 and 80."""
    route = plan_with_changes(straight(), [("1", -1, 20.0), ("1", -2, 180.0)])
    assert [step.lane_id for step in route.steps] == [-1, -2, -2]
    assert [(step.s, step.s_end) for step in route.steps] == [(20, 50), (50, 80), (80, 180)]
    x, y = sampled(route)
    for s, t in ((20.0, -1.5), (50.0, -3.125), (80.0, -4.75), (150.0, -4.75)):
        assert np.interp(s, x, y) == pytest.approx(t, abs=1e-3)
    # a quarter of the way a cubic has come 3/16 - 2/64 = 5/32 of the way across
    assert np.interp(35.0, x, y) == pytest.approx(-1.5 - 3.25 * 5 / 32, abs=1e-3)


def test_against_the_reference_line_it_is_the_mirror_image() -> None:
    route = plan_with_changes(straight(), [("1", 1, 180.0), ("1", 2, 20.0)])
    x, y = sampled(route)
    for s, t in ((180.0, 1.5), (150.0, 3.125), (120.0, 4.75), (30.0, 4.75)):
        assert np.interp(-s, -x, y) == pytest.approx(t, abs=1e-3)


@given(
    radius=st.floats(60.0, 2000.0),
    left=st.booleans(),
    taper=st.floats(-0.01, 0.01),
    begin=st.floats(0.0, 60.0),
    length=st.floats(20.0, 130.0),
    against=st.booleans(),
)
def test_it_is_smooth_and_joins_the_lanes(
    radius: float, left: bool, taper: float, begin: float, length: float, against: bool
) -> None:
    """On lines, spirals and arcs, on lanes that widen: position, heading and curvature agree."""
    bend = (1.0 if left else -1.0) / radius
    one = road(
        (Line(), 50.0), (Spiral(0.0, bend), 50.0), (Arc(bend), 100.0),
        sections=lanes(Width(0.0, 4.0, taper, 0.0, 0.0)),
    )  # fmt: skip
    sign = 1 if against else -1
    s, s_end = (200.0 - begin, 200.0 - begin - length) if against else (begin, begin + length)
    model = alone(one)
    route = plan_with_changes(model, [("1", sign, s), ("1", 2 * sign, s_end)])
    path = route.sample(0.1)
    check_path(path, tolerance=6e-3)  # curvature jumps by less than it takes for a jump
    for at, lane, station in ((0, sign, s), (-1, 2 * sign, s_end)):
        pose = lane_pose(one, lane, station)
        assert math.dist((path.x[at], path.y[at]), (pose.x, pose.y)) < 0.11
        assert abs(math.remainder(path.h[at] - pose.h, math.tau)) < 0.02
    assert route.length == pytest.approx(path.length)
    assert max(step.s_end - step.s for step in route.steps[:2]) <= 0.5 * USUAL + 1e-9


def test_too_little_room_is_passed_on_the_lane_beside() -> None:
    """10 m are too few to change lane in: the place is passed on the lane that one is on."""
    route = plan_with_changes(straight(), [("1", -1, 20.0), ("1", -2, 30.0), ("1", -2, 190.0)])
    assert route.steps[0].lane_id == -1
    assert route.steps[-1].lane_id == -2


def test_nobody_changes_to_the_other_side() -> None:
    with refuses(InputError):
        plan_with_changes(straight(), [("1", -1, 20.0), ("1", 1, 180.0)])


def test_a_route_without_a_change_is_what_it_was() -> None:
    route = plan_with_changes(straight(), [("1", -1, 20.0), ("1", -1, 180.0)])
    assert [(step.lane_id, step.across) for step in route.steps] == [(-1, None)]


def stretch(begin: float, by: float, lane: int = -2) -> list[Place]:
    return [Place("1", -1, 0.0), Place("1", -1, begin), Place("1", lane, by), Place("1", lane, 200)]


def test_a_stretch_has_a_way_for_each_place_at_which_a_change_may_begin() -> None:
    """Lanes of 3 and 3.5 m; 160 m of road for a change of 60 m: it begins at 20, 40 … 120 m."""
    found = turnings(straight(), stretch(20.0, 180.0), USUAL)
    assert [turning.begins for turning in found] == pytest.approx([20, 40, 60, 80, 100, 120])
    for turning in found:
        assert (turning.length, turning.across) == (60.0, -3.25)
        x, y = sampled(turning.route)
        begins = turning.begins
        for s, t in ((begins, -1.5), (begins + 30.0, -3.125), (begins + 60.0, -4.75), (200, -4.75)):
            assert np.interp(s, x, y) == pytest.approx(t, abs=1e-3)
    (only,) = turnings(straight(), stretch(20.0, 60.0), USUAL)
    assert (only.begins, only.length) == (pytest.approx(20.0), 40.0)


def test_a_stretch_needs_room_and_a_lane_beside() -> None:
    with refuses(InputError, "15 m", "10 m"):
        turnings(straight(), stretch(20.0, 30.0), USUAL)
    with refuses(InputError, "lane -1"):
        turnings(straight(), [*stretch(20.0, 180.0)[:2], *stretch(20.0, 180.0, 1)[2:]], USUAL)


def test_traffic_comes_along_the_lane_from_before_its_section() -> None:
    route = coming(straight(), Place("1", -2, 120.0), Place("1", -2, 200.0), 250.0)
    assert route.length == pytest.approx(200.0)
    x, y = sampled(route)
    assert np.interp([0.0, 100.0, 200.0], x, y) == pytest.approx([-4.75] * 3)
