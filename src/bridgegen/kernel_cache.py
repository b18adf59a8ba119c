"""The cache of compiled kernels on disk.

Numba's cache key is the file of the compiled function only, so it misses a change in a kernel that
the function calls from another file. Here the name of the cache folder is a digest of the source of
all private modules beside kernels and of the modules that those take constants from: after a change
in one of them, all kernels are compiled again. Nothing else of the path depends on the
installation: each new virtual environment, clone and CI job of the same source reuses the compiled
code.

The cache holds pickles and machine code, so only a folder that this user owns is read.
"""

import hashlib
import os
import re
import stat
import tempfile
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from functools import lru_cache
from pathlib import Path
from typing import IO, Any

import llvmlite
import numba
import numpy as np
from numba.core import caching
from numba.core.compiler_lock import global_compiler_lock

PACKAGE = Path(__file__).parent
KEPT = "kernels-"
"""The names of folders begin so that later processes use, too."""

IMPORTED = re.compile(r"^ *from bridgegen\.([\w.]+) import", re.MULTILINE)
"""A module of ours that another one imports from."""


@lru_cache(maxsize=1)
def cache_folder() -> Path:
    """Return the folder of the compiled code of exactly this source; it is created if needed.

    It is in ``NUMBA_CACHE_DIR`` if that is set; else in the user's cache folder; else, if that is
    not writable or belongs to another user, in a temporary folder of this user; else it is a new
    temporary folder for this process only.
    """
    versions = (numba.__version__, llvmlite.__version__, np.__version__)
    digest = hashlib.sha256(" ".join(versions).encode())
    for source in sorted(_sources()):
        digest.update(source.read_bytes())
    name = f"{KEPT}{digest.hexdigest()[:16]}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        folder = Path(chosen) / name
        return folder if _is_writable(folder) else _for_this_process()
    home = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "bridgegen"
    if _is_writable(home / name) and _is_owned(home / name):
        return home / name
    shared = Path(tempfile.gettempdir()) / f"bridgegen-{_user()}"
    if _is_writable(shared) and _is_owned(shared) and _is_writable(shared / name):
        return shared / name
    return _for_this_process()


def _sources() -> set[Path]:
    """Return the files of the kernels, and of all modules that they take constants from."""
    homes = {kernels.parent for kernels in PACKAGE.rglob("_*_kernels.py")}
    found = {one for home in homes for one in home.glob("_[!_]*.py")}
    new = list(found)
    while new:
        for module in IMPORTED.findall(new.pop().read_text(encoding="utf-8")):
            source = PACKAGE.joinpath(*module.split(".")).with_suffix(".py")
            if source.is_file() and source not in found:
                found.add(source)
                new.append(source)
    return found


def is_compiled() -> bool:
    """Return whether compiled kernels of an earlier run exist, so that this run starts at once."""
    return any(cache_folder().rglob("*.nbi"))


def is_kept(folder: Path) -> bool:
    """Return whether a cache folder outlives this process."""
    return folder.name.startswith(KEPT)


def _for_this_process() -> Path:
    return Path(tempfile.mkdtemp(prefix="bridgegen-"))


def _user() -> int:
    return os.getuid() if hasattr(os, "getuid") else 0


def _is_writable(folder: Path) -> bool:
    try:
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        with tempfile.TemporaryFile(dir=folder):
            return True
    except OSError:
        return False


def _is_owned(folder: Path) -> bool:
    """Return whether only this user can have written the files of a folder."""
    if not hasattr(os, "getuid"):
        return True  # on this system, each user has a temporary folder
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    return (
        stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & others
    )


class _Locator(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Stores a function's code in a folder named after its subpackage."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        path = Path(file)
        inside = path.is_relative_to(PACKAGE)
        name = (
            ".".join(path.relative_to(PACKAGE).parent.parts) or "root"
            if inside
            else self.get_suitable_cache_subpath(file)
        )
        self._cache_path = str(cache_folder() / name)

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> "_Locator | None":
        # Skips the parent's, which requires ``numba.config.CACHE_DIR``.
        found: _Locator | None = super(caching.UserProvidedCacheLocator, cls).from_function(
            function, file
        )
        return found


class _Format(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


class KernelCache(caching.FunctionCache):  # type: ignore[misc]
    """A function's compiled code on disk; processes that lack it compile one after the other."""

    _impl_class = _Format

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the compiled code of a signature, or None; damaged files are ignored."""
        found = self._load(signature, context)
        if (
            found is None and _CompileLock.acquire()
        ):  # another process may have compiled it meanwhile
            found = self._load(signature, context)
        return found

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep the compiled code of a signature if it can be written."""
        with suppress(OSError):
            super().save_overload(signature, data)

    def _load(self, signature: Any, context: Any) -> Any:
        try:
            return super().load_overload(signature, context)
        except Exception:  # a file that is truncated, zeroed or of another machine
            with suppress(OSError):
                self.flush()
            return None


class _CompileLock:
    """A lock among processes for compilation; always used under Numba's own lock."""

    depth = 0
    file: IO[str] | None = None

    @classmethod
    def acquire(cls) -> bool:
        """Wait until no other process compiles; return whether the lock was acquired now."""
        try:
            import fcntl
        except ImportError:  # not on this system: each process compiles for itself
            return False
        if cls.file is not None:
            return False
        try:
            cls.file = (cache_folder() / "lock").open("w")
            fcntl.flock(cls.file, fcntl.LOCK_EX)
        except OSError:  # a file system without locks
            return False
        return True

    @classmethod
    def release(cls) -> None:
        """Release the lock."""
        if cls.file is not None:
            cls.file.close()
            cls.file = None


@contextmanager
def compiling() -> Iterator[None]:
    """Enclose code that loads or compiles kernels; the outermost one releases the lock."""
    with global_compiler_lock:
        _CompileLock.depth += 1
        try:
            yield
        finally:
            _CompileLock.depth -= 1
            if not _CompileLock.depth:
                _CompileLock.release()
