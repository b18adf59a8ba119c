"""Rows that differ from each other."""

from collections.abc import Sequence

import numpy as np

from bridgegen.base.arrays import Float, Int

DISTINCT = (0.2, 0.1)
"""Two kept scenarios differ by at least this much: root mean square over what happened in them, or
over the searched parameters, each scaled to 0..1. The second distance counts where too few differ
by the first."""

COPY = 1e-3
"""Rows that are nearer to each other are the same."""


def apart(U: Float, u: Float) -> Float:
    """Return the distance of rows ``(N, n_var)`` from one ``(n_var,)``, ``(N,)`` in [0, 1]."""
    if not U.shape[1]:
        return np.zeros(len(U))
    distance: Float = np.sqrt(((U - u) ** 2).mean(axis=1))
    return distance


def distinct(U: Float, order: Int, keep: int, kept: Sequence[int] = ()) -> list[int]:
    """Return the first rows of an order that differ from each other, and from those kept already.

    Args:
        U: ``(N, n)`` coordinates, scaled to 0..1.
        order: positions in U, the best first.
        keep: how many at most, those kept already included.
        kept: positions of rows that are kept in any case.

    Returns:
        The positions of the further rows, those that differ most first.
    """
    chosen = list(kept)
    for distance in DISTINCT:
        near = np.zeros(len(order), dtype=bool)
        for row in chosen:
            near |= apart(U[order], U[row]) < distance
        rest = order[~near]
        while len(rest) and len(chosen) < keep:
            best = int(rest[0])
            chosen.append(best)
            rest = rest[apart(U[rest], U[best]) >= distance]
    return chosen[len(kept) :]
