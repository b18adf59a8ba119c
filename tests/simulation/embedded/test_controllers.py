"""Controllers that a file gives, switches on and off: who moves the ego then.

On leg C (road 3, straight, south is inward) lane 1 leads south, lane 2 lies 3.5 m to its right.
The instants are 0.05 s apart.
"""

import re

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.base.errors import UnsupportedError

from .storyboards import after, events, lane, lateral, run, scenario, simulator, speeding, start

EGO = start("ego", lane(3, 1, 95.0), 10.0)
AHEAD = start("bv", lane(3, 1, 45.0), 0.0)


def switch(**domains: str) -> str:
    words = " ".join(f'{name}="{value}"' for name, value in domains.items())
    return f"<ActivateControllerAction {words}/>"


def assign(*properties: str, more: str = "") -> str:
    held = "".join(
        f'<Property name="{one}" value="{two}"/>' for one, two in map(str.split, properties)
    )
    return f"""<ControllerAction><AssignControllerAction{more}><Controller name="pilot"><Properties>
{held}</Properties></Controller></AssignControllerAction></ControllerAction>"""


def override(active: str, value: float = 0.0) -> str:
    return f"""<ControllerAction><OverrideControllerValueAction>
<Throttle value="{value}" active="{active}"/></OverrideControllerValueAction></ControllerAction>"""


def told(*rows, first=(), ego="route-follower", names=("ego", "bv"), speed=10.0):
    """The ego drives south towards bv, 50 m ahead; rows are (name, action, condition)."""
    actions = "".join(f"<PrivateAction>{one}</PrivateAction>" for one in first)
    private = start("ego", lane(3, 1, 95.0), speed).replace("</Private>", actions + "</Private>")
    story = events(*((name, "ego", action, when) for name, action, when in rows))
    return run(scenario(names, private + AHEAD, story), ego)


BOTH_OFF, BOTH_ON = (
    switch(lateral="false", longitudinal="false"),
    switch(lateral="true", longitudinal="true"),
)


def test_the_storyboard_moves_an_entity_whose_controller_is_not_known():
    unknown = assign("pilot somebody")
    for first in ((unknown, BOTH_ON), (assign(more=' activateLateral="true"'),), (BOTH_ON,)):
        assert (told(first=first, ego=None).v[0, 0] == 10.0).all()
    assert (told(("on", BOTH_ON, after(1.0)), ego=None).v[0, 0] == 10.0).all()
    rollout = told(("off", BOTH_OFF, after(1.0)), first=(unknown, BOTH_OFF), ego=None)
    assert (rollout.v[0, 0] == 10.0).all()


def test_a_note_says_once_that_the_storyboard_stands_in():
    story = events(("on", "ego", BOTH_ON, after(1.0)))
    first = (assign("pilot somebody"), BOTH_ON)
    actions = "".join(f"<PrivateAction>{one}</PrivateAction>" for one in first)
    text = scenario(("ego", "bv"), EGO.replace("</Private>", actions + "</Private>") + AHEAD, story)
    (note,) = simulator(text, None).program.notes
    said = "the storyboard moves 'ego': its controller is not known here"
    assert re.fullmatch(rf"test\.xosc, line \d+: {said}; a driver in its place: --ego NAME", note)
    assert simulator(text, "careful").program.notes == ()


def test_a_driver_of_ours_takes_the_place_of_any_controller_of_the_ego():
    rollout = told(first=(assign("pilot somebody"), BOTH_ON), ego="careful")
    assert rollout.v[0, 0, -1] < 1.0  # it stops behind bv
    mine = told(first=(assign("driver careful"), BOTH_ON), ego=None)
    assert (mine.v == rollout.v).all()


def test_a_driver_that_is_switched_on_in_an_event_drives_from_then_on():
    rollout = told(("on", BOTH_ON, after(2.0)), ego="careful")
    assert (rollout.v[0, 0, :41] == 10.0).all()
    always = told(ego="careful")
    assert always.v[0, 0, 40] < 10.0  # it would have braked by then
    assert rollout.v[0, 0, 60] < 10.0
    from_the_start = told(("on", BOTH_ON, after(2.0)), first=(BOTH_ON,), ego="careful")
    assert (from_the_start.v == always.v).all()


def test_the_storyboard_takes_over_where_the_ego_is_and_as_fast_as_it_is():
    """careful brakes; at 2 s the storyboard takes over and, from 3 s on, adds 1 m/s each second."""
    rows = ("off", BOTH_OFF, after(2.0)), ("faster", speeding(20.0, "linear rate 1"), after(3.0))
    rollout = told(*rows, ego="careful")
    always = told(ego="careful")
    v = rollout.v[0, 0]
    assert (v[:41] == always.v[0, 0, :41]).all()
    assert v[40:61] == pytest.approx(v[40])
    assert v[81] - v[61] == pytest.approx(1.0)
    steps = np.hypot(np.diff(rollout.x[0, 0]), np.diff(rollout.y[0, 0]))
    assert steps == pytest.approx(0.5 * (v[1:] + v[:-1]) * 0.05, abs=1e-6)


def test_the_driver_sets_the_speed_and_the_storyboard_steers():
    """It changes to the lane to the right while the driver slows down for bv."""
    rows = ("over", lateral(-1, "linear time 2", "ego"), after(1.0))
    first = (switch(lateral="false", longitudinal="true"),)
    rollout = told(rows, first=first, ego="careful", speed=18.0)
    x = rollout.x[0, 0] - rollout.x[0, 0, 0]
    assert x[[20, 40, 60, 80]] == pytest.approx([0.0, -1.75, -3.5, -3.5], abs=1e-9)
    always = told(ego="careful", speed=18.0)
    assert rollout.v[0, 0, :21] == pytest.approx(always.v[0, 0, :21])
    assert rollout.v[0, 0, 21] < 17.9


def test_the_driver_steers_and_the_storyboard_sets_the_speed():
    """careful would stop; the storyboard goes on at 10 m/s, and straight through bv."""
    first = (switch(lateral="true", longitudinal="false"),)
    rollout = told(first=first, ego="careful")
    assert rollout.v[0, 0] == pytest.approx(10.0)
    assert rollout.distance[0, 1].min() == 0.0
    rows = ("slower", speeding(4.0, "step time 0"), after(2.0))
    assert told(rows, first=first, ego="careful").v[0, 0, 60] == pytest.approx(4.0)


def test_what_moves_the_ego_across_while_its_driver_steers_is_over_at_once():
    over = ("over", lateral(-1, "linear time 2", "ego"), after(1.0))
    with refuses(UnsupportedError, "LaneChangeAction"):
        told(over)
    rollout = told(over, ("off", BOTH_OFF, after(3.0)), speed=5.0)
    assert rollout.x[0, 0] == pytest.approx(rollout.x[0, 0, 0], abs=1e-6)
    later = ("over", lateral(-1, "linear time 2", "ego"), after(3.0))
    rollout = told(("off", BOTH_OFF, after(3.0)), later, speed=8.0)
    assert rollout.x[0, 0, 100] - rollout.x[0, 0, 0] == pytest.approx(-3.5, abs=1e-6)


def test_pedals_that_are_let_go_of_change_nothing():
    assert (told(first=(override("false"),)).v == told().v).all()


def test_which_of_several_controllers_is_meant():
    named = switch(objectControllerRef="other", lateral="true", longitudinal="true")
    with refuses(UnsupportedError, "ego"):
        told(first=(assign("driver careful"), named), ego=None)
    off = named.replace("true", "false")
    always = told(first=(assign("driver careful"),), ego=None)
    assert (told(first=(assign("driver careful"), off), ego=None).v == always.v).all()


def test_another_driver_than_at_the_start_is_refused():
    with refuses(UnsupportedError):
        told(("other", assign("driver fsm"), after(1.0)), ego="careful")


def test_an_ego_with_a_driver_is_put_where_the_storyboard_says():
    """At 2 s it is put 20 m before bv, at its speed; from there on the driver goes on."""
    there = f"<TeleportAction>{lane(3, 1, 65.0)}</TeleportAction>"
    rollout = told(("put", there, after(2.0)))
    y = rollout.y[0, 0]
    assert y[0] - y[40] == pytest.approx(20.0)
    assert y[0] - y[41] == pytest.approx(30.0)
    assert y[0] - y[42] == pytest.approx(30.5)
    assert rollout.v[0, 0, 38:45] == pytest.approx(10.0)
