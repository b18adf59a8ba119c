"""Laws of the conflict analysis and of harm, over bodies that turn, stop and meet."""

import math
from dataclasses import fields, replace

import numpy as np
import pytest
from hypothesis import example, given, settings
from hypothesis import strategies as st

from bridgegen.assess.conflict import quantities
from bridgegen.assess.conflict import severity as injury
from bridgegen.assess.conflict._codes import CONTACT, COURSE, NEAR_MISS, NO_CONFLICT
from bridgegen.assess.conflict._conflict_kernels import urgency
from bridgegen.assess.conflict._limits import FLUSH, HORIZON, SAME_WAY
from bridgegen.assess.conflict.analysis import Conflicts, Responsible, Zone, analyse
from bridgegen.assess.conflict.harm import NEAR_MISS as CRITICAL
from bridgegen.assess.conflict.harm import closeness_of_pairs, decisive, harm_of_pairs
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.conflict.types import Rule
from bridgegen.base import elementary
from bridgegen.drivers.kinds import CAR, PEDESTRIAN
from bridgegen.simulation.rollout import Rollout

DT = 0.05
SEEDS = st.integers(0, 10_000)
STATES = ("x", "y", "h", "v", "a", "offset")


def drive_around(seed, n=6, e=4, t=90):
    """Vehicles, people and objects that turn, stop and meet in a small place."""
    rng = np.random.default_rng(seed)
    time = DT * np.arange(t)
    v = np.abs(rng.uniform(0, 14, (n, e, 1)) + rng.uniform(-5, 3, (n, e, 1)) * time)
    v[rng.random((n, e)) < 0.2] = 0.0
    turn = rng.uniform(-0.5, 0.5, (n, e, 1)) * (rng.random((n, e, 1)) < 0.5)
    h = rng.uniform(-4, 4, (n, e, 1)) + turn * time
    claims = rng.integers(-4, 5, (n, e, e))
    return Rollout(
        time_step=DT,
        names=("ego", *(f"bv{j}" for j in range(1, e))),
        box=np.column_stack([rng.uniform(1, 6, e), rng.uniform(0.5, 2.5, e), rng.uniform(0, 2, e)]),
        x=rng.uniform(-20, 20, (n, e, 1)) + np.cumsum(DT * v * np.cos(h), axis=-1),
        y=rng.uniform(-20, 20, (n, e, 1)) + np.cumsum(DT * v * np.sin(h), axis=-1),
        h=np.broadcast_to(h, (n, e, t)).copy(),
        v=v,
        a=np.gradient(v, DT, axis=2),
        offset=rng.normal(0, 0.5, (n, e, 1)) + rng.normal(0, 0.3, (n, e, 1)) * time,
        n_steps=rng.integers(1, t + 1, n),
        status=np.zeros(n, np.int8),
        kinds=rng.integers(0, 8, e),
        light_names=("light",),
        lights=np.repeat(rng.integers(0, 5, (n, 1, 9)), 10, axis=2).astype(np.int8),
        stop_lines=np.concatenate(
            [rng.uniform(-10, 10, (n, 2, 2)), rng.uniform(-3, 3, (n, 2, 1))], axis=2
        ),
        stop_lights=np.array([0, 0]),
        stop_entities=np.array([0, 1]),
        claims=claims - np.swapaxes(claims, 1, 2),
        crosswalks=np.concatenate(
            [rng.uniform(-9, 9, (n, 1, 2)), rng.uniform(-3, 3, (n, 1, 1)), np.full((n, 1, 2), 3.0)],
            axis=2,
        ),
        friction=rng.uniform(1, 9, n),
        present=rng.random((n, e, 1)) < 0.9 + np.zeros((n, e, t)),
    )


def claims_within(rollout):
    """Keep the claims within what a map can say."""
    return replace(rollout, claims=np.clip(rollout.claims, -4, 4))


def around(seed):
    return claims_within(drive_around(seed))


def same(a: Conflicts, b: Conflicts, but=(), tolerance=0.0):
    for field in fields(Conflicts):
        if field.name in ("names", "time_step", "left_hand", "country", "driven", *but):
            continue
        one, other = getattr(a, field.name), getattr(b, field.name)
        if one.dtype.kind in "ib" or tolerance == 0.0:
            np.testing.assert_array_equal(one, other, field.name)
        else:
            np.testing.assert_allclose(one, other, atol=tolerance, err_msg=field.name)


def alike(a: Conflicts, b: Conflicts, but=(), share=0.95):
    """All pairs agree but a few that rounding decides."""
    agree = np.ones(a.kind.shape, np.bool_)
    for field in fields(Conflicts):
        one, other = getattr(a, field.name), getattr(b, field.name)
        if field.name in ("names", "time_step", "left_hand", "country", "driven", "ok", *but):
            continue
        agree &= (one == other) if one.dtype.kind in "ib" else np.isclose(one, other, atol=1e-5)
    assert agree.mean() >= share


def moved(rollout, turn, dx, dy):
    c, s = np.cos(turn), np.sin(turn)

    def pose(array):
        x, y = array[..., 0], array[..., 1]
        rest = array[..., 3:]
        return np.concatenate(
            [np.stack([x * c - y * s + dx, x * s + y * c + dy, array[..., 2] + turn], -1), rest], -1
        )

    return replace(
        rollout,
        x=rollout.x * c - rollout.y * s + dx,
        y=rollout.x * s + rollout.y * c + dy,
        h=rollout.h + turn,
        stop_lines=pose(rollout.stop_lines),
        crosswalks=pose(rollout.crosswalks),
    )


def test_noise_of_a_body_that_has_stopped_does_not_turn_it_round(meeting, track, course):
    """It brakes to a stop before one that stands, and then its speed wavers around 0."""
    v = course((0.0, 15.0), (1.0, 15.0), (2.875, 0.0), (6.0, 0.0))
    ahead = track(v=v)
    standing = track(x=ahead["x"][-1] + 4.4, v=0.0)
    known = analyse(meeting(ahead, standing))
    assert known.kind[0, 1] == NEAR_MISS
    noisy = ahead | {"v": np.where(v == 0.0, -0.01, v)}
    found = analyse(meeting(noisy, standing))
    assert found.kind[0, 1] == NEAR_MISS
    assert found.ttc[0, 1] == known.ttc[0, 1]


@given(SEEDS, st.floats(-3, 3), st.floats(-100, 100), st.floats(-100, 100))
@settings(max_examples=25)
def test_it_does_not_matter_where_north_is(seed, turn, dx, dy):
    rollout = around(seed)
    alike(analyse(rollout), analyse(moved(rollout, turn, dx, dy)))


MIRRORED = np.array(
    [Zone.NONE, Zone.FRONT, Zone.FRONT_RIGHT, Zone.RIGHT, Zone.REAR_RIGHT, Zone.REAR,
     Zone.REAR_LEFT, Zone.LEFT, Zone.FRONT_LEFT]
)  # fmt: skip


@given(SEEDS, st.lists(st.booleans(), min_size=4, max_size=4))
@example(1211, [False, True, False, False])
@settings(max_examples=60, deadline=None)
def test_driving_backwards_is_driving_ahead_with_the_body_turned_round(seed, turned):
    """Only the zones have other names: what was the front is the rear.

    Who stands drives neither way, and is another one when turned round; here, none does.
    """
    ahead = drive_around(seed)
    ahead = replace(ahead, v=np.where(ahead.v == 0.0, 0.01, ahead.v))
    back = np.array(turned)
    sign = np.where(back, -1.0, 1.0)
    box = ahead.box.copy()
    box[:, 2] *= sign
    backwards = replace(
        ahead, box=box, h=ahead.h + np.where(back, np.pi, 0.0)[:, None],
        v=ahead.v * sign[:, None], a=ahead.a * sign[:, None],
    )  # fmt: skip
    one, other = analyse(ahead), analyse(backwards)
    for name in ("kind", "type", "responsible", "rule", "instant", "decided", "at_fault"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name
    for name in ("severity", "ttc", "v_ego", "v_other"):
        if not back.any() or name != "severity":
            np.testing.assert_allclose(getattr(one, name), getattr(other, name), rtol=1e-6)
    assert plausibility(ahead).labels == plausibility(backwards).labels
    for zone, there, flips in (
        (one.zone_ego, other.zone_ego, back[0]),
        (one.zone_other, other.zone_other, back),
    ):
        opposite = np.where(zone == Zone.NONE, zone, (zone - Zone.FRONT + 4) % 8 + Zone.FRONT)
        assert np.array_equal(np.where(flips, opposite, zone), there)
    names = ["d_min", "v_d", "ttc", "btn", "drac", "pet", "thw"]
    np.testing.assert_allclose(
        quantities.evaluate(ahead, names), quantities.evaluate(backwards, names), rtol=1e-6
    )


@given(SEEDS)
@settings(max_examples=25)
def test_in_a_mirror_left_and_right_change_places(seed):
    """Only the rule of the right does not: it is left out by claims on every pair."""
    rollout = around(seed)
    claims = np.where(rollout.claims == 0, 1, rollout.claims)
    rollout = replace(rollout, claims=claims)

    def flip(array):
        return array * np.array([1.0, -1.0, -1.0, 1.0, 1.0][: array.shape[-1]])

    mirror = replace(
        rollout,
        y=-rollout.y,
        h=-rollout.h,
        offset=-rollout.offset,
        stop_lines=flip(rollout.stop_lines),
        crosswalks=flip(rollout.crosswalks),
    )
    one, other = analyse(rollout), analyse(mirror)
    zones = replace(other, zone_ego=MIRRORED[other.zone_ego], zone_other=MIRRORED[other.zone_other])
    alike(one, zones)


@given(SEEDS)
@settings(max_examples=25)
def test_a_rows_result_depends_on_that_row_alone(seed):
    rollout = around(seed)
    whole = analyse(rollout)
    for i in (0, 3):
        names = (*STATES, "n_steps", "status", "lights", "stop_lines", "claims", "crosswalks",
                 "friction",
                 "present")  # fmt: skip
        alone = analyse(replace(rollout, **{n: getattr(rollout, n)[i : i + 1] for n in names}))
        for field in fields(Conflicts):
            if field.name not in ("names", "time_step", "left_hand", "country", "driven"):
                np.testing.assert_array_equal(
                    getattr(whole, field.name)[i], getattr(alone, field.name)[0], field.name
                )


@given(SEEDS)
@settings(max_examples=25)
def test_the_order_of_the_others_does_not_matter(seed):
    rollout = around(seed)
    order = np.array([0, 3, 1, 2])
    shuffled = replace(
        rollout,
        names=tuple(rollout.names[i] for i in order),
        box=rollout.box[order],
        kinds=rollout.kinds[order],
        present=rollout.present[:, order],
        claims=rollout.claims[:, order][:, :, order],
        stop_entities=np.array([0, 2]),
        **{name: getattr(rollout, name)[:, order] for name in STATES},
    )
    one, other = analyse(rollout), analyse(shuffled)
    for field in fields(Conflicts):
        if field.name not in ("names", "time_step", "left_hand", "country", "driven", "ok"):
            np.testing.assert_array_equal(
                getattr(one, field.name)[:, order], getattr(other, field.name), field.name
            )


@given(SEEDS, st.integers(1, 40))
@settings(max_examples=25)
def test_instants_before_anybody_is_present_shift_the_result(seed, steps):
    rollout = around(seed)

    def later(array):
        return np.concatenate([np.repeat(array[..., :1], steps, axis=-1), array], axis=-1)

    n, e, _ = rollout.shape
    absent = np.zeros((n, e, steps), np.bool_)
    shifted = replace(
        rollout,
        n_steps=rollout.n_steps + steps,
        lights=later(rollout.lights),
        present=np.concatenate([absent, rollout.present], axis=2),
        **{name: later(getattr(rollout, name)) for name in STATES},
    )
    one, other = analyse(rollout), analyse(shifted)
    happened = one.kind > NO_CONFLICT
    np.testing.assert_array_equal(one.kind, other.kind)
    np.testing.assert_array_equal((one.instant + steps)[happened], other.instant[happened])
    np.testing.assert_array_equal(one.type, other.type)


@given(SEEDS)
@settings(max_examples=40)
def test_contact_is_where_the_distance_is_zero_first(seed):
    rollout = around(seed)
    found = analyse(rollout)
    for i in range(rollout.shape[0]):
        touching = rollout.distance[i, :, : rollout.n_steps[i]] == 0.0
        first = np.argmax(touching.any(axis=0)) if touching.any() else -1
        expected = touching[:, first] if first >= 0 else np.zeros(rollout.shape[1], np.bool_)
        np.testing.assert_array_equal(found.kind[i] == CONTACT, expected)
        assert (found.instant[i][expected] == first).all()


@given(SEEDS)
@settings(max_examples=40)
def test_harm_is_between_0_and_1_and_ordered(seed):
    found = analyse(around(seed))
    own, whoever = harm_of_pairs(found), harm_of_pairs(found, "any")
    assert ((own >= 0.0) & (own <= 1.0)).all()
    assert (whoever >= own).all()
    assert (decisive(found, "any")[1] >= decisive(found)[1]).all()
    near, contact = found.kind == NEAR_MISS, found.kind == CONTACT
    assert (whoever[near | contact] >= CRITICAL).all()
    assert (whoever[~near & ~contact] < CRITICAL).all()
    close = closeness_of_pairs(found, "any")
    np.testing.assert_array_equal(close >= 0.6, contact & (whoever > 0.0))
    np.testing.assert_array_equal(close >= CRITICAL, whoever >= CRITICAL)
    np.testing.assert_array_equal(found.severity[contact], found.potential[contact])
    assert not found.severity[~contact].any()
    others = (found.responsible == Responsible.OTHER) & ~found.preventable
    assert not own[others & (near | contact)].any()
    critical = own >= CRITICAL
    assert (found.at_fault[critical] & (near | contact)[critical]).all()
    # One that has priority need not reckon with an ego that stops in its way.
    priority = (found.rule >= Rule.MAP_PRIORITY) & (found.rule <= Rule.ONCOMING_FIRST)
    priority |= found.rule == Rule.FROM_OFF_ROAD
    assert not (critical & (found.stood_ego > 0.0) & ~priority).any()


def pair(of=harm_of_pairs, **values):
    """Return what one pair is worth with values given; the ego is responsible."""
    whole = {field.name: np.zeros((1, 2)) for field in fields(Conflicts)}
    for name in ("kind", "type", "responsible", "rule", "instant", "decided", "zone_ego",
                 "zone_other"):  # fmt: skip
        whole[name] = np.zeros((1, 2), np.int64)
    whole["preventable"] = whole["leads_ego"] = np.zeros((1, 2), np.bool_)
    whole["responsible"][0, 1] = Responsible.EGO
    whole |= {"names": ("ego", "bv"), "time_step": DT, "ok": np.ones(1, np.bool_)}
    for name, value in values.items():
        whole[name][0, 1] = value
    return of(Conflicts(**whole), "ego")[0, 1]


TIMES, DECELERATIONS = st.floats(0.0, 4.0), st.floats(0.0, 60.0)


@given(st.floats(0.0, 1.0), st.floats(0.0, 1.0), TIMES, DECELERATIONS)
def test_a_collision_ranks_by_severity_and_above_the_near_miss_of_it(one, other, ttc, needed):
    collision = pair(kind=CONTACT, potential=one)
    near = pair(kind=NEAR_MISS, potential=one, ttc=ttc, needed=needed)
    assert collision > near if one > 1e-12 else collision == pytest.approx(near)
    if one > other + 1e-12:
        assert collision > pair(kind=CONTACT, potential=other)


def severity(kind, speed):
    """Return the severity of a car's front against the rear of another body."""
    return float(injury.severity(CAR, kind, speed, 0.0, injury.FRONT, injury.REAR))


def test_a_touch_ranks_below_a_serious_near_miss_and_collisions_spread():
    touch = pair(kind=CONTACT, potential=severity(CAR, 0.23))
    nearly = pair(kind=NEAR_MISS, ttc=0.2, needed=13.0 / 0.4, potential=severity(PEDESTRIAN, 13.0))
    crashes = [pair(kind=CONTACT, potential=severity(CAR, v)) for v in (1.0, 5.0, 10.0, 20.0, 30.0)]
    assert CRITICAL < touch < crashes[0] < nearly < crashes[2]
    assert np.diff(crashes).min() > 0.08
    assert pair(kind=CONTACT, potential=severity(PEDESTRIAN, 13.0)) > crashes[3]
    # a severity of 1 %: 0.3 + 0.7 ln(101) / ln(10001) = 0.3 + 0.7 x 4.615121 / 9.210440
    assert pair(kind=CONTACT, potential=0.01) == pytest.approx(0.650752, abs=1e-6)
    assert pair(kind=CONTACT, potential=1.0) == 1.0
    assert pair(kind=CONTACT, potential=0.0) == CRITICAL


def test_a_near_miss_has_the_severity_of_the_collision_that_it_nearly_is():
    """Two cars, the ego 6 m behind one that stands, at 10 m/s, then gone: a near miss."""
    still, moving = np.zeros((1, 40)), np.full((1, 40), 10.0)
    x = np.stack([np.cumsum(DT * moving, axis=1), still + 10.5 + 0.5], axis=1)
    stops = np.minimum(x, x[:, :1, 9:10])  # it halts at once after half a second
    stops[:, 1] = x[:, 1]
    v = np.stack([np.where(np.arange(40) < 10, moving, 0.0), still], axis=1)
    rollout = Rollout(
        time_step=DT, names=("ego", "bv"), box=np.array([[4.5, 1.8, 0.0]] * 2), x=stops,
        y=np.zeros((1, 2, 40)), h=np.zeros((1, 2, 40)), v=v, a=np.zeros((1, 2, 40)),
        offset=np.zeros((1, 2, 40)), status=np.zeros(1, np.int8),
        n_steps=np.full(1, 40), kinds=np.array([CAR, CAR]),
    )  # fmt: skip
    found = analyse(rollout)
    assert found.kind[0, 1] == NEAR_MISS
    assert found.closing_normal[0, 1] == pytest.approx(10.0)
    assert found.potential[0, 1] == pytest.approx(severity(CAR, 10.0))
    assert found.severity[0, 1] == found.delta_v_ego[0, 1] == 0.0


@given(TIMES, TIMES, DECELERATIONS, DECELERATIONS, st.sampled_from([COURSE, NEAR_MISS]))
def test_a_near_miss_grows_as_time_falls_and_deceleration_rises(t1, t2, d1, d2, kind):
    nearer = pair(kind=kind, ttc=min(t1, t2), needed=max(d1, d2), potential=0.2)
    assert nearer >= pair(kind=kind, ttc=max(t1, t2), needed=min(d1, d2), potential=0.2)


@given(st.sampled_from([COURSE, NEAR_MISS, CONTACT]), st.floats(0, 50), st.floats(0, 50))
def test_no_speed_enters_by_itself(kind, v, w):
    same_course = {"kind": kind, "ttc": 1.0, "needed": 5.0, "potential": 0.2}
    assert pair(v_ego=v, v_other=w, closing_normal=v, **same_course) == pair(**same_course)


@given(TIMES, DECELERATIONS)
def test_the_kernels_urgency_is_that_of_harm(ttc, needed):
    close = pair(closeness_of_pairs, kind=NEAR_MISS, ttc=ttc, needed=needed)
    assert close == pytest.approx(0.3 + 0.3 * urgency(ttc, needed))
    course = pair(kind=COURSE, ttc=ttc, needed=needed)
    assert course == pytest.approx(0.1 + 0.2 * urgency(ttc, needed))
    assert urgency(HORIZON, needed) == 0.0


def test_constants_have_the_bits_of_elementary_functions():
    """They are written out: importing them must not import the compiler."""
    assert elementary.sin(math.radians(8.0)) == FLUSH
    assert elementary.cos(math.radians(35.0)) == SAME_WAY
    side, front = injury.CURVES["side"], injury.CURVES["front"]
    at_ten_percent = 73.0 / 2.0 / 3.6
    assert side.intercept == elementary.log(0.1 / 0.9) - front.slope * at_ten_percent
