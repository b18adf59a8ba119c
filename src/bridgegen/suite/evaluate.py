"""An entry of a suite → its pipeline → the results of its rows."""

from collections.abc import Sequence
from dataclasses import dataclass, replace

import numpy as np

from bridgegen.campaign.chosen import as_judged, chosen_objective
from bridgegen.campaign.scenarios import driven_by, load
from bridgegen.errors import BridgeGenError, InputError
from bridgegen.evaluation import Evaluation
from bridgegen.odd.parameters import Parameter
from bridgegen.openx.file_scenario import FileScenario
from bridgegen.options import CommonOptions
from bridgegen.pipeline import Pipeline
from bridgegen.simulation.choice import SimulatorChoice
from bridgegen.simulation.rollout import STATUS_MESSAGES
from bridgegen.suite.clauses import judged
from bridgegen.suite.entries import Entry
from bridgegen.suite.results import EntryResult, RowResult, finite
from bridgegen.suite.rows import rows_of
from bridgegen.workers import Threads

AT_ONCE = 512
"""Rows that are evaluated together; no result depends on it."""

QUANTITIES = ("harm", "severity", "n_collision", "d_min")


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
    """

    entry: Entry
    ego: str | None
    options: CommonOptions
    simulator: SimulatorChoice
    samples: int
    seed: int

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


def pipeline_of(job: Job) -> Pipeline:
    """Return the pipeline of an entry, ready to evaluate.

    Raises:
        InputError: the files cannot be read or run.
    """
    entry = job.entry
    is_file = entry.scenario.lower().endswith(".xosc")
    trigger = job.options.empty_trigger if is_file else None
    scenario = driven_by(load(entry.scenario, entry.distribution, trigger), job.options.others)
    spec = chosen_objective(scenario.objective, job.options, "one")
    scenario = as_judged(replace(scenario, objective=spec), spec.rule)
    options = replace(job.options, ego=job.ego)
    pipeline = Pipeline(
        scenario, scenario.space(), options, simulator=job.simulator, workers=Threads(1)
    )
    pipeline.choose_objective()
    return pipeline


def rows_of_job(job: Job, pipeline: Pipeline) -> np.ndarray:
    """Return the rows of an entry, ``(N, len(pipeline.space.names))``."""
    return rows_of(pipeline.scenario, pipeline.space, job.samples, job.seed)[0]


def _evaluated(job: Job, found: EntryResult) -> EntryResult:
    pipeline = pipeline_of(job)
    space = pipeline.space
    X, excluded = rows_of(pipeline.scenario, space, job.samples, job.seed)
    notes = [*pipeline.scenario.notes, *pipeline.notes]
    if excluded:
        notes.append(f"{excluded} combinations are excluded by the scenario's own constraints")
    names = [name for name in space.names if name in {*space.variables, *space.derived}]
    rows: list[RowResult] = []
    for start in range(0, len(X), AT_ONCE):
        some = X[start : start + AT_ONCE]
        evaluation = pipeline.evaluate(some)
        found_here = _rows(pipeline, some, evaluation, names)
        rows += judged(pipeline, job.simulator, some, found_here)
    units = dict(zip(space.names, space.units, strict=True))
    return found.model_copy(
        update={
            "driver": pipeline.driver.label,
            "title": pipeline.scenario.title,
            "parameters": names,
            "units": [units[name] for name in names],
            "criteria": [one.to_dict() for one in pipeline.monitor],
            "clauses": [one.to_dict() for one in pipeline.scenario.clauses],
            "rows": rows,
            "notes": notes,
        }
    )


def _rows(
    pipeline: Pipeline, X: np.ndarray, evaluation: Evaluation, names: Sequence[str]
) -> list[RowResult]:
    space = pipeline.space
    columns = [space.index(name) for name in names]
    parameters: list[Parameter | None] = [space.parameters.get(name) for name in names]
    scenario = pipeline.scenario
    of_file = scenario.texts if isinstance(scenario, FileScenario) else {}
    metrics = {name: evaluation.metrics[:, pipeline.metrics.index(name)] for name in QUANTITIES}
    margins = [evaluation.metrics[:, pipeline.metrics.index(one)] for one in pipeline.monitor.names]
    rows = []
    for i in range(len(X)):
        x: list[float | str] = []
        for name, column, one in zip(names, columns, parameters, strict=True):
            value = float(X[i, column])
            if name in of_file:  # of a set of values, too, which has no parameter of its own
                x.append(of_file[name][round(value)])
                continue
            written = value if one is None else one.kind.written(value)
            x.append(written if isinstance(written, str) else float(written))
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
                conflict=texts["conflict"],
                conflict_type=texts["conflict_type"],
                responsible=texts["responsible"],
                partner=texts["partner"],
                implausible=texts["implausible"],
                margins=[float(one[i]) for one in margins],
            )
        )
    return rows
