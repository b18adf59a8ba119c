"""The evaluations of a batch of rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np
import numpy.typing as npt

from bridgegen.assess.conflict.findings import Findings
from bridgegen.base.arrays import Bool, Float, Int


@dataclass(frozen=True)
class Evaluation:
    """The evaluation of a batch of N rows.

    Attributes:
        metrics: ``(N, M)`` float64, NaN in a failed row.
        F: ``(N, n_obj)`` float64, minimised; a filler in a failed row.
        critical: ``(N,)`` bool; only rows of the requested cause, if there is one.
        status: ``(N,)`` int8, 0 is success.
        findings: the decisive conflict of each row.
        messages: details of failures, by row.
        cause: ``(N,)`` int8, the `Cause` of each row that the thresholds call critical; None where
            causes are not determined.
    """

    metrics: Float
    F: Float
    critical: Bool
    status: npt.NDArray[np.int8]
    findings: Findings
    messages: Mapping[int, str] = field(default_factory=dict)
    cause: npt.NDArray[np.int8] | None = None

    @classmethod
    def join(cls, parts: Sequence["Evaluation"]) -> "Evaluation":
        """Return the evaluations of several parts, at least one, in their order."""
        starts = np.cumsum([0, *(len(part.status) for part in parts)]).tolist()
        messages = {
            start + row: text
            for start, part in zip(starts, parts, strict=False)
            for row, text in part.messages.items()
        }
        sought = [part.cause for part in parts if part.cause is not None]
        return cls(
            np.concatenate([part.metrics for part in parts]),
            np.concatenate([part.F for part in parts]),
            np.concatenate([part.critical for part in parts]),
            np.concatenate([part.status for part in parts]),
            Findings.join([part.findings for part in parts]),
            messages,
            np.concatenate(sought) if sought else None,
        )

    @classmethod
    def gathered(cls, parts: Sequence[tuple[Int, "Evaluation"]]) -> "Evaluation":
        """Return the evaluation of N rows from those of parts of them.

        Args:
            parts: the rows ``(n,)`` of each, every one of 0 … N − 1 once, and its evaluation.
        """
        if len(parts) == 1:
            return parts[0][1]
        # Parts come storyboard by storyboard, and go back into the order of X.
        rows = np.concatenate([at for at, _ in parts])
        order, whole = np.argsort(rows), cls.join([part for _, part in parts])
        return cls(
            whole.metrics[order],
            whole.F[order],
            whole.critical[order],
            whole.status[order],
            whole.findings.take(order),
            {int(rows[row]): text for row, text in whole.messages.items()},
            None if whole.cause is None else whole.cause[order],
        )
