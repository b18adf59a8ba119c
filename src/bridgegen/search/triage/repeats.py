"""Findings evaluated again, for drivers and simulators that do not repeat: how likely each fails.

The same scenario may pass and fail: in a stack whose processes race, in a planner that draws random
numbers. A scenario was chosen because it failed once, so that evaluation says nothing of its
probability and is not counted: only the repeats are, which follow it.
"""

from collections.abc import Callable, Mapping

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.engine.evaluation import Evaluation
from bridgegen.engine.pipeline import Pipeline
from bridgegen.search.triage.record import Repeated

Known = Mapping[int, Repeated]
"""Results of repeats, by evaluation."""


def repeated(
    pipeline: Pipeline,
    X: Float,
    evaluations: Int,
    most: int,
    failed: Bool,
    fails: Callable[[Evaluation], Bool],
    known: Known,
) -> dict[int, Repeated]:
    """Evaluate rows again, each until it is known whether it fails more often than not.

    Args:
        pipeline: the run's.
        X: ``(K, len(space.names))``, distinct rows.
        evaluations: ``(K,)`` their ids in the store.
        most: repeats of a row at most.
        failed: ``(K,)`` which of them failed at first.
        fails: returns which rows of an evaluation are a failure.
        known: what an earlier triage of the same run found; these are not evaluated again.

    Returns:
        The results, in the order of the rows; see `Repeated`.
    """
    ids = evaluations.tolist()
    found = {
        i: known.get(i) or Repeated(evaluation=i, repeats=0, fails=0, failed=bool(failed[k]))
        for k, i in enumerate(ids)
    }
    open_ = [k for k, i in enumerate(ids) if i not in known]
    # All rows once, then those that are not decided: a round is one batch, whatever the workers.
    for number in range(1, most + 1):
        if not open_:
            break
        evaluation = pipeline.evaluate(X[open_], number)
        failing = fails(evaluation)
        valid = (evaluation.status == 0) & (evaluation.findings.implausible == "")
        for j, k in enumerate(open_):
            before, has = found[ids[k]], bool(valid[j])
            found[ids[k]] = before.model_copy(
                update={
                    "repeats": before.repeats + has,
                    "fails": before.fails + (has and bool(failing[j])),
                    "lost": before.lost + (not has),
                }
            )
        open_ = [k for k in open_ if not found[ids[k]].decided]
    return found


def nearest_misses(harm: Float, harmful: Bool, valid: Bool, most: int) -> list[int]:
    """Return rows that did not fail and came nearest to it, which may fail another time.

    Args:
        harm: ``(N,)``.
        harmful: ``(N,)``, those that failed.
        valid: ``(N,)``, those with a result.
        most: how many.
    """
    some = np.flatnonzero(valid & ~harmful & (harm > 0.0))
    return some[np.argsort(-harm[some], kind="stable")][:most].tolist()  # type: ignore[no-any-return]
