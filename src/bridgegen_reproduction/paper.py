"""What the paper prints in Section V: numbers and facts, by table.

Source: Hao et al., "BridgeGen: Bridging Data-Driven and Knowledge-Driven Approaches for
Safety-Critical Scenario Generation in Automated Vehicle Validation", Tables II to VI.
"""

from collections.abc import Mapping
from dataclasses import dataclass

PACK = "paper"
"""The pack that holds the scenarios as the paper has them; the catalogue's are changed since."""

MAIN = f"{PACK}-crossroads-s4"
"""The scenario that Section V examines in detail."""

SCENARIOS = (MAIN, *(f"{PACK}-crossroads-s{number}" for number in (1, 2, 3)))

ITERATIONS, POPULATION = 25, 40
"""Tables IV and V."""

WEIGHTS = {"d_min": 0.8297, "v_d": 0.1703}
"""Of the fitness, a1 and a2, Section V-B; d_min in m, v_d in km/h."""

POINTS = {
    ("A", "in"): "P1",
    ("A", "out"): "P2",
    ("B", "in"): "P3",
    ("B", "out"): "P4",
    ("C", "in"): "P5",
    ("C", "out"): "P6",
    ("D", "in"): "P7",
    ("D", "out"): "P8",
}
"""Where a leg's inbound lane begins, and where its outbound lane ends."""


@dataclass(frozen=True)
class Design:
    """A row of Table II.

    Attributes:
        ego: the points between which the ego drives.
        ego_speed: [m/s].
        bv: the points between which the background vehicle drives.
        bv_speed: [m/s].
        conflict: what it calls their conflict point.
    """

    ego: tuple[str, str]
    ego_speed: float
    bv: tuple[str, str]
    bv_speed: float
    conflict: str


DESIGNS = {
    f"{PACK}-crossroads-s1": Design(("P5", "P2"), 6.9, ("P3", "P8"), 1.8, "C1"),
    f"{PACK}-crossroads-s2": Design(("P5", "P2"), 6.9, ("P1", "P4"), 1.8, "C2"),
    f"{PACK}-crossroads-s3": Design(("P1", "P6"), 6.9, ("P7", "P2"), 5.5, "C3"),
    f"{PACK}-crossroads-s4": Design(("P5", "P8"), 6.9, ("P3", "P8"), 1.8, "C4"),
}
"""Table II."""


def shipped(scenario: str) -> str:
    """Return the name by which `bridgegen` knows one of `SCENARIOS`."""
    return f"{PACK}/{short(scenario)}"


def short(scenario: str) -> str:
    """Return what the user calls one of `SCENARIOS`."""
    return scenario.removeprefix(f"{PACK}-")


THRESHOLDS = {"n_collision_above": 0.0, "d_min_below": 2.0, "v_d_at_least": 1.0}
"""Table III; printed without units."""


@dataclass(frozen=True)
class Method:
    """A search method of Section V.

    Attributes:
        algorithm: ours, by name.
        title: the paper's name of it.
    """

    algorithm: str
    title: str


RS, PPO = Method("random", "RS"), Method("ppo", "PPO")
PSO, NSGA2DT = Method("pso", "PSO"), Method("nsga2-dt", "NSGA-II-DT")

GROUPS: Mapping[str, tuple[Method, ...]] = {"single": (RS, PPO, PSO), "many": (RS, NSGA2DT)}
"""Those that are compared with each other, the baseline first: of one objective, of many."""

METHODS = (RS, PPO, PSO, NSGA2DT)

TITLES = {method.algorithm: method.title for method in METHODS}

HYPERPARAMETERS: Mapping[str, Mapping[str, float]] = {
    "ppo": {"epochs": 32, "gamma": 0.99, "lr_actor": 0.0003, "lr_critic": 0.001},
    "pso": {"c1": 1.5, "c2": 1.5, "w": 0.8},
    "nsga2-dt": {"crossover": 0.7, "mutation": 0.05},
}
"""Tables IV and V, by our settings' names."""

RESULTS: Mapping[tuple[str, str], Mapping[str, float]] = {
    ("single", "random"): {
        "r_critic": 0.530, "t_critic": 5.089, "avg_d_min": 13.38, "median_d_min": 12.19,
        "avg_v_d": 17.92, "median_v_d": 18.96, "avg_fitness": -8.05, "median_fitness": -8.32,
        "runtime": 406.0,
    },
    ("single", "ppo"): {
        "r_critic": 0.852, "t_critic": 1.000, "avg_d_min": 2.00, "median_d_min": 1.40,
        "avg_v_d": 20.57, "median_v_d": 22.10, "avg_fitness": 1.84, "median_fitness": 2.31,
        "runtime": 366.0,
    },
    ("single", "pso"): {
        "r_critic": 0.746, "t_critic": 1.954, "avg_d_min": 4.91, "median_d_min": 1.45,
        "avg_v_d": 20.49, "median_v_d": 20.36, "avg_fitness": 16.59, "median_fitness": 18.61,
        "runtime": 388.0,
    },
    ("many", "random"): {
        "r_critic": 0.541, "t_critic": 1.567, "avg_d_min": 4.94, "median_d_min": 1.45,
        "avg_v_d": 19.38, "median_v_d": 19.26, "runtime": 467.0,
    },
    ("many", "nsga2-dt"): {
        "r_critic": 0.649, "t_critic": 1.000, "avg_d_min": 2.90, "median_d_min": 0.69,
        "avg_v_d": 20.61, "median_v_d": 20.38, "runtime": 424.0,
    },
}  # fmt: skip
"""Table VI, by group and algorithm; d_min in m, v_d in km/h, runtime in s."""

T_CRITIC_IN_THE_TEXT = 5.098
"""Of RS among the methods of one objective, Section V-C-1."""


def fitness(d_min: float, v_d_kmh: float) -> float:
    """Return the fitness of Section V-B, as Table VI's rows of RS and PPO have it: −a1·d + a2·v."""
    return -WEIGHTS["d_min"] * d_min + WEIGHTS["v_d"] * v_d_kmh
