"""Leaving out of a scenario what is asked for, and no more than it takes with it."""

import pytest

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.pruning import strays, without
from bridgegen.openx.openscenario.read import read

from .files import car, entity, maneuver, scenario, speed, story

TWO = entity(car()) + entity(car(), "other")
PRIVATE = (
    '<Private entityRef="{who}"><PrivateAction><TeleportAction><Position><WorldPosition x="0" y="0"'
    "/></Position></TeleportAction></PrivateAction></Private>"
)


@pytest.fixture
def events():
    """One maneuver of two events, and one of one."""
    text = scenario(
        entities=TWO,
        init=PRIVATE.format(who="ego") + PRIVATE.format(who="other"),
        stories=story(
            maneuver(speed("1", "one"), speed("2", "two")) + maneuver(speed("3", "three"), name="n")
        ),
    )
    return read(text.encode())


def names(scenario, cls) -> list[str]:
    return [one.name for one in walk(scenario) if isinstance(one, cls)]


def found(scenario, cls):
    return [one for one in walk(scenario) if isinstance(one, cls)]


def test_an_action_takes_its_event_along_and_leaves_the_others(events):
    targets = found(events, osc.AbsoluteTargetSpeed)
    left = without(events, targets[:1])
    assert names(left, osc.Event) == ["two", "three"]
    assert names(without(events, targets[2:]), osc.Maneuver) == ["m"]
    assert names(without(events, targets), osc.Maneuver) == []
    assert names(events, osc.Event) == ["one", "two", "three"]


def test_equal_elements_elsewhere_stay(events):
    first, second = found(events, osc.TeleportAction)
    assert first == second
    left = without(events, [second])
    assert [one.entity_ref for one in left.storyboard.init.actions.privates] == ["ego"]


def test_nothing_to_leave_out_changes_nothing(events):
    assert without(events, []) is events


def test_who_is_not_there_is_named():
    text = scenario(
        entities=TWO, init=PRIVATE.format(who="ghost"),
        stories=story(maneuver(speed("1")), actors="ghost"),
    )  # fmt: skip
    astray = strays(read(text.encode()))
    assert {type(one) for one in astray} == {osc.EntityRef, osc.Private, osc.ManeuverGroup}
    skipped: list[str] = []
    left = read(text.encode(), skipped=skipped)
    assert strays(left) == []
    assert left.storyboard.init.actions.privates == ()
    assert left.storyboard.stories == ()
    assert all("of an entity that is not there (line 3)" in one for one in skipped)
