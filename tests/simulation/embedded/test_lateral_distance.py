"""Distances across the road, by hand: on leg C lane 1 leads south at x = -1.75, lane 2 at -5.25.

The bv drives on lane 1, the cv 30 m ahead of it; west is to their right. A car is 2 m wide.
"""

import math

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError

from .storyboards import after, events, lane, lateral, run, scenario, start

EGO = start("ego", lane(1, 1, 90.0), 0.0)
DT = 0.05
LANE_1, LANE_2 = -1.75, -5.25


def keeping(
    distance=None, side="rightToReferencedEntity", limits="", *, free="false",
    continuous="false", system="lane", to="cv",
):  # fmt: skip
    metres = "" if distance is None else f'distance="{distance}"'
    bounds = f"<DynamicConstraints {limits}/>" if limits else ""
    return f"""<LateralAction><LateralDistanceAction entityRef="{to}" {metres} freespace="{free}"
continuous="{continuous}" displacement="{side}" coordinateSystem="{system}">{bounds}
</LateralDistanceAction></LateralAction>"""


def driven(action, *rows, speed=10.0, other=10.0, ego=None):
    cars = start("bv", lane(3, 1, 95.0), speed) + start("cv", lane(3, 1, 65.0), other)
    text = scenario(("ego", "bv", "cv"), EGO + cars, events(("k", "bv", action, after(1.0)), *rows))
    return run(text, ego=ego)


LIMITS = 'maxAcceleration="2" maxDeceleration="2" maxSpeed="1"'


@pytest.mark.parametrize("system", ["lane", "road", "entity"])
@pytest.mark.parametrize(
    ("side", "free", "x"),
    [
        ("rightToReferencedEntity", "false", LANE_1 - 3.0),
        ("leftToReferencedEntity", "false", LANE_1 + 3.0),
        ("rightToReferencedEntity", "true", LANE_1 - 5.0),
    ],
)
def test_without_limits_it_is_there_at_once(system, side, free, x):
    rollout = driven(keeping(3.0, side, free=free, system=system))
    k = round(1.0 / DT)
    assert rollout.x[0, 1, : k + 1] == pytest.approx(LANE_1)
    assert rollout.x[0, 1, k + 1 : k + 60] == pytest.approx(x)
    assert rollout.y[0, 1, : k + 60] == pytest.approx(13.0 + 95.0 - 10.0 * DT * np.arange(k + 60))


def test_by_acceleration_and_speed():
    """3 m by ±2 m/s² at most 1 m/s: 0.5 s up, 0.5 s down, 0.25 m each, 2.5 s at 1 m/s."""
    rollout = driven(keeping(3.0, limits=LIMITS))
    k = round(1.0 / DT)
    aside = LANE_1 - rollout.x[0, 1]
    assert aside[k + round(0.5 / DT)] == pytest.approx(0.25, abs=0.03)
    assert aside[k + round(1.75 / DT)] == pytest.approx(1.5, abs=0.03)
    assert aside[k + round(3.0 / DT)] == pytest.approx(2.75, abs=0.03)
    assert aside[k + 100 : k + 110] == pytest.approx(3.0, abs=0.01)
    across = np.diff(aside[: k + 100]) / DT
    assert np.abs(across).max() <= 1.0 + 1e-9
    assert np.abs(np.diff(across)).max() <= 2.0 * DT + 1e-9
    steps = np.hypot(np.diff(rollout.x[0, 1]), np.diff(rollout.y[0, 1]))[: k + 100]
    assert steps == pytest.approx(10.0 * DT)  # its speed is along the line that it draws
    turn = rollout.h[0, 1, k + round(1.75 / DT)] - rollout.h[0, 1, 0]
    assert turn == pytest.approx(-math.asin(0.1), abs=1e-9)


def test_a_distance_that_is_not_said_is_the_present_one():
    """The cv changes to lane 2; the bv, 1 m to its left at first, follows it continuously."""
    cars = start("bv", lane(3, 1, 95.0), 10.0) + start("cv", lane(3, 1, 65.0), 10.0)
    rows = (
        ("a", "bv", keeping(1.0, "leftToReferencedEntity"), after(0.5)),
        ("b", "bv", keeping(None, "any", continuous="true"), after(1.0)),
        ("c", "cv", lateral(-1, "sinusoidal time 3", "cv"), after(2.0)),
    )
    rollout = run(scenario(("ego", "bv", "cv"), EGO + cars, events(*rows)), ego=None)
    gap = rollout.x[0, 1] - rollout.x[0, 2]
    assert gap[round(1.0 / DT) :] == pytest.approx(1.0, abs=1e-9)
    assert rollout.x[0, 1, -1] == pytest.approx(LANE_2 + 1.0)


@pytest.mark.parametrize("continuous", ["false", "true"])
def test_it_is_over_when_it_is_reached_or_never(continuous):
    then = """<Condition name="c" delay="0" conditionEdge="none"><ByValueCondition>
<StoryboardElementStateCondition storyboardElementType="event" storyboardElementRef="k"
state="completeState"/></ByValueCondition></Condition>"""
    rollout = driven(
        keeping(1.0, limits=LIMITS, continuous=continuous),
        ("then", "cv", lateral(-1, "linear time 1", "cv"), then),
    )
    began = int(rollout.began[0, -1])
    if continuous == "true":
        assert began == -1
        return
    # 0.5 s up, 0.5 s at 1 m/s, 0.5 s down: 0.25 + 0.5 + 0.25 m
    assert began == pytest.approx((1.0 + 1.5) / DT, abs=4)


def test_left_of_who_comes_the_other_way_is_right_of_the_own():
    """The cv drives north on lane -1 at x = 1.75; 1 m to its left is x = 0.75."""
    cars = start("bv", lane(3, 1, 95.0), 10.0) + start("cv", lane(3, -1, 20.0), 5.0)
    for system in ("lane", "entity"):
        action = keeping(1.0, "leftToReferencedEntity", system=system)
        text = scenario(("ego", "bv", "cv"), EGO + cars, events(("k", "bv", action, after(1.0))))
        assert run(text, ego=None).x[0, 1, 40] == pytest.approx(0.75)


def test_who_stands_does_not_slide():
    rollout = driven(keeping(3.0, limits=LIMITS), speed=0.0)
    assert (rollout.x[0, 1] == rollout.x[0, 1, 0]).all()


def test_refusals():
    own = ("e", "ego", keeping(3.0), after(1.0))
    with refuses(UnsupportedError, "LateralDistanceAction"):
        driven(keeping(3.0), own, ego="route-follower")
    with refuses(UnsupportedError):
        driven(keeping(3.0, limits='maxAcceleration="2" maxAccelerationRate="1"'))
    with pytest.raises(UnsupportedError, match='coordinateSystem="world"'):
        driven(keeping(3.0, system="world"))
