"""The runs of a comparison, on several cores: each started or resumed, and its result."""

from collections.abc import Callable, Iterable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.base.errors import BridgeGenError, InputError, Interrupted
from bridgegen.engine.options import SearchOptions
from bridgegen.engine.workers import Threads
from bridgegen.engine.workers.tasks import READY, TaskPool
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.search import SearchCallbacks, resume, run_search
from bridgegen.jobs.search.loop import Progress
from bridgegen.results.store import Store
from bridgegen.results.store.run_file import FILE


@dataclass(frozen=True)
class Task:
    """A run to make.

    Attributes:
        name: of the run.
        folder: of the run.
        scenario: to search, as ``run_search`` takes it.
        options: of the run.
        deliver: whether to export its scenarios and write its report, too.
        may_be_refused: whether an argument that breaks a rule costs this run alone.
    """

    name: str
    folder: Path
    scenario: str
    options: SearchOptions
    deliver: bool = False
    may_be_refused: bool = False


class RunsProgress:
    """Says how far many runs are: evaluations of all, and how many runs have ended.

    Args:
        callbacks: are told.
        runs: how many there are.
        budget: evaluations of each.
        ended: runs that have ended already.
        made: evaluations of these.
        each: called with the name of each run that ends.
    """

    def __init__(
        self,
        callbacks: JobCallbacks,
        runs: int,
        budget: int,
        ended: int = 0,
        made: int = 0,
        each: Callable[[str], object] = lambda name: None,
    ) -> None:
        self._callbacks, self._each = callbacks, each
        self._runs, self._ended, self._failed = runs, ended, 0
        self._budget, self._before = budget, made
        self._total = made + (runs - ended) * budget
        self._evaluations: dict[str, int] = {}
        self._show()

    def compile(self) -> None:
        """Say that kernels may be compiled before the first run."""
        self._callbacks.compile()

    def batch(self, name: str, evaluations: int) -> None:
        """Say how many evaluations a run has made so far."""
        self._evaluations[name] = evaluations
        self._show()

    def ended(self, name: str, failure: str | None) -> None:
        """Say that a run has ended, or why it failed."""
        self._each(name)
        self._ended += 1
        if failure is not None:
            self._failed += 1
            self._callbacks.say(f"{name} failed: {failure}")
        # A run may end before its budget: what it will not make is no longer to come.
        self._total -= self._budget - self._evaluations.get(name, 0)
        self._show()

    def _show(self) -> None:
        made = self._before + sum(self._evaluations.values())
        facts = f"{self._ended} of {self._runs} runs"
        if self._failed:
            facts += f", {self._failed} failed"
        self._callbacks.progress("", made, self._total, facts)


def evaluations_of(folder: Path) -> tuple[int, bool]:
    """Return the number of evaluations in a run's folder, and whether the run has ended.

    Raises:
        StorageError: it is damaged.
    """
    if not (folder / FILE).exists():
        return 0, False
    with Store.open(folder) as store:
        return len(store), store.finished is not None


def attempt(
    task: Task,
    cluster: str | None,
    batch: Callable[[int], None],
    stage: Callable[[str], None],
) -> str | None:
    """Search or resume a run.

    Args:
        task: the run.
        cluster: where its scenarios are simulated; None is here, in one thread.
        batch: called with the evaluations so far.
        stage: called as a stage begins, "compile" or "search".

    Returns:
        Why it failed, or None.

    Raises:
        InputError: an argument breaks a rule; nothing of the run exists.
        KeyboardInterrupt: Ctrl-C; finished evaluations are kept.
    """

    def count(progress: Progress) -> None:
        batch(progress.evaluations)

    callbacks = SearchCallbacks(stage=stage, batch=count)
    # The way of a user: `run_search` and `resume`. So every cell is a run that can be viewed,
    # resumed, repeated and measured.
    how: dict[str, Any] = {
        "deliver": task.deliver,
        # One thread each: the cores are shared by the runs.
        "workers": cluster or Threads(1),
        "callbacks": callbacks,
    }
    begun = (task.folder / FILE).exists()
    try:
        if begun:
            how |= {"ego": task.options.ego, "worse_than": task.options.worse_than}
            resume(task.folder, algorithm=task.options.algorithm, **how)
        else:
            run_search(task.scenario, **vars(task.options), out=task.folder, **how)
    except Interrupted:
        raise KeyboardInterrupt from None
    except InputError as error:
        if not (task.may_be_refused or (task.folder / FILE).exists()):
            raise
        return str(error)
    except BridgeGenError as error:
        return str(error)
    except Exception as error:  # a user's algorithm or driver may raise anything
        return f"{type(error).__name__}: {error}"
    return None


# --- Runs on several cores: processes that each make one run at a time, in one thread ---
# A process that crashes (out of memory, or by its driver) costs the run that it was making.


def run_all(
    tasks: Iterable[Task], at_once: int, progress: RunsProgress, cluster: str | None = None
) -> dict[str, str]:
    """Make runs; no result depends on how many at a time.

    Args:
        tasks: the runs.
        at_once: how many at a time, ≥ 1. With 1, they are made in this process.
        cluster: where their scenarios are simulated, "ray" or "ray://HOST:PORT"; by default, a run
            is one thread.
        progress: is told.

    Returns:
        Why runs failed, by name.

    Raises:
        InputError: an argument breaks a rule.
        KeyboardInterrupt: Ctrl-C; every process has ended, and finished evaluations are kept.
    """
    waiting = list(tasks)
    at_once = min(at_once, len(waiting))
    if at_once > 1:
        return _run_in_processes(waiting, at_once, progress, cluster)
    return _run_sequentially(waiting, progress, cluster)


def _run_sequentially(
    tasks: Iterable[Task], progress: RunsProgress, cluster: str | None
) -> dict[str, str]:
    failures = {}

    def stage(name: str) -> None:
        if name == "compile":
            progress.compile()

    for task in tasks:

        def batch(evaluations: int, name: str = task.name) -> None:
            progress.batch(name, evaluations)

        failure = attempt(task, cluster, batch, stage)
        if failure is not None:
            failures[task.name] = failure
        progress.ended(task.name, failure)
    return failures


def _run_in_processes(
    tasks: Iterable[Task], at_once: int, progress: RunsProgress, cluster: str | None
) -> dict[str, str]:
    failures = {}

    def heard(task: Task, kind: str, *rest: Any) -> None:
        if kind == "batch":
            progress.batch(task.name, *rest)
        elif rest == ("compile",):
            progress.compile()

    def ended(task: Task, failure: str | None, crash: str | None) -> None:
        if (why := crash or failure) is not None:
            failures[task.name] = why
        progress.ended(task.name, why)

    # Processes by `subprocess`: forked ones have threads and compiled code of their parent, and
    # `multiprocessing` would run a user's script again. One that crashes is one failed run; a
    # `ProcessPoolExecutor` would end them all.
    TaskPool(tasks, make, (cluster,), heard=heard, ended=ended).run(at_once)
    return failures


def make(task: Task, cluster: str | None, say: Callable[..., None]) -> str | None:
    """Make a run in a worker process, and report its progress; return why it failed, or None."""
    return attempt(
        task,
        cluster,
        lambda evaluations: say("batch", evaluations),
        # Where nothing is compiled yet, one process compiles and the others begin after it.
        lambda stage: say(READY) if stage == "search" else say("stage", stage),
    )
