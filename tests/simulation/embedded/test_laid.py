"""Trajectories that are laid when they begin: relative to entities, or by the row's parameters.

On leg C (road 3, straight along y, s = y - 13 m) lane 1 leads south, 1.75 m left of the road's
reference line, which runs north along x = 0. The instants are 0.05 s apart.
"""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from scipy.interpolate import BSpline
from tests.approval import approve, refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.simulation.embedded.compiler.curves import basis
from bridgegen.simulation.rollout import STATUS_MESSAGES

from .storyboards import after, events, lane, run, scenario, simulator, speeding, start

SOUTH = 1.5 * math.pi
EGO = start("ego", lane(1, 1, 90.0), 0.0)
BV = start("bv", lane(3, 1, 90.0), 10.0)  # at x = -1.75, y = 103, southwards
RELATIVE = '<Timing domainAbsoluteRelative="relative" scale="1" offset="0"/>'


def vertex(place: str, time: float | str | None = None) -> str:
    timed = "" if time is None else f' time="{time}"'
    return f"<Vertex{timed}><Position>{place}</Position></Vertex>"


def world(x: float | str, y: float | str, h: float | None = None) -> str:
    heading = "" if h is None else f' h="{h}"'
    return f'<WorldPosition x="{x}" y="{y}"{heading}/>'


def beside(ds: float, offset: float = 0.0, lanes: int = 0, entity: str = "bv") -> str:
    return (
        f'<RelativeLanePosition entityRef="{entity}" dLane="{lanes}" ds="{ds}" offset="{offset}"/>'
    )


def road(s: float, t: float, turn: float | None = None, kind: str = "relative") -> str:
    turned = "" if turn is None else f'<Orientation h="{turn}" type="{kind}"/>'
    return f'<RoadPosition roadId="3" s="{s}" t="{t}">{turned}</RoadPosition>'


def line(*vertices: str) -> str:
    return f"<Polyline>{''.join(vertices)}</Polyline>"


def follow(shape: str, timing: str = "<None/>", more: str = "") -> str:
    return f"""<RoutingAction><FollowTrajectoryAction{more}><TrajectoryRef><Trajectory name="t"
closed="false"><Shape>{shape}</Shape></Trajectory></TrajectoryRef><TimeReference>{timing}
</TimeReference><TrajectoryFollowingMode followingMode="position"/></FollowTrajectoryAction>
</RoutingAction>"""


def told(*rows, bv=BV, parameters="", **values):
    """Rows are (action of bv, condition)."""
    story = events(*((f"e{i}", "bv", action, when) for i, (action, when) in enumerate(rows)))
    return run(scenario(("ego", "bv"), EGO + bv, story, parameters=parameters), None, **values)


def place(rollout, seconds: float, row: int = 0):
    """Return x, y [m], and the heading from 0 to a whole turn [rad]; 1e-9 less is 0."""
    k = round(seconds / 0.05)
    h = (float(rollout.h[row, 1, k]) + 1e-9) % math.tau - 1e-9
    return float(rollout.x[row, 1, k]), float(rollout.y[row, 1, k]), h


def number(name: str, value: float) -> str:
    return f'<ParameterDeclaration name="{name}" parameterType="double" value="{value}"/>'


def test_vertices_beside_the_entity_are_those_of_the_instant_when_it_begins():
    """At 1 s it is at y = 93; from there 20 m straight on, then 2 m to the right over 20 m."""
    out = told((follow(line(*map(vertex, (beside(0), beside(-20), beside(-40, 2.0))))), after(1.0)))
    assert out.status[0] == 0
    assert place(out, 2.0) == pytest.approx((-1.75, 83.0, SOUTH))
    slanted = math.hypot(20.0, 2.0)
    share = 10.0 / slanted
    x, y, h = place(out, 4.0)
    assert (x, y) == pytest.approx((-1.75 - 2.0 * share, 73.0 - 20.0 * share))
    assert math.remainder(h - math.atan2(-20.0, -2.0), math.tau) == pytest.approx(0.0, abs=1e-9)
    assert out.v[0, 1] == pytest.approx(10.0)


def test_times_count_from_the_beginning_and_give_the_speed():
    """From 1 s on 20 m in 4 s, then 30 m in 2 s."""
    vertices = (vertex(beside(0), 0), vertex(beside(-20), 4), vertex(beside(-50), 6))
    out = told((follow(line(*vertices), RELATIVE), after(1.0)))
    assert place(out, 3.0)[1] == pytest.approx(93.0 - 10.0)
    assert place(out, 6.0)[1] == pytest.approx(93.0 - 35.0)
    assert out.v[0, 1, 40] == pytest.approx(5.0)
    assert out.v[0, 1, 130] == pytest.approx(15.0)
    assert place(out, 8.0)[1] == pytest.approx(43.0 - 15.0)  # on at its last speed


def test_each_row_has_its_own_vertices():
    shape = line(vertex(world(0, "$p"), 0), vertex(world("${2 * $p}", "$p"), "$q"))
    out = told(
        (follow(shape, RELATIVE), after(1.0)),
        parameters=number("p", 1.0) + number("q", 2.0), p=[10.0, 20.0], q=[2.0, 4.0],
    )  # fmt: skip
    assert place(out, 2.0, 0) == pytest.approx((10.0, 10.0, 0.0), abs=1e-8)
    assert place(out, 2.0, 1)[:2] == pytest.approx((10.0, 20.0))
    assert not simulator(
        scenario(("ego", "bv"), EGO + BV, events(("e", "bv", follow(shape, RELATIVE), after(1.0))),
                 parameters=number("p", 1.0) + number("q", 2.0)), None,
    ).fixed  # fmt: skip


def test_times_that_do_not_increase_end_the_row():
    shape = line(vertex(beside(0), 0), vertex(beside(-9), "$q"))
    out = told(
        (follow(shape, RELATIVE), after(1.0)), parameters=number("q", 2.0), q=[2.0, -1.0]
    )  # fmt: skip
    approve(STATUS_MESSAGES[int(out.status[1])], "trajectory")
    assert out.status[0] == 0
    literal = line(vertex(beside(0), 3), vertex(beside(-9), 2))
    with refuses(UnsupportedError, "2 s", "3 s"):
        told((follow(literal, RELATIVE), after(1.0)))


def test_vertices_in_road_coordinates():
    """From (4, 93), the road's right, to (-4, 93), its left, at 2 m/s from 1 s on."""
    walk = start("bv", lane(3, 1, 90.0), 2.0)
    out = told((follow(line(vertex(road(80, -4)), vertex(road(80, 4)))), after(1.0)), bv=walk)
    assert place(out, 2.0) == pytest.approx((2.0, 93.0, math.pi))
    assert place(out, 4.0)[:2] == pytest.approx((-2.0, 93.0))


def test_a_stated_heading_is_kept_and_turns_from_vertex_to_vertex():
    """It slides to the left and turns from 0 to 90° of the road's direction (north)."""
    turns = line(vertex(road(80, 0, 0.0)), vertex(road(80, 20, 0.5 * math.pi)))
    out = told((follow(turns), after(1.0)))
    assert place(out, 2.0) == pytest.approx((-10.0, 93.0, 0.75 * math.pi))
    absolute = line(vertex(road(80, 0, 0.3, "absolute")), vertex(road(80, 20, 0.3, "absolute")))
    assert place(told((follow(absolute), after(1.0))), 2.0)[2] == pytest.approx(0.3)
    for both in (world(0, 93, 0.3), world(-20, 93, 0.3)), (world(0, 93), world(-20, 93)):
        h = place(told((follow(line(*map(vertex, both))), after(1.0))), 2.0)[2]
        assert h == pytest.approx(0.3 if 'h="' in both[0] else math.pi)


def test_an_initial_trajectory_is_a_place_to_start_at():
    lonely = f"""<Private entityRef="bv"><PrivateAction>
{follow(line(vertex(road(80, -4)), vertex(road(80, 4))))}</PrivateAction><PrivateAction>
{speeding(2.0, "step time 0")}</PrivateAction></Private>"""
    out = told(bv=lonely)
    assert place(out, 0.0) == pytest.approx((4.0, 93.0, math.pi))
    assert place(out, 2.0) == pytest.approx((0.0, 93.0, math.pi))


ARC = (
    '<ClothoidSpline><ClothoidSplineSegment curvatureStart="{k}" curvatureEnd="{k}" length="{l}"/>'
    '<ClothoidSplineSegment curvatureStart="0" curvatureEnd="0" length="10"/></ClothoidSpline>'
)


def test_bends_without_a_start_begin_where_the_entity_is():
    """From (-1.75, 93) southwards, a quarter to the left of 20 m radius, then eastwards."""
    out = told((follow(ARC.format(k=0.05, l=10.0 * math.pi)), after(1.0)))
    k = round((1.0 + math.pi) / 0.05)  # a quarter takes pi s at 10 m/s
    passed = (k * 0.05 - 1.0) * 10.0 - 10.0 * math.pi
    assert float(out.x[0, 1, k]) == pytest.approx(-1.75 + 20.0 + passed, abs=5e-3)
    assert float(out.y[0, 1, k]) == pytest.approx(73.0, abs=5e-3)
    turn = math.remainder(float(out.h[0, 1, k]), math.tau)
    assert turn == pytest.approx(0.0, abs=1e-2)
    half = place(out, 1.0 + 0.5 * math.pi)
    away = math.hypot(half[0] - 18.25, half[1] - 93.0)
    assert away == pytest.approx(20.0, abs=7e-3)  # a chord of 1 m is 6 mm inside


def test_a_spline_is_that_of_scipy():
    points = [(0.0, 50.0), (10.0, 50.0), (20.0, 60.0), (30.0, 50.0), (40.0, 50.0)]
    knots = [0, 0, 0, 0, 1, 2, 2, 2, 2]
    inner = "".join(
        f"<ControlPoint><Position>{world(x, y)}</Position></ControlPoint>" for x, y in points
    ) + "".join(f'<Knot value="{one}"/>' for one in knots)
    out = told((follow(f'<Nurbs order="4">{inner}</Nurbs>'), after(1.0)))
    curve = BSpline(np.array(knots, float), np.array(points), 3)(np.linspace(0, 2, 20001))
    for seconds in (1.5, 2.5, 3.5, 4.5):
        x, y, _ = place(out, seconds)
        assert np.hypot(*(curve - (x, y)).T).min() < 5e-3
    wrong = inner.replace('<Knot value="2"/>', "", 1)
    with refuses(UnsupportedError):
        told((follow(f'<Nurbs order="4">{wrong}</Nurbs>'), after(1.0)))
    gap = inner.replace('<Knot value="1"/>', '<Knot value="2"/>')
    with refuses(UnsupportedError):
        told((follow(f'<Nurbs order="4">{gap}</Nurbs>'), after(1.0)))


def test_a_spline_with_times_is_where_its_times_say():
    """Along a straight line: times and places are the same means of the control points'."""
    points = "".join(
        f'<ControlPoint time="{t}"><Position>{world(x, 50.0)}</Position></ControlPoint>'
        for t, x in ((0, 0.0), (1, 10.0), (2, 20.0), (3, 30.0))
    )
    knots = "".join(f'<Knot value="{one}"/>' for one in (0, 0, 0, 1, 2, 2, 2))
    out = told((follow(f'<Nurbs order="3">{points}{knots}</Nurbs>', RELATIVE), after(1.0)))
    for seconds in (1.5, 2.0, 3.5):
        assert place(out, seconds) == pytest.approx((10.0 * (seconds - 1.0), 50.0, 0.0), abs=1e-6)


KNOT = '<Knot value="0"/>'
CURVE = f"<ControlPoint><Position>{world(0, 50)}</Position></ControlPoint>"


@pytest.mark.parametrize(
    ("shape", "said"),
    [
        (line(*[vertex(beside(0))] * 5001), "a Polyline of 5001 vertices"),
        (ARC.format(k=0.0, l=1e9), "a clothoid 1e+09 m long"),
        (ARC.format(k=1e6, l=1.0), "a clothoid must turn by at most"),
        (f'<Nurbs order="2">{CURVE * 501}<Knot value="0"/><Knot value="1"/></Nurbs>',
         "a Nurbs of 501 control points"),
        (f'<Nurbs order="21">{CURVE * 22}{KNOT * 43}</Nurbs>', "of order 21"),
        (f'<Nurbs order="2">{CURVE * 2}{KNOT * 4}</Nurbs>', "leave no curve"),
        (f'<Nurbs order="3">{CURVE * 2}{KNOT * 5}</Nurbs>', "of order 3 with 2"),
    ],
)  # fmt: skip
def test_what_would_take_too_much_or_is_no_curve_is_refused(shape, said):
    with pytest.raises(UnsupportedError) as caught:
        told((follow(shape), after(1.0)))
    assert said in str(caught.value)


@given(st.integers(2, 5), st.integers(0, 4), st.data())
@settings(max_examples=50, deadline=None)
def test_weights_of_control_points_add_up_to_one_and_are_scipy_s(order, more, data):
    n = order + more
    inner = sorted(data.draw(st.lists(st.integers(1, 9), min_size=more, max_size=more)))
    knots = [0.0] * order + [float(one) for one in inner] + [10.0] * order
    weights = basis(order, knots, [1.0] * n, 33)
    assert weights.sum(axis=1) == pytest.approx(1.0)
    assert (weights >= 0.0).all()
    u = np.linspace(0.0, 10.0, 33)[:-1]  # SciPy takes the last knot from the right
    assert weights[:-1] == pytest.approx(BSpline(np.array(knots), np.eye(n), order - 1)(u))


STARTS = f"><PositionStart>{world(0, 50, 0.0)}</PositionStart></ClothoidSplineSegment>"


def along(shape: str, s: float, t: float = 0.0, turn: float | None = None) -> str:
    turned = "" if turn is None else f'<Orientation h="{turn}" type="relative"/>'
    return f"""<Position><TrajectoryPosition s="{s}" t="{t}"><TrajectoryRef><Trajectory name="t"
closed="false"><Shape>{shape}</Shape></Trajectory></TrajectoryRef>{turned}</TrajectoryPosition>
</Position>"""


@pytest.mark.parametrize(
    ("shape", "s", "t", "turn", "found"),
    [  # a place on straight lines; beyond their end; on the second; from a place on another; bends
        (line(vertex(road(80, -4)), vertex(road(80, 4))), 3.0, 1.0, None, (1.0, 92.0, math.pi)),
        (line(vertex(road(80, -4)), vertex(road(80, 4))), 99.0, 0.0, 0.5, (-4, 93, math.pi + 0.5)),
        (line(vertex(world(0, 50)), vertex(world(0, 60)), vertex(world(30, 60))), 15.0, -2.0, None,
         (5.0, 58.0, 0.0)),
        (line(vertex(along(line(vertex(world(0, 50)), vertex(world(9, 50))), 4, 3)[10:-11]),
              vertex(world(4, 99))), 7.0, 0.0, None, (4.0, 60.0, 0.5 * math.pi)),
        (ARC.format(k=0.05, l=10.0 * math.pi).replace("/>", STARTS, 1),
         10.0 * math.pi + 5.0, 0.0, None, (20.0, 75.0, 0.5 * math.pi)),
    ],
)  # fmt: skip
def test_a_place_along_a_trajectory(shape, s, t, turn, found):
    beam = f"<TeleportAction>{along(shape, s, t, turn)}</TeleportAction>"
    stopped = start("bv", lane(3, 1, 90.0), 0.0)
    x, y, h = place(told((beam, after(1.0)), bv=stopped), 2.0)
    assert (x, y) == pytest.approx(found[:2], abs=1e-2)
    assert math.remainder(h - found[2], math.tau) == pytest.approx(0.0, abs=1e-2)


def test_a_place_along_a_trajectory_may_vary_by_row():
    """So may the line: from (0, p) to (0, p + 10), q along it and 1 m to its left."""
    shape = line(vertex(world(0, "$p")), vertex(world(0, "${$p + 10}")))
    beam = f"<TeleportAction>{along(shape, '$q', 1.0)}</TeleportAction>"
    out = told(
        (beam, after(1.0)), bv=start("bv", lane(3, 1, 90.0), 0.0),
        parameters=number("p", 50.0) + number("q", 2.0), p=[50.0, 60.0], q=[2.0, 99.0],
    )  # fmt: skip
    assert place(out, 2.0, 0)[:2] == pytest.approx((-1.0, 52.0))
    assert place(out, 2.0, 1)[:2] == pytest.approx((-1.0, 70.0))


def test_no_stated_time_means_the_entity_s_own_speed_and_is_noted():
    untimed = line(vertex(beside(0)), vertex(beside(-40)))
    story = events(("e", "bv", follow(untimed, RELATIVE), after(1.0)))
    (note,) = simulator(scenario(("ego", "bv"), EGO + BV, story), None).program.notes
    approve(note, "followed")
    out = told((follow(untimed, RELATIVE), after(1.0)))
    assert place(out, 3.0)[1] == pytest.approx(73.0)


def part(where: str, length: float, time: float | None = None) -> str:
    timed = "" if time is None else f' timeStart="{time}"'
    start = f"<PositionStart>{where}</PositionStart>" if where else ""
    return f"""<ClothoidSplineSegment curvatureStart="0" curvatureEnd="0" length="{length}"{timed}>
{start}</ClothoidSplineSegment>"""


def test_a_chain_of_clothoids_may_start_anew():
    """10 m east from (0, 73), and 6 m north from (10, 80): the 7 m between are a straight line."""
    first, second = world(0, 73, 0.0), world(10, 80, 0.5 * math.pi)
    shape = f"<ClothoidSpline>{part(first, 10)}{part(second, 4)}{part('', 2)}</ClothoidSpline>"
    out = told((follow(shape), after(1.0)))
    for seconds, wanted in (
        (1.5, (5.0, 73.0)),
        (2.3, (10.0, 76.0)),
        (3.0, (10.0, 83.0)),
    ):
        assert place(out, seconds)[:2] == pytest.approx(wanted, abs=0.51)
    assert place(out, 3.0)[2] == pytest.approx(0.5 * math.pi)
    chain = part(first, 10, 0.0) + part(second, 4, 2.0) + part("", 2, 4.0)
    shape = f'<ClothoidSpline timeEnd="5">{chain}</ClothoidSpline>'
    out = told((follow(shape, RELATIVE), after(1.0)))
    assert place(out, 2.0)[:2] == pytest.approx((5.0, 73.0), abs=0.3)
    assert place(out, 3.0)[:2] == pytest.approx((10.0, 80.0), abs=0.01)
    assert place(out, 5.0)[:2] == pytest.approx((10.0, 84.0), abs=0.01)
    assert place(out, 5.95)[:2] == pytest.approx((10.0, 85.9), abs=0.01)


def test_a_sharp_bend_of_no_length_is_none():
    chain = "".join(
        f'<ClothoidSplineSegment curvatureStart="0" curvatureEnd="{k}" length="{length}"/>'
        for k, length in ((1e7, 1e-300), (0.0, 10.0), (1e3, 1e-7), (0.0, 10.0))
    )
    out = told((follow(f"<ClothoidSpline>{chain}</ClothoidSpline>"), after(1.0)))
    assert out.status[0] == 0
    assert place(out, 2.0)[:2] == pytest.approx((-1.75, 83.0), abs=0.01)


def test_a_lane_change_ends_it():
    change = """<LateralAction><LaneOffsetAction continuous="false"><LaneOffsetActionDynamics
dynamicsShape="step"/><LaneOffsetTarget><AbsoluteTargetLaneOffset value="0"/></LaneOffsetTarget>
</LaneOffsetAction></LateralAction>"""
    shape = follow(line(vertex(beside(0)), vertex(beside(-80, 2.0))))
    out = told((shape, after(1.0)), (change, after(3.0)))
    assert out.status[0] == 0


def test_backwards_along_a_trajectory_goes_tail_first():
    """At -2 m/s from (4, 93) to (-4, 93): its nose points east."""
    back = start("bv", lane(3, 1, 90.0), -2.0)
    for shape in (
        line(vertex(road(80, -4)), vertex(road(80, 4))),
        line(vertex(world(4, 93)), vertex(world(-4, 93))),
    ):
        out = told((follow(shape), after(0.0)), bv=back)
        x, y, h = place(out, 2.0)
        assert (x, y) == pytest.approx((0.0, 93.0), abs=0.11)
        assert math.remainder(h, math.tau) == pytest.approx(0.0, abs=1e-9)
        assert out.v[0, 1, 40] == -2.0


@pytest.mark.parametrize("laid", [True, False])
def test_who_came_tail_first_goes_back_the_way_it_came(laid):
    """From -4 m/s at 2 m/s²: 4 m on in 2 s, back in 2 s, and on over where it began."""
    ends = (road(60, 0), road(60, 40)) if laid else (world(0, 73), world(-40, 73))
    shape = follow(line(*(vertex(one) for one in ends)))
    back = start("bv", lane(3, 1, 90.0), -4.0)
    forward = speeding(6.0, "linear rate 2")
    out = told((shape, after(0.0)), (forward, after(0.0)), bv=back)
    for seconds, x in ((1.0, -3.0), (2.0, -4.0), (3.0, -3.0), (4.0, 0.0), (5.0, 5.0)):
        assert place(out, seconds)[0] == pytest.approx(x, abs=0.25)  # it begins an instant later
    assert np.diff(out.h[0, 1, 2:]) == pytest.approx(0.0, abs=1e-9)  # its nose points east
    moved = np.hypot(np.diff(out.x[0, 1, 2:]), np.diff(out.y[0, 1, 2:]))
    v = out.v[0, 1, 2:]
    assert moved == pytest.approx(0.05 * np.abs(v[:-1] + v[1:]) / 2, abs=2e-3)


def test_an_initial_trajectory_may_be_followed_tail_first():
    shape = follow(line(vertex(world(-1.75, 103)), vertex(world(-1.75, 63))))
    bv = f"""<Private entityRef="bv"><PrivateAction>{shape}</PrivateAction>
<PrivateAction>{speeding(-5.0, "step time 0")}</PrivateAction></Private>"""
    out = told(bv=bv)
    assert place(out, 0.0)[2] == pytest.approx(0.5 * math.pi)
    x, y, h = place(out, 4.0)
    assert (x, y, h) == pytest.approx((-1.75, 83.0, 0.5 * math.pi))


def test_backwards_along_a_lane_ends_where_its_way_begins():
    """From 2 s on -1 m/s² to -3 m/s; 30 m are behind it to the road's end at y = 113."""
    slow = start("bv", lane(3, 1, 90.0), 0.0)
    out = told((speeding(-3.0, "linear rate 1"), after(2.0)), bv=slow)
    x, y, h = place(out, 6.0)
    assert (x, y) == pytest.approx((-1.75, 103.0 + 4.5 + 3.0))
    assert math.remainder(h - SOUTH, math.tau) == pytest.approx(0.0, abs=1e-9)
    assert place(out, 9.0)[1] == pytest.approx(113.0, abs=1e-6)
    assert out.v[0, 1, 180] == 0.0


def test_a_driver_takes_the_trajectory_of_its_ego_for_its_way():
    """By the declared numbers: these cannot vary then. Without a driver, they can."""
    shape = ARC.format(k=0.05, l="$l").replace("/>", STARTS, 1)
    ego = f"""<Private entityRef="ego"><PrivateAction>{follow(shape)}</PrivateAction>
<PrivateAction>{speeding(5.0, "step time 0")}</PrivateAction></Private>"""
    far = start("bv", lane(3, 1, 20.0), 0.0)
    text = scenario(("ego", "bv"), ego + far, parameters=number("l", 31.4159))
    driven = run(text, "route-follower")
    k = round(10.0 * math.pi / 5.0 / 0.05)
    assert float(driven.x[0, 0, k]) == pytest.approx(20.0, abs=0.3)
    assert float(driven.y[0, 0, k]) == pytest.approx(70.0, abs=0.3)
    assert "l" in simulator(text, "route-follower").fixed
