"""Finding the entries of catalogues in the files of strangers.

A catalogue's folder, its name and its entries' names come from an untrusted file:
only regular files of a folder are read, so many, so large, and nothing that they name in turn but
further entries.
"""

import os
import stat
from collections.abc import Iterable, Iterator
from dataclasses import replace
from pathlib import Path

from lxml import etree

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.openscenario.declarations import CatalogLocations
from bridgegen.openx.openscenario.element import Element, rewritten
from bridgegen.openx.openscenario.entities import Controller, MiscObject, Pedestrian, Vehicle
from bridgegen.openx.openscenario.environment import Environment
from bridgegen.openx.openscenario.positions import Route, Trajectory
from bridgegen.openx.openscenario.reader import element_of
from bridgegen.openx.openscenario.storyboard import Maneuver
from bridgegen.openx.openscenario.tier4 import is_storyboard, root_of
from bridgegen.openx.xml import MAX_BYTES, parse_xml, read_bytes

MAX_FILES = 1000
"""Largest number of files in a catalogue's folder, of any kind."""

_LOCATIONS: dict[type[Element], str] = {
    Vehicle: "vehicles",
    Controller: "controllers",
    Pedestrian: "pedestrians",
    MiscObject: "misc_objects",
    Environment: "environments",
    Maneuver: "maneuvers",
    Trajectory: "trajectories",
    Route: "routes",
}


class CatalogLine(int):
    """A line of a catalogue's file, which messages name, too.

    It is the number of the line wherever one is wanted, and reads ``7 of Catalogs/cars.xosc``.
    """

    file: str

    def __new__(cls, line: int, file: str) -> "CatalogLine":
        """Return a line of a file."""
        made = super().__new__(cls, line)
        made.file = file
        return made

    def __str__(self) -> str:
        return f"{int(self)} of {self.file}"

    def __reduce__(self) -> tuple[type["CatalogLine"], tuple[int, str]]:
        return CatalogLine, (int(self), self.file)


class NoEntryError(FileFormatError):
    """A reference to a catalogue leads nowhere."""


class Catalogs:
    """The catalogues that a scenario file names.

    Args:
        locations: as the file has them; paths that are parameters are not followed.
        folder: of the file.
        skipped: takes a sentence for each thing in an entry that is not supported, as of
            `bridgegen.openx.openscenario.read.read`.
    """

    def __init__(
        self, locations: CatalogLocations, folder: Path, skipped: list[str] | None = None
    ) -> None:
        self._folders = {
            cls: _tidy(folder / str(place.directory.path))
            for cls, field in _LOCATIONS.items()
            if (place := getattr(locations, field)) is not None
        }
        self._skipped = skipped
        self._roots: dict[Path, etree._Element] = {}
        self._entries: dict[tuple[str, str, frozenset[type[Element]]], Element] = {}
        self._bytes = 0

    def entry(self, catalog: str, name: str, classes: Iterable[type[Element]]) -> Element:
        """Return an entry as it stands in its file, its lines `CatalogLine`.

        Args:
            catalog: the catalogue's name.
            name: the entry's.
            classes: of which it may be.

        Raises:
            NoEntryError: no such folder, catalogue or entry.
        FileFormatError: a file of that catalogue's folder cannot be read, or is malformed.
            UnsupportedError: the entry holds what this version does not know.
        """
        known = {cls.__name__: cls for cls in classes if cls in _LOCATIONS}
        key = catalog, name, frozenset(known.values())
        if key not in self._entries:
            self._entries[key] = self._find(catalog, name, known)
        return self._entries[key]

    def _find(self, catalog: str, name: str, known: dict[str, type[Element]]) -> Element:
        folders = list(
            dict.fromkeys(self._folders[cls] for cls in known.values() if cls in self._folders)
        )
        if not folders:
            kinds = " or ".join(f"{tag}Catalog" for tag in known)
            raise NoEntryError(f"catalogue '{catalog}': CatalogLocations has no {kinds}")
        is_there = False
        for path in (path for folder in folders for path in _files(folder, catalog)):
            root = self._root(path)
            for node in root.findall("Catalog"):
                if catalog not in (node.get("name"), path.stem):  # other tools go by the file
                    continue
                is_there = True
                for child in node:
                    if child.get("name") == name and child.tag in known:
                        return self._read(child, known[str(child.tag)], str(path))
        where = ", ".join(map(str, folders))
        if is_there:
            kinds = " or ".join(known)
            raise NoEntryError(f"catalogue '{catalog}' in {where} has no {kinds} '{name}'")
        raise NoEntryError(f"catalogue '{catalog}' is in no file of {where}")

    def _root(self, path: Path) -> etree._Element:
        if path not in self._roots:
            data = read_bytes(path, limit=MAX_BYTES - self._bytes)  # of all of them together
            self._bytes += len(data)
            is_xml = path.suffix.lower() == ".xosc"
            self._roots[path] = parse_xml(data, str(path)) if is_xml else root_of(path)
        return self._roots[path]

    def _read(self, node: etree._Element, cls: type[Element], file: str) -> Element:
        entry = element_of(cls, node, file, self._skipped)
        return rewritten(
            entry, lambda element: replace(element, line=CatalogLine(element.line, file))
        )


def _tidy(path: Path) -> Path:
    """Return a path without its ``..``, if it is the same without."""
    short = Path(os.path.normpath(path))
    try:
        return short if short.samefile(path) else path
    except (OSError, ValueError):
        return path


def _files(folder: Path, catalog: str) -> Iterator[Path]:
    """Yield the files of a folder, one of the catalogue's name first."""
    try:
        paths: list[Path] = []
        for path in folder.iterdir():
            paths.append(path)
            if len(paths) > MAX_FILES:
                raise NoEntryError(
                    f"{folder}: a catalogue's folder may hold {MAX_FILES} files, it has more"
                )
        found = [
            path
            for path in sorted(paths, key=lambda path: (path.stem != catalog, path.name))
            if stat.S_ISREG(path.stat().st_mode) and is_storyboard(path)
        ]
    except (OSError, ValueError) as error:
        reason = getattr(error, "strerror", None) or str(error)
        raise NoEntryError(f"{folder}: cannot be read: {reason}") from None
    yield from found
