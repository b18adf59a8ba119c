"""Rollouts made by hand, whose partings, contacts, events and lights are known."""

from dataclasses import replace

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve

from bridgegen.results.confirmation.compare import compare, tracks
from bridgegen.results.confirmation.differences import (
    DIVERGED,
    TRACE,
    Approach,
    Contact,
    EventTimes,
    LightTimes,
    Offset,
)
from bridgegen.results.confirmation.record import Differences, Outcome
from bridgegen.results.confirmation.words import explanation
from bridgegen.scenario.language.thresholds import Thresholds
from bridgegen.simulation.rollout import Rollout

STEP = 0.1
CAR = (4.0, 2.0, 1.0)


def moving(x, y=None, *, step=STEP, names=("ego", "bv"), h=0.0, v=None, **more):
    """One scenario: ``x`` and ``y`` (E, T)."""
    x = np.array(x, dtype=float)
    y = np.array([[0.0], [20.0], [40.0]])[: len(x)] + np.zeros(x.shape) if y is None else y
    h = np.broadcast_to(np.asarray(h, dtype=float), x.shape).copy()
    v = np.gradient(x, step, axis=1) if v is None else np.broadcast_to(v, x.shape).astype(float)
    arrays = {name: one[np.newaxis] for name, one in zip("xyhv", (x, y, h, v), strict=True)}
    return Rollout(
        time_step=step,
        names=names[: len(x)],
        box=np.array([CAR] * len(x)),
        a=np.zeros((1, *x.shape)),
        offset=np.zeros((1, *x.shape)),
        n_steps=np.array([more.pop("n_steps", x.shape[1])]),
        status=np.zeros(1, np.int8),
        **arrays,
        **more,
    )


def steady(speed=10.0, instants=21, step=STEP, ahead=0.0):
    """Two cars side by side, 20 m apart; the other one ``ahead`` of where it would be."""
    t = np.arange(instants) * step
    return np.array([speed * t, speed * t + ahead])


def test_where_nothing_differs_nobody_parts():
    found = compare(moving(steady()), moving(steady()))
    assert (found.partings, found.events, found.lights, found.boxes) == ((), (), (), ())
    assert found.ends == (2.0, 2.0)
    assert found.contacts == (None, None)
    assert tracks(moving(steady()), moving(steady())) == ()


def test_who_drifts_parts_when_it_is_half_a_metre_off():
    """0.2 m/s faster from 1 s on: 0.05 m at 1.25 s, 0.5 m after 3.5 s."""
    t = np.arange(61) * STEP
    drift = np.maximum(0.2 * (t - 1.0), 0.0)
    x = np.array([10.0 * t, 10.0 * t])
    there = moving(x + np.array([np.zeros(61), drift]), v=np.array([[10.0], [10.2]]))
    found = compare(moving(x, v=10.0), there)
    (one,) = found.partings
    assert (one.entity, one.time, one.only) == ("bv", pytest.approx(3.6), None)
    assert one.gap == pytest.approx(0.52)
    assert one.along == pytest.approx(0.52)
    assert one.across == pytest.approx(0.0)
    assert one.speed == pytest.approx(0.2)
    assert one.since == pytest.approx(1.3)
    (track,) = tracks(moving(x), there)
    assert (track.entity, track.first, len(track.x)) == ("bv", 13, 61 - 13)
    assert track.x[0] == pytest.approx(13.0 + 0.06)


def test_a_gap_is_told_in_the_direction_of_travel():
    """Northbound, there 3 m to the west: to the left; there 3 m to the south: behind."""
    x, y = np.zeros((1, 5)), np.arange(5.0)[np.newaxis]
    here = moving(x, y, h=np.pi / 2)
    (one,) = compare(here, moving(x - 3.0, y, h=np.pi / 2)).partings
    assert (one.along, one.across) == (pytest.approx(0.0), pytest.approx(3.0))
    (one,) = compare(here, moving(x, y - 3.0, h=np.pi / 2)).partings
    assert (one.along, one.across) == (pytest.approx(-3.0), pytest.approx(0.0))
    assert one.time == one.since == 0.0


def test_who_was_a_little_off_when_the_first_parted_is_known():
    """The van parts at 1 s, when the ego is 0.3 m off and the other one not yet by 1 cm."""
    x = np.zeros((3, 30))
    other = x.copy()
    other[0, 5:] = -0.3
    other[1, 5:], other[1, 15:] = 0.009, 5.0
    other[2, 10:] = 2.0
    names = ("ego", "bv", "van")
    found = compare(moving(x, names=names), moving(other, names=names))
    assert [one.entity for one in found.partings] == ["van", "bv"]
    assert found.offsets == (Offset("ego", pytest.approx(0.3)),)


def test_who_goes_another_way_is_told_by_how_much():
    """Both at 1 m a step; there it turns left by 90° after ten steps, here it goes on."""
    k = np.arange(21.0)
    here = moving(k[np.newaxis], np.zeros((1, 21)))
    there = moving(np.minimum(k, 10.0)[np.newaxis], np.maximum(k - 10.0, 0.0)[np.newaxis])
    (one,) = compare(here, there).partings
    assert (one.time, one.gap) == (pytest.approx(1.1), pytest.approx(np.sqrt(2.0)))
    assert one.turn == pytest.approx(np.pi / 2)
    (back,) = compare(there, here).partings
    assert back.turn == pytest.approx(-np.pi / 2)
    stands = moving(np.zeros((1, 21)), np.zeros((1, 21)))
    (one,) = compare(stands, here).partings
    assert one.turn is None


def passing(aside=0.0, late=0.0, after=0.0, instants=41):
    """The ego passes a standing car at 10 m/s: beside it from 1.6 s on, boxes 1.9 m apart.

    Args:
        aside: how far to the left of its course the ego is, from 1 s on [m].
        late: how far behind, likewise.
        after: how far to the left the other car is from 2.5 s on [m].
        instants: in all.
    """
    t = np.arange(instants) * STEP
    begun, over = t > 1.0 - 1e-9, t > 2.5 - 1e-9
    x = np.array([10.0 * t - late * begun, np.full(instants, 20.0)])
    y = np.array([aside * begun, 3.9 + after * over])
    return moving(x, y, v=np.array([[10.0], [0.0]]))


def test_a_small_difference_before_the_closest_approach_is_found_and_a_large_one_after_is_not():
    found = compare(passing(), passing(aside=-0.2, after=5.0))
    assert found.closest == Approach(pytest.approx(1.6), "bv", pytest.approx(1.9))
    (one,) = found.diverged
    assert (one.entity, one.since, one.only) == ("ego", pytest.approx(1.0), None)
    assert one.time <= found.closest.time
    assert (one.gap, one.along, one.across, one.speed) == pytest.approx((0.2, 0.0, -0.2, 0.0))
    assert [each.entity for each in found.partings] == ["bv"]  # after it
    assert compare(passing(), passing(after=5.0)).diverged == ()


def test_a_miss_names_the_small_difference_before_and_not_the_large_one_after():
    """0.2 m to the right, the ego passes at 2.1 m instead of 1.9 m: the threshold is 2 m."""
    found = compare(passing(), passing(aside=-0.2, after=5.0))
    ours, theirs = (
        Outcome(critical=d_min < 2.0, d_min=d_min, v_d=10.0, n_collision=0.0, F=(d_min,))
        for d_min in (1.9, 2.1)
    )
    text = explanation(ours, theirs, Differences.of(found), Thresholds())
    approve(text, "1.00 s", "0.20 m")
    assert "bv diverges" not in text
    assert "parts" not in text


def test_up_to_the_closest_approach_who_is_off_most_is_told_when_it_is():
    """Behind by 0.1 m a second: 0.05 m is passed after 0.5 s, 0.16 m at the closest approach."""
    there = passing()
    t = np.arange(41) * STEP
    there.x[0, 0] -= 0.1 * t
    (one,) = compare(passing(), there).diverged
    assert (one.since, one.time) == (pytest.approx(0.6), pytest.approx(1.6))
    assert (one.along, one.across) == (pytest.approx(-0.16), pytest.approx(0.0))


def test_what_no_more_than_traces_differs_has_not_diverged():
    assert compare(passing(), passing(aside=-TRACE)).diverged == ()
    assert len(compare(passing(), passing(aside=-TRACE - 1e-9)).diverged) == 1


def test_the_closest_approach_is_the_first_contact_or_that_to_the_partner():
    here = moving(np.array([[0.0, 1.0, 2.0, 3.0], [5.5] * 4, [10.0] * 4]), np.zeros((3, 4)),
                  names=("ego", "bv", "van"))  # fmt: skip
    assert compare(here, here).closest == Approach(pytest.approx(0.2), "bv", 0.0)
    van = compare(here, here, partner="van").closest
    assert van == Approach(pytest.approx(0.3), "van", pytest.approx(3.0))
    assert compare(here, here, partner="nobody").closest == compare(here, here).closest
    alone = moving(np.zeros((1, 4)))
    assert compare(alone, alone).closest is None


def test_who_is_missing_before_the_closest_approach_has_diverged():
    here, there = passing(), passing()
    gone = np.ones((1, 2, 41), dtype=bool)
    gone[0, 1, 5:] = False
    found = compare(here, replace(there, present=gone))
    (one,) = found.diverged
    assert (one.entity, one.only, one.gap) == ("bv", "here", None)
    assert one.since == one.time == pytest.approx(0.6)  # for more than a step


def test_the_limit_itself_is_not_parted():
    exact = compare(moving(steady()), moving(steady(ahead=DIVERGED)))
    assert exact.partings == ()
    assert len(compare(moving(steady()), moving(steady(ahead=DIVERGED + 1e-9))).partings) == 1


def test_the_first_who_parts_comes_first():
    x = np.zeros((3, 30))
    other = x.copy()
    other[0, 20:] = 2.0
    other[2, 10:] = -1.0
    names = ("ego", "bv", "van")
    found = compare(moving(x, names=names), moving(other, names=names))
    assert [(one.entity, one.time) for one in found.partings] == [("van", 1.0), ("ego", 2.0)]


def test_others_are_known_by_name_and_the_ego_by_its_place():
    x = np.array([[0.0] * 5, [50.0] * 5, [90.0] * 5])
    y = np.zeros((3, 5))
    here = moving(x, y, names=("ego", "bv", "van"))
    there = moving(x[[0, 2, 1]], y, names=("hero", "van", "bike"))
    found = compare(here, there)
    assert found.partings == ()
    assert (found.only_here, found.only_there) == (("bv",), ("bike",))


def test_two_of_one_name_are_told_apart_by_their_order():
    x = np.array([[0.0] * 5, [50.0] * 5, [90.0] * 5])
    names = ("ego", "cone", "cone")
    assert compare(moving(x, names=names), moving(x, names=names)).partings == ()


def test_only_what_both_have_is_compared():
    """There it ends after 1 s; what stands in the arrays beyond means nothing."""
    here, there = moving(steady()), moving(steady(), n_steps=11)
    there.x[0, :, 11:] = 999.0
    found = compare(here, there)
    assert (found.ends, found.partings) == ((2.0, pytest.approx(1.0)), ())


def test_a_finer_step_is_interpolated():
    """0.03 s here, 0.1 s there: at constant speed there is no difference at any instant."""
    fine = moving(steady(step=0.03, instants=70), step=0.03)
    found = compare(fine, moving(steady()))
    assert (found.partings, found.step) == ((), 0.1)
    (one,) = compare(fine, moving(steady(ahead=0.7))).partings
    assert (one.entity, one.time) == ("bv", 0.0)
    assert one.gap == pytest.approx(0.7)
    (track,) = tracks(fine, moving(steady(ahead=0.7)))
    assert len(track.x) == 67  # of here's instants those up to 2 s
    assert np.allclose(track.x, 10.0 * 0.03 * np.arange(67) + 0.7)


def test_the_first_contact_is_when_and_with_whom():
    """Cars of 4 m: bumpers meet where the reference points are 4 m apart."""
    t = np.arange(31) * STEP
    x = np.array([10.0 * t, np.full(31, 24.05), np.full(31, 24.05)])
    y = np.array([[0.0], [9.0], [0.0]]) + np.zeros((3, 31))
    names = ("ego", "bv", "van")
    found = compare(moving(x, y, names=names), moving(x[:, :15], y[:, :15], names=names))
    assert found.contacts == (Contact(pytest.approx(2.1), "van"), None)


def test_who_is_not_there_has_no_place():
    present = np.ones((1, 2, 21), bool)
    present[0, 1, 10:] = False
    x = steady()
    gone = x.copy()
    gone[1, 10:] = 500.0
    here = moving(x, present=present)
    assert compare(here, moving(gone, present=present)).partings == ()
    (one,) = compare(here, moving(x)).partings
    assert (one.entity, one.only) == ("bv", "there")
    assert (one.time, one.since) == (pytest.approx(1.1), pytest.approx(1.0))
    assert one.gap is None
    later = present.copy()
    later[0, 1, 10] = True  # a step later is the same
    assert compare(here, moving(x, present=later)).partings == ()
    (track,) = tracks(moving(x), here)
    assert (track.first, np.isnan(track.x).all()) == (10, True)


@pytest.mark.parametrize(
    ("here", "there", "found"),
    [
        (5, 5, ()),
        (5, 6, ()),  # a step
        (5, 7, (EventTimes("go", 0.5, 0.7),)),
        (-1, -1, ()),
        (5, -1, (EventTimes("go", 0.5, None),)),
        (-1, 5, (EventTimes("go", None, 0.5),)),
        (20, -1, ()),  # the other one had ended, or would have a step later
        (19, -1, ()),
        (18, -1, (EventTimes("go", 1.8, None),)),
    ],
)
def test_events_differ_by_more_than_a_step(here, there, found):
    a, b = (moving(steady(), event_names=("go",), began=np.array([[k]])) for k in (here, there))
    assert compare(a, b).events == tuple(
        replace(one, **{k: pytest.approx(v) for k, v in vars(one).items() if k != "name" and v})
        for one in found
    )


def test_lights_differ_for_more_than_a_step():
    red, green = np.full((1, 1, 21), 1, np.int8), np.full((1, 1, 21), 1, np.int8)
    green[0, 0, 12:] = 4
    late = green.copy()
    late[0, 0, 12] = 1
    a, b, c = (moving(steady(), light_names=("s1",), lights=one) for one in (red, green, late))
    assert compare(a, b).lights == (LightTimes("s1", pytest.approx(1.2), 1, 4),)
    assert compare(b, c).lights == ()


def test_other_boxes_are_told():
    here = moving(steady())
    there = replace(here, box=np.array([CAR, (4.5, 1.8, 1.2)]))
    (one,) = compare(here, there).boxes
    assert (one.entity, one.here, one.there) == ("bv", CAR, (4.5, 1.8, 1.2))


def test_rows_are_chosen():
    two = moving(steady())
    both = replace(
        two,
        **{n: np.concatenate([getattr(two, n)] * 2) for n in ("x", "y", "h", "v", "a", "offset")},
        n_steps=np.array([21, 21]),
        status=np.zeros(2, np.int8),
    )
    both.x[1, 1] += 2.0
    assert compare(two, both, 0, 0).partings == ()
    assert len(compare(two, both, 0, 1).partings) == 1
    assert compare(both, both, 1, 1).partings == ()


steps = st.floats(-1.0, 1.0, allow_subnormal=False)
walks = st.lists(st.tuples(steps, steps), min_size=2, max_size=30)


@given(walks)
def test_identical_rollouts_never_part(walk):
    x, y = np.cumsum(np.array(walk), axis=0).T
    one = moving(np.stack([x, x + 9.0]), np.stack([y, y]))
    assert compare(one, replace(one)).partings == ()


@given(walks, walks)
def test_who_parts_from_whom_does_not_matter(walk, other):
    n = min(len(walk), len(other))
    a, b = (
        moving(np.cumsum(np.array(one[:n])[:, :1], axis=0).T,
               np.cumsum(np.array(one[:n])[:, 1:], axis=0).T)
        for one in (walk, other)
    )  # fmt: skip
    there, back = compare(a, b), compare(b, a)
    assert [(p.entity, p.time, p.gap, p.since) for p in there.partings] == [
        (p.entity, p.time, p.gap, p.since) for p in back.partings
    ]
    assert [p.speed for p in there.partings] == [-p.speed for p in back.partings]
    gap = np.hypot(b.x - a.x, b.y - a.y)[0, 0]
    assert bool(there.partings) == bool((gap > DIVERGED).any())
    for one in there.partings:
        assert np.hypot(one.along, one.across) == pytest.approx(one.gap)
        assert one.since <= one.time
    assert bool(tracks(a, b)) == bool((gap > TRACE).any())


@given(walks, st.floats(0, 6.3), st.floats(-100, 100))
def test_where_the_world_is_turned_to_does_not_matter(walk, angle, shift):
    x, y = np.cumsum(np.array(walk), axis=0).T
    drift = np.linspace(0.0, 2.0, len(x))
    cos, sin = np.cos(angle), np.sin(angle)

    def turned(x, y, h):
        return moving(
            (x * cos - y * sin + shift)[np.newaxis], (x * sin + y * cos)[np.newaxis], h=h + angle
        )

    (plain,) = compare(moving(x[np.newaxis], y[np.newaxis]),
                       moving((x + drift)[np.newaxis], y[np.newaxis])).partings  # fmt: skip
    (one,) = compare(turned(x, y, 0.0), turned(x + drift, y, 0.0)).partings
    assert one.time == pytest.approx(plain.time, abs=STEP + 1e-9)
    assert one.along == pytest.approx(plain.along, abs=2.1 / (len(x) - 1) + 1e-6)
    assert one.across == pytest.approx(0.0, abs=1e-6)
