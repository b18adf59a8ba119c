"""CMA-ES: an evolution strategy that learns the shape of the objective."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms._cma import Distribution
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve


class CMAES:
    """A normal distribution that moves, stretches and turns towards the better rows.

    This is an own implementation: packages on PyPI refuse one parameter, and one of them draws from
    NumPy's global generator. Rows outside the cube are reflected into it, while the distribution
    learns from the unreflected ones: the objective continues as its mirror image, so that an
    optimum in a corner, where many critical scenarios are, is no harder to approach than one
    inside.

    It restarts, anywhere in the cube, when it has contracted, when its axes differ too much, or
    when nothing improves; restarts alternate between large searches, with twice as many rows per
    generation each time, and small, more local ones, whichever have had fewer evaluations.

    Source: Hansen (2016), arXiv:1604.00772; restarts: Hansen (2009), "Benchmarking a
    BI-population CMA-ES on the BBOB-2009 function testbed"; reflection, among other ways, in
    Biedrzycki (2020), doi:10.1016/j.swevo.2019.100627.
    """

    name: ClassVar[str] = "cma-es"
    description: ClassVar[str] = "covariance matrix adaptation ES of one objective, BIPOP restarts"
    source: ClassVar[str] = "Hansen (2016), arXiv:1604.00772; Hansen (2009), BBOB, for restarts"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(
            0, "rows per batch of the first search; 0: 4 + 3 ln(parameters)", 0, 100_000
        ),
        "step": Setting(0.3, "initial standard deviation, as a share of each range", 0.01, 1.0),
        "restart_within": Setting(
            1e-3,
            "restart once its standard deviation is this small, as a share of every "
            "parameter's range",
            1e-12,
            1.0,
        ),
    }
    objectives: ClassVar[Arity] = "one"

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        values = resolve(CMAES, problem, seed, settings)
        self._n_var, self._step = problem.n_var, float(values["step"])
        self._within = float(values["restart_within"])
        # With fewer than three rows there is none to move away from.
        self._first = max(3, values["population"] or 4 + int(3 * np.log(problem.n_var)))
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._large = self._first
        self._spent = {"first": 0, "large": 0, "small": 0}
        self._begin("first", self._first, self._step)

    def _begin(self, kind: str, population: int, step: float, most: float = np.inf) -> None:
        """Start a search anywhere, of at most ``most`` evaluations."""
        self._kind, self._most, self._used = kind, most, 0
        self._search = Distribution(self._rng.random(self._n_var), step, population)
        self._best: list[float] = []

    def _restart(self) -> None:
        """Start a large or a small search, whichever kind has had fewer evaluations."""
        if self._spent["large"] <= self._spent["small"]:
            self._large = min(2 * self._large, 2**9 * self._first)
            self._begin("large", self._large, self._step)
            return
        shrink, share = self._rng.random(2)
        population = max(3, int(self._first * (self._large / self._first / 2) ** (share * share)))
        most = self._spent["large"] / 2
        self._begin("small", population, self._step * 10 ** (-2 * shrink), most)

    def ask(self) -> Float:
        """Return the next generation, one row each."""
        self._drawn = self._search.sample(self._rng)
        return reflected(self._drawn)

    def tell(self, U: Float, results: Results) -> None:
        """Rank the generation, those without a result last, and learn from it."""
        F = np.where(results.ok & np.isfinite(results.F[:, 0]), results.F[:, 0], np.inf)
        self._used += len(F)
        self._spent[self._kind] += len(F)
        self._search.learn(self._drawn[np.argsort(F, kind="stable")])
        n, rows = self._n_var, self._search.population
        patience = 10 + int(np.ceil(30 * n / rows))
        self._best = [*self._best[1 - patience :], float(F.min())]
        if (
            self._search.reach < self._within
            or (len(self._best) == patience and min(self._best) == max(self._best))
            or self._search.generations > 100 + 50 * (n + 3) ** 2 / np.sqrt(rows)
            or self._search.degenerate
            or self._used >= self._most
        ):
            self._restart()


def reflected(rows: Float) -> Float:
    """Return rows with values outside [0, 1] mirrored at the faces, as often as needed."""
    inside: Float = 1.0 - np.abs(1.0 - np.mod(rows, 2.0))
    return inside
