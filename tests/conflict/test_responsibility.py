"""Each rule of responsibility in a rollout that shows it, and in its counter-case."""

from dataclasses import replace
from functools import partial

import numpy as np
import pytest

from bridgegen.assess.conflict.analysis import CONTACT, COURSE, NEAR_MISS, ConflictType, analyse
from bridgegen.assess.conflict.harm import decisive
from bridgegen.assess.conflict.summary import sentence
from bridgegen.assess.conflict.types import RULES, Responsible, Rule, Zone
from bridgegen.drivers.kinds import BICYCLE, CAR, OTHER, PEDESTRIAN
from bridgegen.drivers.preventable import avoids_cut_in
from bridgegen.drivers.right_of_way import BY_MAP, BY_SIGNS, FROM_THE_RIGHT, ONCOMING, SIREN

DT = 0.05
RIGHT_ANGLE = np.pi / 2
MAN = (0.5, 0.5, 0.0)
EGO, BV, NEITHER, SHARED = Responsible.EGO, Responsible.OTHER, Responsible.NONE, Responsible.SHARED


def verdict(rollout, e=1):
    """(responsible, rule) of the ego and one other, who must be in conflict."""
    found = analyse(rollout)
    assert found.kind[0, e] >= NEAR_MISS
    return Responsible(found.responsible[0, e]), Rule(found.rule[0, e])


def at_fault(rollout, e=1):
    return bool(analyse(rollout).at_fault[0, e])


def stopping_distance(v, g=0.774 * 9.81):
    """Of the careful driver [m]: 0.75 s, then up to 0.774 g at 12.65 m/s³; UN R157, Annex 3."""
    jerk = 12.65
    rise = g / jerk
    left = v - 0.5 * jerk * rise**2
    return 0.75 * v + v * rise - jerk * rise**3 / 6.0 + left**2 / (2.0 * g)


def test_every_rule_has_words_and_a_source():
    assert set(RULES) == set(Rule)
    assert all(words and source for rule, (words, source) in RULES.items() if rule)


# What stands ahead.


@pytest.mark.parametrize("v", [8.0, 14.0, 20.0, 30.0])
def test_a_standing_obstacle_is_the_egos_from_the_stopping_distance_on(track, meeting, v):
    enough = meeting(track(v=v), track(x=4.0 + stopping_distance(v) + 0.3))
    assert verdict(enough) == (EGO, Rule.STANDING_AHEAD)
    assert analyse(enough).preventable[0, 1]
    short = meeting(track(v=v), track(x=4.0 + stopping_distance(v) - 0.3))
    assert verdict(short) == (NEITHER, Rule.UNSAFE_START)
    assert not at_fault(short)


@pytest.mark.parametrize("grip", [2.0, 5.0])
def test_the_careful_driver_brakes_no_harder_than_the_tyres_allow(track, meeting, grip):
    distance = stopping_distance(20.0, grip)
    enough = meeting(track(v=20.0), track(x=4.0 + distance + 0.3))
    assert verdict(replace(enough, friction=np.array([grip]))) == (EGO, Rule.STANDING_AHEAD)
    short = meeting(track(v=20.0), track(x=4.0 + distance - 0.3))
    assert verdict(short) == (EGO, Rule.STANDING_AHEAD)
    slippery = replace(short, friction=np.array([grip]))
    assert verdict(slippery) == (NEITHER, Rule.UNSAFE_START)
    assert not at_fault(slippery)


def test_what_a_bend_takes_from_the_tyres_is_not_left_to_brake(track, meeting):
    """At 17 m/s on 100 m radius 2.9 of 5 m/s² hold the car: 4.1 are left at first."""
    radius, v = 100.0, 17.0
    way = np.arange(161) * DT * v
    bend = {
        "x": radius * np.sin(way / radius), "y": radius * (1 - np.cos(way / radius)),
        "h": way / radius, "v": np.full(161, v),
    }  # fmt: skip
    distance = 4.0 + stopping_distance(v, 5.0) + 1.0
    at = distance / radius
    x, y = radius * np.sin(at), radius * (1 - np.cos(at))
    stands = {"x": np.full(161, x), "y": np.full(161, y), "h": np.full(161, at)}
    rollout = meeting({**track(t=8.0), **bend}, {**track(t=8.0), **stands})
    assert analyse(replace(rollout, friction=np.array([9.0]))).preventable[0, 1]
    assert not analyse(replace(rollout, friction=np.array([5.0]))).preventable[0, 1]


@pytest.mark.parametrize(("friction", "slow"), [(5.0, 17.3), (9.0, 20.0)])
def test_a_careful_driver_is_slower_before_a_bend(track, meeting, friction, slow):
    """It takes 60 % of the grip: on 100 m radius sqrt(0.6 · 5 · 100) = 17.3 m/s, on a dry road 20.

    A car stands where 17.3 m/s still stop (27 m on a dry road, 45 m on a wet one), 20 m/s do not.
    """
    radius, v = 100.0, 20.0
    way = np.arange(161) * DT * v
    bend = {
        "x": radius * np.sin(way / radius), "y": radius * (1 - np.cos(way / radius)),
        "h": way / radius, "v": np.full(161, v),
    }  # fmt: skip
    at = (4.0 + stopping_distance(slow, friction) + 6.0) / radius
    stands = {
        "x": np.full(161, radius * np.sin(at)), "y": np.full(161, radius * (1 - np.cos(at))),
        "h": np.full(161, at),
    }  # fmt: skip
    rollout = meeting({**track(t=8.0), **bend}, {**track(t=8.0), **stands})
    assert 4.0 + stopping_distance(v, 5.0) > radius * at or friction > 5.0
    assert analyse(replace(rollout, friction=np.array([friction]))).preventable[0, 1]


def test_a_pedestrian_beside_the_lane_is_not_to_blame_for_an_ego_that_leaves_it(track, meeting):
    """The ego slides 9 m off its lane, 3 m of them within the last second, into one who runs there.

    The pedestrian comes at 3 m/s, so that a careful driver could not stop.
    """
    ego, at = track(v=15.0, h=0.2), 60
    walker = track(x=ego["x"][at] + 2.0, y=ego["y"][at] + 9.0, v=3.0, h=-RIGHT_ANGLE)
    kinds = [CAR, PEDESTRIAN]
    rollout = meeting(ego, walker, kinds=kinds, boxes=[(4.0, 2.0, 0.0), MAN], claims=[0])
    rollout = replace(rollout, friction=np.array([5.0]))
    assert verdict(rollout) == (BV, Rule.STEPPED_OUT)
    offset = rollout.offset.copy()
    offset[0, 0] = rollout.y[0, 0]
    assert verdict(replace(rollout, offset=offset)) == (EGO, Rule.LEFT_ITS_LANE)


def test_a_barrier_ahead_is_the_egos(track, meeting):
    rollout = meeting(track(v=20.0), track(x=60.0), kinds=[CAR, OTHER])
    assert verdict(rollout) == (EGO, Rule.STANDING_AHEAD)


def test_a_parked_car_that_the_ego_scrapes_is_the_egos(track, meeting):
    # its side is 0.2 m in the ego's way: corners or sides meet, and it has not moved at all
    ego = track(v=10.0, h=0.03)
    rollout = meeting(ego, track(x=60.0, y=3.5), claims=[0])
    assert verdict(rollout) == (EGO, Rule.STANDING_AHEAD)


def test_an_obstacle_that_is_revealed_too_late_is_nobodys(track, meeting, course):
    # a van between ego and obstacle leaves the lane when the ego is 30 m away from the obstacle
    aside = course((0.0, 0.0), (2.95, 0.0), (3.0, 8.0), (3.5, 8.0), (3.55, 0.0), (6.0, 0.0))
    van = track(x=15.0, v=20.0, slide=aside)
    late = meeting(track(v=20.0), track(x=100.0), van)
    assert verdict(late) == (NEITHER, Rule.REVEALED_LATE)
    early = meeting(track(v=20.0), track(x=100.0), {**van, "y": np.full(121, 8.0)})
    assert verdict(early) == (EGO, Rule.STANDING_AHEAD)


def excused_up_to(faulty, least, most):
    """The value from which on the ego, excused at ``least``, is at fault; by bisection."""
    assert faulty(most)
    assert not faulty(least)
    for _ in range(12):
        middle = 0.5 * (least + most)
        least, most = (least, middle) if faulty(middle) else (middle, most)
    return least


LATER = np.arange(0.0, DT, 0.007)
"""Shifts of the instants at which a motion is sampled, within a step [s]."""


def test_what_is_revealed_late_does_not_depend_on_where_the_samples_fall(track, meeting):
    """A van that hides an obstacle leaves the lane at 0.3 s; the distance that suffices.

    At 20 m/s a step is 1 m; at whole steps the distances differed by as much.
    """

    def met(distance, later):
        van = track(x=10.0 + 20.0 * later, v=20.0)
        aside = 8.0 * np.maximum(DT * np.arange(121) + later - 0.3, 0.0)
        obstacle = track(x=distance)
        return at_fault(meeting(track(x=20.0 * later, v=20.0), obstacle, {**van, "y": aside}))

    needed = [excused_up_to(partial(met, later=later), 30.0, 90.0) for later in LATER]
    assert max(needed) - min(needed) < 0.1


def test_who_steps_out_does_not_depend_on_where_the_samples_fall(track, meeting):
    """A pedestrian, on a crosswalk for 2.3 s before an ego comes, stands still; the pace it needs.

    At whole steps the paces differed by 0.1 s of 2.3 s.
    """
    walk = np.array([[[0.0, 0.0, 0.0, 2.0, 6.0]]])

    def met(pace, later):  # in s/m
        ego = track(x=-2.0 - (4.0 - later) / pace, v=1.0 / pace)
        y = 3.0 * np.minimum(DT * np.arange(121) - 4.0 + later, 0.0)
        walker = {**track(h=RIGHT_ANGLE, v=np.where(y < 0.0, 3.0, 0.0)), "x": np.zeros(121), "y": y}
        boxes = [(4.0, 2.0, 0.0), MAN]
        return at_fault(meeting(ego, walker, kinds=[CAR, PEDESTRIAN], boxes=boxes, crosswalks=walk))

    needed = [excused_up_to(partial(met, later=later), 1.0 / 25.0, 1.0 / 8.0) for later in LATER]
    assert max(needed) / min(needed) - 1.0 < 0.002


def wrong_way(track, meeting, v, stands, tail_first=False, **more):
    """The ego keeps v; a car comes towards it at 10 m/s, has stopped at 5 s and stands so long [s].

    It brakes by 5 m/s² from 3 s on; the bodies are 4 m long, so they meet where the ego has driven
    for 5 s and so long.
    """
    speed = np.interp(DT * np.arange(301), [0.0, 3.0, 5.0], [10.0, 10.0, 0.0])
    h, speed = (0.0, -speed) if tail_first else (np.pi, speed)
    ghost = track(x=4.0 + v * (5.0 + stands) + 40.0, h=h, v=speed, t=15.0)  # 30 and 10 m
    return meeting(track(v=v, t=15.0), ghost, claims=[0], **more)


@pytest.mark.parametrize("v", [12.0, 20.0, 30.0])
def test_one_that_came_against_the_traffic_is_a_standing_obstacle_since_it_stands(
    track, meeting, v
):
    enough = (stopping_distance(v) + 2.0) / v
    found = analyse(wrong_way(track, meeting, v, enough))
    assert found.type[0, 1] == ConflictType.HEAD_ON
    assert verdict(wrong_way(track, meeting, v, enough)) == (EGO, Rule.STANDING_AHEAD)
    assert found.decided[0, 1] == pytest.approx(5.0 / DT, abs=1)
    assert found.left[0, 1] == pytest.approx(enough, abs=2 * DT)
    assert found.preventable[0, 1]


@pytest.mark.parametrize("v", [12.0, 20.0, 30.0])
def test_one_that_stopped_too_late_has_driven_on_the_wrong_side(track, meeting, v):
    """A careful driver would have braked for it, all the same, when it still came: 4 s before."""
    rollout = wrong_way(track, meeting, v, (stopping_distance(v) - 2.0) / v)
    assert verdict(rollout) == (BV, Rule.WRONG_SIDE)
    found = analyse(rollout)
    assert found.left[0, 1] == pytest.approx(4.0, abs=2 * DT)
    assert found.preventable[0, 1]
    assert at_fault(rollout)
    # at 4 m/s² it takes 140 m to stop from 30 m/s: 4 s are not enough on a slippery road
    slippery = replace(wrong_way(track, meeting, 30.0, 1.0), friction=np.array([4.0]))
    assert verdict(slippery) == (BV, Rule.WRONG_SIDE)
    assert not at_fault(slippery)


def test_one_that_still_comes_against_the_traffic_drives_on_the_wrong_side(track, meeting):
    rollout = meeting(track(v=20.0), track(x=104.0, h=np.pi, v=20.0), claims=[0])
    assert verdict(rollout) == (BV, Rule.WRONG_SIDE)
    assert not at_fault(rollout)
    without_map = meeting(track(v=20.0), track(x=104.0, h=np.pi, v=20.0))
    assert verdict(without_map) == (NEITHER, Rule.LEFT_ITS_LANE)  # which side is whose?


@pytest.mark.parametrize("v", [12.0, 20.0, 30.0])
def test_an_oncoming_car_that_is_about_to_stop_would_not_have_run_into_who_stops(track, meeting, v):
    """It still does 2 m/s when they meet, and stands 0.4 s later; 4 s before, there was room."""
    rollout = wrong_way(track, meeting, v, -0.4)
    assert verdict(rollout) == (BV, Rule.WRONG_SIDE)
    assert analyse(rollout).v_other[0, 1] > 1.0
    assert at_fault(rollout)


def test_who_backs_towards_the_ego_is_responsible_and_an_ego_that_could_stop_fails(track, meeting):
    """Front to rear, not head-on; what braking avoids is as of one that comes nose first."""
    found = analyse(wrong_way(track, meeting, 20.0, -0.4, tail_first=True))
    assert found.type[0, 1] == ConflictType.REAR_END_STRIKING
    assert (found.zone_ego[0, 1], found.zone_other[0, 1]) == (Zone.FRONT, Zone.REAR)
    about_to_stop = wrong_way(track, meeting, 20.0, -0.4, tail_first=True)
    assert verdict(about_to_stop) == (BV, Rule.REVERSED)
    assert at_fault(about_to_stop)
    backs_on = meeting(track(v=20.0), track(x=104.0, v=-20.0), claims=[0])
    assert verdict(backs_on) == (BV, Rule.REVERSED)
    assert not at_fault(backs_on)
    enough = (stopping_distance(20.0) + 2.0) / 20.0
    stands = wrong_way(track, meeting, 20.0, enough, tail_first=True)
    assert verdict(stands) == (EGO, Rule.STANDING_AHEAD)
    to_ego = meeting(track(v=-5.0), track(x=-60.0, v=5.0), claims=[0])
    assert verdict(to_ego) == (EGO, Rule.REVERSED)


def test_who_backs_across_gives_way_also_from_the_right(track, meeting):
    def met(h, v):
        return meeting(track(x=-60.0, v=20.0), track(x=1.0, y=-21.0, h=h, v=v))

    assert verdict(met(0.5 * np.pi, 6.0)) == (EGO, Rule.ASSUMED_RIGHT_BEFORE_LEFT)
    assert verdict(met(-0.5 * np.pi, -6.0)) == (BV, Rule.REVERSED)


def test_oncoming_traffic_in_a_bend_does_not_turn_off(track, meeting):
    """The ego follows a bend of 100 m to the left, the other leaves it, on 130 m; they meet at 3 s.

    Across a junction, which a map knows by a claim, they would turn.
    """
    time = DT * np.arange(round(6.0 / DT) + 1)
    ego = track(h=0.15 * time, v=15.0)
    other = track(h=0.45 + np.pi - 15.0 / 130.0 * (time - 3.0), v=15.0)
    at = round(3.0 / DT)
    start = {axis: ego[axis][at] - other[axis][at] for axis in "xy"}
    other |= {axis: other[axis] + start[axis] for axis in "xy"}
    found = analyse(meeting(ego, other, claims=[0]))
    assert found.type[0, 1] == ConflictType.HEAD_ON
    assert verdict(meeting(ego, other, claims=[0])) == (BV, Rule.WRONG_SIDE)
    assert analyse(meeting(ego, other, claims=[1])).type[0, 1] == ConflictType.TURNING


def test_four_seconds_are_counted_by_the_speeds_of_each_instant(track, meeting):
    """The ego brakes by 3 m/s² from 2.5 s before they meet, so it was 4 s away earlier.

    It would have stopped from then on, but not from 4 s before the contact on.
    """
    t = DT * np.arange(301)
    ego = np.interp(t, [0.0, 6.0, 15.0], [30.0, 30.0, 3.0])
    ghost = np.interp(t, [0.0, 4.0, 8.0], [16.0, 16.0, 0.0])
    meets = 8.5
    way = 30.0 * 6.0 + 30.0 * (meets - 6.0) - 0.5 * 3.0 * (meets - 6.0) ** 2
    rollout = meeting(
        track(v=ego, t=15.0), track(x=4.0 + way + 96.0, h=np.pi, v=ghost, t=15.0), claims=[0],
        friction=np.array([4.7]),
    )  # fmt: skip
    assert verdict(rollout) == (BV, Rule.WRONG_SIDE)
    assert analyse(rollout).left[0, 1] > 4.3
    assert at_fault(rollout)


def test_one_that_crosses_and_stops_stands_ahead_only_since_it_stands(track, meeting, course):
    """It has priority by the signs, so the ego gives way; or none, then it stopped too late."""
    # at 2 m/s across from 20 m to the right of the ego's lane; it stops in it at 10 s
    creeps = course((0.0, 2.0), (9.5, 2.0), (10.0, 0.0), (16.0, 0.0))

    def met(stands, claim):
        other = track(
            x=4.0 + 20.0 * (10.0 + stands) - 1.0, y=-19.5, h=RIGHT_ANGLE, v=creeps, t=16.0
        )
        return meeting(track(v=20.0, t=16.0), other, claims=[claim])

    late = met(0.9 * stopping_distance(20.0) / 20.0, BY_SIGNS)
    assert analyse(late).type[0, 1] == ConflictType.CROSSING
    assert verdict(late)[1] != Rule.STANDING_AHEAD
    early = met(1.1 * stopping_distance(20.0) / 20.0, BY_SIGNS)
    assert verdict(early) == (EGO, Rule.STANDING_AHEAD)
    assert analyse(early).decided[0, 1] == pytest.approx(10.0 / DT, abs=1)


def test_what_was_seen_long_ago_is_not_revealed_late(track, meeting, course):
    """A slow lorry is seen 8 s before it is struck, more than 4 s, and 4 s are too few to brake."""
    aside = course((0.0, 0.0), (0.95, 0.0), (1.0, 8.0), (1.5, 8.0), (1.55, 0.0), (12.0, 0.0))
    van = track(x=15.0, v=30.0, slide=aside, t=12.0)
    slow = track(x=4.0 + 9.5 * 28.0, v=2.0, t=12.0)
    rollout = replace(
        meeting(track(v=30.0, t=12.0), slow, van, claims=[0, 0]), friction=np.array([3.5])
    )
    found = analyse(rollout)
    assert found.kind[0, 1] == CONTACT
    assert verdict(rollout) == (EGO, Rule.REAR_DISTANCE)


# The vehicle ahead, the vehicle behind.


def test_the_vehicle_ahead_brakes_and_the_ego_does_not(track, meeting, course):
    # RSS: 20 m/s, 40 m apart; it brakes with 5 m/s² from 1 s on
    lead = track(x=44.0, v=course((0.0, 20.0), (1.0, 20.0), (5.0, 0.0), (6.0, 0.0)))
    rollout = meeting(track(v=20.0), lead)
    assert verdict(rollout) == (EGO, Rule.REAR_DISTANCE)
    found = analyse(rollout)
    assert found.decided[0, 1] == 20
    assert found.preventable[0, 1]


def test_who_had_no_time_to_open_the_gap_is_not_blamed(track, meeting, course):
    # 12 m behind at 23 m/s; the other brakes with 8 m/s², at once or after a while
    time = DT * np.arange(241)
    at_once = np.interp(time, [0.0, 0.2, 3.075], [23.0, 23.0, 0.0])
    found = meeting(track(v=23.0, t=12.0), track(x=16.0, v=at_once, t=12.0))
    assert verdict(found) == (NEITHER, Rule.UNSAFE_START)
    assert not analyse(found).preventable[0, 1]
    assert not at_fault(found)
    later = np.interp(time, [0.0, 7.0, 9.875], [23.0, 23.0, 0.0])
    found = meeting(track(v=23.0, t=12.0), track(x=16.0, v=later, t=12.0))
    assert verdict(found) == (EGO, Rule.REAR_DISTANCE)
    assert analyse(found).preventable[0, 1]


def test_the_vehicle_behind_keeps_no_distance(track, meeting):
    rollout = meeting(track(v=10.0), track(x=-20.0, v=20.0), claims=[0])
    assert verdict(rollout) == (BV, Rule.REAR_DISTANCE)


def brakes_hard(course):
    return course((0.0, 20.0), (1.0, 20.0), (3.5, 0.0), (6.0, 0.0))  # 8 m/s²


def test_braking_hard_without_a_reason_is_shared(track, meeting, course):
    ego = track(v=brakes_hard(course))
    behind = track(x=-12.0, v=20.0)
    assert verdict(meeting(ego, behind)) == (SHARED, Rule.BRAKED_WITHOUT_REASON)
    reason = track(x=48.0)
    assert verdict(meeting(ego, behind, reason)) == (BV, Rule.REAR_DISTANCE)
    gently = track(v=course((0.0, 20.0), (1.0, 20.0), (6.0, 0.0)))
    assert verdict(meeting(gently, behind)) == (BV, Rule.REAR_DISTANCE)


def test_a_red_light_is_a_reason_to_brake(track, meeting, course):
    rollout = meeting(track(v=brakes_hard(course)), track(x=-12.0, v=20.0))
    rollout = with_line(rollout, 55.0, 0.0, 0.0, entity=0, states=1)
    assert verdict(rollout) == (BV, Rule.REAR_DISTANCE)


def overtakes(track, meeting, course, behind, **more):
    """The ego has changed to the left lane until 2 s; a slower car follows it there from 3 s on."""
    there = course((0.0, 0.0), (0.3, 0.0), (0.35, 2.1), (2.0, 2.1), (2.05, 0.0), (6.0, 0.0))
    ego = track(v=24.0, slide=there)
    ego["offset"] = ego["y"].copy()
    after = course((0.0, 0.0), (3.0, 0.0), (3.05, 1.75), (5.0, 1.75), (5.05, 0.0), (6.0, 0.0))
    return meeting(ego, track(x=behind, v=12.0, slide=after), claims=[0], **more)


def test_who_has_arrived_on_a_lane_may_go_straight_on_there(track, meeting, course):
    in_front = overtakes(track, meeting, course, 54.0)
    assert analyse(in_front).type[0, 1] == ConflictType.REAR_END_STRIKING
    assert verdict(in_front) == (BV, Rule.CUT_IN)
    assert not at_fault(in_front)
    beside = overtakes(track, meeting, course, 44.0)
    assert analyse(beside).type[0, 1] == ConflictType.SIDE_SWIPE
    assert verdict(beside) == (BV, Rule.LEFT_ITS_LANE)
    assert not at_fault(beside)


def test_the_ego_cuts_in_before_one_who_comes_from_behind(track, meeting, course):
    # to the left within 1.75 s; the other is 10 m/s faster
    slide = course((0.0, 2.0), (1.75, 2.0), (1.8, 0.0), (6.0, 0.0))
    ego = track(v=15.0, slide=slide)
    ego["offset"] = ego["y"].copy()
    near = meeting(ego, track(x=-18.0, y=3.5, v=25.0), claims=[0])
    assert analyse(near).type[0, 1] == ConflictType.REAR_END_STRUCK
    assert verdict(near) == (EGO, Rule.CUT_IN)
    assert decisive(analyse(near))[1][0] >= 0.6
    # 45 m: 0.75 s and 3 m/s² suffice to lose 10 m/s: 7.5 + 16.7 m and the rise
    far = meeting(ego, track(x=-49.0, y=3.5, v=25.0), claims=[0])
    assert verdict(far) == (BV, Rule.REAR_DISTANCE)


@pytest.mark.parametrize("ahead", [24.0, 30.0, 60.0])
def test_the_ego_changes_lanes_behind_one_that_is_slower_there(track, meeting, course, ahead):
    """The slower one has never left its lane, though it comes to where the ego will drive."""
    slide = course((0.0, 0.0), (1.0, 0.0), (1.05, 2.0), (2.8, 2.0), (2.85, 0.0), (9.0, 0.0))
    ego = track(v=25.0, slide=slide, t=9.0)
    ego["offset"] = ego["y"].copy()
    found = meeting(ego, track(x=ahead, y=3.5, v=15.0, t=9.0), claims=[0])
    assert analyse(found).type[0, 1] == ConflictType.REAR_END_STRIKING
    assert verdict(found) == (EGO, Rule.REAR_DISTANCE)


def test_halfway_through_a_lane_change_the_ego_is_still_the_one_that_comes_over(
    track, meeting, course
):
    """The other begins to steer away; the ego, which moves over evenly, steers less lately."""
    h = course((0.0, 0.0), (1.0, 0.0), (1.2, 0.024), (5.0, 0.024), (5.2, 0.0), (6.0, 0.0))
    ego = track(v=25.0, h=h)
    ego["offset"] = ego["y"].copy()
    away = course((0.0, 0.0), (2.6, 0.0), (3.2, 0.15), (6.0, 0.15))
    found = meeting(ego, track(x=1.0, y=3.0, v=25.0, slide=away), claims=[0])
    assert analyse(found).type[0, 1] == ConflictType.SIDE_SWIPE
    assert verdict(found) == (EGO, Rule.LEFT_ITS_LANE)
    # one that comes over faster than the ego does, from the same place, is to blame
    towards = course((0.0, 0.0), (1.5, 0.0), (1.55, -1.2), (6.0, -1.2))
    found = meeting(ego, track(x=1.0, y=5.0, v=25.0, slide=towards), claims=[0])
    assert analyse(found).type[0, 1] == ConflictType.SIDE_SWIPE
    assert verdict(found) == (BV, Rule.LEFT_ITS_LANE)


def test_cut_ins_are_preventable_where_the_regulations_driver_avoids_them(track, meeting):
    """Against `avoids_cut_in`, which has the crashes of the Commission's own code."""
    rng = np.random.default_rng(0)
    agree, preventable, n, required = 0, 0, 0, 0
    for _ in range(400):
        v, slower, gap = rng.uniform(8, 30), rng.uniform(2, 10), rng.uniform(2, 40)
        lateral = rng.uniform(0.5, 2.0)
        slide = np.where(np.arange(161) * DT < 3.5 / lateral, -lateral, 0.0)
        w = max(v - slower, 0.5)
        ego = track(v=v, t=8.0)
        other = track(x=4.0 + gap, y=3.5, v=w, slide=slide, t=8.0)
        found = analyse(meeting(ego, other, claims=[0]))
        if found.type[0, 1] != ConflictType.REAR_END_STRIKING or found.kind[0, 1] != CONTACT:
            continue
        overlaps, enters = (int(np.argmax(other["y"] < y)) for y in (2.0, 2.5))
        avoided = avoids_cut_in(
            v, w, gap, lateral, lateral_gap=1.5, ego_size=(4.0, 2.0), other_size=(4.0, 2.0)
        )
        n, agree = n + 1, agree + (bool(avoided) == found.preventable[0, 1])
        preventable += found.preventable[0, 1]
        # UN R157, 5.2.5.2, by hand: 0.3 m over the marking is 0.5 m beside the ego here; it is
        # seen to move for 0.72 s before, and 0.2 s show that it moves.
        closing = v - w
        at_most = (gap - enters * DT * closing) / closing
        is_required = enters >= 18 and at_most > closing / 12.0 + 0.35
        rule, since = Rule.CUT_IN, overlaps
        if found.preventable[0, 1]:
            rule = Rule.CUT_IN_PREVENTABLE
        elif is_required:
            rule, since, required = Rule.CUT_IN_REQUIRED, enters, required + 1
        assert found.rule[0, 1] == rule
        assert found.responsible[0, 1] == (BV if rule == Rule.CUT_IN else EGO)
        assert found.decided[0, 1] == min(since, found.instant[0, 1] - 1)
        assert found.at_fault[0, 1] == (rule != Rule.CUT_IN)
    assert n > 150
    assert 0.1 * n < required < 0.9 * n
    assert 0.1 * n < preventable < 0.9 * n
    assert agree >= 0.96 * n, (agree, n)


def test_a_careful_ego_is_not_blamed_for_a_near_miss_after_a_cut_in(track, meeting, course):
    # it brakes as the careful driver does, yet comes near
    slide = course((0.0, -2.0), (1.75, -2.0), (1.8, 0.0), (6.0, 0.0))
    since = 10
    braked = np.maximum(20.0 - 7.593 * DT * np.arange(121 - since - 15), 10.0)
    v = np.concatenate([np.full(since + 15, 20.0), braked])
    rollout = meeting(track(v=v), track(x=24.5, y=3.5, v=10.0, slide=slide), claims=[0])
    found = analyse(rollout)
    assert found.kind[0, 1] == NEAR_MISS
    assert verdict(rollout) == (BV, Rule.CUT_IN)
    assert decisive(found)[1][0] == 0.0
    assert decisive(found, "any")[1][0] >= 0.3


# Sideways.


@pytest.mark.parametrize("side", [1.0, -1.0])
def test_who_moves_sideways_is_responsible(track, meeting, side):
    ego = track(v=15.0, slide=side)
    ego["offset"] = ego["y"].copy()
    rollout = meeting(ego, track(y=3.5 * side, v=15.0), claims=[0])
    assert verdict(rollout) == (EGO, Rule.LEFT_ITS_LANE)
    rollout = meeting(track(v=15.0), track(y=3.5 * side, v=15.0, slide=-side), claims=[0])
    assert verdict(rollout) == (BV, Rule.LEFT_ITS_LANE)
    assert not at_fault(rollout)


@pytest.mark.parametrize(("side", "bend"), [(1.0, 0.0), (-1.0, 0.0), (1.0, 0.01), (-1.0, -0.01)])
def test_without_offsets_the_tracks_tell_who_moved(track, meeting, side, bend):
    h = bend * 15.0 * DT * np.arange(121)
    steers = h + side * np.interp(DT * np.arange(121), [0.0, 0.5, 3.0], [0.0, 0.1, 0.1])
    ego, other = track(v=15.0, h=steers), track(y=3.5 * side, v=15.0, h=h)
    assert verdict(meeting(ego, other)) == (EGO, Rule.LEFT_ITS_LANE)
    ego, other = track(y=-3.5 * side, v=15.0, h=h), track(v=15.0, h=steers)
    # the other comes from the ego's side that it steers away from
    assert verdict(meeting({**ego, "y": ego["y"] + 7.0 * side}, other)) == (BV, Rule.LEFT_ITS_LANE)


def test_who_leaves_its_side_of_the_road_meets_oncoming_traffic(track, meeting):
    ego = track(v=10.0, slide=1.0)
    ego["offset"] = ego["y"].copy()
    rollout = meeting(ego, track(x=64.0, y=3.5, h=np.pi, v=10.0), claims=[0])
    assert analyse(rollout).type[0, 1] == ConflictType.HEAD_ON
    assert verdict(rollout) == (EGO, Rule.LEFT_ITS_LANE)
    rollout = meeting(track(v=10.0), track(x=64.0, y=3.5, h=np.pi, v=10.0, slide=1.0), claims=[0])
    assert verdict(rollout) == (BV, Rule.LEFT_ITS_LANE)
    assert not at_fault(rollout)  # even if it had stopped, it would have been met


# Right of way.


def crossing(track, meeting, claim, other_from=-1.0):
    """Both arrive at the same time, from a right angle; the other from the right if -1."""
    other = track(y=30.0 * other_from, h=-other_from * RIGHT_ANGLE, v=10.0)
    return meeting(track(x=-30.0, v=10.0), other, claims=claim and [claim])


@pytest.mark.parametrize(
    ("claim", "rule"),
    [
        (BY_MAP, Rule.MAP_PRIORITY),
        (BY_SIGNS, Rule.SIGNS),
        (FROM_THE_RIGHT, Rule.RIGHT_BEFORE_LEFT),
        (ONCOMING, Rule.ONCOMING_FIRST),
    ],
)
def test_the_claims_of_the_map_decide(track, meeting, claim, rule):
    assert verdict(crossing(track, meeting, -claim)) == (EGO, rule)
    assert verdict(crossing(track, meeting, claim)) == (BV, rule)
    # 2 s before they meet it is no longer to be expected that the other stops: 10 m/s can brake
    assert at_fault(crossing(track, meeting, claim))


def test_without_priorities_who_comes_from_the_right_goes_first(track, meeting):
    from_right = crossing(track, meeting, None)
    assert verdict(from_right) == (EGO, Rule.ASSUMED_RIGHT_BEFORE_LEFT)
    from_left = crossing(track, meeting, None, other_from=1.0)
    assert verdict(from_left) == (BV, Rule.ASSUMED_RIGHT_BEFORE_LEFT)


def test_priority_does_not_allow_to_drive_into_what_has_long_been_in_the_way(track, meeting):
    # the other creeps across at 1 m/s and is in the way 3 s before the ego arrives at 10 m/s
    other = track(y=-6.0, h=RIGHT_ANGLE, v=1.0, t=8.0)
    rollout = meeting(track(x=-62.0, v=10.0, t=8.0), other, claims=[BY_SIGNS])
    assert verdict(rollout) == (EGO, Rule.JUNCTION_OCCUPIED)
    # the other way round the other could have braked, but the ego, which creeps, had to give way
    ego, other = track(x=-6.0, v=1.0, t=8.0), track(y=-62.0, h=RIGHT_ANGLE, v=10.0, t=8.0)
    rollout = meeting(ego, other, claims=[-BY_SIGNS])
    assert verdict(rollout) == (Responsible.SHARED, Rule.SIGNS)
    assert at_fault(rollout)
    assert "the ego disregarded signs of priority, and" in sentence(analyse(rollout), 0, 1)
    # no duty is known: the other is the one who could have braked
    assert verdict(meeting(ego, other, claims=[0])) == (BV, Rule.JUNCTION_OCCUPIED)


def test_who_turns_gives_way_to_who_comes_along_the_same_road(track, meeting, course):
    h = course((0.0, 0.0), (1.0, 0.0), (4.0, RIGHT_ANGLE), (6.0, RIGHT_ANGLE))
    ego = track(v=6.0, h=h)
    at = 60
    other = track(x=ego["x"][at] + 3.0 + 30.0, y=ego["y"][at] + 1.0, h=np.pi, v=10.0)
    assert verdict(meeting(ego, other)) == (EGO, Rule.TURNING_GIVES_WAY)
    assert verdict(meeting(ego, other, claims=[-ONCOMING])) == (EGO, Rule.ONCOMING_FIRST)
    swapped = meeting(other, ego)
    assert verdict(swapped) == (BV, Rule.TURNING_GIVES_WAY)


def test_a_left_turn_that_has_only_begun_is_a_turn(track, meeting, course):
    # 8 degrees at the contact, 90 in the end
    h = course((0.0, 0.0), (2.6, 0.0), (5.6, RIGHT_ANGLE), (6.0, RIGHT_ANGLE))
    ego = track(v=8.0, h=h)
    rollout = meeting(ego, track(x=49.0, y=1.6, h=np.pi, v=8.0), claims=[-ONCOMING])
    found = analyse(rollout)
    assert found.type[0, 1] == ConflictType.TURNING
    assert verdict(rollout) == (EGO, Rule.ONCOMING_FIRST)


def test_an_ego_that_turns_in_front_of_another_takes_its_right_of_way(track, meeting, course):
    # from a side road into the lane of one who is 3 m behind by then and much faster
    h = course((0.0, RIGHT_ANGLE), (1.0, RIGHT_ANGLE), (3.0, 0.0), (6.0, 0.0))
    ego = track(x=0.0, y=0.0, h=h, v=5.0)
    end = 60
    y = ego["y"][end]
    other = track(x=ego["x"][end] - 8.0 - 15.0 * 3.0, y=y, v=15.0)
    rollout = meeting(ego, other, claims=[-BY_SIGNS])
    found = analyse(rollout)
    assert found.type[0, 1] == ConflictType.REAR_END_STRUCK
    assert verdict(rollout) == (EGO, Rule.SIGNS)


# Lights.


def with_line(rollout, x, y, h, entity, states):
    """The rollout with a stop line on the route of an entity, and its light's state."""
    lights = np.broadcast_to(np.asarray(states, np.int8), (1, 1, rollout.shape[2])).copy()
    return replace(
        rollout,
        light_names=("light",),
        lights=lights,
        stop_lines=np.array([[[x, y, h]]]),
        stop_lights=np.array([0]),
        stop_entities=np.array([entity]),
    )


RED, GREEN = 1, 4


def test_who_runs_a_red_light_is_responsible(track, meeting):
    # even against one that must give way otherwise
    plain = crossing(track, meeting, BY_SIGNS)
    assert verdict(with_line(plain, -10.0, 0.0, 0.0, 0, RED)) == (EGO, Rule.RED_LIGHT)
    assert verdict(with_line(plain, -10.0, 0.0, 0.0, 0, GREEN)) == (BV, Rule.SIGNS)
    plain = crossing(track, meeting, -BY_SIGNS)
    red = with_line(plain, 0.0, -9.8, RIGHT_ANGLE, 1, RED)
    assert verdict(red) == (BV, Rule.RED_LIGHT)
    found = analyse(red)
    # its front, 2 m ahead, passes the line with instant 37, after 18.5 m; at 10 m/s it needs
    # 10² / (2 · 3) = 16.7 m to stop in comfort, which it has up to 1.8 m: a danger from 2.0 m on
    assert found.decided[0, 1] == 4


def test_all_give_way_to_an_emergency_vehicle(track, meeting):
    """StVO § 38: though it crosses at red; with due regard, so not where only it could brake."""
    plain = crossing(track, meeting, -SIREN)
    red = with_line(plain, 0.0, -9.8, RIGHT_ANGLE, 1, RED)
    assert verdict(plain) == verdict(red) == (EGO, Rule.EMERGENCY_VEHICLE)
    ours = crossing(track, meeting, SIREN)
    assert verdict(ours) == (BV, Rule.EMERGENCY_VEHICLE)


def test_who_gives_way_to_a_siren_can_act_before_it_is_in_the_way(track, meeting):
    """Both come 100 m at 20 m/s: it is in the ego's strip 0.3 s before, perceived all along."""
    rollout = meeting(
        track(x=-100.0, v=20.0), track(y=-100.0, h=RIGHT_ANGLE, v=20.0), claims=[-SIREN]
    )
    assert verdict(rollout) == (EGO, Rule.EMERGENCY_VEHICLE)
    found = analyse(rollout)
    assert found.left[0, 1] == pytest.approx(4.0, abs=2 * DT)
    assert found.preventable[0, 1]


def test_who_could_not_perceive_a_siren_in_time_is_not_blamed(track, meeting):
    """A wall hides it until 10 m before they meet; it takes 15 m to stop."""
    ego, other = track(x=-40.0, v=10.0), track(y=-40.0, h=RIGHT_ANGLE, v=10.0)
    open_ = meeting(ego, other, claims=[-SIREN])
    assert verdict(open_) == (EGO, Rule.EMERGENCY_VEHICLE)
    # d from where they would meet, the line from the ego's front to the other's centre passes
    # (-a, -a), a = d (d - 2) / (2 d - 2): 6 m for d = 13 m. The wall ends 6.1 m before.
    wall = track(x=-13.2, y=-13.2, h=np.pi / 4)
    hidden = meeting(
        ego, other, wall, claims=[-SIREN, 0],
        boxes=[(4.0, 2.0, 0.0), (4.0, 2.0, 0.0), (20.0, 2.0, 0.0)],
    )  # fmt: skip
    assert verdict(hidden) == (NEITHER, Rule.REVEALED_LATE)
    assert not at_fault(hidden)
    from_start = meeting(
        track(x=-13.0, v=10.0), track(y=-13.0, h=RIGHT_ANGLE, v=10.0), claims=[-SIREN]
    )
    assert verdict(from_start) == (NEITHER, Rule.UNSAFE_START)


def test_a_red_light_far_behind_does_not_decide(track, meeting):
    plain = meeting(
        track(x=-80.0, v=10.0, t=9.0), track(y=-80.0, h=RIGHT_ANGLE, v=10.0, t=9.0), claims=[BY_MAP]
    )
    assert verdict(with_line(plain, -60.0, 0.0, 0.0, 0, RED)) == (BV, Rule.MAP_PRIORITY)


def test_who_stops_at_a_red_light_has_no_near_miss_behind_it(track, meeting, course):
    # 10 m/s, the line 7 m ahead, hard braking; the other passes behind the line on green
    v = course((0.0, 10.0), (0.5, 10.0), (1.75, 0.0), (6.0, 0.0))
    ego = track(x=-18.0, v=v)
    plain = meeting(ego, track(y=-14.0, h=RIGHT_ANGLE, v=8.0), claims=[-BY_MAP])
    assert analyse(plain).kind[0, 1] == NEAR_MISS
    stops = with_line(plain, -4.0, 0.0, 0.0, 0, RED)
    assert analyse(stops).kind[0, 1] == COURSE


# Pedestrians and cyclists.


def walks_out(track, meeting, v, walk, **more):
    """A pedestrian from the right whose centre is on the ego's axis when the ego arrives."""
    time = 5.0
    ego = track(x=-2.0 - v * time, v=v, t=8.0)
    walker = track(y=-walk * time, h=RIGHT_ANGLE, v=walk, t=8.0)
    return meeting(ego, walker, kinds=[CAR, PEDESTRIAN], boxes=[(4.0, 2.0, 0.0), MAN], **more)


def test_a_pedestrian_who_was_in_the_path_for_long_enough(track, meeting):
    # 1.25 m before the ego's side it is in the path: at 0.4 m/s 3.1 s before it would be hit
    slow = walks_out(track, meeting, 10.0, 0.4)
    assert verdict(slow) == (EGO, Rule.COULD_HAVE_STOPPED)
    # at 3 m/s some 0.75 s before: no time to brake
    fast = walks_out(track, meeting, 10.0, 3.0)
    assert verdict(fast) == (BV, Rule.STEPPED_OUT)
    assert not at_fault(fast)


def test_a_crosswalk_obliges_from_where_it_is_entered(track, meeting):
    walk = np.array([[[0.0, 0.0, 0.0, 2.0, 6.0]]])
    fast = walks_out(track, meeting, 10.0, 3.0, crosswalks=walk)
    # it is at the kerb, 7 m beside the axis, 2.3 s before: 23 m; 17 m suffice
    assert verdict(fast) == (EGO, Rule.CROSSWALK)
    assert stopping_distance(10.0) < 20.0
    shift = [50.0, 0.0, 0.0, 0.0, 0.0]
    elsewhere = walks_out(track, meeting, 10.0, 3.0, crosswalks=walk + shift)
    assert verdict(elsewhere) == (BV, Rule.STEPPED_OUT)
    quick = walks_out(track, meeting, 20.0, 3.0, crosswalks=walk)
    assert stopping_distance(20.0) > 7.0 / 3.0 * 20.0
    assert verdict(quick) == (NEITHER, Rule.STEPPED_OUT)


def test_a_pedestrian_behind_a_parked_van_is_seen_late(track, meeting):
    time, v, walk = 5.0, 10.0, 0.8
    ego = track(x=-2.0 - v * time, v=v, t=8.0)
    walker = track(y=-walk * time, h=RIGHT_ANGLE, v=walk, t=8.0)
    van = track(x=-6.0, y=-2.2, t=8.0)
    boxes = [(4.0, 2.0, 0.0), MAN, (9.0, 2.0, 0.0)]
    rollout = meeting(ego, walker, van, kinds=[CAR, PEDESTRIAN, CAR], boxes=boxes)
    alone = meeting(ego, walker, kinds=[CAR, PEDESTRIAN], boxes=boxes[:2])
    assert analyse(rollout).decided[0, 1] > analyse(alone).decided[0, 1]
    assert verdict(rollout) == (BV, Rule.STEPPED_OUT)


def test_a_pedestrian_who_walks_into_the_side(track, meeting):
    ego = track(x=-20.0, v=10.0)
    walker = track(y=-3.0, h=RIGHT_ANGLE, v=0.9)
    rollout = meeting(ego, walker, kinds=[CAR, PEDESTRIAN], boxes=[(4.0, 2.0, 0.0), MAN])
    assert verdict(rollout) == (BV, Rule.INTO_THE_SIDE)
    assert not at_fault(rollout)


def test_an_ego_that_turns_right_across_a_cyclist_is_responsible(track, meeting, course):
    # the cyclist rides beside the ego, 0.9 m from its side, and straight on
    h = course((0.0, 0.0), (2.0, 0.0), (4.5, -RIGHT_ANGLE), (6.0, -RIGHT_ANGLE))
    ego = track(v=6.0, h=h)
    box = (1.8, 0.6, 0.0)
    rollout = meeting(
        ego, track(x=-1.0, y=-2.2, v=6.0), kinds=[CAR, BICYCLE], boxes=[(4.0, 2.0, 0.0), box],
        claims=[0],
    )  # fmt: skip
    found = analyse(rollout)
    assert found.type[0, 1] == ConflictType.VRU_INTO_SIDE
    assert verdict(rollout) == (EGO, Rule.TURNING_GIVES_WAY)
    swerves = meeting(
        track(v=6.0), track(x=1.0, y=-2.2, v=6.0, slide=0.5), kinds=[CAR, BICYCLE],
        boxes=[(4.0, 2.0, 0.0), box], claims=[0],
    )  # fmt: skip
    assert verdict(swerves) == (BV, Rule.INTO_THE_SIDE)


def test_a_cyclist_with_priority_counts_as_a_vehicle(track, meeting):
    ego = track(x=-30.0, v=10.0)
    cyclist = track(y=-15.0, h=RIGHT_ANGLE, v=5.0)
    boxes = [(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)]
    rollout = meeting(ego, cyclist, kinds=[CAR, BICYCLE], boxes=boxes, claims=[-BY_SIGNS])
    assert verdict(rollout) == (EGO, Rule.SIGNS)
    rollout = meeting(ego, cyclist, kinds=[CAR, BICYCLE], boxes=boxes, claims=[BY_SIGNS])
    assert verdict(rollout) == (EGO, Rule.COULD_HAVE_STOPPED)  # 2 s before, at 10 m/s
    ego = track(x=-90.0, v=30.0)
    rollout = meeting(ego, cyclist, kinds=[CAR, BICYCLE], boxes=boxes, claims=[BY_SIGNS])
    assert verdict(rollout) == (BV, Rule.SIGNS)


def test_an_ego_that_turns_waits_for_pedestrians(track, meeting, course):
    # it turns left at 5 m/s; the pedestrian walks slowly along the road that it came on
    h = course((0.0, 0.0), (1.0, 0.0), (4.0, RIGHT_ANGLE), (8.0, RIGHT_ANGLE))
    ego = track(v=5.0, h=h, t=8.0)
    walker = track(x=ego["x"][100] - 0.4 * 5.0, y=ego["y"][100] + 2.0, v=0.4, t=8.0)
    more = {"kinds": [CAR, PEDESTRIAN], "boxes": [(4.0, 2.0, 0.0), MAN], "claims": [0]}
    assert verdict(meeting(ego, walker, **more)) == (EGO, Rule.TURNING_GIVES_WAY)
    straight = track(x=-25.0, v=5.0, t=8.0)
    slow = track(y=-2.0, h=RIGHT_ANGLE, v=0.4, t=8.0)
    assert verdict(meeting(straight, slow, **more)) == (EGO, Rule.COULD_HAVE_STOPPED)


def test_offsets_of_another_road_are_no_lane_change(track, meeting, course):
    # the ego turns left; its offset is told from the road that it comes from
    h = course((0.0, 0.0), (1.0, 0.0), (4.0, RIGHT_ANGLE), (6.0, RIGHT_ANGLE))
    ego = track(v=6.0, h=h)
    ego["offset"] = ego["y"].copy()
    at = 90
    box = [(4.0, 2.0, 0.0), MAN]
    walker = track(x=ego["x"][at] - 2.4, y=ego["y"][at], v=course((0, 0), (4, 0), (4.1, 2), (6, 2)))
    rollout = meeting(ego, walker, kinds=[CAR, PEDESTRIAN], boxes=box, claims=[0])
    assert analyse(rollout).type[0, 1] == ConflictType.VRU_INTO_SIDE
    assert verdict(rollout)[1] != Rule.LEFT_ITS_LANE


def test_one_that_must_give_way_is_a_danger_once_it_cannot_stop_in_comfort(track, meeting):
    """Or 2 s before they meet; here after 2.75 s, so that it is a danger from 0.75 s on.

    At 20 m/s, 3 m/s² stop within 66.7 m: that one is a danger from the start, 58 m before. One to
    which the ego must give way is a danger as soon as both are on a collision course, 4 s at most
    before they meet.
    """
    trusted = analyse(crossing(track, meeting, BY_SIGNS))
    assert trusted.decided[0, 1] * DT == pytest.approx(0.75, abs=0.15)
    assert trusted.preventable[0, 1]
    fast = track(y=-60.0, h=RIGHT_ANGLE, v=20.0)
    fast = analyse(meeting(track(x=-30.0, v=10.0), fast, claims=[BY_SIGNS]))
    assert fast.decided[0, 1] * DT == pytest.approx(0.0, abs=0.15)
    feared = analyse(crossing(track, meeting, -BY_SIGNS))
    assert feared.decided[0, 1] == pytest.approx(0, abs=1)
    assert feared.preventable[0, 1]


def test_the_slower_runner_of_a_red_light_is_avoided(track, meeting):
    """At 5 m/s it could stop within 4.2 m, so it is a danger late, but leaves the ego more time."""
    late = track(y=-30.0, h=RIGHT_ANGLE, v=10.0)
    early = meeting(track(x=-60.0, v=20.0), late)
    line = with_line(early, 0.0, -25.0, RIGHT_ANGLE, 1, RED)
    assert verdict(line) == (BV, Rule.RED_LIGHT)
    assert at_fault(line)  # 2.8 s from its line to the ego's way: time to brake from 20 m/s
    near = with_line(early, 0.0, -4.5, RIGHT_ANGLE, 1, RED)
    assert verdict(near) == (BV, Rule.RED_LIGHT)
    assert not at_fault(near)


@pytest.mark.parametrize(("v", "fault"), [(10.0, True), (4.0, False)])
def test_a_vehicle_that_pulls_out_ahead_is_followed(track, meeting, v, fault):
    """A bus pulls out over seconds, 40 m ahead, and the ego strikes its flank with a corner.

    Driving up to it is the ego's failure; one that comes from behind and drives at the ego's flank
    is the other's.
    """
    bus = (12.0, 2.5, 0.0)
    angle = 0.1
    ahead = 40.0 if fault else -10.0
    other = track(x=ahead, y=-5.0 if fault else -3.4, h=angle, v=4.0 if fault else 9.0, t=8.0)
    rollout = meeting(track(v=v, t=8.0), other, boxes=[(4.0, 2.0, 0.0), bus], claims=[0])
    found = analyse(rollout)
    assert found.type[0, 1] == ConflictType.SIDE_SWIPE
    assert verdict(rollout) == (
        (EGO, Rule.CUT_IN_PREVENTABLE) if fault else (BV, Rule.LEFT_ITS_LANE)
    )
    assert at_fault(rollout) == fault


@pytest.mark.parametrize("faster", [True, False])
def test_a_cyclist_who_swings_out_is_passed_with_room(track, meeting, course, faster):
    """The ego passes 0.5 m beside it, or it catches the ego up and rides into its flank."""
    kinds, boxes = [CAR, BICYCLE], [(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)]
    meet = 2.5 if faster else 1.0
    swings = course((0, 0), (meet, 0), (meet + 0.1, 0.8), (6, 0.8))
    other = track(x=24.0 if faster else -9.0, y=-1.8, v=4.0 if faster else 10.0, slide=swings)
    rollout = meeting(track(v=12.0 if faster else 4.0), other, kinds=kinds, boxes=boxes, claims=[0])
    assert analyse(rollout).type[0, 1] == ConflictType.VRU_INTO_SIDE
    expected = (EGO, Rule.PASSED_TOO_CLOSE) if faster else (BV, Rule.INTO_THE_SIDE)
    assert verdict(rollout) == expected


def test_a_slower_vehicle_that_brakes_at_last_had_long_been_too_near(track, meeting, course):
    """The ego drives up to one that is 6 m/s slower for 6 s; its braking then excuses nothing."""
    brakes = course((0, 10), (5.5, 10), (7, 5))
    rollout = meeting(track(v=16.0, t=7.0), track(x=42.0, v=brakes, t=7.0))
    assert verdict(rollout) == (EGO, Rule.REAR_DISTANCE)
    at_once = course((0, 16), (2, 0), (7, 0))
    near = meeting(track(v=16.0, t=7.0), track(x=6.0, v=at_once, t=7.0))
    assert verdict(near)[0] == NEITHER


@pytest.mark.parametrize(
    ("claim", "stands", "expected"),
    [
        (-BY_SIGNS, 1.0, (EGO, Rule.SIGNS)),  # 8 m before it; it needs 0.75 s and 10.7 m
        (-BY_SIGNS, 4.0, (BV, Rule.STRUCK_STANDING)),
        (BY_SIGNS, 1.0, (BV, Rule.STRUCK_STANDING)),
        (-SIREN, 1.0, (BV, Rule.STRUCK_STANDING)),
    ],
)
def test_who_stops_in_the_way_of_one_that_has_priority(track, meeting, claim, stands, expected):
    """The ego stops with its front in the other's way, so many seconds before it is struck."""
    at = 6.0 - stands
    v = np.clip(4.0 * (at - DT * np.arange(121)), 0.0, 8.0)
    ego = track(v=v)
    ego["x"] = ego["x"] - ego["x"][-1] - 2.5
    other = track(y=-2.0 - 1.0 - 8.0 * 6.0, h=RIGHT_ANGLE, v=8.0)
    other["x"] = other["x"] * 0.0
    rollout = meeting(ego, other, claims=[claim])
    assert analyse(rollout).type[0, 1] == ConflictType.EGO_STANDING
    assert verdict(rollout) == expected
    assert analyse(rollout).at_fault[0, 1] == (expected[0] == EGO)


def test_braking_too_little_for_a_slower_one_is_held_against_the_ego(track, meeting, course):
    """It closes in on a lorry from 30 m/s, which brakes at last, 4 s before they meet or less.

    The time to collision had been below 4 s for 7 s, in which the ego could have slowed down.
    """
    v = course((0.0, 30.0), (3.7, 22.6), (9.0, 0.0))
    lorry = course((0.0, 15.4), (3.6, 15.4), (7.7, 0.0), (9.0, 0.0))
    ego, other = track(v=v, t=9.0), track(x=63.0, v=lorry, t=9.0)
    rollout = replace(meeting(ego, other), friction=np.array([5.0]))
    assert verdict(rollout) == (EGO, Rule.REAR_DISTANCE)
    assert analyse(rollout).preventable[0, 1]


@pytest.mark.parametrize(("braking", "kind"), [(4.0, ConflictType.EGO_STANDING), (0.5, None)])
def test_an_ego_that_all_but_stands_and_brakes_is_run_into(track, meeting, braking, kind):
    """At 0.45 m/s it stops within 0.1 s; with little braking it drives on, in front."""
    v = np.maximum(0.45 + braking * (2.0 - DT * np.arange(121)), 0.0)
    ego = track(v=v)
    at = 41  # the other's front, 2 m ahead of its centre, is then beside the ego's right edge
    other = track(x=ego["x"][at] + 2.9, y=-3.0 - 9.0 * DT * at, h=RIGHT_ANGLE, v=9.0)
    rollout = meeting(ego, other, claims=[-BY_SIGNS])
    found = analyse(rollout).type[0, 1]
    assert (found == ConflictType.EGO_STANDING) == (kind == ConflictType.EGO_STANDING)


def test_an_ego_struck_in_the_flank_by_one_that_sped_up_is_not_to_blame(track, meeting, course):
    """From the right, it stands until the ego is 0.8 s before it, and speeds up by 8 m/s²."""
    starts = course((0, 0), (2.0, 0), (4.0, 16), (6, 16))
    other = track(y=-9.0, h=RIGHT_ANGLE, v=starts)
    rollout = meeting(track(x=-31.0, v=10.0), other, claims=[-FROM_THE_RIGHT])
    found = analyse(rollout)
    assert not found.leads_ego[0, 1]
    assert verdict(rollout) == (NEITHER, Rule.REVEALED_LATE)
