from dataclasses import replace
from math import cos, pi, sin

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import approve

from bridgegen.assess.conflict.plausibility import LIMITS, SLIP, Implausible, plausibility
from bridgegen.drivers.kinds import ANIMAL, BICYCLE, BUS, CAR, MOTORCYCLE, OTHER, PEDESTRIAN, TRUCK
from bridgegen.simulation.rollout import Rollout

DT = 0.05
CAR_BOX, PROP_BOX, WALKER_BOX = (4.6, 1.9, 1.4), (0.4, 0.4, 0.0), (0.5, 0.6, 0.0)
FAR = 1000.0  # m, where the ego is


class Body:
    """The states of one body at T instants."""

    def __init__(self, x=0.0, y=0.0, h=0.0, v=0.0, *, kind=CAR, box=CAR_BOX, there=True, t=61):
        self.kind, self.box = kind, box
        self.x, self.y, self.h, self.v, self.there = (
            np.broadcast_to(one, t).copy() for one in (x, y, h, v, there)
        )


def drives(speed, *, x=0.0, y=0.0, h=0.0, t=61, **given):
    """A body that goes along its heading, both of which may change from instant to instant."""
    speed, h = (np.broadcast_to(np.asarray(one, float), t) for one in (speed, h))
    step = 0.5 * (speed[1:] + speed[:-1]) * DT
    middle = 0.5 * (h[1:] + h[:-1])
    xs = x + np.concatenate([[0.0], np.cumsum(step * np.cos(middle))])
    ys = y + np.concatenate([[0.0], np.cumsum(step * np.sin(middle))])
    return Body(xs, ys, h, speed, t=t, **given)


def scene(*others, ego=None, n_steps=None, status=0):
    """One row with an ego far away, unless it is given."""
    t = len(others[0].x)
    bodies = [ego or Body(FAR, FAR, t=t), *others]
    states = {name: np.array([[getattr(one, name) for one in bodies]]) for name in "xyhv"}
    there = np.array([[one.there for one in bodies]])
    return Rollout(
        time_step=DT,
        names=("ego", *(f"bv{i}" for i in range(1, len(bodies)))),
        box=np.array([one.box for one in bodies]),
        **states, a=np.zeros_like(states["x"]), offset=np.zeros_like(states["x"]),
        n_steps=np.array([n_steps or t]),
        status=np.array([status], np.int8),
        kinds=np.array([one.kind for one in bodies]),
        present=np.zeros((0, 0, 0), bool) if there.all() else there,
    )  # fmt: skip


def found(*others, **given):
    """The code of one row, when, who and whom."""
    one = plausibility(scene(*others, **given))
    return Implausible(one.code[0]), int(one.instant[0]), int(one.entity[0]), int(one.other[0])


PLAUSIBLE = (Implausible.NONE, -1, -1, -1)


def test_ordinary_driving_is_plausible():
    time = DT * np.arange(61)
    bend = drives(8.0, h=0.1 * 8.0 * time)  # 10 m radius, 6.4 m/s² across
    brakes = drives(np.maximum(20.0 - 9.0 * time, 0.0), y=50.0)
    walker = Body(x=5.0, y=100.0 + 1.5 * time, h=0.0, v=1.5, kind=PEDESTRIAN, box=WALKER_BOX)
    assert found(bend, brakes, walker) == PLAUSIBLE


def test_two_others_that_collide():
    # Fronts 3.7 m ahead, rears 0.9 m behind: 10 m/s close 20 − 4.6 m in 1.54 s, instant 31.
    comes, stands = drives(10.0), Body(20.0)
    assert found(comes, stands) == (Implausible.OTHERS_COLLIDE, 31, 1, 2)
    one = plausibility(scene(comes, stands))
    approve(one.reason(0), "1.55 s")
    assert found(comes, Body(20.0, y=1.91)) == PLAUSIBLE  # 1.9 m wide each: 1 cm between them
    assert found(comes, Body(20.0, y=1.88)) == (Implausible.OTHERS_COLLIDE, 31, 1, 2)


def test_what_comes_after_the_ego_s_contact_does_not_matter():
    comes, stands = drives(10.0), Body(20.0)
    crash = drives(10.0, x=-200.0, h=pi / 2, y=-10.0)  # meets bv3 before the others meet
    target = Body(-200.0, 0.0)
    assert found(comes, stands, target, ego=crash) == PLAUSIBLE
    late = drives(3.0, x=-200.0, h=pi / 2, y=-10.0)
    assert found(comes, stands, target, ego=late)[0] is Implausible.OTHERS_COLLIDE


def test_what_comes_long_after_a_near_miss_does_not_matter():
    """The ego brakes 6 m before a car, at 1 s; another stops at once from 10 m/s, then or later."""
    steps = np.arange(61)
    ego = drives(np.maximum(10.0 - 9.0 * DT * np.maximum(steps - 20, 0), 0.0), x=-200.0)
    target = Body(-200.0 + 10.0 + 4.6 + 6.0, 0.0)

    def stops(at):
        return drives(np.where(steps < at, 10.0, 0.0), y=50.0)

    assert found(stops(30), target, ego=ego)[0] is Implausible.DECELERATION
    assert found(stops(50), target, ego=ego) == PLAUSIBLE
    assert found(stops(50), Body(-100.0, 9.0), ego=ego)[0] is Implausible.DECELERATION


def test_the_ego_s_own_motion_is_not_judged():
    slides = Body(50.0, 5.0 * DT * np.arange(61), 0.0, 5.0)
    assert found(Body(), ego=slides) == PLAUSIBLE
    assert found(slides)[0] is Implausible.SIDEWAYS_MOTION


@pytest.mark.parametrize("kind", [CAR, BUS, BICYCLE])
def test_wheels_do_not_move_sideways(kind):
    crab = Body(v=1.0, y=1.0 * DT * np.arange(61), kind=kind)
    assert found(crab) == (Implausible.SIDEWAYS_MOTION, 1, 1, -1)
    one = plausibility(scene(crab))
    assert one.value[0] == pytest.approx(1.0)
    assert one.limit[0] == pytest.approx(0.2 + SLIP * 1.0)
    approve(one.reason(0), "1.00 m/s", "0.05 s")
    step = Body(x=10.0 * DT * np.arange(61), y=3.5 * (np.arange(61) > 20), v=10.0, kind=kind)
    assert found(step)[:2] == (Implausible.JUMP, 21)
    assert found(replace_kind(crab, PEDESTRIAN)) == PLAUSIBLE


def replace_kind(body, kind):
    return Body(body.x, body.y, body.h, body.v, kind=kind)


def test_a_body_that_turns_on_the_spot():
    turns = Body(h=0.5 * pi * (np.arange(61) > 30))
    assert found(turns) == (Implausible.CURVATURE, 31, 1, -1)
    approve(plausibility(scene(turns)).reason(0), "1.55 s")


def test_a_turn_beyond_the_steering_and_beyond_the_grip():
    time = DT * np.arange(61)
    tight = drives(1.0, h=1.0 * time)  # 1 m radius
    assert found(tight)[0] is Implausible.CURVATURE
    assert found(drives(1.0, h=1.0 * time, kind=BICYCLE)) == PLAUSIBLE
    fast = drives(20.0, h=0.6 * time)  # 12 m/s²
    one = plausibility(scene(fast))
    assert Implausible(one.code[0]) is Implausible.LATERAL_ACCELERATION
    assert one.value[0] == pytest.approx(12.0)
    assert found(drives(20.0, h=0.3 * time)) == PLAUSIBLE  # 6 m/s²
    assert found(drives(20.0, h=0.3 * time, kind=TRUCK))[0] is Implausible.LATERAL_ACCELERATION


def test_speeds_that_change_too_fast():
    stops = drives(np.where(np.arange(61) < 30, 8.5, 0.0))
    one = plausibility(scene(stops))
    assert (one.code[0], one.instant[0]) == (Implausible.DECELERATION, 30)
    assert one.value[0] == pytest.approx(8.5 / 0.25)
    approve(one.reason(0), "34.0 m/s²", "1.50 s")
    leaps = drives(np.where(np.arange(61) < 30, 0.0, 3.0))
    assert found(leaps)[:2] == (Implausible.ACCELERATION, 30)


@pytest.mark.parametrize("kind", [CAR, TRUCK, BICYCLE, PEDESTRIAN])
def test_a_little_less_than_the_limit_is_plausible(kind):
    time = DT * np.arange(61)
    faster, slower = LIMITS[kind][:2]
    assert found(drives(np.minimum(0.99 * faster * time, 20.0), kind=kind)) == PLAUSIBLE
    assert found(drives(np.maximum(20.0 - 0.99 * slower * time, 0.0), kind=kind)) == PLAUSIBLE
    worse = drives(np.maximum(20.0 - (slower + 0.5) * time, 0.0), kind=kind)
    assert found(worse)[0] is Implausible.DECELERATION


def test_bodies_that_start_in_each_other():
    assert found(Body(0.0), Body(2.0)) == (Implausible.BODIES_OVERLAP_AT_START, 0, 1, 2)
    one = plausibility(scene(Body(0.0), Body(2.0)))
    assert one.value[0] == pytest.approx(1.9)  # side by side is the shorter way out
    approve(one.reason(0), "1.90 m", "0.00 s")
    assert found(Body(0.0), Body(4.6)) == PLAUSIBLE  # bumper to bumper
    ego = Body(3.0)
    assert found(Body(0.0), ego=ego) == (Implausible.BODIES_OVERLAP_AT_START, 0, 0, 1)


def test_props_may_stand_in_each_other_but_nobody_drives_through_them():
    barrier = (2.0, 0.4, 0.0)
    parts = [Body(1.9 * i, kind=OTHER, box=barrier) for i in range(3)]
    assert found(*parts) == PLAUSIBLE
    through = drives(10.0, x=-10.0)
    assert found(through, *parts)[0] is Implausible.OTHERS_COLLIDE


def test_who_is_added_where_somebody_is():
    there = np.arange(61) >= 20
    added = Body(2.0, there=there)
    assert found(Body(0.0), added) == (Implausible.BODIES_OVERLAP_AT_START, 20, 1, 2)
    leaves = Body(2.0, there=~there)
    assert found(drives(10.0, x=-30.0), leaves) == PLAUSIBLE  # would be there at 2.7 s
    stays = Body(2.0)
    assert found(drives(10.0, x=-20.0), stays)[0] is Implausible.OTHERS_COLLIDE


def test_who_comes_back_elsewhere_has_not_jumped():
    x = np.where(np.arange(61) < 40, 0.0, 300.0)
    gone = (np.arange(61) < 20) | (np.arange(61) >= 40)
    assert found(Body(x, there=gone)) == PLAUSIBLE
    assert found(Body(x))[:2] == (Implausible.JUMP, 40)


def test_a_body_that_meets_one_that_comes_back():
    x = np.where(np.arange(61) < 20, 300.0, 12.0)
    back = Body(x, there=(np.arange(61) < 10) | (np.arange(61) >= 20))
    assert found(drives(5.0), back)[0] is Implausible.OTHERS_COLLIDE


def test_padding_and_failed_rows_do_not_count():
    comes, stands = drives(10.0), Body(20.0)
    assert found(comes, stands, n_steps=31) == PLAUSIBLE
    assert found(comes, stands, n_steps=32)[0] is Implausible.OTHERS_COLLIDE
    assert found(comes, stands, status=1) == PLAUSIBLE


def test_without_kinds_only_overlaps_and_jumps_count():
    rollout = replace(scene(Body(v=1.0, y=1.0 * DT * np.arange(61))), kinds=np.zeros(0, np.int64))
    assert plausibility(rollout).code[0] == Implausible.NONE
    rollout = replace(scene(Body(0.0), Body(2.0)), kinds=np.zeros(0, np.int64))
    assert plausibility(rollout).code[0] == Implausible.BODIES_OVERLAP_AT_START


def random_rows(n, seed):
    """Bodies that drive, turn and stop near each other, in N rows."""
    rng = np.random.default_rng(seed)
    t, e = 41, 4
    time = DT * np.arange(t)
    v = np.abs(rng.uniform(0, 14, (n, e, 1)) + rng.uniform(-12, 9, (n, e, 1)) * time)
    h = rng.uniform(-4, 4, (n, e, 1)) + rng.uniform(-0.8, 0.8, (n, e, 1)) * time
    step = 0.5 * (v[..., 1:] + v[..., :-1]) * DT
    middle = 0.5 * (h[..., 1:] + h[..., :-1])
    start = rng.uniform(-15, 15, (2, n, e, 1))
    x = start[0] + np.concatenate(
        [np.zeros((n, e, 1)), np.cumsum(step * np.cos(middle), axis=-1)], axis=-1
    )
    y = start[1] + np.concatenate(
        [np.zeros((n, e, 1)), np.cumsum(step * np.sin(middle), axis=-1)], axis=-1
    )
    return Rollout(
        time_step=DT, names=("ego", "a", "b", "c"),
        box=np.array([CAR_BOX, CAR_BOX, WALKER_BOX, (10.0, 2.5, 3.4)]),
        x=x, y=y, h=h, v=v, a=np.zeros_like(x), offset=np.zeros_like(x),
        n_steps=rng.integers(2, t + 1, n), status=np.zeros(n, np.int8),
        kinds=np.array([CAR, CAR, PEDESTRIAN, TRUCK]),
    )  # fmt: skip


ROWS = random_rows(60, 0)


def moved(rollout, turn, dx, dy):
    c, s = cos(turn), sin(turn)
    return replace(
        rollout,
        x=rollout.x * c - rollout.y * s + dx,
        y=rollout.x * s + rollout.y * c + dy,
        h=rollout.h + turn,
    )


@settings(max_examples=20, deadline=None)
@given(st.floats(-4, 4), st.floats(-1e3, 1e3), st.floats(-1e3, 1e3))
def test_the_place_and_direction_of_the_world_do_not_matter(turn, dx, dy):
    here, there = plausibility(ROWS), plausibility(moved(ROWS, turn, dx, dy))
    assert len(set(here.code)) > 3  # of several kinds
    np.testing.assert_array_equal(here.code, there.code)
    np.testing.assert_array_equal(here.instant, there.instant)
    np.testing.assert_allclose(here.value, there.value, rtol=1e-6, atol=1e-9)


@settings(max_examples=20, deadline=None)
@given(st.lists(st.integers(0, 59), min_size=1, max_size=60, unique=True))
def test_a_row_is_judged_by_itself(rows):
    whole = plausibility(ROWS)
    names = ("x", "y", "h", "v", "a", "offset", "n_steps", "status")
    part = plausibility(replace(ROWS, **{name: getattr(ROWS, name)[rows] for name in names}))
    for name in ("code", "instant", "entity", "other", "value", "limit"):
        np.testing.assert_array_equal(getattr(part, name), getattr(whole, name)[rows])


def test_collisions_are_those_that_plain_geometry_finds():
    """Every instant of every pair, by shapely."""
    shapely = pytest.importorskip("shapely")

    def polygon(i, e, k):
        length, width, ahead = ROWS.box[e]
        c, s = cos(ROWS.h[i, e, k]), sin(ROWS.h[i, e, k])
        corners = []
        for a, b in ((0.5, 0.5), (-0.5, 0.5), (-0.5, -0.5), (0.5, -0.5)):
            u, w = ahead + a * length, b * width
            corners.append((ROWS.x[i, e, k] + u * c - w * s, ROWS.y[i, e, k] + u * s + w * c))
        return shapely.Polygon(corners)

    one = plausibility(ROWS)
    hits = 0
    for i in range(60):
        first = None
        contact = None
        for k in range(int(ROWS.n_steps[i])):
            shapes = [polygon(i, e, k) for e in range(4)]
            pairs = [(a, b) for a in range(1, 4) for b in range(a + 1, 4)]
            deep = any(shapes[a].buffer(-0.02).intersects(shapes[b]) for a, b in pairs)
            if first is None and deep:
                first = k
            if contact is None and any(shapes[0].intersects(shapes[e]) for e in range(1, 4)):
                contact = k
        if one.code[i] == Implausible.OTHERS_COLLIDE:
            hits += 1
            assert first is not None
            assert one.instant[i] <= first <= one.instant[i] + 2
            assert contact is None or one.instant[i] <= contact
        elif one.code[i] == Implausible.NONE and first is not None:
            assert contact is not None
            assert contact < first + 1
    assert hits >= 3


@pytest.mark.parametrize(
    ("kind", "starts", "brakes", "radius", "across"),
    [
        (CAR, 8.0, 11.0, 3.125, 9.81),
        (TRUCK, 3.0, 8.0, 5.0, 4.905),
        (BUS, 3.0, 8.0, 5.0, 4.905),
        (MOTORCYCLE, 10.0, 11.0, 2.0, 9.81),
        (BICYCLE, 3.0, 7.0, 1.0, 6.867),
        (PEDESTRIAN, 8.0, 8.0, 0.0, np.inf),
        (ANIMAL, 13.0, 13.0, 0.0, np.inf),
        (OTHER, np.inf, np.inf, 0.0, np.inf),
    ],
)
def test_what_bodies_can_do_is_as_published(kind, starts, brakes, radius, across):
    """The numbers of the sources that `LIMITS` names: m/s², m/s², m, m/s²."""
    most = LIMITS[kind].tolist()
    assert most[:2] == [starts, brakes]
    assert 1.0 / most[2] == pytest.approx(radius)
    assert most[3] == pytest.approx(across)
