"""How the evaluations of a run meet its pass criteria."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.arrays import Numbers
from bridgegen.criteria import unit_of
from bridgegen.odd.criteria import Criterion


@dataclass(frozen=True)
class CriterionSummary:
    """How the evaluations of a run meet a criterion.

    Attributes:
        criterion: it.
        met: number of evaluations that meet it.
        violated: number of those that violate it.
        unknown: number of those that failed.
        worst: the least margin; NaN if all failed.
        at: the evaluation that has it, from 1; None likewise. The first of equal ones.
        unit: of margins; "1" of a mixture or a number.
    """

    criterion: Criterion
    met: int
    violated: int
    unknown: int
    worst: float
    at: int | None
    unit: str

    @property
    def sentence(self) -> str:
        """The result in words."""
        done = self.met + self.violated
        if not done:
            return "unknown: all evaluations failed"
        unit = "" if self.unit == "1" else f" {self.unit}"
        worst = f"least margin {self.worst:.3g}{unit} (evaluation {self.at})"
        if not self.violated:
            return f"met in all {done} evaluations; {worst}"
        return f"violated in {self.violated} of {done} evaluations; {worst}"


def summarise_criteria(
    criteria: Sequence[Criterion], metrics: Numbers, names: Sequence[str]
) -> tuple[CriterionSummary, ...]:
    """Return how rows meet criteria.

    Args:
        criteria: of a run.
        metrics: ``(N, M)``, NaN where an evaluation failed.
        names: of the M columns, the criteria's margins among them.
    """
    found = []
    for one in criteria:
        margins = np.asarray(metrics[:, list(names).index(one.quantity)])
        known = ~np.isnan(margins)
        violated = int((margins < 0.0).sum())
        at = int(np.nanargmin(margins)) if known.any() else None
        found.append(
            CriterionSummary(
                one,
                int(known.sum()) - violated,
                violated,
                int((~known).sum()),
                float("nan") if at is None else float(margins[at]),
                None if at is None else at + 1,
                unit_of(one),
            )
        )
    return tuple(found)
