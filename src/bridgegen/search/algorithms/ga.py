"""A genetic algorithm, pymoo's."""

from typing import Any, ClassVar

from bridgegen.search.algorithms.algorithm import Arity
from bridgegen.search.algorithms.genetic import Genetic


class GA(Genetic):
    """Tournament selection, crossover, mutation, and survival of the best.

    Source: Deb and Agrawal (1995), "Simulated binary crossover for continuous search space";
    elitist survival of parents and children together, as in pymoo.
    """

    name: ClassVar[str] = "ga"
    description: ClassVar[str] = "genetic algorithm of one objective (pymoo)"
    source: ClassVar[str] = "Deb and Agrawal (1995), Complex Systems 9(2)"
    objectives: ClassVar[Arity] = "one"

    def _algorithm(self, **parts: Any) -> Any:
        from pymoo.algorithms.soo.nonconvex import ga

        return ga.GA(**parts)
