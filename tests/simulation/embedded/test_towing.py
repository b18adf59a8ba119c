"""Trailers: they follow their hitches, are bodies that others meet, and are coupled and uncoupled.

On leg C (road 3, straight along y, s = y - 13 m) lane 1 leads south at x = -1.75.
"""

import math

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.assess.conflict.analysis import Responsible, analyse
from bridgegen.assess.conflict.plausibility import plausibility
from bridgegen.assess.conflict.summary import sentence
from bridgegen.assess.metrics.impact import n_collision
from bridgegen.base.errors import UnsupportedError
from bridgegen.simulation.accidents import accidents
from bridgegen.simulation.embedded.motion._towing_kernels import drawn
from bridgegen.simulation.rollout import Rollout

from .storyboards import after, crossroads, events, lane, lateral, run, scenario, speeding, start

HITCH, COUPLER = -1.0, 5.0  # m, behind the car's axle and ahead of the trailer's
ROADS = crossroads(arm_length=300.0)


def trailer(name: str, more: str = "", coupler: str | None = f'<TrailerCoupler dx="{COUPLER}"/>'):
    return f"""<ScenarioObject name="{name}"><Vehicle name="t" vehicleCategory="trailer">
<BoundingBox><Center x="1" y="0" z="0.75"/><Dimensions width="2" length="6" height="1.5"/>
</BoundingBox><Performance maxSpeed="60" maxAcceleration="5" maxDeceleration="9"/><Axles>
<RearAxle maxSteering="0" wheelDiameter="0.6" trackWidth="1.6" positionX="0" positionZ="0.3"/>
</Axles>{coupler or ""}{more}</Vehicle></ScenarioObject>"""


def towing(text: str, name: str, tows: str = "", hitch: str = f'<TrailerHitch dx="{HITCH}"/>'):
    """Return a file in which a vehicle has a hitch, and tows."""
    at = text.index("</Vehicle>", text.index(f'<ScenarioObject name="{name}">'))
    return text[:at] + hitch + tows + text[at:]


def behind(name: str) -> str:
    return f'<Trailer><TrailerRef entityRef="{name}"/></Trailer>'


def inside(text: str) -> str:
    one = text.replace("<ScenarioObject ", "<Trailer ").replace("</ScenarioObject>", "</Trailer>")
    return f"<Trailer>{one}</Trailer>"


def told(privates: str, *rows, names=("ego", "bv"), tower="bv", ego=None, tows=None, more="",
         **given) -> Rollout:  # fmt: skip
    text = scenario(names, privates, events(*rows))
    text = towing(text, tower, inside(trailer("trailer")) if tows is None else tows)
    text = text.replace("</Entities>", more + "</Entities>")
    return run(text, ego, given.pop("roads", None), **given)


def at(rollout: Rollout, name: str, k: int) -> tuple[float, float, float]:
    e = rollout.names.index(name)
    return tuple(float(array[0, e, k]) for array in (rollout.x, rollout.y, rollout.h))


def gap(rollout: Rollout, tower: str, towed: str) -> np.ndarray:
    """Return how far a coupler is from its hitch at each instant [m]."""
    front, rear = (rollout.names.index(name) for name in (tower, towed))
    x, y, h = rollout.x[0], rollout.y[0], rollout.h[0]
    return np.hypot(
        x[front] + HITCH * np.cos(h[front]) - x[rear] - COUPLER * np.cos(h[rear]),
        y[front] + HITCH * np.sin(h[front]) - y[rear] - COUPLER * np.sin(h[rear]),
    )


EGO = start("ego", lane(1, 1, 90.0), 0.0)
SOUTH = start("bv", lane(3, 1, 90.0), 10.0)


def test_a_trailer_follows_straight_behind():
    out = told(EGO + SOUTH)
    assert out.names == ("ego", "bv", "trailer")
    assert out.towed_by.tolist() == [-1, -1, 1]
    _, car, towed = range(3)
    assert out.y[0, towed] - out.y[0, car] == pytest.approx(6.0)  # 1 m and 5 m behind
    assert out.x[0, towed] == pytest.approx(-1.75)
    assert out.v[0, towed] == pytest.approx(10.0)
    assert plausibility(out).labels == [""]
    assert accidents(out, 0) == ()


@given(
    h=st.floats(-3.0, 3.0), way=st.floats(0.01, 30.0), along=st.floats(-3.0, 3.0),
    share=st.floats(0.05, 0.95), length=st.floats(0.2, 12.0),
)  # fmt: skip
def test_a_straight_pull_is_the_same_in_one_step_or_two(h, way, along, share, length):
    dx, dy = way * math.cos(along), way * math.sin(along)
    once = drawn(h, dx, dy, length)
    half = drawn(h, share * dx, share * dy, length)
    twice = drawn(half, (1.0 - share) * dx, (1.0 - share) * dy, length)
    assert math.remainder(once - twice, math.tau) == pytest.approx(0.0, abs=1e-6)


def test_how_far_a_trailer_comes_round():
    """A coupler that is pulled across by its length: 2 atan(exp(-1)) is left of a right angle."""
    assert drawn(0.0, 0.0, 5.0, 5.0) == pytest.approx(0.5 * math.pi - 2.0 * math.atan(math.exp(-1)))
    assert drawn(0.7, 0.0, 0.0, 5.0) == 0.7


def test_in_a_circle_a_trailer_cuts_the_corner():
    """Hitch and coupler at radius R: the axle settles at sqrt(R² - L²)."""
    radius, pull = 20.0, 0.1
    h, angle = math.pi / 2, 0.0
    for _ in range(20_000):
        before, angle = angle, angle + pull / radius
        dx = radius * (math.cos(angle) - math.cos(before))
        dy = radius * (math.sin(angle) - math.sin(before))
        h = drawn(h, dx, dy, COUPLER)
    x = radius * math.cos(angle) - COUPLER * math.cos(h)
    y = radius * math.sin(angle) - COUPLER * math.sin(h)
    assert math.hypot(x, y) == pytest.approx(math.sqrt(radius**2 - COUPLER**2), rel=1e-4)


def test_a_lane_change_and_a_turn_with_two_trailers():
    last = inside(trailer("last"))
    both = inside(trailer("first", f'<TrailerHitch dx="{HITCH}"/>{last}'))
    bv = start("bv", lane(3, 1, 50.0), 8.0, lane(3, 1, 50.0), lane(4, -1, 50.0))
    out = told(EGO + bv, tows=both)
    assert out.names == ("ego", "bv", "first", "last")
    assert gap(out, "bv", "first") == pytest.approx(0.0, abs=1e-9)
    assert gap(out, "first", "last") == pytest.approx(0.0, abs=1e-9)
    assert np.ptp(out.h[0, 3]) > 1.0  # it comes round, too
    for e in (2, 3):  # an axle rolls the way that its body points
        dx, dy = np.diff(out.x[0, e]), np.diff(out.y[0, e])
        h = 0.5 * (out.h[0, e, 1:] + out.h[0, e, :-1])
        assert dx * np.sin(h) - dy * np.cos(h) == pytest.approx(0.0, abs=2e-3)
        v = 0.5 * (out.v[0, e, 1:] + out.v[0, e, :-1])
        assert np.hypot(dx, dy) == pytest.approx(v * out.time_step, abs=5e-3)
    changed = told(EGO + SOUTH, ("e", "bv", lateral(-1, "cubic time 3"), after(1.0)))
    assert changed.x[0, 2, -1] == pytest.approx(changed.x[0, 1, -1], abs=1e-3)
    assert plausibility(changed).labels == [""]


def test_a_trailer_jackknifes_when_it_is_pushed():
    """A millimetre aside grows; the coupler stays where the hitch is."""
    bv = start("bv", lane(3, 1, 20.0), -2.0)
    out = told(EGO + bv, ("e", "bv", lateral(-1, "cubic time 4"), after(0.5)), roads=ROADS)
    assert gap(out, "bv", "trailer") == pytest.approx(0.0, abs=1e-9)
    turn = np.abs(out.h[0, 2] - out.h[0, 1])
    assert turn[-1] > 0.5


def test_a_trailer_is_a_body_that_one_meets():
    """The ego drives into the back of a trailer, 2 m behind its axle and 6 m behind the car's."""
    behind_it = start("ego", lane(3, 1, 130.0), 10.0)
    out = told(behind_it + start("bv", lane(3, 1, 90.0), 0.0), roads=ROADS)
    contact = int(np.argmax(out.distance[0, 2] == 0.0))
    assert contact * out.time_step == pytest.approx((40.0 - 6.0 - 2.0 - 3.4) / 10.0, abs=0.06)
    assert n_collision(out)[0] >= 1
    conflicts = analyse(out)
    assert Responsible(int(conflicts.responsible[0, 2])) == Responsible.EGO
    assert [one.who for one in accidents(out, 0)][:1] == [("ego", "trailer")]


def test_the_ego_s_trailer_is_part_of_it():
    """It is nobody's obstacle, and what it hits, the ego hits."""
    walker = start("walker", lane(3, 1, 60.0), 0.0)
    there = '<Position><WorldPosition x="0.0" y="70" h="0"/></Position>'
    walker = walker.replace(lane(3, 1, 60.0), there)
    ego = start("ego", lane(3, 1, 90.0), 5.0)
    out = told(ego + walker, names=("ego", "walker"), tower="ego")
    assert (out.distance[0, [0, 2]] == np.inf).all()
    nearest = out.distance[0, 1].min()
    assert nearest == pytest.approx(1.75 - 1.0 - 0.2, abs=0.02)
    wide = told(ego + walker, names=("ego", "walker"), tower="ego",
                tows=inside(trailer("trailer").replace('width="2"', 'width="4"')))  # fmt: skip
    hit = int(np.argmax(wide.distance[0, 1] == 0.0))
    alone = np.hypot(wide.x[0, 1] - wide.x[0, 0], wide.y[0, 1] - wide.y[0, 0])
    assert wide.distance[0, 1, hit] == 0.0
    assert alone[hit] == pytest.approx(math.hypot(1.75, 2.0), abs=0.35)  # the car itself is past
    assert n_collision(wide)[0] == 1
    found = analyse(wide)
    assert found.body[0].tolist() == [0, 2, 0]
    assert Responsible(int(found.responsible[0, 1])) == Responsible.EGO
    approve(sentence(found, 0, 1), "walker", "5.0 m/s")
    assert plausibility(wide).labels == [""]  # it is the ego's, not others', collision


@pytest.mark.parametrize("ego", ["route-follower", "reference", "careful", "fsm", "un-r157"])
def test_drivers_do_not_mind_their_own_trailers(ego):
    way = (lane(3, 1, 90.0), lane(4, -1, 50.0))
    privates = start("ego", lane(3, 1, 90.0), 8.0, *way) + start("bv", lane(1, 1, 90.0), 0.0)
    out = told(privates, tower="ego", ego=ego)
    alone = run(scenario(("ego", "bv"), privates), ego)
    for name in ("x", "y", "h", "v"):
        np.testing.assert_array_equal(getattr(out, name)[0, 0], getattr(alone, name)[0, 0])
    assert gap(out, "ego", "trailer") == pytest.approx(0.0, abs=1e-9)


CONNECT = '<TrailerAction><ConnectTrailerAction trailerRef="trailer"/></TrailerAction>'
DISCONNECT = "<TrailerAction><DisconnectTrailerAction/></TrailerAction>"


def test_a_trailer_is_coupled_and_uncoupled():
    """It stands 6 m behind, goes with the car for 4 s, and goes on at the speed that it has."""
    parked = start("trailer", lane(3, 1, 96.0), 0.0)
    rows = (
        ("couple", "bv", CONNECT, after(1.0)),
        ("go", "bv", speeding(8.0, "linear rate 2"), after(2.0)),
        ("leave", "bv", DISCONNECT, after(5.0)),
        ("stop", "bv", speeding(0.0, "linear rate 3"), after(5.0)),
    )
    out = told(EGO + start("bv", lane(3, 1, 90.0), 0.0) + parked, *rows, tows="",
               more=trailer("trailer"), roads=ROADS)  # fmt: skip
    coupled = slice(round(1.0 / out.time_step), round(5.0 / out.time_step))
    assert gap(out, "bv", "trailer")[coupled] == pytest.approx(0.0, abs=1e-9)
    assert out.v[0, 2, round(5.0 / out.time_step)] == pytest.approx(6.0)
    assert out.v[0, 2, -1] == pytest.approx(6.0)  # nobody brakes it
    assert out.y[0, 2, -1] < out.y[0, 1, -1]  # through the car: that is the scenario's
    assert [one.who for one in accidents(out, 0)] == []  # of the coupled


def test_where_its_tower_goes_a_trailer_goes():
    teleport = f"<TeleportAction>{lane(1, 1, 50.0)}</TeleportAction>"
    out = told(EGO + SOUTH, ("away", "bv", teleport, after(1.0)))
    k = round(2.0 / out.time_step)
    assert gap(out, "bv", "trailer") == pytest.approx(0.0, abs=1e-9)
    turn = at(out, "trailer", k)[2] - at(out, "bv", k)[2]
    assert math.remainder(turn, math.tau) == pytest.approx(0.0, abs=1e-9)
    gone = scenario(("ego", "bv"), EGO + SOUTH, events(("x", "bv", teleport, after(99.0))))
    delete = """<GlobalAction><EntityAction entityRef="bv"><DeleteEntityAction/></EntityAction>
</GlobalAction>"""
    gone = gone.replace(f"<PrivateAction>{teleport}</PrivateAction>", delete, 1).replace(
        'value="99.0"', 'value="1.0"'
    )
    out = run(towing(gone, "bv", inside(trailer("trailer"))), None)
    k = round(1.0 / out.time_step)
    assert out.present[0, 2, : k - 1].all()
    assert not out.present[0, 2, k + 1 :].any()


def test_a_trailer_with_a_place_of_its_own_is_pulled_from_there():
    aside = '<Position><WorldPosition x="-4.75" y="108.0" h="0"/></Position>'
    parked = start("trailer", aside, 0.0)
    out = told(EGO + SOUTH + parked, tows=behind("trailer"), more=trailer("trailer"))
    assert gap(out, "bv", "trailer") == pytest.approx(0.0, abs=1e-9)
    hitch = (-1.75, 104.0)
    toward = math.atan2(hitch[1] - 108.0, hitch[0] + 4.75)
    assert math.remainder(at(out, "trailer", 0)[2] - toward, math.tau) == pytest.approx(0.0)


def test_a_trailer_that_is_put_ahead_of_its_hitch_is_straight_behind():
    """In the car, or in front of it: a coupling does not fold by half a turn."""
    for y in (95.0, 103.0):
        ahead = f'<Position><WorldPosition x="-1.75" y="{y}" h="0"/></Position>'
        out = told(EGO + SOUTH + start("trailer", ahead, 0.0), tows=behind("trailer"),
                   more=trailer("trailer"))  # fmt: skip
        x, y, h = at(out, "trailer", 0)
        assert (x, y, math.remainder(h, math.tau)) == pytest.approx((-1.75, 109.0, -math.pi / 2))
        assert out.v[0, out.names.index("trailer"), 0] == pytest.approx(10.0)


def test_trailers_of_one_name():
    cv = start("cv", lane(1, 1, 60.0), 5.0)
    text = scenario(("ego", "bv", "cv"), EGO + SOUTH + cv)
    for name in ("bv", "cv"):
        text = towing(text, name, inside(trailer("trailer")))
    out = run(text, None)
    assert out.names == ("ego", "bv", "cv", "trailer", "cv.trailer")
    assert out.towed_by.tolist() == [-1, -1, -1, 1, 2]


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (lambda text: text.replace(f'<TrailerHitch dx="{HITCH}"/>', "", 1),
         "a trailer behind 'bv', which has no TrailerHitch, is not supported"),
        (lambda text: text.replace(f'<TrailerCoupler dx="{COUPLER}"/>', ""),
         "the trailer 'trailer', which has no TrailerCoupler, is not supported"),
        (lambda text: text.replace(f'dx="{COUPLER}"', 'dx="0.01"'),
         "a TrailerCoupler less than 0.1 m ahead of its axle is not supported"),
        (lambda text: text.replace('entityRef="trailer"', 'entityRef="ego"', 1),
         "an ego that is towed is not supported"),
        (lambda text: towing(text, "ego", behind("trailer")),
         "a second vehicle that tows 'trailer' is not supported"),
        (lambda text: towing(text, "trailer", behind("trailer")),
         "a second vehicle that tows 'trailer' is not supported"),
    ],
)  # fmt: skip
def test_couplings_that_cannot_be(change, message):
    text = towing(scenario(("ego", "bv"), EGO + SOUTH), "bv", behind("trailer"))
    text = text.replace("</Entities>", trailer("trailer") + "</Entities>")
    if "'ego'" in message or "an ego" in message:
        text = text.replace("</Vehicle>", f'<TrailerCoupler dx="{COUPLER}"/></Vehicle>', 1)
    with pytest.raises(UnsupportedError, match=message):
        run(change(text), None)


def test_a_vehicle_that_tows_itself():
    ring = trailer("a", f'<TrailerHitch dx="-1"/>{behind("b")}')
    ring += trailer("b", f'<TrailerHitch dx="-1"/>{behind("a")}')
    text = scenario(("ego", "bv"), EGO + SOUTH).replace("</Entities>", ring + "</Entities>")
    with refuses(UnsupportedError):
        run(text, None)
