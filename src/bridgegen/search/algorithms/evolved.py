"""Algorithms built on pymoo's populations: GA, ES, NSGA-II, SPEA2, PSO; a generation is a batch."""

import math
from abc import ABC, abstractmethod
from collections.abc import Mapping
from typing import Any, ClassVar

from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import (
    RESTART_WITHIN,
    Arity,
    Problem,
    Results,
    Setting,
    Value,
    asynchronous,
    resolve,
)

# --- Base of the algorithms built on pymoo's populations: a generation is a batch ---


class Evolved(ABC):
    """A population that changes from generation to generation; restarts when it has converged.

    Attributes:
        scaled: whether it measures distances between objectives, which then need one scale.
    """

    name: ClassVar[str]
    description: ClassVar[str]
    source: ClassVar[str]
    settings: ClassVar[Mapping[str, Setting]]
    objectives: ClassVar[Arity]
    scaled: ClassVar[bool] = False

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        from bridgegen.search.algorithms._pymoo import Generations

        self._values = resolve(type(self), problem, seed, settings)
        within = self._values["restart_within"]
        self._search = Generations(
            self._build,
            problem,
            seed,
            within,
            scaled=self.scaled,
            asynchronous=asynchronous(type(self)),
        )

    @abstractmethod
    def _build(self) -> Any:
        """Return pymoo's algorithm, not yet set up."""

    def ask(self) -> Float:
        """Return the next generation, one row each."""
        return self._search.ask()

    def tell(self, U: Float, results: Results) -> None:
        """Select the survivors, or the next moves, by the rows' results.

        Raises:
            ValueError: U are not the first rows that were asked for and are not told.
        """
        self._search.tell(U, results)


# --- Base of pymoo's genetic algorithms: crossover and mutation ---


class Genetic(Evolved):
    """A population whose parents are crossed and whose children are mutated.

    Crossover is simulated binary, mutation polynomial (each parameter with probability 1/n of a
    mutated child, or 1/2 where n is one or two); a child that is a known individual is not
    evaluated again. Selection and survival are each algorithm's own.

    Source: Deb and Agrawal (1995), "Simulated binary crossover for continuous search space".
    """

    asynchronous: ClassVar[bool] = True
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "individuals, and rows per batch", low=4, high=100_000),
        "crossover": Setting(0.9, "probability that two parents are crossed", 0.0, 1.0),
        "crossover_eta": Setting(15.0, "how close children stay to their parents", 0.0, 1000.0),
        "mutation": Setting(0.9, "probability that a child is mutated", 0.0, 1.0),
        "mutation_eta": Setting(20.0, "how little a mutated parameter moves", 0.0, 1000.0),
        "restart_within": RESTART_WITHIN,
    }

    def _build(self) -> Any:
        from pymoo.operators.crossover.sbx import SBX
        from pymoo.operators.mutation.pm import PM

        values = self._values
        return self._algorithm(
            pop_size=values["population"],
            crossover=SBX(prob=values["crossover"], eta=values["crossover_eta"]),
            mutation=PM(prob=values["mutation"], eta=values["mutation_eta"]),
        )

    @abstractmethod
    def _algorithm(self, **parts: Any) -> Any:
        """Return pymoo's algorithm, not yet set up, with a population size and operators."""


# --- A genetic algorithm, pymoo's ---


class GA(Genetic):
    """Tournament selection, crossover, mutation, and survival of the best.

    Source: Deb and Agrawal (1995), "Simulated binary crossover for continuous search space";
    elitist survival of parents and children together, as in pymoo.
    """

    name: ClassVar[str] = "ga"
    description: ClassVar[str] = "genetic algorithm of one objective (pymoo)"
    source: ClassVar[str] = "Deb and Agrawal (1995), Complex Systems 9(2)"
    objectives: ClassVar[Arity] = "one"

    def _algorithm(self, **parts: Any) -> Any:
        from pymoo.algorithms.soo.nonconvex import ga

        return ga.GA(**parts)


# --- An evolution strategy, pymoo's ---


class ES(Evolved):
    """The best of a generation's children become the next parents; no parent survives.

    Each individual has its own step sizes, one per parameter, which mutate before use (log-normal
    self-adaptation); some children move by differences of parents instead. The first generation is
    drawn anywhere, as many as there are parents.

    Source: Runarsson and Yao (2005), "Search biases in constrained evolutionary optimization",
    without its constraints.
    """

    name: ClassVar[str] = "es"
    description: ClassVar[str] = "evolution strategy of one objective, steps self-adapted (pymoo)"
    source: ClassVar[str] = "Runarsson and Yao (2005), doi:10.1109/TSMCC.2004.841906"
    settings: ClassVar[Mapping[str, Setting]] = {
        "children": Setting(
            40, "children of a generation, and rows per batch", low=4, high=100_000
        ),
        "parents": Setting(
            0.15, "share of the children that become parents; at least two", 0.01, 0.5
        ),
        "gamma": Setting(0.85, "length of the steps by differences of parents", 0.0, 2.0),
        "restart_within": RESTART_WITHIN,
    }
    objectives: ClassVar[Arity] = "one"
    asynchronous: ClassVar[bool] = True

    def _build(self) -> Any:
        from pymoo.algorithms.soo.nonconvex import es

        children = self._values["children"]
        parents = min(max(2, math.ceil(children * self._values["parents"])), children // 2)
        return es.ES(n_offsprings=children, pop_size=parents, gamma=self._values["gamma"])


# --- NSGA-II, pymoo's ---


class NSGA2(Genetic):
    """Individuals survive by the rank of their non-dominated front, then by crowding.

    Source: Deb, Pratap, Agarwal and Meyarivan (2002), "A fast and elitist multiobjective genetic
    algorithm: NSGA-II".
    """

    name: ClassVar[str] = "nsga2"
    description: ClassVar[str] = (
        "non-dominated sorting genetic algorithm II, many objectives (pymoo)"
    )
    source: ClassVar[str] = "Deb et al. (2002), doi:10.1109/4235.996017"
    objectives: ClassVar[Arity] = "many"

    def _algorithm(self, **parts: Any) -> Any:
        from pymoo.algorithms.moo import nsga2

        return nsga2.NSGA2(**parts)


# --- SPEA2, pymoo's ---


class SPEA2(Genetic):
    """Individuals survive by strength (how many their dominators dominate), then by density.

    Source: Zitzler, Laumanns and Thiele (2001), "SPEA2: Improving the strength Pareto evolutionary
    algorithm".
    """

    name: ClassVar[str] = "spea2"
    description: ClassVar[str] = "strength Pareto evolutionary algorithm 2, many objectives (pymoo)"
    source: ClassVar[str] = (
        "Zitzler, Laumanns and Thiele (2001), TIK report 103, doi:10.3929/ethz-a-004284029"
    )
    objectives: ClassVar[Arity] = "many"
    scaled: ClassVar[bool] = True

    def _algorithm(self, **parts: Any) -> Any:
        from pymoo.algorithms.moo import spea2

        # SPEA2's density is a distance in F: `scaled` puts all objectives on one scale before.
        return spea2.SPEA2(survival=spea2.SPEA2Survival(normalize=False), **parts)


# --- Particle swarm optimisation, pymoo's ---


class PSO(Evolved):
    """A swarm of particles drawn to their own best row and to the swarm's.

    The inertia and the two pulls are constant, as in the paper; pymoo's adaptive variant would
    replace them after the first generation. Where the paper is silent:

    - particles start at rest. pymoo's default draws initial velocities from [0, max_velocity],
      never negative, so that the whole swarm first drifts towards the cube's far corner;
    - a particle that would leave the cube draws its velocity again, up to 20 times, and then
      falls back to a random place between its old one and the face it crossed (pymoo's rule);
    - each generation, the particle that holds the best row is replaced by a polynomial mutation
      of that row;
    - a converged swarm would propose one row forever (on a smooth function of ten parameters after
      some 180 generations). It restarts without memory: its findings are in the store, and another
      start may find another kind of critical scenario.

    Source: Kennedy and Eberhart (1995), "Particle swarm optimization"; the inertia weight is Shi
    and Eberhart's (1998). Hyper-parameters: paper, Table IV.
    """

    name: ClassVar[str] = "pso"
    description: ClassVar[str] = "particle swarm optimisation of one objective (pymoo)"
    source: ClassVar[str] = "Kennedy and Eberhart (1995), doi:10.1109/ICNN.1995.488968"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "particles, and rows per batch", low=2, high=100_000),
        "w": Setting(0.8, "inertia: share of the velocity that a particle keeps", 0.0, 2.0),
        "c1": Setting(1.5, "pull towards the particle's own best row", 0.0, 4.0),
        "c2": Setting(1.5, "pull towards the swarm's best row", 0.0, 4.0),
        "max_velocity": Setting(
            0.2, "largest step per generation and parameter, as a share of its range", 1e-6, 1.0
        ),
        "mutate_best": Setting(True, "replace the best row's particle by a mutation of that row"),
        "restart_within": Setting(
            1e-3,
            "scatter the swarm afresh once half of its particles' best rows are this close to "
            "the best one, as a share of each parameter's range; 0: never",
            0.0,
            1.0,
        ),
    }
    objectives: ClassVar[Arity] = "one"

    def _build(self) -> Any:
        from pymoo.algorithms.soo.nonconvex import pso

        values = self._values
        return pso.PSO(
            pop_size=values["population"],
            w=values["w"],
            c1=values["c1"],
            c2=values["c2"],
            # Constant, as in the paper; pymoo's adaptive variant would replace w, c1 and c2 after
            # the first generation.
            adaptive=False,
            # pymoo's own initial velocities are never negative: the swarm would first drift to a
            # corner.
            initial_velocity="zero",
            max_velocity_rate=values["max_velocity"],
            pertube_best=values["mutate_best"],
        )
