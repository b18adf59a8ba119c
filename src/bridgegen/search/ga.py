"""A genetic algorithm, pymoo's."""

from typing import Any, ClassVar

from bridgegen.search.algorithm import Arity
from bridgegen.search.genetic import Genetic


class GA(Genetic):
    """A population that is selected by tournament, crossed, mutated, and thinned to the best.

    Source: Deb and Agrawal (1995), "Simulated binary crossover for continuous search space";
    elitist survival of parents and children together, as pymoo has it.
    """

    name: ClassVar[str] = "ga"
    description: ClassVar[str] = "genetic algorithm of one objective (pymoo)"
    source: ClassVar[str] = "Deb and Agrawal (1995), Complex Systems 9(2)"
    objectives: ClassVar[Arity] = "one"

    def _made_of(self, **parts: Any) -> Any:
        from pymoo.algorithms.soo.nonconvex import ga

        return ga.GA(**parts)
