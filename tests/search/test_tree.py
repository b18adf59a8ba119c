import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays
from sklearn.tree import DecisionTreeClassifier
from tests.approval import refuses

from bridgegen.search.algorithms.tree import Leaf, fit_leaves

CUBE2 = {"low": [0.0, 0.0], "high": [1.0, 1.0]}


def random_rows(n=2000, n_var=2, seed=0):
    return np.random.default_rng(seed).random((n, n_var))


def as_tuples(leaves):
    return [(tuple(x.low), tuple(x.high), x.rows, x.critical) for x in leaves]


def test_a_box_is_found_to_the_row():
    X = random_rows()
    inside = (X[:, 0] > 0.25) & (X[:, 0] <= 0.75) & (X[:, 1] > 0.6)
    leaves = fit_leaves(X, inside, **CUBE2, min_rows=1)
    (found,) = (leaf for leaf in leaves if leaf.critical)
    assert found.rows == found.critical == inside.sum()
    assert np.array_equal(found.holds(X), inside)
    assert found.low == pytest.approx([0.25, 0.6], abs=0.005)
    assert found.high == pytest.approx([0.75, 1.0], abs=0.005)


def test_the_first_split_is_the_one_with_the_least_gini_impurity():
    # By hand: cutting column 0 between 2 and 3 leaves 2·(0) + 4·(3/8) = 1.5; every other cut of
    # either column leaves more.
    X = np.array([[1, 5], [2, 1], [3, 6], [4, 2], [5, 3], [6, 4]], float)
    critical = [False, False, True, True, False, True]
    leaves = fit_leaves(X, critical, low=[0, 0], high=[9, 9], min_rows=2, max_depth=1)
    assert as_tuples(leaves) == [
        ((0.0, 0.0), (2.5, 9.0), 2, 0),
        ((np.nextafter(2.5, 9), 0.0), (9.0, 9.0), 4, 3),
    ]


@pytest.mark.parametrize("critical", [np.zeros(50, bool), np.ones(50, bool)])
def test_what_is_pure_is_one_leaf_the_whole_box(critical):
    (leaf,) = fit_leaves(random_rows(50), critical, **CUBE2, min_rows=1)
    assert as_tuples([leaf]) == [((0.0, 0.0), (1.0, 1.0), 50, critical.sum())]


def test_no_rows_are_one_leaf_without_rows():
    (leaf,) = fit_leaves(np.empty((0, 2)), [], **CUBE2, min_rows=5)
    assert (leaf.rows, leaf.critical, leaf.share) == (0, 0, 0.0)


def test_rows_that_are_all_alike_cannot_be_split():
    (leaf,) = fit_leaves(np.full((6, 2), 0.5), [True, False] * 3, **CUBE2, min_rows=1)
    assert (leaf.rows, leaf.critical, leaf.share) == (6, 3, 0.5)


def few_values(n_var=2):
    """Rows in which equal values, and values that are one in float32, are frequent."""
    values = st.sampled_from([0.0, 0.5, np.nextafter(0.5, 1), 0.5 + 1e-12, 0.7, 1.0])
    return st.integers(1, 40).flatmap(
        lambda n: st.tuples(
            arrays(np.float64, (n, n_var), elements=values | st.floats(0, 1)), arrays(bool, n)
        )
    )


@given(few_values(), st.integers(1, 10))
def test_every_row_of_the_box_lies_in_exactly_one_leaf(data, min_rows):
    X, critical = data
    leaves = fit_leaves(X, critical, **CUBE2, min_rows=min_rows)
    edges = np.array([edge for leaf in leaves for edge in (leaf.low, leaf.high)])
    for rows in (X, edges, np.nextafter(edges, 0), np.nextafter(edges, 1), random_rows(100)):
        assert (np.sum([leaf.holds(rows) for leaf in leaves], axis=0) == 1).all()
    for leaf in leaves:
        inside = leaf.holds(X)
        assert (leaf.rows, leaf.critical) == (inside.sum(), critical[inside].sum())
        assert leaf.rows >= min(min_rows, len(X))
        assert (leaf.low <= leaf.high).all()


@given(few_values())
def test_different_rows_are_told_apart_to_the_last_bit(data):
    X, critical = data
    distinct, first = np.unique(X, axis=0, return_index=True)
    leaves = fit_leaves(distinct, critical[first], **CUBE2, min_rows=1)
    assert {leaf.share for leaf in leaves} <= {0.0, 1.0}


def test_of_equally_good_splits_the_first_column_s_lowest_is_taken():
    X = np.repeat([[0.1], [0.3], [0.5], [0.7], [0.9]], 2, axis=1)
    # Cutting off the lowest row or the highest one leaves the same impurity.
    leaves = fit_leaves(X, [True, False, False, False, True], **CUBE2, min_rows=1, max_depth=1)
    assert as_tuples(leaves) == [
        ((0.0, 0.0), (0.2, 1.0), 1, 1),
        ((np.nextafter(0.2, 1), 0.0), (1.0, 1.0), 4, 1),
    ]


def theirs(X, critical, **settings):
    """scikit-learn's tree, fitted to ranks (it rounds values to float32), and each row's leaf."""
    ranks = np.stack([np.unique(x, return_inverse=True)[1] for x in X.T], axis=1)
    model = DecisionTreeClassifier(random_state=0, **settings).fit(ranks, critical)
    return model.tree_, model.apply(ranks.astype(np.float32))


def impurity(leaves):
    return sum(2 * x.critical * (x.rows - x.critical) / x.rows for x in leaves)


@given(few_values(3), st.integers(1, 10))
def test_the_best_split_is_as_good_as_scikit_learn_s(data, min_rows):
    X, critical = data
    leaves = fit_leaves(X, critical, low=[0] * 3, high=[1] * 3, min_rows=min_rows, max_depth=1)
    tree, _ = theirs(X, critical, min_samples_leaf=min_rows, max_depth=1)
    is_leaf = tree.children_left < 0
    found = (tree.impurity * tree.n_node_samples)[is_leaf].sum()
    assert impurity(leaves) == pytest.approx(found, abs=1e-9)


@pytest.mark.parametrize("pruning", [0.0, 0.003, 0.01, 0.05])
@pytest.mark.parametrize("seed", range(8))
def test_a_tree_without_ties_is_scikit_learn_s(seed, pruning):
    rng = np.random.default_rng(seed)
    X = rng.random((2000, 3))
    critical = (X @ [1, -0.5, 0.2] + 0.2 * rng.standard_normal(2000)) > 0.4
    leaves = fit_leaves(
        X, critical, low=[0] * 3, high=[1] * 3, min_rows=60, max_depth=4, pruning=pruning
    )
    _, other = theirs(X, critical, min_samples_leaf=60, max_depth=4, ccp_alpha=pruning)
    own = np.argmax([leaf.holds(X) for leaf in leaves], axis=0)
    assert len({*zip(own, other, strict=True)}) == len({*own}) == len({*other}) == len(leaves)


def test_depth_and_pruning_keep_a_tree_small():
    X = random_rows()
    noisy = (X[:, 0] > 0.5) ^ (random_rows(seed=1)[:, 0] < 0.1)
    full = fit_leaves(X, noisy, **CUBE2, min_rows=1)
    assert len(fit_leaves(X, noisy, **CUBE2, min_rows=1, max_depth=3)) <= 8 < len(full)
    low, high = fit_leaves(X, noisy, **CUBE2, min_rows=1, pruning=0.005)
    assert low.high[0] == pytest.approx(0.5, abs=0.01)
    assert low.share == pytest.approx(0.1, abs=0.03)
    assert high.share == pytest.approx(0.9, abs=0.03)


@pytest.mark.parametrize(
    ("change", "said"),
    [
        ({"X": [[0.5, 1.5]]}, "low <= X <= high"),
        ({"X": [[0.5, np.nan]]}, "finite"),
        ({"X": [[0.5]]}, "shape"),
        ({"critical": [True, False]}, "critical"),
        ({"min_rows": 0}, "min_rows >= 1"),
    ],
)
def test_what_is_no_input_is_refused(change, said):
    with refuses(ValueError, said):
        fit_leaves(**({"X": [[0.5, 0.5]], "critical": [True], **CUBE2, "min_rows": 1} | change))


def test_holds_counts_both_edges():
    leaf = Leaf(np.array([0.2]), np.array([0.4]), 0, 0)
    X = np.array([[0.2], [0.4], [np.nextafter(0.2, 0)], [np.nextafter(0.4, 1)]])
    assert leaf.holds(X).tolist() == [True, True, False, False]
