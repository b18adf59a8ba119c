"""Findings evaluated again, for drivers and simulators that do not repeat: how likely each fails.

The same scenario may pass and fail: in a stack whose processes race, in a planner that draws random
numbers. A scenario was chosen because it failed once, so that evaluation says nothing of its
probability and is not counted: only the repeats are, which follow it.
"""

from collections.abc import Callable, Sequence

from bridgegen.base.arrays import Bool, Float
from bridgegen.engine.evaluation import Evaluation
from bridgegen.engine.pipeline import Pipeline
from bridgegen.search.triage.record import Repeated, is_decided


def repeated(
    pipeline: Pipeline,
    X: Float,
    first: Sequence[Repeated],
    most: int,
    fails: Callable[[Evaluation], Bool],
) -> dict[int, Repeated]:
    """Evaluate rows again, each until it is known whether it fails more often than not.

    Args:
        pipeline: the run's.
        X: ``(K, len(space.names))``, distinct rows.
        first: of each row; those that have repeats already are not evaluated.
        most: repeats of a row at most.
        fails: returns which rows of an evaluation are a failure.

    Returns:
        The results by evaluation, in the order of the rows.
    """
    found = list(first)
    left = [k for k, item in enumerate(found) if not item.repeats + item.lost]
    # All rows once, then those that are not decided: a round is one batch, whatever the workers.
    for number in range(1, most + 1) if left else ():
        evaluation = pipeline.evaluate(X[left], number)
        valid = (evaluation.status == 0) & (evaluation.findings.implausible == "")
        for k, has, fail in zip(left, valid.tolist(), fails(evaluation).tolist(), strict=True):
            item = found[k]
            counts = {"fails": item.fails + (has and fail), "lost": item.lost + (not has)}
            found[k] = item.model_copy(update=counts | {"repeats": item.repeats + has})
        left = [k for k in left if not is_decided(found[k].fails, found[k].repeats)]
        if not left:
            break
    return {item.evaluation: item for item in found}
