"""Departures from the lane and the road, and close passes, by hand-worked rollouts.

The road is straight, along x: one lane of 3.5 m each way, the ego's to the right; the body is 2 m
wide, so that 0.75 m are between each wheel and the border of its lane.
"""

import math
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.assess.conflict import quantities
from bridgegen.assess.conflict.analysis import (
    VIOLATION,
    ConflictType,
    Responsible,
    Rule,
    analyse,
    encounters,
)
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.harm import NEAR_MISS, closeness_of_pairs, decisive, harm_of_pairs
from bridgegen.assess.conflict.severity import FRONT, severity
from bridgegen.assess.conflict.summary import sentence, summarise
from bridgegen.drivers.kinds import BICYCLE, CAR, OTHER, PEDESTRIAN
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load

HALF, FAR = 1.75, 5.25  # m, from the route to the border of the ego's lane; to the left edge


def corridor(edges=(FAR, HALF), lanes=(HALF, HALF), town=1.0):
    """The room beside a route along x, sampled every 0.5 m from -20 m to 180 m."""
    x = np.arange(-20.0, 180.1, 0.5)
    table = np.zeros((1, len(x), 8))
    table[0, :, 0] = x
    table[0, :, 3:] = *lanes, *edges, town
    return {"corridors": table, "corridor_of": np.zeros(1, np.int64)}


def aside(track, course, metres, v=10.0, **more):
    """An ego that moves to its left by so much from 2 s to 3 s, and stays there."""
    ego = track(v=v, **more)
    return led(ego, course((0.0, 0.0), (2.0, 0.0), (3.0, metres), (6.0, metres)))


def led(ego, y):
    """An ego at y of the route, which its offset says."""
    ego["y"] = ego["offset"] = y
    return ego


def turned(rollout, angle, mirrored=False):
    """The same scene, mirrored at the x axis and turned by an angle [rad]."""
    side, table = (-1.0 if mirrored else 1.0), rollout.corridors.copy()
    c, s = math.cos(angle), math.sin(angle)
    if mirrored:
        table[..., [3, 4, 5, 6]] = table[..., [4, 3, 6, 5]]
    x, y = table[..., 0].copy(), side * table[..., 1]
    table[..., 0], table[..., 1] = c * x - s * y, s * x + c * y
    table[..., 2] = side * table[..., 2] + angle
    y = side * rollout.y
    return replace(
        rollout, x=c * rollout.x - s * y, y=s * rollout.x + c * y, h=side * rollout.h + angle,
        offset=side * rollout.offset, corridors=table,
    )  # fmt: skip


# A wheel is at metres + 1 m; the border at 1.75 m, the road's edge at 1.75 m or 5.25 m.
@pytest.mark.parametrize(
    ("metres", "kind"),
    [
        (0.0, None),
        (0.9, None),  # 0.15 m beyond the line: a touch
        (1.2, None),
        (1.3, ConflictType.LANE_DEPARTURE),  # 0.55 m
        (4.4, ConflictType.LANE_DEPARTURE),  # 0.15 m beyond the edge
        (4.5, ConflictType.ROAD_DEPARTURE),  # 0.25 m
        (-0.9, None),
        (-1.0, ConflictType.ROAD_DEPARTURE),  # 0.25 m beyond the right edge
    ],
)
def test_how_far_the_ego_leaves_its_lane_or_the_road(track, meeting, course, metres, kind):
    found = analyse(meeting(aside(track, course, metres), track(y=80.0), **corridor()))
    _, harm = decisive(found)
    if kind is None:
        assert found.kind[0, 0] == 0
        assert harm[0] < NEAR_MISS
        return
    assert (found.kind[0, 0], found.type[0, 0]) == (VIOLATION, kind)
    assert found.responsible[0, 0] == Responsible.EGO
    edge = {True: 5.25 if metres > 0.0 else 1.75, False: 1.75}[kind == ConflictType.ROAD_DEPARTURE]
    assert found.aside[0, 0] == pytest.approx(math.copysign(abs(metres) + 1.0 - edge, metres))
    assert NEAR_MISS < harm[0] < 0.6


def test_a_departure_in_words_and_in_all_columns(track, meeting, course):
    rollout = meeting(aside(track, course, 2.0), track(y=80.0), friction=np.array([5.0]),
                      **corridor())  # fmt: skip
    found = analyse(rollout)
    assert decisive(found)[0].tolist() == [0]
    approve(sentence(found, 0, 0), "1.2 m", "10.0 m/s")
    one = summarise(found)
    assert (one.conflict, one.partner, one.type) == ("violation", "", "lane departure")
    assert one.to_dict()["aside"] == {"value": pytest.approx(1.25), "unit": "m"}
    # Border at 1.75 m: 0.5 m beyond it where the reference point is at 1.25 m, 0.625 s after 2 s.
    assert one.decided == pytest.approx(2.65)
    row = Findings.of(found, [""])
    assert row.row(0)["conflict"] == "violation"
    assert row.row(0)["partner"] is None
    assert row.row(0)["rule"] == Rule.DID_NOT_KEEP_LANE.label
    names = ["harm", "severity", "course_ttc", "course_braking"]
    values = quantities.evaluate(rollout, names)[0]
    assert values[1:].tolist() == [0.0, math.inf, 0.0]
    # 1.25 m of 2 m, head-on at twice 10 m/s; from 0.3 on, a factor of ten adds about 0.175.
    may = 0.02 * 0.625 * float(severity(CAR, CAR, 20.0, 0.0, FRONT, FRONT))
    assert values[0] == pytest.approx(0.3 + 0.7 * math.log1p(may / 1e-4) / math.log1p(1e4))


def test_a_road_is_left_the_worse_the_faster_and_the_slipperier(track, meeting, course):
    def harm(v, friction):
        ego = aside(track, course, -3.0, v)
        rollout = meeting(ego, track(y=80.0), friction=np.array([friction]), **corridor())
        return decisive(analyse(rollout))[1][0]

    assert harm(6.0, 8.0) < harm(10.0, 8.0) < harm(10.0, 3.0) < harm(14.0, 3.0)
    # Brakes of 8 m/s² stop 6 m/s within 2.25 m, before what stands 4.5 m beyond the edge.
    assert harm(6.0, 8.0) == NEAR_MISS


def test_lanes_of_one_way_and_the_room_of_a_junction(track, meeting, course):
    ego, other = aside(track, course, 3.5), track(y=80.0)
    wide = corridor(lanes=(FAR, HALF))
    assert analyse(meeting(ego, other, **wide)).kind[0, 0] == 0  # a change of lane
    inner = corridor(edges=(np.inf, np.inf))
    assert analyse(meeting(ego, other, **inner)).type[0, 0] == ConflictType.LANE_DEPARTURE


@pytest.mark.parametrize(
    ("x", "y", "v", "excused"),
    [
        (45.0, -1.0, 0.0, True),  # a van that stands in the lane
        (45.0, -1.0, 9.8, False),  # as fast as the ego
        (45.0, -4.0, 0.0, False),  # beside the road
        (5.0, -3.0, 2.0, False),  # behind it when it moves aside
        (75.0, -1.0, 0.0, False),  # too far ahead: 46 m and more between the bodies
    ],
)
def test_passing_what_is_in_the_lane_is_no_departure(track, meeting, course, x, y, v, excused):
    ego = track(v=10.0)
    led(ego, course((0.0, 0.0), (2.0, 0.0), (3.0, 2.5), (6.0, 2.5)))
    found = analyse(meeting(ego, track(x=x, y=y, v=v), **corridor()))
    assert (found.kind[0, 0] == 0) == excused


def test_after_an_excused_departure_the_next_one_counts(track, meeting, course):
    ego = track(v=10.0, t=9.0)
    led(ego, course((0.0, 0.0), (1.0, 0.0), (2.0, 2.5), (4.0, 2.5), (5.0, 0.0), (7.0, 0.0),
                    (8.0, 2.5), (9.0, 2.5)))  # fmt: skip
    found = analyse(meeting(ego, track(x=30.0, y=-1.0, t=9.0), **corridor()))
    assert found.type[0, 0] == ConflictType.LANE_DEPARTURE
    assert found.decided[0, 0] * found.time_step > 7.0


def test_leaving_after_the_first_contact_is_none(track, meeting, course):
    ego = aside(track, course, 3.0)
    hit = meeting(ego, track(x=15.0, v=0.0), **corridor())
    assert analyse(hit).kind[0].tolist()[0] == 0


@pytest.mark.parametrize("lacks", ["corridor", "row"])
def test_without_lanes_there_is_no_violation(track, meeting, course, lacks):
    known = corridor() if lacks == "row" else {}
    if lacks == "row":
        known["corridor_of"] = np.array([-1])
    rollout = meeting(aside(track, course, 9.0), track(y=80.0), **known)
    assert (analyse(rollout).kind != VIOLATION).all()


# The ego is faster by 5 m/s: a failure below 0.5 m + 0.15 m. Widths are 2 m and 0.6 m.
@pytest.mark.parametrize(
    ("clearance", "town", "failure", "noted"),
    [
        (0.3, 1.0, True, False),
        (0.6, 1.0, True, False),
        (0.7, 1.0, False, True),
        (1.4, 1.0, False, True),
        (1.6, 1.0, False, False),
        (1.6, 0.0, False, True),
        (2.1, 0.0, False, False),
    ],
)
@pytest.mark.parametrize("kind", [BICYCLE, PEDESTRIAN])
def test_clearance_to_whom_the_ego_passes(track, meeting, clearance, town, failure, noted, kind):
    other = track(x=25.0, y=-(1.3 + clearance), v=3.0)
    rollout = meeting(
        track(v=8.0), other, kinds=[CAR, kind], boxes=[(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)],
        **corridor(lanes=(HALF, 6.0), edges=(FAR, 6.0), town=town),
    )  # fmt: skip
    found = analyse(rollout)
    harm = harm_of_pairs(found)[0, 1]
    assert (harm >= NEAR_MISS) == failure
    assert (found.kind[0, 1] == VIOLATION) == (failure or noted)
    if failure or noted:
        assert found.rule[0, 1] == Rule.PASSED_TOO_CLOSE
        assert found.aside[0, 1] == pytest.approx(clearance, abs=1e-9)
        approve(sentence(found, 0, 1), "bv", "8.0 m/s")


@pytest.mark.parametrize(
    ("change", "counts"),
    [
        ({}, True),
        ({"v": 9.8}, False),  # the ego is not faster
        ({"h": math.pi}, False),  # it comes towards
        ({"v": 0.0, "kind": PEDESTRIAN}, False),  # it waits
        ({"right": 1.5}, False),  # it is beside the lanes
        ({"ego": 1.5}, False),  # at walking pace
        ({"kind": CAR}, False),
        ({"x": 1.0}, False),  # beside it from the start on
        ({"x": 24.0}, False),  # level after (24 - 2.9) / 7 = 3.01 s; slowing takes 3.08 s
    ],
)
def test_whom_the_law_means(track, meeting, change, counts):
    v = change.get("v", 0.5 if "ego" in change else 3.0)
    other = track(x=change.get("x", 6.0 if "ego" in change else 25.0), y=-1.7, v=v,
                  h=change.get("h", 0.0))  # fmt: skip
    rollout = meeting(
        track(v=change.get("ego", 10.0)), other, kinds=[CAR, change.get("kind", BICYCLE)],
        boxes=[(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)],
        **corridor(lanes=(HALF, change.get("right", HALF))),
    )  # fmt: skip
    assert (analyse(rollout).type[0, 1] == ConflictType.CLOSE_PASS) == counts


def test_who_draws_level_and_stays_behind_does_not_pass(track, meeting, course):
    """It gains 22.5 m on who is 25 m ahead: the fronts are 1.4 m apart then."""
    rollout = meeting(
        track(v=course((0.0, 8.0), (4.0, 8.0), (5.0, 3.0), (6.0, 3.0))),
        track(x=25.0, y=-1.7, v=3.0), kinds=[CAR, BICYCLE],
        boxes=[(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)], **corridor(),
    )  # fmt: skip
    assert (analyse(rollout).kind[0] != VIOLATION).all()


def test_who_is_overtaken_and_then_stays_ahead_has_not_overtaken(track, meeting, course):
    """The cyclist draws level from behind within 2 s, and falls behind again."""
    rollout = meeting(
        track(v=4.0),
        track(x=-7.0, y=-1.7, v=course((0.0, 8.0), (2.0, 8.0), (3.0, 2.5), (6.0, 2.5))),
        kinds=[CAR, BICYCLE], boxes=[(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)], **corridor(),
    )  # fmt: skip
    assert rollout.distance[0, 1].min() < 0.5
    assert (analyse(rollout).kind[0] != VIOLATION).all()


@pytest.mark.parametrize("who", ["the other", "the ego"])
def test_who_comes_near_while_they_are_level(track, meeting, course, who):
    """They are level from 2.8 s on (22 m at 8 m/s), 2 m apart; then one moves over by 1.6 m."""
    near = course((0.0, 0.0), (3.0, 0.0), (3.6, 1.6), (6.0, 1.6))
    ego, other = track(v=8.0), track(x=17.0, y=-3.3, v=3.0)
    if who == "the other":
        other["y"] = other["y"] + near
    else:
        ego["y"] = ego["y"] - near
    rollout = meeting(
        ego, other, kinds=[CAR, BICYCLE], boxes=[(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)],
        **corridor(lanes=(HALF, 6.0), edges=(FAR, 6.0)),
    )  # fmt: skip
    found = analyse(rollout)
    assert (found.type[0, 1] == ConflictType.CLOSE_PASS) == (who == "the ego")
    if who == "the ego":
        assert found.aside[0, 1] == pytest.approx(0.4)


@pytest.mark.parametrize("mirrored", [False, True])
@pytest.mark.parametrize("angle", [0.0, 1.0, -2.5])
def test_laws_of_mirror_and_rotation(track, meeting, course, angle, mirrored):
    ego = aside(track, course, 2.0)
    rollout = meeting(
        ego, track(x=25.0, y=-1.8, v=3.0), kinds=[CAR, BICYCLE],
        boxes=[(4.0, 2.0, 0.0), (1.8, 0.6, 0.0)], **corridor(lanes=(HALF, 3.0), edges=(FAR, 3.0)),
    )  # fmt: skip
    before, after = analyse(rollout), analyse(turned(rollout, angle, mirrored))
    for name in ("kind", "type", "rule", "responsible", "instant", "decided"):
        assert getattr(before, name).tolist() == getattr(after, name).tolist(), name
    sign = np.array([-1.0 if mirrored else 1.0, 1.0])
    assert after.aside[0] == pytest.approx(sign * before.aside[0], abs=1e-9)
    assert harm_of_pairs(after) == pytest.approx(harm_of_pairs(before), abs=1e-9)


def test_rare_events_are_of_encounters_alone(track, meeting, course):
    rollout = meeting(aside(track, course, 2.0), track(y=80.0), **corridor())
    assert decisive(analyse(rollout))[1][0] > NEAR_MISS
    assert (encounters(rollout).kind != VIOLATION).all()
    assert closeness_of_pairs(encounters(rollout), "ego").max() < NEAR_MISS


def test_parts_of_a_batch_keep_their_own_corridors(track, meeting, course):
    from bridgegen.simulation.rollout import joined

    ego, other = aside(track, course, 3.5), track(y=80.0)
    narrow, wide = corridor(), corridor(lanes=(FAR, HALF))
    wide["corridors"] = wide["corridors"][:, :-50]
    parts = [(np.array([k]), meeting(ego, other, **one)) for k, one in enumerate((wide, narrow))]
    parts.append((np.array([2]), meeting(ego, other)))
    found = analyse(joined(parts))
    assert found.kind[:, 0].tolist() == [0, VIOLATION, 0]
    back = analyse(joined(parts).take(np.array([1, 0])))
    assert back.kind[:, 0].tolist() == [VIOLATION, 0]


def test_an_obstacle_is_no_party(track, meeting):
    rollout = meeting(track(v=8.0), track(x=25.0, y=-1.7), kinds=[CAR, OTHER], **corridor())
    assert (analyse(rollout).kind != VIOLATION).all()


# Widths of lanes and shoulders are those of the scenarios' files; right-hand traffic.
@pytest.mark.parametrize(
    ("name", "expected"),
    [
        # two lanes of 3.75 m between shoulders of 2.5 m; the ego is on the right lane; 130 km/h
        ("cut-in", {(5.625, 1.875, 8.125, 4.375, 0.0)}),
        # one lane of 3.5 m each way, shoulders of 2.3 m; 50 km/h
        ("cyclist-swings-out", {(1.75, 1.75, 7.55, 4.05, 1.0)}),
        # the inner of two lanes of 3.5 m on each leg, and one through the junction
        ("left-across-path", {(1.75, 5.25, 8.75, 5.25, 1.0), (1.75, 1.75, np.inf, np.inf, 1.0)}),
    ],
)
def test_the_room_beside_routes_of_the_catalogue(name, expected):
    scenario = load(name)
    pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego="route-follower"))
    fixed = {"lane_width": 3.75 if name == "cut-in" else 3.5}
    middle = pipeline.space.decode(np.full((1, pipeline.space.n_var), 0.5))[0]
    x = [fixed.get(one, value) for one, value in zip(pipeline.space.names, middle, strict=True)]
    roads, _ = pipeline.runner.roads_of(np.array([x]))
    table = roads.corridors([0])[0]
    assert {tuple(row) for row in table[:, 3:].round(6).tolist()} == expected


def test_slides_are_found_and_lane_changes_are_none():
    """Where the bend behind the junction is slid through, harm is 0.3 or more in each row."""
    rng = np.random.default_rng(5)
    for name, ego in (("pedestrian-at-night", "route-follower"), ("cut-out", "reference")):
        scenario = load(name)
        pipeline = Pipeline(scenario, scenario.space(), PipelineOptions(ego=ego))
        rollout = pipeline.rollout(pipeline.space.decode(rng.random((120, pipeline.space.n_var))))
        there = np.arange(rollout.shape[2]) < rollout.n_steps[:, np.newaxis]
        off = np.abs(np.where(there, rollout.offset[:, 0], 0.0)).max(axis=1) > 1.75
        found = analyse(rollout)
        assert off.sum() > 10
        if ego == "reference":
            assert (found.kind[:, 0] == 0).all()
        else:
            assert (decisive(found)[1][off] >= NEAR_MISS).all()
