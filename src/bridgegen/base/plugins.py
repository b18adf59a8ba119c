"""Code that is named: by entry points of installed packages, or by an option of the user."""

import importlib
import importlib.util
import os
import sys
from collections.abc import Callable, Collection, Iterator, MutableMapping
from contextlib import suppress
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path
from types import ModuleType
from typing import TYPE_CHECKING, Any, TypeVar

from bridgegen.base.errors import InputError, UnknownNameError

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint, EntryPoints

Kind = TypeVar("Kind")
LISTED = 12
"""Number of names that a message lists at most."""


@dataclass(frozen=True)
class PlugIns:
    """One kind of things that packages may add.

    Attributes:
        kind: what one is, for messages: "algorithm".
        group: of the entry points.
    """

    kind: str
    group: str

    def names(self, ours: Collection[str]) -> list[str]:
        """Return all names, ours first; imports no other package."""
        return [*ours, *sorted(set(self._points()) - set(ours))]

    def load(self, name: str, ours: Collection[str]) -> Any:
        """Return what an installed package offers by a name; None where the name is ours alone.

        Args:
            name: of it.
            ours: the names that BridgeGen itself takes.

        Raises:
            UnknownNameError: no package offers it; names the nearest.
            InputError: it cannot be loaded, or takes a name that is in use.
        """
        added = self._points().get(name, [])
        if len(added) > (0 if name in ours else 1):
            places = [*(["bridgegen"] if name in ours else []), *(point.value for point in added)]
            raise InputError(
                f"{self.kind} '{name}' is declared more than once: {', '.join(places)}"
            )
        if name in ours:
            return None
        if not added:
            raise UnknownNameError(self.kind, name, self.names(ours))
        try:
            return added[0].load()
        except Exception as error:  # whatever a stranger's module raises while it is imported
            raise InputError(
                f"{self.place(name)} cannot be loaded: {type(error).__name__}: {error}"
            ) from error

    def place(self, name: str) -> str:
        """Return what a plug-in is and where it is declared, for messages."""
        values = ", ".join(point.value for point in self._points().get(name, []))
        return f"{self.kind} '{name}' ({values}, entry point of '{self.group}')"

    def _points(self) -> dict[str, list["EntryPoint"]]:
        import importlib.metadata

        return _declared(importlib.metadata.entry_points, self.group, _module_folders())


def _module_folders() -> tuple[tuple[str, int], ...]:
    """Return the folders of modules, and when packages were last added or removed there [ns]."""
    found = []
    for folder in sys.path:
        with suppress(OSError):
            found.append((folder, os.stat(folder or os.curdir).st_mtime_ns))
    return tuple(found)


@lru_cache(maxsize=64)
def _declared(
    entry_points: Callable[..., "EntryPoints"], group: str, folders: tuple[tuple[str, int], ...]
) -> dict[str, list["EntryPoint"]]:
    """Return the entry points of a group by name; reading those of all packages takes 20 ms."""
    found: dict[str, list[EntryPoint]] = {}
    for point in entry_points(group=group):
        # A package installed twice (a wheel beside an editable copy) lists the same twice.
        if all(point.value != other.value for other in found.setdefault(point.name, [])):
            found[point.name].append(point)
    return found


class Registry(MutableMapping[str, Kind]):
    """Ours by name, then those of installed packages, which are imported when they are asked for.

    Where both have a name, it is ours.

    Args:
        ours: by name.
        added: where packages add theirs.
        check: makes one of what a package offers, given with its name.
    """

    def __init__(
        self, ours: dict[str, Kind], added: PlugIns, check: Callable[[Any, str], Kind]
    ) -> None:
        self._ours, self._added, self._check = ours, added, check
        self._loaded: dict[str, Kind] = {}

    def __getitem__(self, name: str) -> Kind:
        """Return one by name.

        Raises:
            KeyError: there is none.
            InputError: a package's that cannot be loaded, or is not what it should be.
        """
        if name in self._ours:
            return self._ours[name]
        if name not in self._loaded:
            if name not in self._added.names(self._ours):
                raise KeyError(name)
            self._loaded[name] = self._check(self._added.load(name, self._ours), name)
        return self._loaded[name]

    def __setitem__(self, name: str, kind: Kind) -> None:
        self._ours[name] = kind

    def __delitem__(self, name: str) -> None:
        del self._ours[name]

    def __contains__(self, name: object) -> bool:
        return name in self._ours or name in self._added.names(self._ours)

    def __iter__(self) -> Iterator[str]:
        return iter(self._added.names(self._ours))

    def __len__(self) -> int:
        return len(self._added.names(self._ours))


# --- Code of the user that an option names: ``module:Class`` or ``file.py:Class`` ---
# Only what a person has typed is imported, never what a folder or a file names.


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


def object_of(name: str, what: str, kind: type[Kind], noun: str) -> Kind:
    """Return an object of the user's own.

    Args:
        name: ``module:NAME`` or ``file.py:NAME``.
        what: it is, for messages: "--detector".
        kind: of which it must be.
        noun: what that is called: "class".

    Raises:
        InputError: there is no such module, file or object, or importing it raises.
    """
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
    if not isinstance(found, kind):
        # What a module imports from elsewhere is not what it offers.
        has = [
            key
            for key, value in vars(module).items()
            if isinstance(value, kind)
            and (not isinstance(value, type) or value.__module__ == module.__name__)
        ]
        offers = f", and has: {', '.join(has[:LISTED])}" if has else ", and has none"
        raise InputError(f"{what}: {where} must have a {noun} '{wanted}'{offers}")
    return found


def class_of(name: str, what: str) -> type[Any]:
    """Return a class of the user's own; see `object_of`.

    Raises:
        InputError: there is no such module, file or class, or importing it raises.
    """
    if not is_own(name):
        raise InputError(f"{what} must read module:Class or file.py:Class, got '{name}'")
    return object_of(name, what, type, "class")
