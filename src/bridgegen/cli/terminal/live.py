"""Progress bars on stderr."""

import threading
import time
from types import TracebackType
from typing import TYPE_CHECKING, Any, Self

from rich.console import Console
from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TaskID,
    TextColumn,
    TimeRemainingColumn,
)

if TYPE_CHECKING:
    from bridgegen.jobs.frame import JobCallbacks


class Live:
    """One live bar on stderr: the stage, how many of how many, facts, the remaining time.

    Args:
        total: number of items, if it is known.
    """

    def __init__(self, total: int | None = None) -> None:
        self.console = Console(stderr=True)
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(bar_width=14),
            MofNCompleteColumn(),
            TextColumn("{task.fields[facts]}"),
            TimeRemainingColumn(compact=True),
            console=self.console,
            transient=True,
            disable=not self.console.is_terminal,  # else it would print an empty line
        )
        self._task: TaskID = self._progress.add_task("starting", total=total, facts="")
        self._items, self._count = total, threading.Event()
        self._began = time.perf_counter()

    @property
    def seconds(self) -> float:
        """Time since construction [s]."""
        return time.perf_counter() - self._began

    def show(
        self,
        *,
        what: str | None = None,
        done: int | None = None,
        total: int | None = None,
        facts: str | None = None,
    ) -> None:
        """Show changes."""
        self._count.set()  # the stage that compiles is over
        fields: dict[str, Any] = {} if facts is None else {"facts": facts}
        self._progress.update(self._task, description=what, completed=done, total=total, **fields)

    def say_compiling(self) -> None:
        """Explain the delay if the kernels are not compiled yet, and count them until ``show``."""
        from bridgegen.base.compilation.cache import is_compiled

        if self._count.is_set() or is_compiled():
            return
        self.console.print("First run: compiling the simulator; later runs start at once.")
        # Compilation blocks this thread, so another one counts.
        threading.Thread(target=self._count_kernels, daemon=True).start()

    def _count_kernels(self) -> None:
        from bridgegen.base.compilation.cache import OF_A_SEARCH, n_compiled

        before = n_compiled()
        while not self._count.wait(0.2):
            done = min(n_compiled() - before, OF_A_SEARCH)
            self._progress.update(
                self._task, description="compiling kernels", completed=done, total=OF_A_SEARCH
            )
        self._progress.update(self._task, completed=0, total=self._items)

    def __enter__(self) -> Self:
        self._progress.start()
        return self

    def __exit__(
        self,
        kind: type[BaseException] | None,
        error: BaseException | None,
        trace: TracebackType | None,
    ) -> None:
        self._count.set()
        self._progress.stop()


class JobProgress(Live):
    """A job's live progress."""

    @property
    def callbacks(self) -> "JobCallbacks":
        """The callbacks for a job."""
        from bridgegen.jobs.frame import JobCallbacks

        return JobCallbacks(
            compile=self.say_compiling,
            stage=lambda what: self.show(what=what, facts=""),
            progress=lambda what, done, total, facts: self.show(
                what=what, done=done, total=total, facts=facts
            ),
            # A path may contain brackets, which are rich's markup.
            say=lambda text: self.console.print(
                text, markup=False, highlight=False, soft_wrap=True
            ),
        )
