"""A benchmark of drivers from start to finish: search, triage, judge, write tables and a page."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from math import isfinite, isnan, nan
from pathlib import Path
from typing import Any

from bridgegen.base.errors import (
    BridgeGenError,
    FileFormatError,
    InputError,
    Interrupted,
    StorageError,
)
from bridgegen.engine.domain import needed_by
from bridgegen.engine.options import PipelineOptions, called_with
from bridgegen.engine.runner import Runner
from bridgegen.engine.workers import read_choice
from bridgegen.engine.workers.processes import cores
from bridgegen.engine.workers.tasks import READY, TaskPool
from bridgegen.jobs.benchmark.failures import (
    CAREFUL,
    failures_of,
    judge,
    read_judgement,
    write_judgement,
    write_reproductions,
)
from bridgegen.jobs.benchmark.options import BenchmarkOptions
from bridgegen.jobs.benchmark.page import write_page
from bridgegen.jobs.benchmark.plan import (
    COLUMNS,
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
from bridgegen.jobs.compare.plan import RUN_PATTERN, RUNS
from bridgegen.jobs.compare.runs import RunsProgress, Task, evaluations_of, run_all
from bridgegen.jobs.compare.words import number
from bridgegen.jobs.frame import JobCallbacks, Judged, Table
from bridgegen.jobs.search.run import REPORT, Run
from bridgegen.jobs.search.scenarios import load
from bridgegen.results.folder import claim
from bridgegen.results.store.sqlite import Lock
from bridgegen.search import algorithms as toolkit
from bridgegen.search.algorithms.algorithm import Problem, resolve
from bridgegen.search.triage.effort import effort
from bridgegen.search.triage.record import JSON_FILE

# --- What follows the searches, run by run in processes: careful drivers and scripts ---


@dataclass(frozen=True)
class Finish:
    """A run whose failures are to be judged.

    Attributes:
        name: of the run.
        folder: of the run.
        scripts: whether its exported scenarios get scripts.
    """

    name: str
    folder: Path
    scripts: bool


def searches(plan: Plan, failures: dict[Cell, str]) -> tuple[list[Task], int, int]:
    """Return the searches that are to be made; how many have ended, and their evaluations.

    Args:
        plan: of the benchmark.
        failures: gets why the others cannot be used.
    """
    tasks, ended, made = [], 0, 0
    for cell in plan.cells:
        try:
            evaluations, is_ended = evaluations_of(plan.folder(cell))
        except StorageError as error:
            failures[cell] = str(error)
            continue
        if is_ended:
            ended, made = ended + 1, made + evaluations
        else:
            tasks.append(task_of(plan, cell))
    return tasks, ended, made


def task_of(plan: Plan, cell: Cell, *, deliver: bool = False) -> Task:
    """Return the task of a run."""
    return Task(
        cell.name,
        plan.folder(cell),
        plan.scenarios[cell.scenario],
        plan.options_of(cell),
        deliver=deliver,
        # A planner may refuse a scenario, and that costs its run alone.
        may_be_refused=True,
    )


def chosen(plan: Plan, failed: Mapping[Cell, str]) -> tuple[Cell, ...]:
    """Return the runs to be triaged: of each driver, scenario and column those that add a way.

    The first seed's, and any other's that fails in a way which no run before it does: testing the
    neighbours of failures takes longer than a short search, and most seeds find the same.

    Raises:
        StorageError: a run is damaged.
    """
    found: list[Cell] = []
    ways: dict[tuple[str, str, str], set[tuple[str, ...]]] = {}
    for cell in plan.cells:
        if cell in failed:
            continue
        run = Run(plan.folder(cell))
        own = set(failures_of(run, run.rows()).ways)
        group = (cell.scenario, cell.driver, cell.column)
        # A triage is dear: a run that adds no way of failing to those of earlier seeds is not
        # triaged.
        if group not in ways or own - ways[group]:
            found.append(cell)
        ways.setdefault(group, set()).update(own)
    return tuple(found)


def is_delivered(folder: Path) -> bool:
    """Return whether a run has its triage and its report, which is written last."""
    return (folder / JSON_FILE).exists() and (folder / REPORT).exists()


def finish_all(tasks: Iterable[Finish], at_once: int, progress: RunsProgress) -> dict[str, str]:
    """Judge runs; return why some could not be, by name.

    Raises:
        KeyboardInterrupt: Ctrl-C; what has been judged is kept.
    """
    waiting, problems = list(tasks), {}

    def ended(task: Finish, problem: str | None, crash: str | None) -> None:
        if (why := crash or problem) is not None:
            problems[task.name] = why
        progress.ended(task.name, why)

    at_once = min(at_once, len(waiting))
    if at_once > 1:
        TaskPool(waiting, finish, ended=ended).run(at_once)
    else:
        for task in waiting:
            ended(task, finish(task, lambda *what: None), None)
    return problems


def is_finished(folder: Path) -> bool:
    """Return whether a run's failures have been judged."""
    try:
        return read_judgement(folder) is not None
    except FileFormatError:
        return False


def finish(task: Finish, say: Callable[..., Any]) -> str | None:
    """Judge a run, and write scripts beside its scenarios; return why not, or None."""
    say(READY)
    try:
        run = Run(task.folder)
        rows = run.rows()
        judgement = judge(run, rows)
        notes = write_reproductions(run, rows) if task.scripts else {}
        write_judgement(task.folder, judgement.model_copy(update={"notes": notes}))
    except BridgeGenError as error:
        return str(error)
    return None


LOCK = "benchmark.lock"


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

    @property
    def work(self) -> str:
        """How many runs there are."""
        return f"{len(self.plan.cells):,} runs"

    def to_json(self) -> list[dict[str, Any]]:
        """Return what is known of each driver."""
        return [
            {
                **vars(standing),
                "first": standing.first if isfinite(standing.first) else None,
                "avoided": {k: v if isfinite(v) else None for k, v in standing.avoided.items()},
            }
            for standing in self.standings
        ]

    def shown(self) -> list[str | Table]:
        """Return what the terminal shows: the table of drivers, and the files."""
        head = (
            "driver",
            "perception",
            "modes",
            "robust",
            "first",
            "severity",
            *(f"{name} avoids" for name in CAREFUL),
            "scenarios",
            "n/a",
            "no result",
            "failed rows",
        )
        gaps = [f"missing: {cell.name}: {why}" for cell, why in self.gaps.items()]
        return [
            Table(head, [_row(standing) for standing in self.standings], texts=2),
            *gaps,
            f"\n{'page':<12}{self.page}",
            f"{'tables':<12}{self.plan.out / '*.csv'}",
            f"{'runs':<12}{self.plan.out / RUNS}  (bridgegen resume, view, …)",
        ]

    def judged(self) -> list[Judged]:
        """Return the figures of each driver in each column of perception."""
        facts = {"command": self.plan.command(), "page": str(self.page)}
        return [
            Judged(
                suite="planners",
                group=f"bridgegen.planners.{standing.driver.replace('.', '_')}",
                test="it drove",
                holds=standing.driven > 0,
                details=f"{standing.evaluations} evaluations in {standing.driven} scenarios",
                figures={
                    "modes": standing.modes,
                    "robust": standing.robust,
                    "severity": standing.severity,
                    "failures": standing.failures,
                    "failed_rows": standing.failed_rows,
                    "no_result": standing.failed,
                },
                facts=facts,
                of=f"{standing.driver}, {COLUMNS[standing.column]}",
            )
            for standing in self.standings
        ]


def _row(standing: Standing) -> list[object]:
    shares = (standing.avoided.get(name, nan) for name in CAREFUL)
    return [
        standing.driver,
        COLUMNS[standing.column].removesuffix(" perception"),
        standing.modes,
        standing.robust,
        number(standing.first, 0),
        f"{standing.severity:.2f}",
        *(number(100 * share, 0) + ("" if isnan(share) else " %") for share in shares),
        standing.driven,
        standing.not_applicable,
        standing.failed,
        standing.failed_rows,
    ]


@called_with(BenchmarkOptions)
def benchmark_planners(given: BenchmarkOptions) -> Benchmark:
    """Search scenarios for the failures of several drivers, and compare what is found.

    Each driver drives each scenario within its stated domain, with perfect perception and by what
    sensors track. Each run is an ordinary run's folder under ``OUT/runs``. Then ``drivers.csv``,
    ``outcomes.csv``, ``modes.csv`` and a page. Killed at any moment and called again, it resumes;
    called with more drivers, scenarios or seeds, it adds their runs.

    Returns:
        The benchmark. A run that failed is a gap in it.

    Raises:
        InputError: an invalid argument or file, or a planner that is not installed.
        StorageError: the folder holds something else, is in use, or cannot be written.
        Interrupted: Ctrl-C; every run keeps what it has done.
    """
    callbacks, quick, algorithm = given.callbacks, given.quick, given.algorithm
    usual = (QUICK_BUDGET, QUICK_SEEDS, QUICK_KEEP) if quick else (1000, 3, KEEP)
    asked = (given.budget, given.seeds, given.keep)
    budget, seeds, keep = (b if a is None else a for a, b in zip(asked, usual, strict=True))
    triage = given.triage or (QUICK_TRIAGE if quick else TRIAGE)
    at_once = cores() if given.workers is None else read_choice(given.workers)
    problems = number_problems(seeds, budget, keep)
    if not isinstance(at_once, int):
        raise InputError(f"workers must be a number of processes, got {at_once}")
    if problems:
        raise InputError(*problems)
    effort(triage)
    resolve(toolkit.get(algorithm), Problem.unnamed(1), 0, {})
    taking_part = entrants(given.drivers or None, QUICK_DRIVERS if quick else ours())
    searched = [
        str(scenario) for scenario in given.scenarios or (QUICK_SCENARIOS if quick else catalogue())
    ]
    folder = Path(given.out or Path("benchmarks") / ("planners-quick" if quick else "planners"))
    callbacks.stage("reading the scenarios")
    callbacks.compile()
    needs = {name: domain_of(name) for name in dict.fromkeys(searched)}
    plan = make_plan(
        searched,
        taking_part,
        needs,
        seeds=seeds,
        budget=budget,
        algorithm=algorithm,
        keep=keep,
        triage=triage,
        out=folder,
    )
    claim(
        plan.out,
        plan.identity(),
        file=FILE,
        what="benchmark",
        pieces=RUNS,
        kept=RUN_PATTERN,
        grows=True,
    )
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


def _run(plan: Plan, at_once: int, callbacks: JobCallbacks, done: list[str]) -> Benchmark:
    """Make what is missing, and conclude.

    Args:
        plan: of the benchmark.
        at_once: number of runs at a time.
        callbacks: called as it progresses.
        done: gets the names of the runs whose search has ended.
    """
    callbacks.stage("measuring speeds")
    plan, speeds = measured(plan, lambda driver: callbacks.stage(f"measuring {driver}"))
    failures: dict[Cell, str] = {}
    tasks, ended, made = searches(plan, failures)
    waiting = {task.name for task in tasks}
    done += [cell.name for cell in plan.cells if cell.name not in waiting and cell not in failures]
    _say_plan(plan, seconds_of(plan, speeds, at_once), callbacks)
    callbacks.stage("searching")
    by_name = {cell.name: cell for cell in plan.cells}
    progress = RunsProgress(callbacks, len(plan.cells), plan.budget, ended, made, done.append)
    failures |= {by_name[name]: why for name, why in run_all(tasks, at_once, progress).items()}
    failures = read_gaps(plan, failures)

    to_triage = chosen(plan, failures)
    callbacks.stage("testing failures")
    delivered = [
        task_of(plan, cell, deliver=True)
        for cell in to_triage
        if not is_delivered(plan.folder(cell))
    ]
    counting = _Counting(callbacks, "testing failures", len(delivered))
    failed = run_all(delivered, at_once, counting)
    failures |= {by_name[name]: why for name, why in failed.items()}

    callbacks.stage("careful drivers")
    finished = [
        Finish(cell.name, plan.folder(cell), cell in to_triage)
        for cell in plan.cells
        if cell not in failures and not is_finished(plan.folder(cell))
    ]
    counting = _Counting(callbacks, "careful drivers", len(finished))
    failed = finish_all(finished, at_once, counting)
    failures |= {by_name[name]: why for name, why in failed.items()}
    return conclude(plan, failures, callbacks)


def conclude(plan: Plan, failures: dict[Cell, str], callbacks: JobCallbacks) -> Benchmark:
    """Read the runs, and write tables and page.

    Raises:
        StorageError: they cannot be written.
    """
    callbacks.stage("reading the runs")
    found = outcomes(plan, failures)
    result = Benchmark(plan, found, standings(found), failures, plan.out / "benchmark.html")
    write_tables(plan, result.outcomes, result.standings)
    write_page(plan, result.outcomes, result.standings, result.page)
    return result


class _Counting(RunsProgress):
    """Counts the tasks of a stage."""

    def __init__(self, callbacks: JobCallbacks, what: str, number: int) -> None:
        self._what = what
        super().__init__(callbacks, number, 0)

    def batch(self, name: str, evaluations: int) -> None:
        """Its evaluations have been made already."""

    def ended(self, name: str, failure: str | None) -> None:
        """Count one more."""
        self._ended += 1
        self._show()

    def _show(self) -> None:
        self._callbacks.progress(self._what, self._ended, self._runs, "")


def _say_plan(plan: Plan, seconds: float, callbacks: JobCallbacks) -> None:
    """Say who does not take part, and how long the runs take."""
    for entrant in plan.entrants:
        if entrant.problem:
            callbacks.say(f"{entrant.name}: {entrant.problem}")
    callbacks.say(
        f"{len(plan.cells)} runs of {plan.budget:,} evaluations: about {_duration(seconds)}, by "
        "the speed of each driver on this machine; less where runs have ended already"
    )


def _duration(seconds: float) -> str:
    if seconds < 90:
        return f"{seconds:.0f} s"
    minutes = seconds / 60
    return f"{minutes:.0f} min" if minutes < 90 else f"{minutes / 60:.1f} h"


def domain_of(scenario: str) -> frozenset[str]:
    """Return what a logical scenario needs, see `bridgegen.engine.domain.needed_by`.

    Args:
        scenario: name of the catalogue, or path of a file.

    Raises:
        InputError: no such scenario, or an invalid one.
    """
    logical = load(scenario)
    return needed_by(Runner(logical, logical.space(), PipelineOptions(ego="route-follower")))[0]
