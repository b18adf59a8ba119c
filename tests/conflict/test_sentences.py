"""Sentences on conflicts whose numbers are worked by hand."""

import numpy as np
import pytest

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
    assert text == (
        "The ego's front struck the rear of 'bv' at 19.9 m/s closing speed; the ego is "
        "responsible: it did not keep a safe distance to the vehicle ahead (RSS (Shalev-Shwartz et "
        "al., 2017), definition 1; StVO § 4 (1)); the risk arose 4.0 s before, and a driver who "
        "brakes 0.75 s later with 0.774 g, or as hard as the road allows (UN R157, Annex 3), would "
        "have avoided it."
    )


def test_a_standing_ego_is_struck(track, meeting):
    text = of(meeting(track(), track(x=-30.0, v=10.0)))
    assert text.startswith(
        "The front of 'bv' struck the rear of the ego, which had stood for 2.6 s, at 10.0 m/s "
        "closing speed; 'bv' is responsible: it drove into a standing vehicle (StVO"
    )
    assert "brakes" not in text


def test_who_is_struck_in_the_side_strikes_nobody(track, meeting):
    ego, other = track(x=-30.0, v=10.0), track(x=-2.0, y=-31.0, h=RIGHT_ANGLE, v=10.0)
    text = of(meeting(ego, other, claims=[BY_SIGNS]))
    assert text.startswith("The front of 'bv' struck the ego's right side at 10.0 m/s closing")


def test_signs_against_the_other(track, meeting):
    rollout = meeting(
        track(x=-30.0, v=10.0), track(y=-30.0, h=RIGHT_ANGLE, v=10.0), claims=[BY_SIGNS]
    )
    assert "'bv' is responsible: it disregarded signs of priority (Vienna Convention" in of(rollout)


def test_a_pedestrian_steps_out(track, meeting):
    ego, walker = track(x=-52.0, v=10.0, t=8.0), track(y=-15.0, h=RIGHT_ANGLE, v=3.0, t=8.0)
    boxes = [(4.0, 2.0, 0.0), (0.5, 0.5, 0.0)]
    text = of(meeting(ego, walker, kinds=[CAR, PEDESTRIAN], boxes=boxes))
    assert "'bv' is responsible: it came into the path when stopping was no longer" in text
    assert text.endswith(
        "and a driver who brakes 0.75 s later with 0.774 g, or as hard as the road allows (UN "
        "R157, Annex 3), would not have avoided it."
    )


def test_what_stands_far_ahead_is_no_risk_for_so_long(track, meeting):
    text = of(meeting(track(v=10.0, t=9.0), track(x=84.0, t=9.0)))
    assert text.endswith(
        "; it stood there, hidden by no other participant, for the last 8.0 s, and a driver "
        "who brakes 0.75 s later with 0.774 g, or as hard as the road allows (UN R157, Annex 3), "
        "would have avoided it."
    )
    near = of(meeting(track(v=10.0), track(x=34.0)))
    assert "; the risk arose 3.0 s before, and a driver who brakes" in near


def test_one_that_came_on_the_wrong_side_and_stopped(track, meeting):
    """From 10 m/s it stops at 5 s, 4.5 s before: 47 m of the ego's 90 m would have sufficed."""
    v = np.interp(0.05 * np.arange(301), [0.0, 3.0, 5.0], [10.0, 10.0, 0.0])

    def met(stands):
        ghost = track(x=44.0 + 20.0 * (5.0 + stands), h=np.pi, v=v, t=15.0)
        return of(meeting(track(v=20.0, t=15.0), ghost, claims=[0]))

    assert (
        "the ego is responsible: it did not stop for what stood in the path for long enough (StVO "
        "§ 3 (1): stop within the distance seen); it stood there, hidden by no other participant, "
        "for the last 4.5 s, and a driver who brakes 0.75 s later"
    ) in met(4.5)
    assert (
        "'bv' is responsible: it drove on the wrong side of the road, towards the ego (Vienna "
        "Convention, Art. 10; StVO § 2 (1), (2)); the risk arose 4.0 s before, and a driver who "
        "brakes 0.75 s later with 0.774 g, or as hard as the road allows (UN R157, Annex 3), would "
        "have avoided it."
    ) in met(1.0)


def test_near_miss(track, meeting, course):
    v = course((0.0, 20.0), (1.0, 20.0), (3.0, 0.0), (6.0, 0.0))
    assert of(meeting(track(v=v), track(x=48.0))).startswith(
        "The ego's front came within 1.2 s of the rear of 'bv' at 20.0 m/s closing speed, which "
        "needed 8.3 m/s² of braking; "
    )


def test_collision_course_and_none(track, meeting, course):
    v = course((0.0, 20.0), (0.5, 20.0), (5.5, 0.0), (6.0, 0.0))
    assert of(meeting(track(v=v), track(x=74.0))).startswith(
        "The ego and 'bv' were on a collision course with "
    )
    assert of(meeting(track(v=5.0), track(y=9.0, v=5.0))) == ""


def test_who_moves_sideways(track, meeting):
    ego = track(v=15.0, slide=1.0)
    ego["offset"] = ego["y"].copy()
    text = of(meeting(ego, track(y=3.5, v=15.0), claims=[0]))
    assert "the ego is responsible: it moved sideways into the way of 'bv' (RSS" in text
    text = of(meeting(track(v=15.0), track(y=3.5, v=15.0, slide=-1.0), claims=[0]))
    assert "'bv' is responsible: it moved sideways into the way of the ego (RSS" in text


@pytest.mark.parametrize(("row", "other"), [(0, -1), (0, 2), (1, 1), (-1, 1)])
def test_no_such_pair(track, meeting, row, other):
    with pytest.raises(IndexError, match=r"row must be 0 to 0 and other 0 to 1"):
        sentence(analyse(meeting(track(), track(x=9.0))), row, other)
