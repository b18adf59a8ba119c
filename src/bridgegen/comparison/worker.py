"""In a process of its own: makes one run after the other, as it is told to.

Not forked, so that it inherits no threads and no compiled code's state; started by
`bridgegen.comparison.workers`, with which it exchanges pickled messages through its pipes.
"""

import os
import pickle
import queue
import sys
import threading
from typing import Any

from bridgegen.comparison.runs import Task, attempt
from bridgegen.errors import InputError


def _listen(tasks: "queue.SimpleQueue[Task]") -> None:
    """Take tasks; once nobody is there to give any, the process ends at once.

    At any moment: what a run has recorded is whole, and it can be gone on with.
    """
    try:
        while True:
            tasks.put(pickle.load(sys.stdin.buffer))
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


def main() -> None:
    """Make runs until there are no more."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what an algorithm prints must not get between our messages

    def say(*message: Any) -> None:
        pickle.dump(message, answers)
        answers.flush()

    tasks: queue.SimpleQueue[Task] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(tasks,), daemon=True).start()
    while True:
        task = tasks.get()
        try:
            failure = attempt(
                task,
                lambda evaluations: say("batch", evaluations),
                lambda stage: say("stage", stage),
            )
        except InputError as error:
            say("refused", error.problems)
            continue
        say("ended", failure)


if __name__ == "__main__":
    main()
