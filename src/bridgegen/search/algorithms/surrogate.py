"""Surrogate search: models of the whole space, asked for critical scenarios unlike known ones."""

from collections.abc import Mapping
from typing import TYPE_CHECKING, Any, ClassVar

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.search.algorithms.algorithm import Arity, Problem, Results, Setting, Value, resolve
from bridgegen.search.algorithms.sampling import latin_hypercube, sobol_rows
from bridgegen.search.surrogates.gaussian_process import Parameters
from bridgegen.search.surrogates.known import Known, distances
from bridgegen.search.surrogates.saved import Saved, packed, unpacked
from bridgegen.search.surrogates.subset import telling

if TYPE_CHECKING:
    from bridgegen.search.surrogates.gaussian_process import GaussianProcess

CANDIDATES = 512
"""Number of rows anywhere that a model chooses from, and as many near good rows; a power of two."""

# Bounded: fitting costs the cube of this number, and half of these rows are the best ones
# (`telling`).
MODEL_ROWS = 300
"""Maximum number of rows that a process is fitted to."""

BEST, FOUND = 20, 40
"""Numbers of rows that candidates are near: the best ones, and the distinct critical ones found
last."""

REACH = 0.5
"""Greatest standard deviation of a candidate's step from a good row, per parameter; the least is an
eighth of it."""

CAUTION = 0.5
"""Number of standard deviations by which an uncertain row counts as more likely critical."""


class Surrogate(Saved):
    """Two Gaussian processes of the whole space: of the objective, and of what is critical.

    A batch has three parts:

    - rows at random, so that no model is believed for ever;
    - rows where sample paths of the objective are least (Thompson sampling);
    - once a critical row is known: rows that are most likely critical, by a process of the label
      alone. Harm often leaps where it becomes critical, and the objective around tells little.

    The more critical rows are known, the more rows a batch has, so that a row costs less; a tenth
    of all rows counts as critical for this.

    The last two keep a distance from distinct critical rows, from one another and from rows whose
    results are not known yet, so that what is found are other scenarios, not the first one again.
    Where no candidate is left that far away, the distance is halved.

    With many rows, the processes are fitted to 300 of them: half are the best, or the critical
    ones; the others are spread over the rest (`telling`).

    Source: Thompson sampling in batches: Kandasamy et al. (2018), arXiv:1705.09236; the label by
    regression: Rasmussen and Williams (2006), section 6.5.
    """

    name: ClassVar[str] = "surrogate"
    description: ClassVar[str] = "Gaussian processes of objective and criticality, for new failures"
    source: ClassVar[str] = "Kandasamy et al. (2018), arXiv:1705.09236, for Thompson sampling"
    settings: ClassVar[Mapping[str, Setting]] = {
        "initial": Setting(20, "number of initial space-filling rows", 2, 100_000),
        "batch": Setting(10, "rows per batch, at least", 1, 10_000),
        # Always 10 rows a batch took twice as long at 1,000 rows and found no more; growth by all
        # rows found the rarest failures later, so batches grow with what has been found
        # (docs/decisions/search.md).
        "growth": Setting(
            0.2, "rows per batch at least, as a share of the critical ones known", 0.0, 1.0
        ),
        # The expected objective less some deviations, without random rows, found nothing in 3 of 3
        # seeds on left-across-path: it stays at a local optimum of near misses.
        "explore": Setting(0.2, "share of a batch that is drawn at random", 0.0, 1.0),
        "critical": Setting(
            0.7,
            "share of the others that are likely critical, once a critical row is known",
            0.0,
            1.0,
        ),
        "apart": Setting(
            0.1,
            "distance kept from critical rows, as a share of the ranges, in root mean square",
            0.0,
            1.0,
        ),
    }
    objectives: ClassVar[Arity] = "one"
    asynchronous: ClassVar[bool] = True

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._values = resolve(type(self), problem, seed, settings)
        self._n_var = problem.n_var
        self._known = Known(problem, self._values["apart"])
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._of_objective: Parameters | None = None
        self._of_label: Parameters | None = None

    def ask(self) -> Float:
        """Return a sample of the cube at first, then batches; none where all rows are known."""
        rows = self._next()
        self._known.expect(rows)
        return rows

    def _next(self) -> Float:
        """Return the next rows."""
        known, rng = self._known, self._rng
        # A tenth of all rows counts as critical, so a batch has 2 % of all rows at least.
        many = max(int(known.critical.sum()), len(known) // 10)
        n = max(self._values["batch"], int(self._values["growth"] * many))
        if known.exhausted:
            return np.empty((0, self._n_var))
        if not len(known):
            rows = latin_hypercube(rng, self._values["initial"], self._n_var)
            return known.columns.snapped(rows)
        batch = known.anywhere(round(n * self._values["explore"]), rng)
        # A process of a constant label would say nothing.
        mixed = known.critical.any() and not known.critical.all()
        likely = round((n - len(batch)) * self._values["critical"]) if mixed else 0
        if likely:
            # The label has a process of its own, since harm leaps where a row becomes critical
            # (0.15 to 0.6), which a process of the objective smooths away: 5 critical rows became
            # 27. Divided by the deviation, so that the prior variance of 1 fits.
            label = -known.critical.astype(np.float64) / known.critical.std()
            model = self._fitted(label, self._of_label)
            self._of_label = model.parameters
            rows, points = self._candidates(known.U[known.distinct[-FOUND:]], batch)
            mean, deviation = model.predict(points)
            # One path for all of these rows: what keeps them apart is the distance alone.
            paths = np.tile(mean - CAUTION * deviation, (likely, 1))
            batch = self._joined(batch, rows, points, paths)
        scores = known.scores()
        model = self._fitted(scores, self._of_objective)
        self._of_objective = model.parameters
        rows, points = self._candidates(known.U[np.argsort(scores, kind="stable")[:BEST]], batch)
        # Thompson sampling: rows of a batch differ without a penalty between them.
        paths = model.sample(points, max(n - len(batch), 0), rng)
        return self._joined(batch, rows, points, paths)

    def _fitted(self, values: Float, parameters: Parameters | None) -> "GaussianProcess":
        from bridgegen.search.surrogates.gaussian_process import GaussianProcess  # compiled

        rows = telling(values, MODEL_ROWS)
        return GaussianProcess(self._known.points[rows], values[rows], parameters)

    def _candidates(self, bases: Float, batch: Float) -> tuple[Float, Float]:
        """Return new rows to choose from and their points, anywhere and near the bases."""
        rng, known, shape = self._rng, self._known, (CANDIDATES, self._n_var)
        anywhere = sobol_rows(rng, CANDIDATES, self._n_var)
        base = bases[rng.integers(len(bases), size=CANDIDATES)]
        scale = REACH * elementary.power(2.0, -3.0 * rng.random((CANDIDATES, 1)))
        # At most some twenty parameters change, as in TuRBO.
        share = min(1.0, 20.0 / self._n_var) * rng.random((CANDIDATES, 1))
        moved = rng.random(shape) < share
        moved[np.arange(CANDIDATES), rng.integers(self._n_var, size=CANDIDATES)] = True
        near = np.clip(np.where(moved, base + scale * rng.standard_normal(shape), base), 0.0, 1.0)
        drawn = rng.random(shape)  # a level has no neighbours: it changes to any other
        levels = known.columns.discrete
        near[:, levels] = np.where(moved, drawn, base)[:, levels]
        rows = known.columns.snapped(np.concatenate([batch, anywhere, near]))
        new = known.new(rows)
        # The batch stands first, so that a candidate equal to one of its rows is not new.
        rows = rows[new[new >= len(batch)]]
        if not len(rows):
            rows = known.anywhere(self._values["batch"], rng)
        return rows, known.columns.points(rows)

    def _joined(self, batch: Float, rows: Float, points: Float, paths: Float) -> Float:
        """Return a batch and, for each path, the row where it is least that is far enough away."""
        known, apart = self._known, self._values["apart"]
        # Rows that are asked for and not told count like known critical ones: with `--ahead`, the
        # next batch would else return to them.
        others = np.concatenate(
            [known.points[known.distinct], known.pending, known.columns.points(batch)]
        )
        off = distances(points, others)
        taken: list[int] = []
        for path in paths:
            while apart > 1e-3 and not (off >= apart).any():
                apart /= 2.0
            free = (off >= apart) & (off > 0.0)
            if not free.any():
                break
            taken.append(int(np.where(free, path, np.inf).argmin()))
            off = np.minimum(off, distances(points, points[taken[-1:]]))
        return np.concatenate([batch, rows[taken]])

    def tell(self, U: Float, results: Results) -> None:
        """Record the rows; the next batch learns from them."""
        self._known.add(U, results.F[:, 0], results.ok, results.critical)

    def _more(self) -> Any:
        return [packed(self._of_objective), packed(self._of_label)]

    def _take(self, more: Any) -> None:
        self._of_objective, self._of_label = (unpacked(item, self._n_var) for item in more)
