"""SPEA2, pymoo's."""

from collections.abc import Mapping
from typing import Any, ClassVar

from bridgegen.arrays import Float
from bridgegen.search.algorithm import (
    RESTART_WITHIN,
    Arity,
    Problem,
    Results,
    Setting,
    Value,
    resolve,
)


class SPEA2:
    """Individuals survive by how many they and their betters dominate, then by distance to others.

    Crossover is simulated binary, mutation polynomial (each parameter with probability 1/n of a
    mutated child, or 1/2 where n is one or two); a child that is a known individual is not
    evaluated again.

    Source: Zitzler, Laumanns and Thiele (2001), "SPEA2: Improving the strength Pareto evolutionary
    algorithm".
    """

    name: ClassVar[str] = "spea2"
    description: ClassVar[str] = "strength Pareto evolutionary algorithm 2, many objectives (pymoo)"
    source: ClassVar[str] = (
        "Zitzler, Laumanns and Thiele (2001), TIK report 103, doi:10.3929/ethz-a-004284029"
    )
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "individuals, and rows per batch", low=4, high=100_000),
        "crossover": Setting(0.9, "probability that two parents are crossed", 0.0, 1.0),
        "crossover_eta": Setting(15.0, "how close children stay to their parents", 0.0, 1000.0),
        "mutation": Setting(0.9, "probability that a child is mutated", 0.0, 1.0),
        "mutation_eta": Setting(20.0, "how little a mutated parameter moves", 0.0, 1000.0),
        "restart_within": RESTART_WITHIN,
    }
    objectives: ClassVar[Arity] = "many"

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        from bridgegen.search._pymoo import Generations

        self._values = resolve(SPEA2, problem, seed, settings)
        within = self._values["restart_within"]
        self._search = Generations(self._build, problem, seed, within, scaled=True)

    def _build(self) -> Any:
        from pymoo.algorithms.moo import spea2
        from pymoo.operators.crossover.sbx import SBX
        from pymoo.operators.mutation.pm import PM

        values = self._values
        return spea2.SPEA2(
            pop_size=values["population"],
            survival=spea2.SPEA2Survival(normalize=False),
            crossover=SBX(prob=values["crossover"], eta=values["crossover_eta"]),
            mutation=PM(prob=values["mutation"], eta=values["mutation_eta"]),
        )

    def ask(self) -> Float:
        """Return the next generation, one row each."""
        return self._search.ask()

    def tell(self, U: Float, results: Results) -> None:
        """Select who lives on.

        Raises:
            ValueError: U is not what was last asked.
        """
        self._search.tell(U, results)
