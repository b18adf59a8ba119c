"""Samples that cover the whole range of every parameter."""

import numpy as np

from bridgegen.arrays import Float


def latin_hypercube(rng: np.random.Generator, n: int, n_var: int) -> Float:
    """Return n rows, one in each n-th of every column: ``(n, n_var)`` float64 in [0, 1).

    Source: McKay, Beckman and Conover (1979), doi:10.1080/00401706.1979.10489755.
    """
    strata = rng.permuted(np.tile(np.arange(n), (n_var, 1)), axis=1).T
    rows: Float = (strata + rng.random((n, n_var))) / max(n, 1)
    return rows
