"""What scenarios and drivers are called in a project, the same on every machine."""

import re
from dataclasses import dataclass
from pathlib import Path, PurePosixPath

from bridgegen.drivers import is_remote, is_spec

_VERSION = re.compile(r"[-_@]v?([0-9]+(?:[._][0-9]+)*)$")
_SUFFIXES = (".py", ".fmu")


@dataclass(frozen=True, order=True)
class Driver:
    """A system under test, and which version of it.

    Attributes:
        name: without the version: what failure modes and requirements are about.
        version: of the name, "1.2" of ``stack-1.2``; of a driver that ships BridgeGen's; "" where
            nothing says it.
        label: as people call it.
    """

    name: str
    version: str
    label: str


def scenario_name(text: str, project: Path, distribution: str = "") -> str:
    """Return what a scenario is called: its name, or where its file is in the project.

    Args:
        text: as a run or suite records it: a name, or a path.
        project: folder of the project.
        distribution: the file with its variations, if there is one: it names the scenario.
    """
    given = distribution or text
    is_path = given.lower().endswith((".yaml", ".yml", ".xosc"))
    return place_of(given, project) if is_path else given


def driver_of(text: str, project: Path, bridgegen: str) -> Driver:
    """Return the driver of a result.

    A version ends a part of the name behind ``-``, ``_`` or ``@``: ``stack-1.2``,
    ``stack_v3.py:Stack``, ``builds/stack@7/driver.py:Stack``.

    Args:
        text: as a run or suite records it.
        project: folder of the project.
        bridgegen: version of BridgeGen that made the result.
    """
    if is_remote(text):
        return Driver(text, "", text)
    if not is_spec(text):
        name, version = _split(text)
        return Driver(name, version or f"BridgeGen {bridgegen}", text)
    file, _, cls = (text, "", "") if text.endswith(".fmu") else text.rpartition(":")
    label = place_of(file, project)
    parts, version = [], ""
    for part in PurePosixPath(label).parts:
        bare, found = _split(part)
        parts.append(bare)
        version = found or version
    end = f":{cls}" if cls else ""
    return Driver("/".join(parts) + end, version, label + end)


def _split(part: str) -> tuple[str, str]:
    """Return a part of a name without its version, and the version."""
    suffix = next((one for one in _SUFFIXES if part.endswith(one)), "")
    stem = part.removesuffix(suffix)
    found = _VERSION.search(stem)
    if found is None or not found.start():
        return part, ""
    return stem[: found.start()] + suffix, found[1]


def place_of(text: str, project: Path) -> str:
    """Return where a file is, as seen from the project's folder; by its name if far from it."""
    path = Path(text)
    if not path.is_absolute():
        tried = (project / path, project.parent / path, Path.cwd() / path)
        path = next((one for one in tried if one.exists()), path)
        if not path.is_absolute():
            return path.as_posix()
    try:
        return path.relative_to(project).as_posix()
    except ValueError:
        pass
    try:
        return "../" + path.relative_to(project.parent).as_posix()
    except ValueError:
        return "/".join(path.parts[-2:])
