"""A tiny reproduction, shared: two scenarios, two seeds, three iterations, and no PPO."""

from pathlib import Path
from typing import Any

import pytest

from bridgegen_reproduction import Reproduction, protocol, reproduce

TINY: dict[str, Any] = {
    "seeds": 2,
    "iterations": 3,
    "scenarios": ["crossroads-s3", "crossroads-s4"],
    "out": "reproduction",  # relative, so that the command in it is the same wherever it is made
}

NOT_THERE = ("a_package_that_is_not_there",)


@pytest.fixture(scope="session")
def tiny() -> dict[str, Any]:
    return TINY


@pytest.fixture
def without_ppo(monkeypatch) -> None:
    """A machine on which the extra rl is not installed."""
    monkeypatch.setattr(protocol, "NEEDED_BY_PPO", NOT_THERE)


@pytest.fixture(scope="session")
def done(tmp_path_factory) -> tuple[Path, Reproduction]:
    """Its folder, and what it came to."""
    home = tmp_path_factory.mktemp("reproduction")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(protocol, "NEEDED_BY_PPO", NOT_THERE)
        patch.chdir(home)
        result = reproduce(**TINY, workers=1)
    return home / "reproduction", result
