"""Sentences on conflicts whose numbers are worked by hand."""

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.summary import sentence
from bridgegen.drivers.kinds import CAR, PEDESTRIAN
from bridgegen.drivers.right_of_way import BY_SIGNS

RIGHT_ANGLE = np.pi / 2


def of(rollout):
    return sentence(analyse(rollout), 0, 1)


def test_the_ego_strikes_a_rear(track, meeting, course):
    lead = track(x=44.0, v=course((0.0, 20.0), (1.0, 20.0), (5.0, 0.0), (6.0, 0.0)))
    text = of(meeting(track(v=20.0), lead))
    # 40 m close at 5 m/s² · t²/2 within 4 s; the mean speed of the last step is 19.875 m/s
    approve(text, "bv", "19.9 m/s")


def test_a_standing_ego_is_struck(track, meeting):
    text = of(meeting(track(), track(x=-30.0, v=10.0)))
    approve(text, "bv", "2.6 s")
    assert "brakes" not in text


def test_who_is_struck_in_the_side_strikes_nobody(track, meeting):
    ego, other = track(x=-30.0, v=10.0), track(x=-2.0, y=-31.0, h=RIGHT_ANGLE, v=10.0)
    text = of(meeting(ego, other, claims=[BY_SIGNS]))
    approve(text, "bv", "10.0 m/s")


def test_signs_against_the_other(track, meeting):
    rollout = meeting(
        track(x=-30.0, v=10.0), track(y=-30.0, h=RIGHT_ANGLE, v=10.0), claims=[BY_SIGNS]
    )
    approve(of(rollout), "bv")


def test_a_pedestrian_steps_out(track, meeting):
    ego, walker = track(x=-52.0, v=10.0, t=8.0), track(y=-15.0, h=RIGHT_ANGLE, v=3.0, t=8.0)
    boxes = [(4.0, 2.0, 0.0), (0.5, 0.5, 0.0)]
    text = of(meeting(ego, walker, kinds=[CAR, PEDESTRIAN], boxes=boxes))
    approve(text, "bv", "0.75 s", "0.774")


def test_what_stands_far_ahead_is_no_risk_for_so_long(track, meeting):
    text = of(meeting(track(v=10.0, t=9.0), track(x=84.0, t=9.0)))
    approve(text, "8.0 s", "0.75 s")
    near = of(meeting(track(v=10.0), track(x=34.0)))
    approve(near, "3.0 s")


def test_one_that_came_on_the_wrong_side_and_stopped(track, meeting):
    """From 10 m/s it stops at 5 s, 4.5 s before: 47 m of the ego's 90 m would have sufficed."""
    v = np.interp(0.05 * np.arange(301), [0.0, 3.0, 5.0], [10.0, 10.0, 0.0])

    def met(stands):
        ghost = track(x=44.0 + 20.0 * (5.0 + stands), h=np.pi, v=v, t=15.0)
        return of(meeting(track(v=20.0, t=15.0), ghost, claims=[0]))

    approve(met(4.5), "4.5 s", "0.75 s")
    approve(met(1.0), "bv", "10")


def test_near_miss(track, meeting, course):
    v = course((0.0, 20.0), (1.0, 20.0), (3.0, 0.0), (6.0, 0.0))
    approve(of(meeting(track(v=v), track(x=48.0))), "bv", "1.2 s")


def test_collision_course_and_none(track, meeting, course):
    v = course((0.0, 20.0), (0.5, 20.0), (5.5, 0.0), (6.0, 0.0))
    approve(of(meeting(track(v=v), track(x=74.0))), "bv")
    assert of(meeting(track(v=5.0), track(y=9.0, v=5.0))) == ""


def test_who_moves_sideways(track, meeting):
    ego = track(v=15.0, slide=1.0)
    ego["offset"] = ego["y"].copy()
    text = of(meeting(ego, track(y=3.5, v=15.0), claims=[0]))
    approve(text, "bv")
    text = of(meeting(track(v=15.0), track(y=3.5, v=15.0, slide=-1.0), claims=[0]))
    approve(text, "bv")


@pytest.mark.parametrize(("row", "other"), [(0, -1), (0, 2), (1, 1), (-1, 1)])
def test_no_such_pair(track, meeting, row, other):
    with refuses(IndexError, "row"):
        sentence(analyse(meeting(track(), track(x=9.0))), row, other)
