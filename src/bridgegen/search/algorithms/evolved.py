"""Base of the algorithms built on pymoo's populations: a generation is a batch."""

from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import (
    Arity,
    Problem,
    Results,
    Setting,
    Value,
    asynchronous,
    resolve,
)


class Evolved(ABC):
    """A population that changes from generation to generation; restarts when it has converged.

    Attributes:
        scaled: whether it measures distances between objectives, which then need one scale.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    source: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]]
    objectives: ClassVar[Arity]
    scaled: ClassVar[bool] = False

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        from bridgegen.search.algorithms._pymoo import Generations

        self._values = resolve(type(self), problem, seed, settings)
        within = self._values["restart_within"]
        self._search = Generations(
            self._build, problem, seed, within, scaled=self.scaled,
            asynchronous=asynchronous(type(self)),
        )  # fmt: skip

    @abstractmethod
    def _build(self) -> Any:
        """Return pymoo's algorithm, not yet set up."""

    def ask(self) -> Float:
        """Return the next generation, one row each."""
        return self._search.ask()

    def tell(self, U: Float, results: Results) -> None:
        """Select the survivors, or the next moves, by the rows' results.

        Raises:
            ValueError: U are not the first rows that were asked for and are not told.
        """
        self._search.tell(U, results)
