"""The algorithms by name: BridgeGen's own, those of installed packages, and of the user's files."""

from collections.abc import Iterator, MutableMapping
from importlib import import_module
from typing import Any

from bridgegen.base.errors import InputError
from bridgegen.base.plugins import PlugIns, class_of, is_own
from bridgegen.search.algorithms.algorithm import Algorithm

PARTS = ("name", "description", "source", "settings", "objectives", "ask", "tell")
"""Attributes of the algorithm protocol."""

ADDED = PlugIns("algorithm", "bridgegen.algorithms")

_PLACES = {
    "random": "bridgegen.search.algorithms.sampling:Random",
    "sobol": "bridgegen.search.algorithms.sampling:Sobol",
    "grid": "bridgegen.search.algorithms.sampling:Grid",
    "pairwise": "bridgegen.search.algorithms.pairwise:Pairwise",
    "pso": "bridgegen.search.algorithms.evolved:PSO",
    "ga": "bridgegen.search.algorithms.evolved:GA",
    "es": "bridgegen.search.algorithms.evolved:ES",
    "cma-es": "bridgegen.search.algorithms.cma_es:CMAES",
    "nsga2": "bridgegen.search.algorithms.evolved:NSGA2",
    "spea2": "bridgegen.search.algorithms.evolved:SPEA2",
    "mopso": "bridgegen.search.algorithms.mopso:MOPSO",
    "nsga2-dt": "bridgegen.search.algorithms.nsga2_dt:NSGA2DT",
    "map-elites": "bridgegen.search.algorithms.map_elites:MAPElites",
    "turbo": "bridgegen.search.algorithms.turbo:TuRBO",
    "surrogate": "bridgegen.search.algorithms.surrogate:Surrogate",
    "rate": "bridgegen.search.algorithms.rate:Rate",
    "dqn": "bridgegen.search.algorithms.reinforcement:DQN",
    "ddpg": "bridgegen.search.algorithms.reinforcement:DDPG",
    "ppo": "bridgegen.search.algorithms.reinforcement:PPO",
    "ppo-adversary": "bridgegen.search.algorithms.ppo_adversary:PPOAdversary",
}
"""Modules and classes of the shipped algorithms, by name."""


class _Ours(MutableMapping[str, type[Algorithm]]):
    """Ours by name, each imported when it is asked for: a search needs one of them."""

    def __init__(self) -> None:
        self._loaded: dict[str, type[Algorithm]] = {}

    def __getitem__(self, name: str) -> type[Algorithm]:
        if name not in self._loaded:
            module, _, attribute = _PLACES[name].partition(":")
            self._loaded[name] = getattr(import_module(module), attribute)
        return self._loaded[name]

    def __setitem__(self, name: str, algorithm: type[Algorithm]) -> None:
        self._loaded[name] = algorithm

    def __delitem__(self, name: str) -> None:
        del self._loaded[name]

    def __iter__(self) -> Iterator[str]:
        return iter(dict.fromkeys([*_PLACES, *self._loaded]))

    def __len__(self) -> int:
        return len({*_PLACES, *self._loaded})


ALGORITHMS: MutableMapping[str, type[Algorithm]] = _Ours()


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
