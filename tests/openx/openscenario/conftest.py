"""Fixtures and helpers; ``scenes`` is loaded by path because tests are no packages."""

import importlib.util
import sys
from pathlib import Path

import pytest

_SPEC = importlib.util.spec_from_file_location("scenes", Path(__file__).with_name("scenes.py"))
scenes = importlib.util.module_from_spec(_SPEC)
sys.modules.setdefault("openscenario_scenes", scenes)
_SPEC.loader.exec_module(scenes)


@pytest.fixture(scope="session")
def s4() -> bytes:
    """A file that we wrote."""
    return scenes.written(scenes.individuals())
