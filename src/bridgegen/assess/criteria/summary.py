"""How the evaluations of a run meet its pass criteria."""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.assess.criteria.monitor import margin_in_words, unit_of
from bridgegen.base.arrays import Numbers
from bridgegen.scenario.language.criteria import Criterion

MOST_NAMED = 3
"""Maximum number of violated criteria that a headline names."""

_SEVERITIES = ("critical", "major", "minor")


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
        least = margin_in_words(self.worst, self.unit, 3)
        worst = f"least margin {least} (evaluation {self.at})"
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
    for criterion in criteria:
        margins = np.asarray(metrics[:, list(names).index(criterion.quantity)])
        known = ~np.isnan(margins)
        violated = int((margins < 0.0).sum())
        at = int(np.nanargmin(margins)) if known.any() else None
        found.append(
            CriterionSummary(
                criterion,
                int(known.sum()) - violated,
                violated,
                int((~known).sum()),
                float("nan") if at is None else float(margins[at]),
                None if at is None else at + 1,
                unit_of(criterion),
            )
        )
    return tuple(found)


def by_gravity(found: Sequence[CriterionSummary]) -> list[CriterionSummary]:
    """Return the violated ones, the gravest first, then those violated most often."""
    violated = [summary for summary in found if summary.violated]
    return sorted(
        violated,
        key=lambda summary: (_SEVERITIES.index(summary.criterion.severity), -summary.violated),
    )


def headline(ego: str, found: Sequence[CriterionSummary]) -> str:
    """Return how a driver meets criteria in one clause; empty where nothing is known.

    Args:
        ego: the driver.
        found: of all criteria of a run.
    """
    done = max((summary.met + summary.violated for summary in found), default=0)
    if not done:
        return ""
    evaluations = f"{done:,} evaluation{'s' * (done != 1)}"
    violated = by_gravity(found)
    if not violated:
        which = found[0].criterion.id if len(found) == 1 else f"all {len(found)} pass criteria"
        return f"{ego} meets {which} in {'all ' if done > 1 else ''}{evaluations}"
    named = [f"{summary.criterion.id} in {summary.violated:,}" for summary in violated[:MOST_NAMED]]
    if len(violated) > MOST_NAMED:
        return (
            f"{ego} violates {len(violated)} of {len(found)} pass criteria: {', '.join(named)}, … "
            f"of {evaluations}"
        )
    text = named[0] if len(named) == 1 else f"{', '.join(named[:-1])} and {named[-1]}"
    return f"{ego} violates {text} of {evaluations}"
