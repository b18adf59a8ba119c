"""A benchmark of drivers from start to finish: search, triage, judge, write tables and a page."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

from bridgegen.base.errors import InputError, Interrupted
from bridgegen.engine.domain import needed_by
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.runner import Runner
from bridgegen.engine.workers.processes import cores
from bridgegen.jobs.benchmark.page import write_page
from bridgegen.jobs.benchmark.plan import (
    FILE,
    KEEP,
    QUICK_BUDGET,
    QUICK_DRIVERS,
    QUICK_KEEP,
    QUICK_SCENARIOS,
    QUICK_SEEDS,
    QUICK_TRIAGE,
    TRIAGE,
    Cell,
    Plan,
    catalogue,
    entrants,
    make_plan,
    measured,
    number_problems,
    ours,
    seconds_of,
)
from bridgegen.jobs.benchmark.results import (
    Outcome,
    Standing,
    outcomes,
    read_gaps,
    standings,
    write_tables,
)
from bridgegen.jobs.benchmark.work import (
    Finish,
    chosen,
    finish_all,
    is_delivered,
    is_finished,
    searches,
    task_of,
)
from bridgegen.jobs.compare.plan import RUN_PATTERN, RUNS
from bridgegen.jobs.compare.runs import RunCallbacks, run_all
from bridgegen.jobs.search.scenarios import load
from bridgegen.results.folder import claim
from bridgegen.results.store.sqlite import Lock
from bridgegen.search import algorithms as toolkit
from bridgegen.search.algorithms.algorithm import Problem, resolve
from bridgegen.search.triage.effort import effort

LOCK = "benchmark.lock"


@dataclass(frozen=True)
class BenchmarkCallbacks(RunCallbacks):
    """Called as a benchmark progresses.

    Attributes:
        stage: with the stage that begins: "domains", "speeds", "search", "triage", "judge",
            "read".
        measuring: with the name of a driver whose speed is measured.
        estimated: with the plan, and how many seconds the runs take, about.
        begun: with the number of runs, how many have ended already, and their evaluations.
        tasks: with the number of tasks of a stage without evaluations, and how many are done.
    """

    stage: Callable[[str], None] = lambda stage: None
    measuring: Callable[[str], None] = lambda driver: None
    estimated: Callable[[Plan, float], None] = lambda plan, seconds: None
    begun: Callable[[int, int, int], None] = lambda runs, ended, made: None
    tasks: Callable[[int, int], None] = lambda number, done: None


@dataclass(frozen=True)
class Benchmark:
    """The results of a benchmark.

    Attributes:
        plan: of it.
        outcomes: by driver, scenario and column of perception.
        standings: by driver and column.
        gaps: why runs have no result.
        page: the HTML page with all results.
    """

    plan: Plan
    outcomes: tuple[Outcome, ...]
    standings: tuple[Standing, ...]
    gaps: dict[Cell, str]
    page: Path


def benchmark_planners(
    drivers: Sequence[str] | None = None,
    *,
    scenarios: Sequence[str | Path] | None = None,
    budget: int | None = None,
    seeds: int | None = None,
    algorithm: str = "pso",
    keep: int | None = None,
    triage: str | None = None,
    quick: bool = False,
    workers: int | None = None,
    out: Path | str | None = None,
    callbacks: BenchmarkCallbacks | None = None,
) -> Benchmark:
    """Search scenarios for the failures of several drivers, and compare what is found.

    Each driver drives each scenario within its stated domain, with perfect perception and by what
    sensors track. Each run is an ordinary run's folder under ``OUT/runs``. Then ``drivers.csv``,
    ``outcomes.csv``, ``modes.csv`` and a page. Killed at any moment and called again, it resumes;
    called with more drivers, scenarios or seeds, it adds their runs.

    Args:
        drivers: names, as of ``--ego``; by default all planners that are installed, and ours.
        scenarios: names of the catalogue, or paths; the catalogue by default.
        budget: evaluations of each run; 1,000 by default.
        seeds: runs of each driver, scenario and column; 3 by default.
        algorithm: that searches.
        keep: scenarios that each run exports; 3 by default.
        triage: how much of the findings is simulated again: "full", "short" or "none"; "short" by
            default.
        quick: whether other defaults hold: four scenarios, two of our drivers, 40 evaluations, one
            seed, one scenario exported, no triage.
        workers: number of runs at a time; one for each core by default. No result depends on it.
        out: folder; ``benchmarks/planners`` by default, or ``benchmarks/planners-quick``.
        callbacks: called as it progresses.

    Raises:
        InputError: an invalid argument or file, or a planner that is not installed.
        StorageError: the folder holds something else, is in use, or cannot be written.
        Interrupted: Ctrl-C; every run keeps what it has done.
    """
    callbacks = callbacks or BenchmarkCallbacks()
    budget = budget if budget is not None else QUICK_BUDGET if quick else 1000
    seeds = seeds if seeds is not None else QUICK_SEEDS if quick else 3
    keep = keep if keep is not None else QUICK_KEEP if quick else KEEP
    triage = triage if triage is not None else QUICK_TRIAGE if quick else TRIAGE
    at_once = cores() if workers is None else workers
    problems = number_problems(seeds, budget, keep)
    if at_once < 1:
        problems.append(f"1 <= workers must hold, got {workers}")
    if problems:
        raise InputError(*problems)
    effort(triage)
    resolve(toolkit.get(algorithm), Problem.unnamed(1), 0, {})
    taking_part = entrants(drivers, QUICK_DRIVERS if quick else ours())
    searched = [str(one) for one in scenarios or (QUICK_SCENARIOS if quick else catalogue())]
    folder = Path(out or Path("benchmarks") / ("planners-quick" if quick else "planners"))
    callbacks.stage("domains")
    callbacks.compile()
    needs = {name: domain_of(name) for name in dict.fromkeys(searched)}
    plan = make_plan(
        searched, taking_part, needs, seeds=seeds, budget=budget, algorithm=algorithm, keep=keep,
        triage=triage, out=folder,
    )  # fmt: skip
    claim(
        plan.out, plan.identity(), file=FILE, what="benchmark", pieces=RUNS, kept=RUN_PATTERN,
        grows=True,
    )  # fmt: skip
    lock = Lock(plan.out / LOCK)
    done: list[str] = []
    try:
        return _run(plan, at_once, callbacks, done)
    except KeyboardInterrupt:
        raise Interrupted(
            plan.out, len(done), len(plan.cells), what="runs", command=plan.command()
        ) from None
    finally:
        lock.release()


def _run(plan: Plan, at_once: int, callbacks: BenchmarkCallbacks, done: list[str]) -> Benchmark:
    """Make what is missing, and conclude.

    Args:
        plan: of the benchmark.
        at_once: number of runs at a time.
        callbacks: called as it progresses.
        done: gets the names of the runs whose search has ended.
    """
    callbacks.stage("speeds")
    plan, speeds = measured(plan, callbacks.measuring)
    failures: dict[Cell, str] = {}
    tasks, ended, made = searches(plan, failures)
    waiting = {one.name for one in tasks}
    done += [cell.name for cell in plan.cells if cell.name not in waiting and cell not in failures]
    callbacks.estimated(plan, seconds_of(plan, speeds, at_once))
    callbacks.stage("search")
    callbacks.begun(len(plan.cells), ended, made)

    def search_ended(name: str, failure: str | None) -> None:
        done.append(name)
        callbacks.ended(name, failure)

    by_name = {cell.name: cell for cell in plan.cells}
    of_runs = RunCallbacks(callbacks.compile, callbacks.batch, search_ended)
    failures |= {by_name[name]: why for name, why in run_all(tasks, at_once, of_runs).items()}
    failures = read_gaps(plan, failures)

    to_triage = chosen(plan, failures)
    callbacks.stage("triage")
    delivered = [
        task_of(plan, cell, deliver=True)
        for cell in to_triage
        if not is_delivered(plan.folder(cell))
    ]
    counting = _Counting(callbacks, len(delivered))
    failed = run_all(delivered, at_once, RunCallbacks(ended=counting.ended))
    failures |= {by_name[name]: why for name, why in failed.items()}

    callbacks.stage("judge")
    finished = [
        Finish(cell.name, plan.folder(cell), cell in to_triage)
        for cell in plan.cells
        if cell not in failures and not is_finished(plan.folder(cell))
    ]
    counting = _Counting(callbacks, len(finished))
    failed = finish_all(finished, at_once, RunCallbacks(ended=counting.ended))
    failures |= {by_name[name]: why for name, why in failed.items()}
    return conclude(plan, failures, callbacks)


def conclude(plan: Plan, failures: dict[Cell, str], callbacks: BenchmarkCallbacks) -> Benchmark:
    """Read the runs, and write tables and page.

    Raises:
        StorageError: they cannot be written.
    """
    callbacks.stage("read")
    found = outcomes(plan, failures)
    result = Benchmark(plan, found, standings(found), failures, plan.out / "benchmark.html")
    write_tables(plan, result.outcomes, result.standings)
    write_page(plan, result.outcomes, result.standings, result.page)
    return result


class _Counting:
    """Counts the tasks of a stage."""

    def __init__(self, callbacks: BenchmarkCallbacks, number: int) -> None:
        self._callbacks, self._number, self._done = callbacks, number, 0
        callbacks.tasks(number, 0)

    def ended(self, name: str, failure: str | None) -> None:
        """Count one more."""
        self._done += 1
        self._callbacks.tasks(self._number, self._done)


def domain_of(scenario: str) -> frozenset[str]:
    """Return what a logical scenario needs, see `bridgegen.engine.domain.needed_by`.

    Args:
        scenario: name of the catalogue, or path of a file.

    Raises:
        InputError: no such scenario, or an invalid one.
    """
    logical = load(scenario)
    return needed_by(Runner(logical, logical.space(), PipelineOptions(ego="route-follower")))[0]
