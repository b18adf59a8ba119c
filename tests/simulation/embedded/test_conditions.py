"""Conditions on entities: when each is met, worked by hand.

On leg C (road 3, straight, south is inward) lane 1 leads south, lane 2 lies 3.5 m to its right.
A car is 4 m long and 2 m wide, its box's centre 1.4 m ahead of its reference point.
"""

import math

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError

from .storyboards import after, condition, events, lane, run, scenario, speeding, start

EGO = start("ego", lane(1, 1, 90.0), 0.0)
NOTHING = speeding(3.0, "step time 0")


def instant(text, privates, *, who="bv", names=("ego", "bv", "cv"), others=()):
    """Return when an event of cv begins that waits for a condition of ``who``."""
    rows = [*others, ("seen", "cv", NOTHING, condition(who, text))]
    rollout = run(scenario(names, EGO + privates, events(*rows)))
    return int(rollout.began[0, -1]), rollout


def behind(gap, speed=10.0, other=0.0, lane_id=1):
    """bv drives south from s = 95 on lane 1, cv is ahead of it by so much."""
    return start("bv", lane(3, 1, 95.0), speed) + start("cv", lane(3, lane_id, 95.0 - gap), other)


def distance(kind, value, rule="lessOrEqual", *, free="false", system="entity", to="cv"):
    return f"""<RelativeDistanceCondition entityRef="{to}" relativeDistanceType="{kind}"
value="{value}" freespace="{free}" rule="{rule}" coordinateSystem="{system}"/>"""


@pytest.mark.parametrize("system", ["entity", "lane", "road"])
@pytest.mark.parametrize(
    ("kind", "free", "lane_id", "seconds"),
    [
        # 60 m apart at 10 m/s; within 20.25 m after 39.75 m: at 3.975 s, seen at 4 s
        ("longitudinal", "false", 1, 4.0),
        ("longitudinal", "false", 2, 4.0),
        ("longitudinal", "true", 1, 3.6),  # 4 m less: 35.75 m
        ("longitudinal", "true", 2, 3.6),
        ("euclidianDistance", "false", 1, 4.0),
        ("euclidianDistance", "true", 1, 3.6),
        # beside: sqrt(20.25² - 3.5²) = 19.945 m, after 40.055 m
        ("euclidianDistance", "false", 2, 4.05),
        # corners: sqrt(20.25² - 1.5²) = 20.194 m between the bumpers, after 35.806 m
        ("euclidianDistance", "true", 2, 3.6),
    ],
)
def test_distances(system, kind, free, lane_id, seconds):
    text = distance(kind, 20.25, free=free, system=system)
    at, _ = instant(text, behind(60.0, lane_id=lane_id))
    assert at == round(seconds / 0.05)


@pytest.mark.parametrize("system", ["entity", "lane"])
@pytest.mark.parametrize(
    ("free", "limit", "seen"),
    [("false", 3.4, False), ("false", 3.6, True), ("true", 1.4, False), ("true", 1.6, True)],
)
def test_a_lateral_distance_is_that_of_the_lanes(system, free, limit, seen):
    at, _ = instant(distance("lateral", limit, free=free, system=system), behind(60.0, lane_id=2))
    assert (at == 0) is seen


def test_a_distance_along_the_way_goes_round_the_corner():
    """40 m to the junction, a quarter of a circle of 14.75 m (23.17 m), 30 m beyond it.

    As the crow flies from (-1.75, 53) to (43, -1.75): 70.7 m.
    """
    route = (lane(3, 1, 40.0), lane(4, -1, 90.0))
    cars = start("bv", lane(3, 1, 40.0), 0.0, *route) + start("cv", lane(4, -1, 30.0), 0.0)
    for kind, metres in (("longitudinal", 93.17), ("euclidianDistance", 70.7)):
        for limit, seen in ((metres - 1.0, False), (metres + 1.0, True)):
            at, _ = instant(distance(kind, limit, system="lane"), cars)
            assert (at == 0) is seen, (kind, limit)


@pytest.mark.parametrize(
    ("free", "other", "seconds"),
    [
        # 60 m at 10 m/s: 2.95 s are left after 30.5 m; between bumpers after 26.5 m
        ("false", 0.0, 3.05),
        ("true", 0.0, 2.65),
        # at 6 m/s less: 17.7 m are left after 42.3 m of relative way
        ("false", 4.0, 7.05),
    ],
)
@pytest.mark.parametrize("kind", ["longitudinal", "euclidianDistance"])
def test_time_to_collision(free, other, seconds, kind):
    text = f"""<TimeToCollisionCondition value="2.951" freespace="{free}" rule="lessThan"
relativeDistanceType="{kind}" coordinateSystem="entity"><TimeToCollisionConditionTarget>
<EntityRef entityRef="cv"/></TimeToCollisionConditionTarget></TimeToCollisionCondition>"""
    at, _ = instant(text, behind(60.0, other=other))
    assert at == pytest.approx(seconds / 0.05, abs=1)


def test_no_time_to_collision_where_the_gap_grows():
    text = """<TimeToCollisionCondition value="1e6" freespace="true" rule="lessThan">
<TimeToCollisionConditionTarget><EntityRef entityRef="cv"/></TimeToCollisionConditionTarget>
</TimeToCollisionCondition>"""
    route = (lane(3, 1, 60.0), lane(1, -1, 90.0))
    cars = start("bv", lane(3, 1, 95.0), 10.0, *route) + start("cv", lane(3, 1, 60.0), 11.0, *route)
    assert instant(text, cars)[0] == -1


def test_time_to_collision_with_a_place():
    place = lane(3, 1, 35.0)
    text = f"""<TimeToCollisionCondition value="2.951" freespace="false" rule="lessThan">
<TimeToCollisionConditionTarget>{place}</TimeToCollisionConditionTarget>
</TimeToCollisionCondition>"""
    assert instant(text, behind(20.0))[0] == 61


def test_headways():
    text = """<TimeHeadwayCondition entityRef="{}" value="2.951" freespace="{}" rule="lessThan"
relativeDistanceType="longitudinal" coordinateSystem="lane"/>"""
    assert instant(text.format("cv", "false"), behind(60.0))[0] == 61
    assert instant(text.format("cv", "true"), behind(60.0))[0] == 53
    assert instant(text.format("bv", "false"), behind(60.0), who="cv")[0] == -1  # it stands
    behind_it = start("bv", lane(3, 1, 70.0), 10.0) + start("cv", lane(3, 1, 90.0), 0.0)
    assert instant(text.format("cv", "false"), behind_it)[0] == -1


def test_no_headway_to_who_is_behind_as_the_crow_flies():
    text = """<TimeHeadwayCondition entityRef="cv" value="50" freespace="false" rule="lessThan"
alongRoute="false"/>"""
    behind_it = start("bv", lane(3, 1, 70.0), 10.0) + start("cv", lane(3, 1, 90.0), 0.0)
    assert instant(text, behind_it)[0] == -1
    assert instant(text, behind(60.0))[0] == 0


def test_lane_0_is_the_line_between_both_directions():
    """bv drives 1.75 m beside it, from s = 95; s = 35 is within 5 m after 55.32 m."""
    place = lane(3, 0, 35.0)
    text = f'<ReachPositionCondition tolerance="5">{place}</ReachPositionCondition>'
    reach = 60.0 - math.sqrt(25.0 - 1.75**2)
    assert instant(text, behind(20.0))[0] == math.ceil(reach / 0.5)


def test_distance_to_a_place():
    text = f"""<DistanceCondition value="20.25" freespace="{{}}" rule="lessOrEqual"
relativeDistanceType="longitudinal" coordinateSystem="road">{lane(3, 1, 35.0)}
</DistanceCondition>"""
    assert instant(text.format("false"), behind(20.0))[0] == 80
    assert (
        instant(text.format("true"), behind(20.0))[0] == 73
    )  # its bumper is 3.4 m ahead: after 36.35 m
    old = f"""<DistanceCondition value="20.25" freespace="false" alongRoute="true"
rule="lessThan">{lane(3, 1, 35.0)}</DistanceCondition>"""
    assert instant(old, behind(20.0))[0] == 80


BRAKE = ("brake", "bv", speeding(4.0, "linear rate 2.5"), after(1.0))  # from 10 m/s, for 2.4 s


@pytest.mark.parametrize(
    ("text", "at"),
    [
        ('<AccelerationCondition value="-2.4" rule="lessThan" direction="longitudinal"/>', 21),
        ('<AccelerationCondition value="2.4" rule="greaterThan"/>', 21),
        ('<AccelerationCondition value="2.4" rule="greaterThan" direction="lateral"/>', -1),
        ('<SpeedCondition value="7.01" rule="lessThan" direction="longitudinal"/>', 44),
        ('<SpeedCondition value="0.5" rule="lessThan" direction="lateral"/>', 0),
        ('<RelativeSpeedCondition entityRef="cv" value="5.01" rule="lessThan"/>', 44),
        (
            '<RelativeSpeedCondition entityRef="cv" value="5.01" rule="lessThan" '
            'direction="longitudinal"/>',
            44,
        ),
    ],
)
def test_speeds_and_accelerations(text, at):
    assert instant(text, behind(60.0, other=2.0), others=(BRAKE,))[0] == at


def test_a_relative_speed_is_measured_along_the_entity_s_own_axes():
    """cv crosses from bv's right (west) to its left: it comes from leg D and drives west."""
    cars = start("bv", lane(3, 1, 90.0), 4.0) + start("cv", lane(4, 1, 90.0), 7.0)
    text = '<RelativeSpeedCondition entityRef="cv" value="{}" rule="greaterThan" direction="{}"/>'
    assert instant(text.format(3.99, "longitudinal"), cars)[0] == 0
    assert instant(text.format(4.01, "longitudinal"), cars)[0] == -1
    # driving south, east is to the left: cv moves to the right at 7 m/s
    assert instant(text.format(6.99, "lateral"), cars)[0] == 0
    assert instant(text.format(7.01, "lateral"), cars)[0] == -1


def test_contacts():
    touching = behind(60.0)  # bumpers meet after 56 m
    one = '<CollisionCondition><EntityRef entityRef="cv"/></CollisionCondition>'
    other = '<CollisionCondition><EntityRef entityRef="ego"/></CollisionCondition>'
    kind = '<CollisionCondition><ByType type="{}"/></CollisionCondition>'
    assert instant(one, touching)[0] in (112, 113)
    assert instant(other, touching)[0] == -1
    assert instant(kind.format("vehicle"), touching)[0] in (112, 113)
    assert instant(kind.format("pedestrian"), touching)[0] == -1


def test_headings():
    cars = behind(60.0, other=3.0)
    south = -math.pi / 2
    text = '<AngleCondition angleType="heading" angle="{}" angleTolerance="0.01"{}/>'
    assert instant(text.format(south, ""), cars)[0] == 0
    assert instant(text.format(south + math.tau, ""), cars)[0] == 0  # a turn more is the same
    assert instant(text.format(south + 0.02, ""), cars)[0] == -1
    lane_ = ' coordinateSystem="lane"'
    assert instant(text.format(0.0, lane_), cars)[0] == 0
    assert instant(text.format(0.02, lane_), cars)[0] == -1
    relative = """<RelativeAngleCondition entityRef="{}" angleType="heading" angle="{}"
angleTolerance="0.01"/>"""
    assert instant(relative.format("cv", 0.0), cars)[0] == 0
    crossing = start("bv", lane(3, 1, 90.0), 0.0) + start("cv", lane(2, 1, 90.0), 0.0)
    assert instant(relative.format("cv", math.pi / 2), crossing)[0] == 0  # from south to east
    assert instant(relative.format("cv", -math.pi / 2), crossing)[0] == -1


def test_the_end_of_the_road():
    """bv has 20 m of leg D left at 10 m/s, and stands at its end from 2 s on."""
    cars = start("bv", lane(4, -1, 80.0), 10.0) + start("cv", lane(3, 1, 50.0), 0.0)
    assert instant('<EndOfRoadCondition duration="0"/>', cars)[0] == 40
    assert instant('<EndOfRoadCondition duration="1"/>', cars)[0] == 60


def test_what_cannot_be_measured_is_refused():
    for text, what in (
        (distance("lateral", 1.0, system="world"), "coordinateSystem"),
        ('<AngleCondition angleType="pitch" angle="0" angleTolerance="1"/>', 'angleType="pitch"'),
    ):
        with refuses(UnsupportedError, what):
            instant(text, behind(60.0))


def test_box_gaps_are_those_of_the_recorded_distances():
    rng = np.random.default_rng(4)
    from bridgegen.simulation._box_kernels import box_gap
    from bridgegen.simulation.boxes import box_distance

    n = 200
    box = np.array([[4.5, 1.9, 1.4], [0.5, 0.7, 0.1]])
    x, y, h = (rng.uniform(-6, 6, (1, 2, n)) for _ in range(3))
    told = box_distance(box, x, y, h, np.array([n]))[0, 1]
    for k in range(n):
        c, s = np.cos(h[0, :, k]), np.sin(h[0, :, k])
        dx, dy = x[0, 1, k] - x[0, 0, k], y[0, 1, k] - y[0, 0, k]
        assert box_gap(box[0], box[1], dx, dy, c[0], s[0], c[1], s[1]) == pytest.approx(told[k])
