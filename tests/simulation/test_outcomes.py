"""Collisions and queues, from motions that are worked by hand."""

import math
from dataclasses import replace

import numpy as np
import pytest

from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.scenario.ontology.individuals import build_static
from bridgegen.simulation.accidents import Accident, accidents
from bridgegen.simulation.queues import Queue, find_queues, queues
from bridgegen.simulation.rollout import Rollout

DT = 0.1


def rollout(x, y=0.0, h=0.0, v=0.0, *, box=(4.0, 2.0, 0.0), names=None, steps=None):
    """One scenario of boxes of 4 m by 2 m about their reference points; ``(E, T)`` each."""
    x = np.asarray(x, dtype=float)
    e, t = x.shape
    full = [np.broadcast_to(np.asarray(one, dtype=float), (e, t))[None].copy()
            for one in (x, y, h, v)]  # fmt: skip
    return Rollout(
        time_step=DT,
        names=names or ("ego", *(f"bv{k}" for k in range(1, e))),
        box=np.broadcast_to(np.asarray(box, dtype=float), (e, 3)).copy(),
        x=full[0], y=full[1], h=full[2], v=full[3],
        a=np.zeros_like(full[0]), offset=np.zeros_like(full[0]),
        n_steps=np.array([steps or t]), status=np.zeros(1, np.int8),
    )  # fmt: skip


# -- collisions ------------------------------------------------------------------------------------


def test_driving_into_somebody_who_stands():
    """From 0 at 10 m/s towards a box from 28 to 32 m: it touches when its front is at 28 m."""
    t = np.arange(40) * DT
    one = rollout([10.0 * t, np.full(40, 30.0)], np.array([[0.0], [1.0]]))
    (crash,) = accidents(one, 0)
    assert crash.who == ("ego", "bv1")
    assert crash.time == pytest.approx(2.6)
    # front at 28 m: they touch along x = 28, from y = 0 to 1
    assert (crash.x, crash.y) == (pytest.approx(28.0), pytest.approx(0.5))


def test_the_middle_of_an_overlap():
    """A step later the overlap is 1 m by 1 m: its middle is half a metre inside."""
    t = np.arange(30) * DT
    (crash,) = accidents(rollout([10.0 * t + 0.5, np.full(30, 30.0)], [[0.0], [1.0]]), 0)
    assert (crash.time, crash.x, crash.y) == (2.6, pytest.approx(28.25), pytest.approx(0.5))
    turned = rollout([[0.0], [2.2]], [[0.0], [0.0]], [[0.0], [math.pi / 4]], box=(2.0, 2.0, 0.0))
    (crash,) = accidents(turned, 0)  # a corner, at 2.2 - √2, pokes into the side at x = 1
    a = 2.2 - math.sqrt(2.0)
    assert crash.y == pytest.approx(0.0, abs=1e-12)
    assert a < crash.x < 1.0


def test_nobody_hits_anybody():
    assert accidents(rollout([[0.0] * 5, [4.5] * 5]), 0) == ()


def test_one_accident_within_five_seconds_two_beyond():
    x = np.full((2, 120), [[0.0], [20.0]])
    x[1, [3, 4, 30, 100]] = 1.0  # 0.3 s, 3.0 s (the same), 10.0 s (another)
    assert [one.time for one in accidents(rollout(x), 0)] == [0.3, 10.0]


@pytest.mark.parametrize(("again", "times"), [(59, [1.0]), (60, [1.0]), (61, [1.0, 6.1])])
def test_five_seconds_after_a_contact_another_begins(again, times):
    """Contacts at 1.0 s and, 4.9, 5.0 or 5.1 s later, again."""
    x = np.full((2, 120), [[0.0], [20.0]])
    x[1, [10, again]] = 1.0
    assert [one.time for one in accidents(rollout(x), 0)] == times


def test_others_collide_too_but_not_what_is_part_of_the_road():
    x = [[-50.0] * 3, [0.0] * 3, [1.0] * 3, [2.0] * 3, [2.5] * 3]
    names = ("ego", "cone_1", "bv", "other", "cone_2")
    found = accidents(rollout(x, names=names), 0, ["cone_1", "cone_2"])
    assert {one.who for one in found} == {
        ("cone_1", "bv"), ("bv", "other"), ("bv", "cone_2"), ("cone_1", "other"),
        ("other", "cone_2"),
    }  # fmt: skip


def test_what_comes_after_the_end_did_not_happen():
    x = [[0.0] * 10, [20.0] * 5 + [0.0] * 5]
    assert accidents(rollout(x, steps=5), 0) == ()


@pytest.mark.parametrize("turn", [0.0, 0.7, 2.0])
def test_accidents_do_not_depend_on_where_north_is(turn):
    t = np.arange(40) * DT
    x, y, h = 10.0 * t, np.zeros(40), np.zeros(40)
    c, s = math.cos(turn), math.sin(turn)
    xs, ys = np.array([x, np.full(40, 30.2)]), np.array([y, np.full(40, 0.8)])
    (straight,) = accidents(rollout(xs, ys), 0)
    (turned,) = accidents(rollout(c * xs - s * ys, s * xs + c * ys, np.array([h, h]) + turn), 0)
    assert turned.time == straight.time
    assert turned.x == pytest.approx(c * straight.x - s * straight.y)
    assert turned.y == pytest.approx(s * straight.x + c * straight.y)


def test_accidents_come_in_the_order_of_time():
    """b and c touch at 0.2 s, before the ego and b do; of one instant, in the rollout's order."""
    x = np.full((3, 10), [[0.0], [20.0], [40.0]])
    x[1, 5:], x[2, 2:5] = 1.0, 21.0
    first, second = accidents(rollout(x, names=("ego", "b", "c")), 0)
    assert first == Accident(0.2, pytest.approx(20.5), 0.0, ("b", "c"))
    assert (second.time, second.who) == (0.5, ("ego", "b"))
    together = rollout([[0.0] * 3, [1.0] * 3, [2.0] * 3], names=("ego", "b", "c"))
    assert [one.who for one in accidents(together, 0)] == [("b", "c"), ("ego", "b"), ("ego", "c")]


# -- queues ----------------------------------------------------------------------------------------


def found(station, lane=0, length=4.0, steps=31):
    station = np.asarray(station, dtype=float)
    station = np.broadcast_to(station.reshape(len(station), -1), (len(station), steps))
    lane = np.broadcast_to(np.asarray(lane), station.shape)
    return find_queues(lane, station, np.full(len(station), length), DT)


def test_three_that_stand_behind_one_another_are_a_queue():
    """Centres at 0, 10 and 20 m, boxes of 4 m: from -2 to 22 m, gaps of 6 m."""
    assert found([0.0, 10.0, 20.0]) == [(0, (0, 1, 2), 0, 24.0)]


def test_two_are_none():
    assert found([0.0, 10.0]) == []


def test_far_apart_they_are_none():
    assert found([0.0, 10.0, 24.0]) == []  # a gap of 10 m is not below 10 m
    assert found([0.0, 10.0, 23.9]) == [(0, (0, 1, 2), 0, 27.9)]


def test_on_two_lanes_they_are_none():
    assert found([0.0, 10.0, 20.0], np.array([[0], [1], [0]])) == []


def test_less_than_two_seconds_is_none():
    lane = np.full((3, 31), -1)
    lane[:, 5:25] = 0  # 20 instants: 1.9 s
    assert found([0.0, 10.0, 20.0], lane) == []
    lane[:, 25] = 0  # 2.0 s
    assert found([0.0, 10.0, 20.0], lane) == [(0, (0, 1, 2), 5, 24.0)]


def test_who_joins_later_is_of_it():
    lane = np.zeros((4, 81), dtype=int)
    lane[3, :40] = -1
    assert found([0.0, 10.0, 20.0, 30.0], lane, steps=81) == [(0, (0, 1, 2, 3), 0, 34.0)]


def test_two_queues_on_one_lane():
    stations = [0.0, 10.0, 20.0, 100.0, 110.0, 120.0]
    assert found(stations) == [(0, (0, 1, 2), 0, 24.0), (0, (3, 4, 5), 0, 24.0)]


def test_a_queue_that_breaks_up_and_forms_again_is_two():
    lane = np.zeros((3, 101), dtype=int)
    lane[1, 40:45] = -1
    assert [(who, first) for _, who, first, _ in found([0.0, 10.0, 20.0], lane, steps=101)] == [
        ((0, 1, 2), 0),
        ((0, 1, 2), 45),
    ]


STATIC = {
    "lane_width": 3.5,
    "lanes_per_direction": 2,
    "arm_length": 60.0,
    "intersection_size": 26.0,
}


@pytest.fixture(scope="module")
def model():
    return opendrive_from_owl(build_static(STATIC))


def waiting(distances, speed=0.0, t=31):
    """Vehicles that face the junction on the inner inbound lane of leg A, south of it."""
    y = np.full((len(distances), t), 0.0)
    y += -(13.0 + np.asarray(distances))[:, None]
    x = np.full_like(y, 1.75)
    return rollout(x, y, math.pi / 2, speed)


LANES = {(str(road), lane) for road in (1, 2, 3, 4) for lane in (-2, -1, 1, 2)}


def test_a_queue_at_a_crossroads(model):
    one = waiting([5.0, 15.0, 25.0])
    (queue,) = queues(one, 0, one.names, model, LANES)
    assert (queue.time, queue.who) == (0.0, ("ego", "bv1", "bv2"))
    assert (queue.road_id, queue.lane_id) == ("1", 1)
    assert queue.length == pytest.approx(24.0)
    assert isinstance(queue, Queue)


def test_who_drives_is_in_no_queue(model):
    assert queues(waiting([5.0, 15.0, 25.0], 1.0), 0, ("ego", "bv1", "bv2"), model, LANES) == ()
    crawling = waiting([5.0, 15.0, 25.0], 0.99)
    assert len(queues(crawling, 0, crawling.names, model, LANES)) == 1


def test_only_vehicles_and_only_lanes_that_are_asked_for(model):
    one = waiting([5.0, 15.0, 25.0])
    assert queues(one, 0, ("ego", "bv1"), model, LANES) == ()
    assert queues(one, 0, one.names, model, LANES - {("1", 1)}) == ()
    beside = replace(one, x=one.x + 30.0)
    assert queues(beside, 0, one.names, model, LANES) == ()


def test_a_row_of_a_batch_is_that_row_alone(model):
    one, free = waiting([5.0, 15.0, 25.0]), waiting([5.0, 20.0, 50.0])
    both = replace(
        one,
        **{name: np.concatenate([getattr(free, name), getattr(one, name)])
           for name in ("x", "y", "h", "v", "a", "offset", "n_steps", "status")},
    )  # fmt: skip
    assert queues(both, 0, one.names, model, LANES) == ()
    assert queues(both, 1, one.names, model, LANES) == queues(one, 0, one.names, model, LANES)


# -- who is not there --------------------------------------------------------------------------


@pytest.mark.parametrize("who", [0, 1])
def test_nobody_runs_into_somebody_that_is_not_there(who):
    """As above, with either there up to 2.5 s, which is an instant before they would touch."""
    t = np.arange(40) * DT
    one = rollout([10.0 * t, np.full(40, 30.0)], np.array([[0.0], [1.0]]))
    present = np.ones(one.x.shape, dtype=np.bool_)
    present[0, who, 27:] = False
    assert len(accidents(replace(one, present=present), 0)) == 1
    present[0, who, 26:] = False
    assert accidents(replace(one, present=present), 0) == ()


def test_nobody_queues_that_is_not_there(model):
    one = waiting([5.0, 15.0, 25.0])
    present = np.ones(one.x.shape, dtype=np.bool_)
    assert len(queues(replace(one, present=present), 0, one.names, model, LANES)) == 1
    present[0, 1] = False
    assert queues(replace(one, present=present), 0, one.names, model, LANES) == ()
