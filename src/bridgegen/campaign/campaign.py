"""A campaign from start to finish: search, hand over, report; and going on with one."""

import hashlib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridgegen import search as toolkit
from bridgegen.campaign.beforehand import refuse_beforehand
from bridgegen.campaign.chosen import as_judged, chosen_objective, columns_of, counted
from bridgegen.campaign.handover import hand_over, most_critical
from bridgegen.campaign.loop import Progress, Reason, run_loop
from bridgegen.campaign.report import write_run_report
from bridgegen.campaign.restored import pipeline_of, placed
from bridgegen.campaign.run import Run
from bridgegen.campaign.scenarios import driven_by, is_file, load, refuse_standstill
from bridgegen.campaign.settings import MAX_BUDGET, MAX_KEEP, MAX_SEED, Settings
from bridgegen.cause import Cause
from bridgegen.errors import InputError, Interrupted, StorageError, WorkersError
from bridgegen.odd.adversary import adversarial
from bridgegen.pipeline import Pipeline
from bridgegen.report.data import WHOLE
from bridgegen.search.algorithm import Problem, Value, resolve
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
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


def run_search(
    scenario: str | Path,
    *,
    distribution: Path | str | None = None,
    algorithm: str = "pso",
    settings: Mapping[str, Value] | None = None,
    budget: int | None = None,
    seed: int | None = None,
    ego: str | None = None,
    ideal: Iterable[str] = (),
    time_limit: float | None = None,
    axes: Iterable[str] | None = None,
    fixed: Mapping[str, float | str] | None = None,
    road_map: Path | str | None = None,
    junction: str | None = None,
    keep: int = 10,
    out: Path | str | None = None,
    objective: dict[str, float | None] | None = None,
    weights: str | None = None,
    scale: str | None = None,
    objectives: str | None = None,
    count: str | None = None,
    metrics: Sequence[str] = (),
    causes: bool = True,
    cause: str | None = None,
    adversary: str | None = None,
    others: str | None = None,
    simulator: SimulatorChoice | None = None,
    deliver: bool = True,
    workers: Choice = None,
    watch: Watch | None = None,
) -> Run:
    """Search a logical scenario for its critical concrete ones, and hand them over.

    Args:
        scenario: a name of the catalogue, or the path of a YAML file or of an OpenSCENARIO file.
        distribution: of the parameters of an OpenSCENARIO file, a file itself.
        algorithm: a name of ``bridgegen list algorithms``.
        settings: of the algorithm, where they are not to be its defaults.
        budget: evaluations, exactly; 1000, or what a stochastic distribution says, by default.
        seed: the same seed gives the same result; 0, or what a stochastic distribution says, by
            default.
        ego: a name of the ego's drivers, or a driver of your own: ``package.module:Class``,
            ``file.py:Class`` or ``file.fmu``; the scenario's own choice by default.
        ideal: stages of the driver to be ideal: perception, prediction, control.
        time_limit: [s] that one call of a driver of your own may take; 10 by default.
        axes: the axes of the search space; the scenario's own by default.
        fixed: parameters to hold at a value, by name.
        road_map: an OpenDRIVE map, or the ``.owl`` that it was imported as; by default the
            scenario's own road network is generated.
        junction: the id of the map's junction, where it has several with as many legs.
        keep: how many critical scenarios to hand over.
        out: the run's folder, new; ``runs/SCENARIO-ALGORITHM-SEED`` by default.
        objective: metrics and their weights (None with entropy weights), instead of the
            scenario's; ``{"harm": None}`` or ``{"paper": None}`` for one of these, with its rule
            of what is critical.
        weights: "fixed", or "entropy" of a random sample, instead of the scenario's way.
        scale: "raw", or "standardised" by a random sample, instead of the scenario's.
        objectives: "one", the terms' weighted sum, or "many", one for each term; what the
            algorithm is made for, by default.
        count: whose conflicts count as harm: "ego", those that the ego is responsible for or could
            have prevented (the default), or "any".
        metrics: names of those to record besides the objective's and the paper's.
        causes: whether to find the cause of each critical scenario, by replaying it.
        cause: "perception", "planning", "control" or "unavoidable": a critical scenario of another
            cause does not count.
        adversary: the participant that an adversary drives, see `bridgegen.odd.adversary`; with an
            algorithm that is one, the first vehicle by default.
        others: "attentive" or "scripted": who drives all participants but the ego (and the one
            that an adversary drives); what the scenario says by default.
        simulator: which one runs the scenarios; the embedded one by default.
        deliver: whether to write the critical scenarios and the report; ``resume`` does it later.
        workers: who evaluates: so many processes, or ``"ray"``, ``"ray://HOST:PORT"``; threads of
            this process by default, one for each core. The results do not depend on it.
        watch: told how it is getting on.

    Returns:
        The finished run.

    Raises:
        InputError: anything that the arguments or files say wrongly; or a scenario at the defaults
            or the corners of the ranges that could not be exported.
        StorageError: the folder exists or cannot be written.
        WorkersError: there are no workers, or they are lost; ``resume`` goes on.
        Interrupted: Ctrl-C; likewise.
    """
    watch, simulates = watch or Watch(), simulator or EMBEDDED
    catalogue = driven_by(load(scenario, distribution), others)
    budget = catalogue.budget if budget is None else budget
    seed = catalogue.seed if seed is None else seed
    _check_numbers(budget, seed, keep)
    method = toolkit.get(algorithm)
    columns = columns_of(method, objectives)
    spec = chosen_objective(catalogue.objective, objective, weights, scale, columns, counted(count))
    logical = as_judged(replace(catalogue, objective=spec), spec.rule)
    logical, roads = placed(logical, road_map, junction)
    driven: str | None = None
    if adversary is not None or getattr(method, "is_adversary", False):
        logical = adversarial(logical, adversary)
        driven = logical.adversary.participant if logical.adversary else None
    space = logical.space(axes, fixed)
    if space.n_var == 0:
        refuse_standstill(logical)
    n_obj = 1 if columns == "one" else len(spec.terms)
    values = resolve(method, Problem(space.variables, n_obj=n_obj), seed, settings or {})
    folder = Path(out) if out is not None else Path("runs") / f"{logical.name}-{algorithm}-{seed}"
    refuse_used(folder)
    if cause is not None and not causes:
        raise InputError(f"to search for the cause '{cause}', causes must be sought")
    with open_workers(workers) as crew:
        watch.workers(crew)
        pipeline = Pipeline(
            logical,
            space,
            ego=ego,
            ideal=ideal,
            time_limit=time_limit,
            road_map=roads,
            also=metrics,
            seek_causes=causes,
            cause=None if cause is None else Cause.named(cause),
            simulator=simulates,
            workers=crew,
        )
        watch.stage("compile")
        pipeline.warm_up()
        refuse_beforehand(pipeline)
        chosen = pipeline.choose_objective(objectives=columns, seed=seed)
        made_with = Settings(
            scenario=str(Path(scenario).resolve()) if is_file(scenario) else str(scenario),
            distribution=str(Path(distribution).resolve()) if distribution is not None else None,
            fingerprint=catalogue.fingerprint,
            algorithm=method.name,
            algorithm_settings=values,
            budget=budget,
            seed=seed,
            ego=pipeline.driver.name,
            ideal=tuple(sorted(pipeline.driver.ideal)),
            time_limit=time_limit,
            axes=tuple(str(axis) for axis in space.axes),
            fixed=space.fixed,
            map=str(roads.path.resolve()) if roads else None,
            map_digest=hashlib.sha256(roads.data).hexdigest() if roads else None,
            junction=roads.site.junction_id if roads else None,
            keep=keep,
            causes=causes,
            cause=cause,
            adversary=driven,
            others=others,
            simulator=simulates.name,
            simulator_settings=dict(simulates.settings),
            objective=chosen.to_dict(),
            chosen={
                "objective": objective,
                "weights": weights,
                "scale": scale,
                "objectives": objectives,
                "count": count,
                "metrics": list(metrics),
            },
        )
        searcher = _algorithm(pipeline, made_with)  # before there is a folder: it may refuse
        with Store.create(
            folder, made_with.to_dict(), space.names, pipeline.metrics,
            n_var=space.n_var, n_obj=chosen.n_obj, labels=space.labels,
        ) as store:  # fmt: skip
            return _go(pipeline, searcher, store, made_with, watch, deliver)


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
    values = resolve(method, problem, settings.seed, settings.algorithm_settings)
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


def _check_numbers(budget: int, seed: int, keep: int) -> None:
    problems = [
        f"{low} <= {name} <= {high} must hold, got {value}"
        for name, value, low, high in (
            ("budget", budget, 1, MAX_BUDGET),
            ("seed", seed, 0, MAX_SEED),
            ("keep", keep, 0, MAX_KEEP),
        )
        if not low <= value <= high
    ]
    if problems:
        raise InputError(*problems)
