"""NSGA-II, SPEA2 and MOPSO: what a front is, how near they come, when they begin afresh."""

import numpy as np
import pytest
from pymoo.indicators.hv import HV

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms import Problem, Results, get

METHODS = ["nsga2", "spea2", "mopso"]


def zdt1(U: Float) -> Float:
    """Zitzler, Deb and Thiele's first problem; its front is f2 = 1 − √f1."""
    g = 1 + 9 * U[:, 1:].mean(axis=1)
    return np.stack([U[:, 0], g * (1 - np.sqrt(U[:, 0] / g))], axis=1)


def found(name: str, seed: int, scale: float = 1.0, n_var: int = 6) -> Float:
    search, values = get(name)(Problem.unnamed(n_var, 2), seed), []
    for _ in range(25):
        U = search.ask()
        values.append(zdt1(U))
        search.tell(U, Results.of_F(values[-1] * [1.0, scale]))
    return np.concatenate(values)


@pytest.mark.parametrize("name", METHODS)
def test_a_thousand_rows_come_near_the_front(name: str):
    """The whole front dominates 0.6667 + 0.21 = 0.8767 of the area up to (1.1, 1.1)."""
    volume = HV(ref_point=np.array([1.1, 1.1]))
    assert np.median([volume(found(name, seed)) for seed in range(3)]) > 0.6
    assert np.median([volume(found("random", seed)) for seed in range(3)]) < 0.1


@pytest.mark.parametrize("name", METHODS)
def test_the_unit_of_an_objective_does_not_count(name: str):
    """Metres or kilometres: who dominates whom is the same, and so is what is asked."""
    np.testing.assert_array_equal(found(name, 1), found(name, 1, scale=1024.0))


@pytest.mark.parametrize("name", METHODS)
@pytest.mark.parametrize("n_obj", [1, 3])
def test_one_objective_will_do_and_so_will_three(name: str, n_obj: int):
    search, best = get(name)(Problem.unnamed(3, n_obj), 0), []
    for _ in range(25):
        U = search.ask()
        F = np.abs(U[:, :1] - np.linspace(0.5, 0.6, n_obj)) + np.abs(U[:, 1:] - 0.5).sum(
            axis=1, keepdims=True
        )
        best.append(F.min(axis=0))
        search.tell(U, Results.of_F(F))
    assert (np.min(best, axis=0) < 0.1).all()


@pytest.mark.parametrize("name", METHODS)
def test_a_front_that_is_a_point_is_left(name: str):
    """All objectives agree: the population gathers at one row, and is then scattered."""
    search = get(name)(Problem.unnamed(2, 2), 0, restart_within=0.02)
    spread = []
    for _ in range(60):
        U = search.ask()
        spread.append(np.median(np.abs(U - 0.3).max(axis=1)))
        F = ((U - 0.3) ** 2).sum(axis=1, keepdims=True)
        search.tell(U, Results.of_F(np.hstack([F, F])))
    gathered = int(np.argmin(np.array(spread) > 0.05))
    assert gathered > 0, "it gathers"
    assert max(spread[gathered:]) > 0.2, "it is scattered"


@pytest.mark.parametrize("name", METHODS)
def test_who_failed_leads_nobody(name: str):
    """Half of the cube fails; a row there must not live on for want of worse ones."""
    search = get(name)(Problem.unnamed(2, 2), 0)
    for _ in range(15):
        U = search.ask()
        ok = U[:, 0] > 0.5
        F = np.where(ok[:, None], np.stack([U[:, 0], 1 - U[:, 1]], axis=1), np.nan)
        search.tell(U, Results.of_F(F, ok))
    assert (search.ask()[:, 0] > 0.5).mean() > 0.5


def test_the_archive_is_cut_to_its_size():
    search = get("mopso")(Problem.unnamed(4, 2), 0, archive=10)
    for _ in range(20):
        U = search.ask()
        search.tell(U, Results.of_F(zdt1(U)))
    front = search._front_F
    assert len(front) == 10
    dominated = [any((a <= b).all() and (a < b).any() for a in front) for b in front]
    assert not any(dominated)


def test_of_two_leaders_the_less_crowded_leads():
    """SMPSO: each particle flies towards the less crowded of two rows of the front.

    All rows are of the front, those below 0.5 apart, those above it close together: of two drawn at
    random, one below leads in three cases of four. From just above 0.5 a particle, whose own best
    row is where it is, then goes down; and in a few cases of those where one above leads.
    """
    search = get("mopso")(
        Problem.unnamed(1, 2), 3, population=2000, archive=2000, w=0.0, mutation=0.0
    )
    U = search.ask()
    f = np.where(U[:, 0] < 0.5, 100.0 * U[:, 0], 50.0 + 0.01 * U[:, 0])
    search.tell(U, Results.of_F(np.stack([f, -f], axis=1)))
    near = (U[:, 0] > 0.5) & (U[:, 0] < 0.6)
    down = search.ask()[near] < U[near]
    assert 0.7 < down.mean() < 0.85
