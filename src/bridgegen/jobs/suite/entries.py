"""What a suite consists of: scenario files and their variations, found in folders."""

import hashlib
import json
from collections.abc import Iterable, Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from typing import Any, Literal

from bridgegen.base.errors import BridgeGenError, InputError
from bridgegen.jobs.suite.rows import NO_MATRIX
from bridgegen.openx.openscenario.kind import files_named_in, kind_of_file
from bridgegen.openx.openscenario.tier4 import is_storyboard
from bridgegen.results.failures import FailureFile, failure_of
from bridgegen.scenario.language.parameters import nearest
from bridgegen.scenario.language.plain_yaml import MAX_BYTES
from bridgegen.scenario.language.reader import DSL, entry_names, load, pack_names
from bridgegen.scenario.language.reader import names as catalogue_names

MOST_FILES = 100_000
"""Largest number of files that are looked at in all folders together."""

RESULTS = "results.jsonl"
"""File of a suite's results, in the suite's folder."""

VARIATIONS = "variations"
"""Folder beside `RESULTS` of variations that were run again."""

_YAML = (".yaml", ".yml")
_STORYBOARD = ".xosc"


@dataclass(frozen=True)
class Entry:
    """A scenario of a suite, with the distribution of its parameters if there is one.

    Attributes:
        name: unique in the suite, short.
        scenario: the path of a file, or a name of the catalogue.
        distribution: the file with its variations, or None.
        problem: why it cannot run; empty if nothing is known to be wrong.
        criteria: pass criteria that the index of its folder states for it, besides its own; see
            `bridgegen.results.failures`.
        count: whose conflicts count as harm by that index; None leaves it to the scenario.
        is_failure: whether that index keeps it as a failure.
    """

    name: str
    scenario: str
    distribution: str | None = None
    problem: str = ""
    criteria: tuple[Mapping[str, Any], ...] = ()
    count: Literal["any"] | None = None
    is_failure: bool = False

    @property
    def digest(self) -> str:
        """A digest of its files, their map and catalogues; empty if they cannot be read."""
        made = hashlib.sha256()
        try:
            if not is_storyboard(self.scenario):
                return load(self.scenario).fingerprint
            if self.criteria or self.count:
                made.update(json.dumps([self.criteria, self.count], sort_keys=True).encode())
            for name in filter(None, (self.scenario, self.distribution)):
                # Maps and catalogues belong to it: the same storyboard on another map is another
                # scenario.
                for path in (Path(name), *files_named_in(Path(name))):
                    made.update(hashlib.sha256(path.read_bytes()).digest())
        except (BridgeGenError, OSError):
            return ""
        return made.hexdigest()


def find_entries(given: Sequence[str | Path]) -> tuple[Entry, ...]:
    """Return the scenarios that files, folders and names stand for.

    In a folder, and the folders in it: scenario files (``.xosc`` with a storyboard, ``.yaml`` with
    a logical scenario), and distribution files, which stand for variations of the scenario that
    they name. A scenario that a distribution of the suite names runs with its variations only. The
    name of a pack stands for all of its scenarios.
    Catalogues, fragments, maps and other files are passed over. A file that is named itself must be
    one of them.

    Args:
        given: paths, or names of the catalogue, of a pack, or of a pack's scenario.

    Returns:
        The entries, in the order of their paths; one with a ``problem`` where a file is broken.

    Raises:
        InputError: a path does not exist, or a file that is named is no scenario; nothing is found.
    """
    problems, found = list[str](), dict[str, Entry]()
    shipped = (*catalogue_names(), *pack_names(), *entry_names())
    for item in given:
        path = Path(item)
        if path.is_dir():
            for file in _files(path):
                if (entry := _entry(file)) is not None:
                    found.setdefault(entry.distribution or entry.scenario, entry)
        elif path.is_file():
            entry = _entry(path)
            if entry is None:
                problems.append(f"{path}: is no scenario and no distribution of one")
            else:
                found.setdefault(entry.distribution or entry.scenario, entry)
        elif some := [name for name in shipped if name == str(item) or name.startswith(f"{item}/")]:
            for name in some:
                found.setdefault(name, Entry(name, name))
        else:
            near = nearest(str(item), [*shipped, *(name.partition("/")[0] for name in shipped)])
            problems.append(f"{item}: no such file, folder, pack or scenario that ships{near}")
    if problems:
        raise InputError(*problems)
    if not found:
        raise InputError(f"no scenario in {', '.join(map(str, given))}")
    # A storyboard with a distribution stands for its variations, and is no entry besides.
    varied = {Path(item.scenario).resolve() for item in found.values() if item.distribution}
    kept = [
        item
        for item in found.values()
        if item.distribution
        or not Path(item.scenario).is_file()
        or Path(item.scenario).resolve() not in varied
    ]
    read = dict[Path, FailureFile]()
    return _named([indexed(item, read) for item in kept])


def indexed(entry: Entry, read: dict[Path, FailureFile] | None = None) -> Entry:
    """Return an entry with what the index of its folder states for it.

    Raises:
        FileFormatError: the index is damaged.
    """
    found = failure_of(entry.scenario, entry.distribution, {} if read is None else read)
    if found is None:
        return entry
    _, failure = found
    count: Literal["any"] | None = "any" if failure.count == "any" else None
    return replace(entry, criteria=tuple(failure.criteria), count=count, is_failure=True)


def of_edition(entries: Sequence[Entry], edition: str | None) -> tuple[Entry, ...]:
    """Return the entries without those whose matrix lacks an edition.

    Raises:
        InputError: no scenario has that edition.
    """
    if edition in (None, NO_MATRIX):
        return tuple(entries)
    kept, known = list[Entry](), set[str]()
    for entry in entries:
        editions = _editions(entry)
        known |= editions
        if not editions or edition in editions:
            kept.append(entry)
    if edition not in known:
        some = f"; editions: {', '.join(sorted(known))}" if known else ""
        raise InputError(f"no scenario has a matrix of the edition '{edition}'{some}")
    return tuple(kept)


def _editions(entry: Entry) -> set[str]:
    """Return the editions of an entry's matrix; none if it has no matrix, or cannot be read."""
    if is_storyboard(entry.scenario):
        return set()
    try:
        return {grid.edition for grid in load(entry.scenario).matrix}
    except BridgeGenError:
        return set()


def _files(folder: Path) -> Iterable[Path]:
    """Return the files of a folder that may be scenarios, in order.

    Variations that were run again are none; see `bridgegen.jobs.suite.replay`.
    """
    found, again = [], set[Path]()
    # Sorted, so that entries have one order on every file system.
    for count, path in enumerate(sorted(folder.rglob("*"))):
        if count >= MOST_FILES:
            raise InputError(f"{folder}: a suite has at most {MOST_FILES} files")
        if path.name == RESULTS:  # sorted before the folder beside it
            again.add(path.parent / VARIATIONS)
        # What `suite replay` has exported lies inside the suite's folder, and is no scenario of it.
        if again and not again.isdisjoint(path.parents):
            continue
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.suffix.lower() in (*_YAML, DSL, _STORYBOARD) and not hidden and path.is_file():
            found.append(path)
    return found


def _entry(path: Path) -> Entry | None:
    """Return the entry of a file; None if it is none."""
    if path.suffix.lower() in (*_YAML, DSL) and not is_storyboard(path):
        with path.open("rb") as file:
            head = file.read(MAX_BYTES)
        # Of DSL, files with declarations alone are imported by others.
        key = b"scenario " if path.suffix.lower() == DSL else b"scenario:"
        is_scenario = any(line.startswith(key) for line in head.splitlines())
        return Entry(path.stem, str(path)) if is_scenario else None
    if not is_storyboard(path):
        return None
    kind, named, problem = kind_of_file(path)
    if problem:
        return Entry(path.stem, str(path), problem=problem)
    if kind == "distribution":
        scenario = (path.parent / named).resolve()
        if not scenario.is_file():
            return Entry(path.stem, named, str(path), f"{path}: no such file: {scenario}")
        return Entry(path.stem, str(_near(scenario, path)), str(path))
    return Entry(path.stem, str(path)) if kind == "storyboard" else None


def _near(path: Path, beside: Path) -> Path:
    """Return a path relative to the working folder where another one is."""
    if beside.is_absolute():
        return path
    try:
        return path.relative_to(Path.cwd())
    except ValueError:
        return path


def _named(entries: list[Entry]) -> tuple[Entry, ...]:
    """Return entries with names of their own: the shortest ends of their paths that are unique."""
    paths = [Path(entry.distribution or entry.scenario).with_suffix("") for entry in entries]
    depth = dict.fromkeys(range(len(paths)), 1)
    names = [path.name for path in paths]
    for _ in range(64):
        seen: dict[str, list[int]] = {}
        for i, name in enumerate(names):
            seen.setdefault(name, []).append(i)
        again = [i for some in seen.values() if len(some) > 1 for i in some]
        if not again:
            break
        for i in again:
            depth[i] += 1
            names[i] = "/".join(paths[i].parts[-depth[i] :])
    order = sorted(range(len(entries)), key=lambda i: names[i])
    return tuple(replace(entries[i], name=names[i]) for i in order)
