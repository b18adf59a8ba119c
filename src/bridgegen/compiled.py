"""The one decorator for compiled code, and where the compiled code is kept between runs.

Numba keys its cache by the file of the compiled function alone, so a change in a kernel that it
calls from another file would go unnoticed. Here the cache folder's name is a digest of the source
of every kernel: change one, and all are compiled again.
"""

import hashlib
import os
import tempfile
from collections.abc import Callable
from functools import lru_cache
from pathlib import Path
from typing import Any

import numba


@lru_cache(maxsize=1)
def cache_folder() -> Path:
    """The folder that holds the compiled code of exactly this source, made if need be.

    ``NUMBA_CACHE_DIR`` overrules it; where the user's cache cannot be written, a temporary folder
    serves for as long as the machine keeps it.
    """
    digest = hashlib.sha256(numba.__version__.encode())
    for source in sorted(Path(__file__).parent.rglob("_*kernels.py")):
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
    numba.config.CACHE_DIR = str(cache_folder())
    compiled: Callable[..., Any] = numba.njit(cache=True, nogil=True, error_model="numpy")(function)
    return compiled
