"""In a process of its own: calls one function after the other, as it is told to.

Not forked, so that it inherits no threads and no compiled code's state; begun by
`bridgegen.workers.process`, with which it exchanges pickled messages through its pipes.
"""

import os
import pickle
import queue
import sys
import threading
from collections.abc import Callable
from typing import Any

from bridgegen.workers.bench import portable

Say = Callable[..., None]
"""Says something to who began this process; may be called by any thread."""


def _listen(requests: "queue.SimpleQueue[bytes]") -> None:
    """Take requests; once nobody is there to make any, the process ends at once."""
    try:
        while True:
            requests.put(pickle.load(sys.stdin.buffer))
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


def connect() -> tuple["queue.SimpleQueue[bytes]", Say]:
    """Return what is asked for, as it comes, and how to answer; say that we have begun."""
    answers, lock = os.fdopen(os.dup(1), "wb"), threading.Lock()
    os.dup2(2, 1)  # what is printed must not get between our messages

    def say(*message: Any) -> None:
        data = pickle.dumps(message, protocol=5)
        with lock:
            answers.write(data)
            answers.flush()

    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests,), daemon=True).start()
    say("begun")
    return requests, say


def main() -> None:
    """Call what is asked for, until nobody asks."""
    requests, say = connect()
    while True:
        request = requests.get()
        try:
            # Here, not where they are taken: what cannot be unpickled is told like any error.
            function, arguments, tells = pickle.loads(request)
            came = function(*arguments, *([say] if tells else []))
        except Exception as error:
            say("raised", portable(error))
        else:
            say("answer", came)
