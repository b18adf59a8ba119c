"""What a suite consists of: scenario files and their variations, found in folders."""

import hashlib
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from pathlib import Path

from bridgegen.errors import BridgeGenError, InputError
from bridgegen.odd.plain_yaml import MAX_BYTES
from bridgegen.odd.reader import load, pack_names
from bridgegen.odd.reader import names as catalogue_names
from bridgegen.openx.openscenario.kind import files_named_in, kind_of_file

MOST_FILES = 100_000
"""Files that are looked at in all folders together."""

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
    """

    name: str
    scenario: str
    distribution: str | None = None
    problem: str = ""

    @property
    def digest(self) -> str:
        """A digest of its files, their map and catalogues; empty if they cannot be read."""
        made = hashlib.sha256()
        try:
            if not self.scenario.lower().endswith(_STORYBOARD):
                return load(self.scenario).fingerprint
            for one in filter(None, (self.scenario, self.distribution)):
                for path in (Path(one), *files_named_in(Path(one))):
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
    shipped = (*catalogue_names(), *pack_names())
    for one in given:
        path = Path(one)
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
        elif some := [name for name in shipped if name == str(one) or name.startswith(f"{one}/")]:
            for name in some:
                found.setdefault(name, Entry(name, name))
        else:
            problems.append(f"{one}: no such file, folder, pack or scenario that ships")
    if problems:
        raise InputError(*problems)
    if not found:
        raise InputError(f"no scenario in {', '.join(map(str, given))}")
    varied = {Path(one.scenario).resolve() for one in found.values() if one.distribution}
    kept = [
        one
        for one in found.values()
        if one.distribution or not Path(one.scenario).is_file()
        or Path(one.scenario).resolve() not in varied
    ]  # fmt: skip
    return _named(kept)


def _files(folder: Path) -> Iterable[Path]:
    """Return the files of a folder that may be scenarios, in order."""
    found = []
    for count, path in enumerate(sorted(folder.rglob("*"))):
        if count >= MOST_FILES:
            raise InputError(f"{folder}: a suite has at most {MOST_FILES} files")
        hidden = any(part.startswith(".") for part in path.relative_to(folder).parts)
        if path.suffix.lower() in (*_YAML, _STORYBOARD) and not hidden and path.is_file():
            found.append(path)
    return found


def _entry(path: Path) -> Entry | None:
    """Return the entry of a file; None if it is none."""
    if path.suffix.lower() in _YAML:
        with path.open("rb") as file:
            head = file.read(MAX_BYTES)
        is_scenario = any(line.startswith(b"scenario:") for line in head.splitlines())
        return Entry(path.stem, str(path)) if is_scenario else None
    if path.suffix.lower() != _STORYBOARD:
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
    paths = [Path(one.distribution or one.scenario).with_suffix("") for one in entries]
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
