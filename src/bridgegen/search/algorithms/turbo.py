"""TuRBO: several trust regions, each with a Gaussian process of its own."""

from collections.abc import Mapping, Sequence
from dataclasses import asdict, dataclass, field
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve
from bridgegen.search.algorithms.sampling import latin_hypercube, sobol_rows
from bridgegen.search.surrogates.gaussian_process import Parameters
from bridgegen.search.surrogates.known import Known, distances
from bridgegen.search.surrogates.saved import Saved, packed, unpacked

if TYPE_CHECKING:
    from bridgegen.search.surrogates.gaussian_process import GaussianProcess

# Bounded, so that a row takes as long at 5,000 rows as at 300: factorising costs the cube of this
# number.
MODEL_ROWS = 256
"""Maximum number of rows of a region's model: those nearest to its centre."""

CANDIDATES = 512
"""Number of rows of a region that its sample paths choose from; a power of two, as Sobol sequences
like."""

LONGEST = 1.6
"""Length of a region beyond which it does not grow: its box is the whole cube, or nearly."""

IMPROVEMENT = 1e-3
"""Share of the best objective by which a row must be better to count as a success."""


@dataclass
class _Region:
    """A box around the best row of a local search.

    Attributes:
        own: places of its rows among the known ones.
        length: of the box, a share of each parameter's range where all have one length.
        avoided: number of distinct critical rows that were known when it began.
        pending: how many first rows it still waits for.
        successes: batches in a row that improved its best row.
        failures: rows since the last improvement.
        parameters: of its model.
    """

    length: float
    avoided: int
    pending: int
    own: Int = field(default_factory=lambda: np.empty(0, np.int64))
    successes: int = 0
    failures: int = 0
    parameters: Parameters | None = None


class TuRBO(Saved):
    """Trust regions that follow their best rows, grow while they improve and shrink if not.

    A batch is drawn by Thompson sampling: each of its rows is where a sample path of a region's
    process is least, the paths of all regions competing. A region that has shrunk to a point
    restarts elsewhere.

    Where the first rows of the only region are not told yet, rows are drawn anywhere.

    It differs from the source:

    - objectives are learnt by their logarithmic distances from the median (`compressed`);
    - a region's process learns from the nearest rows, whichever region asked for them;
    - a region stays away from critical scenarios that were known when it began, so that it finds
      others;
    - a parameter with levels changes to any of them, with the box's length as probability.

    Source: Eriksson et al. (2019), "Scalable global optimization via local Bayesian optimization",
    arXiv:1910.04867.
    """

    name: ClassVar[str] = "turbo"
    description: ClassVar[str] = "trust regions with Gaussian processes, Thompson sampling"
    source: ClassVar[str] = "Eriksson et al. (2019), arXiv:1910.04867"
    settings: ClassVar[Mapping[str, Setting]] = {
        # Of 300 evaluations, one region found a critical row in .67 of the seeds of
        # wrong-way-driver and in all of pedestrian-at-night, three regions in .17 and .33.
        "regions": Setting(1, "trust regions at a time", 1, 100),
        "initial": Setting(20, "space-filling rows with which a region begins", 2, 10_000),
        "batch": Setting(10, "rows per batch", 1, 10_000),
        "length": Setting(0.8, "initial length of a region, as a share of each range", 0.01, 1.6),
        "shortest": Setting(2.0**-7, "length below which a region restarts elsewhere", 1e-6, 0.5),
        "successes": Setting(3, "improving batches in a row after which a region doubles", 1, 1000),
        "failures": Setting(
            0,
            "rows without improvement after which it halves; 0: the parameters, 5 at least",
            0,
            100_000,
        ),
        "avoid": Setting(
            0.15,
            "distance that a region keeps from critical rows found before it began, as a "
            "share of the ranges, in root mean square",
            0.0,
            1.0,
        ),
    }
    objectives: ClassVar[Arity] = "one"
    asynchronous: ClassVar[bool] = True

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._values = resolve(type(self), problem, seed, settings)
        if not self._values["shortest"] <= self._values["length"]:
            raise InputError(
                f"turbo: shortest <= length must hold, got {self._values['shortest']:g} and "
                f"{self._values['length']:g}"
            )
        self._n_var = problem.n_var
        self._patience = self._values["failures"] or max(5, problem.n_var)
        self._known = Known(problem, self._values["avoid"])
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._regions = [self._begun() for _ in range(self._values["regions"])]
        self._asked: list[_Region | None] = []  # of each row that is not told

    def _begun(self) -> _Region:
        return _Region(self._values["length"], len(self._known.distinct), self._values["initial"])

    def ask(self) -> Float:
        """Return the first rows of regions that begin, else a batch of all regions'."""
        rows, regions = self._next()
        self._known.expect(rows)
        self._asked += regions
        return rows

    def _next(self) -> "tuple[Float, Sequence[_Region | None]]":
        """Return the next rows and the region of each; None for a row that is of no region."""
        if self._known.exhausted:
            return np.empty((0, self._n_var)), []
        waiting = [
            region
            for region in self._regions
            if region.pending and not any(region is r for r in self._asked)
        ]
        if waiting:
            counts = [region.pending for region in waiting]
            asked = self._rng.permutation(np.repeat(np.arange(len(waiting)), counts))
            rows = latin_hypercube(self._rng, len(asked), self._n_var)
            return self._known.columns.snapped(self._away(rows)), [waiting[k] for k in asked]
        ready = [region for region in self._regions if not region.pending]
        if ready:
            return self._batch(ready)
        rows = self._known.anywhere(self._values["batch"], self._rng)
        return rows, [None] * len(rows)

    def _away(self, rows: Float) -> Float:
        """Return first rows, those near a known critical row moved to anywhere else."""
        # At most ten tries: where known critical rows are everywhere, rows near one are taken.
        for _ in range(10):
            near = self._off(rows, len(self._known.distinct)) < self._values["avoid"]
            rows[near] = self._rng.random((np.count_nonzero(near), self._n_var))
        return rows

    def _off(self, rows: Float, k: int) -> Float:
        """Return how far rows are from the first k distinct critical ones, ``(n,)``."""
        known = self._known
        return distances(known.columns.points(rows), known.points[known.distinct[:k]])

    def _batch(self, ready: Sequence[_Region]) -> tuple[Float, Sequence[_Region]]:
        """Return a batch of regions whose first rows are told, and the region of each row."""
        n, scores = self._values["batch"], self._known.scores()
        found = [self._candidates(region) for region in ready]
        paths = [
            self._model(region, scores).sample(self._known.columns.points(rows), n, self._rng)
            for region, rows in zip(ready, found, strict=True)
        ]
        rows, values = np.concatenate(found), np.concatenate(paths, axis=1)
        regions = np.repeat(np.arange(len(found)), [len(array) for array in found])
        new = self._known.new(rows)
        rows, values, regions = rows[new], values[:, new], regions[new]
        taken: list[int] = []
        for path in values[: len(rows)]:
            # Each path chooses one row that no earlier path took: a batch without duplicates.
            path[taken] = np.inf
            taken.append(int(path.argmin()))
        return rows[taken], [ready[k] for k in regions[taken]]

    def _centre(self, region: _Region) -> int:
        """Return the place of a region's best row, the first of equal ones."""
        return int(region.own[self._known.F[region.own].argmin()])

    def _model(self, region: _Region, scores: Float) -> "GaussianProcess":
        """Return a region's process, and keep its parameters for the next."""
        from bridgegen.search.surrogates.gaussian_process import GaussianProcess  # compiled

        points = self._known.points
        off = np.sum((points - points[self._centre(region)]) ** 2, axis=1)
        near = np.sort(np.argsort(off, kind="stable")[:MODEL_ROWS])
        model = GaussianProcess(points[near], scores[near], region.parameters)
        region.parameters = model.parameters
        return model

    def _candidates(self, region: _Region) -> Float:
        """Return new rows of a region's box; from anywhere, where it has none."""
        n_var, rng, columns = self._n_var, self._rng, self._known.columns
        lengths = np.ones(n_var) if region.parameters is None else region.parameters.lengths
        # A region is long where the objective changes slowly; its volume stays that of a cube of
        # this length (the source).
        sides = region.length * lengths / elementary.exp(float(elementary.log(lengths).mean()))
        centre = self._known.U[self._centre(region)]
        low, high = np.clip(centre - sides / 2, 0.0, 1.0), np.clip(centre + sides / 2, 0.0, 1.0)
        # A level has no neighbours, so a box around it means nothing.
        low[columns.discrete], high[columns.discrete] = 0.0, 1.0
        inside = sobol_rows(rng, CANDIDATES, n_var)
        # Some twenty parameters change at a time, as in the authors' code: in many dimensions a
        # candidate that changes all of them is far from the best row.
        share = np.full(n_var, min(1.0, 20.0 / n_var))
        share[columns.discrete] = np.minimum(share[columns.discrete], region.length)
        moved = rng.random((CANDIDATES, n_var)) < share
        # One parameter at least changes, as there: a candidate equal to the centre is known.
        moved[np.arange(CANDIDATES), rng.integers(n_var, size=CANDIDATES)] = True
        rows = columns.snapped(np.where(moved, low + inside * (high - low), centre))
        rows = rows[self._known.new(rows)]
        rows = rows[self._off(rows, region.avoided) >= self._values["avoid"]]
        return rows if len(rows) else self._known.anywhere(self._values["batch"], rng)

    def tell(self, U: Float, results: Results) -> None:
        """Grow or shrink the regions; restart those that have shrunk to a point."""
        first = len(self._known)
        self._known.add(U, results.F[:, 0], results.ok, results.critical)
        told, self._asked = self._asked[: len(U)], self._asked[len(U) :]
        for k, region in enumerate(self._regions):
            own = first + np.flatnonzero([item is region for item in told])
            if not len(own):
                continue
            if region.pending:
                region.pending -= len(own)
                region.own = np.concatenate([region.own, own])
                continue
            self._judge(region, own)
            if region.length < self._values["shortest"]:
                self._regions[k] = self._begun()

    def _judge(self, region: _Region, own: Int) -> None:
        """Change a region's length by its new rows."""
        best = float(self._known.F[self._centre(region)])
        least = float(self._known.F[own].min())
        region.own = np.concatenate([region.own, own])
        # As in the authors' code.
        margin = IMPROVEMENT * abs(best) if np.isfinite(best) else 0.0
        if least < best - margin:
            region.successes, region.failures = region.successes + 1, 0
        else:
            region.successes, region.failures = 0, region.failures + len(own)
        if region.successes >= self._values["successes"]:
            region.length, region.successes = min(2.0 * region.length, LONGEST), 0
        elif region.failures >= self._patience:
            region.length, region.failures = region.length / 2.0, 0

    def _more(self) -> Any:
        return [
            asdict(region) | {"own": region.own.tolist(), "parameters": packed(region.parameters)}
            for region in self._regions
        ]

    def _take(self, more: Any) -> None:
        n, regions = len(self._known), []
        for item in more:
            own = np.array(item["own"], np.int64).reshape(-1)
            counts = [item[key] for key in ("avoided", "pending", "successes", "failures")]
            # A run's folder may come from others: its state is checked, and nothing of it is
            # executed.
            right = all(type(count) is int and count >= 0 for count in counts)
            if (
                not right
                or not 0.0 < item["length"] <= LONGEST
                or bool(len(own)) is bool(counts[1])
            ):
                raise ValueError("its regions are not those of a search")
            if len(own) and not 0 <= own.min() <= own.max() < n:
                raise ValueError("its regions have rows that it does not know")
            parameters = unpacked(item["parameters"], self._n_var)
            regions.append(_Region(**item | {"own": own, "parameters": parameters}))
        if len(regions) != self._values["regions"]:
            raise ValueError("it has another number of regions")
        self._regions = regions
