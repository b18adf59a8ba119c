"""The genetic algorithm and the evolution strategy: what the contract does not say."""

import math

import numpy as np
import pytest

from bridgegen.search.algorithms import Problem, Results, get
from bridgegen.testing.algorithms import Late


def best_of(search, budget: int = 2000) -> float:
    """The best value of a bowl in eight dimensions, its bottom not in the middle."""
    best, told = np.inf, 0
    while told < budget:
        U = search.ask()
        F = ((U - np.linspace(0.1, 0.8, 8)) ** 2).sum(axis=1, keepdims=True)
        search.tell(U, Results.of_F(F))
        best, told = min(best, F.min()), told + len(U)
    return best


@pytest.mark.parametrize("ahead", [0, 16, 90])
@pytest.mark.parametrize("name", ["ga", "es"])
def test_it_goes_downhill(name: str, ahead: int):
    problem = Problem.unnamed(8)
    found = [best_of(Late(get(name)(problem, seed), ahead)) for seed in range(5)]
    by_chance = [best_of(get("random")(problem, seed)) for seed in range(5)]
    assert max(found) < (0.05 if ahead < 40 else 0.5) * min(by_chance)


@pytest.mark.parametrize("ahead", [0, 16, 90])
@pytest.mark.parametrize("name", ["ga", "es"])
def test_it_begins_afresh_when_it_has_converged(name: str, ahead: int):
    """Rows of the old start that are told after it are no parents of the new one."""
    search, generations, starts = get(name)(Problem.unnamed(2), 0), 0, set()
    driven = Late(search, ahead)
    while generations < 400:
        U = driven.ask()
        F = ((U - 0.4) ** 2).sum(axis=1, keepdims=True)
        driven.tell(U, Results.of_F(F))
        generations += 1
        starts.add(search._search.starts)
    assert len(starts) > 1


@pytest.mark.parametrize(("children", "parents"), [(4, 0.5), (5, 0.5), (7, 0.01), (40, 0.15)])
def test_any_share_of_parents(children: int, parents: float):
    search = get("es")(Problem.unnamed(3), 0, children=children, parents=parents)
    first = min(max(2, math.ceil(children * parents)), children // 2)
    for generation in range(5):
        U = search.ask()
        assert len(U) == (children if generation else first)
        search.tell(U, Results.of_F(U.sum(axis=1, keepdims=True)))
