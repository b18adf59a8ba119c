"""From a run's rows to the report's data."""

from collections.abc import Mapping, Sequence
from math import comb
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.happening import Happening
from bridgegen.assess.conflict.harm import NEAR_MISS, Count
from bridgegen.assess.criteria import by_gravity, quantity, summarise_criteria
from bridgegen.assess.objective import Objective, Rule
from bridgegen.base.arrays import Float, Taken
from bridgegen.base.errors import ScenarioError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.replays import Replays
from bridgegen.pages.data import (
    WHOLE,
    Column,
    Deferred,
    Evaluations,
    PageRows,
    ReportData,
    RunSummary,
)
from bridgegen.pages.findings_payload import MOST_MODES
from bridgegen.pages.further import further_playbacks
from bridgegen.pages.notes import tables
from bridgegen.pages.playback import NO_ROW, Playback
from bridgegen.pages.playbacks import (
    beside_others,
    measured_playbacks,
    minimal_playbacks,
    others_of,
    playbacks,
)
from bridgegen.pages.screened_payload import screened_payload
from bridgegen.pages.simulation_payload import simulation_payload
from bridgegen.results.confirmation.record import Record
from bridgegen.results.store import Recorded, Rows
from bridgegen.results.store.summary import Summary
from bridgegen.scenario.language.coverage import CoverageMap, coverage_map
from bridgegen.scenario.language.criteria import PREFIX
from bridgegen.scenario.language.thresholds import Thresholds
from bridgegen.search.screened import NOTE
from bridgegen.search.triage.record import Mode, Triage

SAMPLE = 50_000
"""Number of random scenarios that estimate feasibility: fewer than `bridgegen analyse coverage`
draws, for speed."""

INDEPENDENT = "random"
"""The algorithm whose rows are independent draws."""

TRIPLES = 25_000_000
"""Maximum of scenarios times triples of parameters to count triples: a tenth of a second."""


def build_report(
    pipeline: Pipeline,
    rows: Rows | Recorded,
    summary: Summary,
    *,
    kept: Sequence[tuple[str, int, tuple[str, ...]]],
    replays: Replays | None = None,
    algorithm: str,
    seed: int,
    budget: int,
    command: str,
    finished: bool,
    version: str,
    notes: Mapping[str, Any],
    view: str = "",
    keep: str = "",
    simulated: tuple[str, str] = ("", ""),
    regions: Mapping[str, Any] | None = None,
    confirmations: Sequence[Record] = (),
    hashes: Mapping[str, str] | None = None,
    coverage: bool = True,
    files: Mapping[str, bytes] | None = None,
    more: bool = True,
    triage: Triage | None = None,
    drawn: Mapping[str, Float] | None = None,
    further_files: Sequence[str] = (),
    happening: Happening | None = None,
    beside: tuple[str, ...] = (),
) -> ReportData:
    """Return all that the page shows.

    Args:
        pipeline: what evaluated the rows.
        rows: all of the run, in order.
        summary: of the same rows.
        kept: name, evaluation and files of the exported scenarios, most critical first; an
            exported scenario satisfies all constraints.
        replays: of these scenarios; simulated here by default.
        algorithm: its name.
        seed: of the run.
        budget: of the run.
        command: the command line that repeats the run.
        finished: whether the budget is spent.
        version: of BridgeGen.
        notes: the algorithm's notes on the run.
        keep: the command line that keeps its failures in a suite.
        view: the command line that shows this run with the motion of every scenario, if any.
        simulated: see `simulation_payload`.
        regions: the critical ones, in the form of `regions.record`, if they are known.
        confirmations: of its scenarios in other simulators.
        hashes: digests of the run's inputs and results.
        coverage: whether to compute coverage, and what the page simulates with; not for news.
        files: those of ``kept``, by their paths relative to the page, if the page includes them.
        more: whether the page includes the motion of more scenarios than ``kept``.
        triage: failure modes and bound of the run, if they are known.
        drawn: failing fresh random draws, the worst first, by name.
        beside: pages of other analyses, files of the run's folder.
        further_files: of these and of the minimal scenarios, by their paths relative to the page.
        happening: which events began, and who came near the ego, if it is known.
    """
    scenario, limits = pipeline.scenario, pipeline.objective.thresholds
    embedded = pipeline.runner.embedded
    terms, rule = pipeline.objective.names, pipeline.objective.rule
    if pipeline.objective.objectives == "one":
        weighted = zip(terms, pipeline.objective.weights, strict=True)
        wanted = {"weights of the objective": ", ".join(f"{n} {w:.4g}" for n, w in weighted)}
    else:
        wanted = {"objectives": ", ".join(terms)}
    head = RunSummary(
        scenario=scenario.name,
        title=scenario.title,
        description=scenario.description.strip(),
        road=pipeline.runner.source.road,
        ego=pipeline.driver.label,
        baseline=pipeline.baseline.driver.label if pipeline.baseline else "",
        algorithm=algorithm,
        seed=seed,
        budget=budget,
        n_evaluations=summary.evaluations,
        n_critical=summary.critical,
        r_critic=summary.r_critic,
        critical_rule=rule_in_words(pipeline.objective, pipeline.cause, pipeline.baseline),
        critical_distance=limits.d_min_below if rule == "thresholds" else None,
        first_critical=summary.first,
        fiftieth_critical=summary.fiftieth,
        d_min_best=summary.d_min_best,
        d_min_median=summary.d_min_median,
        v_d_best=summary.v_d_best,
        v_d_median=summary.v_d_median,
        wall_seconds=summary.seconds,
        finished=finished,
        version=version,
        command=command,
        view=view,
        keep=keep,
        independent=algorithm == INDEPENDENT,
        harm=pipeline.objective.harm if rule != "thresholds" else "",
        criteria=pipeline.objective.criteria,
        hashes=hashes,
        odd="" if scenario.odd is None else scenario.odd.label,
        settings={
            **({} if scenario.odd is None else scenario.odd.facts),
            "axes searched": ", ".join(str(axis) for axis in pipeline.space.axes),
            **wanted,
            "simulated": f"{embedded.duration:g} s at {embedded.time_step:g} s",
        },
    )
    modes = triage.modes[:MOST_MODES] if triage else ()
    first = [mode.shown for mode in modes]
    if triage and not modes:  # the scenarios nearest to harm
        nearest = [item.evaluation for item in triage.bound.least if item.evaluation is not None]
        first = nearest[:1]
    judged = summarise_criteria(
        [item for item in pipeline.monitor if item.quantity in pipeline.metrics],
        rows.metrics,
        pipeline.metrics,
    )
    worst = [item.at for item in (*by_gravity(judged), *judged)]
    first += [at - 1 for at in worst if at is not None]
    return ReportData(
        head,
        _evaluations(pipeline, rows),
        playbacks(pipeline, rows, kept, replays=replays),
        _coverage(pipeline, rows) if coverage else None,
        tables({key: note for key, note in notes.items() if key != NOTE}, pipeline.space),
        regions,
        # An iterator: motions are rolled out until the page is full. A page that rolled out a tenth
        # of 10⁶ rows, with room for a few hundred, took 5,440 MiB.
        more=further_playbacks(pipeline, rows, {evaluation for _, evaluation, _ in kept}, first)
        if more
        else (),
        files=files or {},
        confirmations=confirmations,
        triage=triage,
        minimal=_minimal(pipeline, modes, further_files),
        drawn=_drawn(pipeline, drawn or {}, further_files),
        criteria=judged,
        screened=screened_payload(notes, pipeline.space),
        happening=happening,
        beside=beside,
        simulation=simulation_payload(pipeline, simulated) if coverage else None,
    )


def rule_in_words(
    objective: Objective, cause: Cause | None = None, baseline: Pipeline | None = None
) -> str:
    """Return when a scenario is critical, in words.

    Args:
        objective: with the rule.
        cause: the only one that counts, if one was chosen.
        baseline: of the driver that the ego's is compared with, if there is one.
    """
    rule = critical_in_words(
        objective.rule, objective.count, objective.thresholds, objective.criteria
    )
    rule += "" if cause is None else f", put down to {cause.label}"
    return rule if baseline is None else f"{rule}; not so with {baseline.driver.label}"


def critical_in_words(
    rule: Rule, count: Count, limits: Thresholds, criteria: Sequence[str] = ()
) -> str:
    """Return when a scenario is critical, in words: by harm, by thresholds, or by criteria."""
    if rule == "criteria":
        names = ", ".join(name.removeprefix(PREFIX) for name in criteria) or "all"
        which = "criterion" if len(criteria) == 1 else "one of the criteria"
        return f"a violation of {which} {names}"
    if rule == "harm" and count == "any":
        return (
            "a collision or a near miss, whoever is responsible, or a violation of the ego's, "
            f"harm_any ≥ {NEAR_MISS:g}"
        )
    if rule == "harm":
        return (
            "a collision that the ego is responsible for or could have prevented, or a near miss "
            "that it is responsible for, or its leaving the lane or the road, or passing a cyclist "
            f"or pedestrian too closely, harm ≥ {NEAR_MISS:g}"
        )
    many = limits.n_collision_above
    contact = "a collision" if many == 0 else f"more than {many:g} collisions"
    return (
        f"{contact}, or d_min below {limits.d_min_below:g} m while v_d is at least "
        f"{limits.v_d_at_least:g} m/s"
    )


def _evaluations(pipeline: Pipeline, rows: Rows | Recorded) -> Evaluations:
    space, declared = pipeline.space, pipeline.scenario.parameters
    X, measured = PageRows(rows.X), PageRows(rows.metrics)
    lines = {line.name: line for line in pipeline.scenario.table()}
    parameters = tuple(
        Column(
            name,
            unit,
            Deferred(X, i),
            lines[name].description,
            declared[name].low if name in declared else None,
            declared[name].high if name in declared else None,
            name in space.variables,
            declared[name].kind.labels() if name in declared else {},
        )
        for i, (name, unit) in enumerate(zip(space.names, space.units, strict=True))
        if name not in {*pipeline.runner.source.unused_names, *space.decisions}
    )
    metrics = tuple(
        Column(
            name,
            pipeline.units[name],
            rows.metrics[:, j]
            # Only columns that the page summarises are held whole; others are read of the rows that
            # it shows.
            if name in WHOLE or name.startswith(PREFIX)
            else Deferred(measured, j),
            quantity(name).description,
        )
        for j, name in enumerate(pipeline.metrics)
    )
    item = pipeline.objective.objectives == "one"
    names = ("F",) if item else tuple(f"F of {name}" for name in pipeline.objective.names)
    objectives = tuple(Column(name, "1", rows.F[:, j]) for j, name in enumerate(names))
    cause = rows.cause if rows.cause.any() else None
    return Evaluations(
        rows.batch,
        parameters,
        metrics,
        objectives,
        rows.critical,
        rows.status,
        cause,
        rows.findings if any(rows.findings.conflict) or any(rows.findings.implausible) else None,
    )


def _minimal(
    pipeline: Pipeline, modes: Sequence[Mode], files: Sequence[str]
) -> tuple[Playback, ...]:
    """Return the playbacks of the minimal scenarios of failure modes."""
    wanted = [
        (
            mode.minimal.name or f"minimal form of mode {mode.number}",
            mode.shown,
            _of(mode.minimal.name, files),
            mode.minimal,
        )
        for mode in modes
        if mode.minimal is not None
    ]
    return () if pipeline.driver.is_own else minimal_playbacks(pipeline, wanted)


def _drawn(
    pipeline: Pipeline, drawn: Mapping[str, Float], files: Sequence[str]
) -> tuple[Playback, ...]:
    """Return the playbacks of fresh random draws."""
    if not drawn:
        return ()
    X = np.stack([*drawn.values()])
    wanted = [(name, NO_ROW, _of(name, files)) for name in drawn]
    played = measured_playbacks(pipeline, wanted, X, brief=False)
    played = beside_others(played, X, others_of(pipeline))
    # A driver of the user's own need not do the same again.
    return tuple(item for item in played if item.metrics[pipeline.objective.harm] >= NEAR_MISS)


def _of(name: str, files: Sequence[str]) -> tuple[str, ...]:
    return tuple(file for file in files if Path(file).stem == name)


def _coverage(pipeline: Pipeline, rows: Rows | Recorded) -> CoverageMap:
    space, ok = pipeline.space, rows.status == 0
    X, critical = Taken(rows.X, np.flatnonzero(ok)), rows.critical[ok]
    n_var = len({*space.variables} - space.decisions)
    strength = 3 if comb(n_var, 3) * (len(X) + SAMPLE) <= TRIPLES else 2
    try:
        return coverage_map(space, X, critical, strength=strength, sample=SAMPLE)
    except ScenarioError:
        # Constraints may contradict each other where the search has no row: no sample then.
        return coverage_map(space, X, critical, strength=strength, sample=0)
