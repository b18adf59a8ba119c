"""Which driver a result is of: a digest of what makes it, and what people call it.

A driver's path is neither: the same file is named in many ways, and changes under one name.
"""

import ast
import hashlib
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from functools import lru_cache
from pathlib import Path

from bridgegen.base.errors import InputError
from bridgegen.drivers.address import Command, address_of, is_remote
from bridgegen.drivers.drivers import file_of
from bridgegen.drivers.tunable import split_settings

MOST_LETTERS = 80
"""Maximum number of characters of the name that a user gives a driver."""

MOST_FILES, MOST_BYTES = 64, 2**20
"""Largest number of modules of a driver that are read, and of the bytes [bytes] of each that are
searched for imports."""


@dataclass(frozen=True, order=True)
class Identity:
    """A driver as results tell it from others.

    Attributes:
        name: what it is called: as the user says (``--name``), else its class, else its name.
        content: what makes it, the same wherever its files lie; its own name where nothing is known
            of its files.
    """

    name: str
    content: str


def identity_of(driver: str, digest: str, name: str = "") -> Identity:
    """Return the identity of the driver of a result.

    Args:
        driver: as the user named it; a driver that ships, by its name.
        digest: see `digest_of`, as recorded; "" of a result that has none: then its name, as it was
            typed, is all that is known.
        name: what the user calls it; may be empty.
    """
    if not digest:
        return Identity(name or driver, driver)
    plain, settings = split_settings(driver)
    end = "" if is_remote(plain) or plain.endswith(".fmu") else plain.rpartition(":")[2]
    called = (end or Path(plain).name) + (f"@{settings.name}" if settings else "")
    return Identity(name or called, f"{digest}:{end}")


def labels_of(drivers: Sequence[Identity]) -> list[str]:
    """Return how drivers are called beside each other.

    Of several contents under one name, those after the first are called changed: "V2 (changed)",
    "V2 (changed 2)".
    """
    seen: dict[str, list[str]] = {}
    found = []
    for driver in drivers:
        contents = seen.setdefault(driver.name, [])
        if driver.content not in contents:
            contents.append(driver.content)
        number = contents.index(driver.content)
        more = f" {number}" if number > 1 else ""
        found.append(f"{driver.name} (changed{more})" if number else driver.name)
    return found


def checked_name(name: str) -> str:
    """Return what a user calls a driver.

    Raises:
        InputError: it is no line of 1 to `MOST_LETTERS` characters.
    """
    if not (name.isprintable() and name.strip() and len(name) <= MOST_LETTERS):
        raise InputError(
            f"a driver's name (--name) must be a line of 1 to {MOST_LETTERS} characters, got "
            f"{ascii(name)[:MOST_LETTERS]}"
        )
    return name


def digest_of(driver: str) -> str:
    """Return a digest of the files that make a driver: its own, and modules beside it.

    Modules count if they lie in the file's folder and are imported by name, by the file or by
    another one of them; and the file of its settings. What else a driver reads as it runs
    (weights, say) does not.

    Empty where no file is known: a driver that ships, in a package, or of a server.
    """
    try:
        if is_remote(driver):
            return _digest_of_command(driver)
        plain, settings = split_settings(driver)
        if settings is not None:
            both = digest_of(plain).encode() + settings.read_bytes()
            return hashlib.sha256(both).hexdigest()
        path = file_of(driver)
        if path is None or not path.is_file():
            return ""
        own, *others = _modules(path) if path.suffix == ".py" else [path]
        digest = hashlib.sha256(own.read_bytes())
        for other in others:
            digest.update(hashlib.sha256(other.read_bytes()).digest())
        return digest.hexdigest()
    except (InputError, OSError, ValueError):
        return ""


def _modules(path: Path) -> list[Path]:
    """Return a file and the modules of its folder that it imports, directly or not, by name."""
    found = [path]
    for module in found:  # which grows
        for name in sorted(set(_imported(module))):
            beside = path.parent / f"{name}.py"
            if beside not in found and beside.is_file() and len(found) < MOST_FILES:
                found.append(beside)
    return found


def _imported(path: Path) -> Iterator[str]:
    """Yield the modules that a file imports; none of a file that is no Python."""
    with path.open("rb") as file:
        text = file.read(MOST_BYTES)
    try:
        tree = ast.parse(text)  # it is read, and not run
    except (SyntaxError, ValueError, RecursionError, MemoryError):
        return
    for node in ast.walk(tree):
        if isinstance(node, ast.Import):
            yield from (alias.name.partition(".")[0] for alias in node.names)
        elif isinstance(node, ast.ImportFrom) and node.module:
            yield node.module.partition(".")[0]


def _digest_of_command(driver: str) -> str:
    """Return a digest of a program and of the files among its arguments."""
    command = address_of(driver)
    if not isinstance(command, Command):
        return ""
    digest = hashlib.sha256()
    for word in command.words[1:]:
        if not Path(word).is_file():  # a file is known by what it holds, wherever it lies
            digest.update(word.encode("utf-8", "surrogateescape") + b"\0")
    for path in (Path(word) for word in (command.program or "", *command.words[1:])):
        if path.is_file():
            stat = path.stat()
            # Asked for each entry of a suite: a file is read once, and again if its time or size
            # changes.
            digest.update(_digest_of_file(path, stat.st_mtime_ns, stat.st_size))
    return digest.hexdigest()


@lru_cache(maxsize=64)
def _digest_of_file(path: Path, modified: int, size: int) -> bytes:
    """Return the digest of a file that was modified then."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()
