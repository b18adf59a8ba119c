"""In a process of its own (`bridgegen.workers.process`): calls functions, as it is told to."""

import pickle

from bridgegen.child import connect
from bridgegen.workers.bench import portable


def main() -> None:
    """Call what is asked for, until nobody asks."""
    requests, say = connect()
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
