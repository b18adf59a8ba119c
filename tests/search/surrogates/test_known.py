import numpy as np
import pytest

from bridgegen.search.algorithms import Problem
from bridgegen.search.surrogates.known import Columns, Known, distances


def told(known: Known, U: list[list[float]], critical: bool = False, ok: bool = True) -> None:
    rows = np.array(U)
    flags = np.full(len(rows), ok), np.full(len(rows), critical)
    known.add(rows, np.full(len(rows), 1.0 if ok else np.nan), *flags)


def of_levels(*levels: int, apart: float = 0.1) -> Known:
    return Known(Problem(tuple(map(str, range(len(levels)))), levels=levels), apart)


def test_a_level_is_one_number_wherever_in_its_interval_a_row_lies():
    columns = Columns(2, (0, 3))
    U = np.array([[0.2, 0.0], [0.2, 0.3], [0.2, 0.34], [0.2, 1.0]])
    np.testing.assert_allclose(columns.points(U)[:, 1], [0.0, 0.0, 0.5, 1.0])
    np.testing.assert_allclose(columns.snapped(U)[:, 1], [1 / 6, 1 / 6, 0.5, 5 / 6])
    np.testing.assert_array_equal(columns.snapped(U)[:, 0], 0.2)
    assert columns.count == 0


@pytest.mark.parametrize("levels", [(2, 3), (100, 100, 7)])
def test_snapping_keeps_the_level_and_enumeration_has_each_once(levels):
    columns = Columns(len(levels), levels)
    rows = columns.everything()
    assert len(np.unique(rows, axis=0)) == len(rows) == columns.count == np.prod(levels)
    np.testing.assert_array_equal(columns.snapped(rows), rows)
    number = np.floor(rows * levels)
    np.testing.assert_array_equal(number.max(axis=0), np.array(levels) - 1)


def test_without_levels_all_columns_are_continuous():
    columns = Columns(3)
    U = np.random.default_rng(0).random((5, 3))
    np.testing.assert_array_equal(columns.points(U), U)
    assert columns.count == 0


def test_rows_of_one_level_are_one_row():
    known = of_levels(2, 2)
    told(known, [[0.1, 0.1]])
    np.testing.assert_array_equal(known.new(np.array([[0.4, 0.3], [0.6, 0.1], [0.9, 0.4]])), [1])
    assert not known.exhausted
    told(known, [[0.1, 0.9], [0.9, 0.1], [0.9, 0.9]])
    assert known.exhausted
    assert len(known.anywhere(5, np.random.default_rng(0))) == 0


def test_rows_from_anywhere_are_new():
    known = of_levels(2, 3)
    told(known, [[0.1, 0.1], [0.9, 0.9]])
    rows = known.anywhere(10, np.random.default_rng(0))
    assert len(np.unique(rows, axis=0)) == len(rows) == 4
    np.testing.assert_array_equal(known.new(rows), np.arange(4))


def test_minus_zero_is_zero():
    known = Known(Problem.unnamed(1), 0.1)
    told(known, [[0.0]])
    assert len(known.new(np.array([[-0.0]]))) == 0


def test_distinct_critical_rows_are_apart_in_root_mean_square():
    known = Known(Problem.unnamed(4), 0.1)
    step = 0.1 * np.sqrt(4)  # in one column
    told(known, [[0.0, 0.5, 0.5, 0.5], [0.9 * step, 0.5, 0.5, 0.5]], critical=True)
    told(known, [[0.9, 0.5, 0.5, 0.5]], critical=True, ok=False)
    told(known, [[1.1 * step, 0.5, 0.5, 0.5]], critical=True)
    np.testing.assert_array_equal(known.distinct, [0, 3])
    np.testing.assert_array_equal(known.critical, [True, True, False, True])


def test_failed_rows_count_as_the_worst():
    known = Known(Problem.unnamed(1), 0.1)
    told(known, [[0.1]], ok=False)
    known.add(
        np.array([[0.2], [0.3]]), np.array([5.0, np.nan]), np.ones(2, bool), np.zeros(2, bool)
    )
    np.testing.assert_array_equal(known.F, [np.inf, 5.0, np.inf])


def test_distances():
    assert distances(np.zeros((1, 4)), np.array([[1.0, 1, 1, 1], [0.5, 0, 0, 0]])) == [0.25]
    assert distances(np.zeros((1, 4)), np.empty((0, 4))) == [np.inf]
