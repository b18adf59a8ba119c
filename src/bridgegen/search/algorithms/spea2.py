"""SPEA2, pymoo's."""

from typing import Any, ClassVar

from bridgegen.search.algorithms.algorithm import Arity
from bridgegen.search.algorithms.genetic import Genetic


class SPEA2(Genetic):
    """Individuals survive by strength (how many their dominators dominate), then by density.

    Source: Zitzler, Laumanns and Thiele (2001), "SPEA2: Improving the strength Pareto evolutionary
    algorithm".
    """

    name: ClassVar[str] = "spea2"
    description: ClassVar[str] = "strength Pareto evolutionary algorithm 2, many objectives (pymoo)"
    source: ClassVar[str] = (
        "Zitzler, Laumanns and Thiele (2001), TIK report 103, doi:10.3929/ethz-a-004284029"
    )
    objectives: ClassVar[Arity] = "many"
    scaled: ClassVar[bool] = True

    def _algorithm(self, **parts: Any) -> Any:
        from pymoo.algorithms.moo import spea2

        return spea2.SPEA2(survival=spea2.SPEA2Survival(normalize=False), **parts)
