"""A campaign from start to finish: search, triage, export, report; and resuming one."""

import hashlib
import itertools
import os
import re
from collections.abc import Callable, Sequence
from contextlib import nullcontext
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np

from bridgegen.assess.metrics import about
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import (
    BridgeGenError,
    InputError,
    Interrupted,
    StorageError,
    WorkersError,
)
from bridgegen.base.plugins import file_of, is_own
from bridgegen.drivers import STORYBOARD
from bridgegen.drivers.identity import digest_of
from bridgegen.engine.domain import outside
from bridgegen.engine.options import SearchOptions, called_with, checked, range_problems
from bridgegen.engine.pipeline import Pipeline
from bridgegen.engine.workers import Choice, Workers, open_workers
from bridgegen.jobs.search.critical import export_critical, most_critical
from bridgegen.jobs.search.exportable import require_exportable
from bridgegen.jobs.search.loop import Progress, Reason, run_loop
from bridgegen.jobs.search.report import write_run_report
from bridgegen.jobs.search.restored import check_named, pipeline_of, placed
from bridgegen.jobs.search.run import Run
from bridgegen.jobs.search.scenarios import (
    as_judged,
    chosen_objective,
    columns_of,
    driven_by,
    is_file,
    load,
    refuse_standstill,
    within,
)
from bridgegen.jobs.search.screening import require_screen, screen_batch, screen_budget
from bridgegen.jobs.search.searcher import (
    FailingDriver,
    Suffices,
    drawn_of,
    require_asynchronous,
    searcher_of,
)
from bridgegen.jobs.search.settings import Settings
from bridgegen.openx.opendrive.road_map import RoadMap
from bridgegen.openx.opendrive.site_adapted import adapted
from bridgegen.openx.opendrive.site_fit import ALL
from bridgegen.pages.data import WHOLE
from bridgegen.results.store import Recorded, Store, refuse_used
from bridgegen.results.validated import extrapolated, regions_beside
from bridgegen.scenario.language.adversary import adversarial
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.search import algorithms as toolkit
from bridgegen.search.algorithms.algorithm import Problem, resolve
from bridgegen.search.algorithms.automatic import AUTO, RATE, automatic
from bridgegen.search.algorithms.rate import Rate
from bridgegen.search.triage.effort import effort
from bridgegen.search.triage.fresh import failing_draws
from bridgegen.search.triage.record import JSON_FILE, Repeated, read_record, write_record
from bridgegen.search.triage.triage import triage
from bridgegen.simulation.choice import SimulatorChoice


@dataclass(frozen=True)
class SearchCallbacks:
    """Called as a campaign progresses, all from the same thread.

    Attributes:
        stage: with the stage that begins: "compile", "search", "triage", "export", "report".
        workers: with the workers, before they evaluate anything.
        batch: with the progress, after each batch.
        exported: with the number of scenarios exported so far.
        warning: with what the user should know about the search that begins.
    """

    stage: Callable[[str], None] = lambda stage: None
    workers: Callable[[Workers], None] = lambda workers: None
    batch: Callable[[Progress], None] = lambda progress: None
    exported: Callable[[int], None] = lambda count: None
    warning: Callable[[str], None] = lambda text: None


@dataclass(frozen=True, kw_only=True)
class SearchArguments(SearchOptions):
    """The arguments of ``run_search``: a run's options, and what no result depends on."""

    scenario: str | Path = field(
        kw_only=False,
        metadata={"help": "Name in the catalogue, or path of a YAML file or an OpenSCENARIO file."},
    )
    out: Path | str | None = field(
        default=None,
        metadata={"help": "Folder of the run, new; runs/SCENARIO-DRIVER by default, or -2, -3 …."},
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
    callbacks: SearchCallbacks | None = field(
        default=None, metadata={"help": "Called as the search progresses."}
    )


@called_with(SearchArguments)
def run_search(given: SearchArguments) -> Run:
    """Search a logical scenario for its critical concrete ones, and export them.

    Returns:
        The finished run.

    Raises:
        InputError: arguments or files that break a rule; or a scenario at the defaults
            or the corners of the ranges that could not be exported.
        StorageError: the folder exists or cannot be written.
        WorkersError: there are no workers, or they are lost; ``resume`` continues.
        Interrupted: Ctrl-C; likewise.
    """
    callbacks = given.callbacks or SearchCallbacks()
    catalogue = driven_by(
        load(given.scenario, given.distribution, given.empty_trigger), given.others
    )
    catalogue = within(catalogue, given.odd, given.road_map)
    budget = catalogue.budget if given.budget is None else given.budget
    seed = catalogue.seed if given.seed is None else given.seed
    if problems := range_problems(replace(given, budget=budget, seed=seed)):
        raise InputError(*problems)
    effort(given.triage)
    # Before anything else depends on it: the run records the algorithm that `auto` stands for.
    given = _with_algorithm(given, catalogue, budget)
    require_screen(given, budget)
    method = toolkit.get(given.algorithm)
    require_asynchronous(given, method)
    columns = columns_of(method, given.objectives)
    spec = chosen_objective(catalogue.objective, given, columns)
    logical = as_judged(replace(catalogue, objective=spec), spec.gated)
    judged = logical
    logical, roads = placed(logical, given.road_map, given.junction)
    if roads is not None and isinstance(judged, LogicalScenario):
        sites = roads.sites or (roads.site,)
        changes = [note for site in sites for note in adapted(judged, roads.model, site)[1]]
        if roads.sites and changes:
            changes = [
                f"{len(changes)} lanes or routes are adapted to the map; the first: {changes[0]}"
            ]
        for note in (*roads.warnings, *dict.fromkeys(changes)):
            callbacks.warning(note)
    driven: str | None = None
    if given.adversary is not None or getattr(method, "is_adversary", False):
        logical = adversarial(logical, given.adversary)
        driven = logical.adversary.participant if logical.adversary else None
    space = logical.space(given.axes, given.fixed)
    if roads is not None and roads.sites and Axis.STATIC not in space.axes:
        raise InputError("--place all searches the axis static: name it in --axes, too")
    if space.n_var == 0:
        refuse_standstill(logical)
    n_obj = 1 if columns == "one" else len(spec.terms)
    values = resolve(method, Problem(space.variables, n_obj=n_obj), seed, given.settings)
    population, own_budget = values.get("population"), screen_budget(given, budget)
    rows = budget if own_budget is None else own_budget
    if isinstance(population, int) and population > rows:
        callbacks.warning(
            f"population {population} is greater than the budget, {rows} evaluations: the search "
            "ends within its first, random batch"
        )
    driver = given.ego or logical.driver or STORYBOARD.name
    folder = Path(given.out) if given.out is not None else _new_folder(logical.name, driver)
    refuse_used(folder)
    if given.cause is not None and not given.causes:
        raise InputError(f"to search for the cause '{given.cause}', causes must be sought")
    with open_workers(given.workers) as pool:
        callbacks.workers(pool)
        pipeline = Pipeline(
            logical, space, given, road_map=roads, simulator=given.simulator, workers=pool
        )
        for note in (*logical.notes, *pipeline.runner.notes):
            callbacks.warning(note)
        if domain := outside(pipeline.runner):
            callbacks.warning(domain)
        callbacks.stage("compile")
        pipeline.warm_up()
        # What the ontology says of lanes and participants is checked before the budget is spent: an
        # export that SHACL refuses once came after it.
        require_exportable(pipeline)
        chosen = pipeline.choose_objective(objectives=columns, seed=seed)
        made_with = Settings.of(
            given,
            scenario=_absolute(given.scenario) if is_file(given.scenario) else str(given.scenario),
            distribution=_absolute(given.distribution),
            exposure=_absolute(given.exposure) if is_file(given.exposure or "") else given.exposure,
            fingerprint=catalogue.fingerprint,
            algorithm=given.algorithm,
            settings=values,
            budget=budget,
            screen_budget=own_budget,
            screen_batch=screen_batch(given),
            seed=seed,
            ego=pipeline.driver.name,
            driver_digest=digest_of(pipeline.driver.name),
            ideal=sorted(pipeline.driver.ideal),
            vehicle=pipeline.runner.vehicle,
            axes=[str(axis) for axis in space.axes],
            road_map=_absolute(roads.path) if roads else None,
            map_digest=hashlib.sha256(roads.data).hexdigest() if roads else None,
            junction=_junction(given, roads),
            adversary=driven,
            optimised=chosen.to_dict(),
            criteria=[criterion.to_dict() for criterion in pipeline.monitor],
            own_metrics=[about(name) for name in given.metrics if is_own(name)],
        )
        # Before the folder is made, so that a refused call leaves none.
        searcher = searcher_of(pipeline, made_with, callbacks.warning)  # it may refuse
        with Store.create(
            folder,
            made_with.to_dict(),
            space.names,
            pipeline.metrics,
            n_var=space.n_var,
            n_obj=chosen.n_obj,
            labels=space.labels,
            domain=domain,
        ) as store:
            return _go(pipeline, searcher, store, made_with, callbacks, given.deliver)


@checked
def resume(
    folder: Path | str,
    *,
    ego: str | None = None,
    worse_than: str | None = None,
    algorithm: str | None = None,
    metrics: Sequence[str] | None = None,
    simulator: SimulatorChoice | None = None,
    deliver: bool = True,
    workers: Choice = None,
    callbacks: SearchCallbacks | None = None,
) -> Run:
    """Resume a run that was interrupted or killed; a finished one gets its files again.

    The result is that of an undisturbed run, to the last bit.

    Args:
        folder: of the run.
        ego: where a driver of your own drives, that same driver: code that a folder names is never
            imported unasked.
        worse_than: likewise, the driver that the ego's is compared with.
        algorithm: likewise, an algorithm of your own.
        metrics: likewise, those of your own.
        simulator: the run's, or its screen, with its place on this machine; as recorded by
            default.
        deliver: as for ``run_search``.
        workers: likewise.
        callbacks: called as it progresses.

    Raises:
        StorageError: not a run, in use, made by another version, or not writable.
        InputError: the scenario or the map is missing, or not what it was.
        WorkersError: there are no workers, or they are lost.
        Interrupted: Ctrl-C.
    """
    callbacks = callbacks or SearchCallbacks()
    with Store.open(folder, write=True) as store, open_workers(workers) as pool:
        callbacks.workers(pool)
        run = Run.of(store)
        # Code that a run's folder names is never imported unasked: a user's driver or algorithm has
        # to be named again.
        check_named(run.settings.algorithm, algorithm, "algorithm", run.folder, "resume")
        require_asynchronous(run.settings, toolkit.get(run.settings.algorithm))
        pipeline = pipeline_of(
            run,
            "resume",
            ego=ego,
            worse_than=worse_than,
            metrics=metrics or (),
            compares=True,
            causes=True,
            simulator=simulator,
            workers=pool,
        )
        for known in run.settings.own_metrics:
            if known["sha256"] != about(str(known["code"]))["sha256"]:
                callbacks.warning(
                    f"{file_of(str(known['code']))} has changed since the run began: evaluations "
                    f"from here on have another '{known['name']}' than those before"
                )
        callbacks.stage("compile")
        pipeline.warm_up()
        settings = run.settings
        screen = settings.screen
        if simulator is not None and screen is not None and simulator.name == screen.name:
            settings = replace(settings, screen=replace(screen, access=simulator.access))
        searcher = searcher_of(pipeline, settings, callbacks.warning)
        return _go(pipeline, searcher, store, run.settings, callbacks, deliver)


def _go(
    pipeline: Pipeline,
    algorithm: toolkit.Algorithm,
    store: Store,
    settings: Settings,
    callbacks: SearchCallbacks,
    deliver: bool,
) -> Run:
    """Search up to the budget; then export and report, if ``deliver``."""
    callbacks.stage("search")
    watching = [callbacks.batch]
    if pipeline.driver.is_own:
        failing = FailingDriver(store, pipeline.driver.name, settings.budget)
        watching.append(failing.after_batch)
    enough = None
    if isinstance(algorithm, Rate):
        enough = Suffices(algorithm, pipeline.runner.kinds)
        watching.append(enough.after_batch)

    def on_batch(progress: Progress) -> None:
        for watch in watching:
            watch(progress)

    try:
        evaluating = pipeline.stream() if settings.ahead else nullcontext(pipeline.evaluate)
        with evaluating as evaluate:
            result = run_loop(
                algorithm,
                pipeline.space.decode,
                evaluate,
                store,
                settings.budget,
                on_batch,
                ahead=settings.ahead or 0,
                enough=enough,
            )
    except WorkersError as error:
        raise _workers_lost(error, store) from error
    # A folder that was removed meanwhile: SQLite goes on in a file without a name.
    store.require_there()
    if result.reason is Reason.INTERRUPTED:
        raise Interrupted(store.folder, result.evaluations, settings.budget)
    if not deliver:
        return Run.of(store)
    try:
        return _finish(pipeline, algorithm, store, settings, callbacks)
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


def _workers_lost(error: WorkersError, store: Store) -> WorkersError:
    store.require_there()
    problem = f"{error}; {len(store)} evaluations are kept"
    return WorkersError(f"{problem}, resume with 'bridgegen resume {store.folder}'")


def _finish(
    pipeline: Pipeline,
    algorithm: toolkit.Algorithm,
    store: Store,
    settings: Settings,
    callbacks: SearchCallbacks,
) -> Run:
    """Triage the results, export the most critical scenarios, and write the report."""
    callbacks.stage("triage")
    rows, record = Recorded(store, whole=(*WHOLE, *pipeline.monitor.names)), None
    best, rule = np.zeros(0, dtype=np.int64), pipeline.objective.rule
    records_harm = pipeline.objective.harm in pipeline.metrics  # not in runs of earlier versions
    if rule == "criteria" or not records_harm:
        best = _critical_by_objective(rows, settings.keep)
    repeats = settings.repeats or 1
    if repeats > 1 and pipeline.repeats:
        name, repeats = pipeline.driver.label, 1
        callbacks.warning(f"--repeats: {name} always repeats here, so nothing is evaluated again")
    if records_harm:
        triaged = triage(
            pipeline,
            rows,
            algorithm=settings.algorithm,
            seed=settings.seed,
            keep=settings.keep,
            chosen=best.tolist() if rule == "criteria" else None,
            effort=effort(settings.triage),
            domain=store.domain,
            drawn=drawn_of(algorithm, pipeline, settings, store) if settings.rate else None,
            repeats=repeats,
            known=_known_repeats(store, rows) if repeats > 1 else (),
        )
        if rule != "criteria":
            best = np.array(triaged.exports, dtype=np.int64)
        found, said = _extrapolated(pipeline, rows.X[best], store.folder, settings, callbacks)
        beyond = tuple(best[found].tolist())
        record = triaged.record.model_copy(update={"beyond": beyond, "extrapolated": said})
        write_record(store.folder, record)
    callbacks.stage("export")
    chosen = rows.take(best)
    # One simulation, for the files and the playback.
    # Files and page took one simulation each before.
    replays = pipeline.replays(chosen.X) if len(best) else None
    drawn = failing_draws(pipeline.space, record, settings.keep)
    exported = export_critical(
        pipeline, chosen, replays, store.folder, callbacks.exported, record, drawn
    )
    callbacks.stage("report")
    run = Run.of(store, rows)
    there = np.flatnonzero(np.isin(best, [item.evaluation for item in exported]))
    write_run_report(pipeline, run, rows, exported, replays.take(there) if replays else None)
    return run


def _known_repeats(store: Store, rows: Recorded) -> tuple[Repeated, ...]:
    """Return the repeats that an earlier triage of these rows has recorded."""
    try:
        record = read_record(store.folder / JSON_FILE, rows.digest())
    except BridgeGenError:  # damaged, or of fewer rows: it is written anew
        record = None
    return record.repeated if record else ()


def _extrapolated(
    pipeline: Pipeline, X: Float, folder: Path, settings: Settings, callbacks: SearchCallbacks
) -> tuple[Int, str]:
    """Return which findings lie outside the region that a dossier beside the run calls validated.

    A dossier that is damaged is a warning: what was searched does not depend on it.
    """
    try:
        regions = regions_beside(folder)
    except BridgeGenError as error:
        callbacks.warning("; ".join(error.problems))
        regions = []
    of = settings.fingerprint, str(settings.vehicle), pipeline.space.names
    return extrapolated(regions, *of, X)


def _critical_by_objective(rows: Recorded, keep: int) -> Int:
    """Return distinct critical rows in the objective's order, ``keep`` at most."""
    at = np.flatnonzero(rows.critical)
    found: Int = at[most_critical(rows.U[at], rows.F[at], rows.critical[at], keep)]
    return found


def _with_algorithm(
    given: SearchArguments, scenario: SearchedScenario, budget: int
) -> SearchArguments:
    """Return options that name the algorithm; where they say `AUTO`, the one that it is."""
    if given.rate or given.exposure is not None:
        if given.algorithm not in (AUTO, RATE):
            raise InputError(
                f"--rate estimates by rows that the algorithm {RATE} draws, got {given.algorithm} "
                "(--algorithm)"
            )
        given = replace(given, algorithm=RATE)
    if given.algorithm == RATE:
        return replace(given, rate=True)
    if given.algorithm != AUTO:
        return given
    name = automatic(
        screen_budget(given, budget) or budget,
        scenario.space(given.axes, given.fixed).n_var,
        many=given.objectives == "many",
        closed_loop=given.adversary is not None,
    )
    return replace(given, algorithm=name)


def _junction(given: SearchArguments, roads: RoadMap | None) -> str | None:
    """Return what to take the same junction by again."""
    if roads is None or given.junction == ALL:
        return given.junction
    return roads.site.place_id


def _new_folder(scenario: str, driver: str) -> Path:
    """Return a folder of that scenario and driver in ``runs`` that does not exist yet."""
    name = f"{scenario}-{folder_word(driver)}"
    numbers = itertools.chain([""], (f"-{n}" for n in itertools.count(2)))
    return next(path for n in numbers if not os.path.lexists(path := Path("runs") / f"{name}{n}"))


def folder_word(driver: str) -> str:
    """Return what a driver is called in the name of a folder."""
    short = driver.rpartition(":")[2] if ":" in driver else Path(driver).stem
    return re.sub(r"[^\w-]+", "-", short)[:40]


def _absolute(path: Path | str | None) -> str | None:
    return None if path is None else str(Path(path).resolve())
