"""Attentive participants: as their script says where nobody is near, else as the law has it."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st

from .storyboards import after, events, lane, lateral, run, scenario, speeding, start

AWAY = start("ego", lane(4, -1, 90.0), 0.0)  # stands on another leg, and leaves it
STEP = 0.05  # s
JERK, BRAKING, REACTION = 12.65, 0.774 * 9.81, 0.75  # UN R157, annex 3


def southbound(name, s, speed, lane_id=1):
    return start(name, lane(3, lane_id, s), speed, lane(3, lane_id, s), lane(1, -lane_id, 90.0))


def both(text, **values):
    return run(text, None, others="scripted", **values), run(
        text, None, others="attentive", **values
    )


def assert_same(one, other):
    for name in ("x", "y", "h", "v", "a", "offset", "n_steps", "status", "began"):
        assert np.array_equal(getattr(one, name), getattr(other, name)), name


SCRIPT = events(
    ("faster", "bv", speeding(9.0, "linear rate 4.0"), after(1.0)),
    ("aside", "bv", lateral(1, "sinusoidal time 3"), after(2.0)),
    ("slower", "bv", speeding(2.0, "sinusoidal time 2.0"), after(6.0)),
)


def test_with_nobody_near_it_does_what_its_script_says_to_the_bit():
    text = scenario(("ego", "bv"), AWAY + start("bv", lane(3, 2, 80.0), 5.0), SCRIPT)
    scripted, attentive = both(text)
    assert_same(scripted, attentive)
    assert np.ptp(attentive.v[0, 1]) > 6.0


@given(
    gap=st.floats(-30.0, 30.0),
    speed=st.floats(0.0, 14.0),
    faster=st.floats(0.0, 14.0),
    leader=st.floats(0.0, 10.0),
)
@settings(max_examples=40, deadline=None)
def test_it_never_exceeds_the_speed_of_its_script(gap, speed, faster, leader):
    script = events(("faster", "bv", speeding(faster, "linear rate 3.0"), after(1.0)))
    places = southbound("bv", 50.0, speed) + southbound("other", 50.0 + gap, leader)
    text = scenario(("ego", "bv", "other"), AWAY + places, script)
    scripted, attentive = both(text)
    assert np.all(attentive.v <= scripted.v + 1e-9)


@given(speed=st.floats(1.0, 20.0), spare=st.floats(0.0, 30.0))
@settings(max_examples=40, deadline=None)
def test_it_stops_behind_a_standing_car_where_its_braking_distance_suffices(speed, spare):
    builds_up = BRAKING / JERK
    distance = speed * (REACTION + STEP) + speed * builds_up / 2 + speed**2 / (2 * BRAKING)
    gap = distance + 0.5 + spare
    places = southbound("other", 8.0, 0.0) + southbound("bv", 8.0 + 4.0 + gap, speed)
    attentive = run(scenario(("ego", "bv", "other"), AWAY + places), None, others="attentive")
    between = np.abs(attentive.y[0, 1] - attentive.y[0, 2]) - 4.0
    assert between.min() > 0.0


def test_it_reacts_after_the_regulations_time_and_brakes_as_hard():
    places = southbound("other", 8.0, 0.0) + southbound("bv", 8.0 + 4.0 + 35.0, 19.0)
    rollout = run(scenario(("ego", "bv", "other"), AWAY + places), None, others="attentive")
    a = rollout.a[0, 1]
    first = int(np.flatnonzero(a < 0.0)[0])
    assert first == round(REACTION / STEP)
    assert a[first] == pytest.approx(-JERK * STEP)
    assert a.min() == pytest.approx(-BRAKING)
    assert np.diff(a[: first + 20]).min() >= -JERK * STEP - 1e-6


def test_the_order_of_the_participants_does_not_matter():
    places = {
        "one": southbound("one", 60.0, 9.0),
        "two": southbound("two", 45.0, 4.0),
        "three": start("three", lane(2, 1, 50.0), 8.0, lane(2, 1, 50.0), lane(4, -1, 90.0)),
    }
    found = []
    for names in (("one", "two", "three"), ("three", "two", "one"), ("two", "one", "three")):
        text = scenario(("ego", *names), AWAY + "".join(places[name] for name in names))
        rollout = run(text, None, others="attentive")
        found.append({name: rollout.x[0, rollout.names.index(name)] for name in places})
    for name in places:
        assert np.array_equal(found[0][name], found[1][name])
        assert np.array_equal(found[0][name], found[2][name])


def test_a_change_of_lane_waits_until_the_gap_is_free():
    # On leg 3 the right-hand lane is 2. The other one is abreast, and a little faster.
    places = start("bv", lane(3, 2, 90.0), 6.0) + start("other", lane(3, 1, 90.0), 8.0)
    script = events(("aside", "bv", lateral(1, "sinusoidal time 3"), after(1.0)))
    scripted, attentive = both(scenario(("ego", "bv", "other"), AWAY + places, script))
    x, first = attentive.x[0, 1], attentive.x[0, 1, 0]
    begins = int(np.flatnonzero(np.abs(x - first) > 0.01)[0])
    gap = np.abs(attentive.y[0, 2] - attentive.y[0, 1])[begins] - 4.0
    assert gap > 1.5
    assert begins > 1.0 / STEP + 5
    assert np.abs(x - first).max() == pytest.approx(3.5, abs=0.05)
    at_once = int(np.flatnonzero(np.abs(scripted.x[0, 1] - first) > 0.01)[0])
    assert at_once < begins


@given(speed=st.floats(1.0, 20.0), gap=st.floats(0.5, 60.0), leader=st.floats(0.0, 10.0))
@settings(max_examples=40, deadline=None)
def test_it_builds_up_and_releases_an_acceleration_as_the_regulation_s_driver(speed, gap, leader):
    """12.65 m/s³, in all that lies between two standstills."""
    places = southbound("other", 20.0, leader) + southbound("bv", 20.0 + 4.0 + gap, speed)
    rollout = run(scenario(("ego", "bv", "other"), AWAY + places), None, others="attentive")
    v = rollout.v[0, 1, : rollout.n_steps[0]]
    drives = np.convolve(v > 0.0, np.ones(3), "valid") == 3.0
    jerk = np.abs(np.diff(v, 2)) / STEP**2
    assert jerk[drives].max(initial=0.0) <= JERK + 1e-6


EASTBOUND = start("bv", lane(2, 1, 40.0), 6.0, lane(2, 1, 40.0), lane(4, -1, 90.0))


def test_an_insistent_driver_gives_way_to_none_that_crosses():
    """An attentive one gives way to the one from its right (StVO § 8)."""
    right = start("other", lane(1, 1, 35.0), 6.0, lane(1, 1, 35.0), lane(3, -1, 90.0))
    text = scenario(("ego", "bv", "other"), AWAY + EASTBOUND + right)
    scripted, insistent, attentive = (
        run(text, None, others=one).v[0, 1] for one in ("scripted", "insistent", "attentive")
    )
    assert np.array_equal(scripted, insistent)
    assert attentive.min() < 4.0


def test_an_insistent_driver_stops_for_what_stands_in_its_way():
    """The other one stops in the middle of the junction, 4.9 s after the start."""
    script = events(("stops", "other", speeding(0.0, "linear time 2.0"), after(2.9)))
    text = scenario(
        ("ego", "bv", "other"), AWAY + EASTBOUND + southbound("other", 10.0, 6.0), script
    )
    scripted, insistent = (run(text, None, others=one) for one in ("scripted", "insistent"))
    assert insistent.v[0, 2, -1] == 0.0
    assert insistent.v[0, 1, -1] < 0.5
    front = insistent.x[0, 1, -1] + 1.4 + 2.0
    side = insistent.x[0, 2, -1] - 1.0
    assert 1.0 < side - front < 4.0
    assert scripted.x[0, 1, -1] > side, "the other one does not stand in the way"
