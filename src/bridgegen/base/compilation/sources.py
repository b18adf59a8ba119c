"""Which source files the code of a kernel depends on.

Numba looks at the file of the compiled function only, so it misses a change in a kernel that the
function calls from another file, or in a constant that it takes from there. Here a module's digest
is of its own source and of all modules of this package that it imports, directly or not.
"""

import hashlib
import re
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = Path(__file__).parents[2]

IMPORTED = re.compile(r"^ *from bridgegen\.([\w.]+) import (\([^)]*\)|[^\n]*)", re.MULTILINE)
"""A module of ours, and the names that another one imports from it."""


@cache
def digest(source: Path) -> str:
    """Return the digest of a module, and of all that it imports of this package.

    Args:
        source: its file; for one outside this package, the digest is of all kernels.
    """
    known = {source} if source.is_relative_to(PACKAGE) else set(PACKAGE.rglob("_*_kernels.py"))
    new = list(known)
    while new:
        found = _imported(new.pop()) - known
        known |= found
        new += found
    digest = hashlib.sha256()
    for one in sorted(known):
        digest.update(_content(one))
    return digest.hexdigest()[:16]


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
            yield from (one for one in submodules if one.is_file())
        elif home.with_suffix(".py").is_file():
            yield home.with_suffix(".py")
