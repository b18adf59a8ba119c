"""Rows evaluated with two drivers: what the ego fails in, and the baseline's driver does not.

The baseline is another driver, the version before a change say. A row is critical if it is with the
ego's driver and not with the baseline's, and its F is the difference of their objectives, so that a
search finds where the ego is worse.
"""

from collections.abc import Sequence
from dataclasses import replace

import numpy as np

from bridgegen.assess.metrics import OF_BASELINE
from bridgegen.base.arrays import Bool
from bridgegen.engine.evaluation import Evaluation
from bridgegen.engine.trials import Trials

RECORDED = tuple(f"{OF_BASELINE}{name}" for name in ("harm", "severity", "d_min"))
"""Names of the baseline's quantities that a search records, after the ego's."""

_LOST = "with the baseline's driver"


def difference(
    found: Evaluation,
    names: Sequence[str],
    baseline: Evaluation,
    baseline_names: Sequence[str],
    *,
    gated: bool,
) -> Evaluation:
    """Return the evaluation of N rows less that of the same rows with the baseline's driver.

    A row that fails with the baseline's driver fails. One whose traffic is implausible with either
    driver is not critical, and its F is 0: no difference.

    Args:
        found: with the ego's driver; its columns of RECORDED are filled here.
        names: of its metrics.
        baseline: with the baseline's, by the same objective.
        baseline_names: of its metrics.
        gated: whether implausible scenarios are no results.
    """
    # Of a row that one of the two did not get through, nothing can be said of who is worse.
    both = _usable(found, gated) & _usable(baseline, gated)
    F = np.where(both[:, np.newaxis], found.F - baseline.F, 0.0)
    lost = (found.status == 0) & (baseline.status != 0)
    metrics = found.metrics.copy()
    for name in set(RECORDED) & set(names):
        column = baseline_names.index(name.removeprefix(OF_BASELINE))
        metrics[:, names.index(name)] = baseline.metrics[:, column]
    metrics[lost | (found.status != 0)] = np.nan
    findings = found.findings
    if lost.any():
        blank = {name: np.where(lost, "", array) for name, array in findings.columns().items()}
        findings = replace(findings, **blank)
    why = {
        row: ": ".join(text for text in (_LOST, baseline.messages.get(row, "")) if text)
        for row in np.flatnonzero(lost).tolist()
    }
    return replace(
        found,
        metrics=metrics,
        F=F,
        critical=found.critical & both & ~baseline.critical,
        status=np.where(lost, baseline.status, found.status).astype(np.int8),
        findings=findings,
        messages={**found.messages, **why},
    )


def difference_of_trials(found: Trials, baseline: Trials) -> Trials:
    """Return trials in which only what the baseline's driver avoids is harmful."""
    ok: Bool = found.ok & baseline.ok
    harm = np.where(ok & ~baseline.harmful, found.harm, 0.0)
    # What the baseline fails in, too, counts as harmless here.
    until = np.where(ok & baseline.harmful, np.inf, found.harmless_until)
    return replace(found, harm=harm, ok=ok, harmless_until=until)


def _usable(evaluation: Evaluation, gated: bool) -> Bool:
    usable: Bool = evaluation.status == 0
    if gated:
        usable = usable & np.array(evaluation.findings.implausible == "", dtype=np.bool_)
    return usable
