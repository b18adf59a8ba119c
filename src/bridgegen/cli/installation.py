"""This installation of BridgeGen: versions, machine, cache, extras, other simulators.

Reading it starts nothing, connects to nothing, and compiles the elementary functions at most.
"""

import os
import platform
import re
from collections.abc import Iterator
from dataclasses import dataclass
from importlib.metadata import PackageNotFoundError, requires, version
from pathlib import Path

from bridgegen.base.extras import EXTRAS, is_installed
from bridgegen.drivers.drivers import planner_findings
from bridgegen.engine.workers.processes import cores

LIBRARIES = ("numpy", "numba", "llvmlite", "pyoxigraph", "pyshacl")
"""Packages whose versions decide on results, or on compiled code."""

ESMINI, CARLA = "ESMINI_LIB", "CARLA_HOST"


@dataclass(frozen=True)
class Finding:
    """One fact about the installation.

    Attributes:
        subject: what it is about.
        value: the fact.
        advice: what to do, where something is missing; else empty.
        is_problem: whether a search of the catalogue would fail, or be slower at each start.
    """

    subject: str
    value: str
    advice: str = ""
    is_problem: bool = False


def examine() -> Iterator[Finding]:
    """Yield the facts about this installation."""
    yield Finding("bridgegen", version("bridgegen"))
    yield Finding("Python", f"{platform.python_version()}, {platform.platform()}")
    yield from _libraries()
    yield Finding("cores", str(cores()))
    yield _cache()
    yield _bits()
    for extra, (_, use) in EXTRAS.items():
        if is_installed(extra):
            yield Finding(f"extra {extra}", f"installed ({use})")
        else:
            advice = f"pip install 'bridgegen[{extra}]'"
            yield Finding(f"extra {extra}", f"not installed ({use})", advice)
    for name, state, advice in planner_findings():
        yield Finding(f"planner {name}", state, advice)
    yield _esmini()
    host = os.environ.get(CARLA)
    yield Finding("CARLA server", host or f"localhost, as {CARLA} is not set")


def _libraries() -> Iterator[Finding]:
    for name in LIBRARIES:
        try:
            yield Finding(name, version(name))
        except PackageNotFoundError:
            yield Finding(name, "missing", f"pip install '{_requirement(name)}'", is_problem=True)


def _requirement(name: str) -> str:
    """Return what BridgeGen requires of a package."""
    found = [require for require in requires("bridgegen") or [] if re.match(rf"{name}\b", require)]
    return found[0].partition(";")[0].strip() if found else name


def _cache() -> Finding:
    from bridgegen.base.compilation.cache import is_compiled
    from bridgegen.base.compilation.folder import cache_folder, is_kept

    folder = cache_folder()
    if not is_kept(folder):
        return Finding(
            "compiled code",
            f"{folder}, for this process only",
            "make ~/.cache writable for you alone, or set NUMBA_CACHE_DIR",
            is_problem=True,
        )
    if is_compiled():
        return Finding("compiled code", str(folder))
    return Finding(
        "compiled code", f"{folder}, empty", "the first search compiles, which takes minutes"
    )


def _bits() -> Finding:
    from bridgegen.base.compilation.cache import is_compiled
    from bridgegen.engine.conformance import differences

    rows = is_compiled()  # else they take minutes
    if different := differences(rows=rows):
        return Finding(
            "bits",
            f"not the published ones: {', '.join(different)}",
            "results differ from other machines' in their last digits; report it, with this list",
        )
    return Finding("bits", "the published ones" if rows else "the published ones, of functions")


def _esmini() -> Finding:
    from bridgegen.simulation.esmini.simulator import RELEASES

    path = os.environ.get(ESMINI)
    if path is None:
        return Finding(
            "esmini",
            f"unknown: {ESMINI} is not set",
            f"get libesminiLib.so of esmini 3 from {RELEASES}; name it in {ESMINI}, or by "
            "--esmini-lib (docs/esmini.md)",
        )
    if not Path(path).is_file():
        return Finding("esmini", f"{path}: no such file", f"correct {ESMINI}", is_problem=True)
    return Finding("esmini", path)
