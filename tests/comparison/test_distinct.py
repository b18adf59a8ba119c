import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bridgegen.jobs.compare.record import distinct, normalised
from bridgegen.scenario.language.reader import load

clouds = st.tuples(st.integers(0, 40), st.integers(1, 4)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.integers(0, 16).map(lambda k: k / 16))
)


def apart(points, i, j) -> float:
    """The root mean square of the differences."""
    return float(np.sqrt(np.mean((points[i] - points[j]) ** 2)))


def test_by_hand():
    points = np.array([[0.0, 0.0], [0.1, 0.0], [0.15, 0.0], [0.0, 0.1], [1.0, 1.0], [1.0, 1.0]])
    # From the first: 0.071, 0.106, 0.071, 1; the last one is the one before it.
    assert distinct(points, 0.1).tolist() == [True, False, True, False, True, False]


def test_at_the_distance_itself_two_are_different():
    assert distinct(np.array([[0.0], [0.5], [0.75]]), 0.5).tolist() == [True, True, False]


@settings(max_examples=30)
@given(clouds, st.sampled_from([0.051, 0.11, 0.3]))
def test_what_is_new_lies_apart_and_is_near_all_else(points, threshold):
    new = distinct(points, threshold)
    centres = np.flatnonzero(new).tolist()
    for i in range(len(points)):
        nearest = min((apart(points, i, j) for j in centres if j < i), default=np.inf)
        assert new[i] == (nearest >= threshold)


@settings(max_examples=30)
@given(clouds, st.integers(0, 40))
def test_what_comes_later_changes_nothing_and_repeats_add_nothing(points, cut):
    new = distinct(points, 0.11)
    assert np.array_equal(distinct(points[:cut], 0.11), new[:cut])
    assert distinct(np.concatenate([points, points]), 0.11).sum() == new.sum()


@settings(max_examples=30)
@given(clouds, st.permutations(range(4)))
def test_no_parameter_counts_more_than_another(points, order):
    columns = [k for k in order if k < points.shape[1]]
    assert np.array_equal(distinct(points, 0.11), distinct(points[:, columns], 0.11))


def test_chunks_leave_no_seam():
    points = np.random.default_rng(0).random((1000, 2))
    new = distinct(points, 0.05)
    centres = points[new]
    gaps = np.sqrt(((centres[:, np.newaxis] - centres) ** 2).mean(axis=2))
    np.fill_diagonal(gaps, np.inf)
    assert gaps.min() >= 0.05
    assert np.sqrt(((points[:, np.newaxis] - centres) ** 2).mean(axis=2)).min(axis=1).max() < 0.05


def test_the_limit_bounds_what_is_counted():
    points = np.arange(1000.0)[:, np.newaxis]
    assert distinct(points, 0.5, limit=300).sum() == 300
    assert distinct(points, 0.5).all()


def test_parameters_are_shares_of_their_ranges():
    space = load("crossroads-s4").space()
    X = space.decode(np.random.default_rng(0).random((50, space.n_var)))
    shares = normalised(space, X)
    assert shares.shape == (50, space.n_var)
    assert shares.min() >= -1e-12
    assert shares.max() <= 1.0 + 1e-12
    for k, name in enumerate(space.variables):
        one = space.parameters[name]
        back = one.low + shares[:, k] * (one.high - one.low)
        assert back == pytest.approx(X[:, space.index(name)])
