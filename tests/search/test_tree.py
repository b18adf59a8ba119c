import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bridgegen.search.tree import Leaf, fit_leaves

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


@given(few_values(), st.integers(1, 10), st.integers(0, 2**32 - 1))
def test_every_row_of_the_box_lies_in_exactly_one_leaf(data, min_rows, seed):
    X, critical = data
    leaves = fit_leaves(X, critical, **CUBE2, min_rows=min_rows, seed=seed)
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


def test_one_input_gives_one_tree_bit_for_bit_and_ties_follow_the_seed():
    X = np.repeat(random_rows(60, 1), 4, axis=1)  # four columns that split equally well
    critical = X[:, 0] > 0.5
    box = {"low": np.zeros(4), "high": np.ones(4), "min_rows": 5}
    trees = [as_tuples(fit_leaves(X, critical, **box, seed=seed)) for seed in range(8)]
    assert trees == [as_tuples(fit_leaves(X, critical, **box, seed=seed)) for seed in range(8)]
    assert len({str(tree) for tree in trees}) > 1


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
        ({"critical": [True, False]}, "critical must have shape"),
        ({"min_rows": 0}, "min_rows >= 1"),
    ],
)
def test_what_is_no_input_is_refused(change, said):
    with pytest.raises(ValueError, match=said):
        fit_leaves(**({"X": [[0.5, 0.5]], "critical": [True], **CUBE2, "min_rows": 1} | change))


def test_holds_counts_both_edges():
    leaf = Leaf(np.array([0.2]), np.array([0.4]), 0, 0)
    X = np.array([[0.2], [0.4], [np.nextafter(0.2, 0)], [np.nextafter(0.4, 1)]])
    assert leaf.holds(X).tolist() == [True, True, False, False]
