"""A worker's own side: what it has made from recipes, and works with."""

import pickle
import traceback
from collections import OrderedDict
from typing import Any

from bridgegen.arrays import Float
from bridgegen.workers.recipe import Recipe

KEPT = 8
"""A worker that several campaigns share keeps what so many recipes made, the latest used."""


class Unprepared(Exception):
    """What the work is to be done with has not been made here, or not been kept."""


class Bench:
    """What a worker works with, by the keys of the recipes that made it."""

    def __init__(self) -> None:
        self._made: OrderedDict[str, Any] = OrderedDict()

    def holds(self, key: str) -> bool:
        """Whether a recipe has been made, and kept."""
        return key in self._made

    def prepare(self, recipe: Recipe) -> None:
        """Make what a recipe says, if it is not there.

        Raises:
            Exception: whatever making it raises.
        """
        if not self.holds(recipe.key):
            made = recipe.make()
            while len(self._made) >= KEPT:
                self._made.popitem(last=False)
            self._made[recipe.key] = made

    def work(self, key: str, work: str, X: Float, given: tuple[Any, ...]) -> Any:
        """Return what comes of rows.

        Args:
            key: of the recipe.
            work: a method's name.
            X: the rows.
            given: to the method, besides.

        Raises:
            Unprepared: the recipe has to be prepared first.
            Exception: whatever the work raises.
        """
        if not self.holds(key):
            raise Unprepared(key)
        self._made.move_to_end(key)
        return getattr(self._made[key], work)(X, *given)


def portable(error: BaseException) -> BaseException:
    """Return an exception as it can be raised elsewhere, its traceback told in a note."""
    told = "".join(traceback.format_exception(error))
    try:
        again: BaseException = pickle.loads(pickle.dumps(error))
    except Exception:  # one that cannot be made from its arguments
        again = RuntimeError(f"{type(error).__name__}: {error}")
    again.add_note(f"In a worker:\n{told}")
    return again
