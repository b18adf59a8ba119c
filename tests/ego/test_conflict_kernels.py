"""What is foreseen, held against geometry by hand and by shapely."""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from shapely import affinity
from shapely.geometry import box

from bridgegen.drivers._conflict_kernels import (
    CROSSING,
    END_MARGIN,
    LEADER,
    NO_CONFLICT,
    SIDE_MARGIN,
    boxes_meet,
    foot_on_way,
    foresee,
)

from .straight import CAR, DS, DT, path

EAST = path(0.0, 0.0, 0.0)
REACH, HORIZON = 60.0, 5.0


def seen(x, y, h, w, *, v=10.0, s=100.0, known=True, turn=0.0, k=1, beside=None, other=None):
    """What a car at (x, y, h) and speed w means to an ego at station s of the x axis."""
    theirs = path(x, y, h) if other is None else other
    row = np.zeros(3) if beside is None else beside
    return foresee(
        k, DT, EAST, len(EAST), DS, s, v, CAR, known, theirs, len(theirs), DS, 0.0, x, y, h, w,
        turn, CAR, HORIZON, REACH, row,
    )  # fmt: skip


@given(
    st.floats(-8.0, 8.0), st.floats(-8.0, 8.0), st.floats(-4.0, 4.0),
    st.floats(0.3, 4.0), st.floats(0.3, 2.0), st.floats(0.3, 4.0), st.floats(0.3, 2.0),
)  # fmt: skip
def test_boxes_meet_as_shapely_says(x, y, turned, length, width, other_length, other_width):
    first = box(-length, -width, length, width)
    second = box(-other_length, -other_width, other_length, other_width)
    second = affinity.translate(affinity.rotate(second, turned, use_radians=True), x, y)
    distance = first.distance(second)
    overlap = first.intersection(second).area
    if distance > 1e-9 or overlap > 1e-9:  # a touch is anybody's
        met = boxes_meet(x, y, turned, length, width, other_length, other_width)
        assert met == (distance == 0.0)


@given(st.floats(20.0, 400.0), st.floats(-9.0, 59.0), st.floats(-30.0, 30.0))
def test_the_foot_on_a_straight_way(s, ahead, aside):
    station, offset = foot_on_way(EAST, len(EAST), DS, s, REACH, s + ahead, aside)
    assert (station, offset) == pytest.approx((s + ahead, aside), abs=1e-6)


def test_who_is_far_behind_or_ahead_is_not_beside():
    for ahead in (-20.0, 80.0):
        assert foot_on_way(EAST, len(EAST), DS, 100.0, REACH, 100.0 + ahead, 1.0)[1] == math.inf


def test_a_leader_and_its_gap():
    # centres 40 m apart, boxes 4.6 m long: 35.4 m between the bumpers, closing by 4 m/s
    assert seen(140.0, 0.5, 0.0, 6.0) == pytest.approx((LEADER, 8.85, 35.4, 6.0, 0.0))
    assert seen(140.0, 0.5, 0.0, 12.0)[1] == math.inf


def test_who_comes_from_the_side_will_be_a_leader():
    beside = np.array([3.5 + 0.06, 3.56, 0.0])  # it came 6 cm nearer in 0.05 s: 1.2 m/s
    what, *_, lateral = seen(130.0, 3.5, 0.0, 10.0, beside=beside, known=False)
    assert what == LEADER
    assert lateral == pytest.approx((3.5 - 1.9 - SIDE_MARGIN) / 1.2)


def test_a_neighbour_on_its_lane_is_nobody():
    assert seen(110.0, 3.5, 0.0, 10.0, beside=np.array([3.5, 3.5, 0.0]))[0] == NO_CONFLICT
    assert seen(120.0, 3.5, math.pi, 10.0)[0] == NO_CONFLICT  # nor is one that comes the other way
    assert seen(80.0, 0.0, 0.0, 20.0)[0] == NO_CONFLICT  # nor who is behind


def test_who_crosses_in_time_is_met_and_who_does_not_is_not():
    # The ego's centre is at x = 101.4 and reaches 131.4 in 3 s; the other's comes to y = 0 then.
    what, ttc, room, *_ = seen(131.4, -30.0 - 1.4, math.pi / 2, 10.0)
    assert what == CROSSING
    # They touch before the centres meet: by their halves and the margins, over 10 m/s.
    assert 3.0 - (2.3 + 0.95 + END_MARGIN + SIDE_MARGIN) / 10.0 - 0.2 <= ttc <= 3.0
    # Its strip of the ego's way begins half its width and the ego's half length before there.
    assert room == pytest.approx(30.0 - 2.3 - 0.95, abs=0.01)
    assert seen(131.4, -55.0, math.pi / 2, 10.0)[0] == NO_CONFLICT  # far too late
    assert seen(131.4, -12.0, math.pi / 2, 10.0)[0] == NO_CONFLICT  # long gone


def test_who_would_run_into_its_rear_half_is_let_do_so():
    # The other reaches the ego's way one second after the ego's front has passed.
    assert seen(101.0, -6.0, math.pi / 2, 6.0, v=5.0, s=100.5)[0] == NO_CONFLICT


def test_one_that_changes_lane_counts_once_it_has_come_nearer():
    args = (112.0, 6.0, -1.2, 5.0)
    for nearer, expected in ((0.3, NO_CONFLICT), (0.4, CROSSING)):
        cy = 6.0 + 1.4 * math.sin(-1.2)
        beside = np.array([cy, cy + nearer, 0.0])
        assert seen(*args, known=False, beside=beside)[0] == expected
