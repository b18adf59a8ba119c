"""Sampling without feedback: random, Sobol, the full grid."""

from collections.abc import Mapping
from hashlib import blake2b
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve

# --- Random sampling, the baseline ---


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


# --- Sobol sequence: random sampling without its clusters and holes ---


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


# --- Full factorial design: brute force ---


BATCH = 40
"""Number of rows per batch; the results do not depend on it."""

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


# --- Samples that cover the whole range of every parameter ---


def latin_hypercube(rng: np.random.Generator, n: int, n_var: int) -> Float:
    """Return n rows, one in each n-th of every column: ``(n, n_var)`` float64 in [0, 1).

    Source: McKay, Beckman and Conover (1979), doi:10.1080/00401706.1979.10489755.
    """
    strata = rng.permuted(np.tile(np.arange(n), (n_var, 1)), axis=1).T
    rows: Float = (strata + rng.random((n, n_var))) / max(n, 1)
    return rows


def sobol_rows(rng: np.random.Generator, n: int, n_var: int) -> Float:
    """Return the first n rows of a scrambled Sobol sequence: ``(n, n_var)`` float64 in [0, 1).

    Args:
        rng: draws the scrambling.
        n: a power of two.
        n_var: number of columns.
    """
    from scipy.stats import qmc  # takes a second to import

    # SciPy spawns from the generator that it is given, which would not be part of rng's state.
    own = np.random.Generator(np.random.PCG64(rng.integers(2**63)))
    rows: Float = qmc.Sobol(n_var, scramble=True, rng=own).random(n)
    return rows
