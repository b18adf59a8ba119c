"""The algorithms by name: ours, and those that installed packages add."""

from typing import TYPE_CHECKING

from bridgegen.errors import InputError, UnknownNameError
from bridgegen.search.algorithm import Algorithm
from bridgegen.search.cma_es import CMAES
from bridgegen.search.ddpg import DDPG
from bridgegen.search.dqn import DQN
from bridgegen.search.es import ES
from bridgegen.search.ga import GA
from bridgegen.search.grid import Grid
from bridgegen.search.map_elites import MAPElites
from bridgegen.search.mopso import MOPSO
from bridgegen.search.nsga2 import NSGA2
from bridgegen.search.nsga2_dt import NSGA2DT
from bridgegen.search.pairwise import Pairwise
from bridgegen.search.ppo import PPO
from bridgegen.search.ppo_adversary import PPOAdversary
from bridgegen.search.pso import PSO
from bridgegen.search.random import Random
from bridgegen.search.sobol import Sobol
from bridgegen.search.spea2 import SPEA2

if TYPE_CHECKING:
    from importlib.metadata import EntryPoint

GROUP = "bridgegen.algorithms"

ALGORITHMS: dict[str, type[Algorithm]] = {
    cls.name: cls
    for cls in (
        Random,
        Sobol,
        Grid,
        Pairwise,
        PSO,
        GA,
        ES,
        CMAES,
        NSGA2,
        SPEA2,
        MOPSO,
        NSGA2DT,
        MAPElites,
        DQN,
        DDPG,
        PPO,
        PPOAdversary,
    )
}


def names() -> list[str]:
    """Return every algorithm's name, ours first; imports no other package."""
    return [*ALGORITHMS, *sorted(set(_entry_points()) - set(ALGORITHMS))]


def get(name: str) -> type[Algorithm]:
    """Return an algorithm's class.

    Raises:
        UnknownNameError: no such algorithm; names the nearest.
        InputError: an installed package's algorithm that cannot be loaded, lacks a part of the
            protocol, or takes a name that is in use.
    """
    added = _entry_points().get(name, [])
    if len(added) > (0 if name in ALGORITHMS else 1):
        places = [*(["bridgegen"] if name in ALGORITHMS else []), *(e.value for e in added)]
        raise InputError(f"algorithm '{name}' is declared more than once: {', '.join(places)}")
    if name in ALGORITHMS:
        return ALGORITHMS[name]
    if not added:
        raise UnknownNameError("algorithm", name, names())
    place = f"algorithm '{name}' ({added[0].value}, entry point of '{GROUP}')"
    try:
        found = added[0].load()
    except Exception as error:  # whatever a stranger's module raises while it is imported
        raise InputError(f"{place} cannot be loaded: {type(error).__name__}: {error}") from error
    parts = ("name", "description", "source", "settings", "objectives", "ask", "tell")
    missing = [part for part in parts if not hasattr(found, part)]
    if missing or not isinstance(found, type):
        lack = f"lacks {', '.join(missing)}" if missing else "is not a class"
        raise InputError(f"{place} {lack}; see bridgegen.search.Algorithm")
    algorithm: type[Algorithm] = found
    if algorithm.name != name:
        raise InputError(f"{place} calls itself '{algorithm.name}'; the two names must agree")
    return algorithm


def _entry_points() -> dict[str, list["EntryPoint"]]:
    from importlib.metadata import entry_points

    found: dict[str, list[EntryPoint]] = {}
    for point in entry_points(group=GROUP):
        # A package installed twice (a wheel beside an editable copy) lists the same object twice.
        if all(point.value != other.value for other in found.setdefault(point.name, [])):
            found[point.name].append(point)
    return found
