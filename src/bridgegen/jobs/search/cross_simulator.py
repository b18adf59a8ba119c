"""Scenarios of a run, simulated here and in another simulator, and compared one by one."""

import time
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass

import numpy as np

from bridgegen.assess.conflict.analysis import analyse
from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.harm import Count
from bridgegen.assess.objective import CLASSIFYING
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.runner import Runner
from bridgegen.engine.workers import Lost
from bridgegen.results.confirmation.compare import compare, first_contact, tracks
from bridgegen.results.confirmation.record import (
    Change,
    Course,
    Differences,
    Margin,
    Outcome,
    Scenario,
    digest_of,
    number,
)
from bridgegen.results.confirmation.words import explanation
from bridgegen.results.store import Rows
from bridgegen.scenario.language.criteria import PREFIX
from bridgegen.simulation.rollout import STATUS_MESSAGES, WORKER_ENDED, Rollout

AT_A_TIME = 32
"""Largest number of scenarios that are simulated before their results are yielded."""

FOUND = ("conflict", "conflict_type", "responsible", "partner")
"""The fields of a record on the decisive conflict."""

SECONDS = 0.5
"""Duration of a batch below which batches grow [s], so that little is lost at an interruption."""


@dataclass(frozen=True)
class _Ran:
    """A row of a rollout.

    Attributes:
        rollout: of several rows.
        row: which of them.
        metrics: ``(M,)`` of that row; NaN where it failed.
        findings: of all rows of the rollout.
    """

    rollout: Rollout
    row: int
    metrics: Float
    findings: Findings


def run_elsewhere(
    here: Pipeline, there: Pipeline, every: Rows, evaluations: Sequence[int]
) -> Iterator[Scenario]:
    """Simulate evaluations here and there, and yield the comparison of each.

    Args:
        here: the run's pipeline.
        there: the same with another simulator.
        every: all rows of the run.
        evaluations: some of these, which succeeded.
    """
    for at, runner in here.runner.by_variant(every.X[list(evaluations)]):
        yield from _run_some(here, runner, there, every, [evaluations[row] for row in at.tolist()])


def _run_some(
    here: Pipeline, runner: Runner, there: Pipeline, every: Rows, evaluations: Sequence[int]
) -> Iterator[Scenario]:
    """Compare evaluations of one storyboard, which a runner has."""
    most = max(1, min(AT_A_TIME, there.rows_at_once * there.runs_at_once))
    size, done = min(most, there.runs_at_once), 0
    while done < len(evaluations):
        began = time.monotonic()
        some = list(evaluations[done : done + size])
        X = every.X[some]
        motion = runner.run(X)
        found = _elsewhere(there, X, here.objective.count)
        for row, (k, ran) in enumerate(zip(some, found, strict=True)):
            yield _scenario(here, every, k, motion, row, ran)
        done += len(some)
        if time.monotonic() - began < SECONDS:  # no result depends on the batch
            size = min(most, 2 * size)


def _elsewhere(there: Pipeline, X: Float, count: Count) -> Iterator[_Ran | str]:
    """Yield each row's result, or the reason of its failure."""
    try:
        found = there.rollouts(X)
    except InputError as error:
        if len(X) == 1:
            yield "; ".join(error.problems)
            return
        for x in X:  # isolate the row that fails
            yield from _elsewhere(there, x[np.newaxis], count)
        return
    for rollout in found:
        if isinstance(rollout, Lost):
            yield f"{STATUS_MESSAGES[WORKER_ENDED]}: {rollout.reason}"
            continue
        metrics = there.measure(rollout)
        findings = _findings(rollout, count)
        for row in range(rollout.shape[0]):
            yield _Ran(rollout, row, metrics[row], findings)


def _findings(rollout: Rollout, count: Count) -> Findings:
    return Findings.of(analyse(rollout), [""] * rollout.shape[0], count)


def _scenario(
    here: Pipeline, every: Rows, k: int, motion: Rollout, row: int, ran: _Ran | str
) -> Scenario:
    """Return the comparison of evaluation k, whose motion here is a row of a rollout."""
    objective = here.objective
    known = _outcome(here, every.metrics[k], every.F[k], every.findings.row(k))
    # A record is only used with the row that it is of.
    digest = digest_of(every.X[k], every.metrics[k])
    if isinstance(ran, str) or ran.rollout.status[ran.row] != 0:
        failure = _legal(ran if isinstance(ran, str) else _failure(ran))
        ours = known.model_copy(update={"contact": first_contact(motion, row)})
        return Scenario(evaluation=k, name=None, row=digest, here=ours, failure=failure)
    # By the run's own objective: a difference is then of the motion, and not of the rule.
    F, _ = objective.F(ran.metrics[np.newaxis], here.metrics)
    partner = known.partner if objective.rule == "harm" else ""
    found = compare(motion, ran.rollout, row, ran.row, partner)
    both = (known, _outcome(here, ran.metrics, F[0], ran.findings.row(ran.row)))
    ours, theirs = (
        outcome.model_copy(update={"contact": contact, "ends": ends})
        for outcome, contact, ends in zip(both, found.contacts, found.ends, strict=True)
    )
    differences = Differences.of(found)
    return Scenario(
        evaluation=k,
        name=None,
        row=digest,
        here=ours,
        there=theirs,
        change=Change.between(ours, theirs),
        differences=differences,
        tracks=tuple(Course.of(track) for track in tracks(motion, ran.rollout, row, ran.row)),
        explanation=explanation(ours, theirs, differences, objective.thresholds, objective.rule),
    )


def _outcome(
    pipeline: Pipeline, metrics: Float, F: Float, finding: Mapping[str, str | None]
) -> Outcome:
    names = pipeline.metrics
    measured = {
        name: number(metrics[names.index(of)])
        for name, of in (("harm", pipeline.objective.harm), ("severity", "severity"))
        if of in names
    }
    n_collision, d_min, v_d = (number(metrics[names.index(name)]) for name in CLASSIFYING)
    return Outcome(
        critical=bool(pipeline.objective.critical(metrics[np.newaxis], names)[0]),
        n_collision=n_collision,
        d_min=d_min,
        v_d=v_d,
        F=tuple(number(item) for item in F),
        **measured,
        **{name: finding[name] or "" for name in FOUND},
        margins={
            name.removeprefix(PREFIX): Margin(
                value=float(metrics[names.index(name)]), unit=pipeline.units[name]
            )
            for name in pipeline.objective.criteria
        },
    )


def _failure(ran: _Ran) -> str:
    status = int(ran.rollout.status[ran.row])
    said = STATUS_MESSAGES.get(status, f"status {status}")
    return ": ".join([said, *filter(None, [ran.rollout.messages.get(ran.row)])])


def _legal(text: str) -> str:
    """Return another program's text without control characters."""
    return "".join(name if name.isprintable() else " " for name in text).strip()
