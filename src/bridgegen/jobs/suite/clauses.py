"""Clauses of a regulation: which variations violate them, and each clause's verdict by ego."""

from collections import Counter
from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.preventability.classes import CellClass, Codes, Outcome, classes, outcomes
from bridgegen.jobs.preventability.options import MODELS
from bridgegen.jobs.suite.results import (
    EXCUSED,
    FAILED,
    NOT_APPLICABLE,
    NOT_RUN,
    PASSED,
    EntryResult,
    RowResult,
    Verdict,
)
from bridgegen.scenario.language.protocols import read_clause
from bridgegen.search.triage.bound import too_few
from bridgegen.simulation.choice import SimulatorChoice


@dataclass(frozen=True)
class ClauseResult:
    """One clause, judged over all variations of all entries that state it, with one ego.

    Attributes:
        id: of the clause.
        text: of it.
        ego: as named.
        entries: that state it, by name.
        passed: variations that pass, those with an unpreventable collision among them.
        failed: variations that fail.
        not_run: variations without a result, of the ego or of a model that decides.
        not_applicable: variations whose traffic could not happen, or in which what their scenario
            is about did not happen.
        unpreventable: variations that pass although the ego collides, since the models do, too.
    """

    id: str
    text: str
    ego: str
    entries: tuple[str, ...]
    passed: int
    failed: int
    not_run: int
    not_applicable: int
    unpreventable: int

    @property
    def verdict(self) -> Verdict:
        """Failed if a variation fails; else not run if one did not; else whether it is judged."""
        if self.failed:
            return "failed"
        if self.not_run or not self.passed + self.not_applicable:
            return "not run"
        few = too_few(self.passed, self.passed + self.not_applicable, "variations could be judged")
        return "not judged" if few else "passed"


def clause_results(results: Sequence[EntryResult], ego: str) -> tuple[ClauseResult, ...]:
    """Return the clauses that entries state, judged with one ego, in the order of their ids."""
    of: dict[str, list[tuple[EntryResult, int]]] = {}
    texts: dict[str, str] = {}
    for result in results:
        if result.ego != ego:
            continue
        for number, given in enumerate(result.clauses):
            clause = read_clause(given)
            of.setdefault(clause.id, []).append((result, number))
            texts.setdefault(clause.id, clause.text)
    return tuple(_result(id, texts[id], ego, of[id]) for id in sorted(of, key=_order))


def _order(id: str) -> list[tuple[bool, int, str]]:
    """Return a key by which 5.2.10 comes after 5.2.9."""
    parts = id.replace("-", ".").split(".")
    return [(part.isdigit(), int(part) if part.isdigit() else 0, part) for part in parts]


def _result(
    id: str, text: str, ego: str, stated: Sequence[tuple[EntryResult, int]]
) -> ClauseResult:
    letters = [letter for result, number in stated for letter in result.letters(number)]
    counts = Counter(letters)
    return ClauseResult(
        id,
        text,
        ego,
        tuple(dict.fromkeys(result.entry for result, _ in stated)),
        passed=counts[PASSED] + counts[EXCUSED],
        failed=counts[FAILED],
        not_run=counts[NOT_RUN],
        not_applicable=counts[NOT_APPLICABLE],
        unpreventable=counts[EXCUSED],
    )


def judged(
    pipeline: Pipeline, simulator: SimulatorChoice, X: Float, rows: Sequence[RowResult]
) -> list[RowResult]:
    """Return rows with what each clause of the scenario makes of them.

    Args:
        pipeline: of the ego.
        simulator: which runs it.
        X: ``(N, len(pipeline.space.names))``.
        rows: their results.
    """
    clauses = pipeline.scenario.clauses
    if not clauses:
        return list(rows)
    found = np.full(len(rows), CellClass.AVOIDED, np.int8)
    if any(clause.collisions in ("any", "preventable") for clause in clauses):
        strict = any(clause.collisions == "preventable" for clause in clauses)
        found = _classes(pipeline, simulator, X, rows, MODELS if strict else ())
    ids = [criterion.id for criterion in pipeline.monitor]
    return [
        row.model_copy(
            update={
                "clauses": "".join(
                    _letter(row, CellClass(code), clause.collisions, clause.criteria, ids)
                    for clause in clauses
                )
            }
        )
        for row, code in zip(rows, found.tolist(), strict=True)
    ]


def _letter(
    row: RowResult,
    found: CellClass,
    collisions: str | None,
    criteria: Sequence[str],
    ids: Sequence[str],
) -> str:
    if row.problem:
        return NOT_RUN
    # Before the verdicts: in traffic that could not happen, neither passing nor failing says
    # anything.
    if row.implausible:
        return NOT_APPLICABLE
    # Before the models: that no driver could have avoided a collision excuses no violated
    # criterion.
    if any(ids[i] in criteria for i in row.violated):
        return FAILED
    if collisions == "critical":
        return FAILED if row.critical else NOT_APPLICABLE if row.unsafe_start else PASSED
    if collisions is None or found == CellClass.AVOIDED:
        return PASSED
    if collisions == "any" or found == CellClass.PREVENTABLE:
        return FAILED
    return EXCUSED if found == CellClass.UNPREVENTABLE else NOT_RUN


def _classes(
    pipeline: Pipeline,
    simulator: SimulatorChoice,
    X: Float,
    rows: Sequence[RowResult],
    models: Sequence[str],
) -> Codes:
    """Return the class of each row as a preventability map has it, ``(N,)``.

    Only rows in which the ego touches another are simulated again, and the models drive only where
    its box overlaps another's. Without models a collision is not preventable.
    """
    ego = np.full(len(rows), Outcome.AVOIDED, np.int8)
    touching = np.array([row.collisions > 0 and not row.problem for row in rows], np.bool_)
    if touching.any():
        ego[touching] = outcomes(pipeline, X[touching])
    # Without models there is still a column, which says below that one of them collided, too.
    theirs = np.full((max(len(models), 1), len(rows)), Outcome.NOT_NEEDED, np.int8)
    open_ = ego == Outcome.COLLIDED
    if not models:
        theirs[:, open_] = Outcome.COLLIDED
    # The models are asked for collisions only.
    scenario = replace(pipeline.scenario, criteria=())
    for codes, name in zip(theirs, models, strict=False):
        if not open_.any():
            break
        model = Pipeline(
            scenario,
            pipeline.space,
            PipelineOptions(ego=name, vehicle=pipeline.runner.vehicle),
            simulator=simulator,
            workers=Threads(1),
        )
        codes[open_] = outcomes(model, X[open_])
        # One model that avoids a collision decides on it: the next need not drive there.
        open_ &= codes != Outcome.AVOIDED
    return classes(ego, theirs)
