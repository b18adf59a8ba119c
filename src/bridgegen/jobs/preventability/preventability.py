"""Makes a map: the drivers and the models in every cell that needs them, chunk by chunk."""

import shlex
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, field
from importlib.metadata import version
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen import drivers as egos
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, Interrupted
from bridgegen.engine.options import PipelineOptions, checked
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import CarriedDriver, Lost, Workers, open_workers
from bridgegen.jobs.preventability import arithmetic
from bridgegen.jobs.preventability.classes import Codes, Outcome, outcomes
from bridgegen.jobs.preventability.grid import Grid, GridAxis, grid_of
from bridgegen.jobs.preventability.result import ChunkStore, PreventabilityMap, simulated
from bridgegen.jobs.search.scenarios import driven_by, is_file, load
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.simulation import vehicles

MODELS = ("un-r157", "fsm")
"""The models of UN R157, annex 3: a collision that one of them avoids is preventable."""


@dataclass(frozen=True)
class MapCallbacks:
    """Called as a map progresses.

    Attributes:
        compile: before kernels are compiled.
        cells: with the number of cells that are done, and of all.
    """

    compile: Callable[[], None] = field(default=lambda: None)
    cells: Callable[[int, int], None] = field(default=lambda done, total: None)


@checked
def map_preventability(
    scenario: str | Path,
    ego: str | Sequence[str],
    *,
    grid: Mapping[str, GridAxis] | Sequence[str] | None = None,
    models: Sequence[str] = MODELS,
    fixed: Mapping[str, float | str] | None = None,
    vehicle: str | None = None,
    others: str | None = None,
    workers: int | str | Workers | None = None,
    out: Path | str | None = None,
    callbacks: MapCallbacks | None = None,
) -> PreventabilityMap:
    """Simulate a driver in every cell of a grid, and the models wherever it collides.

    Called again with the same arguments after it was stopped, it resumes. Results depend neither
    on that nor on the workers.

    Args:
        scenario: a name of the catalogue or of a pack, or the path of a file.
        ego: the drivers under test, by name; one, or several to compare. Beside drivers,
            `arithmetic.NAMES`: models as the regulation computes them.
        grid: the axes, by the names of parameters: the pictures' X axis, Y axis, then what the
            pictures differ in; or texts ``NAME=LOW:HIGH:N``. By default that of the scenario.
        models: the drivers that decide whether a collision is preventable.
        fixed: other parameters to hold at a value; at their defaults otherwise.
        vehicle: how the egos move, those of the models too; see `bridgegen.simulation.vehicles`.
        others: driver of the other participants: "attentive", "insistent" or "scripted"; the
            scenario's choice by default.
        workers: a number of processes, ``"ray"``, ``"ray://HOST:PORT"``, or open workers; threads
            by default.
        out: the map's folder; ``preventability/SCENARIO`` by default.
        callbacks: called as it progresses.

    Raises:
        InputError: an invalid argument or file.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    say = callbacks or MapCallbacks()
    drivers = _distinct([ego] if isinstance(ego, str) else ego, "driver")
    judges = _distinct(models, "model")
    for name in (*drivers, *judges):
        if name not in arithmetic.NAMES:
            egos.get(name)
    if vehicle is not None:
        vehicles.require(vehicle)
    logical = driven_by(load(scenario), others)
    if any(name in arithmetic.NAMES for name in (*drivers, *judges)):
        arithmetic.require(logical.name)
    space = logical.space(fixed=dict(fixed or {}))
    cells = grid_of(logical.name, space, grid)
    if twice := [name for name in cells.names if name in space.fixed]:
        raise InputError(f"an axis of the grid cannot be held at a value: {', '.join(twice)}")
    folder = Path("preventability", logical.name) if out is None else Path(out)
    names = simulated(drivers, judges)
    settings = {
        "version": version("bridgegen"),
        "scenario": logical.name,
        "fingerprint": logical.fingerprint,
        "grid": cells.to_dict(),
        "fixed": space.fixed,
        "drivers": list(drivers),
        "models": list(judges),
        **({"vehicle": vehicle} if vehicle else {}),
        "files of drivers": {name: digest_of(name) for name in names},
    }
    command = _command(scenario, drivers, judges, cells, fixed or {}, vehicle, others, folder)
    store = ChunkStore(folder, settings, len(names), cells.cells)
    found = np.empty((len(names), cells.cells), np.int8)
    done = 0
    try:
        with open_workers(workers) as hands:
            run = _Run(logical, cells, drivers, judges, vehicle, hands, say)
            for i in range(store.count):
                start, stop = store.bounds(i)
                part = store.read(i)
                if part is None:
                    part = run.chunk(start, stop)
                    store.write(i, part)
                found[:, start:stop] = part
                done = stop
                say.cells(done, cells.cells)
    except KeyboardInterrupt:
        raise Interrupted(folder, done, cells.cells, what="cells", command=command) from None
    shaped = found.reshape(len(names), *cells.shape)
    result = PreventabilityMap(logical, cells, drivers, judges, shaped, command, folder)
    result.write()
    return result


class _Run:
    """Simulates chunks; each driver's pipeline is made when it first drives."""

    def __init__(
        self,
        scenario: SearchedScenario,
        grid: Grid,
        drivers: Sequence[str],
        models: Sequence[str],
        vehicle: str | None,
        workers: Workers,
        say: MapCallbacks,
    ) -> None:
        self._scenario, self._grid, self._workers, self._say = scenario, grid, workers, say
        self._vehicle = vehicle
        self._drivers, self._names = drivers, simulated(drivers, models)
        # Those that are drivers, too, have driven everywhere already.
        self._models = sorted(models, key=lambda name: name not in drivers)
        self._pipelines: dict[str, Pipeline] = {}

    def chunk(self, start: int, stop: int) -> Codes:
        """Return the outcomes of consecutive cells, ``(D, n)``."""
        X, ok = self._grid.rows(start, stop)
        found = np.full((len(self._names), stop - start), Outcome.NOT_NEEDED, np.int8)
        found[:, ~ok] = Outcome.NOT_APPLICABLE
        n = len(self._drivers)
        for d, name in enumerate(self._drivers):
            found[d, ok] = self._outcomes(name, X[ok])
        open_: Bool = ok & (found[:n] == Outcome.COLLIDED).any(axis=0)
        for name in self._models:
            m = self._names.index(name)
            if name not in self._drivers:
                found[m, open_] = self._outcomes(name, X[open_])
            open_ &= found[m] != Outcome.AVOIDED
        return found

    def _outcomes(self, name: str, X: Float) -> Codes:
        if not len(X):
            return np.empty(0, np.int8)
        if name in arithmetic.NAMES:
            return arithmetic.outcomes(name, self._scenario.name, self._grid.space, X)
        if name not in self._pipelines:
            self._say.compile()
            options = PipelineOptions(ego=name, vehicle=self._vehicle)
            made = Pipeline(self._scenario, self._grid.space, options, workers=self._workers)
            made.warm_up()
            self._pipelines[name] = made
        parts = []
        for part in self._workers.map(self._pipelines[name], outcomes, X):
            if isinstance(part.result, Lost):
                parts.append(np.full(part.rows, Outcome.FAILED, np.int8))
            else:
                parts.append(part.result)
        return np.concatenate(parts)


def _distinct(names: Iterable[str], what: str) -> tuple[str, ...]:
    """Return names, of which there is one and none is there twice.

    Raises:
        InputError: otherwise.
    """
    found = tuple(names)
    if not found:
        raise InputError(f"a map needs a {what} at least")
    if twice := sorted({name for name in found if found.count(name) > 1}):
        raise InputError(f"each {what} is named once, got twice: {', '.join(twice)}")
    return found


def digest_of(name: str) -> str | None:
    """Return a digest of the file of a user's driver; None where it has none."""
    return CarriedDriver.of(name).digest


def _command(
    scenario: str | Path,
    drivers: Sequence[str],
    models: Sequence[str],
    grid: Grid,
    fixed: Mapping[str, float | str],
    vehicle: str | None,
    others: str | None,
    folder: Path,
) -> str:
    """Return the command line that makes the map again."""
    where = str(Path(scenario).resolve()) if is_file(scenario) else str(scenario)
    words: list[Any] = ["bridgegen", "preventability", where, "--ego", ",".join(drivers)]
    for name, values in zip(grid.names, grid.values, strict=True):
        words += ["--grid", f"{name}={values[0]:.17g}:{values[-1]:.17g}:{len(values)}"]
    if tuple(models) != MODELS:
        words += ["--models", ",".join(models)]
    for name, value in fixed.items():
        words += ["--fix", f"{name}={value}"]
    if vehicle is not None:
        words += ["--vehicle", vehicle]
    if others is not None:
        words += ["--others", others]
    return shlex.join([*words, "--out", str(folder)])
