from dataclasses import dataclass

import numpy as np
import pytest

from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.space import SearchSpace


@dataclass
class Result:
    critical: np.ndarray
    status: np.ndarray


class World:
    """Stands in for a simulator: what is critical is a formula of the row."""

    def __init__(self, space: SearchSpace, rule, fails=None) -> None:
        self.space, self.rule, self.fails = space, rule, fails
        self.asked: list[np.ndarray] = []

    def values(self, X):
        return {name: X[:, k] for k, name in enumerate(self.space.names)}

    def critical(self, X):
        return np.asarray(self.rule(self.values(X)), bool)

    def __call__(self, X) -> Result:
        self.asked.append(X)
        status = np.zeros(len(X), np.int8)
        if self.fails is not None:
            status[self.fails(self.values(X))] = 1
        return Result(self.critical(X) & (status == 0), status)

    def random(self, n, seed=0):
        X = self.space.decode(np.random.default_rng(seed).random((n, self.space.n_var)))
        return X, self.critical(X)


@pytest.fixture(scope="session")
def space() -> SearchSpace:
    return load("crossroads-s4").space()


@pytest.fixture(scope="session")
def every() -> SearchSpace:
    """With whole numbers, and parameters that limit each other."""
    return load("crossroads-s4").space(tuple(Axis))


@pytest.fixture(scope="session")
def world():
    return World
