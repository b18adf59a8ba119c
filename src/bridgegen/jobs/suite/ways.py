"""How a row fails: in which failure mode, and which pass criteria it violates."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.base.arrays import Float
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.suite.evaluate import Job
from bridgegen.search.triage.modes import Key, keys_of, title
from bridgegen.simulation.choice import EMBEDDED
from bridgegen.simulation.rollout import STATUS_MESSAGES

NO_KEY = Key("", "", "", "", "")
"""Of a scenario that is no failure by its conflict, but violates pass criteria."""


@dataclass(frozen=True)
class Way:
    """How a row fails.

    Attributes:
        key: of its mode; NO_KEY where it only violates criteria.
        rule: label of the rule that decides on the responsibility; "" likewise.
        violates: the criteria that it violates, as `Criterion.to_dict` gives them.
        metrics: by name, all that are recorded.
        harm: that counts.
        title: in words.
        driver: that drove the ego, by name.
        problem: why it does not fail; empty if it does.
    """

    key: Key
    rule: str
    violates: tuple[Mapping[str, Any], ...]
    metrics: Mapping[str, float]
    harm: float
    title: str
    driver: str
    problem: str = ""


def ways(pipeline: Pipeline, X: Float) -> list[Way]:
    """Return how rows fail: by harm, as a triage has it, or by pass criteria alone.

    Args:
        pipeline: with the quick causes.
        X: ``(N, len(pipeline.space.names))``.
    """
    found = pipeline.evaluate(X)
    places = pipeline.try_all(X).place.tolist()
    causes = [""] * len(X) if found.cause is None else [Cause(k).label for k in found.cause]
    keys = keys_of(found.findings, pipeline.kinds, places, causes)
    margins = found.metrics[:, [pipeline.metrics.index(one) for one in pipeline.monitor.names]]
    made = []
    for i, key in enumerate(keys):
        metrics = dict(zip(pipeline.metrics, found.metrics[i].tolist(), strict=True))
        harm = float(np.nan_to_num(metrics[pipeline.objective.harm]))
        violates = tuple(
            one.to_dict()
            for one, margin in zip(pipeline.monitor, margins[i], strict=True)
            if margin < 0.0
        )
        problem, rule = "", str(found.findings.rule[i])
        if found.status[i]:
            text = STATUS_MESSAGES[int(found.status[i])]
            problem = ": ".join(filter(None, (text, found.messages.get(i, ""))))
        elif harm < NEAR_MISS or found.findings.implausible[i]:
            key, rule = NO_KEY, ""
            if not violates:
                why = found.findings.implausible[i]
                problem = f"it is no failure of the ego: harm {harm:.2g} of {NEAR_MISS:g}"
                problem = f"its traffic is implausible: {why}" if why else problem
        ids = ", ".join(one["id"] for one in violates)
        words = f"violates {ids}"
        if key is not NO_KEY:
            words = title(key, [rule], pipeline.objective.count)
        made.append(Way(key, rule, violates, metrics, harm, words, pipeline.driver.label, problem))
    return made


def seeking_causes(job: Job) -> Job:
    """Return a job whose pipeline is the embedded simulator's, and finds quick causes."""
    return replace(job, options=replace(job.options, causes=True), simulator=EMBEDDED)
