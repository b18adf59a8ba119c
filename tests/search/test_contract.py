"""Every registered algorithm keeps the contract; a new one by being registered."""

from dataclasses import replace
from typing import Any

import pytest

from bridgegen.base.extras import is_installed
from bridgegen.search.algorithms import ALGORITHMS, Algorithm
from bridgegen.testing import AlgorithmContract

SMALL = {
    "dqn": {
        **{"epochs": 4, "width": 8, "memory": 200},
        **{"gamma": 0.5, "lr_critic": 0.05, "explore": 2},
    },
    "ddpg": {"epochs": 1, "width": 8, "memory": 200, "noise": 1.0},
    "ppo": {"epochs": 4, "width": 8, "lr_actor": 0.03},
    "ppo-adversary": {"epochs": 2, "width": 8, "lr_actor": 0.03, "minibatch": 16},
    "turbo": {"length": 0.4, "successes": 2, "failures": 3, "shortest": 0.15},
}
"""Other defaults: networks that are trained in no time, settings that show in a few batches."""


def small(algorithm: type[Algorithm]) -> Any:
    """Return an algorithm with the defaults of SMALL, skipped where its extra is missing."""
    if algorithm.name not in SMALL:
        return pytest.param(algorithm, id=algorithm.name)
    changed = {
        key: replace(algorithm.settings[key], default=value)
        for key, value in SMALL[algorithm.name].items()
    }
    kind = type(algorithm.__name__, (algorithm,), {"settings": {**algorithm.settings, **changed}})
    extra = getattr(algorithm, "extra", None)
    missing = extra is not None and not is_installed(extra)
    skip = pytest.mark.skipif(missing, reason=f"the extra {extra} is not installed")
    return pytest.param(kind, id=algorithm.name, marks=skip)


class TestRegistered(AlgorithmContract):
    @pytest.fixture(autouse=True, params=[small(one) for one in ALGORITHMS.values()])
    def each(self, request):
        self.algorithm = request.param
        self.is_finite = self.algorithm.name in ("grid", "pairwise")
