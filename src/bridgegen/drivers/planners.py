"""Planners of others as drivers: what an adapter declares, and the table of all adapters.

Adapters are found by the entry points ``bridgegen.drivers``, ours (`adapters/planners`) like those
of other packages. An adapter's file imports its planner only when it drives, so that reading what
it declares is cheap.
"""

import os
import shlex
from dataclasses import dataclass
from functools import cache
from importlib.metadata import PackageNotFoundError, version
from typing import TYPE_CHECKING, Any

from bridgegen.base.errors import InputError
from bridgegen.base.plugins import PlugIns, Registry

if TYPE_CHECKING:
    from packaging.requirements import Requirement


@dataclass(frozen=True)
class Planner:
    """A planner that others wrote, and our adapter for it.

    Attributes:
        name: as given to ``--ego``.
        description: one sentence: what it is, and what of the driving is its own.
        spec: of the adapter, ``module:Class``, see `bridgegen.drivers.interface.BatchDriver`.
        requires: requirements of pip, as ``fiss-planner>=1.0,<2``, that it needs to drive.
        licence: of the planner.
        source: its publication or page.
        how_to_get: one sentence, where pip alone is not enough; else empty.
        domain: where it means to drive: words of `DOMAINS`; elsewhere it is not judged.
        variables: environment variables that must be set, to the folder of a checkout for example.
    """

    name: str
    description: str
    spec: str
    requires: tuple[str, ...]
    licence: str
    source: str
    how_to_get: str = ""
    domain: frozenset[str] = frozenset()
    variables: tuple[str, ...] = ()


DOMAINS = {
    "motorway": "carriageways of one direction, without crossing traffic",
    "road": "roads with oncoming traffic, without junctions on the way",
    "junction": "junctions, where others cross or turn",
    "oncoming": "a vehicle that drives the wrong way towards the ego",
    "vulnerable": "pedestrians and cyclists on the way or beside it",
}
"""Parts of an operational design domain, as planners state them."""

PLUG_INS = PlugIns("planner", "bridgegen.drivers")


@cache
def planners() -> Registry[Planner]:
    """Return the planners by name; each is imported when it is asked for."""
    return Registry({}, PLUG_INS, _checked)


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
    problems += [
        f"{variable} is not set" for variable in planner.variables if not os.environ.get(variable)
    ]
    return "; ".join(problems)


def installed(planner: Planner) -> str:
    """Return the packages that a planner drives by, with their versions; none may be missing."""
    return ", ".join(
        f"{requirement.name} {version(requirement.name)}" for requirement in _requirements(planner)
    )


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
