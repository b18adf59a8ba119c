"""esmini's library, where there is one."""

import os

import pytest

from bridgegen.simulation.choice import SimulatorChoice


@pytest.fixture(scope="session")
def esmini():
    """The choice of esmini."""
    if not os.environ.get("ESMINI_LIB"):
        pytest.skip("ESMINI_LIB names no library of esmini's")
    return SimulatorChoice("esmini")
