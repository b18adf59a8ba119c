"""Number of different critical scenarios of a run."""

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.jobs.compare.options import APART
from bridgegen.scenario.language.space import SearchSpace

LIMIT = 10_000
"""Maximum number of different scenarios that are counted per run: it bounds the time."""

_CHUNK = 256


def normalised(space: SearchSpace, X: Float) -> Float:
    """Return points whose distances are those of the searched parameters.

    A parameter becomes its share of the declared range, or what its kind defines.

    Args:
        space: the search space.
        X: ``(N, len(space.names))``.

    Returns:
        ``(N, k)`` float64, k at least ``space.n_var``; no parameter differs by more than 1.
    """
    parts = [np.empty((len(X), 0))]
    for name in space.variables:
        one = space.parameters[name]
        parts.append(one.kind.coordinates(X[:, space.index(name)], one.low, one.high))
    return np.concatenate(parts, axis=1)


def distinct(
    points: Float, apart: float = APART, limit: int = LIMIT, n_var: int | None = None
) -> Bool:
    """Return which points are new: at least ``apart`` from every new one before them.

    A greedy net, in the order of the points: new points lie apart from one another, and every
    point is closer than ``apart`` to one of them; so another order may find a few more or fewer.
    Clusters by single linkage would not depend on the order, but a search that fills the space
    evenly would be one cluster, and count as one scenario.

    Args:
        points: ``(N, d)`` float64, as `normalised` returns them.
        apart: the root mean square of the parameters' differences.
        limit: maximum number of new points.
        n_var: number of parameters; d by default.

    Returns:
        ``(N,)`` bool; after the limit has been reached, False.
    """
    from scipy.spatial.distance import cdist

    new = np.zeros(len(points), np.bool_)
    if not points.size:
        new[: min(len(points), 1)] = True
        return new
    least = apart * np.sqrt(n_var or points.shape[1])
    centres = np.empty((min(len(points), limit), points.shape[1]))
    count = 0
    for start in range(0, len(points), _CHUNK):
        chunk = points[start : start + _CHUNK]
        free = np.ones(len(chunk), np.bool_)
        if count:
            free = cdist(chunk, centres[:count]).min(axis=1) >= least
        open_ones = np.flatnonzero(free)
        among = cdist(chunk[open_ones], chunk[open_ones]) < least
        covered = np.zeros(len(open_ones), np.bool_)
        for k, at in enumerate(open_ones.tolist()):
            if covered[k]:
                continue
            if count == limit:
                return new
            new[start + at], centres[count] = True, chunk[at]
            count += 1
            covered |= among[k]
    return new
