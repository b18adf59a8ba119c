"""NSGA-II-DT: a decision tree finds the critical regions, NSGA-II searches inside them."""

import itertools
from collections.abc import Generator, Mapping
from functools import partial
from hashlib import blake2b
from typing import Any, ClassVar

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.search.algorithms.algorithm import (
    JSON,
    Arity,
    Problem,
    Results,
    Setting,
    Value,
    resolve,
)
from bridgegen.search.algorithms.dominance import non_dominated, thin
from bridgegen.search.algorithms.sampling import latin_hypercube
from bridgegen.search.algorithms.tree import Leaf, fit_leaves

Rounds = Generator[Float, Results, None]
"""A generator that yields rows to evaluate, and gets their results by ``send``."""


BOXES_KEPT = 100
"""Maximum number of a tree's boxes in the run's notes, the surest; a long run has thousands."""


class NSGA2DT:
    """NSGA-II in each critical box of a decision tree, then another tree.

    A space-filling sample is first. Then, repeatedly: a tree is fitted to all unique evaluations,
    critical or not (failed ones are neither); each leaf with enough rows and a large enough
    critical share is a box; NSGA-II runs in each for some generations, from the leaf's
    non-dominated rows, which are not evaluated again, filled up to a population with space-filling
    ones. If no leaf is critical, the whole cube is the box.

    Boxes are visited in descending order of (critical + 1) / (rows + 2), Laplace's estimate of a
    critical share, so that a budget that ends within a round is spent where the evidence is
    strongest; a leaf of 10 critical rows of 10 comes after one of 90 of 90.

    Crossover and mutation are simulated binary and polynomial, with the paper's probabilities,
    0.7 and 0.05; that of mutation applies per parameter. If it applied per child, 19 of 20 children
    would only recombine values of their parents.

    Source: Ben Abdessalem et al. (2018), "Testing vision-based control systems using learnable
    evolutionary algorithms"; probabilities, population: paper, Table V.
    """

    name: ClassVar[str] = "nsga2-dt"
    description: ClassVar[str] = "NSGA-II within the critical leaves of decision trees"
    source: ClassVar[str] = "Ben Abdessalem et al. (2018), doi:10.1145/3180155.3180160"
    settings: ClassVar[Mapping[str, Setting]] = {
        "population": Setting(40, "individuals, and rows per batch", low=4, high=100_000),
        "initial": Setting(40, "space-filling rows before the first tree", 2, 1_000_000),
        # 1 / 3 / 5 / 6 generations: R_critic of S1 .56 .68 .66 .67, of S4 .40 .42 .47 .52; five, so
        # that a budget of 1,000 still sees three trees or more.
        "generations": Setting(5, "of NSGA-II in a box, until the next tree", 1, 10_000),
        "share": Setting(0.5, "critical share that makes a leaf critical", 0.01, 1.0),
        # 5 / 10 / 20: S1 .62 .68 .63, S4 .41 .42 .49, all within the spread of the seeds.
        "min_rows": Setting(10, "minimum number of rows of a leaf", 1, 100_000),
        "crossover": Setting(0.7, "probability that two parents are crossed", 0.0, 1.0),
        "crossover_eta": Setting(15.0, "how close children stay to their parents", 0.0, 1000.0),
        "mutation": Setting(0.05, "probability that a child's parameter is mutated", 0.0, 1.0),
        "mutation_eta": Setting(20.0, "how little a mutated parameter moves", 0.0, 1000.0),
    }
    objectives: ClassVar[Arity] = "many"

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._values = resolve(NSGA2DT, problem, seed, settings)
        self._problem, self._seed = problem, seed
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._known = _Known(problem)
        self._trees: list[JSON] = []
        self._critical: list[JSON] = []
        self._rounds = self._search()
        self._next = next(self._rounds)

    def ask(self) -> Float:
        """Return the next sample, or the next generation in a box.

        The first generation in a box has known rows, which the campaign does not evaluate again.
        """
        return self._next.copy()

    def tell(self, U: Float, results: Results) -> None:
        """Process the rows' results, and make the next rows."""
        self._known.add(U, results)
        self._next = self._rounds.send(results)

    def notes(self) -> Mapping[str, JSON]:
        """Return each tree's size, and the critical boxes, the last tree's and the surest first."""
        return {"decision trees": list(self._trees), "critical boxes": list(self._critical)}

    def _search(self) -> Rounds:
        from bridgegen.search.algorithms._pymoo import Generations

        yield latin_hypercube(self._rng, self._values["initial"], self._problem.n_var)
        for count in itertools.count():
            for number, leaf in enumerate(self._boxes()):
                first, box = self._population(leaf), (leaf.low, leaf.high)
                build, seed = partial(self._nsga2, first), (self._seed, count, number)
                search = Generations(build, self._problem, seed, 0.0, box=box)
                # The first batch is the population itself; its known rows cost nothing, since the
                # campaign answers them from the store.
                for _ in range(1 + self._values["generations"]):
                    U = search.ask()
                    search.tell(U, (yield U))

    def _boxes(self) -> list[Leaf]:
        """Return the critical leaves of a tree over all known rows, or the whole cube."""
        known, least = self._known, self._values["min_rows"]
        low, high = np.zeros(self._problem.n_var), np.ones(self._problem.n_var)
        leaves = fit_leaves(known.U, known.critical, low=low, high=high, min_rows=least)
        critical = [
            leaf for leaf in leaves if leaf.rows >= least and leaf.share >= self._values["share"]
        ]
        critical.sort(key=lambda leaf: -(leaf.critical + 1) / (leaf.rows + 2))
        number = len(self._trees) + 1
        self._trees.append(
            {
                "tree": number,
                "evaluations": len(known.U),
                "leaves": len(leaves),
                "critical leaves": len(critical),
            }
        )
        boxes: list[JSON] = [
            {"tree": number, **self._described(leaf)} for leaf in critical[:BOXES_KEPT]
        ]
        self._critical = boxes + self._critical
        return critical or [Leaf(low, high, len(known.U), int(known.critical.sum()))]

    def _described(self, leaf: Leaf) -> dict[str, JSON]:
        """Return a leaf's description: its bounds where narrower than the cube, and its rows."""
        edges = zip(self._problem.parameters, leaf.low.tolist(), leaf.high.tolist(), strict=True)
        box: JSON = {name: [low, high] for name, low, high in edges if low > 0.0 or high < 1.0}
        return {"box": box, "rows": leaf.rows, "critical": leaf.critical}

    def _population(self, leaf: Leaf) -> Float:
        """Return NSGA-II's initial population in a box: ``(population, n_var)`` float64."""
        size, inside = self._values["population"], leaf.holds(self._known.U)
        U, F = self._known.U[inside], self._known.F[inside]
        front = np.flatnonzero(non_dominated(F))
        front = front[thin(F[front], size)]
        fresh = latin_hypercube(self._rng, size - len(front), self._problem.n_var)
        fresh = leaf.low + fresh * (leaf.high - leaf.low)
        return np.concatenate([U[front], np.clip(fresh, leaf.low, leaf.high)])

    def _nsga2(self, first: Float) -> Any:
        from pymoo.algorithms.moo import nsga2
        from pymoo.operators.crossover.sbx import SBX
        from pymoo.operators.mutation.pm import PM

        values = self._values
        return nsga2.NSGA2(
            pop_size=values["population"],
            sampling=first,
            crossover=SBX(prob=values["crossover"], eta=values["crossover_eta"]),
            # The paper's 0.05 is read per parameter: per child, 19 of 20 children would be
            # recombined values only.
            mutation=PM(prob=1.0, prob_var=values["mutation"], eta=values["mutation_eta"]),
        )


class _Known:
    """Every successful evaluation, once.

    Attributes:
        U: ``(n, n_var)`` float64.
        F: ``(n, n_obj)`` float64.
        critical: ``(n,)`` bool.
    """

    def __init__(self, problem: Problem) -> None:
        self._parts = [
            (np.empty((0, problem.n_var)), np.empty((0, problem.n_obj)), np.zeros(0, np.bool_))
        ]
        self._rows: set[bytes] = set()

    def add(self, U: Float, results: Results) -> None:
        """Add rows that are new and have a result."""
        good = results.ok & np.isfinite(results.F).all(axis=1)
        fresh = []
        for k in np.flatnonzero(good).tolist():
            row = blake2b(U[k].tobytes(), digest_size=16).digest()
            if row not in self._rows:
                self._rows.add(row)
                fresh.append(k)
        self._parts.append((U[fresh], results.F[fresh], results.critical[fresh]))

    @property
    def U(self) -> Float:
        return self._joined[0]

    @property
    def F(self) -> Float:
        return self._joined[1]

    @property
    def critical(self) -> Bool:
        return self._joined[2]

    @property
    def _joined(self) -> tuple[Float, Float, Bool]:
        if len(self._parts) > 1:  # seldom: once for a tree and once for a box
            U, F, critical = zip(*self._parts, strict=True)
            self._parts = [(np.concatenate(U), np.concatenate(F), np.concatenate(critical))]
        return self._parts[0]
