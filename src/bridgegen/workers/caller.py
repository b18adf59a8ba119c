"""In a process of its own (`bridgegen.workers.process`): calls functions, as it is told to."""

import pickle
import queue

from bridgegen.child import Say, connect, leave
from bridgegen.workers.bench import portable


def main() -> None:
    """Call what is asked for, until nobody asks."""
    requests, say = connect()
    try:
        _answer(requests, say)
    except BaseException as error:  # sys.exit, say
        leave(error)


def _answer(requests: "queue.SimpleQueue[bytes]", say: Say) -> None:
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
