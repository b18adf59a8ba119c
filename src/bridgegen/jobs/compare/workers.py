"""Runs on several cores: processes that each make one run at a time, in one thread.

A process that crashes (out of memory, or by its driver) costs the run that it was making.
"""

from collections.abc import Callable, Iterable
from typing import Any

from bridgegen.engine.workers.tasks import READY, TaskPool
from bridgegen.jobs.compare.runs import RunCallbacks, Task, attempt


def run_all(
    tasks: Iterable[Task], at_once: int, callbacks: RunCallbacks, cluster: str | None = None
) -> dict[str, str]:
    """Make runs; no result depends on how many at a time.

    Args:
        tasks: the runs.
        at_once: how many at a time, ≥ 1. With 1, they are made in this process.
        cluster: where their scenarios are simulated, "ray" or "ray://HOST:PORT"; by default, a run
            is one thread.
        callbacks: called as they progress.

    Returns:
        Why runs failed, by name.

    Raises:
        InputError: an argument breaks a rule.
        KeyboardInterrupt: Ctrl-C; every process has ended, and finished evaluations are kept.
    """
    waiting = list(tasks)
    at_once = min(at_once, len(waiting))
    if at_once > 1:
        return _run_in_processes(waiting, at_once, callbacks, cluster)
    return _run_sequentially(waiting, callbacks, cluster)


def _run_sequentially(
    tasks: Iterable[Task], callbacks: RunCallbacks, cluster: str | None
) -> dict[str, str]:
    failures = {}

    def stage(name: str) -> None:
        if name == "compile":
            callbacks.compile()

    for task in tasks:

        def batch(evaluations: int, name: str = task.name) -> None:
            callbacks.batch(name, evaluations)

        failure = attempt(task, cluster, batch, stage)
        if failure is not None:
            failures[task.name] = failure
        callbacks.ended(task.name, failure)
    return failures


def _run_in_processes(
    tasks: Iterable[Task], at_once: int, callbacks: RunCallbacks, cluster: str | None
) -> dict[str, str]:
    failures = {}

    def heard(task: Task, kind: str, *rest: Any) -> None:
        if kind == "batch":
            callbacks.batch(task.name, *rest)
        elif rest == ("compile",):
            callbacks.compile()

    def ended(task: Task, failure: str | None, crash: str | None) -> None:
        if (why := crash or failure) is not None:
            failures[task.name] = why
        callbacks.ended(task.name, why)

    TaskPool(tasks, make, (cluster,), heard=heard, ended=ended).run(at_once)
    return failures


def make(task: Task, cluster: str | None, say: Callable[..., None]) -> str | None:
    """Make a run in a worker process, and report its progress; return why it failed, or None."""
    return attempt(
        task,
        cluster,
        lambda evaluations: say("batch", evaluations),
        lambda stage: say(READY) if stage == "search" else say("stage", stage),
    )
