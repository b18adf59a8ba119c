"""What must not change: a scene turned and moved as a whole, mirrored, planned anew, cut into rows.

The story uses what depends on the roads: a route, positions of several kinds, a lane change, an
offset, a trajectory and conditions on them.
"""

import math
from dataclasses import replace

import numpy as np
import pytest

from bridgegen.openx.opendrive.model import OpenDrive

from .storyboards import (
    after,
    condition,
    crossroads,
    events,
    lane,
    lateral,
    scenario,
    simulator,
    speeding,
    start,
)

NAMES = ("ego", "bv", "cv")


def moved(model: OpenDrive, angle: float, dx: float, dy: float) -> OpenDrive:
    """The road network, turned about the origin and then moved."""
    c, s = math.cos(angle), math.sin(angle)
    roads = [
        replace(
            road,
            plan_view=tuple(
                replace(
                    one, x=c * one.x - s * one.y + dx, y=s * one.x + c * one.y + dy,
                    hdg=one.hdg + angle,
                )
                for one in road.plan_view
            ),
        )
        for road in model.roads
    ]  # fmt: skip
    return replace(model, roads=tuple(roads))


def offset(metres: float) -> str:
    return f"""<LateralAction><LaneOffsetAction continuous="false"><LaneOffsetActionDynamics
dynamicsShape="cubic" maxLateralAcc="1"/><LaneOffsetTarget><AbsoluteTargetLaneOffset
value="{metres}"/></LaneOffsetTarget></LaneOffsetAction></LateralAction>"""


def aside(metres: float) -> str:
    return f"""<LateralAction><LateralDistanceAction entityRef="cv" distance="{metres}"
freespace="false" continuous="true" displacement="any" coordinateSystem="entity">
<DynamicConstraints maxAcceleration="1" maxDeceleration="1" maxSpeed="1"/></LateralDistanceAction>
</LateralAction>"""


def story() -> str:
    """The bv changes lane, comes back and turns left; the cv goes aside, and is put behind it."""
    back = """<TeleportAction><Position><RelativeLanePosition entityRef="bv" dLane="0"
dsLane="-20"/></Position></TeleportAction>"""
    near = condition(
        "bv",
        """<DistanceCondition value="60" freespace="true" rule="lessThan"
coordinateSystem="lane" relativeDistanceType="longitudinal"><Position><RelativeObjectPosition
entityRef="ego" dx="0" dy="0"/></Position></DistanceCondition>""",
    )
    clear = condition(
        "bv",
        """<RelativeClearanceCondition distanceForward="10" distanceBackward="30"
freeSpace="true" oppositeLanes="true"/>""",
    )
    rows = (
        ("a", "bv", lateral(-1, "sinusoidal time 2", "bv"), after(0.5)),
        ("g", "bv", lateral(1, "cubic distance 15", "bv"), after(3.0)),
        ("b", "cv", offset(0.8), after(1.0)),
        ("c", "bv", speeding(5.0, "linear time 2"), near),
        ("d", "cv", back, after(4.0)),
        ("e", "bv", aside(1.0), after(5.0)),
        ("f", "cv", speeding(12.0, "cubic time 3"), clear),
    )
    privates = (
        start("ego", lane(4, -1, 60.0), 0.0)
        + start("bv", lane(3, 1, 70.0), 9.0, lane(3, 1, 70.0), lane(4, -1, 80.0))
        + start("cv", lane(3, 1, 95.0), 11.0)
    )
    return scenario(NAMES, privates, events(*rows))


@pytest.fixture(scope="module")
def plain():
    made = simulator(story(), None)
    rollout = made.run(made.roads([crossroads()]), np.zeros(1, dtype=np.int64), {})
    assert rollout.status[0] == 0
    assert (rollout.began[0] >= 0).all()  # every event happens
    return rollout


@pytest.mark.parametrize(
    ("angle", "dx", "dy"), [(0.7, 0.0, 0.0), (-2.1, 310.0, -170.0), (math.pi, 5.0, 0.0)]
)
def test_turning_and_moving_all_changes_nothing(plain, angle, dx, dy):
    made = simulator(story(), None)
    roads = made.roads([moved(crossroads(), angle, dx, dy)])
    other = made.run(roads, np.zeros(1, dtype=np.int64), {})
    assert (other.began == plain.began).all()
    np.testing.assert_allclose(other.v, plain.v, atol=1e-8)
    c, s = math.cos(angle), math.sin(angle)
    np.testing.assert_allclose(other.x, c * plain.x - s * plain.y + dx, atol=1e-7)
    np.testing.assert_allclose(other.y, s * plain.x + c * plain.y + dy, atol=1e-7)
    turn = np.remainder(other.h - plain.h - angle + math.pi, math.tau) - math.pi
    np.testing.assert_allclose(turn, 0.0, atol=1e-8)


def test_ways_that_are_known_already_are_the_ways_that_are_asked_for(plain):
    """The same network serves a second run, which asks for nothing any more."""
    made = simulator(story(), None)
    roads = made.roads([crossroads()])
    for _ in range(2):
        again = made.run(roads, np.zeros(1, dtype=np.int64), {})
        for field in ("x", "y", "h", "v", "a", "began"):
            np.testing.assert_array_equal(getattr(again, field), getattr(plain, field))


def test_rows_do_not_depend_on_one_another(plain):
    """The same row many times over, over two networks of which one is turned."""
    made = simulator(story(), None)
    roads = made.roads([crossroads(), moved(crossroads(), 0.7, 0.0, 0.0)])
    rows = np.array([0, 1, 0, 0, 1])
    many = made.run(roads, rows, {})
    for i in np.flatnonzero(rows == 0):
        for field in ("x", "y", "h", "v", "a", "began"):
            np.testing.assert_array_equal(getattr(many, field)[i], getattr(plain, field)[0])
    np.testing.assert_array_equal(many.x[1], many.x[4])
