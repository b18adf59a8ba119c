"""A campaign from start to finish: search, hand over, report; and going on with one."""

import hashlib
from collections.abc import Callable
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bridgegen import search as toolkit
from bridgegen.campaign.beforehand import refuse_beforehand
from bridgegen.campaign.chosen import as_judged, chosen_objective, columns_of
from bridgegen.campaign.handover import hand_over, most_critical
from bridgegen.campaign.loop import Progress, Reason, run_loop
from bridgegen.campaign.report import write_run_report
from bridgegen.campaign.restored import pipeline_of, placed
from bridgegen.campaign.run import Run
from bridgegen.campaign.scenarios import driven_by, is_file, load, refuse_standstill
from bridgegen.campaign.settings import Settings
from bridgegen.errors import InputError, Interrupted, StorageError, WorkersError
from bridgegen.odd.adversary import adversarial
from bridgegen.options import SearchOptions, called_with, range_problems
from bridgegen.pipeline import Pipeline
from bridgegen.report.data import WHOLE
from bridgegen.search.algorithm import Problem, resolve
from bridgegen.simulation.choice import SimulatorChoice
from bridgegen.store import Recorded, Store, refuse_used
from bridgegen.triage.record import write_record
from bridgegen.triage.triage import triage
from bridgegen.workers import Choice, Workers, open_workers


@dataclass(frozen=True)
class Watch:
    """Who wants to know how a campaign is getting on; each is called from the same thread.

    Attributes:
        stage: told what begins: "compile", "search", "triage", "hand over", "report".
        workers: told who evaluates, before anything is.
        batch: told after each batch.
        written: told how many scenarios are handed over.
    """

    stage: Callable[[str], None] = lambda stage: None
    workers: Callable[[Workers], None] = lambda workers: None
    batch: Callable[[Progress], None] = lambda progress: None
    written: Callable[[int], None] = lambda count: None


@dataclass(frozen=True, kw_only=True)
class SearchArguments(SearchOptions):
    """The arguments of ``run_search``: a run's options, and what no result depends on."""

    scenario: str | Path = field(
        kw_only=False,
        metadata={"help": "Name in the catalogue, or path of a YAML file or an OpenSCENARIO file."},
    )
    out: Path | str | None = field(
        default=None,
        metadata={"help": "Folder of the run, new; runs/SCENARIO-ALGORITHM-SEED by default."},
    )
    deliver: bool = field(
        default=True,
        metadata={
            "help": "Whether to write critical scenarios and report; ``resume`` does it later."
        },
    )
    workers: Choice = field(
        default=None,
        metadata={
            "help": 'Number of worker processes, or ``"ray"`` / ``"ray://HOST:PORT"``; threads '
            "of this process by default, one for each core. No result depends on it."
        },
    )
    watch: Watch | None = field(
        default=None, metadata={"help": "Told how the search is getting on."}
    )


@called_with(SearchArguments)
def run_search(given: SearchArguments) -> Run:
    """Search a logical scenario for its critical concrete ones, and export them.

    Returns:
        The finished run.

    Raises:
        InputError: anything that the arguments or files say wrongly; or a scenario at the defaults
            or the corners of the ranges that could not be exported.
        StorageError: the folder exists or cannot be written.
        WorkersError: there are no workers, or they are lost; ``resume`` goes on.
        Interrupted: Ctrl-C; likewise.
    """
    watch = given.watch or Watch()
    catalogue = driven_by(load(given.scenario, given.distribution), given.others)
    budget = catalogue.budget if given.budget is None else given.budget
    seed = catalogue.seed if given.seed is None else given.seed
    if problems := range_problems(replace(given, budget=budget, seed=seed)):
        raise InputError(*problems)
    method = toolkit.get(given.algorithm)
    columns = columns_of(method, given.objectives)
    spec = chosen_objective(catalogue.objective, given, columns)
    logical = as_judged(replace(catalogue, objective=spec), spec.rule)
    logical, roads = placed(logical, given.road_map, given.junction)
    driven: str | None = None
    if given.adversary is not None or getattr(method, "is_adversary", False):
        logical = adversarial(logical, given.adversary)
        driven = logical.adversary.participant if logical.adversary else None
    space = logical.space(given.axes, given.fixed)
    if space.n_var == 0:
        refuse_standstill(logical)
    n_obj = 1 if columns == "one" else len(spec.terms)
    values = resolve(method, Problem(space.variables, n_obj=n_obj), seed, given.settings)
    name = f"{logical.name}-{given.algorithm}-{seed}"
    folder = Path(given.out) if given.out is not None else Path("runs") / name
    refuse_used(folder)
    if given.cause is not None and not given.causes:
        raise InputError(f"to search for the cause '{given.cause}', causes must be sought")
    with open_workers(given.workers) as crew:
        watch.workers(crew)
        pipeline = Pipeline(
            logical, space, given, road_map=roads, simulator=given.simulator, workers=crew
        )
        watch.stage("compile")
        pipeline.warm_up()
        refuse_beforehand(pipeline)
        chosen = pipeline.choose_objective(objectives=columns, seed=seed)
        made_with = Settings.of(
            given,
            scenario=_absolute(given.scenario) if is_file(given.scenario) else str(given.scenario),
            distribution=_absolute(given.distribution),
            fingerprint=catalogue.fingerprint,
            algorithm=method.name,
            settings=values,
            budget=budget,
            seed=seed,
            ego=pipeline.driver.name,
            ideal=sorted(pipeline.driver.ideal),
            axes=[str(axis) for axis in space.axes],
            road_map=_absolute(roads.path) if roads else None,
            map_digest=hashlib.sha256(roads.data).hexdigest() if roads else None,
            junction=roads.site.junction_id if roads else None,
            adversary=driven,
            optimised=chosen.to_dict(),
        )
        searcher = _algorithm(pipeline, made_with)  # before there is a folder: it may refuse
        with Store.create(
            folder, made_with.to_dict(), space.names, pipeline.metrics,
            n_var=space.n_var, n_obj=chosen.n_obj, labels=space.labels,
        ) as store:  # fmt: skip
            return _go(pipeline, searcher, store, made_with, watch, given.deliver)


def resume(
    folder: Path | str,
    *,
    ego: str | None = None,
    simulator: SimulatorChoice | None = None,
    deliver: bool = True,
    workers: Choice = None,
    watch: Watch | None = None,
) -> Run:
    """Go on with a run that was interrupted or killed; a finished one gets its files again.

    The result is that of an undisturbed run, to the last bit.

    Args:
        folder: of the run.
        ego: where a driver of your own drives, that same driver: what a folder names is never
            imported by itself.
        simulator: the run's, with where it is on this machine; the run's by default.
        deliver: as for ``run_search``.
        workers: likewise.
        watch: told how it is getting on.

    Raises:
        StorageError: not a run, in use, made by another version, or not writable.
        InputError: the scenario or the map is missing, or not what it was.
        WorkersError: there are no workers, or they are lost.
        Interrupted: Ctrl-C.
    """
    watch = watch or Watch()
    with Store.open(folder, write=True) as store, open_workers(workers) as crew:
        watch.workers(crew)
        settings = Settings.from_dict(store.settings, store.folder)
        pipeline = pipeline_of(
            settings, store.metrics, store.folder, ego=ego, simulator=simulator, workers=crew
        )
        watch.stage("compile")
        pipeline.warm_up()
        searcher = _algorithm(pipeline, settings)
        return _go(pipeline, searcher, store, settings, watch, deliver)


def _algorithm(pipeline: Pipeline, settings: Settings) -> toolkit.Algorithm:
    """Return the run's search algorithm, as it begins."""
    method = toolkit.get(settings.algorithm)
    arena = pipeline.arena() if getattr(method, "is_adversary", False) else None
    if arena is not None:
        arena.warm_up()
    names, n_obj = pipeline.space.variables, pipeline.objective.n_obj
    problem = Problem(names, pipeline.metrics, n_obj, arena)
    values = resolve(method, problem, settings.seed, settings.settings)
    return method(problem, settings.seed, **values)


def _go(
    pipeline: Pipeline,
    algorithm: toolkit.Algorithm,
    store: Store,
    settings: Settings,
    watch: Watch,
    deliver: bool,
) -> Run:
    """Search up to the budget, then hand over and report if that is wanted."""
    watch.stage("search")
    try:
        result = run_loop(
            algorithm, pipeline.space.decode, pipeline.evaluate, store, settings.budget, watch.batch
        )
    except WorkersError as error:
        raise _workers_lost(error, store) from error
    store.require_there()
    if result.reason is Reason.INTERRUPTED:
        raise Interrupted(store.folder, result.evaluations, settings.budget)
    if not deliver:
        return Run(store.folder)
    try:
        _finish(pipeline, store, settings, watch)
    except KeyboardInterrupt:
        store.require_there()
        raise Interrupted(store.folder, result.evaluations, settings.budget) from None
    except WorkersError as error:
        raise _workers_lost(error, store) from error
    except (OSError, StorageError) as error:
        store.require_there()
        if isinstance(error, StorageError):
            raise
        raise StorageError(
            f"{error.filename or store.folder}: cannot be read or written: {error.strerror}; the "
            f"evaluations are kept, 'bridgegen resume {store.folder}' writes the files"
        ) from None
    return Run(store.folder)


def _workers_lost(error: WorkersError, store: Store) -> WorkersError:
    store.require_there()
    problem = f"{error}; {len(store)} evaluations are kept"
    return WorkersError(f"{problem}, go on with 'bridgegen resume {store.folder}'")


def _finish(pipeline: Pipeline, store: Store, settings: Settings, watch: Watch) -> None:
    watch.stage("triage")
    rows, found = Recorded(store, whole=WHOLE), None
    best = np.zeros(0, dtype=np.int64)
    if pipeline.objective.harm in pipeline.metrics:  # runs of earlier versions did not record it
        triaged = triage(
            pipeline, rows, algorithm=settings.algorithm, seed=settings.seed, keep=settings.keep
        )
        found, best = triaged.record, np.array(triaged.exports, dtype=np.int64)
        write_record(store.folder, found)
    if pipeline.objective.rule == "thresholds" and len(best) < settings.keep:
        # What the paper calls critical is kept besides, in the paper's order.
        at = np.flatnonzero(rows.critical)
        more = at[most_critical(rows.U[at], rows.F[at], rows.critical[at], settings.keep)]
        best = np.concatenate([best, more[~np.isin(more, best)]])[: settings.keep]
    watch.stage("hand over")
    kept = hand_over(pipeline, rows.take(best), store.folder, watch.written, found)
    watch.stage("report")
    write_run_report(pipeline, store, settings, rows, kept)


def _absolute(path: Path | str | None) -> str | None:
    return None if path is None else str(Path(path).resolve())
