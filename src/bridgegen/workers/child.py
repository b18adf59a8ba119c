"""In a process of its own: calls one function after the other, as it is told to.

Not forked, so that it inherits no threads and no compiled code's state; begun by
`bridgegen.workers.process`, with which it exchanges pickled messages through its pipes.
"""

import os
import pickle
import queue
import sys
import threading
from typing import Any

from bridgegen.workers.bench import portable


def _listen(requests: "queue.SimpleQueue[bytes]") -> None:
    """Take requests; once nobody is there to make any, the process ends at once."""
    try:
        while True:
            requests.put(pickle.load(sys.stdin.buffer))
    except (EOFError, OSError, pickle.UnpicklingError):
        os._exit(0)


def main() -> None:
    """Call what is asked for, until nobody asks."""
    answers = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # what is printed must not get between our messages

    def say(*message: Any) -> None:
        pickle.dump(message, answers, protocol=5)
        answers.flush()

    requests: queue.SimpleQueue[bytes] = queue.SimpleQueue()
    threading.Thread(target=_listen, args=(requests,), daemon=True).start()
    say("begun")
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
