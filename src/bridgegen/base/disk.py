"""Files that are written atomically, and pages that replace only pages of the same kind."""

import glob
import os
from collections.abc import Iterable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO

from bridgegen.base.errors import InputError, StorageError

_HEAD = 1000
"""Length of a page's beginning within which its generator is named [bytes]."""


def write_whole(path: Path, chunks: Iterable[bytes]) -> None:
    """Write a file atomically: a temporary file beside it, then a rename.

    Temporary files of killed processes are removed. A device or a pipe is written to directly.

    Args:
        path: of the file; an existing file is replaced.
        chunks: its content.

    Raises:
        StorageError: it cannot be written (no such folder, read-only, disk full).
    """
    with writing_whole(path) as file:
        file.writelines(chunks)


@contextmanager
def writing_whole(path: Path) -> Iterator[IO[bytes]]:
    """Yield a file that replaces ``path`` once all is written; see `write_whole`.

    Args:
        path: of the file; an existing file is replaced.

    Raises:
        StorageError: it cannot be written (no such folder, read-only, disk full).
    """
    # Beside the file, for a rename is atomic within one file system only.
    part = path.with_name(f".{path.name}.{os.getpid()}.part")
    try:
        # A rename would replace /dev/stdout or a named pipe by a file.
        if path.exists() and not path.is_file():
            with path.open("wb") as file:
                yield file
            return
        _remove_left_over(path)
        with part.open("wb") as file:
            _lock(file)
            yield file
        part.replace(path)
    except OSError as error:
        why = error.strerror or error
        raise StorageError(f"{path}: cannot be written: {why}") from None
    finally:
        with suppress(OSError):  # already renamed, or an error is being raised
            part.unlink()


def read_inside(folder: Path, name: str) -> bytes:
    """Return the content of a file in an untrusted folder.

    Args:
        folder: of a run.
        name: of the file, relative to the folder.

    Raises:
        FileNotFoundError: it does not exist.
        StorageError: it cannot be read, is not a file, or is a link to a place outside the folder.
    """
    path = folder / name
    try:
        # A run's folder may come from another person: a link in it must not publish a file of this
        # user's, in a report say.
        if not path.resolve(strict=True).is_relative_to(folder.resolve(strict=True)):
            raise StorageError(f"{path}: is a link to a place outside {folder}, and is not read")
        # Reading a pipe would wait for ever, and a device may have no end.
        if not path.is_file():
            raise StorageError(f"{path}: is not a file")
        return path.read_bytes()
    except FileNotFoundError:
        raise
    except (OSError, RuntimeError) as error:  # RuntimeError: links in a circle
        why = error.strerror if isinstance(error, OSError) else error
        raise StorageError(f"{path}: cannot be read: {why}") from None


def _remove_left_over(path: Path) -> None:
    """Remove temporary files of processes that have ended.

    A lock marks those of processes on other machines, if the file system has locks.
    """
    for part in path.parent.glob(f".{glob.escape(path.name)}.*.part"):
        pid = part.name.split(".")[-2]
        if not (pid.isascii() and pid.isdecimal()) or _runs(int(pid)):
            continue
        with suppress(OSError), part.open("rb") as file:
            if _lock(file):
                part.unlink()


def _runs(pid: int) -> bool:
    """Return whether a process runs on this machine; True if that is unknown."""
    if os.name != "posix":
        return True
    try:
        os.kill(pid, 0)
    except ProcessLookupError:
        return False
    except (OSError, OverflowError):  # another user's; or not a process number
        return True
    return True


def _lock(file: IO[bytes]) -> bool:
    """Lock a file until it is closed; return whether that succeeds."""
    try:
        import fcntl

        fcntl.flock(file, fcntl.LOCK_EX | fcntl.LOCK_NB)
    except (ImportError, OSError):  # not supported, or locked by another process
        return False
    return True


@contextmanager
def locked(folder: Path) -> Iterator[None]:
    """Hold a folder against other processes that do so, where the system has such locks."""
    try:
        import fcntl

        handle = os.open(folder, os.O_RDONLY)
    except (ImportError, OSError):
        yield
        return
    try:
        with suppress(OSError):  # a file system without locks
            fcntl.flock(handle, fcntl.LOCK_EX)
        yield
    finally:
        os.close(handle)


def refuse_other(page: Path, generator: str, what: str) -> None:
    """Reject a page's path that is not .html, or at which another kind of file exists.

    Args:
        page: path of the new page.
        generator: the generator that an earlier page of this kind names.
        what: the kind, for messages ("picture").

    Raises:
        InputError: its name does not end in .html.
        StorageError: another file exists there, or the file cannot be read.
    """
    if page.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{page}: the name of the {what} must end in .html")
    mark = f'<meta name="generator" content="{generator}">'.encode()
    try:
        with page.open("rb") as file:
            ours = mark in file.read(_HEAD)
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{page}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{page}: exists already, is not a {what}, and is not overwritten")
