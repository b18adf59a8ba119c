"""Hand-worked values; and laws that any front keeps."""

import math

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from hypothesis.extra.numpy import arrays

from bridgegen.jobs.compare.fronts import Scale, front, generational_distance, hypervolume, spread

grids = st.tuples(st.integers(1, 30), st.integers(1, 3)).flatmap(
    lambda shape: arrays(np.float64, shape, elements=st.integers(0, 8).map(lambda k: k / 8))
)


def test_the_front_by_hand():
    F = np.array([[2.0, 2.0], [1.0, 3.0], [3.0, 1.0], [2.0, 3.0], [1.0, 3.0], [3.0, 3.0]])
    assert front(F).tolist() == [[1.0, 3.0], [2.0, 2.0], [3.0, 1.0]]
    assert front(np.array([[3.0], [1.0], [1.0]])).tolist() == [[1.0]]
    assert front(np.empty((0, 2))).shape == (0, 2)


@settings(max_examples=30)
@given(grids)
def test_the_front_is_what_no_other_dominates(F):
    rows = {tuple(row) for row in F.tolist()}
    alone = {
        a for a in rows
        if not any(all(y <= x for x, y in zip(a, b, strict=True)) for b in rows - {a})
    }  # fmt: skip
    found = front(F)
    assert {tuple(row) for row in found.tolist()} == alone
    assert len(found) == len(alone)
    assert np.array_equal(front(F[::-1]), found)


def test_hypervolume_by_hand():
    # Two boxes to the corner (1, 1), ½ × ½ and ¾ × ¼, which overlap in ½ × ¼.
    F = np.array([[0.5, 0.5], [0.25, 0.75]])
    assert hypervolume(F) == pytest.approx(0.25 + 0.1875 - 0.125)
    assert hypervolume(np.array([[0.0, 0.0]])) == 1.0
    assert hypervolume(np.array([[1.0, 0.0]])) == 0.0
    assert hypervolume(np.array([[0.2]])) == pytest.approx(0.8)
    assert hypervolume(np.array([[0.5, 0.5, 0.5]])) == pytest.approx(0.125)
    assert hypervolume(np.empty((0, 2))) == 0.0


@settings(max_examples=30)
@given(grids)
def test_hypervolume_counts_the_front_only_and_grows_with_it(F):
    assert hypervolume(F) == pytest.approx(hypervolume(front(F)))
    assert hypervolume(F[: len(F) // 2]) <= hypervolume(F) + 1e-12
    assert hypervolume(F[:, ::-1].copy()) == pytest.approx(hypervolume(F))


def test_generational_distance_by_hand():
    # 3-4-5: distances 5 and 1 from the nearest reference point, not scaled by the reference's size.
    reference = np.array([[0.0, 0.0], [100.0, 300.0]])
    assert generational_distance(np.array([[3.0, 4.0], [0.0, 1.0]]), reference) == 3.0
    assert generational_distance(reference, reference) == 0.0
    assert math.isnan(generational_distance(np.empty((0, 2)), reference))


def test_spread_of_two_objectives_by_hand():
    reference = np.array([[0.0, 4.0], [4.0, 0.0]])
    even = np.array([[0.0, 4.0], [2.0, 2.0], [4.0, 0.0]])
    assert spread(even, reference) == 0.0
    # Ends reached; gaps √2 and 3√2, mean 2√2: (√2 + √2) / (2 · 2√2).
    uneven = np.array([[0.0, 4.0], [1.0, 3.0], [4.0, 0.0]])
    assert spread(uneven, reference) == pytest.approx(0.5)
    # One point in the middle: d_f = d_l = 2√2, and no gap: 1.
    assert spread(np.array([[2.0, 2.0]]), reference) == 1.0
    # Half of it: d_l = 2√2, one gap of 2√2 that is the mean: ½.
    assert spread(even[:2], reference) == pytest.approx(0.5)
    assert math.isnan(spread(even[:1], even[:1]))
    assert math.isnan(spread(np.array([[1.0]]), np.array([[1.0]])))


def test_spread_of_three_objectives_by_hand():
    ends = np.eye(3)
    # Each is √2 from its nearest, all alike, and the ends are there.
    assert spread(ends, ends) == 0.0
    # Two ends are there, the third is √2 from the nearest; both gaps are √2: √2 / (√2 + 2√2).
    assert spread(ends[:2], ends) == pytest.approx(1 / 3)


def test_the_scale_is_of_all_runs():
    runs = [(np.array([-40.0, 1.0]), np.array([-3.0, 5.0])), (np.array([-10.0, 0.0]), np.zeros(2))]
    scale = Scale.pooled(runs, 2)
    assert scale.worst.tolist() == [-40.0, 0.0]
    assert scale.best.tolist() == [0.0, 5.0]
    assert scale.objectives(np.array([[-40.0, 5.0], [0.0, 2.5]])).tolist() == [[1, 0], [0, 0.5]]
    constant = Scale.pooled([(np.array([2.0]), np.array([2.0]))], 1)
    assert constant.objectives(np.array([[2.0]])).tolist() == [[0.0]]
    assert Scale.pooled([], 2).objectives(np.zeros((0, 2))).shape == (0, 2)
