"""Makes a map: the drivers and the models in every cell that needs them, chunk by chunk."""

from collections.abc import Iterable, Sequence
from importlib.metadata import version
from pathlib import Path

import numpy as np

from bridgegen import drivers as egos
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, Interrupted
from bridgegen.drivers.identity import digest_of
from bridgegen.engine.options import PipelineOptions, called_with
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Lost, Workers, open_workers
from bridgegen.jobs.frame import JobCallbacks, command_of
from bridgegen.jobs.preventability import arithmetic
from bridgegen.jobs.preventability.classes import Codes, Outcome, outcomes
from bridgegen.jobs.preventability.grid import Grid, grid_of
from bridgegen.jobs.preventability.options import MapOptions
from bridgegen.jobs.preventability.pictures import cell_pictures
from bridgegen.jobs.preventability.result import ChunkStore, PreventabilityMap, simulated
from bridgegen.jobs.search.scenarios import driven_by, load, within
from bridgegen.scenario.language.scenario import SearchedScenario
from bridgegen.simulation import vehicles


@called_with(MapOptions)
def map_preventability(given: MapOptions) -> PreventabilityMap:
    """Simulate a driver in every cell of a grid, and the models wherever it collides.

    Called again with the same arguments after it was stopped, it resumes. Results depend neither
    on that nor on the workers. Beside drivers, ``ego`` and ``models`` may name those of
    `arithmetic.NAMES`: models as the regulation computes them.

    Returns:
        The map; its arrays, figures and page are written.

    Raises:
        InputError: an invalid argument or file.
        StorageError: the folder holds something else, or cannot be written.
        Interrupted: Ctrl-C; what is done is kept.
    """
    drivers, judges = _distinct(given.ego, "driver"), _distinct(given.models, "model")
    vehicle, say = given.vehicle, given.callbacks
    for name in (*drivers, *judges):
        if name not in arithmetic.NAMES:
            egos.get(name)
    if vehicle is not None:
        vehicles.require(vehicle)
    logical = within(driven_by(load(given.scenario), given.others), given.odd)
    if any(name in arithmetic.NAMES for name in (*drivers, *judges)):
        arithmetic.require(logical.name)
    space = logical.space(fixed=dict(given.fixed))
    cells = grid_of(logical.name, space, given.grid)
    if twice := [name for name in cells.names if name in space.fixed]:
        raise InputError(f"an axis of the grid cannot be held at a value: {', '.join(twice)}")
    folder = Path("preventability", logical.name) if given.out is None else Path(given.out)
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
        **({} if logical.odd is None else {"odd": logical.odd.odd.to_record()}),
        # A map may be resumed long after: a driver whose file has changed since would give another
        # map.
        "files of drivers": {name: digest_of(name) or None for name in names},
    }
    axes = [
        # Seventeen digits, so that the command makes the same grid to the last bit.
        f"{name}={values[0]:.17g}:{values[-1]:.17g}:{len(values)}"
        for name, values in zip(cells.names, cells.values, strict=True)
    ]
    command = command_of("preventability", given, folder, grid=axes)
    store = ChunkStore(folder, settings, len(names), cells.cells)
    # A byte for each driver and cell: maps may have 50 million cells.
    found = np.empty((len(names), cells.cells), np.int8)
    done = 0
    try:
        with open_workers(given.workers) as hands:
            run = _Run(logical, cells, drivers, judges, vehicle, hands, say)
            for i in range(store.count):
                start, stop = store.bounds(i)
                part = store.read(i)
                if part is None:
                    part = run.chunk(start, stop)
                    # Kept chunk by chunk: an interruption costs one chunk at most, and no result
                    # depends on it.
                    store.write(i, part)
                found[:, start:stop] = part
                done = stop
                say.progress("cells", done, cells.cells, "")
            shaped = found.reshape(len(names), *cells.shape)
            result = PreventabilityMap(logical, cells, drivers, judges, shaped, command, folder)
            pictures = [*cell_pictures(result, run.pipeline)]
    except KeyboardInterrupt:
        raise Interrupted(folder, done, cells.cells, what="cells", command=command) from None
    result.write(pictures)
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
        say: JobCallbacks,
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
            # A model is asked only where the drivers collide and no earlier model has avoided it.
            open_ &= found[m] != Outcome.AVOIDED
        return found

    def pipeline(self, name: str) -> Pipeline | None:
        """Return a driver's pipeline; None of one that is arithmetic and has no motion."""
        if name not in self._pipelines and name not in arithmetic.NAMES:
            self._say.compile()
            options = PipelineOptions(ego=name, vehicle=self._vehicle)
            made = Pipeline(self._scenario, self._grid.space, options, workers=self._workers)
            made.warm_up()
            self._pipelines[name] = made
        return self._pipelines.get(name)

    def _outcomes(self, name: str, X: Float) -> Codes:
        if not len(X):
            return np.empty(0, np.int8)
        if name in arithmetic.NAMES:
            return arithmetic.outcomes(name, self._scenario.name, self._grid.space, X)
        made = self.pipeline(name)
        assert made is not None
        parts = []
        for part in self._workers.map(made, outcomes, X):
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
