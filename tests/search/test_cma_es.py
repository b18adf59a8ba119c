import numpy as np
import pytest

from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms.cma_es import CMAES, LEAST, reflected


def test_reflection_by_hand():
    rows = np.array([[-0.2, 0.3], [1.2, 1.0], [2.3, -1.3]])
    np.testing.assert_allclose(reflected(rows), [[0.2, 0.3], [0.8, 1.0], [0.3, 0.7]])


@pytest.mark.parametrize("n_var", [1, 3, 8])
def test_it_comes_close_to_a_corner(n_var: int):
    search, best = CMAES(Problem.unnamed(n_var), 0), []
    for _ in range(60):
        U = search.ask()
        F = ((U - 1.0) ** 2).sum(axis=1, keepdims=True)
        best.append(F.min())
        search.tell(U, Results.of_F(F))
    assert min(best) < 1e-4


@pytest.mark.parametrize("n_var", [1, 2, 10])
@pytest.mark.parametrize("population", [1, 3, 5])
def test_few_rows_and_failed_ones_are_no_problem(n_var: int, population: int):
    """Warnings are errors here; half of the rows fail, and once all of them."""
    search = CMAES(Problem.unnamed(n_var), 0, population=population, restart_within=1e-12)
    for generation in range(300):
        U = search.ask()
        assert len(U) >= LEAST
        assert ((U >= 0.0) & (U <= 1.0)).all()
        ok = (U[:, 0] < 0.5) & (generation % 7 != 3)
        F = np.where(ok, ((U - 0.4) ** 2).sum(axis=1), np.nan)[:, None]
        search.tell(U, Results.of_F(F, ok))


def test_large_and_small_searches_take_turns():
    """The next one is of the kind that has had fewer evaluations."""
    search, begun = CMAES(Problem.unnamed(2), 4, population=8, restart_within=0.05), []
    spent, before = {"first": 0, "large": 0, "small": 0}, None
    while len([kind for kind, _ in begun if kind == "large"]) < 3:
        if search._search is not before:
            before = search._search
            begun.append((search._kind, before.population_size))
            if len(begun) > 1:
                assert search._kind == ("large" if spent["large"] <= spent["small"] else "small")
        U = search.ask()
        spent[search._kind] += len(U)
        search.tell(U, Results.of_F(((U - 0.4) ** 2).sum(axis=1, keepdims=True)))
    assert begun[0] == ("first", 8)
    assert [size for kind, size in begun if kind == "large"] == [16, 32, 64]
    assert any(kind == "small" for kind, _ in begun)


def test_it_begins_afresh_where_nothing_improves():
    search = CMAES(Problem.unnamed(2), 0, restart_within=1e-12)
    for _ in range(40):
        U = search.ask()
        search.tell(U, Results.of_F(np.ones((len(U), 1))))
    assert search._kind != "first"


@pytest.mark.parametrize(("n_var", "rows", "patience"), [(2, 6, 20), (3, 30, 13), (2, 14, 15)])
@pytest.mark.parametrize("improving", [0, 7])
def test_how_long_it_waits_for_an_improvement(n_var, rows, patience, improving):
    """10 + ⌈30 n/λ⌉ generations whose best are equal (Hansen 2016, B.3); then twice the rows."""
    search = CMAES(Problem.unnamed(n_var), 0, population=rows, restart_within=1e-12)
    sizes = []
    for generation in range(60):
        U = search.ask()
        sizes.append(len(U))
        best = float(max(improving - generation, 0))
        search.tell(U, Results.of_F(np.full((len(U), 1), best)))
    assert sizes.index(2 * rows) == improving + patience
