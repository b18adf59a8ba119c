"""What a detector returns: the events of one kind in one recording."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.scenario.language.event_kinds import EVENT_KINDS, EventKind

ABSENT = -1
OVERLAP = "bodies overlap along the lane"
NOT_WHOLE = "not recorded from begin to end"
NO_CHANGE = "the path fits no lane change"
EGO_CHANGES = "the ego changes lane meanwhile"


@dataclass(frozen=True, eq=False)
class Events:
    """The events of one kind in one recording, by ego and time.

    Attributes:
        kind: of all of them.
        ego: ``(N,)`` int64, participant.
        others: ``(N,)`` int64 by role, participant; `ABSENT` for none.
        begin: ``(N,)`` by the recording's clock [s].
        end: ``(N,)`` [s].
        quantities: ``(N,)`` by name, as the kind declares them; NaN for none.
        refused: how many are no events, by reason.
    """

    kind: EventKind
    ego: Int
    others: Mapping[str, Int]
    begin: Float
    end: Float
    quantities: Mapping[str, Float]
    refused: Mapping[str, int]

    def __len__(self) -> int:
        return len(self.ego)


def events_of(
    kind: str,
    ego: Int,
    others: Mapping[str, Int],
    span: tuple[Float, Float],
    quantities: Mapping[str, npt.NDArray[Any]],
    refused: Mapping[str, Bool],
) -> Events:
    """Return events in order, without those that are refused, each for the first reason.

    Args:
        kind: name.
        ego: ``(K,)`` of the candidates.
        others: ``(K,)`` by role.
        span: ``(K,)`` begin and end [s].
        quantities: ``(K,)`` by name.
        refused: ``(K,)`` by reason.
    """
    left = np.ones(len(ego), np.bool_)
    counts = {}
    for reason, mask in refused.items():
        counts[reason] = int((mask & left).sum())
        left &= ~mask
    begin, end = span
    order = np.flatnonzero(left)
    order = order[np.lexsort((begin[order], ego[order]))]
    declared = EVENT_KINDS[kind]
    return Events(
        declared,
        ego[order],
        {role: others[role][order] for role in declared.roles},
        begin[order],
        end[order],
        {name: np.asarray(quantities[name], np.float64)[order] for name in declared.quantities},
        {reason: count for reason, count in counts.items() if count},
    )
