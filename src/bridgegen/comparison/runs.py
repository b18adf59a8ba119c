"""One run of a comparison: begun, or gone on with; and what became of it."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from bridgegen.campaign import Watch, resume, run_search
from bridgegen.campaign.loop import Progress
from bridgegen.errors import BridgeGenError, InputError, Interrupted
from bridgegen.options import SearchOptions
from bridgegen.store import Store
from bridgegen.store.run_file import FILE
from bridgegen.workers import Threads


@dataclass(frozen=True)
class Task:
    """A run that is to be made.

    Attributes:
        name: what people call it.
        folder: its own.
        scenario: that is searched, as ``run_search`` takes it.
        options: of the run.
    """

    name: str
    folder: Path
    scenario: str
    options: SearchOptions


@dataclass(frozen=True)
class Watcher:
    """Who wants to know how the runs are getting on; each is called from the same thread.

    Attributes:
        compile: told that the simulator is being compiled, maybe.
        batch: told a run's name and its evaluations so far.
        ended: told a run's name, and why it failed if it did.
    """

    compile: Callable[[], None] = lambda: None
    batch: Callable[[str, int], None] = lambda name, evaluations: None
    ended: Callable[[str, str | None], None] = lambda name, failure: None


def evaluations_of(folder: Path) -> tuple[int, bool]:
    """Return how many evaluations a run's folder holds, and whether the run has ended.

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
    """Make a run, or go on with it, without hand-over and report.

    Args:
        task: the run.
        cluster: where its scenarios are simulated; None is here, in one thread.
        batch: told the evaluations so far.
        stage: told what begins, "compile" or "search".

    Returns:
        Why it failed, or None.

    Raises:
        InputError: what the user asked for breaks a rule; nothing of the run exists.
        KeyboardInterrupt: Ctrl-C; what is done is kept.
    """

    def told(progress: Progress) -> None:
        batch(progress.evaluations)

    watch = Watch(stage=stage, batch=told)
    how: dict[str, Any] = {"deliver": False, "workers": cluster or Threads(1), "watch": watch}
    begun = (task.folder / FILE).exists()
    try:
        if begun:
            resume(task.folder, ego=task.options.ego, **how)
        else:
            run_search(task.scenario, **vars(task.options), out=task.folder, **how)
    except Interrupted:
        raise KeyboardInterrupt from None
    except InputError as error:
        if not (task.folder / FILE).exists():
            raise
        return str(error)
    except BridgeGenError as error:
        return str(error)
    except Exception as error:  # whatever an algorithm or a driver of the user's raises
        return f"{type(error).__name__}: {error}"
    return None
