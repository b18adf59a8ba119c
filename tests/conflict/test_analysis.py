"""Conflicts of hand-worked rollouts: contact, near miss, type, zones; what is no conflict."""

from dataclasses import replace

import numpy as np
import pytest

from bridgegen.assess.conflict.analysis import (
    CONTACT,
    COURSE,
    NEAR_MISS,
    NO_CONFLICT,
    ConflictType,
    Responsible,
    Rule,
    Zone,
    analyse,
)
from bridgegen.assess.conflict.harm import harm_of_pairs
from bridgegen.drivers.kinds import ANIMAL, BICYCLE, CAR, OTHER, PEDESTRIAN

RIGHT_ANGLE = np.pi / 2


def one(rollout, e=1):
    """What the analysis says of the ego and one other."""
    found = analyse(rollout)
    names = (
        "kind type responsible rule instant decided zone_ego zone_other preventable ttc needed "
        "closing_normal closing_tangential v_ego v_other stood_ego stood_other overlap left "
        "severity delta_v_ego delta_v_other at_fault"
    )
    values = {name: getattr(found, name)[0, e] for name in names.split()}
    return type("Pair", (), values)


# Contacts: who meets whom with what, and how fast.


def test_front_to_rear_striking(track, meeting):
    # 56 m between the bumpers at 20 m/s: contact after 2.8 s
    found = one(meeting(track(v=20.0), track(x=60.0)))
    assert (found.kind, found.type) == (CONTACT, ConflictType.REAR_END_STRIKING)
    assert (found.zone_ego, found.zone_other) == (Zone.FRONT, Zone.REAR)
    assert found.instant == 56
    assert found.closing_normal == pytest.approx(20.0)
    assert found.closing_tangential == pytest.approx(0.0, abs=1e-9)
    assert (found.v_ego, found.v_other) == (20.0, 0.0)
    assert found.overlap == pytest.approx(1.0)
    assert found.stood_ego == 0.0
    assert found.stood_other == pytest.approx(2.8)
    assert (found.delta_v_ego, found.delta_v_other) == pytest.approx((10.0, 10.0))
    assert found.ttc == 0.0


def test_front_to_rear_struck(track, meeting):
    # 16 m behind and 10 m/s faster: contact after 1.6 s
    found = one(meeting(track(v=10.0), track(x=-20.0, v=20.0)))
    assert (found.kind, found.type) == (CONTACT, ConflictType.REAR_END_STRUCK)
    assert (found.zone_ego, found.zone_other) == (Zone.REAR, Zone.FRONT)
    assert found.instant == 32
    assert found.closing_normal == pytest.approx(10.0)
    assert not found.at_fault


def test_partial_overlap(track, meeting):
    # the bodies are 1.5 m beside each other: half a metre of 2 m meets
    found = one(meeting(track(v=20.0), track(x=40.0, y=1.5)))
    assert found.zone_ego == Zone.FRONT
    assert found.overlap == pytest.approx(0.25)


def test_crossing_with_the_front_in_the_side(track, meeting):
    # the other's front has been in the way for long; the ego meets the middle of its left side
    found = one(meeting(track(x=-32.8, v=10.0), track(y=-15.0, h=RIGHT_ANGLE, v=5.0)))
    assert (found.kind, found.type) == (CONTACT, ConflictType.CROSSING)
    assert (found.zone_ego, found.zone_other) == (Zone.FRONT, Zone.LEFT)
    assert found.instant == 60
    assert found.closing_normal == pytest.approx(10.0)
    assert found.closing_tangential == pytest.approx(5.0)


def test_a_corner_meets_a_side(track, meeting):
    # the other comes at 60 degrees from the right and ahead of it
    angle = np.radians(60.0)
    found = one(meeting(track(v=8.0), track(x=10.0, y=-20.0, h=angle, v=8.0)))
    assert found.kind == CONTACT
    assert {found.zone_ego, found.zone_other} & {
        Zone.FRONT_LEFT, Zone.FRONT_RIGHT, Zone.REAR_LEFT, Zone.REAR_RIGHT
    }  # fmt: skip
    assert found.type == ConflictType.CROSSING


def test_head_on(track, meeting):
    # 56 m apart, 10 and 18 m/s towards each other: 2 s
    found = one(meeting(track(v=10.0), track(x=60.0, y=0.5, h=np.pi, v=18.0)))
    assert (found.kind, found.type) == (CONTACT, ConflictType.HEAD_ON)
    assert (found.zone_ego, found.zone_other) == (Zone.FRONT, Zone.FRONT)
    assert found.instant == 40
    assert found.closing_normal == pytest.approx(28.0)
    assert found.overlap == pytest.approx(0.75)


def test_side_swipe(track, meeting):
    # 2 m between the sides, 1 m/s sideways: 2 s
    found = one(meeting(track(v=10.0), track(y=4.0, v=10.0, slide=-1.0)))
    assert (found.kind, found.type) == (CONTACT, ConflictType.SIDE_SWIPE)
    assert (found.zone_ego, found.zone_other) == (Zone.LEFT, Zone.RIGHT)
    assert found.instant == pytest.approx(40, abs=1)
    assert found.closing_normal == pytest.approx(1.0)
    assert found.closing_tangential == pytest.approx(0.0, abs=1e-9)


def test_turning(track, meeting, course):
    # the ego turns left within 3 s into the way of one who comes towards it
    h = course((0.0, 0.0), (1.0, 0.0), (4.0, RIGHT_ANGLE), (6.0, RIGHT_ANGLE))
    ego = track(v=6.0, h=h)
    at = 50
    other = track(x=ego["x"][at] + 3.0 + 10.0 * 2.5, y=ego["y"][at] + 1.0, h=np.pi, v=10.0)
    found = one(meeting(ego, other))
    assert (found.kind, found.type) == (CONTACT, ConflictType.TURNING)


def test_a_lane_change_is_no_turn(track, meeting, course):
    # it steers by 15 degrees towards the ego's lane at 8 m/s; the ego is faster
    h = -np.radians(15.0) * course(
        (0.0, 0.0), (1.0, 0.0), (1.5, 1.0), (2.5, 1.0), (3.0, 0.0), (6.0, 0.0)
    )
    found = one(meeting(track(v=14.0), track(x=13.0, y=3.5, h=h, v=8.0)))
    assert (found.kind, found.type) == (CONTACT, ConflictType.SIDE_SWIPE)


def test_a_bend_is_no_turn(track, meeting, course):
    # the ego comes along a bend of 86 m radius, which goes on, 46 degrees in all;
    # a bus that stood beside the road there pulls out into its side
    rate = 12.0 / 86.0
    h = course((0.0, -4.25 * rate), (6.0, 1.75 * rate))
    ego = track(v=12.0, h=h)
    at = 85
    bus = track(x=ego["x"][at] - 0.5, y=ego["y"][at] - 1.9 - 0.4 * 0.05 * at, v=0.1, slide=0.4)
    found = one(meeting(ego, bus))
    assert found.type in (ConflictType.SIDE_SWIPE, ConflictType.REAR_END_STRIKING)


def test_a_standing_ego_is_struck(track, meeting):
    found = one(meeting(track(), track(x=-30.0, v=10.0)))
    assert (found.kind, found.type) == (CONTACT, ConflictType.EGO_STANDING)
    assert found.stood_ego == pytest.approx(2.6)
    assert (found.responsible, found.rule) == (Responsible.OTHER, Rule.STRUCK_STANDING)
    assert not found.at_fault


def test_an_ego_that_has_just_stopped_stands(track, meeting, course):
    v = course((0.0, 5.0), (1.0, 0.0), (6.0, 0.0))
    found = one(meeting(track(v=v), track(x=4.0, y=-6.0, h=RIGHT_ANGLE, v=2.8)))
    assert found.kind == CONTACT
    assert 0.0 < found.stood_ego < 0.5
    assert found.type == ConflictType.EGO_STANDING


@pytest.mark.parametrize(("kind", "box"), [(PEDESTRIAN, 0.5), (BICYCLE, 0.6), (ANIMAL, 0.8)])
def test_vulnerable_by_the_front_and_into_the_side(track, meeting, kind, box):
    boxes = [(4.0, 2.0, 0.0), (box, box, 0.0)]
    front = one(meeting(
        track(x=-20.0, v=10.0), track(y=-2.0, h=RIGHT_ANGLE, v=1.0), kinds=[CAR, kind], boxes=boxes
    ))  # fmt: skip
    assert (front.type, front.zone_ego) == (ConflictType.VRU_BY_FRONT, Zone.FRONT)
    side = one(meeting(
        track(x=-20.0, v=10.0), track(y=-3.0, h=RIGHT_ANGLE, v=0.9), kinds=[CAR, kind], boxes=boxes
    ))  # fmt: skip
    assert (side.type, side.zone_ego) == (ConflictType.VRU_INTO_SIDE, Zone.RIGHT)


def test_object(track, meeting):
    found = one(meeting(track(v=20.0), track(x=60.0), kinds=[CAR, OTHER]))
    assert found.type == ConflictType.OBJECT
    assert found.delta_v_ego == pytest.approx(20.0)  # it never moves: a barrier


@pytest.mark.parametrize(
    ("x", "y", "h", "ego", "other"),
    [
        (20.0, 0.0, 0.0, Zone.FRONT, Zone.REAR),
        (20.0, 0.0, 180.0, Zone.FRONT, Zone.FRONT),
        (20.0, 0.0, 90.0, Zone.FRONT, Zone.LEFT),
        (20.0, 0.0, -90.0, Zone.FRONT, Zone.RIGHT),
        (20.0, 0.0, 45.0, Zone.FRONT, Zone.REAR_LEFT),
        (20.0, 0.0, -45.0, Zone.FRONT, Zone.REAR_RIGHT),
        (20.0, 0.0, 135.0, Zone.FRONT, Zone.FRONT_LEFT),
        (20.0, 0.0, -135.0, Zone.FRONT, Zone.FRONT_RIGHT),
        (20.0, 2.0, 20.0, Zone.FRONT_LEFT, Zone.REAR),
        (20.0, -2.0, -20.0, Zone.FRONT_RIGHT, Zone.REAR),
        (20.0, 2.0, -20.0, Zone.FRONT_LEFT, Zone.RIGHT),
        (20.0, -2.0, 20.0, Zone.FRONT_RIGHT, Zone.LEFT),
    ],
)
def test_zones_of_a_standing_body_that_the_ego_drives_into(track, meeting, x, y, h, ego, other):
    found = one(meeting(track(v=10.0), track(x=x, y=y, h=np.radians(h))))
    assert (Zone(found.zone_ego), Zone(found.zone_other)) == (ego, other)


# Collision course, near miss, and what is neither.


def test_near_miss_just_before_an_evasion(track, meeting, course):
    # 30 m behind a standing car at 20 m/s the time is 1.5 s and 6.67 m/s² are needed; it brakes
    # at 10 m/s² from 24 m on, where 1.2 s are left
    v = course((0.0, 20.0), (1.0, 20.0), (3.0, 0.0), (6.0, 0.0))
    found = one(meeting(track(v=v), track(x=48.0)))
    assert found.kind == NEAR_MISS
    assert found.instant == 20
    assert found.ttc == pytest.approx(1.2)
    assert found.needed == pytest.approx(20.0 / 2.4)
    assert (found.zone_ego, found.zone_other) == (Zone.FRONT, Zone.REAR)
    assert found.closing_normal == pytest.approx(20.0)
    assert found.severity == 0.0


def test_no_near_miss_of_an_ego_that_brakes_enough(track, meeting, course):
    # 4 m/s² from 20 m/s on ends 2 m before a standing car; the time to collision falls to 1 s on
    # the way, but no more braking was ever needed
    v = course((0.0, 20.0), (1.0, 20.0), (6.0, 0.0), (8.0, 0.0))
    found = one(meeting(track(v=v, t=8.0), track(x=76.0, t=8.0)))
    assert found.kind == COURSE
    assert found.ttc < 1.5


@pytest.mark.parametrize(
    ("gap", "stops", "kind"),
    [
        pytest.param(12.5, 2.5, COURSE, id="4 m/s², which suffices"),
        pytest.param(10.5, 2.5, NEAR_MISS, id="4.76 m/s²: ISO 15622 allows 4.5 at 10 m/s"),
        pytest.param(12.5, 0.3, NEAR_MISS, id="4 m/s², and it comes as near as 0.3 m"),
    ],
)
def test_comfortable_braking_is_no_near_miss_unless_they_all_but_touch(
    track, meeting, course, gap, stops, kind
):
    # at 10 m/s it brakes from 1 s on, and stops some metres before a standing car
    taken = (gap - stops) / 5.0
    v = course((0.0, 10.0), (1.0, 10.0), (1.0 + taken, 0.0), (6.0, 0.0))
    found = one(meeting(track(v=v), track(x=14.0 + gap)))
    assert found.kind == kind


def test_far_away_is_a_course_and_no_near_miss(track, meeting, course):
    v = course((0.0, 20.0), (0.5, 20.0), (5.5, 0.0), (6.0, 0.0))
    found = one(meeting(track(v=v), track(x=74.0)))
    assert found.kind == COURSE
    assert found.ttc <= 4.0


def test_passing_on_parallel_lanes_is_no_conflict(track, meeting):
    assert one(meeting(track(v=20.0), track(x=30.0, y=2.1, v=5.0))).kind == NO_CONFLICT
    assert one(meeting(track(v=20.0), track(x=90.0, y=2.1, h=np.pi, v=20.0))).kind == NO_CONFLICT


def test_passing_behind_a_crossing_body_is_no_conflict(track, meeting):
    # it is 1.8 m past the ego's strip when the ego arrives; both keep their speeds
    found = one(meeting(track(x=-42.0, v=10.0), track(y=-17.2, h=RIGHT_ANGLE, v=5.5)))
    assert found.kind == NO_CONFLICT


def test_oncoming_in_a_bend_is_no_conflict(track, meeting):
    # lanes of radius 50 and 53.5 m: straight on, both would meet; along their lanes they pass
    t = 0.05 * np.arange(121)
    inner, outer = 50.0, 53.5
    h_ego = 12.0 / inner * t
    back = 12.0 / inner * 6.0 - 12.0 / outer * t
    ego = track(h=h_ego, v=12.0)
    other = dict(track(v=12.0))
    other["x"] = outer * np.sin(back)
    other["y"] = inner - outer * np.cos(back)
    other["h"] = back + np.pi
    found = one(meeting(ego, other))
    assert np.min(meeting(ego, other).distance[0, 1]) == pytest.approx(1.5, abs=0.1)
    assert found.kind == NO_CONFLICT


def test_a_follower_who_changes_lane_in_time_has_no_conflict(track, meeting, course):
    ego = track(v=15.0, slide=course((0.0, 3.0), (1.2, 3.0), (1.25, 0.0), (6.0, 0.0)))
    assert one(meeting(ego, track(x=40.0, v=10.0))).kind == NO_CONFLICT


def test_what_follows_the_first_contact_does_not_count(track, meeting):
    rollout = meeting(track(v=10.0), track(x=24.0), track(x=60.0, y=1.0))
    assert one(rollout, 1).kind == CONTACT
    assert one(rollout, 2).kind != CONTACT


# Bodies that are absent, placed, or moved to another place.


def test_an_ego_alone_has_no_conflict(track, meeting):
    found = analyse(meeting(track(v=10.0)))
    assert found.kind.tolist() == [[NO_CONFLICT]]
    assert found.ttc[0, 0] == np.inf


def test_one_instant(track, meeting):
    rollout = meeting(track(v=20.0), track(x=24.0), n_steps=1)
    found = one(rollout)
    assert found.kind == NEAR_MISS
    assert found.ttc == pytest.approx(1.0)


def test_bodies_that_overlap_from_the_start_are_nobodys_fault(track, meeting):
    found = one(meeting(track(v=20.0), track(x=3.0, v=20.0)))
    assert (found.kind, found.instant) == (CONTACT, 0)
    assert (found.responsible, found.rule) == (Responsible.NONE, Rule.UNSAFE_START)
    assert not found.at_fault


def present(rollout, e, since, until):
    there = np.ones(rollout.shape, np.bool_)
    there[0, e, :since] = there[0, e, until:] = False
    return replace(rollout, present=there)


def test_an_absent_body_has_no_conflict(track, meeting):
    rollout = present(meeting(track(v=20.0), track(x=60.0)), 1, 0, 0)
    found = analyse(rollout)
    assert found.kind[0, 1] == NO_CONFLICT
    assert found.nearness[0, 1] == 0.0


def test_a_body_that_appears_in_the_ego_is_nobodys_fault(track, meeting):
    found = one(present(meeting(track(v=20.0), track(x=21.0)), 1, 20, 121))
    assert (found.kind, found.instant) == (CONTACT, 20)
    assert (found.responsible, found.rule) == (Responsible.NONE, Rule.UNSAFE_START)


def test_where_a_body_was_while_absent_does_not_matter(track, meeting):
    other = track(x=60.0)
    other["x"] = np.where(np.arange(121) < 20, -500.0, 60.0)
    found = one(present(meeting(track(v=20.0), other), 1, 20, 121))
    plain = one(present(meeting(track(v=20.0), track(x=60.0)), 1, 20, 121))
    assert found.instant == plain.instant == 56
    assert (found.rule, found.decided, found.stood_other) == (
        plain.rule, plain.decided, plain.stood_other
    )  # fmt: skip
    assert found.decided == 20
    assert found.stood_other == pytest.approx(1.8)


def test_a_body_that_leaves_is_no_obstacle_afterwards(track, meeting):
    rollout = present(meeting(track(v=20.0), track(x=60.0)), 1, 0, 10)
    assert one(rollout).kind == COURSE  # 2.3 s before


def test_a_body_that_is_moved_into_the_ego_is_nobodys_fault(track, meeting):
    other = track(x=200.0, v=5.0)
    other["x"] = np.where(np.arange(121) < 20, other["x"], other["x"] - 180.0)
    found = one(meeting(track(v=20.0), other))
    assert found.kind == CONTACT
    assert (found.responsible, found.rule) == (Responsible.NONE, Rule.UNSAFE_START)
    assert found.closing_normal < 30.0  # not 180 m in a step


def test_failed_rows_are_empty(track, meeting):
    rollout = replace(meeting(track(v=20.0), track(x=60.0)), status=np.ones(1, np.int8))
    found = analyse(rollout)
    assert not found.ok.any()
    assert not found.kind.any()
    assert np.isinf(found.ttc).all()
    assert not harm_of_pairs(found).any()


def test_an_object_that_moves_gives_way_and_one_that_stands_does_not(track, meeting):
    """A barrier takes nothing off the ego's change of speed; what rolls on ahead does."""
    barrier = one(meeting(track(v=20.0), track(x=60.0), kinds=[CAR, OTHER]))
    rolls = one(meeting(track(v=20.0), track(x=24.0, v=5.0), kinds=[CAR, OTHER]))
    assert barrier.delta_v_ego == pytest.approx(20.0)
    assert 0.0 < rolls.delta_v_ego < 0.5 * 15.0
    car = one(meeting(track(v=20.0), track(x=60.0)))
    assert car.delta_v_ego == pytest.approx(10.0)  # a standing car of equal mass
    assert barrier.severity > car.severity > 0.0


def test_a_simulator_s_lights_of_another_integer_type_do_not_compile_the_analysis_again(
    track, meeting
):
    """It takes half a minute."""
    from bridgegen.assess.conflict._conflict_kernels import analyse_rows

    rollout = meeting(track(v=20.0), track(x=60.0))
    lights = np.ones((1, 1, rollout.shape[2]), np.int64)
    found = analyse(replace(rollout, light_names=("light",), lights=lights))
    assert found.kind[0, 1] == analyse(rollout).kind[0, 1]
    assert len(analyse_rows.signatures) == 1
