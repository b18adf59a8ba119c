"""A particle swarm of many objectives: SMPSO."""

from collections.abc import Mapping
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.algorithms.algorithm import (
    RESTART_WITHIN,
    Arity,
    Penalty,
    Problem,
    Results,
    Setting,
    Value,
    resolve,
)
from bridgegen.search.algorithms.dominance import crowding, non_dominated, thin
from bridgegen.search.algorithms.sampling import latin_hypercube

TURNED = -0.001
"""Factor of a particle's velocity at a face of the cube."""
ETA = 20.0
"""Distribution index of the mutation."""


class MOPSO:
    """A swarm whose particles are drawn to their own best row and to the swarm's common front.

    Its leaders are an archive of non-dominated rows; the most crowded is removed when it is full,
    and of two drawn at random the less crowded leads. Velocities are constricted, and bounded by
    half of the cube. Some particles are mutated (polynomially, a parameter with probability
    1/n) as they move, so that a swarm behind one leader does not stagnate.

    This is an own implementation: pymoo's MOPSO_CD evaluates additional rows during setup, which an
    exact budget does not allow, and has no mutation. Where the source is silent:

    - the first rows are a Latin hypercube;
    - a converged swarm restarts, as the other algorithms do.

    Source: Nebro et al. (2009), "SMPSO: a new PSO-based metaheuristic for multi-objective
    optimization", based on Reyes-Sierra and Coello Coello's (2006), which the paper cites.
    """

    name: ClassVar[str] = "mopso"
    description: ClassVar[str] = "particle swarm of many objectives, speed-constrained (SMPSO)"
    source: ClassVar[str] = "Nebro et al. (2009), doi:10.1109/MCDM.2009.4938830"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "particles, and rows per batch", low=2, high=100_000),
        "archive": Setting(100, "rows of the front that are kept as leaders", 2, 100_000),
        "w": Setting(0.1, "inertia: share of the velocity that a particle keeps", 0.0, 1.0),
        "pull": Setting(
            2.0, "mean pull towards the particle's own best row and towards its leader", 0.5, 10.0
        ),
        "mutation": Setting(0.15, "share of the particles that are mutated", 0.0, 1.0),
        "restart_within": RESTART_WITHIN,
    }
    objectives: ClassVar[Arity] = "many"

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        values = resolve(MOPSO, problem, seed, settings)
        self._n_var, self._size = problem.n_var, int(values["population"])
        self._archive_size, self._w = int(values["archive"]), float(values["w"])
        self._pull, self._mutation = float(values["pull"]), float(values["mutation"])
        self._within = float(values["restart_within"])
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._penalty = Penalty(problem.n_obj)
        self._restart()

    def _restart(self) -> None:
        self._x = latin_hypercube(self._rng, self._size, self._n_var)
        self._v = np.zeros_like(self._x)
        self._started = False

    def ask(self) -> Float:
        """Return the particles' positions, one row each."""
        return self._x.copy()

    def tell(self, U: Float, results: Results) -> None:
        """Update the particles' best rows, the front, and the velocities."""
        F, failed = self._penalty.apply(results.F, results.ok)
        if not self._started:
            self._best, self._best_F, self._best_failed = self._x.copy(), F, failed
            self._front, self._front_F = self._x[:0], F[:0]
            self._started = True
        else:
            # A failed row has the penalty of its batch; any finite row counts as better.
            self._best_F = np.where(self._best_failed[:, None], self._penalty.value, self._best_F)
            # The newer of two rows that do not dominate each other is kept, as in the source.
            worse: Bool = np.logical_and(
                (self._best_F <= F).all(axis=1), (self._best_F < F).any(axis=1)
            )
            self._best = np.where(worse[:, None], self._best, self._x)
            self._best_F = np.where(worse[:, None], self._best_F, F)
            self._best_failed = np.where(worse, self._best_failed, failed)
        self._collect(self._x[~failed], F[~failed])
        if len(self._front) and self._converged():
            self._restart()
        else:
            self._move()

    def _collect(self, x: Float, F: Float) -> None:
        """Add rows to the front, each point of the objective space once, and cut it to size."""
        everything = np.concatenate([self._front, x])
        all_F = np.concatenate([self._front_F, F])
        # Rows of equal F have no distance from each other, so crowding would count them as the
        # densest.
        first = np.sort(np.unique(all_F, axis=0, return_index=True)[1])
        at = first[non_dominated(all_F[first])]
        at = at[thin(all_F[at], self._archive_size)]
        self._front, self._front_F = everything[at], all_F[at]

    def _converged(self) -> bool:
        """Whether half of the particles' best rows are close to one row of the front."""
        away = np.abs(self._best - self._front[0]).max(axis=1)
        return bool(np.median(away) < self._within)

    def _move(self) -> None:
        rng, shape = self._rng, self._x.shape
        leaders = self._best[rng.integers(len(self._best), size=len(self._x))]
        if len(self._front):
            distance = crowding(self._front_F)
            # A binary tournament by crowding: leaders come from where the front is thin.
            pairs = rng.integers(len(self._front), size=(len(self._x), 2))
            second = distance[pairs[:, 1]] > distance[pairs[:, 0]]
            leaders = self._front[np.where(second, pairs[:, 1], pairs[:, 0])]
        # Drawn around the mean pull, a quarter of it to either side: 1.5 .. 2.5 in the source.
        c1, c2 = rng.uniform(0.75 * self._pull, 1.25 * self._pull, size=(2, len(self._x), 1))
        pulls = c1 * rng.random(shape) * (self._best - self._x)
        pulls += c2 * rng.random(shape) * (leaders - self._x)
        # Clerc and Kennedy's constriction is real from c1 + c2 = 4 on; below, it is 1.
        total = np.maximum(c1 + c2, 4.0)
        chi = 2.0 / (total - 2.0 + np.sqrt(total * total - 4.0 * total))
        # SMPSO's speed limit: half of each range, which is 1 in the unit cube.
        self._v = np.clip(chi * (self._w * self._v + pulls), -0.5, 0.5)
        x = self._x + self._v
        self._v = np.where((x < 0.0) | (x > 1.0), TURNED * self._v, self._v)
        self._x = self._mutated(np.clip(x, 0.0, 1.0))

    def _mutated(self, x: Float) -> Float:
        """Return the particles, some of them with a polynomial mutation (Deb and Agrawal 1999)."""
        rng, power = self._rng, ETA + 1.0
        chosen = rng.random((len(x), 1)) < self._mutation
        some = rng.random(x.shape) < 1.0 / self._n_var
        r = rng.random(x.shape)
        down = (2 * r + (1 - 2 * r) * (1 - x) ** power) ** (1 / power) - 1
        up = 1 - (2 * (1 - r) + (2 * r - 1) * x**power) ** (1 / power)
        moved = np.clip(x + np.where(r < 0.5, down, up), 0.0, 1.0)
        return np.where(chosen & some, moved, x)
