"""Files that are written whole or not at all, and pages that replace none but their own kind."""

import glob
import os
from collections.abc import Iterable
from contextlib import suppress
from pathlib import Path
from typing import IO

from bridgegen.errors import InputError, StorageError

_HEAD = 1000
"""Bytes of a page in which it says who made it."""


def write_whole(path: Path, chunks: Iterable[bytes]) -> None:
    """Write a file beside its place, then put it there: nobody ever reads half of it.

    What processes that were killed left of the same file is removed. A device or a pipe is written
    to, and never replaced.

    Args:
        path: where to; a file that exists is replaced.
        chunks: what it holds.

    Raises:
        StorageError: it cannot be written (no such folder, read-only, disk full).
    """
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        if path.exists() and not path.is_file():
            with path.open("wb") as file:
                file.writelines(chunks)
            return
        _remove_left_over(path)
        with part.open("wb") as file:
            _lock(file)
            file.writelines(chunks)
        part.replace(path)
    except OSError as error:
        raise StorageError(f"{path}: cannot be written: {error.strerror}") from None
    finally:
        with suppress(OSError):  # it is there no more, or the first error has been raised already
            part.unlink()


def read_inside(folder: Path, name: str) -> bytes:
    """Return a file of a folder that somebody else may have made.

    Args:
        folder: of a run.
        name: of the file, relative to it.

    Raises:
        FileNotFoundError: there is none.
        StorageError: it cannot be read, is no file, or is a link to a place outside the folder.
    """
    path = folder / name
    try:
        if not path.resolve(strict=True).is_relative_to(folder.resolve(strict=True)):
            raise StorageError(f"{path}: is a link to a place outside {folder}, and is not read")
        if not path.is_file():
            raise StorageError(f"{path}: is not a file")
        return path.read_bytes()
    except FileNotFoundError:
        raise
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        why = error.strerror if isinstance(error, OSError) else error
        raise StorageError(f"{path}: cannot be read: {why}") from None


def _remove_left_over(path: Path) -> None:
    """Remove the parts of a file whose processes have ended: none of this machine's, none locked.

    The lock tells of processes on other machines, where the file system has such locks.
    """
    for part in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        pid = part.name.split(".")[-2]
        if not (pid.isascii() and pid.isdecimal()) or _runs(int(pid)):
            continue
        with suppress(OSError), part.open("rb") as file:
            if _lock(file):
                part.unlink()


def _runs(pid: int) -> bool:
    """Say whether there is such a process on this machine, as far as can be told."""
    if os.name != "posix":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # somebody else's; or no process's number
        return True
    return True


def _lock(file: IO[bytes]) -> bool:
    """Lock a file until it is closed; return whether that succeeds."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):  # not on this system, nor on this file system; or it is taken
        return False
    return True


def refuse_other(page: Path, generator: str, what: str) -> None:
    """Refuse a page's name that is no page's, or is taken by anything but an earlier one.

    Args:
        page: where it is to be.
        generator: what an earlier one names as its generator.
        what: what it is, for messages ("picture").

    Raises:
        InputError: its name does not end in .html.
        StorageError: something else is there, or nobody can tell.
    """
    if page.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{page}: the {what} is a page, its name must end in .html")
    mark = f'<meta name="generator" content="{generator}">'.encode()
    try:
        with page.open("rb") as file:
            ours = mark in file.read(_HEAD)
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{page}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{page}: exists already, is no {what}, and is not overwritten")
