"""Drivers of participants other than the ego: their script alone, or one that looks ahead."""

from collections.abc import Iterable, Sequence
from dataclasses import replace

from bridgegen.base.errors import UnknownNameError
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.story import EventSpec, Participant

ATTENTIVE, INSISTENT, SCRIPTED = "attentive", "insistent", "scripted"

LOOKING = (ATTENTIVE, INSISTENT)
"""Those that limit the script by what is in the way."""

DRIVERS = (*LOOKING, SCRIPTED)
"""What a participant other than the ego may have as its driver."""

EGO = "ego"
ABLE = ("vehicle", "bicycle", "pedestrian")
"""How participants move that get the driver which a scenario states for all."""


def require(name: str) -> str:
    """Return the name of a driver of other participants.

    Raises:
        UnknownNameError: no such driver.
    """
    if name not in DRIVERS:
        raise UnknownNameError("driver of other participants", name, DRIVERS)
    return name


def driven(
    participants: Iterable[Participant], events: Sequence[EventSpec], others: str
) -> tuple[Participant, ...]:
    """Return participants with one driver for all that have none of their own.

    The ego, animals, objects and participants that never move stay as they are.
    """
    acting = {event.participant for event in events}
    return tuple(
        replace(one, driver=others)
        if not one.driver
        and one.name != EGO
        and one.conduct in ABLE
        and (one.speed != 0.0 or one.name in acting)
        else one
        for one in participants
    )


def with_others(scenario: LogicalScenario, others: str) -> LogicalScenario:
    """Return a scenario in which one driver drives all participants but the ego.

    Args:
        scenario: of five layers.
        others: of `DRIVERS`, instead of the scenario's. A participant that an
            adversary drives keeps it.

    Raises:
        UnknownNameError: no such driver.
    """
    require(others)
    adversary = scenario.adversary.participant if scenario.adversary else None
    story = scenario.story
    bare = [
        one if one.name in (EGO, adversary) else replace(one, driver="")
        for one in story.participants
    ]
    changed = driven(bare, story.events, others)
    return replace(scenario, story=replace(story, participants=changed))
