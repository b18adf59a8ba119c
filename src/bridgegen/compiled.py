"""The one decorator for compiled code, and where the compiled code is kept between runs.

Numba keys its cache by the file of the compiled function alone, so a change in a kernel that it
calls from another file would go unnoticed. Here the cache folder's name is a digest of the source
of every private module, kernels and what they read: change one, and all are compiled again.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba
import numba.extending


@lru_cache(maxsize=1)
def cache_folder() -> Path:
    """The folder that holds the compiled code of exactly this source, made if need be.

    ``NUMBA_CACHE_DIR`` overrules it; where the user's cache cannot be written, a temporary folder
    serves for as long as the machine keeps it.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob("_[!_]*.py")):
        digest.update(source.read_bytes())
    name = f"kernels-{digest.hexdigest()[:16]}"
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    home = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "bridgegen"
    fallback = (
        Path(tempfile.gettempdir()) / f"bridgegen-{os.getuid() if hasattr(os, 'getuid') else 0}"
    )
    for parent in [Path(chosen)] if chosen else [home, fallback]:
        folder = parent / name
        try:
            folder.mkdir(parents=True, exist_ok=True, mode=0o700)
            with tempfile.TemporaryFile(dir=folder):
                return folder
        except OSError:
            continue
    return Path(tempfile.mkdtemp(prefix="bridgegen-"))


def is_compiled() -> bool:
    """Whether an earlier run has left compiled kernels, so that this one starts at once."""
    return any(cache_folder().rglob("*.nbi"))


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of arrays and numbers on its first call; it then runs without the GIL.

    A kernel never raises, does not check its arguments (its wrapper does), divides by zero as
    IEEE 754 says, and is not reordered (no fastmath), so its result is the same in any batch.
    """
    return _compile(function, cache=True)


def inlined_kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a part of a kernel: as ``kernel`` does, but into each kernel that calls it.

    For what runs at every instant and takes many arrays, whose descriptions a call would copy.
    """
    return _compile(function, inline="always")


def _compile(function: Callable[..., Any], **options: bool | str) -> Callable[..., Any]:
    numba.config.CACHE_DIR = str(cache_folder())
    compiled: Callable[..., Any] = numba.njit(nogil=True, error_model="numpy", **options)(function)
    return compiled


def _borrowed(_: Any, array: Any) -> Any:
    """In a kernel: the same array, not counted as a reference to its memory.

    Its owner must outlive it. Every reading of an array out of a tuple counts a reference up and
    down, atomically; with one that is borrowed, the compiler sees that there is nothing to count.
    """

    def generate(context: Any, builder: Any, signature: Any, arguments: Any) -> Any:
        view = context.make_array(signature.args[0])(context, builder, arguments[0])
        view.meminfo = view.meminfo.type(None)
        return view._getvalue()

    return array(array), generate


def _itself(array: Any) -> Any:
    return array


borrowed = _itself if numba.config.DISABLE_JIT else numba.extending.intrinsic(_borrowed)
