"""Sobol sequence: random sampling without its clusters and holes."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve


class Sobol:
    """A low-discrepancy sequence, scrambled by the seed; SciPy's.

    Batches are stretches of one sequence, so their size does not change its rows. The sequence is
    balanced best where the budget is a power of two (512, 1024).

    Source: Sobol' (1967), scrambled as in Matoušek (1998).
    """

    name: ClassVar[str] = "sobol"
    description: ClassVar[str] = "scrambled Sobol sequence: evenly spread rows (SciPy)"
    source: ClassVar[str] = "Sobol' (1967), doi:10.1016/0041-5553(67)90144-9"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "rows per batch", low=1, high=1_000_000),
    }
    objectives: ClassVar[Arity] = "any"
    asynchronous: ClassVar[bool] = True

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._population = resolve(Sobol, problem, seed, settings)["population"]
        from scipy.stats import qmc  # takes a second to import

        rng = np.random.Generator(np.random.PCG64(seed))
        self._sequence = qmc.Sobol(problem.n_var, scramble=True, rng=rng)

    def ask(self) -> Float:
        """Return the next stretch of the sequence."""
        # One row first: SciPy warns of a first draw whose size is not a power of two.
        parts = self._sequence.random(1), self._sequence.random(self._population - 1)
        return np.concatenate(parts)

    def tell(self, U: Float, results: Results) -> None:
        """Ignore the results: the sequence is fixed by the seed."""
