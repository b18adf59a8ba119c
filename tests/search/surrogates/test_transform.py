import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.search.surrogates.known import compressed


@given(st.lists(st.floats(allow_nan=False), min_size=1, max_size=30))
def test_any_objective_becomes_finite_and_keeps_its_order(F: list[float]):
    scores = compressed(np.array(F))
    assert np.isfinite(scores).all()
    assert (np.diff(scores[np.argsort(F, kind="stable")]) >= 0.0).all()


@pytest.mark.parametrize("factor", [1e-300, 1e-3, 1e6, 1e300])
def test_the_scale_does_not_matter(factor: float):
    F = np.array([-3.0, 0.0, 0.0, 1.0, 2.0, 50.0])
    np.testing.assert_allclose(compressed(F * factor), compressed(F))


def test_by_hand():
    # Median 0, standard deviation 1: log 2, and as far below.
    np.testing.assert_allclose(compressed(np.array([-1.0, 1.0])), [-np.log(2.0), np.log(2.0)])


def test_infinite_values_count_as_the_nearest_finite_ones():
    scores = compressed(np.array([-np.inf, -1.0, 0.0, 2.0, np.inf]))
    assert scores[0] == scores[1] < scores[2] < scores[3] == scores[4]


@pytest.mark.parametrize("F", [[np.inf, np.inf], [2.0, 2.0], [0.0], [np.inf, 1.0]])
def test_where_nothing_differs_all_are_0(F: list[float]):
    np.testing.assert_array_equal(compressed(np.array(F)), 0.0)
