"""Morris's design and effects, and how far a constant may go, against what is known of them."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.search.sensitivity import (
    STEP,
    design,
    elementary_effects,
    limit,
    sentence,
    summary,
)

SIZES = st.tuples(st.integers(2, 8), st.integers(1, 12), st.integers(0, 2**32 - 1))


@given(SIZES)
def test_each_trajectory_moves_each_factor_once_within_the_unit_cube(sizes):
    r, k, seed = sizes
    points, order = design(r, k, seed)
    assert points.shape == (r, k + 1, k)
    assert (points >= -1e-12).all()
    assert (points <= 1.0 + 1e-12).all()
    moved = np.abs(np.diff(points, axis=1))
    assert np.count_nonzero(moved > 1e-9) == r * k
    assert moved[moved > 1e-9] == pytest.approx(STEP)
    assert (np.sort(order, axis=1) == np.arange(k)).all()
    assert (np.argmax(moved, axis=2) == order).all()


@given(SIZES, st.data())
def test_effects_of_a_linear_function_are_its_coefficients(sizes, data):
    r, k, seed = sizes
    c = np.array(data.draw(st.lists(st.floats(-1e3, 1e3), min_size=k, max_size=k)))
    points, order = design(r, k, seed)
    effects = elementary_effects(points, order, points @ c + 7.0)
    mu_star, sigma = summary(effects)
    assert effects == pytest.approx(np.tile(c, (r, 1)), abs=1e-6)
    assert mu_star == pytest.approx(np.abs(c), abs=1e-6)
    assert sigma == pytest.approx(np.zeros(k), abs=1e-6)


def test_what_interacts_has_a_spread():
    """Of x·y the effect of x is y, of which a third of the values is 0 …, so sigma is above 0."""
    points, order = design(40, 3, 5)
    mu_star, sigma = summary(elementary_effects(points, order, points[..., 0] * points[..., 1]))
    assert mu_star[:2] == pytest.approx([0.5, 0.5], abs=0.12)
    assert (sigma[:2] > 0.3).all()
    assert mu_star[2] == sigma[2] == 0.0


def test_effects_without_a_result_do_not_count():
    effects = np.array([[1.0, np.nan], [3.0, np.nan]])
    mu_star, sigma = summary(effects)
    assert mu_star.tolist() == [2.0, 0.0]
    assert sigma == pytest.approx([np.sqrt(2.0), 0.0])


@given(st.floats(0.76, 1.49))
def test_a_limit_is_found_to_a_hundredth(edge):
    """A verdict that stands up to an edge: the limit stands, and lies just below it."""
    values = [0.75 + part * 0.75 for part in (0.25, 0.5, 0.75, 1.0)]
    found = limit(0.75, [(v, v <= edge) for v in values], lambda v: v <= edge)
    assert found is not None
    assert edge - 0.004 <= found <= edge


def test_what_stands_everywhere_has_no_limit():
    assert limit(1.0, [(1.1, True), (1.2, True)], lambda v: pytest.fail("tried")) is None


@pytest.mark.parametrize(
    ("ends", "words"),
    [
        ((None, None), ""),
        ((None, 0.9), "stands only while the reaction time is ≤ 0.9 s"),
        ((0.7, None), "stands only while the reaction time is ≥ 0.7 s"),
        ((0.7, 0.9), "stands only while the reaction time is between 0.7 and 0.9 s"),
    ],
)
def test_a_sentence_says_for_which_values(ends, words):
    assert sentence("the reaction time", "s", *ends) == words
