"""The folder of the compiled code.

It holds pickles and machine code, so only a folder that this user owns is read.
"""

import hashlib
import os
import stat
import tempfile
from functools import cache
from pathlib import Path

import llvmlite
import numba
import numpy as np

KEPT = "kernels-"
"""The names of folders begin so that later processes use, too."""


@cache
def cache_folder() -> Path:
    """Return the folder of the compiled code; it is created if needed.

    It is in ``NUMBA_CACHE_DIR`` if that is set; else in the user's cache folder; else, if that is
    not writable or belongs to another user, in a temporary folder of this user; else it is a new
    temporary folder for this process only. Nothing of the path depends on the installation: each
    new virtual environment, clone and CI job of the same source uses the same code.
    """
    versions = (numba.__version__, llvmlite.__version__, np.__version__)
    name = KEPT + hashlib.sha256(" ".join(versions).encode()).hexdigest()[:8]
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
