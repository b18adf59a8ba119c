"""What follows the searches, run by run in processes: careful drivers and scripts."""

from collections.abc import Callable, Iterable, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.base.errors import BridgeGenError, FileFormatError, StorageError
from bridgegen.engine.workers.tasks import READY, TaskPool
from bridgegen.jobs.benchmark.failures import (
    failures_of,
    judge,
    read_judgement,
    write_judgement,
    write_reproductions,
)
from bridgegen.jobs.benchmark.plan import Cell, Plan
from bridgegen.jobs.compare.runs import RunsProgress, Task, evaluations_of
from bridgegen.jobs.search.run import REPORT, Run
from bridgegen.search.triage.record import JSON_FILE


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
        cell.name, plan.folder(cell), plan.scenarios[cell.scenario], plan.options_of(cell),
        deliver=deliver, may_be_refused=True,
    )  # fmt: skip


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
