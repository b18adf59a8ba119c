"""Samples that cover the whole range of every parameter."""

import numpy as np

from bridgegen.base.arrays import Float


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
