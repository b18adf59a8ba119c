"""Rows of the search space inside a box, as likely as random search would meet each there.

Random search draws points of the unit cube and decodes them. Most miss a small box. Here each
searched parameter takes only the shares that put it into the box, in the decoder's order, so that
what comes before it is known; how many of all shares these are is the chance that a blind draw
would have stayed in the box. Where constraints couple parameters, that chance differs from row to
row, and a row is kept with a probability in proportion to it: its chance over the largest of all
rows proposed. What is kept has the distribution of blind draws that happen to be in the box, and
the mean chance is the box's share of the space.
Source: rejection sampling by the empirical supremum, B. Caffo, J. Booth and A. Davis, Biometrika
89 (2002); exact but for rows rarer than one in all that are proposed.
"""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, as_float
from bridgegen.scenario.language.space import SearchSpace

MOST = 2**21
"""Largest number of rows that are proposed for one box."""

_LEAST = 2**14  # rows that are proposed at least: so many look for the largest chance
_AT_ONCE = 4096


@dataclass(frozen=True)
class Drawn:
    """Rows in a box.

    Attributes:
        X: ``(n, len(space.names))`` float64, independent of each other; fewer than asked for where
            the constraints leave the box next to nothing.
        share: of the search space's random rows, those that lie in the box; an estimate without
            bias.
    """

    X: Float
    share: float


def in_box(space: SearchSpace, X: Float, low: Float, high: Float) -> Bool:
    """Return which rows lie in a box of the searched parameters; both edges count as inside.

    Args:
        space: what is searched.
        X: ``(N, len(space.names))``.
        low: ``(n_var,)``.
        high: ``(n_var,)``.
    """
    columns = X[:, [space.index(name) for name in space.variables]]
    inside: Bool = np.all((low <= columns) & (columns <= high), axis=1)
    return inside


def draw_within(
    space: SearchSpace,
    low: Float,
    high: Float,
    n: int,
    random: np.random.Generator,
    *,
    most: int = MOST,
) -> Drawn:
    """Draw random rows of the search space inside a box.

    Args:
        space: what is searched.
        low: ``(n_var,)``, of the box, inclusive; in the parameters' own units.
        high: likewise, its upper edges.
        n: how many rows.
        random: where all chance comes from.
        most: rows to propose at most.

    Raises:
        ValueError: wrong shape, NaN or inf.
    """
    low = as_float("low", low, (space.n_var,))
    high = as_float("high", high, (space.n_var,))
    kept = np.empty((0, space.n_var))
    lottery, chance = np.empty(0), np.empty(0)
    proposed, total, largest = 0, 0.0, 0.0
    while True:
        V, certain, chances = _narrowed(space, random.random((_AT_ONCE, space.n_var)), low, high)
        proposed += len(V)
        total += certain * float(chances.sum())
        kept = np.concatenate([kept, V])
        chance = np.concatenate([chance, chances if certain > 0.0 else 0.0 * chances])
        lottery = np.concatenate([lottery, random.random(_AT_ONCE)])
        largest = max(largest, float(chances.max()))
        won = lottery * largest < chance  # the earlier ones, too: the largest may have grown
        kept, chance, lottery = kept[won], chance[won], lottery[won]
        last = proposed >= most or not certain > 0.0
        if last or (len(kept) >= n and proposed >= _LEAST):
            X = space.decode(kept)
            X = X[in_box(space, X, low, high)]  # rounding may leave it by a bit
            if last or len(X) >= n:
                return Drawn(X[:n], total / proposed)


def _narrowed(space: SearchSpace, U: Float, low: Float, high: Float) -> tuple[Float, float, Float]:
    """Return points of the cube that decode into a box, and the chance that a blind one does.

    Returns:
        The points ``(N, n_var)``; the part of the chance that is the same for all; the part that
        depends on the row, ``(N,)``, 0 where the point misses the box after all.
    """
    V, certain, chance = U.copy(), 1.0, np.ones(len(U))
    number = {name: k for k, name in enumerate(space.variables)}
    table: dict[str, Float | float] = {}
    for name in space.order:
        if name in space.derived:
            table[name] = space.derived[name].value.evaluate(table)
            continue
        lo, hi = space.interval(name, table)
        k = number.get(name)
        if k is None:
            table[name] = np.clip(space.defaults[name], lo, hi)
            continue
        parameter = space.parameters[name]
        if low[k] > parameter.low or high[k] < parameter.high:
            first, last = parameter.shares(float(low[k]), float(high[k]), lo, hi)
            part = np.maximum(last - first, 0.0)
            V[:, k] = np.clip(first + U[:, k] * part, 0.0, 1.0)
            if part.ndim == 0:
                certain *= float(part)
            else:
                chance *= part
        table[name] = parameter.at(V[:, k], lo, hi)
    return V, certain, chance
