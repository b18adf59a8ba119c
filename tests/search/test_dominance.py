import numpy as np
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bridgegen.search.algorithms.dominance import crowding, non_dominated, thin


def test_a_front_by_hand():
    F = np.array([[1.0, 3.0], [2.0, 2.0], [3.0, 1.0], [2.0, 3.0], [3.0, 3.0], [2.0, 2.0]])
    assert non_dominated(F).tolist() == [True, True, True, False, False, True]
    assert non_dominated(np.array([[2.0], [1.0], [1.0]])).tolist() == [False, True, True]
    assert non_dominated(np.empty((0, 2))).tolist() == []


@given(
    hnp.arrays(
        np.float64,
        st.tuples(st.integers(0, 30), st.integers(1, 4)),
        elements=st.integers(0, 5).map(float),
    )
)
def test_a_front_is_what_nobody_dominates(F):
    dominated = [any((a <= b).all() and (a < b).any() for a in F) for b in F]
    assert non_dominated(F).tolist() == [not one for one in dominated]


def test_crowding_by_hand():
    # Spans 4 and 4; the second has neighbours 2 apart in both, the third 3 and 3.
    F = np.array([[0.0, 4.0], [1.0, 3.0], [2.0, 2.0], [4.0, 0.0]])
    np.testing.assert_allclose(crowding(F), [np.inf, 1.0, 1.5, np.inf])
    assert np.isinf(crowding(F[:2])).all()


def test_who_is_crowded_goes():
    F = np.array([[0.0, 4.0], [1.0, 3.0], [1.2, 2.8], [4.0, 0.0]])
    assert thin(F, 4).tolist() == [0, 1, 2, 3]
    # Gone: [1, 3], whose neighbours are 1.2 apart in both; those of [1.2, 2.8] are 3.
    assert thin(F, 3).tolist() == [0, 2, 3]
