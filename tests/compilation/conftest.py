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
from bridgegen.compiled import kernel


@kernel
def low(x):
    return FACTOR * math.sin(x)
"""
HIGH = """
from bridgegen._low_kernels import low
from bridgegen.compiled import kernel


@kernel
def high(x):
    return low(x) + low(x + 1.0)
"""
OTHER = """
from bridgegen.compiled import kernel


@kernel
def other(x):
    return x + 1.0
"""
COUNTED = """
from numba.core import event
from bridgegen.compilation import library
library.LARGE = 0  # so that every kernel is called, none linked
with event.install_recorder("numba:compile") as recorder:
    {}
named = [one.data["dispatcher"].__name__ for _, one in recorder.buffer if one.is_start]
print(*sorted(named))
"""

Run = Callable[..., list[str]]


@pytest.fixture
def package(tmp_path) -> Path:
    """A copy of the package with four modules more."""
    here = Path(bridgegen.__file__).parent
    shutil.copytree(here, tmp_path / "bridgegen", ignore=shutil.ignore_patterns("__pycache__"))
    modules = {"_low_kernels": LOW, "_high_kernels": HIGH, "_other_kernels": OTHER}
    for name, text in (modules | {"_constants": "FACTOR = 2.0\n"}).items():
        (tmp_path / "bridgegen" / f"{name}.py").write_text(text)
    return tmp_path / "bridgegen"


@pytest.fixture
def compiled_by(package) -> Run:
    """Runs code in a process, and returns the kernels that it compiled, in alphabetical order.

    Further arguments are variables of its environment.
    """

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
