"""The folder of compiled code, the sources that it depends on, and code that a wheel carries.

It holds pickles and machine code, so only a folder that this user owns is read.
"""

import hashlib
import json
import os
import re
import stat
import sys
import tempfile
from collections.abc import Iterable, Iterator
from dataclasses import dataclass
from functools import cache
from pathlib import Path

import llvmlite
import numba
import numpy as np
from llvmlite import binding as llvm

KEPT = "kernels-"
"""Prefix of the folders that later processes use, too."""


@cache
def cache_folder() -> Path:
    """Return the folder of the compiled code; it is created if needed.

    It is in ``NUMBA_CACHE_DIR`` if that is set; else in the user's cache folder; else, if that is
    not writable or belongs to another user, in a temporary folder of this user; else it is a new
    temporary folder for this process only. Nothing of the path depends on the installation: each
    new virtual environment, clone and CI job of the same source uses the same code.
    """
    # The cache holds pickles of Numba's own classes, which another version may not read.
    versions = (numba.__version__, llvmlite.__version__, np.__version__)
    name = KEPT + hashlib.sha256(" ".join(versions).encode()).hexdigest()[:8]
    chosen = os.environ.get("NUMBA_CACHE_DIR")
    # A folder that the user names is trusted, whoever owns it.
    if chosen:
        folder = Path(chosen) / name
        return folder if _is_writable(folder) else _for_this_process()
    home = Path(os.environ.get("XDG_CACHE_HOME") or "~/.cache").expanduser() / "bridgegen"
    if _is_writable(home / name) and _is_owned(home / name):
        return home / name
    # Another user may have made this folder first, to have us unpickle what lies in it: hence the
    # check of its owner and of its rights.
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
    # Not `stat`, which follows a symbolic link to a folder that somebody else may exchange.
    found = folder.lstat()
    others = stat.S_IWGRP | stat.S_IWOTH
    return (
        stat.S_ISDIR(found.st_mode) and found.st_uid == os.getuid() and not found.st_mode & others
    )


# --- Which source files the code of a kernel depends on ---
# Numba looks at the file of the compiled function only, so it misses a change in a kernel that the
# function calls from another file, or in a constant that it takes from there. Here a module's
# digest is of its own source and of all modules of this package that it imports, directly or not.


PACKAGE = Path(__file__).parents[2]

IMPORTED = re.compile(r"^ *from bridgegen\.([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
"""Regular expression of an import of a module of BridgeGen, and of the imported names."""


@cache
def digest(source: Path) -> str:
    """Return the digest of a module, and of all that it imports of this package.

    Args:
        source: its file; for one outside this package, the digest is of all kernels.
    """
    known = {source} if source.is_relative_to(PACKAGE) else set(PACKAGE.rglob("_*_kernels.py"))
    digest = hashlib.sha256()
    for path in sorted(with_imported(known)):
        digest.update(_content(path))
    return digest.hexdigest()[:16]


def with_imported(sources: Iterable[Path]) -> set[Path]:
    """Return the files of modules, and of all that they import of this package."""
    known = set(sources)
    new = list(known)
    while new:
        found = _imported(new.pop()) - known
        known |= found
        new += found
    return known


@cache
def _content(source: Path) -> bytes:
    return hashlib.sha256(source.read_bytes()).digest()


@cache
def _imported(source: Path) -> frozenset[Path]:
    return frozenset(_imports(source.read_text(encoding="utf-8")))


def _imports(text: str) -> Iterator[Path]:
    for module, names in IMPORTED.findall(text):
        home = PACKAGE.joinpath(*module.split("."))
        if home.is_dir():  # names of a package may be modules
            submodules = (home / f"{name}.py" for name in re.findall(r"\w+", names))
            yield home / "__init__.py"
            yield from (submodule for submodule in submodules if submodule.is_file())
        elif home.with_suffix(".py").is_file():
            yield home.with_suffix(".py")


# --- Compiled code that a wheel carries: read, never written, where this machine can run it ---
# A wheel without it, or on a machine that lacks an instruction of its baseline, compiles as always.


FOLDER = PACKAGE / "_kernels"
BASELINE = "x86-64-v3"
"""Processors that code is compiled for: those of 2013 (Intel Haswell) and 2015 (AMD Excavator), and
later ones."""

FEATURES = (
    "avx", "avx2", "bmi", "bmi2", "cmov", "crc32", "cx16", "cx8", "f16c", "fma", "fxsr", "lzcnt",
    "mmx", "movbe", "popcnt", "sahf", "sse", "sse2", "sse3", "sse4.1", "sse4.2", "ssse3", "xsave",
)  # fmt: skip
"""Instructions of ``BASELINE``, as LLVM names them. Source: x86-64 psABI, micro-architecture
levels."""


@dataclass(frozen=True)
class Shipped:
    """The compiled code of a wheel.

    Attributes:
        folder: it lies there as in the cache.
        machine: for which it was compiled, as Numba writes it: triple, processor, features.
    """

    folder: Path
    machine: tuple[str, str, str]


def described() -> dict[str, str]:
    """Return what must be the same where code of this process is to be used."""
    python = f"{sys.implementation.cache_tag}"
    return {"python": python, "numba": numba.__version__, "triple": llvm.get_process_triple()}


def features() -> str:
    """Return the baseline's instructions as LLVM wants them."""
    return ",".join(f"+{feature}" for feature in FEATURES)


@cache
def shipped() -> Shipped | None:
    """Return the code that came with this installation, if this machine can run it."""
    try:
        facts = json.loads((FOLDER / "machine.json").read_text("utf-8"))
        has = llvm.get_host_cpu_features()
    except (OSError, ValueError, RuntimeError):
        return None
    # Code for a baseline has the bits of code for the host: nothing is contracted or reordered for
    # a processor (checked with 17 scenarios × 6 drivers × 40 rows on a Zen 4).
    if facts != described() or not all(has.get(feature) for feature in FEATURES):
        return None
    return Shipped(FOLDER, (facts["triple"], BASELINE, features()))
