"""Base of pymoo's genetic algorithms: crossover and mutation."""

from abc import abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from bridgegen.search.algorithms.algorithm import RESTART_WITHIN, Setting
from bridgegen.search.algorithms.evolved import Evolved


class Genetic(Evolved):
    """A population whose parents are crossed and whose children are mutated.

    Crossover is simulated binary, mutation polynomial (each parameter with probability 1/n of a
    mutated child, or 1/2 where n is one or two); a child that is a known individual is not
    evaluated again. Selection and survival are each algorithm's own.

    Source: Deb and Agrawal (1995), "Simulated binary crossover for continuous search space".
    """

    asynchronous: ClassVar[bool] = True
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "individuals, and rows per batch", low=4, high=100_000),
        "crossover": Setting(0.9, "probability that two parents are crossed", 0.0, 1.0),
        "crossover_eta": Setting(15.0, "how close children stay to their parents", 0.0, 1000.0),
        "mutation": Setting(0.9, "probability that a child is mutated", 0.0, 1.0),
        "mutation_eta": Setting(20.0, "how little a mutated parameter moves", 0.0, 1000.0),
        "restart_within": RESTART_WITHIN,
    }

    def _build(self) -> Any:
        from pymoo.operators.crossover.sbx import SBX
        from pymoo.operators.mutation.pm import PM

        values = self._values
        return self._algorithm(
            pop_size=values["population"],
            crossover=SBX(prob=values["crossover"], eta=values["crossover_eta"]),
            mutation=PM(prob=values["mutation"], eta=values["mutation_eta"]),
        )

    @abstractmethod
    def _algorithm(self, **parts: Any) -> Any:
        """Return pymoo's algorithm, not yet set up, with a population size and operators."""
