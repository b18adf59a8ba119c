import cma
import numpy as np
import pytest

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms import Problem, Results
from bridgegen.search.algorithms.cma_es import CMAES, Distribution, reflected

TARGET = 1e-9


def ellipsoid(rows: Float) -> Float:
    factors = 10 ** (6 * np.linspace(0, 1, rows.shape[1]))
    return (factors * (rows - 0.6) ** 2).sum(axis=1)


def evaluations(seed: int, n_var: int, population: int) -> int:
    rng = np.random.Generator(np.random.PCG64(seed))
    search, best = Distribution(np.full(n_var, 0.3), 0.2, population), np.inf
    while best > TARGET:
        rows = search.sample(rng)
        values = ellipsoid(rows)
        best = values.min()
        search.learn(rows[np.argsort(values)])
    return search.generations * population


def evaluations_of_its_author(seed: int, n_var: int, population: int) -> int:
    rng = np.random.Generator(np.random.PCG64(seed))
    options = {"popsize": population, "randn": lambda *shape: rng.standard_normal(shape)}
    options |= {"seed": np.nan, "verbose": -9, "verb_log": 0}
    search, best = cma.CMAEvolutionStrategy(np.full(n_var, 0.3), 0.2, options), np.inf
    while best > TARGET:
        rows = search.ask()
        values = ellipsoid(np.array(rows))
        best = values.min()
        search.tell(rows, values.tolist())
    return search.countevals


def test_it_is_as_fast_as_its_authors_package():
    """On an ellipsoid whose axes differ by a factor of 1000, which takes learning all of C."""
    ours, theirs = (
        np.median([of(seed, 4, 8) for seed in range(9)])
        for of in (evaluations, evaluations_of_its_author)
    )
    assert ours == pytest.approx(theirs, rel=0.15)


def test_it_does_not_see_rotations():
    """A law of the method: turned rows and a turned start give the turned distribution."""
    rng = np.random.Generator(np.random.PCG64(5))
    Q = np.linalg.qr(rng.standard_normal((4, 4)))[0]
    plain, turned = (Distribution(M @ np.full(4, 0.3), 0.2, 9) for M in (np.eye(4), Q))
    for _ in range(30):
        rows = plain.sample(rng)
        ranked = rows[np.argsort(ellipsoid(rows))]
        plain.learn(ranked)
        turned.learn(ranked @ Q.T)
    np.testing.assert_allclose(turned.mean, Q @ plain.mean, atol=1e-9)
    np.testing.assert_allclose(turned.C, Q @ plain.C @ Q.T, rtol=1e-6, atol=1e-9)
    assert turned.step == pytest.approx(plain.step, rel=1e-9)


def test_the_constants_by_hand():
    """Tutorial, Table 1, n = 2 and λ = 4: raw weights ln 2.5 − ln i = 0.9163, 0.2231, …"""
    search = Distribution(np.zeros(2), 1.0, 4)
    mass = (0.91629 + 0.22314) ** 2 / (0.91629**2 + 0.22314**2)
    assert search._mass == pytest.approx(mass, rel=1e-4)
    assert search._weights[:2].tolist() == pytest.approx([0.80416, 0.19584], rel=1e-4)
    assert search._rank_one == pytest.approx(2 / (3.3**2 + mass), rel=1e-4)


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


def test_large_and_small_searches_take_turns():
    """The next one is of the kind that has had fewer evaluations."""
    search, begun = CMAES(Problem.unnamed(2), 4, population=8, restart_within=0.05), []
    spent, before = {"first": 0, "large": 0, "small": 0}, None
    while len([kind for kind, _ in begun if kind == "large"]) < 3:
        if search._search is not before:
            before = search._search
            begun.append((search._kind, before.population))
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
