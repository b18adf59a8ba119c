"""Code of the user's own that an option names: ``module:Class``, or a file's, ``file.py:Class``.

Only what a person has typed is imported, never what a folder or a file names.
"""

import importlib
import importlib.util
import sys
from pathlib import Path
from types import ModuleType
from typing import Any

from bridgegen.base.errors import InputError


def is_own(name: str) -> bool:
    """Return whether a name is that of code, ``module:Class`` or ``file.py:Class``."""
    where, _, found = name.rpartition(":")
    return bool(where) and found.isidentifier()


def label_of(name: str) -> str:
    """Return a short name: of code, that of the class; any other as it is."""
    return name.rpartition(":")[2] if is_own(name) else name


def file_of(name: str) -> Path | None:
    """Return the file that holds the code; None where it is a module's."""
    where = name.rpartition(":")[0]
    return Path(where) if is_own(name) and where.endswith(".py") else None


def module_of(where: str) -> ModuleType:
    """Import a module by its name, or a file that ends in .py.

    Raises:
        ImportError: there is no such module or file.
    """
    if not where.endswith(".py"):
        return importlib.import_module(where)
    path = Path(where)
    if not path.is_file():
        raise ImportError("there is no such file")
    taken = sys.modules.get(path.stem)
    is_another = taken is not None and getattr(taken, "__file__", None) != str(path)
    name = f"_own_{path.stem}" if is_another else path.stem  # a file may be called json.py
    found = importlib.util.spec_from_file_location(name, path)
    assert found is not None
    assert found.loader is not None
    module = importlib.util.module_from_spec(found)
    sys.modules[name] = module
    found.loader.exec_module(module)
    return module


def class_of(name: str, what: str) -> type[Any]:
    """Return a class of the user's own.

    Args:
        name: ``module:Class`` or ``file.py:Class``.
        what: it is, for messages: "--detector".

    Raises:
        InputError: there is no such module, file or class, or importing it raises.
    """
    if not is_own(name):
        raise InputError(f"{what} must read module:Class or file.py:Class, got '{name}'")
    where, _, wanted = name.rpartition(":")
    try:
        module = module_of(where)
    except ImportError as error:
        raise InputError(f"{what}: {where} cannot be imported: {error}") from error
    except Exception as error:  # whatever a user's module raises while it is imported
        raise InputError(
            f"{what}: {where} cannot be imported: {type(error).__name__}: {error}"
        ) from error
    found = getattr(module, wanted, None)
    if not isinstance(found, type):
        raise InputError(f"{what}: {where} must have a class '{wanted}'")
    return found
