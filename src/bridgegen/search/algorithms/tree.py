"""A decision tree over rows: boxes whose rows are mostly critical or mostly not.

CART recursively splits a box at a value of one column, so that the two halves are purer than the
whole (Gini impurity). Its leaves partition the outer box.
Source: L. Breiman et al., "Classification and Regression Trees", 1984, sections 2.4 and 3.3.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int, as_float


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
    max_depth: int | None = None,
    pruning: float = 0.0,
) -> list[Leaf]:
    """Return all leaves of a tree that separates critical rows from others.

    They include pure leaves; if no split helps, the only leaf is the whole box. Of equally good
    splits, that of the first column is taken, then the lowest.

    Args:
        X: ``(N, n_var)``, rows inside the outer box.
        critical: ``(N,)`` bool.
        low: ``(n_var,)``, of the outer box, inclusive.
        high: likewise, its upper edges.
        min_rows: minimum number of rows of a leaf, unless there are fewer in all.
        max_depth: maximum number of splits above a leaf; unlimited by default.
        pruning: of Breiman's cost-complexity; a split must lower the impurity of the leaves below
            it, weighted by their share of all rows, by more than this for each leaf that it adds.

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
    nodes = _grown(rows, labels, min_rows, max_depth)
    _prune(nodes, pruning * len(rows))
    found = []
    stack = [(nodes[0], lowest, highest)]  # a tree may be too deep for recursion
    while stack:
        node, low, high = stack.pop()
        if node.halves is None:
            found.append(Leaf(low, high, len(node.inside), node.critical))
            continue
        lower, upper = node.halves
        values = rows[:, node.column]
        edge = _between(float(values[lower.inside].max()), float(values[upper.inside].min()))
        below, above = high.copy(), low.copy()
        # Neighbouring leaves share no float64, so a row is in exactly one; `box.joined` relies on
        # that gap.
        below[node.column], above[node.column] = edge, np.nextafter(edge, np.inf)
        stack += [(upper, above, high), (lower, low, below)]
    return found


@dataclass
class _Node:
    """A node of the tree: which rows lie in it, and how it is split (if it is not a leaf)."""

    inside: Int
    critical: int
    depth: int
    column: int = -1
    halves: "tuple[_Node, _Node] | None" = None

    @property
    def impurity(self) -> float:
        """Gini impurity times the number of rows."""
        rows = len(self.inside)
        return 2 * self.critical * (rows - self.critical) / max(rows, 1)


def _grown(rows: Float, labels: Bool, min_rows: int, max_depth: int | None) -> list[_Node]:
    """Return all nodes of the unpruned tree, each before those below it."""
    nodes = [_Node(np.arange(len(rows)), int(labels.sum()), 0)]
    for node in nodes:
        too_deep = max_depth is not None and node.depth >= max_depth
        if too_deep or node.impurity == 0 or len(node.inside) < 2 * min_rows:
            continue
        split = _best_split(rows[node.inside], labels[node.inside], min_rows)
        if split is None:
            continue
        node.column, is_lower = split
        lower, upper = (
            _Node(inside, int(labels[inside].sum()), node.depth + 1)
            for inside in (node.inside[is_lower], node.inside[~is_lower])
        )
        node.halves = lower, upper
        nodes += [lower, upper]
    return nodes


def _best_split(rows: Float, labels: Bool, min_rows: int) -> tuple[int, Bool] | None:
    """Return the column whose cut leaves the least impurity, and which rows lie below the cut."""
    n = len(rows)
    # Exact float64 values: scikit-learn splits values that are rounded to float32.
    order = np.argsort(rows, axis=0, kind="stable")
    values = np.take_along_axis(rows, order, axis=0)
    below = np.arange(1, n)[:, np.newaxis]
    critical = np.cumsum(labels[order], axis=0)[:-1]
    others = labels.sum() - critical
    # Gini impurity of both halves for all columns and cuts at once, up to a factor.
    impurity = critical * (below - critical) / below + others * (n - below - others) / (n - below)
    is_cut = (values[1:] > values[:-1]) & (below >= min_rows) & (n - below >= min_rows)
    if not is_cut.any():
        return None
    impurity[~is_cut] = np.inf
    # Transposed, so that of equal cuts the first column's lowest one wins.
    column, cut = divmod(int(impurity.T.argmin()), n - 1)
    return column, rows[:, column] <= values[cut, column]


def _prune(nodes: list[_Node], per_leaf: float) -> None:
    """Make a leaf of each node whose leaves lower the impurity by too little, from below."""
    cost: dict[int, float] = {}
    for node in reversed(nodes):
        alone = node.impurity + per_leaf
        split = sum(cost[id(half)] for half in node.halves) if node.halves else np.inf
        if alone <= split:
            node.halves = None
        cost[id(node)] = min(alone, split)


def _between(under: float, over: float) -> float:
    """Return the middle of two values, or the lower where no float64 lies between them."""
    middle = under + (over - under) / 2
    return middle if under <= middle < over else under
