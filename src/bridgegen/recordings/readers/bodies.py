"""The usual body of each kind, for what recordings do not say."""

from bridgegen.drivers.kinds import NAMES
from bridgegen.scenario.participants import PARTICIPANTS, ParticipantKind

_USUAL = {
    name: next(one for one in PARTICIPANTS.values() if one.seen_as.name == name) for name in NAMES
}
"""The first participant of each class, which is the one that gave the class its name."""


def usual(kind: int) -> ParticipantKind:
    """Return the participant that a kind of `bridgegen.drivers.kinds` usually is."""
    return _USUAL[NAMES[kind]]


def usual_box(kind: int) -> tuple[float, float]:
    """Return length and width [m] of a kind of `bridgegen.drivers.kinds`."""
    body = usual(kind).body
    return body.length, body.width


def centre_ahead(kind: int, length: float) -> float:
    """Return how far a body's centre is ahead of its rear axle [m]; 0 for what has no axles.

    It is the same share of the length as of the usual body.
    """
    body = usual(kind).body
    return body.center_ahead / body.length * length
