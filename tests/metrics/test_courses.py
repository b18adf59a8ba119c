"""drac, btn, thw, tet, tit: by hand; against ttc at every instant; against simulated braking."""

from math import pi

import numpy as np
import pytest
from hypothesis import assume, example, given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.assess.metrics.braking import MOST, btn, drac
from bridgegen.assess.metrics.times import TARGET, tet, thw, tit, ttc

GRIP = 0.85 * 9.81
"""m/s², of a tyre on dry asphalt: Wong, table 1.3."""

# By hand. Boxes are 4 m × 2 m about the reference point; the ego stands at 0 and looks along +x.


def two(rollout_of, x=0.0, y=0.0, h=0.0, v=0.0, a=0.0, ego=10.0):
    """One instant of the ego and another."""
    return rollout_of(
        x=[[[0.0], [x]]], y=[[[0.0], [y]]], h=[[[0.0], [h]]], v=[[[ego], [v]]], a=[[[0.0], [a]]]
    )


def test_drac_of_one_that_follows_is_the_classical_one(rollout_of):
    assert drac(two(rollout_of, x=24.0, v=4.0)) == pytest.approx([6.0**2 / (2 * 20)])
    assert drac(two(rollout_of, x=24.0, v=10.0)) == [0.0]
    assert drac(two(rollout_of, x=24.0, v=12.0)) == [0.0]
    assert drac(two(rollout_of, x=-24.0, v=16.0)) == pytest.approx([6.0**2 / (2 * 20)])


def test_drac_of_two_that_meet_is_of_both_together(rollout_of):
    assert drac(two(rollout_of, x=44.0, h=pi, v=6.0)) == pytest.approx([16.0**2 / (2 * 40)])
    assert drac(two(rollout_of, x=44.0, y=3.5, h=pi, v=6.0)) == [0.0]  # on its own lane


def test_drac_of_two_that_cross_is_along_their_relative_velocity(rollout_of):
    """From the left at 5 m/s; they touch after 2 s: 15 m/s² or so would be wrong."""
    rollout = two(rollout_of, x=23.0, y=13.0, h=-pi / 2, v=5.0)
    assert ttc(rollout) == pytest.approx([2.0])
    assert drac(rollout) == pytest.approx([np.hypot(10, 5) / (2 * 2.0)])


def test_drac_has_a_ceiling_that_a_contact_reaches(rollout_of):
    assert drac(two(rollout_of, x=4.1, v=0.0)) == [20.0]  # twice what a tyre gives
    assert drac(two(rollout_of, x=3.0, v=10.0)) == [MOST]


def test_thw_by_hand(rollout_of):
    assert thw(two(rollout_of, x=24.0, v=30.0)) == pytest.approx([2.0])
    assert thw(two(rollout_of, x=24.0, v=0.0, ego=5.0)) == pytest.approx([4.0])
    assert thw(two(rollout_of, x=24.0, y=2.5, v=1.0)) == [np.inf]  # beside our way
    assert thw(two(rollout_of, x=24.0, y=2.5, h=pi / 2)) == pytest.approx([(24 - 1 - 2) / 10])
    assert thw(two(rollout_of, x=-24.0, v=30.0)) == [np.inf]  # behind us
    assert thw(two(rollout_of, x=24.0, ego=0.0)) == [np.inf]  # we stand
    assert thw(two(rollout_of, x=3.0, ego=0.0)) == [0.0]


def test_tet_and_tit_by_hand(rollout_of):
    """Every 0.05 s the time to collision with a wall falls by 0.05 s, from 4 s on."""
    k = np.arange(41)
    rollout = rollout_of(x=np.stack([0.5 * k, np.full(41, 44.0)]), v=[[[10.0] * 41, [0.0] * 41]])
    assert ttc(rollout) == pytest.approx([2.0])
    within = 4.0 - 0.05 * k
    short = within[within <= TARGET + 1e-9]
    assert tet(rollout) == pytest.approx([0.05 * len(short)])
    assert tit(rollout) == pytest.approx([0.05 * (TARGET - short).sum()])


def test_the_nearest_in_time_counts_once_for_tet(rollout_of):
    rollout = rollout_of(x=[[[0.0], [24.0], [14.0]]], v=[[[10.0], [0.0], [0.0]]])
    assert tet(rollout) == pytest.approx([0.05])
    assert tit(rollout) == pytest.approx([0.05 * 2.0])
    at_contact = rollout_of(x=[[[0.0], [3.0]]])
    assert tet(at_contact) == pytest.approx([0.05])
    assert tit(at_contact) == pytest.approx([0.05 * 3.0])


# Against ttc, which has tests of its own, at each instant for each other.


def instants(rollout_of, rollout, standing=False):
    """Each instant with each other as a row of its own, the other standing or not."""
    n, e, t = rollout.shape
    parts = {}
    for name in ("x", "y", "h", "v"):
        array = getattr(rollout, name)
        pair = np.broadcast_arrays(array[:, :1], array[:, 1:])
        parts[name] = np.stack([one.reshape(-1) for one in pair], axis=1)[:, :, None]
    if standing:
        parts["v"][:, 1] = 0.0
    values = []
    for other in range(1, e):
        rows = np.arange(n * (e - 1) * t).reshape(n, e - 1, t)[:, other - 1].ravel()
        one = rollout_of(box=rollout.box[[0, other]], **{k: v[rows] for k, v in parts.items()})
        values.append(ttc(one).reshape(n, t))
    times = np.stack(values, axis=1)  # (N, E - 1, T)
    times[:, :, :][~np.broadcast_to(real(rollout), times.shape)] = np.inf
    return times


def real(rollout):
    return (np.arange(rollout.shape[2]) < rollout.n_steps[:, None])[:, None]


@pytest.mark.parametrize("shape", [(60, 2, 40), (20, 5, 25)])
def test_agree_with_ttc_at_every_instant(rollout_of, driven, shape):
    rollout = driven(*shape, seed=shape[1] + 7, within=25.0)
    times = instants(rollout_of, rollout)
    u = np.stack([np.cos(rollout.h), np.sin(rollout.h)]) * rollout.v
    w = np.hypot(*(u[:, :, 1:] - u[:, :, :1]))
    with np.errstate(divide="ignore", invalid="ignore"):
        rates = np.where(times == 0.0, MOST, np.where(times < np.inf, w / (2 * times), 0.0))
    np.testing.assert_allclose(drac(rollout), np.minimum(rates.max(axis=(1, 2)), MOST), rtol=1e-9)
    least = times.min(axis=1)
    short = least <= TARGET
    np.testing.assert_allclose(tet(rollout), 0.05 * short.sum(axis=1), rtol=1e-12)
    missing = np.where(short, TARGET - least, 0.0)
    np.testing.assert_allclose(tit(rollout), 0.05 * missing.sum(axis=1), rtol=1e-9, atol=1e-12)
    standing = instants(rollout_of, rollout, standing=True)
    np.testing.assert_allclose(thw(rollout), standing.min(axis=(1, 2)), rtol=1e-9)
    assert (drac(rollout) == MOST).any()
    assert ((drac(rollout) > 0) & (drac(rollout) < MOST)).any()
    assert np.isfinite(standing.min(axis=(1, 2))).any()


# btn by hand.


def needed(rollout):
    """The required deceleration [m/s²]."""
    return btn(rollout, available=1.0)


def test_btn_of_one_that_follows_is_jansson_s(rollout_of):
    """(v₁ − v₂)² / (2 · gap) − a₂, as long as the other does not stop before they touch."""
    assert needed(two(rollout_of, x=24.0, v=4.0)) == pytest.approx([6.0**2 / (2 * 20)])
    assert needed(two(rollout_of, x=6.0, v=9.0, a=-1.5)) == pytest.approx([1.0 / 4 + 1.5])
    assert needed(two(rollout_of, x=24.0, v=4.0, a=0.5)) == pytest.approx([0.9 - 0.5])
    assert needed(two(rollout_of, x=24.0, v=10.0)) == [0.0]


def test_btn_behind_one_that_stops_is_for_the_whole_way(rollout_of):
    """The other stops 4 m on; the ego has 20 + 4 m."""
    assert needed(two(rollout_of, x=24.0, v=4.0, a=-2.0)) == pytest.approx([100 / (2 * 24)])
    assert needed(two(rollout_of, x=24.0, v=0.0)) == pytest.approx([100 / (2 * 20)])


def test_btn_before_one_that_crosses(rollout_of):
    """It blocks 20 to 22 m ahead … from 11 − 1 − 2 m on until its rear is through."""
    slow = two(rollout_of, x=23.0, y=8.0, h=-pi / 2, v=2.0)  # there from 2.5 s on, until 5.5 s + 1
    # 20 m are enough to stop; less is needed to come when it has gone, 5.5 + … s from now.
    leaves = (8.0 + 2.0 + 1.0) / 2.0
    assert 10 * leaves >= 2 * 20  # too long to be waited for without stopping
    assert needed(slow) == pytest.approx([100 / (2 * 20)])
    fast = two(rollout_of, x=23.0, y=18.0, h=-pi / 2, v=9.0)
    leaves = (18.0 + 2.0 + 1.0) / 9.0
    assert needed(fast) == pytest.approx([2 * (10 * leaves - 20) / leaves**2])
    early = two(rollout_of, x=23.0, y=60.0, h=-pi / 2, v=9.0)
    assert needed(early) == [0.0]  # the ego is through before it comes


def test_btn_of_two_that_meet_is_to_stand_when_it_comes(rollout_of):
    """While the ego stops in v / a it goes v² / (2 a), the other v · u / a."""
    rollout = two(rollout_of, x=44.0, h=pi, v=6.0)
    assert needed(rollout) == pytest.approx([10 * (10 + 2 * 6) / (2 * 40)])


def test_btn_does_not_ask_for_what_brakes_do_not_help_against(rollout_of):
    assert needed(two(rollout_of, x=-24.0, v=20.0)) == [0.0]
    assert needed(two(rollout_of, x=24.0, ego=0.0)) == [0.0]
    assert needed(two(rollout_of, x=24.0, y=3.0)) == [0.0]


def test_btn_is_a_share_of_what_tyres_give_and_has_a_ceiling(rollout_of):
    rollout = two(rollout_of, x=24.0, v=0.0)
    assert btn(rollout) == pytest.approx([2.5 / GRIP])
    assert btn(two(rollout_of, x=3.0)) == pytest.approx([MOST / GRIP])
    assert btn(two(rollout_of, x=4.01)) == pytest.approx([MOST / GRIP])
    for wrong in (0.0, -1.0, np.nan, np.inf):
        with refuses(ValueError, "available"):
            btn(rollout, available=wrong)


# btn against braking, simulated.

HORIZON = 60.0


def clear_until(a, x, y, h, v, acceleration, ego, depth=1e-6):
    """When the ego, braking at a, is first in contact [s], and how fast it then is [m/s].

    Contact is an overlap of some depth [m]; a negative one takes in bodies that just touch.
    """
    t = np.arange(0.0, HORIZON, 2e-3)
    stop = ego / a if a > 0 else np.inf
    own = np.minimum(t, stop)
    s = ego * own - 0.5 * a * own**2
    ends = v / -acceleration if acceleration < 0 else np.inf
    other = np.minimum(t, ends)
    q = v * other + 0.5 * acceleration * other**2
    dx, dy = x + q * np.cos(h) - s, y + q * np.sin(h)
    apart = np.full(t.shape, -np.inf)
    c, z = abs(np.cos(h)), abs(np.sin(h))
    for turn, mine, its in ((0.0, 2.0, 2 * c + z), (h, 2.0, 2 * c + z)):
        along = dx * np.cos(turn) + dy * np.sin(turn)
        across = dy * np.cos(turn) - dx * np.sin(turn)
        apart = np.maximum(apart, np.abs(along) - (mine + its))
        apart = np.maximum(apart, np.abs(across) - (1.0 + 2 * z + c))
    hit = np.flatnonzero(apart <= -depth)
    if not len(hit):
        return np.inf, 0.0
    k = hit[0]
    return t[k], max(ego - a * t[k], 0.0)


# One that crawls, hardly gathers speed or takes long to stop comes after the horizon.
accelerations = st.sampled_from([0.0, -1.0, -3.0, 1.0]) | st.floats(-4, -0.5) | st.floats(0.1, 2)
others = st.just(0.0) | st.floats(1, 15)
anywhere = st.tuples(
    st.floats(-30, 60), st.floats(-30, 30), st.floats(-3.2, 3.2), others, accelerations
)
in_front = st.tuples(
    st.floats(4.5, 40), st.floats(-3, 3), st.sampled_from([0.0, pi]) | st.floats(-0.3, 0.3),
    others, accelerations,
)  # fmt: skip


@given(anywhere | in_front, st.floats(1, 15))
@example((5.0, 2.0, 0.0, 0.0, 0.0), 1.0)  # it would slide along the other's side
@example((6.5, 0.0, 2.25, 10.0, 0.0), 6.0)  # a corner grazes for less than 2 ms
def test_btn_is_what_braking_takes(rollout_of, other, ego):
    x, y, h, v, a = other
    rollout = two(rollout_of, x=x, y=y, h=h, v=v, a=a, ego=ego)
    assume(rollout.distance[0, 1, 0] > 0.2)
    found = needed(rollout)[0]
    if found == 0.0:
        time, _ = clear_until(0.0, *other, ego)
        # No contact; or the other drives into our side or rear, which braking makes no better.
        if time < np.inf:
            ahead = x - ego * time + (v * time + 0.5 * a * time**2) * np.cos(h)
            assert ahead < 2.0 + 2 * abs(np.cos(h)) + abs(np.sin(h))
        return
    assume(0.05 < found < MOST)
    _, speed = clear_until(found * 1.02 + 0.01, *other, ego)
    assert speed <= 0.2  # never touched, or standing when it is
    step = 2e-3 * (ego + abs(v) + 60.0 * abs(a))  # a corner may graze between two instants
    time, speed = clear_until(found * 0.98 - 0.01, *other, ego, depth=-step - 1e-6)
    assert time < np.inf  # less does not do
