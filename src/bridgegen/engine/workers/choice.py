"""Makes the workers that a user asks for."""

import re
from collections.abc import Iterator
from contextlib import contextmanager

from bridgegen.base.errors import InputError
from bridgegen.engine.workers.threads import Threads
from bridgegen.engine.workers.workers import Workers

MOST = 1024
"""Maximum number of processes on one machine; a larger number is a typing error."""

RAY = "ray"

Choice = int | str | Workers | None
"""A number of processes; ``"ray"`` or ``"ray://HOST:PORT"``; open workers; None for threads."""


def read_choice(given: int | str | None) -> int | str | None:
    """Check and return a choice of workers.

    Args:
        given: a number of processes, as an integer or in digits; or "ray", or "ray://HOST:PORT".

    Raises:
        InputError: it is neither a number in range nor an address of Ray.
    """
    if given is None:
        return None
    text = str(given)
    if text.isdecimal() and 1 <= int(text) <= MOST:
        return int(text)
    if text == RAY or re.fullmatch(r"ray://[^/:\s]+:\d+", text):
        return text
    raise InputError(
        f"workers must be a number of processes, 1 to {MOST}, or ray, or ray://HOST:PORT, "
        f"got {given}"
    )


@contextmanager
def open_workers(choice: Choice) -> Iterator[Workers]:
    """Open workers and close them at the end; workers that the caller passes stay open.

    Raises:
        InputError: see `read_choice`.
    """
    if choice is not None and not isinstance(choice, int | str):
        yield choice
        return
    number = read_choice(choice)
    workers: Workers
    if number is None:
        workers = Threads()
    elif isinstance(number, int):
        from bridgegen.engine.workers.processes import Processes

        workers = Processes(number)
    else:
        from bridgegen.engine.workers.cluster import Cluster

        workers = Cluster(None if number == RAY else number)
    try:
        yield workers
    finally:
        workers.close()
