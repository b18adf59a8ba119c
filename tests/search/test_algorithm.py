import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from hypothesis.extra import numpy as hnp

from bridgegen.base.errors import InputError
from bridgegen.search.algorithms import Problem, get
from bridgegen.search.algorithms.algorithm import Penalty, resolve


def test_penalty_by_hand():
    penalty = Penalty(1)
    # Nothing finite so far: any finite value will do.
    F, failed = penalty.apply(np.array([[np.nan], [np.inf]]), np.array([False, True]))
    assert failed.tolist() == [True, True]
    assert np.isfinite(F).all()
    # Best −1, worst 3: the margin is their distance, 4.
    F, failed = penalty.apply(
        np.array([[-1.0], [3.0], [-np.inf], [5.0]]), np.array([True, True, True, False])
    )
    assert F[:, 0].tolist() == [-1.0, 3.0, 7.0, 7.0]
    assert failed.tolist() == [False, False, True, True]
    # A worse finite value later raises the penalty.
    penalty.apply(np.array([[10.0]]), np.array([True]))
    assert penalty.value[0] == 21.0


finite = st.floats(allow_nan=False, allow_infinity=False, max_value=1e307)


@given(
    F=hnp.arrays(np.float64, (6, 2), elements=finite),
    ok=hnp.arrays(np.bool_, 6),
)
def test_penalty_is_finite_and_worse_than_anything_told(F, ok):
    told, failed = Penalty(2).apply(F, ok)
    assert np.isfinite(told).all()
    assert (failed == ~ok).all()
    np.testing.assert_array_equal(told[ok], F[ok])
    if ok.any():
        assert (told[~ok] > F[ok].max(axis=0)).all()


def test_all_problems_at_once():
    with pytest.raises(InputError) as error:
        get("pso")(Problem.unnamed(0, 2), -1, w=float("nan"), c1="much", population=True)
    assert error.value.problems == (
        "pso: n_var ≥ 1 must hold, got 0: there is nothing to search",
        "pso: n_obj = 1 (it searches a single objective) must hold, got 2",
        "pso: seed ≥ 0 must hold, got -1",
        "pso: w must be in 0 .. 2, got nan",
        "pso: c1 must be a number, got 'much'",
        "pso: population must be an integer, got True",
    )


def test_an_integer_will_do_for_a_number():
    assert resolve(get("pso"), Problem.unnamed(1), 0, {"c1": 2})["c1"] == 2.0
    assert type(resolve(get("pso"), Problem.unnamed(1), 0, {"c1": 2})["c1"]) is float
