"""The program of a worker process (see `process.py`): it calls functions on request."""

import pickle
import queue

from bridgegen.base.processes.child import Say, collect_rarely, connect, leave
from bridgegen.engine.workers.pipeline_cache import picklable


def main() -> None:
    """Answer requests until the parent process ends."""
    collect_rarely()
    requests, say = connect()
    try:
        _answer(requests, say)
    except BaseException as error:  # sys.exit, for example
        leave(error)


def _answer(requests: "queue.SimpleQueue[bytes]", say: Say) -> None:
    say("started")
    while True:
        request = requests.get()
        try:
            # Unpickled here, so that a failure to unpickle is reported like any other error.
            function, arguments, tells = pickle.loads(request)
            result = function(*arguments, *([say] if tells else []))
        except Exception as error:
            say("raised", picklable(error))
        else:
            say("answer", result)
