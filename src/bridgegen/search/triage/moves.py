"""Feasible rows near a row: values moved slightly, or towards nominal."""

import numpy as np

from bridgegen.base.arrays import Float, as_float
from bridgegen.scenario.language.space import SearchSpace

_STREAM = 17  # a random stream of its own under the seed


def nearest(space: SearchSpace, V: Float) -> Float:
    """Return the feasible rows of X whose searched parameters are nearest to wanted values.

    The parameters are taken in the decoder's order, each moved into the interval that the earlier
    ones leave to it, as its kind does it: whole numbers are rounded, angles go round. Feasible
    values are kept to the last bit.

    Args:
        space: the search space.
        V: ``(N, n_var)`` wanted values of the searched parameters.

    Returns:
        ``(N, len(space.names))``, feasible.

    Raises:
        ValueError: wrong shape, NaN or inf.
    """
    wanted = as_float("V", V, (None, space.n_var))
    number = {name: k for k, name in enumerate(space.variables)}
    table: dict[str, Float | float] = {}
    X = np.empty((len(wanted), len(space.names)))
    # In the decoder's order: a bound of a parameter may depend on those before it.
    for name in space.order:
        if name in space.derived:
            value: Float | float = space.derived[name].value.evaluate(table)
        else:
            lo, hi = space.interval(name, table)
            if name in number:
                value = space.parameters[name].kind.nearest(wanted[:, number[name]], lo, hi)
            else:
                value = np.minimum(np.maximum(space.defaults[name], lo), hi)
        table[name] = value
        X[:, space.index(name)] = value
    return X + 0.0  # no −0.0: simulated rows equal recorded rows


def searched(space: SearchSpace, X: Float) -> Float:
    """Return the searched columns of X, ``(N, n_var)``."""
    return X[:, [space.index(name) for name in space.variables]]


def ranges(space: SearchSpace) -> Float:
    """Return high − low of every searched parameter, ``(n_var,)``, > 0."""
    parameters = (space.parameters[name] for name in space.variables)
    return np.array([parameter.high - parameter.low for parameter in parameters])


def around(space: SearchSpace, x: Float, seed: int, number: int, n: int, radius: float) -> Float:
    """Return two sets of n neighbours of a row: the second is one more random move of the first.

    Each searched parameter moves by at most ``radius`` of its range, uniformly; whole numbers
    move only where that is half of one or more, categories never.

    Args:
        space: the search space.
        x: ``(len(space.names),)``, feasible.
        seed: of the run.
        number: of the row, for the random numbers.
        n: neighbours.
        radius: a share of each parameter's range.

    Returns:
        ``(2, n, len(space.names))``, feasible.
    """
    random = np.random.Generator(np.random.PCG64([seed, _STREAM, number]))
    by = (2.0 * random.random((2, n, space.n_var)) - 1.0) * radius * reaches(space)
    first = nearest(space, searched(space, x[np.newaxis]) + by[0])
    return np.stack([first, nearest(space, searched(space, first) + by[1])])


def reaches(space: SearchSpace) -> Float:
    """Return the range of which each searched parameter of a neighbour moves by a share."""
    parameters = (space.parameters[name] for name in space.variables)
    return np.array(
        [parameter.kind.reach(parameter.low, parameter.high) for parameter in parameters]
    )
