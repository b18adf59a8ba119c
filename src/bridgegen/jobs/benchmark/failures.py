"""The rows of a run that are failures of its ego, and whether a careful driver avoids them."""

from dataclasses import dataclass
from pathlib import Path
from typing import Annotated

import numpy as np
from pydantic import BaseModel, ConfigDict, Field

from bridgegen.assess.objective import Objective
from bridgegen.base.arrays import Bool, Int
from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.base.records import read_model
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Threads
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.run import Run
from bridgegen.results.store.rows import Rows
from bridgegen.search.triage.triage import harmful_rows

CAREFUL = ("un-r157", "careful")
"""The careful drivers that drive the rows of a failure again: that of UN R157, which reacts to what
its three disturbances say, and the same extended to any road."""

RESPONSIBLE = frozenset({"ego", "shared"})
"""Labels of who is responsible where the ego is."""

JSON_FILE = "careful.json"
"""In a run's folder: a `Judgement`."""

Count = Annotated[int, Field(ge=0, le=10**8)]


class Judgement(BaseModel):
    """Which failures of a run a careful driver avoids.

    Attributes:
        results: digest of the run's evaluations.
        failures: rows in which the ego fails and is responsible.
        avoided: by driver, in how many of them it does not.
        notes: why a scenario's script could not be written, by the scenario's name.
    """

    model_config = ConfigDict(frozen=True, extra="forbid")

    results: str
    failures: Count
    avoided: dict[str, Count]
    notes: dict[str, str] = {}


@dataclass(frozen=True)
class Failures:
    """The failures of a run.

    Attributes:
        rows: ``(K,)`` positions of the harmful rows for which the ego is responsible.
        ways: of each, what distinguishes ways of failing that a store knows: conflict, type and
            the other participant.
        severity: ``(K,)`` float64, probability of MAIS3+.
        others: number of further harmful rows: preventable, but others are responsible.
    """

    rows: Int
    ways: tuple[tuple[str, ...], ...]
    severity: tuple[float, ...]
    others: int


def failures_of(run: Run, rows: Rows) -> Failures:
    """Return the failures of a run.

    Args:
        run: that has ended.
        rows: all its evaluations.
    """
    harm = Objective.from_dict(run.settings.optimised).harm
    harmful, _ = harmful_rows(rows.metrics, run.metrics, harm, rows.status, rows.findings)
    own: Bool = harmful & np.isin(rows.findings.responsible.astype(str), sorted(RESPONSIBLE))
    at = np.flatnonzero(own)
    found = rows.findings.take(at)
    columns = (found.conflict, found.conflict_type, found.partner)
    severity = rows.metrics[at, run.metrics.index("severity")]
    return Failures(
        at,
        tuple(zip(*(one.tolist() for one in columns), strict=True)),
        tuple(np.nan_to_num(severity).tolist()),
        int(harmful.sum() - own.sum()),
    )


def judge(run: Run, rows: Rows) -> Judgement:
    """Drive the failures of a run again by the careful drivers.

    Raises:
        StorageError: the scenario is not what it was.
    """
    at = failures_of(run, rows).rows
    avoided = dict.fromkeys(CAREFUL, 0)
    if len(at):
        scenario, space, roads = searched(run)
        for name in CAREFUL:
            pipeline = Pipeline(
                scenario, space, PipelineOptions(ego=name), road_map=roads, workers=Threads(1)
            )
            pipeline.choose_objective(Objective.from_dict(run.settings.optimised))
            trials = pipeline.try_all(rows.X[at])
            avoided[name] = int((trials.ok & ~trials.harmful).sum())
    return Judgement(results=rows.digest(), failures=len(at), avoided=avoided)


def write_judgement(folder: Path, judgement: Judgement) -> None:
    """Write a judgement into a run's folder.

    Raises:
        StorageError: it cannot be written.
    """
    write_whole(folder / JSON_FILE, [judgement.model_dump_json(indent=1).encode(), b"\n"])


def read_judgement(folder: Path) -> Judgement | None:
    """Return a run's judgement; None if there is none.

    Raises:
        FileFormatError: it is not one.
        StorageError: it cannot be read.
    """
    return read_model(
        folder / JSON_FILE,
        Judgement,
        lambda path, why: FileFormatError(f"{path}: must be the judgement of a run: {why}"),
    )
