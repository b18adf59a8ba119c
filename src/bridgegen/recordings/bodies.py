"""The usual box of each kind, for recordings that do not say."""

from bridgegen.ego.kinds import NAMES
from bridgegen.participants import PARTICIPANTS

_BOXES = {
    name: next(
        (one.body.length, one.body.width)
        for one in PARTICIPANTS.values()
        if one.seen_as.name == name
    )
    for name in NAMES
}
"""Of the first participant of each class, which is the one that gave the class its name."""


def usual_box(kind: int) -> tuple[float, float]:
    """Return length and width [m] of a kind of `bridgegen.ego.kinds`."""
    return _BOXES[NAMES[kind]]
