"""A copy of the package with kernels of the test's own, run in processes with a cache of theirs."""

import os
import shutil
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path

import pytest

import bridgegen

LOW = """
import math

from bridgegen._constants import FACTOR
from bridgegen.base.compiled import kernel


@kernel
def low(x):
    return FACTOR * math.sin(x)
"""
HIGH = """
from bridgegen._low_kernels import low
from bridgegen.base.compiled import kernel


@kernel
def high(x):
    return low(x) + low(x + 1.0)
"""
OTHER = """
from bridgegen.base.compiled import kernel


@kernel
def other(x):
    return x + 1.0
"""
COUNTED = """
from numba.core import event
from bridgegen.base.compilation import library
library.LARGE = 0  # so that every kernel is called, none linked
with event.install_recorder("numba:compile") as recorder:
    {}
named = [one.data["dispatcher"].__name__ for _, one in recorder.buffer if one.is_start]
print(*sorted(named))
"""

Run = Callable[..., list[str]]


def runner(package: Path) -> Run:
    """Return what runs code of a package in a process; see `compiled_by`."""

    def run(code: str, **more: str) -> list[str]:
        environment = {
            "PATH": os.environ["PATH"], "PYTHONPATH": str(package.parent),
            "XDG_CACHE_HOME": str(package.parent / "cache"), "PYTHONDONTWRITEBYTECODE": "1",
            **more,
        }  # fmt: skip
        done = subprocess.run(
            [sys.executable, "-W", "error", "-c", COUNTED.format(code)],
            env=environment, capture_output=True, text=True, timeout=120.0, check=False,
        )  # fmt: skip
        assert not done.stderr
        assert done.returncode == 0
        return done.stdout.split()

    return run


@pytest.fixture(scope="session")
def made(tmp_path_factory) -> Path:
    """A copy of the package with four modules more, which no test changes."""
    here, place = Path(bridgegen.__file__).parent, tmp_path_factory.mktemp("made") / "bridgegen"
    shutil.copytree(here, place, ignore=shutil.ignore_patterns("__pycache__"))
    modules = {"_low_kernels": LOW, "_high_kernels": HIGH, "_other_kernels": OTHER}
    for name, text in (modules | {"_constants": "FACTOR = 2.0\n"}).items():
        (place / f"{name}.py").write_text(text)
    return place


@pytest.fixture
def package(made, tmp_path) -> Path:
    """A copy of the package with four modules more."""
    shutil.copytree(made, tmp_path / "bridgegen")
    return tmp_path / "bridgegen"


@pytest.fixture
def compiled_by(package) -> Run:
    """Runs code in a process, and returns the kernels that it compiled, in alphabetical order.

    Further arguments are variables of its environment.
    """
    return runner(package)


@pytest.fixture(scope="session")
def compile_once(made, tmp_path_factory) -> Callable[..., Path]:
    """Runs code in a process that lacks its kernels, once; returns the cache that it leaves.

    Arguments are those of `compiled_by`.
    """
    caches: dict[tuple[str, ...], Path] = {}

    def cache_of(code: str, **more: str) -> Path:
        key = (code, *more.values())
        if key not in caches:
            package = tmp_path_factory.mktemp("compiled") / "bridgegen"
            shutil.copytree(made, package)
            assert runner(package)(code, **more) == ["high", "low"]
            caches[key] = package.parent / "cache"
        return caches[key]

    return cache_of
