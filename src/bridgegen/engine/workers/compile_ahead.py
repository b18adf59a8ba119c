"""A process that compiles kernels while this one compiles others."""

import os
import queue
from collections.abc import Iterator
from contextlib import contextmanager, suppress

import numba

from bridgegen.base.compilation.cache import is_compiled
from bridgegen.engine.workers.processes import Process, Said
from bridgegen.engine.workers.recipe import Recipe


@contextmanager
def compiled_ahead(recipe: Recipe) -> Iterator[bool]:
    """Have another process follow a recipe meanwhile, if nothing is compiled and a core is free.

    Both put what they compile into the cache, and neither compiles what the other one does.

    Args:
        recipe: of a call that compiles what this process will need later.

    Yields:
        whether another process does; this one then had better begin with the rest.
    """
    if is_compiled() or numba.config.DISABLE_JIT or (os.cpu_count() or 1) == 1:
        yield False
        return
    said: Said = queue.SimpleQueue()
    helper = None
    with suppress(OSError), open(os.devnull, "wb") as nowhere:  # no process more: alone, then
        helper = Process(said, errors=nowhere)
        helper.call(_follow, recipe)
    try:
        yield helper is not None
    finally:
        if helper is not None:
            # What it has not finished is compiled by whoever needs it; the cache holds whole
            # kernels only.
            helper.end()


def _follow(recipe: Recipe) -> None:
    recipe.make()
