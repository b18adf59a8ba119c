"""A pretend GPU: its driver runs the module's PTX on this processor; see ``tools/ptx.py``."""

import importlib.util
from pathlib import Path

import pytest

from bridgegen.base import cuda
from bridgegen.base.cuda import DEVICE
from bridgegen.simulation.embedded import device

ROOT = Path(__file__).parents[2]


def tool(name):
    spec = importlib.util.spec_from_file_location(name, ROOT / "tools" / f"{name}.py")
    module = importlib.util.module_from_spec(spec)
    spec.loader.exec_module(module)
    return module


@pytest.fixture(scope="session")
def ptx():
    return tool("ptx")


@pytest.fixture
def gpu(ptx, monkeypatch):
    """Yield the pretend driver of a command with ``--device cuda``; it is no device by itself."""
    driver = ptx.Driver()
    monkeypatch.setattr(cuda, "library", lambda: driver)
    monkeypatch.delenv(DEVICE, raising=False)
    device._opened.cache_clear()
    yield driver
    device._opened.cache_clear()
