"""Inside a worker: the pipelines that it has built from recipes."""

import pickle
import traceback
from collections import OrderedDict
from typing import Any

from bridgegen.base.arrays import Float
from bridgegen.engine.workers.recipe import Recipe
from bridgegen.engine.workers.workers import Work

CAPACITY = 8
"""Pipelines that a worker keeps, the most recently used: several campaigns may share it."""


class NotPrepared(Exception):
    """No pipeline has been built here for a recipe, or it has been evicted."""


class PipelineCache:
    """Pipelines by the keys of their recipes."""

    def __init__(self) -> None:
        self._pipelines: OrderedDict[str, Any] = OrderedDict()

    def __contains__(self, key: str) -> bool:
        return key in self._pipelines

    def prepare(self, recipe: Recipe) -> None:
        """Build the pipeline of a recipe, unless it is cached.

        Raises:
            Exception: raised by the recipe.
        """
        if recipe.key not in self:
            pipeline = recipe.make()
            while len(self._pipelines) >= CAPACITY:
                self._pipelines.popitem(last=False)
            self._pipelines[recipe.key] = pipeline

    def run(self, key: str, work: Work, X: Float, args: tuple[Any, ...]) -> Any:
        """Return ``work(pipeline, X, *args)``.

        Args:
            key: of the pipeline's recipe.
            work: a function of the pipeline, the rows and ``args``.
            X: the rows.
            args: further arguments.

        Raises:
            NotPrepared: ``prepare`` must be called first.
            Exception: raised by the work.
        """
        if key not in self:
            raise NotPrepared(key)
        self._pipelines.move_to_end(key)
        return work(self._pipelines[key], X, *args)


def picklable(error: BaseException) -> BaseException:
    """Return an exception that another process can raise, with its traceback in a note."""
    trace = "".join(traceback.format_exception(error))
    try:
        # Tried here: one that the campaign cannot unpickle counts as an invalid message there, at
        # which the worker is ended and its error is lost.
        copy: BaseException = pickle.loads(pickle.dumps(error))
    except Exception:  # its arguments do not rebuild it
        copy = RuntimeError(f"{type(error).__name__}: {error}")
    copy.add_note(f"In a worker:\n{trace}")
    return copy
