"""Which lanes entities are on, how they are turned on them, and whether the lanes are clear.

On leg C (road 3, s counts north, the reference line at x = 0) lane 1 leads south at x = -1.75, lane
2 at x = -5.25; lanes -1 and -2 lead north at x = 1.75 and 5.25. The road's sidewalks are beyond.
A car is 4 m long and 2 m wide, its box's centre 1.4 m ahead of its reference point.
"""

import math

import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError

from .storyboards import (
    after,
    condition,
    events,
    lane,
    lateral,
    run,
    scenario,
    speeding,
    start,
)

EGO = start("ego", lane(1, 1, 90.0), 0.0)
NOTHING = speeding(0.0, "step time 0")
SOUTH, NORTH = -math.pi / 2, math.pi / 2
DT = 0.05


def world(x, y, h):
    return f'<Position><WorldPosition x="{x}" y="{y}" h="{h}"/></Position>'


def instant(text, privates, *rows, names=("ego", "bv", "cv")):
    """Return when an event of the ego begins that waits for a condition of the bv."""
    seen = ("seen", "ego", NOTHING, condition("bv", text))
    made = scenario(names, EGO + privates, events(*rows, seen))
    return int(run(made, ego=None).began[0, -1])


OUTERMOST = 7.0  # m, the carriageway's edge


def edge():
    """Return how far from its reference line leg C's outermost lane goes, by its widths."""
    from .storyboards import crossroads

    section = crossroads().road("3").sections[0]
    return sum(one.widths[0].a for one in section.lanes if one.id > 0 and one.type != "none")


@pytest.mark.parametrize("beyond", [-0.2, 0.2])
def test_off_the_road_is_beyond_its_outermost_lane(beyond):
    assert edge() >= OUTERMOST
    cars = start("bv", world(-edge() - beyond, 60.0, SOUTH), 0.0) + start("cv", lane(3, 1, 5), 0.0)
    at = instant('<OffroadCondition duration="1"/>', cars)
    assert at == (-1 if beyond < 0.0 else round(1.0 / DT))


def test_time_off_the_road_counts_anew():
    """10 m/s across leg C's far end towards the east: off the road from its edge on."""
    x = -edge() + 10.0
    cars = start("bv", world(x, 60.0, 0.0), 10.0) + start("cv", lane(3, 1, 5), 0.0)
    at = instant('<OffroadCondition duration="0.5"/>', cars)
    left = (edge() - x) / 10.0  # when it leaves on the other side
    assert at == pytest.approx((left + 0.5) / DT, abs=1.01)


def angle(value, system, within=0.01):
    return f"""<AngleCondition angleType="heading" angle="{value}" angleTolerance="{within}"
coordinateSystem="{system}"/>"""


@pytest.mark.parametrize(
    ("lane_id", "turn", "system", "value"),
    [
        (1, 0.3, "lane", 0.3),
        (1, 0.3, "road", math.pi + 0.3),
        (1, 0.3, "world", SOUTH + 0.3),
        (-1, 0.3, "lane", 0.3),
        (-1, 0.3, "road", 0.3),
        (-1, 0.3, "world", NORTH + 0.3),
        (-1, 0.3, "entity", 0.0),
    ],
)
@pytest.mark.parametrize("off", [0.0, 0.05])
def test_angles_by_system(lane_id, turn, system, value, off):
    where = f"""<Position><LanePosition roadId="3" laneId="{lane_id}" s="50"><Orientation
type="relative" h="{turn}"/></LanePosition></Position>"""
    cars = start("bv", where, 0.0) + start("cv", lane(3, 1, 5), 0.0)
    assert instant(angle(value + off, system), cars) == (0 if off == 0.0 else -1)


@pytest.mark.parametrize(
    ("system", "value"),
    [("entity", math.pi), ("world", math.pi), ("lane", 0.0), ("road", math.pi)],
)
def test_angles_between_two(system, value):
    """One southbound, one northbound: each goes along its own lane."""
    cars = start("bv", lane(3, 1, 50.0), 0.0) + start("cv", lane(3, -1, 50.0), 0.0)
    for off, at in ((0.0, 0), (0.05, -1)):
        text = f"""<RelativeAngleCondition entityRef="cv" angleType="heading"
angle="{value + off}" angleTolerance="0.01" coordinateSystem="{system}"/>"""
        assert instant(text, cars) == at


def test_who_is_on_no_lane_has_no_angle_to_it():
    cars = start("bv", world(300.0, 300.0, 0.0), 0.0) + start("cv", lane(3, 1, 5), 0.0)
    for system in ("lane", "road"):
        assert instant(angle(0.0, system, within=4.0), cars) == -1


def clearance(forward, backward, *ranges, free="false", opposite="false", to=()):
    lanes = "".join(f"<RelativeLaneRange {one}/>" for one in ranges)
    whom = "".join(f'<EntityRef entityRef="{one}"/>' for one in to)
    return f"""<RelativeClearanceCondition distanceForward="{forward}"
distanceBackward="{backward}" freeSpace="{free}" oppositeLanes="{opposite}">{lanes}{whom}
</RelativeClearanceCondition>"""


OWN = 'from="0" to="0"'
LEFT = 'from="1" to="1"'
RIGHT = 'from="-1" to="-1"'


@pytest.mark.parametrize(
    ("text", "other", "clear"),
    [
        # the other 20 m ahead on the own lane
        (clearance(19.9, 50, OWN), lane(3, 1, 40.0), True),
        (clearance(20.1, 50, OWN), lane(3, 1, 40.0), False),
        # its box reaches from 0.6 m behind to 3.4 m ahead of its reference point
        (clearance(19.3, 50, OWN, free="true"), lane(3, 1, 40.0), True),
        (clearance(19.5, 50, OWN, free="true"), lane(3, 1, 40.0), False),
        # 20 m behind: its nose is at 16.6 m
        (clearance(50, 19.9, OWN), lane(3, 1, 80.0), True),
        (clearance(50, 20.1, OWN), lane(3, 1, 80.0), False),
        (clearance(50, 16.5, OWN, free="true"), lane(3, 1, 80.0), True),
        (clearance(50, 16.7, OWN, free="true"), lane(3, 1, 80.0), False),
        # on the lane to the right (2), on the own one or on any of this direction
        (clearance(50, 50, OWN), lane(3, 2, 60.0), True),
        (clearance(50, 50, RIGHT), lane(3, 2, 60.0), False),
        (clearance(50, 50, 'to="-1"'), lane(3, 2, 60.0), False),
        (clearance(50, 50), lane(3, 2, 60.0), False),
        # the lane to the left leads the other way: it counts only where that is asked for
        (clearance(50, 50), lane(3, -1, 60.0), True),
        (clearance(50, 50, opposite="true"), lane(3, -1, 60.0), False),
        (clearance(50, 50, LEFT, opposite="true"), lane(3, -1, 60.0), False),
        (clearance(50, 50, OWN, opposite="true"), lane(3, -1, 60.0), True),
        # nobody is on a lane of this direction to the left, for there is none: no clearance
        (clearance(50, 50, LEFT), lane(3, 2, 60.0), False),
        # only whom it names
        (clearance(50, 50, OWN, to=("ego",)), lane(3, 1, 40.0), True),
        (clearance(50, 50, OWN, to=("ego", "cv")), lane(3, 1, 40.0), False),
        # across the junction, along the way straight on: 60 + 26 + 20 m
        (clearance(105, 0, OWN), lane(1, -1, 20.0), True),
        (clearance(107, 0, OWN), lane(1, -1, 20.0), False),
    ],
)
def test_clearance(text, other, clear):
    cars = start("bv", lane(3, 1, 60.0), 0.0) + start("cv", other, 0.0)
    assert (instant(text, cars) == 0) is clear


@pytest.mark.parametrize(("aside", "clear"), [(-0.7, True), (-0.8, False)])
def test_a_body_that_reaches_into_the_lane_is_in_the_way(aside, clear):
    """2 m wide on the lane to the right, 1.75 m from its edge: 0.75 m aside, and it reaches over.

    An offset on a lane counts to the left of the reference line, which runs north.
    """
    where = f"""<Position><LanePosition roadId="3" laneId="2" s="60" offset="{aside}"/>
</Position>"""
    cars = start("bv", lane(3, 1, 60.0), 0.0) + start("cv", where, 0.0)
    assert (instant(clearance(50, 50, OWN, free="true"), cars) == 0) is clear
    assert instant(clearance(50, 50, OWN, free="false"), cars) == 0


def test_a_lane_is_clear_when_the_other_has_changed_to_the_next():
    """3.5 m in 4 s, evenly: its reference point is over the edge after 2 s."""
    cars = start("bv", lane(3, 1, 95.0), 10.0) + start("cv", lane(3, 1, 75.0), 10.0)
    change = ("c", "cv", lateral(-1, "linear time 4", "cv"), after(1.0))
    assert instant(clearance(50, 50, OWN), cars, change) == pytest.approx(3.0 / DT, abs=1.01)


def test_no_clearance_off_the_lanes():
    cars = start("bv", world(300.0, 300.0, 0.0), 0.0) + start("cv", lane(3, 1, 5), 0.0)
    assert instant(clearance(1, 1, opposite="true"), cars) == -1


def test_a_range_that_holds_nothing_is_refused():
    cars = start("bv", lane(3, 1, 60.0), 0.0) + start("cv", lane(3, 1, 5), 0.0)
    with refuses(UnsupportedError):
        instant(clearance(1, 1, 'from="1" to="0"'), cars)
