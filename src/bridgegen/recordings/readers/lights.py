"""Traffic lights that come with a recording, as it describes them."""

from collections.abc import Sequence
from dataclasses import dataclass, field

import numpy as np

from bridgegen.base.arrays import Float

RED = "red"


@dataclass(frozen=True, eq=False)
class RecordedLight:
    """A traffic light of one lane.

    Attributes:
        changes: the instants [s] and from then on its state: "red", "yellow", "green", "red and
            yellow", "flashing red", "flashing yellow", "off" or "unknown".
        lane: name of the lane that it governs; "" if unknown.
        path: ``(n, 2)`` of that lane's centre line from the stop line on, in the direction of
            travel [m]: two points at least, the first of them on the stop line; ``(0, 2)`` if
            unknown.
    """

    changes: tuple[tuple[float, str], ...]
    lane: str = ""
    path: Float = field(default_factory=lambda: np.zeros((0, 2)))

    def red_since(self, time: float) -> float:
        """Return since when it has been red at an instant [s]; NaN if it is not."""
        since, is_red = np.nan, False
        for at, state in self.changes:
            if at > time:
                break
            if state == RED and not is_red:
                since = at
            is_red = state == RED
        return since if is_red else np.nan

    def is_seen_to_turn_red(self, since: float) -> bool:
        """Return whether it had another state before an instant."""
        return bool(self.changes and self.changes[0][0] < since)


def changes_of(times: Sequence[float], states: Sequence[str]) -> tuple[tuple[float, str], ...]:
    """Return the changes of a light whose state is known at some instants [s]."""
    return tuple(
        (float(time), state)
        for k, (time, state) in enumerate(zip(times, states, strict=False))
        if k == 0 or state != states[k - 1]
    )
