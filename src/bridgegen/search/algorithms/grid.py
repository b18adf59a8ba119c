"""Full factorial design: brute force."""

from collections.abc import Mapping
from hashlib import blake2b
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve

BATCH = 40
"""Rows per batch; the results do not depend on it."""

_ROUNDS = 8


class Grid:
    """Every combination of a number of levels per parameter, each once; then it ends.

    Levels are at the centres of equal bins: (k + ½) / levels. The order is a permutation by the
    seed, so that a budget smaller than the grid takes a random sample of it without repetition,
    and not one corner. The permutation is computed, never stored: a Feistel network over the
    pair of indices of the first and the second half of the parameters. Each round adds a hash of
    one half to the other, which is invertible, so that every point occurs exactly once.

    Source: the brute force of the paper's Section I; the network is Luby and Rackoff's (1988).
    """

    name: ClassVar[str] = "grid"
    description: ClassVar[str] = "full factorial grid, in an order shuffled by the seed"
    source: ClassVar[str] = "Luby and Rackoff (1988), doi:10.1137/0217022, for the order"
    settings: ClassVar[Mapping[str, Setting]] = {
        "levels": Setting(3, "values per parameter, at the centres of equal bins", 2, 1000),
    }
    objectives: ClassVar[Arity] = "any"
    asynchronous: ClassVar[bool] = True

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._levels: int = resolve(Grid, problem, seed, settings)["levels"]
        self._n_var, self._key = problem.n_var, str(seed).encode()
        # Python's integers: 30 parameters of 1000 levels are 10^90 points.
        self._sizes = (
            self._levels ** (self._n_var // 2),
            self._levels ** (self._n_var - self._n_var // 2),
        )
        self._next = 0

    def ask(self) -> Float:
        """Return the next points of the grid, none after the last."""
        last = min(self._next + BATCH, self._sizes[0] * self._sizes[1])
        levels = [self._point(index) for index in range(self._next, last)]
        self._next = last
        return (np.array(levels, np.float64).reshape(-1, self._n_var) + 0.5) / self._levels

    def tell(self, U: Float, results: Results) -> None:
        """Ignore the results: the grid is fixed by its levels, its order by the seed."""

    def _point(self, index: int) -> list[int]:
        """Return the levels of the point at ``index`` of the order."""
        halves = list(divmod(index, self._sizes[1]))
        for count in range(_ROUNDS):
            here = count % 2
            shift = self._hash(count, halves[1 - here])
            halves[here] = (halves[here] + shift) % self._sizes[here]
        number = halves[0] * self._sizes[1] + halves[1]
        levels = []
        for _ in range(self._n_var):
            number, level = divmod(number, self._levels)
            levels.append(level)
        return levels

    def _hash(self, count: int, half: int) -> int:
        # 16 bytes longer than the half that it is added to: the remainder is then uniform.
        size = max(self._sizes).bit_length() // 8 + 17
        text, digest = b"%d:%d:%s" % (count, half, self._key), b""
        while len(digest) < size:
            digest += blake2b(b"%d:%s" % (len(digest), text)).digest()
        return int.from_bytes(digest[:size], "big")
