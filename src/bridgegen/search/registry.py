"""The algorithms by name: BridgeGen's own, those of installed packages, and of the user's files."""

from typing import Any

from bridgegen.errors import InputError
from bridgegen.own_code import class_of, is_own
from bridgegen.plugins import PlugIns
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
from bridgegen.search.surrogate import Surrogate
from bridgegen.search.turbo import TuRBO

PARTS = ("name", "description", "source", "settings", "objectives", "ask", "tell")
"""Of the protocol."""

ADDED = PlugIns("algorithm", "bridgegen.algorithms")

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
        TuRBO,
        Surrogate,
        DQN,
        DDPG,
        PPO,
        PPOAdversary,
    )
}


def names() -> list[str]:
    """Return every algorithm's name, BridgeGen's own first; imports no other package."""
    return ADDED.names(ALGORITHMS)


def get(name: str) -> type[Algorithm]:
    """Return an algorithm's class.

    Args:
        name: of one that ships or that an installed package adds; or where the user's own is,
            ``module:Class`` or ``file.py:Class``, which is imported.

    Raises:
        UnknownNameError: no such algorithm; names the nearest.
        InputError: another's algorithm that cannot be loaded, lacks a part of the protocol, or
            takes a name that is in use.
    """
    if is_own(name):
        return _checked(class_of(name, "--algorithm"), f"algorithm '{name}'")
    found = ADDED.load(name, ALGORITHMS)
    if found is None:
        return ALGORITHMS[name]
    algorithm = _checked(found, ADDED.place(name))
    if algorithm.name != name:
        raise InputError(
            f"{ADDED.place(name)} has the name '{algorithm.name}'; the two names must agree"
        )
    return algorithm


def _checked(found: Any, place: str) -> type[Algorithm]:
    """Return another's class, which must have all parts of the protocol."""
    missing = [part for part in PARTS if not hasattr(found, part)]
    if missing or not isinstance(found, type):
        lack = f"lacks {', '.join(missing)}" if missing else "is not a class"
        raise InputError(f"{place} {lack}; see bridgegen.search.Algorithm")
    algorithm: type[Algorithm] = found
    return algorithm
