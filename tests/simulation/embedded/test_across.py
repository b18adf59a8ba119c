"""Lane changes and offsets, against values worked by hand.

The bv drives south on leg C's inner lane (id 1, x = -1.75 of the inbound side) from 90 m before
the junction; the outer lane is 3.5 m to its right.
"""

import math

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import UnsupportedError
from bridgegen.simulation.rollout import STATUS_MESSAGES

from .storyboards import after, events, lane, lateral, run, scenario, simulator, speeding, start

EGO = start("ego", lane(1, 1, 90.0), 0.0, lane(1, 1, 90.0), lane(3, -1, 50.0))
SHAPES = {
    "linear": (lambda u: u, lambda u: 1.0),
    "cubic": (lambda u: u * u * (3 - 2 * u), lambda u: 6 * u * (1 - u)),
    "sinusoidal": (
        lambda u: (1 - math.cos(math.pi * u)) / 2,
        lambda u: math.pi / 2 * math.sin(math.pi * u),
    ),
}


def driven(speed, *rows, lane_id=1, names=("ego", "bv"), more=""):
    bv = start("bv", lane(3, lane_id, 90.0), speed)
    return run(scenario(names, EGO + bv + more, events(*rows)))


def at(rollout, seconds):
    return round(seconds / rollout.time_step)


def offsetting(metres, shape="sinusoidal", most=None, *, of=None, continuous="false"):
    target = (
        f'<AbsoluteTargetLaneOffset value="{metres}"/>'
        if of is None
        else f'<RelativeTargetLaneOffset entityRef="{of}" value="{metres}"/>'
    )
    acceleration = "" if most is None else f' maxLateralAcc="{most}"'
    return f"""<LateralAction><LaneOffsetAction continuous="{continuous}">
<LaneOffsetActionDynamics dynamicsShape="{shape}"{acceleration}/>
<LaneOffsetTarget>{target}</LaneOffsetTarget></LaneOffsetAction></LateralAction>"""


def changing(target, dynamics, offset=None):
    shape, dimension, value = dynamics.split()
    aside = "" if offset is None else f' targetLaneOffset="{offset}"'
    return f"""<LateralAction><LaneChangeAction{aside}><LaneChangeActionDynamics
dynamicsShape="{shape}" dynamicsDimension="{dimension}" value="{value}"/><LaneChangeTarget>
{target}</LaneChangeTarget></LaneChangeAction></LateralAction>"""


@pytest.mark.parametrize("shape", SHAPES)
def test_a_lane_change_over_a_time(shape):
    """The lane to the left of the outer one is 3.5 m farther east; the speed is along the line."""
    share, slope = SHAPES[shape]
    rollout = driven(5.0, ("e", "bv", lateral(1, f"{shape} time 4"), after(1.0)), lane_id=2)
    x0, y0 = rollout.x[0, 1, 0], rollout.y[0, 1, 0]
    for u in (0.0, 0.25, 0.5, 0.75, 1.0):
        k = at(rollout, 1.0 + 4.0 * u)
        assert rollout.x[0, 1, k] - x0 == pytest.approx(3.5 * share(u), abs=1e-9)
    assert rollout.x[0, 1, at(rollout, 8.0)] - x0 == pytest.approx(3.5, abs=1e-9)
    steps = np.hypot(np.diff(rollout.x[0, 1]), np.diff(rollout.y[0, 1]))
    np.testing.assert_allclose(steps, 5.0 * rollout.time_step, rtol=1e-9)
    u = np.linspace(0.0, 1.0, 10_001)
    ahead = np.sqrt(25.0 - np.array([3.5 / 4 * slope(one) for one in u]) ** 2).mean() * 4.0
    assert y0 - rollout.y[0, 1, at(rollout, 5.0)] == pytest.approx(5.0 + ahead, abs=1e-3)
    # it turns its nose to where it goes: left of south is east
    h = rollout.h[0, 1, at(rollout, 3.0)] + math.pi / 2
    assert math.remainder(h, math.tau) == pytest.approx(math.asin(slope(0.5) * 3.5 / 20), abs=1e-9)
    assert math.remainder(rollout.h[0, 1, -1] + math.pi / 2, math.tau) == pytest.approx(0.0)
    assert rollout.v[0, 1, -1] == 5.0


@pytest.mark.parametrize("shape", SHAPES)
def test_a_lane_change_over_a_distance(shape):
    """The 20 m are along the lane."""
    share, slope = SHAPES[shape]
    rollout = driven(5.0, ("e", "bv", lateral(1, f"{shape} distance 20"), after(1.0)), lane_id=2)
    x0, y0 = rollout.x[0, 1, 0], rollout.y[0, 1, 0]
    u = np.clip((y0 - rollout.y[0, 1] - 5.0) / 20.0, 0.0, 1.0)
    expected = 3.5 * np.array([share(one) for one in u])
    np.testing.assert_allclose(rollout.x[0, 1] - x0, expected, atol=1e-6)
    steps = np.hypot(np.diff(rollout.x[0, 1]), np.diff(rollout.y[0, 1]))
    np.testing.assert_allclose(steps, 5.0 * rollout.time_step, atol=2e-4)
    k = int(np.argmin(np.abs(u - 0.5)))
    h = math.remainder(rollout.h[0, 1, k] + math.pi / 2, math.tau)
    assert h == pytest.approx(math.atan(slope(u[k]) * 3.5 / 20), abs=1e-6)


@pytest.mark.parametrize(
    ("shape", "steepest"), [("linear", 1), ("cubic", 1.5), ("sinusoidal", math.pi / 2)]
)
def test_a_lane_change_by_a_rate(shape, steepest):
    """At most 1.4 m/s sideways: 3.5 m take 2.5 s times how much steeper than its mean it gets."""
    rate, lasts = 1.4, 2.5 * steepest
    rollout = driven(10.0, ("e", "bv", lateral(1, f"{shape} rate {rate}"), after(1.0)), lane_id=2)
    x = rollout.x[0, 1] - rollout.x[0, 1, 0]
    assert np.diff(x).max() / rollout.time_step == pytest.approx(rate, rel=1e-2)
    arrived = int(np.argmax(x > 3.5 - 1e-6)) * rollout.time_step
    assert arrived == pytest.approx(1.0 + lasts, abs=0.11)


@pytest.mark.parametrize("dynamics", ["cubic time 3", "linear distance 12"])
def test_a_lane_change_while_reversing_is_one_ahead_played_backwards(dynamics):
    """Its tail goes where a nose would, so its nose is turned the other way."""
    ahead = driven(4.0, ("e", "bv", lateral(1, dynamics), after(1.0)), lane_id=2)
    place = lane(3, 2, 50.0)
    back = run(
        scenario(
            ("ego", "bv"),
            EGO + start("bv", place, -4.0),
            events(("e", "bv", lateral(1, dynamics), after(1.0))),
        )
    )
    there, here = at(ahead, 4.9), at(back, 0.0)
    n = there - here
    for name, sign in (("x", 1.0), ("y", -1.0)):
        one, other = (getattr(it, name)[0, 1, : n + 1] for it in (ahead, back))
        assert other - other[0] == pytest.approx(sign * (one - one[0]), abs=1e-6)
    tilt = ahead.h[0, 1, : n + 1] - ahead.h[0, 1, 0]
    assert back.h[0, 1, : n + 1] - back.h[0, 1, 0] == pytest.approx(-tilt, abs=1e-6)
    assert np.abs(tilt).max() > 0.1


@pytest.mark.parametrize("dynamics", ["linear time 0", "sinusoidal distance 0"])
def test_a_lane_change_over_nothing_is_at_once(dynamics):
    rollout = driven(10.0, ("e", "bv", lateral(1, dynamics), after(1.0)), lane_id=2)
    x, k = rollout.x[0, 1] - rollout.x[0, 1, 0], at(rollout, 1.0)
    assert x[k] == pytest.approx(0.0)
    assert x[k + 1] == pytest.approx(3.5)


def test_at_once():
    rollout = driven(10.0, ("e", "bv", lateral(1, "step time 3"), after(1.0)), lane_id=2)
    x, k = rollout.x[0, 1] - rollout.x[0, 1, 0], at(rollout, 1.0)
    assert x[k : k + 2] == pytest.approx([0.0, 3.5], abs=1e-9)


def test_from_the_start_on():
    """As above, from the first instant on."""
    bv = start("bv", lane(3, 2, 90.0), 5.0)
    first = f"<PrivateAction>{lateral(1, 'linear time 4')}</PrivateAction></Private>"
    rollout = run(scenario(("ego", "bv"), EGO + bv.replace("</Private>", first)))
    x = rollout.x[0, 1] - rollout.x[0, 1, 0]
    assert x[[0, 20, 40, 80, 160]] == pytest.approx([0.0, 0.875, 1.75, 3.5, 3.5], abs=1e-9)


def test_to_a_lane_by_its_id_and_to_the_side_of_its_centre():
    """Left of the road's direction, which leads away from the junction, is west."""
    to = changing('<AbsoluteTargetLane value="2"/>', "cubic time 2", 0.5)
    rollout = driven(10.0, ("e", "bv", to, after(1.0)))
    x = rollout.x[0, 1] - rollout.x[0, 1, 0]
    assert x[at(rollout, 3.0)] == pytest.approx(-4.0, abs=1e-9)
    assert x[-60] == pytest.approx(-4.0, abs=1e-9)


def test_to_the_lane_of_another():
    """Whoever is on lane 2, its own lane is 0 to its left."""
    other = start("other", lane(3, 2, 60.0), 0.0)
    to = changing('<RelativeTargetLane entityRef="other" value="0"/>', "linear time 2")
    rollout = driven(10.0, ("e", "bv", to, after(1.0)), names=("ego", "bv", "other"), more=other)
    assert rollout.x[0, 1, -1] == pytest.approx(rollout.x[0, 2, -1], abs=1e-9)


def test_to_the_oncoming_lane_and_back():
    """There is no lane 0: one to the left of the inner lane 1 is lane -1, against its traffic."""
    rollout = driven(
        10.0,
        ("out", "bv", lateral(1, "sinusoidal time 2"), after(1.0)),
        ("back", "bv", lateral(-1, "sinusoidal time 2"), after(4.0)),
    )
    x, y = rollout.x[0, 1] - rollout.x[0, 1, 0], rollout.y[0, 1]
    assert x[at(rollout, 3.0)] == pytest.approx(3.5, abs=1e-9)
    assert x[at(rollout, 4.0)] == pytest.approx(3.5, abs=1e-9)
    assert (np.diff(y[: at(rollout, 6.0)]) < 0.0).all()
    assert x[at(rollout, 6.0)] == pytest.approx(0.0, abs=1e-9)


def test_who_stands_does_not_slide():
    rollout = driven(
        5.0,
        ("stop", "bv", speeding(0.0, "step time 0"), after(1.5)),
        ("e", "bv", lateral(-1, "linear time 4"), after(1.0)),
        ("go", "bv", speeding(5.0, "step time 0"), after(5.0)),
    )
    x = rollout.x[0, 1] - rollout.x[0, 1, 0]
    standing = x[at(rollout, 1.6) : at(rollout, 5.0)]
    assert np.ptp(standing) < 1e-9
    assert x[-1] == pytest.approx(-3.5, abs=1e-9)


def test_a_later_change_goes_on_from_where_it_is():
    rollout = driven(
        10.0,
        ("out", "bv", lateral(-1, "linear time 4"), after(1.0)),
        ("back", "bv", changing('<AbsoluteTargetLane value="1"/>', "linear time 2"), after(3.0)),
    )
    x = rollout.x[0, 1] - rollout.x[0, 1, 0]
    assert x[at(rollout, 3.0)] == pytest.approx(-1.75, abs=1e-9)
    assert x[at(rollout, 4.0)] == pytest.approx(-0.875, abs=1e-9)
    assert x[at(rollout, 5.0)] == pytest.approx(0.0, abs=1e-9)


def test_where_there_is_no_lane_where_it_is_asked_for():
    """On the connecting road within the junction there is one lane only."""
    text = scenario(
        ("ego", "bv"),
        EGO + start("bv", lane(3, 1, 20.0), 15.0, lane(3, 1, 20.0), lane(4, -1, 90.0)),
        events(("e", "bv", lateral(-1, "linear time 2"), after(1.8))),
    )
    rollout = run(text)
    approve(STATUS_MESSAGES[int(rollout.status[0])])


@pytest.mark.parametrize(
    ("shape", "lasts"),
    [
        ("sinusoidal", math.pi * math.sqrt(1.5 / (2 * 2.0))),
        ("cubic", math.sqrt(6 * 1.5 / 2.0)),
        ("linear", math.sqrt(6 * 1.5 / 2.0)),
    ],
)
def test_an_offset_by_its_lateral_acceleration(shape, lasts):
    """1.5 m with at most 2 m/s²; left of the road's direction is west."""
    rollout = driven(10.0, ("e", "bv", offsetting(1.5, shape, 2.0), after(1.0)))
    x = rollout.x[0, 1] - rollout.x[0, 1, 0]
    share = SHAPES[shape][0]
    for seconds in (0.5, 1.0, 1.5, 2.0):
        expected = -1.5 * share(min(seconds / lasts, 1.0))
        assert x[at(rollout, 1.0 + seconds)] == pytest.approx(expected, abs=1e-9)
    if shape != "linear":
        second = np.diff(x, 2) / rollout.time_step**2
        assert np.abs(second).max() == pytest.approx(2.0, rel=0.05)
    assert x[-60] == pytest.approx(-1.5, abs=1e-9)


def test_an_offset_without_a_limit_is_there_at_once():
    rollout = driven(10.0, ("e", "bv", offsetting(-1.0), after(1.0)))
    x, k = rollout.x[0, 1] - rollout.x[0, 1, 0], at(rollout, 1.0)
    assert x[k : k + 2] == pytest.approx([0.0, 1.0], abs=1e-9)


def test_an_offset_from_another():
    """1 m to the right of one that is 0.4 m to the right of its lane's centre, seen southwards."""
    place = lane(3, 2, 60.0).replace('s="60.0"', 's="60.0" offset="0.4"')
    other = start("other", place, 0.0)
    rollout = driven(
        10.0, ("e", "bv", offsetting(-1.0, "cubic", 3.0, of="other"), after(1.0)),
        lane_id=2, names=("ego", "bv", "other"), more=other,
    )  # fmt: skip
    assert rollout.x[0, 1, -1] == pytest.approx(rollout.x[0, 2, -1] - 1.0, abs=1e-9)


def test_the_ego_too_if_nobody_drives_it():
    text = scenario(
        ("ego", "bv"), start("ego", lane(1, 1, 90.0), 10.0) + start("bv", lane(3, 1, 90.0), 1.0),
        events(("e", "ego", lateral(-1, "linear time 2", "ego"), after(1.0))),
    )  # fmt: skip
    with refuses(UnsupportedError, "LaneChangeAction"):
        simulator(text)
    rollout = run(text, ego=None)
    x = rollout.x[0, 0] - rollout.x[0, 0, 0]
    assert np.abs(x[at(rollout, 3.0)]) == pytest.approx(3.5, abs=1e-9)


@pytest.mark.parametrize("metres", [1.0, -1.0])
def test_who_is_aside_in_a_bend_moves_as_fast_as_it_says(metres):
    """The bv turns left with a radius of 14.75 m, 1 m aside of its lane's centre: 7 % off there."""
    route = (lane(3, 1, 30.0), lane(4, -1, 60.0))
    bv = start("bv", lane(3, 1, 30.0), 8.0, *route)
    rollout = run(scenario(("ego", "bv"), EGO + bv, events(
        ("e", "bv", offsetting(metres, "step"), after(0.5)),
    )))  # fmt: skip
    steps = np.hypot(np.diff(rollout.x[0, 1]), np.diff(rollout.y[0, 1]))
    k = round(0.5 / 0.05)
    assert math.remainder(rollout.h[0, 1, -1], math.tau) == pytest.approx(0.0, abs=1e-6)
    off = np.abs(np.delete(steps, k) - 8.0 * 0.05)
    assert np.sort(off)[-5] < 1e-3  # but for the step across, and those in which the bend begins
    assert off.max() < 0.03


# -- lane changes are driven -------------------------------------------------------------------

LOCK = math.tan(0.6) / 2.8  # 1/m, of the tests' car


def tilts(rollout, e=1):
    """The turn of the nose from south, where the lane leads."""
    return np.array([math.remainder(h + math.pi / 2, math.tau) for h in rollout.h[0, e]])


@pytest.mark.parametrize("speed", [0.5, 1.0, 2.0, 3.0, 4.0])
@pytest.mark.parametrize("dynamics", ["sinusoidal time 2", "cubic time 2", "sinusoidal distance 3"])
def test_a_slow_car_changes_lane_as_its_steering_lets_it(speed, dynamics):
    """The path never bends tighter than full lock, and the speed stays that along the line."""
    rollout = driven(speed, ("e", "bv", lateral(1, dynamics), after(0.0)), lane_id=2)
    tilt = tilts(rollout)
    steps = np.hypot(np.diff(rollout.x[0, 1]), np.diff(rollout.y[0, 1]))
    np.testing.assert_allclose(steps, speed * rollout.time_step, rtol=1e-2)
    bends = np.abs(np.diff(tilt)) / steps
    assert bends.max() <= 1.1 * LOCK
    assert np.abs(tilt).max() < math.radians(45.0)
    aside = rollout.x[0, 1] - rollout.x[0, 1, 0]
    assert (np.diff(aside) >= -1e-12).all()
    length = math.sqrt(6.0 * 3.5 / LOCK)  # of a cubic one; a sinusoidal one is shorter
    if speed * 10.0 > 1.3 * length:
        assert aside[-1] == pytest.approx(3.5, abs=1e-6)
        assert tilt[-1] == 0.0


def test_who_stops_while_it_changes_lane_keeps_its_heading_and_place():
    rows = (
        ("e", "bv", lateral(1, "sinusoidal time 4"), after(0.0)),
        ("stop", "bv", speeding(0.0, "linear rate 4"), after(1.0)),
        ("go", "bv", speeding(5.0, "linear rate 2"), after(5.0)),
    )
    rollout = driven(6.0, *rows, lane_id=2)
    tilt, aside = tilts(rollout), rollout.x[0, 1] - rollout.x[0, 1, 0]
    stands = rollout.v[0, 1] == 0.0
    assert stands.sum() > 40
    assert 0.1 < aside[stands][0] < 3.4
    assert np.ptp(aside[stands]) == 0.0
    assert np.ptp(tilt[stands][1:]) == 0.0
    assert tilt[stands][-1] > 0.1
    moves = np.hypot(np.diff(rollout.x[0, 1]), np.diff(rollout.y[0, 1]))
    assert (np.abs(np.diff(tilt)) <= 2.0 * LOCK * moves + 1e-9).all()
    assert aside[-1] == pytest.approx(3.5, abs=1e-6)


def test_who_stands_does_not_begin_to_turn():
    rollout = driven(0.0, ("e", "bv", lateral(1, "sinusoidal time 4"), after(0.0)), lane_id=2)
    assert np.ptp(rollout.x[0, 1]) == np.ptp(rollout.y[0, 1]) == np.ptp(rollout.h[0, 1]) == 0.0


def test_a_walker_may_go_sideways():
    """It has no wheels: 3.5 m in 4 s are its speed, and it goes straight across."""
    walker = start("walker", lane(3, 2, 90.0), 0.5)
    rows = events(("e", "walker", lateral(1, "linear time 4", "walker"), after(0.0)))
    rollout = run(scenario(("ego", "walker"), EGO + walker, rows))
    assert rollout.x[0, 1, 60] - rollout.x[0, 1, 0] == pytest.approx(1.5)
    assert np.ptp(rollout.y[0, 1, :60]) == pytest.approx(0.0, abs=1e-9)
