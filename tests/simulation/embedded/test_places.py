"""Where entities are put and where they go, on the generated crossroads, worked by hand.

Leg C's road 3 runs north from the junction: lane 1 leads south at x = -1.75, s counts from the
junction's edge at y = 13. Lane -1 leads north at x = 1.75.
"""

import math

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, UnsupportedError
from bridgegen.engine.simulate import simulate_file
from bridgegen.simulation.rollout import STATUS_MESSAGES

from .storyboards import (
    after,
    events,
    lane,
    lateral,
    reaches,
    run,
    scenario,
    speeding,
    start,
)

EGO = start("ego", lane(1, 1, 90.0), 0.0)
DT = 0.05
THIRD = lane(3, 1, 50.0)


def position(tag, turn="", **numbers):
    words = " ".join(f'{name}="{value}"' for name, value in numbers.items())
    return f"<Position><{tag} {words}>{turn}</{tag}></Position>"


def orientation(h, kind="relative"):
    return f'<Orientation type="{kind}" h="{h}"/>'


def placed(where, speed=0.0, *rows, other=THIRD, parameters="", ego=EGO, **values):
    """The bv somewhere, at first; the third, if it matters, 50 m up the road, southbound."""
    third = start("third", other, 0.0)
    text = scenario(("ego", "bv", "third"), ego + third + start("bv", where, speed),
                    events(*rows), parameters=parameters)  # fmt: skip
    return run(text, **values)


def pose(rollout, k=0, e=1, row=0):
    return tuple(float(array[row, e, k]) for array in (rollout.x, rollout.y, rollout.h))


def there(rollout, x, y, h, k=0):
    found = pose(rollout, k)
    assert found[:2] == (pytest.approx(x, abs=1e-6), pytest.approx(y, abs=1e-6))
    assert math.remainder(found[2] - h, math.tau) == pytest.approx(0.0, abs=1e-6)


SOUTH, NORTH, WEST = -math.pi / 2, math.pi / 2, math.pi


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        (position("WorldPosition", x=3.0, y=4.0, h=1.0), (3.0, 4.0, 1.0)),
        (position("LanePosition", roadId=3, laneId=2, s=20, offset=0.5), (-5.75, 33.0, SOUTH)),
        (position("LanePosition", orientation(math.pi), roadId=3, laneId=1, s=20),
         (-1.75, 33.0, NORTH)),
        (position("LanePosition", orientation(0.1), roadId=3, laneId=1, s=20),
         (-1.75, 33.0, SOUTH + 0.1)),
        (position("LanePosition", orientation(2.0, "absolute"), roadId=3, laneId=1, s=20),
         (-1.75, 33.0, 2.0)),
        (position("RoadPosition", roadId=3, s=20, t=1.0), (-1.0, 33.0, NORTH)),
        (position("RoadPosition", orientation(math.pi), roadId=3, s=20, t=1.75),
         (-1.75, 33.0, SOUTH)),
        (position("RelativeWorldPosition", entityRef="third", dx=2.0, dy=-3.0),
         (0.25, 60.0, SOUTH)),
        (position("RelativeObjectPosition", orientation(0.3), entityRef="third", dx=2.0, dy=-3.0),
         (-4.75, 61.0, SOUTH + 0.3)),
        (position("RelativeRoadPosition", entityRef="third", ds=-10.0, dt=-3.5),
         (1.75, 53.0, NORTH)),
        (position("RelativeLanePosition", entityRef="third", dLane=1, ds=5.0, offset=0.25),
         (-5.5, 68.0, SOUTH)),
        (position("RelativeLanePosition", entityRef="third", dLane=-1, dsLane=5.0, offset=0.25),
         (-5.0, 58.0, SOUTH)),
        (position("RelativeLanePosition", entityRef="third", dLane=1, dsLane=-5.0),
         (1.75, 68.0, NORTH)),
    ],
)  # fmt: skip
def test_positions(where, expected):
    rollout = placed(where)
    assert rollout.status[0] == 0
    there(rollout, *expected)


@pytest.mark.parametrize(
    "where",
    [
        position("RelativeLanePosition", entityRef="third", dLane=1, ds=5.0),
        position("RelativeObjectPosition", entityRef="third", dx=12.0, dy=1.0),
        position("WorldPosition", x=-1.5, y=40.0, h=SOUTH),
        position("RoadPosition", roadId=3, s=10, t=-2.0),
    ],
)
def test_a_teleport_is_there_at_the_next_instant_and_goes_on_from_there(where):
    at_first = placed(where, 8.0)
    act = (f"<TeleportAction>{where}</TeleportAction>",)
    rollout = placed(lane(1, -1, 30.0), 8.0, ("e", "bv", act[0], after(1.0)))
    k = round(1.0 / DT) + 1
    for array, one in ((rollout.x, at_first.x), (rollout.y, at_first.y), (rollout.h, at_first.h)):
        shift = array[0, 1, k] - one[0, 1, 0]  # headings may count whole turns anew
        np.testing.assert_allclose(array[0, 1, k:], one[0, 1, : 201 - k] + shift, atol=1e-9)
    assert pose(rollout, k)[:2] == pytest.approx(pose(at_first)[:2], abs=1e-9)
    assert (rollout.v[0, 1] == 8.0).all()


def test_there_and_back():
    """Who is put elsewhere and then back goes on as if it had stayed where it was put."""
    away = position("WorldPosition", x=300.0, y=300.0, h=0.0)
    back = position("LanePosition", roadId=3, laneId=1, s=80)
    rollout = placed(
        lane(3, 1, 80.0), 5.0,
        ("away", "bv", f"<TeleportAction>{away}</TeleportAction>", after(1.0)),
        ("back", "bv", f"<TeleportAction>{back}</TeleportAction>", after(2.0)),
    )  # fmt: skip
    k = round(2.0 / DT) + 1
    there(rollout, 300.0, 300.0, 0.0, round(1.0 / DT) + 1)
    stayed = placed(lane(3, 1, 80.0), 5.0)
    np.testing.assert_allclose(rollout.y[0, 1, k:], stayed.y[0, 1, : 201 - k], atol=1e-9)
    np.testing.assert_allclose(rollout.x[0, 1, k:], stayed.x[0, 1, : 201 - k], atol=1e-9)


def test_off_the_lanes_one_goes_straight_ahead():
    rollout = placed(position("WorldPosition", x=40.0, y=40.0, h=0.6), 5.0)
    far = 5.0 * 10.0
    there(rollout, 40 + far * math.cos(0.6), 40 + far * math.sin(0.6), 0.6, -1)


def test_the_present_pose_of_another_counts():
    """2 m ahead of and 1 m to the left of the third, which has moved for two seconds."""
    ahead = position("RelativeObjectPosition", entityRef="third", dx=2.0, dy=1.0)
    rollout = placed(
        lane(1, -1, 30.0), 0.0,
        ("go", "third", speeding(5.0, "step time 0"), after(0.0)),
        ("e", "bv", f"<TeleportAction>{ahead}</TeleportAction>", after(2.0)),
    )  # fmt: skip
    k = round(2.0 / DT)
    x, y, _ = pose(rollout, k, 2)
    there(rollout, x + 1.0, y - 2.0, SOUTH, k + 1)


def test_rows_may_vary_a_position():
    where = position("RelativeLanePosition", entityRef="third", dLane=0, ds="$gap")
    parameter = '<ParameterDeclaration name="gap" parameterType="double" value="5"/>'
    rollout = placed(where, parameters=parameter, gap=[5.0, 10.0, -20.0])
    for row, gap in enumerate((5.0, 10.0, -20.0)):
        assert pose(rollout, row=row)[:2] == pytest.approx((-1.75, 63.0 + gap), abs=1e-6)
        alone = placed(where, parameters=parameter, gap=[gap])
        assert pose(alone) == pose(rollout, row=row)


def test_a_position_that_is_nowhere():
    with refuses(InputError, "test.xosc", "road 3"):
        placed(position("LanePosition", orientation(math.pi), roadId=3, laneId=7, s=20))
    rollout = placed(position("RelativeLanePosition", entityRef="third", dLane=9, ds=0))
    approve(STATUS_MESSAGES[int(rollout.status[0])])


def test_straight_on_across_the_junction():
    """Without a route, the way leads to the opposite leg."""
    rollout = placed(lane(3, 1, 20.0), 10.0)
    assert rollout.y[0, 1, -1] == pytest.approx(33.0 - 100.0, abs=1e-6)
    assert rollout.x[0, 1, -1] == pytest.approx(-1.75, abs=1e-6)


def test_a_lane_that_is_not_the_own_may_be_driven_against_its_traffic():
    where = position("LanePosition", orientation(math.pi), roadId=3, laneId=1, s=20)
    rollout = placed(where, 10.0)
    assert rollout.y[0, 1, 100] == pytest.approx(33.0 + 50.0, abs=1e-6)


def routing(*places):
    waypoints = "".join(f'<Waypoint routeStrategy="shortest">{one}</Waypoint>' for one in places)
    return f"""<RoutingAction><AssignRouteAction><Route name="r" closed="false">{waypoints}
</Route></AssignRouteAction></RoutingAction>"""


def acquiring(place):
    return f"<RoutingAction><AcquirePositionAction>{place}</AcquirePositionAction></RoutingAction>"


@pytest.mark.parametrize("action", [
    routing(lane(3, 1, 80.0), lane(4, -1, 40.0)),
    acquiring(lane(4, -1, 40.0)),
    acquiring(position("RoadPosition", roadId=4, s=40, t=-1.0)),
    acquiring(position("WorldPosition", x=53.0, y=-1.75, h=0.0)),
])  # fmt: skip
def test_a_route_at_run_time_leads_round_the_corner(action):
    """From leg C to leg D in the east: left at the junction, then on along the leg."""
    rollout = placed(lane(3, 1, 80.0), 15.0, ("e", "bv", action, after(1.0)))
    plain = placed(lane(3, 1, 80.0), 15.0, ego=EGO)
    k = round(1.0 / DT)
    np.testing.assert_array_equal(rollout.y[0, 1, : k + 1], plain.y[0, 1, : k + 1])
    assert rollout.x[0, 1, -1] > 20.0
    assert math.remainder(rollout.h[0, 1, -1], math.tau) == pytest.approx(0.0, abs=1e-6)
    steps = np.hypot(np.diff(rollout.x[0, 1]), np.diff(rollout.y[0, 1]))
    np.testing.assert_allclose(steps, 15.0 * DT, rtol=2e-3)


def test_a_lane_change_keeps_the_route():
    """On the outer lane there is no way to the left: the way goes straight on, and no row fails."""
    route = routing(lane(3, 1, 80.0), lane(4, -1, 40.0))
    rollout = placed(
        lane(3, 1, 80.0), 10.0,
        ("r", "bv", route, after(0.5)),
        ("e", "bv", lateral(-1, "linear time 1", "bv"), after(1.0)),
        ("f", "bv", lateral(1, "linear time 1", "bv"), after(3.0)),
    )  # fmt: skip
    assert rollout.status[0] == 0
    assert rollout.x[0, 1, -1] > 5.0


def test_a_route_that_cannot_be_reached_fails_the_row():
    """Leg C's inbound lane is not reached from its own outbound one, which leaves the network."""
    text = placed(lane(3, -1, 50.0), 5.0, ("e", "bv", acquiring(lane(4, -1, 40.0)), after(1.0)))
    message = "no lane leads from where an entity is to its route"
    assert STATUS_MESSAGES[int(text.status[0])] == message


def seen_at(where, *rows, who="bv", tolerance=1.0, speed=5.0, at=None, parameters="", **values):
    """Return when the bv, southbound from s = 80, reaches a position, by row."""
    arrived = ("seen", "ego", speeding(0.0, "step time 0"), reaches(who, where, tolerance))
    cars = start("bv", lane(3, 1, 80.0), speed) + start("third", at or THIRD, 0.0)
    text = scenario(("ego", "bv", "third"), EGO + cars, events(*rows, arrived),
                    parameters=parameters)  # fmt: skip
    return run(text, ego=None, **values).began[:, -1]


@pytest.mark.parametrize(
    ("where", "metres"),
    [
        # the third stands at s = 50, 30 m ahead: so many metres until it is within 1 m
        (position("RelativeObjectPosition", entityRef="third", dx=5.0, dy=0.0), 34.0),
        (position("RelativeLanePosition", entityRef="third", dLane=0, ds=5.0), 24.0),
        (position("RelativeRoadPosition", entityRef="third", ds=-5.0, dt=0.0), 34.0),
        (position("RoadPosition", roadId=3, s=70, t=-1.75 + 3.5), 9.0),
        (position("LanePosition", orientation(1.0), roadId=3, laneId=1, s=70), 9.0),
        (position("RelativeWorldPosition", entityRef="third", dx=0.0, dy=10.0), 19.0),
    ],
)
def test_conditions_look_where_positions_are_now(where, metres):
    found = seen_at(where)
    assert found[0] == pytest.approx(metres / 5.0 / DT, abs=1.01)


def test_a_condition_s_position_moves_with_who_it_counts_from():
    """2 m ahead of the third, which leaves at 1 s with 2 m/s: 31 - 5·t - 2·(t - 1) m to go."""
    go = ("go", "third", speeding(-2.0 + 4.0, "step time 0"), after(1.0))
    ahead = position("RelativeObjectPosition", entityRef="third", dx=2.0, dy=0.0)
    found = seen_at(ahead, go)
    # both go south: the gap of 32 m shrinks by 5 m in the first second, then by 3 m/s, to 1 m
    assert found[0] == pytest.approx((1.0 + (32.0 - 5.0 - 1.0) / 3.0) / DT, abs=1.01)


def test_rows_may_vary_a_condition_s_position():
    where = position("LanePosition", roadId=3, laneId=1, s="$there")
    parameter = '<ParameterDeclaration name="there" parameterType="double" value="70"/>'
    found = seen_at(where, parameters=parameter, there=[70.0, 60.0, 30.0])
    assert found == pytest.approx(np.array([9.0, 19.0, 49.0]) / 5.0 / DT, abs=1.01)


def test_a_condition_on_a_position_that_is_nowhere_is_not_met():
    where = position("RelativeLanePosition", entityRef="third", dLane=9, ds=0.0)
    assert seen_at(where, tolerance=1000.0)[0] == -1


def test_a_route_position_of_an_entity_is_where_it_is():
    where = f"""<Position><RoutePosition><RouteRef><Route name="r" closed="false">
<Waypoint routeStrategy="shortest">{lane(3, 1, 80.0)}</Waypoint>
<Waypoint routeStrategy="shortest">{lane(1, -1, 80.0)}</Waypoint></Route></RouteRef>
<InRoutePosition><FromCurrentEntity entityRef="third"/></InRoutePosition></RoutePosition>
</Position>"""
    assert seen_at(where)[0] == pytest.approx(29.0 / 5.0 / DT, abs=1.01)
    there(placed(where), -1.75, 63.0, SOUTH)


@pytest.mark.parametrize(
    ("where", "expected"),
    [
        ('FromLaneCoordinates pathS="30" laneId="2" laneOffset="0.5"', (-5.75, 63.0, SOUTH)),
        ('FromLaneCoordinates pathS="30" laneId="-2" laneOffset="-0.5"', (-5.75, 63.0, SOUTH)),
        ('FromRoadCoordinates pathS="30" t="5.75"', (-5.75, 63.0, SOUTH)),
        ('FromLaneCoordinates pathS="140" laneId="-1"', (-1.75, -47.0, SOUTH)),
        ('FromLaneCoordinates pathS="140" laneId="1" laneOffset="0.5"', (2.25, -47.0, SOUTH)),
    ],
)
def test_a_position_on_a_route_is_on_a_lane_along_the_route(where, expected):
    """The route leads south from s = 80 on road 3 at y = 93, on road 1 down from y = -13.

    Left is that of the reference line: west on road 3. Lanes -1 and -2 there lead north, so those
    ids and their offsets count from the route, which has them on its right.
    """
    text = f"""<Position><RoutePosition><RouteRef><Route name="r" closed="false">
<Waypoint routeStrategy="shortest">{lane(3, 1, 80.0)}</Waypoint>
<Waypoint routeStrategy="shortest">{lane(1, -1, 80.0)}</Waypoint></Route></RouteRef>
<InRoutePosition><{where}/></InRoutePosition></RoutePosition></Position>"""
    there(placed(text), *expected)


@pytest.mark.parametrize("x", [-2.5, -1.75, -1.0])
@pytest.mark.parametrize("y", [-12.95, -12.6, -12.05])
def test_a_body_just_before_a_lane_is_where_it_is_put(x, y):
    """Road 1 begins at y = -13, for who travels south; a connecting lane ends there."""
    there(placed(position("WorldPosition", x=x, y=y, h=SOUTH)), x, y, SOUTH)
    back = placed(position("WorldPosition", x=x, y=y, h=SOUTH), 4.0)
    assert pose(back, round(2.0 / DT))[:2] == pytest.approx((x, y - 8.0), abs=1e-2)


def test_a_lane_of_a_route_that_is_no_number():
    text = f"""<Position><RoutePosition><RouteRef><Route name="r" closed="false">
<Waypoint routeStrategy="shortest">{lane(3, 1, 80.0)}</Waypoint>
<Waypoint routeStrategy="shortest">{lane(1, -1, 80.0)}</Waypoint></Route></RouteRef>
<InRoutePosition><FromLaneCoordinates pathS="30" laneId="left"/></InRoutePosition></RoutePosition>
</Position>"""
    with refuses(UnsupportedError):
        placed(text)


def test_acquiring_a_position_is_over_when_it_is_reached():
    """At 15 m/s from s = 80 on: at s = 20, 60 m on, after 4 s."""
    over = """<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="e"
state="completeState"/></ByValueCondition></Condition>"""
    act = acquiring(lane(3, 1, 20.0))
    rollout = placed(
        lane(3, 1, 80.0), 15.0, ("e", "bv", act, after(1.0)),
        ("then", "bv", speeding(1.0, "step time 0"), over),
    )  # fmt: skip
    assert rollout.began[0, 1] == pytest.approx(4.0 / DT, abs=1.01)
    replaced = placed(
        lane(3, 1, 80.0), 15.0, ("e", "bv", act, after(1.0)),
        ("f", "bv", routing(lane(3, 1, 80.0), lane(1, -1, 40.0)), after(2.0)),
        ("then", "bv", speeding(1.0, "step time 0"), over),
    )  # fmt: skip
    assert replaced.began[0, 2] == pytest.approx(2.0 / DT, abs=1.01)


@pytest.mark.parametrize("target", [
    position("RelativeObjectPosition", entityRef="third", dx=0.0, dy=0.0),
    position("RelativeLanePosition", entityRef="third", dLane=0, ds=0.0),
    position("RoadPosition", roadId=3, s=50, t=-1.75 + 3.5),
    lane(3, 1, 50.0),
])  # fmt: skip
def test_synchronising_at_positions_of_all_kinds(target):
    """The ego is 40 m from its place at 8 m/s, the bv 30 m from its own: 5 s, so 6 m/s."""
    own = position("RoadPosition", roadId=1, s=50, t=1.75)
    tags = {"TargetPositionMaster": own, "TargetPosition": target}
    places = "".join(
        f"<{tag}>{place.removeprefix('<Position>').removesuffix('</Position>')}</{tag}>"
        for tag, place in tags.items()
    )
    sync = f'<SynchronizeAction masterEntityRef="ego">{places}</SynchronizeAction>'
    rollout = placed(
        lane(3, 1, 80.0), 6.0, ("s", "bv", sync, after(0.0)), ego=start("ego", lane(1, 1, 90), 8.0)
    )
    assert rollout.y[0, 1, 100] == pytest.approx(63.0, abs=0.2)


@pytest.mark.parametrize(
    "driver", ["route-follower", "reference", "un-r157", "fsm", "careful", "careful-fsm"]
)
def test_an_ego_with_a_driver_is_put_elsewhere_and_goes_on(driver):
    """From leg A's inbound lane to leg C's, where it goes on south at the speed that it had."""
    act = f"<TeleportAction>{lane(3, 1, 80.0)}</TeleportAction>"
    text = scenario(("ego",), start("ego", lane(1, 1, 90.0), 8.0),
                    events(("e", "ego", act, after(1.0))))  # fmt: skip
    rollout = run(text, ego=driver)
    k = round(1.0 / DT) + 1
    assert pose(rollout, k, 0)[:2] == pytest.approx((-1.75, 93.0), abs=1e-6)
    assert math.remainder(pose(rollout, k, 0)[2] - SOUTH, math.tau) == pytest.approx(0.0, abs=1e-6)
    assert rollout.v[0, 0, k] == rollout.v[0, 0, k - 1]
    after_it = rollout.y[0, 0, k + 1 : k + 60]
    assert (np.diff(after_it) < 0.0).all()
    assert np.abs(rollout.x[0, 0, k : k + 60] + 1.75).max() < 0.05
    assert np.abs(rollout.offset[0, 0, k : k + 60]).max() < 0.05


def test_an_ego_with_a_driver_takes_a_route_at_run_time():
    """From leg C left to leg D in the east, though it began with no route."""
    act = routing(lane(3, 1, 80.0), lane(4, -1, 40.0))
    rollout = run(
        scenario(("ego",), start("ego", lane(3, 1, 40.0), 8.0), events(("e", "ego", act, after(1))))
    )
    assert rollout.status[0] == 0
    assert rollout.x[0, 0, -1] > 0.0
    assert math.remainder(rollout.h[0, 0, -1], math.tau) == pytest.approx(0.0, abs=0.1)


def test_an_ego_with_a_driver_needs_a_lane():
    away = position("WorldPosition", x=300.0, y=300.0, h=0.0)
    act = f"<TeleportAction>{away}</TeleportAction>"
    rollout = run(
        scenario(("ego",), start("ego", lane(3, 1, 60.0), 8.0), events(("e", "ego", act, after(1))))
    )
    assert rollout.status[0] != 0
    assert "lane" in STATUS_MESSAGES[int(rollout.status[0])]
    assert rollout.n_steps[0] == round(1.0 / DT) + 1


def test_a_second_teleport_at_the_start_counts_from_the_first():
    """40 m up the road, and 15 m on from there, towards the junction; half a second later 5 m."""
    more = position("RelativeLanePosition", entityRef="bv", dLane=0, dsLane=15)
    more = f"<PrivateAction><TeleportAction>{more}</TeleportAction></PrivateAction></Private>"
    bv = start("bv", lane(3, 1, 40.0), 10.0).replace("</Private>", more)
    rollout = run(scenario(("ego", "bv"), EGO + bv))
    assert pose(rollout)[:2] == pytest.approx((-1.75, 13.0 + 25.0), abs=1e-6)
    assert pose(rollout, 10)[1] == pytest.approx(13.0 + 20.0, abs=1e-6)


NOWHERE = """<OpenDRIVE><header revMajor="1" revMinor="7"/></OpenDRIVE>"""


@pytest.mark.parametrize("network", ["", '<LogicFile filepath="map.xodr"/>'])
def test_without_roads_everybody_goes_by_the_world(tmp_path, network):
    """A file may name no map, or one without roads: ahead is where a body's nose points."""
    ahead = position("WorldPosition", x=10, y=20, h=math.pi / 2)
    privates = start("ego", ahead, 2.0) + start("bv", position("WorldPosition", x=0, y=0), 0.0)
    text = scenario(("ego", "bv"), privates)
    (tmp_path / "map.xodr").write_text(NOWHERE)
    file = tmp_path / "s.xosc"
    file.write_text(text.replace('<LogicFile filepath="map.xodr"/>', network))
    rollout = simulate_file(file).rollout
    assert rollout.status[0] == 0
    assert rollout.x[0, 0] == pytest.approx(10.0)
    assert rollout.y[0, 0, 200] == pytest.approx(40.0)
    file.write_text(text.replace("map.xodr", "none.xodr"))
    with refuses(InputError, "none.xodr"):
        simulate_file(file)


def test_a_route_may_change_lane_after_the_start():
    """Lane 1 at x = -1.75, lane 2 at -5.25: 60 m from s = 80 on are a change between them."""
    route = start("bv", lane(3, 1, 80.0), 10.0, lane(3, 1, 80.0), lane(3, 2, 10.0))
    text = scenario(("ego", "bv"), EGO + route, events())
    rollout = run(text)
    x, y = rollout.x[0, 1], rollout.y[0, 1]
    assert pose(rollout)[:2] == (pytest.approx(-1.75, abs=1e-4), pytest.approx(93.0))
    for s, at in ((50.0, -3.5), (65.0, -1.75 - 3.5 * 5 / 32), (20.0, -5.25), (5.0, -5.25)):
        assert np.interp(-(13.0 + s), -y, x) == pytest.approx(at, abs=2e-3)
    steps = np.hypot(np.diff(x), np.diff(y))
    np.testing.assert_allclose(steps, 0.5, atol=1e-3)  # 10 m/s along its path
