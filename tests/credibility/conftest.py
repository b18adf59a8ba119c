"""Runs whose findings were simulated at fractions of the time step; copies that may be changed."""

import shutil
from functools import cache
from pathlib import Path

import pytest
from tests.safety_case.conftest import check

import bridgegen as bg
from bridgegen.jobs.credibility import export

SEARCHES = {
    "hangs": ("cut-out", {"ego": "route-follower", "algorithm": "pso"}),
    "random": ("crossroads-s4", {"ego": "route-follower", "algorithm": "random"}),
    "clean": ("cut-in", {"ego": "reference", "algorithm": "random"}),
}


@pytest.fixture(scope="session")
def made(tmp_path_factory) -> dict[str, Path]:
    """The runs; read only."""
    base = tmp_path_factory.mktemp("credible")
    for name, (scenario, given) in SEARCHES.items():
        bg.run_search(scenario, **given, budget=100, keep=4, causes=False, out=base / name)
    return {name: base / name for name in SEARCHES}


@pytest.fixture
def project(made, tmp_path) -> Path:
    """A copy of all runs, in one folder."""
    return Path(shutil.copytree(next(iter(made.values())).parent, tmp_path / "project"))


@pytest.fixture
def recomputed():
    """Run the exported script in a fresh interpreter; its status, what differs, its errors."""
    return check


@pytest.fixture(autouse=True, scope="session")
def bits_once():
    """Compare this machine's bits once: each dossier does so, which takes seconds."""
    with pytest.MonkeyPatch.context() as patched:
        patched.setattr(export, "differences", cache(export.differences))
        yield
