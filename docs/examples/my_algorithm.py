"""A search algorithm of one's own: half of each batch is random, half steps away from harm.

A package declares it (docs/algorithms.md), then: bridgegen search cut-in --algorithm neighbours
"""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bridgegen.search.algorithms import Problem, Results, Setting
from bridgegen.search.algorithms.algorithm import resolve


class Neighbours:
    name: ClassVar[str] = "neighbours"
    description: ClassVar[str] = "random rows, and neighbours of the most critical ones so far"
    source: ClassVar[str] = "BridgeGen's documentation"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "rows per batch", 2, 10_000),
        "parents": Setting(20, "how many of the most critical rows have neighbours", 1, 10_000),
        "step": Setting(0.1, "standard deviation of a step, as a share of each range", 0.0, 1.0),
    }
    objectives: ClassVar[str] = "one"  # "many": a column of F per metric; "any": not looked at

    def __init__(self, problem: Problem, seed: int, **settings: bool | int | float | str) -> None:
        values = resolve(Neighbours, problem, seed, settings)  # checks all, adds the defaults
        self.n, self.parents, self.step = values["population"], values["parents"], values["step"]
        self.rng = np.random.default_rng(seed)  # the only source of chance: a run can be resumed
        self.best, self.F = np.empty((0, problem.n_var)), np.empty(0)
        self.n_var = problem.n_var

    def ask(self) -> np.ndarray:
        U = self.rng.random((self.n, self.n_var))
        if len(self.best):
            near = self.best[self.rng.integers(len(self.best), size=self.n // 2)]
            steps = self.step * self.rng.standard_normal(near.shape)
            U[: len(near)] = np.clip(near + steps, 0.0, 1.0)
        return U

    def tell(self, U: np.ndarray, results: Results) -> None:
        ok = results.ok  # a failed simulation has no F
        rows, F = np.concatenate([self.best, U[ok]]), np.append(self.F, results.F[ok, 0])
        order = np.argsort(F, kind="stable")[: self.parents]  # F is minimised
        self.best, self.F = rows[order], F[order]

    def notes(self) -> dict[str, object]:  # optional: kept with the run and shown in its report
        return {"the most critical objectives": self.F.tolist()}
