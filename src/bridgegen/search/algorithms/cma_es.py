"""CMA-ES: an evolution strategy that learns the shape of the objective."""

from collections.abc import Mapping
from typing import Any, ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import (
    Arity,
    Penalty,
    Problem,
    Results,
    Setting,
    Value,
    resolve,
)

LEAST = 4
"""Least number of rows of a generation: with fewer, a single row would make the next
distribution."""


class CMAES:
    """A normal distribution that moves, stretches and turns towards the better rows.

    Each search is one of the package ``cmaes``; what surrounds it is here. Rows outside the cube
    are reflected into it, while the distribution learns from the unreflected ones: the objective
    continues as its mirror image, so that an optimum in a corner, where many critical scenarios
    are, is no harder to approach than one inside.

    It restarts, anywhere in the cube, when it has contracted, when nothing improves, or when the
    package advises it, as where its axes differ too much; restarts alternate between large
    searches, with twice as many rows per generation each time, and small, more local ones,
    whichever have had fewer evaluations.

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
        self._first = max(LEAST, values["population"] or 4 + int(3 * np.log(problem.n_var)))
        self._penalty = Penalty(1)
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._large = self._first
        self._spent = {"first": 0, "large": 0, "small": 0}
        self._begin("first", self._first, self._step)

    def _begin(self, kind: str, population: int, step: float, most: float = np.inf) -> None:
        """Start a search anywhere, of at most ``most`` evaluations."""
        self._kind, self._most, self._used = kind, most, 0
        from cmaes import CMA  # loads a part of SciPy

        # `cmaes` has a generator of its own: its seed is drawn from ours, so that restarts are part
        # of one sequence and the whole follows from the run's seed.
        mean, seed = self._rng.random(self._n_var), int(self._rng.integers(2**32))
        self._search: Any = CMA(mean, step, seed=seed, population_size=population)
        self._best: list[float] = []

    def _restart(self) -> None:
        """Start a large or a small search, whichever kind has had fewer evaluations."""
        # BIPOP: both regimes are given the same number of evaluations (Hansen 2009, section 2).
        if self._spent["large"] <= self._spent["small"]:
            # At most nine doublings (Hansen 2009).
            self._large = min(2 * self._large, 2**9 * self._first)
            self._begin("large", self._large, self._step)
            return
        shrink, share = self._rng.random(2)
        population = max(
            LEAST, int(self._first * (self._large / self._first / 2) ** (share * share))
        )
        most = self._spent["large"] / 2
        self._begin("small", population, self._step * 10 ** (-2 * shrink), most)

    def ask(self) -> Float:
        """Return the next generation, one row each."""
        # The distribution learns from the rows as drawn, not as reflected: so the objective goes on
        # as its mirror image beyond a face, and an optimum in a corner is no harder than one
        # inside.
        self._drawn = np.array([self._search.ask() for _ in range(self._search.population_size)])
        # `tell` needs the mean that this generation was drawn around; `cmaes` moves it.
        self._mean = self._search.mean.copy()
        return reflected(self._drawn)

    def tell(self, U: Float, results: Results) -> None:
        """Let the distribution learn from the generation; rows without a result are its worst."""
        F = self._penalty.apply(results.F, results.ok)[0][:, 0]
        self._used += len(F)
        self._spent[self._kind] += len(F)
        self._search.tell(list(zip(self._drawn, F.tolist(), strict=True)))
        n, rows = self._n_var, len(F)
        deviations = np.sqrt(((self._drawn - self._mean) ** 2).mean(axis=0))
        # A history of equal values (arXiv:1604.00772, B.3).
        patience = 10 + int(np.ceil(30 * n / rows))
        self._best = [*self._best[1 - patience :], float(F.min())]
        if (
            deviations.max() < self._within
            or (len(self._best) == patience and min(self._best) == max(self._best))
            or self._search.generation > 100 + 50 * (n + 3) ** 2 / np.sqrt(rows)
            or self._search.should_stop()
            or self._used >= self._most
        ):
            self._restart()


def reflected(rows: Float) -> Float:
    """Return rows with values outside [0, 1] mirrored at the faces, as often as needed."""
    inside: Float = 1.0 - np.abs(1.0 - np.mod(rows, 2.0))
    return inside
