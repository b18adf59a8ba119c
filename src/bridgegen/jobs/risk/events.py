"""The events whose probability is estimated, by severity."""

from collections.abc import Mapping
from dataclasses import dataclass

from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.errors import UnknownNameError

LEAST = NEAR_MISS
"""The score from which outcomes are kept."""

INJURY = "mais3"
"""A serious injury: the mean probability of MAIS3+ in collisions, and no event of its own."""


@dataclass(frozen=True)
class Event:
    """An event.

    Attributes:
        score: it happens from this score on; see `outcomes.Column`.
        description: in words.
    """

    score: float
    description: str


EVENTS: Mapping[str, Event] = {
    "conflict": Event(NEAR_MISS, "a near miss or a collision"),
    "collision": Event(2.0 * NEAR_MISS, "a collision"),
}
"""By name; the last one is the default aim."""

WORDS: Mapping[str, str] = {
    **{name: one.description for name, one in EVENTS.items()},
    INJURY: "a collision with a serious injury (MAIS3+)",
}
"""All that a risk states, by name."""


def require(name: str) -> Event:
    """Return the event of that name.

    Raises:
        UnknownNameError: there is none.
    """
    if name not in EVENTS:
        raise UnknownNameError("event", name, EVENTS)
    return EVENTS[name]
