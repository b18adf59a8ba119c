"""Particle swarm optimisation, pymoo's."""

from collections.abc import Mapping
from typing import Any, ClassVar

from bridgegen.search.algorithms.algorithm import Arity, Setting
from bridgegen.search.algorithms.evolved import Evolved


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
            adaptive=False,
            initial_velocity="zero",
            max_velocity_rate=values["max_velocity"],
            pertube_best=values["mutate_best"],
        )
