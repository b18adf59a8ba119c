"""What the tables and figures need of each run: its evaluations, and where they came from."""

from collections.abc import Mapping
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
import numpy.typing as npt

from bridgegen.assess.objective import PAPER_FACTOR, Objective
from bridgegen.base.arrays import Bool, Float
from bridgegen.jobs import search as campaign
from bridgegen.jobs.compare.plan import Cell
from bridgegen.results.store import Store
from bridgegen_reproduction.paper import WEIGHTS
from bridgegen_reproduction.protocol import Part

FITNESS = Objective.build(tuple(WEIGHTS.items()))
"""The paper's, whatever a run minimised: F = −fitness."""


@dataclass(frozen=True)
class Run:
    """A run's n evaluations, in the order in which they were made.

    Attributes:
        folder: of the run, under the reproduction's.
        command: the command line that makes the same run.
        settings: of its algorithm.
        parameters: names of X's columns.
        X: ``(n, len(parameters))`` float64.
        d_min: ``(n,)`` float64 [m], NaN where the simulation failed.
        v_d: ``(n,)`` float64 [km/h], likewise.
        fitness: ``(n,)`` float64, the paper's, likewise; larger is more critical.
        critical: ``(n,)`` bool.
        collision: ``(n,)`` bool, whether the ego collided.
        cause: ``(n,)`` int8, a `bridgegen.assess.cause.Cause` each.
        seconds: [s] of search.
        seconds_at: ``(n,)`` float64 [s], when each was done.
    """

    folder: str
    command: str
    settings: Mapping[str, object]
    parameters: tuple[str, ...]
    X: Float
    d_min: Float
    v_d: Float
    fitness: Float
    critical: Bool
    collision: Bool
    cause: npt.NDArray[np.int8]
    seconds: float
    seconds_at: Float

    @cached_property
    def hits(self) -> npt.NDArray[np.int64]:
        """Evaluations made when each critical scenario was found, ascending from 1."""
        return np.flatnonzero(self.critical) + 1


Runs = Mapping[tuple[str, Cell], Run]
"""By part's name and cell; those that failed are not in it."""


def read_run(folder: Path, name: str, replay: str) -> Run:
    """Read a run that has ended.

    Args:
        folder: of the run.
        name: what the folder is called in files.
        replay: the folder into which its command makes it again.

    Raises:
        StorageError: not a run, or damaged.
    """
    with Store.open(folder) as store:
        settings = campaign.Run.of(store).settings
        rows, names, seconds = store.read(), store.metrics, store.seconds
    column = {metric: rows.metrics[:, names.index(metric)] for metric in (*WEIGHTS, "n_collision")}
    ok = (rows.status == 0) & np.isfinite(column["d_min"]) & np.isfinite(column["v_d"])
    F, _ = FITNESS.F(rows.metrics, names)

    def known(values: Float) -> Float:
        return np.where(ok, values, np.nan)

    return Run(
        folder=name,
        command=settings.command(Path(replay)),
        settings=settings.settings,
        parameters=store.parameters,
        X=rows.X,
        d_min=known(column["d_min"]),
        v_d=known(column["v_d"] * PAPER_FACTOR["v_d"]),
        fitness=known(-F[:, 0]),
        critical=rows.critical,
        collision=ok & (column["n_collision"] > 0),
        cause=rows.cause,
        seconds=seconds,
        seconds_at=rows.seconds,
    )


def of(runs: Runs, part: Part, scenario: str, algorithm: str) -> list[Run]:
    """Return the runs of an algorithm in a scenario, by seed."""
    found = [
        (cell.seed, run)
        for (name, cell), run in runs.items()
        if (name, cell.scenario, cell.algorithm) == (part.name, scenario, algorithm)
    ]
    return [run for _, run in sorted(found, key=lambda pair: pair[0])]
