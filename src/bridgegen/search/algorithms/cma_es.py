"""CMA-ES: an evolution strategy that learns the shape of the objective."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve

# --- CMA-ES between two restarts: the search distribution and its update by a generation ---


class Distribution:
    """A normal distribution N(mean, step² C) that learns from ranked generations.

    Source: Hansen (2016), "The CMA evolution strategy: a tutorial", arXiv:1604.00772, with its
    Table 1 for every constant and its active update (negative weights).

    Attributes:
        population: rows of a generation, λ.
        mean: ``(n,)`` float64.
        step: the step size, σ.
        C: ``(n, n)`` float64, symmetric.
        scales: ``(n,)`` float64, the square roots of C's eigenvalues.
        axes: ``(n, n)`` float64, C's eigenvectors in columns.
    """

    def __init__(self, mean: Float, step: float, population: int) -> None:
        """Start with a sphere.

        Args:
            mean: ``(n,)`` float64, n ≥ 1.
            step: > 0.
            population: ≥ 3.
        """
        n = len(mean)
        self.mean, self.step, self.population = mean.copy(), step, population
        self.C, self.axes, self.scales = np.eye(n), np.eye(n), np.ones(n)
        self.generations = 0
        self._path, self._step_path = np.zeros(n), np.zeros(n)
        self._expected = np.sqrt(n) * (1.0 - 1.0 / (4.0 * n) + 1.0 / (21.0 * n * n))
        self._set_constants(n, population)

    def _set_constants(self, n: int, population: int) -> None:
        raw = np.log((population + 1) / 2) - np.log(np.arange(1, population + 1))
        good, bad = raw[: population // 2], raw[population // 2 :]
        mass = good.sum() ** 2 / (good**2).sum()
        bad_mass = bad.sum() ** 2 / (bad**2).sum()
        self._mass = float(mass)
        self._keep_step = (mass + 2) / (n + mass + 5)
        self._damping = 1 + 2 * max(0.0, np.sqrt((mass - 1) / (n + 1)) - 1) + self._keep_step
        self._keep_path = (4 + mass / n) / (n + 4 + 2 * mass / n)
        self._rank_one = 2 / ((n + 1.3) ** 2 + mass)
        self._rank_many = min(
            1 - self._rank_one, 2 * (0.25 + mass + 1 / mass - 2) / ((n + 2) ** 2 + mass)
        )
        limit = min(
            1 + self._rank_one / self._rank_many,
            1 + 2 * bad_mass / (mass + 2),
            (1 - self._rank_one - self._rank_many) / (n * self._rank_many),
        )
        negative = np.where(bad < 0.0, bad, 0.0)
        self._weights = np.concatenate(
            [good / good.sum(), negative * max(limit, 0.0) / max(-negative.sum(), 1e-300)]
        )

    def sample(self, rng: np.random.Generator) -> Float:
        """Return a generation: ``(population, n)`` float64."""
        z = rng.standard_normal((self.population, len(self.mean)))
        rows: Float = self.mean + self.step * ((z * self.scales) @ self.axes.T)
        return rows

    def learn(self, ranked: Float) -> None:
        """Move towards the better rows of a generation.

        Args:
            ranked: ``(population, n)`` float64, the sample, the best first.
        """
        n, chosen = len(self.mean), self.population // 2
        self.generations += 1
        y = (ranked - self.mean) / self.step
        move = self._weights[:chosen] @ y[:chosen]
        self.mean = self.mean + self.step * move

        keep = self._keep_step
        self._step_path = (1 - keep) * self._step_path + np.sqrt(
            keep * (2 - keep) * self._mass
        ) * self._whitened(move)
        length = float(np.linalg.norm(self._step_path))
        grown = 1 - (1 - keep) ** (2 * self.generations)
        going = length / np.sqrt(grown) < (1.4 + 2 / (n + 1)) * self._expected

        keep = self._keep_path
        self._path = (1 - keep) * self._path
        if going:  # else the step size lags behind, and C must not grow instead
            self._path += np.sqrt(keep * (2 - keep) * self._mass) * move
        missing = 0.0 if going else self._rank_one * keep * (2 - keep)
        weights = self._weights.copy()
        lengths = (self._whitened(y[chosen:]) ** 2).sum(axis=1)
        weights[chosen:] *= n / np.maximum(lengths, 1e-300)
        kept = 1 + missing - self._rank_one - self._rank_many * self._weights.sum()
        self.C = (
            kept * self.C
            + self._rank_one * np.outer(self._path, self._path)
            + self._rank_many * (y.T * weights) @ y
        )
        self.step *= float(
            np.exp(min(1.0, self._keep_step / self._damping * (length / self._expected - 1)))
        )
        self.C = (self.C + self.C.T) / 2
        values, self.axes = np.linalg.eigh(self.C)
        self.scales = np.sqrt(np.maximum(values, 0.0))

    def _whitened(self, y: Float) -> Float:
        """Return C^(−½) y, for one row or for several."""
        white: Float = ((y @ self.axes) / np.maximum(self.scales, 1e-300)) @ self.axes.T
        return white

    @property
    def reach(self) -> float:
        """The largest standard deviation of a parameter."""
        return self.step * float(np.sqrt(np.diag(self.C).max()))

    @property
    def degenerate(self) -> bool:
        """Whether the covariance is ill-conditioned (condition number above 1e14)."""
        least, largest = float(self.scales.min()), float(self.scales.max())
        return not (np.isfinite(largest) and least > 1e-7 * largest)


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
