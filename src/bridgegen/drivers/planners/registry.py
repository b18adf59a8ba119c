"""The planners that have an adapter, by name: those of this folder, and of installed packages.

An adapter's file imports its planner only when it drives, so that reading what it says is cheap.
"""

import os
import shlex
from functools import cache
from importlib import import_module
from importlib.metadata import PackageNotFoundError, version
from pkgutil import iter_modules
from types import ModuleType
from typing import TYPE_CHECKING, Any

from bridgegen.adapters import planners as folder
from bridgegen.base.errors import InputError
from bridgegen.base.plugins import PlugIns, Registry
from bridgegen.drivers.planners.planner import DOMAINS, Planner

if TYPE_CHECKING:
    from packaging.requirements import Requirement

PLUG_INS = PlugIns("planner", "bridgegen.drivers")


@cache
def planners() -> Registry[Planner]:
    """Return the planners by name; those of installed packages are imported when asked for."""
    ours: dict[str, Planner] = {}
    for module in _modules():
        for one in constants(module):
            if one.name in ours:
                raise InputError(f"planner '{one.name}' is declared twice, again in {module}")
            ours[one.name] = one
    return Registry(ours, PLUG_INS, _checked)


def constants(module: ModuleType) -> tuple[Planner, ...]:
    """Return the planners that a module declares, as ``PLANNER`` or ``PLANNERS``."""
    one = getattr(module, "PLANNER", None)
    return tuple(getattr(module, "PLANNERS", () if one is None else (one,)))


def missing(planner: Planner) -> str:
    """Return what of a planner's requirements is not met, in words; empty if it is installed."""
    problems = []
    for wanted in _requirements(planner):
        try:
            found = version(wanted.name)
        except PackageNotFoundError:
            problems.append(f"{wanted.name} is not installed")
            continue
        if not wanted.specifier.contains(found, prereleases=True):
            problems.append(f"{wanted.name} must be {wanted.specifier}, is {found}")
    problems += [f"{one} is not set" for one in planner.variables if not os.environ.get(one)]
    return "; ".join(problems)


def installed(planner: Planner) -> str:
    """Return the packages that a planner drives by, with their versions; none may be missing."""
    return ", ".join(f"{one.name} {version(one.name)}" for one in _requirements(planner))


def how_to_get(planner: Planner) -> str:
    """Return the command that installs a planner, and what else it needs."""
    command = shlex.join(["pip", "install", *planner.requires]) if planner.requires else ""
    return "; ".join(text for text in (command, planner.how_to_get) if text)


def require(planner: Planner) -> None:
    """Do nothing if a planner is installed.

    Raises:
        InputError: it is not, or in another version; how to get it.
    """
    if problem := missing(planner):
        raise InputError(
            f"the planner '{planner.name}' needs {', '.join(planner.requires)}: {problem}; get it "
            f"by {how_to_get(planner)}"
        )


def _requirements(planner: Planner) -> list["Requirement"]:
    from packaging.requirements import Requirement  # takes a while

    return [Requirement(text) for text in planner.requires]


def _modules() -> list[ModuleType]:
    names = sorted(one.name for one in iter_modules(folder.__path__))
    ours = {"planner", __name__.rpartition(".")[2]}
    return [
        import_module(f"{folder.__name__}.{name}")
        for name in names
        if name not in ours and not name.startswith("_")
    ]


def _checked(found: Any, name: str) -> Planner:
    """Return what a package offers by a name.

    Raises:
        InputError: it is no planner, has another name, or an unknown domain.
    """
    place = PLUG_INS.place(name)
    if not isinstance(found, Planner):
        raise InputError(f"{place} must be a bridgegen Planner, got a {type(found).__name__}")
    if found.name != name:
        raise InputError(f"{place} must have the same name, got '{found.name}'")
    if odd := sorted(found.domain - DOMAINS.keys()):
        raise InputError(
            f"{place} must state its domain by {', '.join(DOMAINS)}, got {', '.join(odd)}"
        )
    return found
