"""What a batch of rows came to: evaluated, or rolled out to be looked at."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float
from bridgegen.simulation.embedded.intentions import Intentions
from bridgegen.simulation.rollout import Rollout


@dataclass(frozen=True)
class Evaluation:
    """What a batch of N rows came to.

    Attributes:
        metrics: ``(N, M)`` float64, NaN in a failed row.
        F: ``(N, n_obj)`` float64, minimised; a filler in a failed row.
        critical: ``(N,)`` bool, of those of the cause that is asked for, if one is.
        status: ``(N,)`` int8, 0 is success.
        messages: by row, what else there is to say of its failure.
        cause: ``(N,)`` int8, the `Cause` of what the thresholds call critical; None where causes
            are not sought.
    """

    metrics: Float
    F: Float
    critical: Bool
    status: npt.NDArray[np.int8]
    messages: Mapping[int, str] = field(default_factory=dict)
    cause: npt.NDArray[np.int8] | None = None

    @classmethod
    def join(cls, parts: Sequence["Evaluation"]) -> "Evaluation":
        """Return the evaluations of several parts, at least one, in their order."""
        starts = np.cumsum([0, *(len(one.status) for one in parts)]).tolist()
        messages = {
            start + row: text
            for start, one in zip(starts, parts, strict=False)
            for row, text in one.messages.items()
        }
        sought = [one.cause for one in parts if one.cause is not None]
        return cls(
            np.concatenate([one.metrics for one in parts]),
            np.concatenate([one.F for one in parts]),
            np.concatenate([one.critical for one in parts]),
            np.concatenate([one.status for one in parts]),
            messages,
            np.concatenate(sought) if sought else None,
        )


@dataclass(frozen=True)
class Replay:
    """A rollout of N rows, with what it does not hold itself.

    Attributes:
        rollout: what happened.
        intentions: what the egos meant to do, if that was asked for.
        ways: by row and number the ways that these name, ``(n, 2)`` float64 [m] each.
        weathers: by row the weather from the start on, and from each change of it: the instant, and
            ``(WEATHER,)`` as sensors feel it (``ego._weather_columns``).
    """

    rollout: Rollout
    intentions: Intentions | None
    ways: Sequence[Mapping[int, Float]]
    weathers: Sequence[Sequence[tuple[int, Float]]]
