"""Where compiled kernels are kept between runs, and by whom they may be read.

Numba keys its cache by the file of the compiled function alone, so a change in a kernel that it
calls from another file would go unnoticed. Here the cache folder's name is a digest of the source
of every private module beside a kernel, and of the modules that those take constants from: change
one, and all are compiled again. Nothing else of the folder's path depends on where the package is
installed: each new virtual environment, clone and CI job of the same source finds what an earlier
one compiled.

The cache holds pickles and machine code, so only a folder of this user's own is read.
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

IMPORTED = re.compile(r"^ *from bridgegen\.([\w.]+) import", re.MULTILINE)
"""A module of ours that another one imports from."""


@lru_cache(maxsize=1)
def cache_folder() -> Path:
    """The folder that holds the compiled code of exactly this source, made if need be.

    ``NUMBA_CACHE_DIR`` says where; otherwise it is the user's cache, or, where that cannot be
    written or belongs to somebody else, a folder of the user's own among the temporary ones. Where
    that belongs to somebody else, too, a new one serves this process alone.
    """
    versions = (numba.__version__, llvmlite.__version__, np.__version__)
    digest = hashlib.sha256(" ".join(versions).encode())
    for source in sorted(_sources()):
        digest.update(source.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    if chosen:
        folder = Path(chosen) / name
        return folder if _is_writable(folder) else _for_this_process()
    home = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "bridgegen"
    if _is_writable(home / name) and _is_ours(home / name):
        return home / name
    shared = Path(tempfile.gettempdir()) / f"bridgegen-{_user()}"
    if _is_writable(shared) and _is_ours(shared) and _is_writable(shared / name):
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
    """Whether an earlier run has left compiled kernels, so that this one starts at once."""
    return any(cache_folder().rglob("*.nbi"))


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


def _is_ours(folder: Path) -> bool:
    """Whether nobody but this user can have written what lies in a folder."""
    if not hasattr(os, "getuid"):
        return True  # on this system, temporary folders are each user's own
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    return (
        stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & others
    )


class _Locator(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Keeps a function's code in a folder named by its place in this package."""

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
        # Not the parent's, who asks for ``numba.config.CACHE_DIR``.
        found: _Locator | None = super(caching.UserProvidedCacheLocator, cls).from_function(
            function, file
        )
        return found


class _Format(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)


class KernelCache(caching.FunctionCache):  # type: ignore[misc]
    """A function's compiled code on disk; of processes that lack it, one compiles at a time."""

    _impl_class = _Format

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the compiled code of a signature, or None; what is damaged is left out."""
        found = self._load(signature, context)
        if found is None and _Turn.take():  # somebody else may have compiled it meanwhile
            found = self._load(signature, context)
        return found

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep the compiled code of a signature, if it can be written: else the next run compiles."""
        with suppress(OSError):
            super().save_overload(signature, data)

    def _load(self, signature: Any, context: Any) -> Any:
        try:
            return super().load_overload(signature, context)
        except Exception:  # a file that is cut off, of zeros, of another machine
            with suppress(OSError):
                self.flush()
            return None


class _Turn:
    """This process's turn to compile; always under Numba's own lock."""

    depth = 0
    file: IO[str] | None = None

    @classmethod
    def take(cls) -> bool:
        """Wait until no other process compiles; return whether this one had to ask."""
        try:
            import fcntl
        except ImportError:  # not on this system: each compiles for itself
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
    def give_back(cls) -> None:
        """Let others compile."""
        if cls.file is not None:
            cls.file.close()
            cls.file = None


@contextmanager
def compiling() -> Iterator[None]:
    """Around whatever loads or compiles a kernel: ends this process's turn with the outermost."""
    with global_compiler_lock:
        _Turn.depth += 1
        try:
            yield
        finally:
            _Turn.depth -= 1
            if not _Turn.depth:
                _Turn.give_back()
