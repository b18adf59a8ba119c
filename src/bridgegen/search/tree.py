"""A decision tree over rows: boxes whose rows are mostly critical or mostly not.

CART recursively splits a box at a value of one column, so that the two halves are purer than the
whole (Gini impurity). Its leaves partition the outer box.
Source: L. Breiman et al., "Classification and Regression Trees", 1984; the tree is scikit-learn's.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float, as_float


@dataclass(frozen=True)
class Leaf:
    """A box of a decision tree.

    Both edges count as inside. A neighbour that begins where this one ends begins at the next
    float64, so that every row in the outer box lies in exactly one leaf.

    Attributes:
        low: ``(n_var,)`` float64, its lowest value in each column.
        high: ``(n_var,)`` float64, its highest.
        rows: how many rows lie in it.
        critical: how many of these are critical.
    """

    low: Float
    high: Float
    rows: int
    critical: int

    @property
    def share(self) -> float:
        """Critical share of its rows, in [0, 1]; 0 without rows."""
        return self.critical / max(self.rows, 1)

    def holds(self, X: Float) -> Bool:
        """Return which rows of ``(N, n_var)`` lie in it, ``(N,)`` bool."""
        inside: Bool = np.all((self.low <= X) & (self.high >= X), axis=1)
        return inside


def fit_leaves(
    X: npt.ArrayLike,
    critical: npt.ArrayLike,
    *,
    low: npt.ArrayLike,
    high: npt.ArrayLike,
    min_rows: int,
    seed: int = 0,
    max_depth: int | None = None,
    pruning: float = 0.0,
) -> list[Leaf]:
    """Return all leaves of a tree that separates critical rows from others.

    They include pure leaves; if no split helps, the only leaf is the whole box. The result is
    deterministic, bit for bit.

    Args:
        X: ``(N, n_var)``, rows inside the outer box.
        critical: ``(N,)`` bool.
        low: ``(n_var,)``, of the outer box, inclusive.
        high: likewise, its upper edges.
        min_rows: minimum number of rows of a leaf, unless there are fewer in all.
        seed: decides between equally good splits; 0 .. 2³²−1.
        max_depth: maximum number of splits above a leaf; unlimited by default.
        pruning: of Breiman's cost-complexity; a split must lower the weighted impurity of the
            leaves below it by more than this for each leaf that it adds.

    Returns:
        The leaves, depth first, lower half first.

    Raises:
        ValueError: wrong shape, NaN or inf, a row outside the box, or min_rows below 1.
    """
    lowest = as_float("low", low, (None,))
    highest = as_float("high", high, lowest.shape)
    rows = as_float("X", X, (None, len(lowest)))
    labels = np.asarray(critical, dtype=np.bool_)
    if labels.shape != rows.shape[:1]:
        raise ValueError(f"critical must have shape ({len(rows)},), got {labels.shape}")
    if min_rows < 1:
        raise ValueError(f"min_rows >= 1 must hold, got {min_rows}")
    if not ((lowest <= rows) & (rows <= highest)).all():
        raise ValueError("low <= X <= high must hold in every row")
    n_critical = int(labels.sum())
    if len(rows) < 2 * min_rows or not 0 < n_critical < len(rows):
        return [Leaf(lowest, highest, len(rows), n_critical)]
    from sklearn.tree import DecisionTreeClassifier

    ranks = _ranks(rows)
    model = DecisionTreeClassifier(
        min_samples_leaf=min_rows, max_depth=max_depth, ccp_alpha=pruning, random_state=seed
    )
    tree, found = model.fit(ranks, labels).tree_, []
    stack = [(0, np.arange(len(rows)), lowest, highest)]  # a tree may be too deep for recursion
    while stack:
        node, inside, low, high = stack.pop()
        left, right = int(tree.children_left[node]), int(tree.children_right[node])
        if left < 0:
            found.append(Leaf(low, high, len(inside), int(labels[inside].sum())))
            continue
        column = int(tree.feature[node])
        goes_left = ranks[inside, column] <= tree.threshold[node]
        lower, upper = inside[goes_left], inside[~goes_left]
        edge = _between(float(rows[lower, column].max()), float(rows[upper, column].min()))
        below, above = high.copy(), low.copy()
        below[column], above[column] = edge, np.nextafter(edge, np.inf)
        stack += [(right, upper, above, high), (left, lower, low, below)]
    return found


def _ranks(rows: Float) -> npt.NDArray[np.float32]:
    """Return each value's rank among its column's distinct values.

    A tree depends only on the order. scikit-learn rounds X to float32, which may merge different
    rows, or move one across a threshold; ranks are exact in float32.
    """
    ranks = np.empty(rows.shape, np.float32)
    for number, column in enumerate(rows.T):
        ranks[:, number] = np.unique(column, return_inverse=True)[1]
    return ranks


def _between(under: float, over: float) -> float:
    """Return the middle of two values, or the lower where no float64 lies between them."""
    middle = under + (over - under) / 2
    return middle if under <= middle < over else under
