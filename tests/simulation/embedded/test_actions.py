"""The storyboard's actions and conditions, against values worked by hand.

The bv drives south on leg C's inner lane (id 1, x = -1.75 of the inbound side) from 90 m before
the junction; the outer lane is 3.5 m to its right.
"""

import math

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError

from .storyboards import (
    after,
    condition,
    ended,
    events,
    lane,
    lateral,
    run,
    scenario,
    simulator,
    speeding,
    start,
)

EGO = start("ego", lane(1, 1, 90.0), 0.0, lane(1, 1, 90.0), lane(3, -1, 50.0))


def driven(speed, *rows, lane_id=1):
    bv = start("bv", lane(3, lane_id, 90.0), speed)
    return run(scenario(("ego", "bv"), EGO + bv, events(*rows)))


def at(rollout, seconds):
    return round(seconds / rollout.time_step)


@pytest.mark.parametrize(
    ("dynamics", "speed"),
    [
        ("linear time 4", lambda u: 4 + 8 * u),
        ("cubic time 4", lambda u: 4 + 8 * u * u * (3 - 2 * u)),
        ("sinusoidal time 4", lambda u: 4 + 8 * (1 - math.cos(math.pi * u)) / 2),
        # 32 m at a mean of 8 m/s take 4 s
        ("linear distance 32", lambda u: 4 + 8 * u),
        ("sinusoidal distance 32", lambda u: 4 + 8 * (1 - math.cos(math.pi * u)) / 2),
        # the steepest: 2 m/s² times 1, 3/2 and pi/2 of the mean
        ("linear rate 2", lambda u: 4 + 8 * u),
        ("cubic rate 3", lambda u: 4 + 8 * u * u * (3 - 2 * u)),
        (f"sinusoidal rate {math.pi}", lambda u: 4 + 8 * (1 - math.cos(math.pi * u)) / 2),
    ],
)
def test_a_speed_changes_by_its_shape(dynamics, speed):
    rollout = driven(4.0, ("e", "bv", speeding(12.0, dynamics), after(1.0)))
    for u in (0.0, 0.25, 0.5, 0.75, 1.0):
        assert rollout.v[0, 1, at(rollout, 1.0 + 4.0 * u)] == pytest.approx(speed(u), abs=1e-6)
    assert rollout.v[0, 1, at(rollout, 6.0)] == 12.0
    k = at(rollout, 6.0)
    travelled = np.sum((rollout.v[0, 1, :k] + rollout.v[0, 1, 1 : k + 1]) / 2) * rollout.time_step
    assert rollout.y[0, 1, 0] - rollout.y[0, 1, k] == pytest.approx(travelled, abs=1e-6)


def test_there_and_back():
    rollout = driven(
        8.0,
        ("out", "bv", lateral(-1, "sinusoidal time 2"), after(1.0)),
        ("back", "bv", lateral(1, "sinusoidal time 2"), ended("out", delay=1.0)),
    )
    x = rollout.x[0, 1]
    assert x[at(rollout, 3.5)] - x[0] == pytest.approx(-3.5, abs=1e-9)
    assert x[at(rollout, 7.0)] == pytest.approx(x[0], abs=1e-9)
    assert x[at(rollout, 4.0)] == pytest.approx(x[0] - 3.5, abs=1e-9)  # the second begins later


def test_where_there_is_no_lane():
    with refuses(Exception, "lane 9"):
        driven(5.0, ("e", "bv", lateral(9, "linear time 2"), after(1.0)))


def walking(points, *rows, speed=0.0):
    vertices = "".join(
        f'<Vertex><Position><WorldPosition x="{x}" y="{y}"/></Position></Vertex>' for x, y in points
    )
    x, y = points[0]
    walker = f"""<Private entityRef="walker"><PrivateAction><TeleportAction><Position>
<WorldPosition x="{x}" y="{y}" h="0"/></Position></TeleportAction></PrivateAction>
<PrivateAction>{speeding(speed, "step time 0")}</PrivateAction>
<PrivateAction><RoutingAction><FollowTrajectoryAction>
<TimeReference><None/></TimeReference><TrajectoryFollowingMode followingMode="position"/>
<TrajectoryRef><Trajectory name="t" closed="false"><Shape><Polyline>{vertices}</Polyline></Shape>
</Trajectory></TrajectoryRef></FollowTrajectoryAction></RoutingAction></PrivateAction></Private>"""
    return run(scenario(("ego", "walker"), EGO + walker, events(*rows)))


def test_a_walker_waits_then_follows_its_line_and_goes_on_straight():
    rollout = walking(
        [(0.0, 0.0), (3.0, 0.0), (3.0, 4.0)],
        ("e", "walker", speeding(1.0, "step time 0"), after(2.0)),
    )
    x, y, h = (array[0, 1] for array in (rollout.x, rollout.y, rollout.h))
    assert (x[at(rollout, 2.0)], y[at(rollout, 2.0)]) == (0.0, 0.0)
    k = at(rollout, 4.0)
    assert x[k] == pytest.approx(2.0, abs=1e-9)
    assert h[k] == 0.0
    k = at(rollout, 7.0)
    assert (x[k], y[k]) == (pytest.approx(3.0, abs=0.1), pytest.approx(2.0, abs=0.1))
    assert h[k] == pytest.approx(math.pi / 2)
    assert (x[-1], y[-1]) == (pytest.approx(3.0), pytest.approx(5.0))  # 8 m in 8 s
    assert rollout.v[0, 1, -1] == 1.0


def test_conditions_fire_when_they_hold():
    """The bv passes the waiting ego's place at 5 m/s; each condition has its own moment."""
    gap = 180.0 + 26.0  # between the reference points at first: two legs of 90 m and the junction
    for text, seconds in (
        ('<SpeedCondition value="4.9" rule="greaterThan"/>', 0.0),
        ('<TraveledDistanceCondition value="10"/>', 2.0),
        (
            '<TimeHeadwayCondition entityRef="ego" value="40" freespace="false" '
            'relativeDistanceType="euclidianDistance" rule="lessOrEqual"/>',
            (gap - 200.0) / 5.0,
        ),
        (
            '<TimeToCollisionCondition value="40" freespace="false" '
            'relativeDistanceType="euclidianDistance" rule="lessOrEqual">'
            '<TimeToCollisionConditionTarget><EntityRef entityRef="ego"/>'
            "</TimeToCollisionConditionTarget></TimeToCollisionCondition>",
            (gap - 200.0) / 5.0,
        ),
    ):
        rollout = driven(5.0, ("e", "bv", speeding(9.0, "step time 0"), condition("bv", text)))
        fired = int(np.argmax(rollout.v[0, 1] == 9.0)) - 1
        assert fired * rollout.time_step == pytest.approx(seconds, abs=0.11), text


@pytest.mark.parametrize(("duration", "instant"), [(0, 40), (0.05, 41), (2, 80)])
def test_standing_still(duration, instant):
    """It stands from 2 s on, and goes again at 5 s; before, it moved."""
    text = f'<StandStillCondition duration="{duration}"/>'
    rollout = driven(
        5.0,
        ("stop", "bv", speeding(0.0, "linear rate 5"), after(1.0)),
        ("seen", "ego", speeding(0.0, "step time 0"), condition("bv", text)),
        ("go", "bv", speeding(5.0, "step time 0"), after(5.0)),
    )
    assert rollout.v[0, 1, at(rollout, 2.0)] == pytest.approx(0.0, abs=1e-9)
    assert rollout.began[0, 1] == instant


def test_a_later_action_overrides_a_running_one():
    rollout = driven(
        10.0,
        ("slow", "bv", speeding(0.0, "sinusoidal time 8"), after(1.0)),
        ("again", "bv", speeding(10.0, "linear rate 2"), after(5.0)),
    )
    assert rollout.v[0, 1, at(rollout, 5.0)] == pytest.approx(5.0, abs=0.1)
    assert rollout.v[0, 1, at(rollout, 6.0)] == pytest.approx(7.0, abs=0.2)
    assert rollout.v[0, 1, at(rollout, 9.0)] == 10.0


def test_the_road_becomes_slippery():
    """Friction of 0.1 from 2 s on: braking is limited to 0.85 * 9.81 * 0.1 m/s²."""
    wet = (
        """<ManeuverGroup name="w" maximumExecutionCount="1">
<Actors selectTriggeringEntities="false"/><Maneuver name="m"><Event name="rain"
priority="override" maximumExecutionCount="1"><Action name="a"><GlobalAction><EnvironmentAction>
<Environment name="e"><RoadCondition frictionScaleFactor="0.1"/></Environment>
</EnvironmentAction></GlobalAction></Action><StartTrigger><ConditionGroup>"""
        + after(2.0)
        + """
</ConditionGroup></StartTrigger></Event></Maneuver></ManeuverGroup>"""
    )
    ego = start("ego", lane(1, 1, 90.0), 10.0, lane(1, 1, 90.0), lane(3, -1, 50.0))
    slow = events(("s", "ego", speeding(0.0, "step time 0"), after(2.5)))
    rollout = run(scenario(("ego",), ego, wet + slow))
    assert rollout.a[0, 0, at(rollout, 3.0)] == pytest.approx(-0.85 * 9.81 * 0.1, rel=1e-6)


def test_the_ego_changes_no_lane():
    text = scenario(
        ("ego", "bv"), EGO + start("bv", lane(3, 1, 90.0), 1.0),
        events(("e", "ego", lateral(1, "linear time 2", "ego"), after(1.0))),
    )  # fmt: skip
    with refuses(UnsupportedError, "LaneChangeAction"):
        simulator(text)
