"""Random sampling, the baseline."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve


class Random:
    """Independent rows, uniform in the unit cube.

    Source: paper, Section IV-E (RS), Table IV: 25 iterations of 40.
    """

    name: ClassVar[str] = "random"
    description: ClassVar[str] = "random sampling: independent, uniform rows; the baseline"
    source: ClassVar[str] = "BridgeGen paper, Section IV-E (RS)"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "rows per batch", low=1, high=1_000_000),
    }
    objectives: ClassVar[Arity] = "any"
    asynchronous: ClassVar[bool] = True

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        values = resolve(Random, problem, seed, settings)
        self._shape = (values["population"], problem.n_var)
        # The bit generator is named: NumPy may change what default_rng returns.
        self._rng = np.random.Generator(np.random.PCG64(seed))

    def ask(self) -> Float:
        """Return the next batch of rows."""
        return self._rng.random(self._shape)

    def tell(self, U: Float, results: Results) -> None:
        """Ignore the results: this is the baseline."""
