"""An entry of a suite → its pipeline → the results of its rows."""

from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from typing import Any

import numpy as np

from bridgegen.assess.conflict.findings import is_unsafe_start
from bridgegen.assess.conflict.happening import Happening
from bridgegen.base.errors import BridgeGenError, InputError
from bridgegen.drivers.identity import digest_of
from bridgegen.engine.domain import outside
from bridgegen.engine.evaluation import Evaluation
from bridgegen.engine.options import CommonOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.search.scenarios import as_judged, chosen_objective, driven_by, load, within
from bridgegen.jobs.suite.clauses import judged
from bridgegen.jobs.suite.drawn import Draw, drawn
from bridgegen.jobs.suite.entries import Entry
from bridgegen.jobs.suite.results import EntryResult, GridResult, RowResult, finite
from bridgegen.jobs.suite.rows import Rows, is_sample, rows_of
from bridgegen.openx.file_scenario import FileScenario
from bridgegen.openx.openscenario.ranges import FileParameter
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.simulation.choice import SimulatorChoice
from bridgegen.simulation.rollout import STATUS_MESSAGES

AT_ONCE = 512
"""Number of rows that are evaluated together; no result depends on it."""

IMPACT = ("impact_speed", "relative_impact_speed", "speed_reduction")

QUANTITIES = ("harm", "severity", "n_collision", "d_min", *IMPACT)

MATRIX, DRAWN = "matrix", "drawn"
"""The columns that name a row's grid, and where an assessor drew it."""


@dataclass(frozen=True)
class Job:
    """What a worker is given.

    Attributes:
        entry: what to run.
        ego: the driver, None for the scenario's own.
        options: those of all entries; without ego, distribution and map.
        simulator: which runs them.
        samples: rows of a logical scenario besides its defaults.
        seed: of samples.
        edition: of a logical scenario's matrix; None: all, "none": samples instead.
        only: the number of the one row that is run, from 0 on; None: all.
        draw: what an assessor's key draws in place of these rows.
        repeats: how often each row is evaluated, unless it is known to repeat.
    """

    entry: Entry
    ego: str | None
    options: CommonOptions
    simulator: SimulatorChoice
    samples: int
    seed: int
    edition: str | None = None
    only: int | None = None
    draw: Draw | None = None
    repeats: int = 1

    @property
    def driver_digest(self) -> str:
        """See `bridgegen.drivers.identity.digest_of`; empty of a scenario's own driver."""
        return digest_of(self.ego) if self.ego else ""

    def is_of(self, result: EntryResult) -> bool:
        """Whether a result is that of the files as they are now."""
        if not result.digest or self.driver_digest != result.driver_digest:
            return False
        return self.entry.digest == result.digest

    @property
    def name(self) -> str:
        """Of the entry, and of the ego if there is one."""
        return self.entry.name if self.ego is None else f"{self.entry.name} ({self.ego})"


def evaluate(job: Job) -> EntryResult:
    """Run an entry; what is wrong with it is a result, too."""
    entry = job.entry
    found = EntryResult(
        entry=entry.name,
        ego=job.ego or "",
        digest=entry.digest,
        driver_digest=job.driver_digest,
        scenario=entry.scenario,
        distribution=entry.distribution or "",
        problem=entry.problem,
    )
    if entry.problem:
        return found
    try:
        return _evaluated(job, found)
    except InputError as error:
        return found.model_copy(update={"problem": "; ".join(error.problems)})
    except BridgeGenError as error:
        return found.model_copy(update={"problem": str(error)})


def scenario_of(job: Job) -> SearchedScenario:
    """Return the scenario of an entry, within the operational design domain if one is given.

    Raises:
        InputError: the files cannot be read, or nothing of it lies in that domain.
    """
    entry = job.entry
    is_file = is_storyboard(entry.scenario)
    trigger = job.options.empty_trigger if is_file else None
    scenario = driven_by(load(entry.scenario, entry.distribution, trigger), job.options.others)
    return within(scenario, job.options.odd)


def pipeline_of(job: Job) -> Pipeline:
    """Return the pipeline of an entry, ready to evaluate.

    Raises:
        InputError: the files cannot be read or run.
    """
    entry, scenario = job.entry, scenario_of(job)
    options = replace(
        job.options,
        ego=job.ego,
        metrics=IMPACT,
        criteria=[*job.options.criteria, *_further_criteria(job, scenario)],
        count=job.options.count or entry.count,
    )
    spec = chosen_objective(scenario.objective, options, "one")
    scenario = as_judged(replace(scenario, objective=spec), spec.gated)
    # Entries are spread over the workers; the rows of each share one thread.
    pipeline = Pipeline(
        scenario, scenario.space(), options, simulator=job.simulator, workers=Threads(1)
    )
    pipeline.choose_objective()
    return pipeline


def _further_criteria(job: Job, scenario: SearchedScenario) -> list[Mapping[str, Any]]:
    """Return the criteria of the index whose ids neither the options nor the scenario have."""
    known = {criterion.id for criterion in scenario.criteria} | {
        criterion["id"] for criterion in job.options.criteria
    }
    return [criterion for criterion in job.entry.criteria if criterion["id"] not in known]


def rows_of_job(job: Job, pipeline: Pipeline) -> np.ndarray:
    """Return the rows of an entry, ``(N, len(pipeline.space.names))``.

    Raises:
        InputError: it has not the one that is asked for.
    """
    return run_of(job, pipeline.scenario, pipeline.space).X


def run_of(job: Job, scenario: SearchedScenario, space: SearchSpace) -> Rows:
    """Return what is run of an entry; see `rows_of_job`."""
    if job.draw is not None:
        found = drawn(scenario, space, job.draw, job.entry.digest)
    else:
        found = rows_of(scenario, space, job.samples, job.seed, job.edition)
    if job.only is None:
        return found
    if not 0 <= job.only < len(found.X):
        raise InputError(
            f"{job.entry.name}: variations are numbered from 1 to {len(found.X)}, got "
            f"{job.only + 1}"
        )
    at = slice(job.only, job.only + 1)
    return replace(found, X=found.X[at], grid=found.grid[at], strata=found.strata[at], excluded=0)


def _evaluated(job: Job, found: EntryResult) -> EntryResult:
    pipeline = pipeline_of(job)
    space = pipeline.space
    given = run_of(job, pipeline.scenario, space)
    X, names = given.X, given.names
    notes = [*pipeline.scenario.notes, *pipeline.runner.notes]
    if given.excluded:
        notes.append(
            f"{given.excluded} {'draws' if given.strata else 'combinations'} are excluded by the "
            "scenario's own constraints"
        )
    rows, texts = list[RowResult](), list[str]()
    for start in range(0, len(X), AT_ONCE):
        some = X[start : start + AT_ONCE]
        tries = []
        for number in range(1 if pipeline.repeats else job.repeats):
            evaluation = pipeline.evaluate(some, number)
            texts += evaluation.findings.happened.tolist()
            found_here = _rows(pipeline, some, evaluation, names)
            tries.append(judged(pipeline, job.simulator, some, found_here))
        rows += [RowResult.of_repeats(each) for each in zip(*tries, strict=True)]
    happening = Happening.of(texts)
    beyond = "" if job.entry.is_failure else outside(pipeline.runner)
    if job.entry.is_failure:  # it is about that conflict: one that stops for it has met it
        happening = replace(happening, stuck=0)
    units = dict(zip(space.names, space.units, strict=True))
    labels = given.strata or [given.grids[number].label for number in given.grid]
    if labels:
        rows = [
            row.model_copy(update={"x": [label, *row.x]})
            for row, label in zip(rows, labels, strict=True)
        ]
    named = [DRAWN if given.strata else MATRIX] if labels else []
    return found.model_copy(
        update={
            "driver": pipeline.driver.label,
            "title": pipeline.scenario.title,
            "parameters": [*named, *_shown(names, space)],
            "units": [*("1" for _ in named), *(units[name] for name in names)],
            "grids": [
                GridResult(
                    label=grid.label,
                    edition=grid.edition,
                    score=grid.score,
                    points=grid.points,
                    graded=grid.graded,
                )
                for grid in given.grids
            ],
            "sampled": bool(space.n_var) and not labels and is_sample(pipeline.scenario),
            "criteria": [criterion.to_dict() for criterion in pipeline.monitor],
            "clauses": [clause.to_dict() for clause in pipeline.scenario.clauses],
            "rows": rows,
            "notes": notes,
            "not_happened": list(happening.reasons),
            "outside": beyond,
        }
    )


def _shown(names: Sequence[str], space: SearchSpace) -> list[str]:
    """Return what parameters are called: a set of values, whose name is ours, by what it is."""
    made = list(names)
    sets = [
        i
        for i, name in enumerate(names)
        if isinstance(parameter := space.parameters.get(name), FileParameter) and parameter.is_set
    ]
    for k, i in enumerate(sets, start=1):
        made[i] = f"value set {k}" if len(sets) > 1 else "value set"
    return made


def written(
    scenario: SearchedScenario, space: SearchSpace, X: np.ndarray, names: Sequence[str]
) -> list[list[float | str]]:
    """Return the values of some columns of rows as results have them."""
    columns = [space.index(name) for name in names]
    parameters: list[Parameter | None] = [space.parameters.get(name) for name in names]
    of_file = scenario.texts if isinstance(scenario, FileScenario) else {}
    made = []
    for row in X.tolist():
        x: list[float | str] = []
        for name, column, parameter in zip(names, columns, parameters, strict=True):
            value = row[column]
            if name in of_file:  # of a set of values, too, which has no parameter of its own
                x.append(of_file[name][round(value)])
                continue
            if isinstance(parameter, FileParameter) and parameter.is_set:
                x.append(f"{round(value) + 1} of {round(parameter.high) + 1}")
                continue
            text = value if parameter is None else parameter.kind.written(value)
            x.append(text if isinstance(text, str) else float(text))
        made.append(x)
    return made


def _rows(
    pipeline: Pipeline, X: np.ndarray, evaluation: Evaluation, names: Sequence[str]
) -> list[RowResult]:
    metrics = {name: evaluation.metrics[:, pipeline.metrics.index(name)] for name in QUANTITIES}
    margins = [
        evaluation.metrics[:, pipeline.metrics.index(item)] for item in pipeline.monitor.names
    ]
    unsafe = is_unsafe_start(evaluation.findings, metrics["harm"])
    rows = []
    for i, x in enumerate(written(pipeline.scenario, pipeline.space, X, names)):
        if evaluation.status[i]:
            text = STATUS_MESSAGES[int(evaluation.status[i])]
            more = evaluation.messages.get(i, "")
            rows.append(RowResult(x=x, problem=f"{text}: {more}" if more else text))
            continue
        texts = {key: value or "" for key, value in evaluation.findings.row(i).items()}
        rows.append(
            RowResult(
                x=x,
                critical=bool(evaluation.critical[i]),
                harm=float(metrics["harm"][i]),
                severity=float(metrics["severity"][i]),
                collisions=float(metrics["n_collision"][i]),
                d_min=finite(float(metrics["d_min"][i])),
                impact_speed=float(metrics["impact_speed"][i]),
                relative_impact_speed=float(metrics["relative_impact_speed"][i]),
                speed_reduction=finite(float(metrics["speed_reduction"][i])) or 0.0,
                conflict=texts["conflict"],
                conflict_type=texts["conflict_type"],
                responsible=texts["responsible"],
                partner=texts["partner"],
                implausible=texts["implausible"],
                unsafe_start=bool(unsafe[i]),
                margins=[float(margin[i]) for margin in margins],
            )
        )
    return rows
