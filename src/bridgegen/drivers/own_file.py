"""A driver's file named without its class: what it could be called."""

import ast
from collections.abc import Iterable
from pathlib import Path

from bridgegen.base.errors import InputError
from bridgegen.drivers import drivers
from bridgegen.drivers.address import is_remote

MAX_BYTES = 2**20


def get(name: str, ideal: Iterable[str] = (), time_limit: float | None = None) -> drivers.Driver:
    """Return a driver by name; see `bridgegen.drivers.drivers.get`.

    Raises:
        InputError: a file without the class in it; names the classes and functions that it has.
    """
    if name.endswith(".py") and not is_remote(name):
        raise InputError(
            f"a driver in a file is named FILE.py:CLASS, or FILE.py:FUNCTION if it is compiled, "
            f"got '{name}'; {_names_in(name)}"
        )
    return drivers.get(name, ideal, time_limit)


def _names_in(name: str) -> str:
    """Say what a file defines, without running it."""
    try:
        with Path(name).open("rb") as file:
            body = ast.parse(file.read(MAX_BYTES)).body
    except OSError as error:
        return f"the file cannot be read: {error.strerror}"
    except (SyntaxError, ValueError, RecursionError, MemoryError) as error:
        return f"the file is no Python: {error}"
    kinds = (ast.ClassDef, ast.FunctionDef)
    found = [one for one in body if isinstance(one, kinds) and not one.name.startswith("_")]
    if not found:
        return "it defines no class and no function"
    return "it defines " + ", ".join(f"{name}:{one.name}" for one in found)
