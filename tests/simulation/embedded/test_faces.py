"""The folders of the embedded simulator: what one may call of another, and its drivers' table."""

import ast
from functools import cache
from pathlib import Path

import pytest

from bridgegen import drivers as ego
from bridgegen import simulation
from bridgegen.drivers.drivers import DRIVERS, GUESTS
from bridgegen.simulation.embedded.drivers import DEMANDS

NAME = "bridgegen.simulation.embedded"
FOLDER = Path(simulation.__file__).parent / "embedded"
WITH_A_FACE = ("conditions", "drivers", "motion", "user_drivers", "storyboard", "world")
"""Folders whose ``__init__`` names all that others may call."""


@cache
def imports(file: Path) -> list[str]:
    """The modules that a file imports from."""
    tree = ast.parse(file.read_text(encoding="utf-8"))
    return [n.module or "" for n in ast.walk(tree) if isinstance(n, ast.ImportFrom)]


@pytest.mark.parametrize("folder", WITH_A_FACE)
def test_others_import_from_a_folder_not_from_its_files(folder: str) -> None:
    inside = f"{NAME}.{folder}."
    assert (FOLDER / folder / "__init__.py").is_file()
    for file in Path(ego.__file__).parents[1].rglob("*.py"):
        if FOLDER / folder not in file.parents:
            assert [one for one in imports(file) if one.startswith(inside)] == [], file


def test_every_driver_that_ships_has_a_kernel_and_no_other() -> None:
    assert set(DEMANDS) == set(DRIVERS)
    assert not set(DEMANDS) & set(GUESTS)
