"""When the reference goes round somebody by the lane beside, and when it does not."""

import math

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.drivers import _lane_change_kernels as change
from bridgegen.drivers import _tracking_kernels as track
from bridgegen.drivers import kinds
from bridgegen.drivers._prediction_kernels import PASSAGE
from bridgegen.drivers._reference_kernels import MIND
from bridgegen.drivers._surroundings_kernels import AROUND, surround

DS, LENGTH, LANE = 0.5, 600.0, 3.5
GRIP = 0.85 * 9.81
N = round(LENGTH / DS) + 1
NO_CROSSWALKS, NO_LIGHTS, NO_PASSAGES = np.zeros((0, 4)), np.zeros(0), np.zeros((0, PASSAGE))

Body = tuple[float, float, float]  # x [m], y [m], speed along the road [m/s]


def two_lanes(*, left: float = LANE, right: float = 0.0, limit: float = 13.9) -> Float:
    return np.tile([limit, left, right], (N, 1))


def mind_after(
    *others: Body,
    s: float = 100.0,
    v: float = 12.0,
    pace: float = 13.9,
    road: Float | None = None,
    kind: int = kinds.CAR,
    crosswalks: Float = NO_CROSSWALKS,
    lights: Float = NO_LIGHTS,
    passages: Float = NO_PASSAGES,
    seen: float = 150.0,
    mind: Float | None = None,
    looks: int = 5,
) -> tuple[Float, float]:
    """What it has in mind after some looks, 0.1 s apart, and what waiting asks for."""
    tracks = np.zeros((len(others) + 1, track.TRACK))
    for one, (x, y, speed) in zip(tracks[1:], others, strict=True):
        one[[track.STATE, track.X, track.Y, track.VX]] = track.CONFIRMED, x, y, speed
        one[[track.LENGTH, track.WIDTH, track.KIND]] = 4.5, 1.9, kind
    x = np.arange(N) * DS
    path = np.stack([x, 0.0 * x, 0.0 * x, 1.0 + 0.0 * x, 0.0 * x, 0.0 * x], axis=1)
    around = np.zeros((len(tracks), AROUND))
    surround(path, N, DS, s, 250.0, 250.0, 0.1, tracks, around)
    mind = np.zeros(MIND) if mind is None else mind
    asked = math.inf
    for _ in range(looks):
        asked = change.change_lane(
            two_lanes() if road is None else road, N, DS, s, v, pace, 3.65, 0.85, 0.95, around,
            tracks, passages, len(passages), crosswalks, lights, seen, GRIP, 0.1, mind,
        )  # fmt: skip
    return mind, asked


def target(*others: Body, **scene) -> float:
    return float(mind_after(*others, **scene)[0][change.AFTER])


STANDS = (180.0, 0.0, 0.0)


def test_who_stands_is_gone_round_by_the_free_lane():
    assert target(STANDS) == LANE
    assert target() == 0.0
    assert target((180.0, LANE, 0.0)) == 0.0  # is not in the way
    assert target(STANDS, road=two_lanes(left=0.0)) == 0.0
    assert target(STANDS, road=two_lanes(left=0.0, right=-LANE)) == -LANE
    assert target((180.0, 0.0, 11.0)) == 0.0  # is hardly slower
    assert target((150.0, 0.0, 3.0)) == LANE


def test_it_does_not_go_round_for_one_look():
    assert target(STANDS, looks=2) == 0.0
    assert target(STANDS, looks=4) == LANE


def test_who_is_beside_or_comes_from_behind_goes_first():
    assert target(STANDS, (100.0, LANE, 12.0)) == 0.0
    assert target(STANDS, (88.0, LANE, 12.0)) == 0.0  # too near
    assert target(STANDS, (60.0, LANE, 20.0)) == 0.0  # would have to brake hard
    assert target(STANDS, (60.0, LANE, 8.0)) == LANE  # falls behind
    assert target(STANDS, (40.0, LANE, 12.0)) == LANE
    assert target(STANDS, (160.0, LANE, 14.0)) == LANE  # drives off ahead
    assert target(STANDS, (170.0, LANE, 0.0)) == 0.0  # both lanes are blocked


def test_who_may_come_unseen_counts_on_a_fast_road_in_fog():
    fast = two_lanes(limit=36.1)
    assert target(STANDS, road=fast, v=10.0, pace=25.0, seen=250.0) == LANE
    assert target(STANDS, road=fast, v=3.0, pace=10.0, seen=50.0) == 0.0


def test_queues_and_people_are_waited_for():
    assert target(STANDS, lights=np.array([200.0])) == 0.0
    assert target(STANDS, lights=np.array([170.0])) == LANE  # it stands behind the line
    assert target(STANDS, crosswalks=np.array([[190.0, 194.0, -6.0, 6.0]])) == 0.0
    assert target(STANDS, kind=kinds.PEDESTRIAN) == 0.0
    crosses = np.zeros((1, PASSAGE))
    crosses[0, :2] = 185.0, 190.0
    assert target(STANDS, passages=crosses) == 0.0


def test_the_lane_beside_must_last_until_it_is_back():
    ends = two_lanes()
    ends[round(220.0 / DS) :, 1] = 0.0
    assert target(STANDS, road=ends) == 0.0
    ends = two_lanes()
    ends[round(350.0 / DS) :, 1] = 0.0
    assert target(STANDS, road=ends) == LANE


def test_on_a_fast_road_nobody_who_moves_is_passed_on_the_right():
    right = {"left": 0.0, "right": -LANE}
    slow = (150.0, 0.0, 4.0)
    assert target(slow, road=two_lanes(limit=33.0, **right), seen=250.0) == 0.0
    assert target(slow, road=two_lanes(limit=13.9, **right)) == -LANE


def test_while_the_lane_beside_is_taken_it_waits_where_it_can_still_go_round():
    free, asked = mind_after((118.0, 0.0, 0.0), (100.0, LANE, 12.0), v=3.0)
    assert free[change.AFTER] == 0.0
    assert -2.0 <= asked < 0.0
    mind, asked = mind_after((114.0, 0.0, 0.0), v=0.0)
    assert mind[change.AFTER] == LANE
    assert math.isinf(asked)


def out(s: float) -> Float:
    """A mind that has changed to the left lane long before a station."""
    mind = np.zeros(MIND)
    mind[[change.BEFORE, change.AFTER, change.BEGINS, change.LENGTH]] = 0.0, LANE, s - 80.0, 50.0
    return mind


def test_it_comes_back_behind_nobody_slow_and_well_before_whom_it_has_passed():
    for x, expected in ((180.0, LANE), (104.0, LANE), (93.0, LANE), (88.0, 0.0)):
        assert target((x, 0.0, 0.0), mind=out(100.0)) == expected
    assert target((88.0, 0.0, 0.0), (200.0, 0.0, 0.0), mind=out(100.0)) == LANE
    assert target((96.0, 0.0, 12.0), mind=out(100.0)) == LANE


def test_it_stops_before_the_lane_beside_ends_if_it_cannot_come_back():
    ends = two_lanes()
    ends[round(170.0 / DS) :, 1] = 0.0
    mind, asked = mind_after((104.0, 0.0, 12.0), mind=out(100.0), road=ends)
    assert mind[change.AFTER] == LANE
    assert asked < -1.5


def test_a_change_that_has_begun_is_carried_out():
    mind = mind_after(STANDS)[0]
    before = mind.copy()
    again, asked = mind_after((100.0, LANE, 12.0), s=120.0, mind=mind)
    assert (again == before).all()
    assert math.isinf(asked)
