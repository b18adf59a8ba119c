from collections.abc import Callable

import pytest

from bridgegen.simulation.rollout import Rollout
from bridgegen.testing.scenes import drive_around, make_rollout


@pytest.fixture(scope="session")
def rollout_of() -> Callable[..., Rollout]:
    return make_rollout


@pytest.fixture(scope="session")
def driven() -> Callable[..., Rollout]:
    return drive_around
