"""Processes import what works by its name: this folder is on their path."""

import sys
from pathlib import Path

import pytest


@pytest.fixture(autouse=True, scope="session")
def doubles_can_be_imported():
    sys.path.append(str(Path(__file__).parent / "doubles"))
    yield
    sys.path.remove(str(Path(__file__).parent / "doubles"))
