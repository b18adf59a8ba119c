"""Pairwise covering array: every pair of levels of any two parameters, in few rows."""

from collections.abc import Mapping
from itertools import islice
from typing import Any, ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve

BATCH = 40
"""Number of rows per batch; the results do not depend on it."""


class Pairwise:
    """A covering array of strength two, allpairspy's; then it ends.

    For any two parameters and any level of each, some row has both. Levels are at the centres of
    equal bins: (k + ½) / levels. The library's array is deterministic; the seed permutes its
    columns and the levels within each, which preserves the coverage. Its order is kept: it is
    greedy, so that a budget smaller than the array still covers many pairs. Where constraints
    narrow a parameter's interval, levels are shares of the rest.

    Source: Czerwonka (2006), "Pairwise testing in the real world".
    """

    name: ClassVar[str] = "pairwise"
    description: ClassVar[str] = "covering array of all pairs of levels (allpairspy)"
    source: ClassVar[str] = 'Czerwonka (2006), "Pairwise testing in the real world", PNSQC'
    settings: ClassVar[Mapping[str, Setting]] = {
        "levels": Setting(5, "values per parameter, at the centres of equal bins", 2, 100),
    }
    objectives: ClassVar[Arity] = "any"
    asynchronous: ClassVar[bool] = True

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._levels: int = resolve(Pairwise, problem, seed, settings)["levels"]
        rng = np.random.Generator(np.random.PCG64(seed))
        self._columns = rng.permutation(problem.n_var)
        self._names = rng.permuted(np.tile(np.arange(self._levels), (problem.n_var, 1)), axis=1)
        self._array: Any
        if problem.n_var == 1:
            self._array = ([level] for level in range(self._levels))
        else:
            from allpairspy import AllPairs

            self._array = AllPairs([range(self._levels)] * problem.n_var)

    def ask(self) -> Float:
        """Return the next rows of the array, none after the last."""
        rows = np.array(list(islice(self._array, BATCH)), np.int64).reshape(-1, len(self._columns))
        renamed = self._names[np.arange(len(self._columns)), rows[:, self._columns]]
        U: Float = (renamed + 0.5) / self._levels
        return U

    def tell(self, U: Float, results: Results) -> None:
        """Ignore the results: the array is fixed by its levels and the seed."""
