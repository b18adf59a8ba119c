"""Differential evolution, pymoo's, as a search algorithm; pymoo comes with BridgeGen.

bridgegen benchmark algorithms crossroads-s4 --algorithms pso,docs/examples/pymoo_search.py:DE
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np
from pymoo.algorithms.soo.nonconvex import de
from pymoo.core.evaluator import Evaluator
from pymoo.core.problem import Problem as Space
from pymoo.core.termination import NoTermination
from pymoo.problems.static import StaticProblem

from bridgegen.search.algorithms import Problem, Results, Setting
from bridgegen.search.algorithms.algorithm import resolve


class DE:
    name: ClassVar[str] = "pymoo-de"
    description: ClassVar[str] = "differential evolution (pymoo)"
    source: ClassVar[str] = "Storn and Price (1997), doi:10.1023/A:1008202821328"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "rows per batch", 4, 10_000)
    }
    objectives: ClassVar[str] = "one"

    def __init__(self, problem: Problem, seed: int, **settings: bool | int | float | str) -> None:
        population = resolve(DE, problem, seed, settings)["population"]
        self.space = Space(n_var=problem.n_var, n_obj=1, xl=0.0, xu=1.0)
        self.search = de.DE(pop_size=population)
        self.search.setup(self.space, termination=NoTermination(), seed=seed)

    def ask(self) -> np.ndarray:
        self.asked = self.search.ask()
        return np.clip(self.asked.get("X"), 0.0, 1.0)

    def tell(self, U: np.ndarray, results: Results) -> None:
        F = np.where(results.ok & np.isfinite(results.F[:, 0]), results.F[:, 0], 1e9)
        Evaluator().eval(StaticProblem(self.space, F=F[:, None]), self.asked)
        self.search.tell(infills=self.asked)
