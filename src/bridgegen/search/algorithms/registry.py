"""The algorithms by name: BridgeGen's own, those of installed packages, and of the user's files."""

from typing import Any

from bridgegen.base.errors import InputError
from bridgegen.base.plugins import PlugIns
from bridgegen.base.user_code import class_of, is_own
from bridgegen.search.algorithms.algorithm import Algorithm
from bridgegen.search.algorithms.cma_es import CMAES
from bridgegen.search.algorithms.ddpg import DDPG
from bridgegen.search.algorithms.dqn import DQN
from bridgegen.search.algorithms.es import ES
from bridgegen.search.algorithms.ga import GA
from bridgegen.search.algorithms.grid import Grid
from bridgegen.search.algorithms.map_elites import MAPElites
from bridgegen.search.algorithms.mopso import MOPSO
from bridgegen.search.algorithms.nsga2 import NSGA2
from bridgegen.search.algorithms.nsga2_dt import NSGA2DT
from bridgegen.search.algorithms.pairwise import Pairwise
from bridgegen.search.algorithms.ppo import PPO
from bridgegen.search.algorithms.ppo_adversary import PPOAdversary
from bridgegen.search.algorithms.pso import PSO
from bridgegen.search.algorithms.random import Random
from bridgegen.search.algorithms.sobol import Sobol
from bridgegen.search.algorithms.spea2 import SPEA2
from bridgegen.search.algorithms.surrogate import Surrogate
from bridgegen.search.algorithms.turbo import TuRBO

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
        raise InputError(f"{place} {lack}; see bridgegen.search.algorithms.Algorithm")
    algorithm: type[Algorithm] = found
    return algorithm
