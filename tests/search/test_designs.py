"""The designs that take no notice of results: Sobol sequence, grid, covering array."""

from itertools import combinations, islice, product

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from scipy.stats import qmc

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms import Algorithm, Problem
from bridgegen.search.algorithms.pairwise import Pairwise
from bridgegen.search.algorithms.sampling import Grid, Random, Sobol


def rows(search: Algorithm) -> Float:
    """Return all rows of a design that ends."""
    batches = list(_batches(search))
    assert len(search.ask()) == 0, "an exhausted design stays exhausted"
    return np.concatenate(batches)


def _batches(search: Algorithm):
    while len(U := search.ask()):
        yield U


def levels_of(U: Float, levels: int) -> np.ndarray:
    k = U * levels - 0.5
    np.testing.assert_allclose(k, np.round(k), atol=1e-9)
    return np.round(k).astype(int)


@pytest.mark.parametrize("n_var", [2, 5, 10])
def test_sobol_is_more_even_than_random(n_var: int):
    n = 400
    sobol = np.concatenate(list(islice(_batches(Sobol(Problem.unnamed(n_var), 3)), n // 40)))
    random = np.concatenate(list(islice(_batches(Random(Problem.unnamed(n_var), 3)), n // 40)))
    assert qmc.discrepancy(sobol) < 0.6 * qmc.discrepancy(random)


def test_sobol_fills_every_elementary_interval():
    """A (0, 1)-sequence in each column: 2^k rows have one in each of 2^k equal intervals."""
    U = Sobol(Problem.unnamed(6), 8, population=64).ask()
    for column in U.T:
        assert sorted(np.floor(column * 64)) == list(range(64))


@pytest.mark.parametrize("population", [1, 2, 7, 120])
def test_batches_are_stretches_of_one_sobol_sequence(population: int):
    whole = Sobol(Problem.unnamed(3), 5, population=840).ask()
    parts = Sobol(Problem.unnamed(3), 5, population=population)
    np.testing.assert_array_equal(
        np.concatenate([parts.ask() for _ in range(840 // population)]), whole
    )


@given(st.integers(2, 6), st.integers(1, 4), st.integers(0, 2**40))
def test_the_grid_is_enumerated_once(levels: int, n_var: int, seed: int):
    found = levels_of(rows(Grid(Problem.unnamed(n_var), seed, levels=levels)), levels)
    assert sorted(map(tuple, found)) == list(product(range(levels), repeat=n_var))


def test_the_whole_of_a_large_grid():
    found = levels_of(rows(Grid(Problem.unnamed(10), 0)), 3)
    assert len(found) == 3**10
    assert len(np.unique(found @ 3 ** np.arange(10))) == 3**10


@pytest.mark.parametrize(("n_var", "levels"), [(10, 3), (30, 5), (200, 1000)])
def test_the_start_of_a_grid_is_spread_over_all_of_it(n_var: int, levels: int):
    search = Grid(Problem.unnamed(n_var), 1, levels=levels)
    U = np.concatenate([search.ask() for _ in range(25)])
    assert len(np.unique(U, axis=0)) == 1000
    # Means of 1000 uniform values: six standard errors, in a grid's spread √(1 − 1/levels²)/√12.
    assert (np.abs(U.mean(axis=0) - 0.5) < 6 * 0.289 / np.sqrt(1000)).all()
    # No two columns go together; 1/√1000 is the standard error of a correlation.
    apart = np.corrcoef(U.T) - np.eye(n_var)
    assert np.abs(apart).max() < 6 / np.sqrt(1000)


@pytest.mark.parametrize(("n_var", "levels"), [(1, 4), (2, 3), (3, 2), (4, 5), (10, 5), (13, 3)])
@pytest.mark.parametrize("seed", [0, 1])
def test_every_pair_of_levels_occurs(n_var: int, levels: int, seed: int):
    found = levels_of(rows(Pairwise(Problem.unnamed(n_var), seed, levels=levels)), levels)
    for column in found.T:
        assert set(column) == set(range(levels))
    for a, b in combinations(found.T, 2):
        assert set(zip(a, b, strict=True)) == set(product(range(levels), repeat=2))


def test_a_covering_array_is_small():
    """At least levels² rows are needed; the greedy array takes about twice that."""
    assert 25 <= len(rows(Pairwise(Problem.unnamed(10), 0))) <= 60


def test_the_start_of_a_covering_array_covers_most():
    found = levels_of(Pairwise(Problem.unnamed(10), 0).ask(), 5)
    pairs = sum(len(set(zip(a, b, strict=True))) for a, b in combinations(found.T, 2))
    assert pairs > 0.9 * 45 * 25
