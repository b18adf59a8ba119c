"""A comparison from start to finish: run what is missing, measure, test, draw, write."""

import os
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from bridgegen.comparison.distinct import APART
from bridgegen.comparison.measures import counts, measure, measures
from bridgegen.comparison.page import write_page
from bridgegen.comparison.plan import Cell, Plan, begin, make_plan
from bridgegen.comparison.record import read, space_of
from bridgegen.comparison.result import Comparison
from bridgegen.comparison.runs import Task, Watcher, evaluations_of
from bridgegen.comparison.table import summarise, write_tables
from bridgegen.comparison.workers import run_all
from bridgegen.errors import Interrupted, StorageError
from bridgegen.odd.space import SearchSpace
from bridgegen.search.algorithm import Value
from bridgegen.store.sqlite import Lock
from bridgegen.workers import read_choice

LOCK = "compare.lock"


@dataclass(frozen=True)
class Watch(Watcher):
    """Who wants to know how a comparison is getting on.

    Attributes:
        begun: told the plan, how many of its runs have ended already, and their evaluations.
        stage: told what begins when the runs are done: "read", "draw".
    """

    begun: Callable[[Plan, int, int], None] = lambda plan, ended, made: None
    stage: Callable[[str], None] = lambda stage: None


def compare(
    scenarios: str | Path | Sequence[str | Path],
    *,
    algorithms: str | Sequence[str] = ("random", "pso"),
    settings: Mapping[str, Mapping[str, Value]] | None = None,
    seeds: int = 10,
    budget: int = 1000,
    baseline: str | None = None,
    apart: float = APART,
    workers: int | str | None = None,
    out: Path | str | None = None,
    distribution: Path | str | None = None,
    ego: str | None = None,
    ideal: Iterable[str] = (),
    time_limit: float | None = None,
    axes: Iterable[str] | None = None,
    fixed: Mapping[str, float | str] | None = None,
    road_map: Path | str | None = None,
    junction: str | None = None,
    objective: Mapping[str, float | None] | None = None,
    weights: str | None = None,
    scale: str | None = None,
    objectives: str | None = None,
    count: str | None = None,
    metrics: Sequence[str] = (),
    causes: bool = False,
    cause: str | None = None,
    adversary: str | None = None,
    others: str | None = None,
    deliver: bool = True,
    watch: Watch | None = None,
) -> Comparison:
    """Run algorithms on scenarios with several seeds, and say which is better at what.

    A grid of runs, each an ordinary run's folder under ``OUT/runs`` (``resume`` hands its critical
    scenarios over); then ``runs.csv``, ``summary.csv``, ``times.csv``, figures and a page. Killed
    at any moment and called again, it goes on; called with more scenarios, algorithms or seeds, it
    makes those runs besides.

    Args:
        scenarios: one or several, each as for ``run_search``.
        algorithms: one or several names of ``bridgegen list algorithms``.
        settings: of algorithms by their names, where they are not to be their defaults.
        seeds: runs of each algorithm in each scenario, with the seeds 0, 1, 2 …
        budget: evaluations of each run.
        baseline: the algorithm that the others are tested against; the first by default.
        apart: critical scenarios are different if their searched parameters differ by this share
            of their ranges, in root mean square.
        workers: so many runs at a time, each in a process and one thread; as many as there are
            cores by default. Or "ray", "ray://HOST:PORT": that many, whose scenarios are simulated
            in a Ray cluster. No result depends on it.
        out: the comparison's folder; ``comparisons/SCENARIOS`` by default.
        distribution: as for ``run_search``, where one scenario file is compared.
        ego: as for ``run_search``, and so on.
        ideal: stages of the driver to be ideal.
        time_limit: [s] that one call of a driver of your own may take.
        axes: the axes of the search space.
        fixed: parameters to hold at a value.
        road_map: a map to search on.
        junction: which junction of the map.
        objective: metrics and their weights.
        weights: "fixed" or "entropy".
        scale: "raw" or "standardised".
        objectives: "one" or "many" with every algorithm; what each is made for, by default.
        count: whose conflicts count as harm, as for ``run_search``.
        metrics: to record besides.
        causes: whether to find the cause of each critical scenario; takes longer.
        cause: the only one that counts.
        adversary: the participant that an adversary drives, with every algorithm.
        others: who drives the other participants.
        deliver: whether to write tables, figures and page; the same call with True does it later.
        watch: told how it is getting on.

    Returns:
        The comparison. A run that failed is a gap in it.

    Raises:
        InputError: anything that the arguments or files say wrongly.
        StorageError: the folder holds something else, is being written, or cannot be.
        Interrupted: Ctrl-C; every run keeps what it has done.
    """
    watch = watch or Watch()
    who = read_choice(workers)
    plan = make_plan(
        [scenarios] if isinstance(scenarios, str | Path) else scenarios,
        [algorithms] if isinstance(algorithms, str) else algorithms,
        settings=settings or {},
        seeds=seeds,
        budget=budget,
        baseline=baseline,
        apart=apart,
        out=None if out is None else Path(out),
        options={
            "distribution": _absolute(distribution),
            "ego": ego,
            "ideal": tuple(ideal),
            "time_limit": time_limit,
            "axes": None if axes is None else tuple(axes),
            "fixed": dict(fixed or {}),
            "road_map": _absolute(road_map),
            "junction": junction,
            "objective": None if objective is None else dict(objective),
            "weights": weights,
            "scale": scale,
            "objectives": objectives,
            "count": count,
            "metrics": tuple(metrics),
            "causes": causes or cause is not None,
            "cause": cause,
            "adversary": adversary,
            **({} if others is None else {"others": others}),
        },
    )
    begin(plan)
    lock = Lock(plan.out / LOCK)
    done: list[str] = []
    try:
        failures = _run(plan, who, watch, done)
        return _conclude(plan, failures, watch, deliver=deliver)
    except KeyboardInterrupt:
        raise Interrupted(
            plan.out, len(done), len(plan.cells), what="runs", command=plan.command()
        ) from None
    finally:
        lock.release()


def _run(plan: Plan, who: int | str | None, watch: Watch, done: list[str]) -> dict[Cell, str]:
    """Make the runs that are missing; return why some failed.

    Args:
        plan: the runs.
        who: makes them, as ``read_choice`` returns it.
        watch: told how it is getting on.
        done: is given the name of each run that has ended, this time or earlier.
    """
    failures, tasks, made = {}, [], 0
    for cell in plan.cells:
        folder = plan.folder(cell)
        try:
            evaluations, is_ended = evaluations_of(folder)
        except StorageError as error:
            failures[cell] = str(error)
            continue
        if is_ended:
            done.append(cell.name)
            made += evaluations
        else:
            tasks.append(Task(cell.name, folder, plan.arguments(cell)))
    watch.begun(plan, len(done), made)

    def ended(name: str, failure: str | None) -> None:
        done.append(name)
        watch.ended(name, failure)

    at_once, cluster = (who, None) if isinstance(who, int) else (_cores(), who)
    failed = run_all(tasks, at_once, Watcher(watch.compile, watch.batch, ended), cluster)
    return failures | {cell: failed[cell.name] for cell in plan.cells if cell.name in failed}


def _conclude(
    plan: Plan, failures: Mapping[Cell, str], watch: Watch, *, deliver: bool
) -> Comparison:
    """Read the runs, measure and test them, and write it all if that is wanted."""
    watch.stage("read")
    gaps, records = dict(failures), {}
    spaces: dict[tuple[str, str], SearchSpace] = {}  # an adversary has other parameters
    for cell in plan.cells:
        if cell in gaps:
            continue
        folder = plan.folder(cell)
        try:
            kind = (cell.scenario, cell.algorithm)
            if kind not in spaces:
                spaces[kind] = space_of(folder)
            space = spaces[kind]
            records[cell] = read(folder, space, plan.budget, counts(plan.budget), plan.apart)
        except StorageError as error:
            gaps[cell] = str(error)
    measured = {
        scenario: measure(of_it, plan.budget, plan.baseline)
        for scenario in plan.scenarios
        if (of_it := {c: one for c, one in records.items() if c.scenario == scenario})
    }
    values = {cell: row for one in measured.values() for cell, row in one.values.items()}
    kinds = measures(plan.budget)
    lines = summarise(values, plan.scenarios, list(plan.algorithms), plan.baseline, kinds)
    result = Comparison(plan, records, measured, gaps, lines, kinds)
    if deliver:
        write_tables(plan, records, values, gaps, lines, kinds)
        watch.stage("draw")
        write_page(result)
    return result


def _absolute(path: Path | str | None) -> str | None:
    return None if path is None else str(Path(path).resolve())


def _cores() -> int:
    """Return how many cores this process may use."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1
