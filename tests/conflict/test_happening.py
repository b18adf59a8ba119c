"""What happened in a scenario, and in a run: worked by hand, with bodies of 4 m by 2 m."""

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve
from tests.conflict.conftest import DT, drive, meet

from bridgegen.assess.conflict.happening import Happening, happened, stuck
from bridgegen.drivers.kinds import CAR, OTHER, PEDESTRIAN
from bridgegen.simulation.rollout import joined

SECONDS = 14.0


def braking(v=10.0, a=-2.5, t=SECONDS):
    """Speeds of a body that brakes at once: it stands after 4 s and 20 m."""
    return np.maximum(v + a * DT * np.arange(round(t / DT) + 1), 0.0)


def scene(*others, left=100.0, kinds=None, v=None, **more):
    """The ego brakes from x = 0, stands at 20 m with its front at 22 m for 10 s."""
    ego = drive(v=braking() if v is None else v, t=SECONDS)
    n_steps = more.pop("n_steps", None)
    return meet(
        ego, *others, kinds=kinds, n_steps=n_steps, progress=np.array([[20.0, left]]), **more
    )


def parked(x=26.0, y=0.0, **how):
    return drive(x=x, y=y, t=SECONDS, **how)


def test_an_ego_that_stands_behind_a_parked_car_is_stuck():
    rows, behind = stuck(scene(parked()))
    assert (rows.tolist(), behind.tolist()) == ([0], [1])


@pytest.mark.parametrize("x", [20.0 + 4.0 + 10.5, -10.0])
def test_what_is_far_or_behind_is_not_what_it_stands_behind(x):
    rows, behind = stuck(scene(parked(x)))
    assert (rows.tolist(), behind.tolist()) == ([0], [0])


def test_an_ego_at_its_end_is_not_stuck():
    assert not stuck(scene(parked(), left=0.0))[0].size


def test_an_ego_that_moves_at_the_end_is_not_stuck():
    v = braking()
    v[-5:] = 2.0
    assert not stuck(scene(parked(), v=v))[0].size


@pytest.mark.parametrize(("stands", "is_stuck"), [(4.8, False), (5.6, True)])
def test_it_may_stand_five_seconds(stands, is_stuck):
    """It is below 0.5 m/s from 3.8 s on; the rest of the arrays is padding, or not recorded."""
    n_steps = round((3.8 + stands) / DT) + 1
    assert bool(stuck(scene(parked(), n_steps=n_steps))[0].size) == is_stuck


def test_a_leader_that_has_driven_is_a_reason():
    leader = drive(x=6.0, v=braking(), t=SECONDS)
    assert not stuck(scene(leader))[0].size


def test_a_jam_is_a_reason_and_a_car_parked_beside_is_none():
    assert not stuck(scene(parked(26.0), parked(32.0)))[0].size
    assert stuck(scene(parked(26.0), parked(32.0, y=3.5)))[0].size
    assert stuck(scene(parked(26.0), parked(45.0)))[0].size


def test_a_person_in_the_way_is_a_reason():
    assert not stuck(scene(parked(26.0), kinds=[CAR, PEDESTRIAN]))[0].size
    assert stuck(scene(parked(26.0), kinds=[CAR, OTHER]))[0].size


@pytest.mark.parametrize(
    ("x", "is_stuck"),
    [
        (210.0, True),  # its front is within 75 + 5 m of the ego's from 10.6 s on: 6.8 s are left
        (130.0, False),  # from 2.6 s on, and beside the ego at 11 s: 3 s are left
        (60.0, True),  # beside the ego at 4 s
    ],
)
def test_the_ego_waits_for_who_comes_not_for_who_has_passed(x, is_stuck):
    """An oncoming car at 10 m/s; the ego stands from 3.8 s to 14 s."""
    comes = drive(x=x, y=3.5, h=np.pi, v=10.0, t=SECONDS)
    assert bool(stuck(scene(parked(), comes))[0].size) == is_stuck


@pytest.mark.parametrize(("state", "is_stuck"), [(0, True), (1, False), (3, False), (4, True)])
def test_a_light_is_a_reason_unless_it_is_green_or_off(state, is_stuck):
    n = round(SECONDS / DT) + 1
    lit = {
        "light_names": ("light",),
        "lights": np.full((1, 1, n), state, np.int8),
        "stop_lines": np.array([[[24.0, 0.0, 0.0]]]),
        "stop_lights": np.array([0]),
        "stop_entities": np.array([0]),
    }
    far = parked(200.0, y=50.0)
    assert bool(stuck(scene(far, **lit))[0].size) == is_stuck
    behind = lit | {"stop_lines": np.array([[[15.0, 0.0, 0.0]]])}
    assert stuck(scene(far, **behind))[0].size


def test_someone_on_the_crosswalk_is_a_reason_while_they_are_there():
    crosswalks = np.array([[[28.0, 0.0, 0.0, 2.0, 4.0]]])  # 4 m along, 8 m across
    on, beside = parked(28.0, y=3.8), parked(28.0, y=4.3)
    for walker, is_stuck in ((on, False), (beside, True)):
        one = scene(walker, kinds=[CAR, PEDESTRIAN], crosswalks=crosswalks)
        assert bool(stuck(one)[0].size) == is_stuck


def test_after_a_contact_nobody_is_stuck():
    assert not stuck(scene(parked(23.0)))[0].size


def test_near_is_five_metres_and_two_seconds():
    """At 10 m/s: a gap of 25 m, so another car whose rear is 25 m ahead of the ego's front."""
    track = drive(v=10.0, t=6.0)
    for x, is_near in ((28.9, True), (29.1, False)):
        text = happened(meet(track, drive(x=x, v=10.0, t=6.0)))[0]
        assert json.loads(text) == {"began": {}, "near": {"bv": is_near}}


def test_everything_is_recorded_and_a_failed_scenario_has_nothing():
    one = scene(parked(), parked(400.0), kinds=[CAR, CAR, CAR])
    names = ("first", "second", "first")  # as two manoeuvres of a file may name theirs
    one = replace(one, event_names=names, began=np.array([[0, -1, -1]]))
    failed = replace(one, status=np.ones(1, np.int8))
    arrived = replace(one, progress=np.array([[20.0, 0.0]]))
    three = joined([(np.array([k]), each) for k, each in enumerate((one, failed, arrived))])
    first, second, third = happened(three)
    assert second == ""
    assert json.loads(first) == {
        "began": {"first": True, "second": False}, "near": {"bv": True, "bv2": False},
        "end": False, "stuck": {"behind": "bv", "driven": 20, "left": 100},
    }  # fmt: skip
    assert json.loads(third)["end"] is True
    assert json.loads(third)["stuck"] is False


def test_an_ego_that_never_moves_is_stuck_whatever_the_reason():
    """It stands at a red light from the start on, or is struck where it stands."""
    still = {"v": np.zeros(round(SECONDS / DT) + 1)}
    jam = parked(6.0), parked(12.0)
    assert stuck(scene(*jam, **still))[0].size
    struck = scene(drive(x=-20.0, v=10.0, t=SECONDS), **still)
    assert struck.distance.min() == 0.0
    assert stuck(struck)[0].size
    assert not stuck(scene(*jam, left=0.0, **still))[0].size


def test_only_what_happens_up_to_the_first_contact_counts():
    """The ego is struck after 1.6 s; a car ahead brakes, and another comes, after that."""
    ego = drive(v=10.0, t=6.0)
    rear, ahead = drive(x=-20.0, v=20.0, t=6.0), drive(x=45.0, v=5.0, t=6.0)
    one = meet(ego, rear, ahead)
    contact = int(np.argmax((one.distance <= 0.0).any(axis=1)))
    names = ("before", "at_it", "after")
    began = np.array([[contact - 1, contact + 1, contact + 2]])
    found = json.loads(happened(replace(one, event_names=names, began=began))[0])
    assert found["began"] == {"before": True, "at_it": True, "after": False}
    assert found["near"] == {"bv": True, "bv2": False}


@pytest.mark.parametrize(("instant", "met"), [(0, True), (20, True), (60, False), (-1, False)])
def test_whoever_acts_is_to_be_met_when_it_does(instant, met):
    """An oncoming car at 10 m/s is near until it is 25 m behind, after 2.9 s."""
    ego, other = drive(v=10.0, t=6.0), drive(x=20.0, y=3.5, h=np.pi, v=10.0, t=6.0)
    one = replace(
        meet(ego, other), event_names=("swerves", "lights"), began=np.array([[instant, 0]]),
        event_actors=(frozenset({1}), frozenset()),
    )  # fmt: skip
    assert json.loads(happened(one)[0])["met"] == {"swerves": met}
    assert "met" not in json.loads(happened(replace(one, event_actors=()))[0])


def test_a_run_in_which_nobody_who_acts_is_met_did_not_happen():
    def texts(first, second):
        return json.dumps({"began": {}, "near": {"bv": True}, "met": {"a": first, "b": second}})

    (reason,) = Happening.of([texts(False, False)] * 99 + [texts(True, False)]).reasons
    approve(reason, "100")
    assert Happening.of([texts(True, False)] * 2 + [texts(False, False)] * 98).happened


def text_of(began=True, near=True, behind=None, is_stuck=False):
    where = {"behind": behind, "driven": 80, "left": 120}
    return json.dumps(
        {"began": {"swings": began}, "near": {"bv": near}, "end": False,
         "stuck": where if is_stuck else False}
    )  # fmt: skip


def test_a_run_in_which_all_happens():
    found = Happening.of([text_of()] * 98 + [text_of(False, False)] * 2 + ["", ""])
    assert (found.rows, found.stuck, found.happened, found.reasons) == (100, 0, True, ())
    assert [vars(one) for one in found.events] == [{"name": "swings", "rows": 98, "of": 100}]
    approve(found.sentence, "98")


def test_an_event_or_an_encounter_in_less_than_one_in_fifty_did_not_happen():
    rare = [text_of()] * 1 + [text_of(began=False)] * 99
    assert Happening.of(rare).reasons == ("the event swings began in 1 of 100 evaluations",)
    alone = [text_of()] * 1 + [text_of(near=False)] * 99
    (reason,) = Happening.of(alone).reasons
    approve(reason, "near", "100")
    assert Happening.of([text_of()] * 2 + [text_of(False, False)] * 98).happened


def test_a_run_whose_ego_is_mostly_stuck_did_not_happen():
    texts = [text_of(behind="van", is_stuck=True)] * 290 + [text_of()] * 10
    found = Happening.of(texts, "outside the domain")
    approve(found.sentence, "290", "300")
    half = Happening.of([text_of(is_stuck=True)] * 150 + [text_of()] * 150)
    assert half.happened
    approve(half.stuck_in_words, "150", "300")


def test_an_unknown_is_never_a_no():
    """Another simulator knows neither events nor the end; an old run recorded nothing."""
    found = Happening.of(['{"began":{},"near":{"bv":true}}'] * 3)
    assert (found.end, found.stuck, found.happened) == (None, None, True)
    old = Happening.of([""] * 5)
    assert (old.rows, old.happened, old.sentence) == (0, True, "")
