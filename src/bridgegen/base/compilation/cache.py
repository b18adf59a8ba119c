"""The cache of compiled kernels on disk, which processes share.

Each module has a folder there, named after it and its digest (`sources`): after a change of a
source file, what depends on it is compiled again, and nothing else.
"""

from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, Any

from numba.core import caching
from numba.core.compiler_lock import global_compiler_lock

from bridgegen.base.compilation.folder import PACKAGE, cache_folder, digest, shipped
from bridgegen.base.compilation.library import CodeStore, KernelLibrary, is_for_kernel

MAIN = PACKAGE / "simulation" / "embedded" / "_rollout_kernels.py"
"""Source file of the kernel that every search calls."""

OF_A_SEARCH = 230
"""Approximate number of kernels that the first search compiles: files ``code/*.bc`` after
crossroads-s4."""


def is_compiled() -> bool:
    """Return whether compiled kernels exist, so that this run starts at once."""
    folders = [cache_folder(), *([carried.folder] if (carried := shipped()) else [])]
    return any(any((folder / _folder_of(MAIN)).glob("*.nbi")) for folder in folders)


def n_compiled() -> int:
    """Return how many kernels the cache holds that other kernels call, whatever their source."""
    with suppress(OSError):
        return sum(path.suffix == ".bc" for path in (cache_folder() / "code").iterdir())
    return 0


def _folder_of(source: Path) -> str:
    name = ".".join(source.relative_to(PACKAGE).with_suffix("").parts)
    return f"{name}-{digest(source)}"


class _Locator(caching.UserProvidedCacheLocator):  # type: ignore[misc]
    """Stores a function's code in a folder of its module."""

    def __init__(self, function: Callable[..., Any], file: str) -> None:
        self._py_file, self._lineno = file, function.__code__.co_firstlineno
        path = Path(file)
        if path.is_relative_to(PACKAGE):
            folder = _folder_of(path)
        else:
            folder = f"{self.get_suitable_cache_subpath(file)}-{digest(path)}"
        self._cache_path = str(cache_folder() / folder)

    def ensure_cache_path(self) -> None:
        """Leave it to `KernelCache.save_overload`: most functions are compiled in others only."""

    @classmethod
    def from_function(cls, function: Callable[..., Any], file: str) -> "_Locator | None":
        # Skips the parent's, which requires ``numba.config.CACHE_DIR``.
        found: _Locator | None = super(caching.UserProvidedCacheLocator, cls).from_function(
            function, file
        )
        return found


class _Format(caching.CompileResultCacheImpl):  # type: ignore[misc]
    _locator_classes = (_Locator,)

    def rebuild(self, target_context: Any, payload: Any) -> Any:
        codegen = target_context.codegen()
        codegen._library_class = KernelLibrary  # for this one only; Numba's lock is held
        try:
            return super().rebuild(target_context, payload)
        finally:
            del codegen._library_class


class KernelCache(caching.FunctionCache):  # type: ignore[misc]
    """A function's compiled code on disk; of several processes that lack it, one compiles it.

    Others wait for that function only, and compile what else they need: a kernel never calls one
    that calls it, so no two processes wait for each other.
    """

    _impl_class = _Format
    _lock: IO[str] | None = None

    def load_overload(self, signature: Any, context: Any) -> Any:
        """Return the compiled code of a signature, or None; damaged files are ignored."""
        if not hasattr(KernelLibrary, "store"):
            KernelLibrary.store = CodeStore(cache_folder(), context.codegen().magic_tuple())
        found = self._load(signature, context) or self._load_shipped(signature, context)
        if found is None and self._acquire():  # another process may have compiled it meanwhile
            found = self._load(signature, context)
        return found

    def save_overload(self, signature: Any, data: Any) -> None:
        """Keep the compiled code of a signature if it can be written."""
        with suppress(OSError):
            super().save_overload(signature, data)

    @contextmanager
    def compiling(self) -> Iterator[None]:
        """Enclose code that loads or compiles this function; under Numba's lock."""
        with global_compiler_lock:
            outermost = self._lock is None
            try:
                yield
            finally:
                if outermost and self._lock is not None:
                    self._lock.close()  # which releases it
                    self._lock = None

    def _acquire(self) -> bool:
        """Wait until no other process compiles this function; return whether one may have."""
        try:
            import fcntl
        except ImportError:  # not on this system: each process compiles for itself
            return False
        if self._lock is not None:
            return False
        folder = Path(self.cache_path)
        try:
            folder.mkdir(exist_ok=True, parents=True)
            self._lock = (folder / f"{self._impl.filename_base}.lock").open("w")
            fcntl.flock(self._lock, fcntl.LOCK_EX)
        except OSError:  # a full disk, a file system without locks
            return False
        return True

    def _index_key(self, signature: Any, codegen: Any) -> Any:
        # The same signature has two codes: one with a wrapper for Python, one for other kernels
        # only.
        return (*super()._index_key(signature, codegen), is_for_kernel())

    def _load(self, signature: Any, context: Any) -> Any:
        try:
            return super().load_overload(signature, context)
        except Exception:  # a file that is truncated, zeroed or of another machine
            with suppress(OSError):
                self.flush()
            return None

    def _load_shipped(self, signature: Any, context: Any) -> Any:
        """Return the code that came with this installation, or None."""
        carried = shipped()
        if carried is None:
            return None
        folder = carried.folder / Path(self.cache_path).name
        key = super()._index_key(signature, context.codegen())
        # Numba's key names the processor of this machine; the wheel's code was compiled for its
        # baseline.
        key = (key[0], carried.machine, *key[2:], is_for_kernel())
        try:
            file = caching.IndexDataCacheFile(
                str(folder), self._impl.filename_base, self._impl.locator.get_source_stamp()
            )
            data = file.load(key)
            return None if data is None else self._impl.rebuild(context, data)
        except Exception:  # of another release of Numba, or damaged
            return None
