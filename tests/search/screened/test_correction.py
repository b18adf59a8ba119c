"""The difference between two simulators, learnt from rows that both have evaluated."""

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from sklearn.kernel_ridge import KernelRidge

from bridgegen.search.screened.correction import CONFIRMED, MISSED, Correction


def compared(n, difference, seed=0, n_var=3):
    """Return n random rows, and the model of a difference that is a function of them."""
    rng = np.random.default_rng(seed)
    U, by_screen = rng.random((n, n_var)), rng.random((n, 1))
    F = by_screen + difference(U)[:, np.newaxis]
    return U, by_screen, F, by_screen[:, 0] < 0.3, F[:, 0] < 0.3


def test_before_any_row_the_screen_is_right():
    model = Correction.none(3, 2)
    screened = np.array([True, False])
    found = model.predict(np.full((2, 3), 0.5), np.zeros((2, 2)), screened)
    np.testing.assert_array_equal(found.difference, np.zeros((2, 2)))
    np.testing.assert_array_equal(found.doubt, [1.0, 1.0])
    np.testing.assert_allclose(found.critical, [CONFIRMED, MISSED])


def test_a_step_in_one_parameter_is_learnt():
    def step(U):
        return np.where(U[:, 0] < 0.5, 0.6, 0.0)

    model = Correction(*compared(200, step))
    U, by_screen, F, screened, critical = compared(500, step, seed=1)
    found = model.predict(U, by_screen, screened)
    before = np.abs(F - by_screen).mean()
    after = np.abs(F - by_screen - found.difference).mean()
    assert after < before / 2
    right = ((found.critical >= 0.5) == critical).mean()
    assert right > (screened == critical).mean()


@settings(max_examples=25, deadline=None)
@given(st.integers(1, 40), st.integers(0, 1000), st.floats(-5.0, 5.0))
def test_a_prediction_lies_within_what_was_met(n, seed, offset):
    """A mean of differences and of 0 exceeds neither; a probability is one."""
    rng = np.random.default_rng(seed)
    model = Correction(*compared(n, lambda U: offset * U[:, 0], seed))
    found = model.predict(rng.random((20, 3)), rng.random((20, 1)), rng.random(20) < 0.5)
    low, high = min(0.0, offset), max(0.0, offset)
    assert (found.difference >= low - 1e-12).all()
    assert (found.difference <= high + 1e-12).all()
    assert ((found.critical >= 0.0) & (found.critical <= 1.0)).all()
    assert ((found.doubt > 0.0) & (found.doubt <= 1.0)).all()


def test_it_is_as_good_as_another_kernel_method():
    """scikit-learn's kernel ridge, of the width that is best for it, on the same rows."""

    def wave(U):
        return np.sin(4.0 * U[:, 0]) + U[:, 1]

    U, by_screen, F, *labels = compared(150, wave)
    new, new_by_screen, new_F, screened, _ = compared(300, wave, seed=1)
    found = Correction(U, by_screen, F, *labels).predict(new, new_by_screen, screened)
    errors = []
    for gamma in (0.1, 1.0, 10.0):
        other = KernelRidge(alpha=0.1, kernel="rbf", gamma=gamma).fit(U, F - by_screen)
        errors.append(np.abs(new_F - new_by_screen - other.predict(new)).mean())
    none = np.abs(new_F - new_by_screen).mean()
    ours = np.abs(new_F - new_by_screen - found.difference).mean()
    assert ours < 0.4 * none
    assert min(errors) < 0.4 * none


def test_several_objectives_are_corrected_each_for_itself():
    U, by_screen, F, *labels = compared(60, lambda U: U[:, 0])
    two = Correction(U, np.repeat(by_screen, 2, axis=1), np.hstack([F, by_screen]), *labels)
    found = two.predict(U, np.repeat(by_screen, 2, axis=1), labels[0])
    assert found.difference[:, 0].min() > 0.0
    np.testing.assert_array_equal(found.difference[:, 1], 0.0)


@pytest.mark.parametrize("n", [1, 2, 3])
def test_few_rows(n):
    model = Correction(*compared(n, lambda U: np.ones(len(U))))
    found = model.predict(np.full((1, 3), 0.5), np.full((1, 1), 0.5), np.array([True]))
    assert 0.0 <= found.difference[0, 0] <= n / (1.0 + n)
