"""rss against the published definitions, one by one, and where they are mixed."""

from dataclasses import replace
from math import pi

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.assess.metrics.distances import Parameters, rss

P = Parameters()

# Boxes are 4 m × 2 m about the reference point. The ego stands at 0 and looks along +x.


def two(rollout_of, x=0.0, y=0.0, h=0.0, v=0.0, ego=10.0):
    return rollout_of(x=[[[0.0], [x]]], y=[[[0.0], [y]]], h=[[[0.0], [h]]], v=[[[ego], [v]]])


def following(v_rear, v_front, response):
    """Definition 1."""
    after = v_rear + response * P.accel_max
    way = v_rear * response + 0.5 * P.accel_max * response**2 + after**2 / (2 * P.brake_min)
    return max(way - v_front**2 / (2 * P.brake_max), 0.0)


def meeting(v_ego, v_other):
    """Definition 2, with the same brakes for both."""
    total = 0.0
    for v, response in ((v_ego, P.ego_response), (v_other, P.other_response)):
        after = v + response * P.accel_max
        total += (v + after) / 2 * response + after**2 / (2 * P.brake_min)
    return total


def beside():
    """Definition 6 of two that go straight on side by side."""
    total = P.lateral_margin
    for response in (P.ego_response, P.other_response):
        after = response * P.lateral_accel_max
        total += after / 2 * response + after**2 / (2 * P.lateral_brake_min)
    return total


speeds, gaps = st.floats(0, 30), st.floats(0.1, 150)


def missing(gap, safe):
    return 1 - gap / safe if gap < safe else 0.0


def test_the_usual_assumptions_are_those_of_ad_rss_lib():
    """Its documentation, Parameter discussion."""
    assert (P.ego_response, P.other_response, P.accel_max) == (1.0, 2.0, 3.5)
    assert (P.brake_min, P.brake_max) == (4.0, 8.0)
    assert (P.lateral_accel_max, P.lateral_brake_min, P.lateral_margin) == (0.2, 0.8, 0.1)


def test_following_by_hand(rollout_of):
    """10 m/s each: 10 + 1.75 + 13.5²/8 − 10²/16 = 28.28125 m are safe; half of that is there."""
    assert rss(two(rollout_of, x=4.0 + 14.140625, v=10.0)) == pytest.approx([0.5])


@given(speeds, speeds, gaps)
def test_following(rollout_of, v, ego, gap):
    expected = missing(gap, following(ego, v, P.ego_response)) if ego or v else None
    found = rss(two(rollout_of, x=4.0 + gap, v=v, ego=ego))
    if expected is not None:
        assert found == pytest.approx([expected], abs=1e-9)


@given(speeds, speeds, gaps)
def test_being_followed(rollout_of, v, ego, gap):
    expected = missing(gap, following(v, ego, P.other_response))
    assert rss(two(rollout_of, x=-4.0 - gap, v=v, ego=ego)) == pytest.approx([expected], abs=1e-9)


@given(speeds, speeds, gaps)
def test_meeting(rollout_of, v, ego, gap):
    expected = missing(gap, meeting(ego, v))
    found = rss(two(rollout_of, x=4.0 + gap, h=pi, v=v, ego=ego))
    assert found == pytest.approx([expected], abs=1e-9)


@given(st.floats(0.01, 3), speeds)
def test_side_by_side(rollout_of, side, v):
    for sign in (1, -1):
        found = rss(two(rollout_of, x=1.0, y=sign * (2.0 + side), v=v))
        assert found == pytest.approx([missing(side, beside())], abs=1e-9)


def test_both_distances_must_be_unsafe(rollout_of):
    """20 m behind one at the same speed, in the lane beside: not dangerous; nor far behind."""
    assert rss(two(rollout_of, x=24.0, v=10.0)) == pytest.approx(
        [1 - 20 / following(10, 10, P.ego_response)]
    )
    assert rss(two(rollout_of, x=24.0, y=3.5, v=10.0)) == [0.0]
    assert rss(two(rollout_of, x=140.0, y=0.0, v=10.0)) == [0.0]
    oblique = rss(two(rollout_of, x=24.0, y=2.4, v=10.0))
    assert oblique == pytest.approx(
        [1 - max(20 / following(10, 10, P.ego_response), 0.4 / beside())]
    )


def test_one_that_crosses_brakes_across_our_way_as_hard_as_it_brakes(rollout_of):
    """From the left, heading down: both must be able to stop before the other's way."""

    def stopping(v, response):
        after = v + response * P.accel_max
        return v * response + 0.5 * P.accel_max * response**2 + after**2 / (2 * P.brake_min)

    own = P.ego_response * P.lateral_accel_max
    own = own / 2 * P.ego_response + own**2 / (2 * P.lateral_brake_min)
    side = P.other_response * P.lateral_accel_max
    side = side / 2 * P.other_response + side**2 / (2 * P.lateral_brake_min)
    safe_along = stopping(10, P.ego_response) + side
    safe_across = stopping(8, P.other_response) + own + P.lateral_margin
    near = rss(two(rollout_of, x=23.0, y=18.0, h=-pi / 2, v=8.0))
    assert near == pytest.approx([1 - max(20 / safe_along, 15 / safe_across)])
    late = rss(two(rollout_of, x=23.0, y=safe_across + 3.01, h=-pi / 2, v=8.0))
    assert late == [0.0]
    gone = rss(two(rollout_of, x=23.0, y=-13.0, h=-pi / 2, v=8.0))
    assert gone == [0.0]  # it has crossed and goes on


def test_contact_is_one_and_nobody_is_zero(rollout_of):
    assert rss(two(rollout_of, x=3.0, v=10.0)) == [1.0]
    assert rss(rollout_of(x=[[[0.0]]], v=10.0)) == [0.0]


def test_other_assumptions(rollout_of):
    rollout = two(rollout_of, x=24.0, v=10.0)
    quick = rss(rollout, replace(P, ego_response=0.3))
    assert quick < rss(rollout)
    assert rss(rollout, replace(P, brake_min=8.0)) < rss(rollout)
    assert rss(rollout, replace(P, brake_max=12.0)) > rss(rollout)


def test_the_worst_instant_and_other_count(rollout_of):
    one = two(rollout_of, x=24.0, v=10.0)
    far = rollout_of(x=[[[0.0, 0.0], [60.0, 24.0], [80.0, 80.0]]], v=10.0)
    np.testing.assert_allclose(rss(far), rss(one))
