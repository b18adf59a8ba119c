"""NSGA-II, pymoo's."""

from typing import Any, ClassVar

from bridgegen.search.algorithms.algorithm import Arity
from bridgegen.search.algorithms.genetic import Genetic


class NSGA2(Genetic):
    """Individuals survive by the rank of their non-dominated front, then by crowding.

    Source: Deb, Pratap, Agarwal and Meyarivan (2002), "A fast and elitist multiobjective genetic
    algorithm: NSGA-II".
    """

    name: ClassVar[str] = "nsga2"
    description: ClassVar[str] = (
        "non-dominated sorting genetic algorithm II, many objectives (pymoo)"
    )
    source: ClassVar[str] = "Deb et al. (2002), doi:10.1109/4235.996017"
    objectives: ClassVar[Arity] = "many"

    def _algorithm(self, **parts: Any) -> Any:
        from pymoo.algorithms.moo import nsga2

        return nsga2.NSGA2(**parts)
