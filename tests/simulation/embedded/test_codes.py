"""The numbers that compiler and kernels share: none means two things."""

import ast
import re
from pathlib import Path

import pytest

from bridgegen.simulation.embedded import _codes as codes

FOLDER = Path(codes.__file__).parent


def assigned() -> list[tuple[str, ...]]:
    """Return the names of each line that assigns some."""
    tree = ast.parse((FOLDER / "_codes.py").read_text())
    return [
        tuple(name.id for name in ast.walk(target) if isinstance(name, ast.Name))
        for line in tree.body
        if isinstance(line, ast.Assign)
        for target in line.targets
    ]


def test_every_name_is_assigned_once():
    names = [name for line in assigned() for name in line]
    assert len(names) == len(set(names))


def test_the_names_of_a_line_have_different_numbers():
    for line in assigned():
        if "FIRST_BY_ENTITY" not in line:
            assert len({getattr(codes, name) for name in line}) == len(line), line


@pytest.mark.parametrize(
    "modules",
    [
        ("_start", "_begin", "_world", "_pursuit", "_presence"),  # Program.actions
        ("_trigger", "_relation"),  # Program.probes
    ],
)
def test_kinds_that_one_column_holds_have_different_numbers(modules):
    files = (next(FOLDER.rglob(f"{name}_kernels.py")) for name in modules)
    text = "".join(file.read_text() for file in files)
    kinds = set(re.findall(r"\bkind == ([A-Z_]+)\b", text))
    for several in re.findall(r"\bkind in \(([A-Z_, ]+)\)", text):
        kinds |= set(several.split(", "))
    assert len(kinds) >= 9
    assert len({getattr(codes, kind) for kind in kinds}) == len(kinds)
