"""A compact record of one run for a comparison, however long the run is."""

from collections import Counter
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.objective import Objective, positivised
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.jobs.compare.fronts import front
from bridgegen.jobs.compare.options import APART
from bridgegen.jobs.search.restored import searched
from bridgegen.jobs.search.run import Run
from bridgegen.results.store import Store
from bridgegen.results.store.rows import Rows
from bridgegen.scenario.language.coverage import coverage
from bridgegen.scenario.language.space import SearchSpace

# --- Number of different critical scenarios of a run ---


LIMIT = 10_000
"""Maximum number of different scenarios that are counted per run: it bounds the time."""

_CHUNK = 256


def normalised(space: SearchSpace, X: Float) -> Float:
    """Return points whose distances are those of the searched parameters.

    A parameter becomes its share of the declared range, or what its kind defines.

    Args:
        space: the search space.
        X: ``(N, len(space.names))``.

    Returns:
        ``(N, k)`` float64, k at least ``space.n_var``; no parameter differs by more than 1.
    """
    parts = [np.empty((len(X), 0))]
    for name in space.variables:
        parameter = space.parameters[name]
        parts.append(
            parameter.kind.coordinates(X[:, space.index(name)], parameter.low, parameter.high)
        )
    return np.concatenate(parts, axis=1)


def distinct(
    points: Float, apart: float = APART, limit: int = LIMIT, n_var: int | None = None
) -> Bool:
    """Return which points are new: at least ``apart`` from every new one before them.

    A greedy net, in the order of the points: new points lie apart from one another, and every
    point is closer than ``apart`` to one of them; so another order may find a few more or fewer.
    Clusters by single linkage would not depend on the order, but a search that fills the space
    evenly would be one cluster, and count as one scenario.

    Args:
        points: ``(N, d)`` float64, as `normalised` returns them.
        apart: the root mean square of the parameters' differences.
        limit: maximum number of new points.
        n_var: number of parameters; d by default.

    Returns:
        ``(N,)`` bool; after the limit has been reached, False.
    """
    from scipy.spatial.distance import cdist

    new = np.zeros(len(points), np.bool_)
    if not points.size:
        new[: min(len(points), 1)] = True
        return new
    least = apart * np.sqrt(n_var or points.shape[1])
    centres = np.empty((min(len(points), limit), points.shape[1]))
    count = 0
    for start in range(0, len(points), _CHUNK):
        chunk = points[start : start + _CHUNK]
        free = np.ones(len(chunk), np.bool_)
        if count:
            free = cdist(chunk, centres[:count]).min(axis=1) >= least
        open_ones = np.flatnonzero(free)
        among = cdist(chunk[open_ones], chunk[open_ones]) < least
        covered = np.zeros(len(open_ones), np.bool_)
        for k, at in enumerate(open_ones.tolist()):
            if covered[k]:
                continue
            if count == limit:
                return new
            new[start + at], centres[count] = True, chunk[at]
            count += 1
            covered |= among[k]
    return new


POINTS = 50
"""Number of points of a curve over the evaluations."""


@dataclass(frozen=True)
class Record:
    """A run that has ended.

    Attributes:
        terms: the metrics by which the scenario's runs are compared.
        parameters: what it searched.
        command: the command line that repeats the run, into the folder ``replay``.
        ended: why it ended: "budget", "exhausted" or "converged".
        evaluations: number of evaluations.
        failed: number of those whose simulation failed.
        critical: number of critical ones.
        reached: by k, the evaluations until the k-th critical one; +inf if there is none.
        seconds: [s] that it took.
        seconds_reached: [s] by k, likewise.
        distinct: how many different critical scenarios it found.
        distinct_reached: by k, the evaluations until the k-th different one; likewise.
        distinct_found: ``(c,)`` int64, different critical scenarios by the c points of its curve.
        modes: the different conflicts of its critical scenarios (type, responsible, rule,
            partner), and how many have each.
        modes_reached: by k, the evaluations until the k-th different conflict; likewise.
        critical_bins: bins of parameters that hold a critical scenario.
        critical_pairs: pairs of bins of two parameters that do.
        found: ``(c,)`` int64, critical scenarios by the c points of its curve.
        fronts: c arrays ``(n, m)`` of positivised terms, larger is more critical: the front at each
            point.
        low: ``(m,)`` the least critical value of each term; None where every simulation failed.
        high: ``(m,)`` the most critical one; likewise.
    """

    terms: tuple[str, ...]
    parameters: tuple[str, ...]
    command: str
    ended: str
    evaluations: int
    failed: int
    critical: int
    reached: Mapping[int, float]
    seconds: float
    seconds_reached: Mapping[int, float]
    distinct: int
    distinct_reached: Mapping[int, float]
    distinct_found: Int
    modes: Counter[tuple[str, ...]]
    modes_reached: Mapping[int, float]
    critical_bins: int
    critical_pairs: int
    found: Int
    fronts: tuple[Float, ...]
    low: Float | None
    high: Float | None


MODE = ("conflict_type", "responsible", "rule", "partner")
"""The fields in which conflicts of different modes differ."""


DISTINCT, MODES = 5, 2
"""Numbers k of the times to the k-th different critical scenario, and to the k-th conflict."""


def points(budget: int) -> Int:
    """Return the evaluations after which a curve has a point, ascending; the last is the budget."""
    return np.unique(np.ceil(budget * np.arange(1, POINTS + 1) / POINTS).astype(np.int64))


def space_of(folder: Path) -> SearchSpace:
    """Return the search space of a run, the same for all runs of a scenario.

    Raises:
        StorageError: not a run, or its scenario or map has changed.
        InputError: the scenario or the map is missing.
    """
    return searched(Run(folder))[1]


def terms_of(folder: Path) -> tuple[str, ...]:
    """Return the metrics that a run's objective is made of.

    Raises:
        StorageError: not a run, or damaged.
    """
    return Objective.from_dict(Run(folder).settings.optimised).names


def read(
    folder: Path,
    space: SearchSpace,
    terms: Sequence[str],
    budget: int,
    ks: Sequence[int],
    apart: float,
) -> Record:
    """Read a run that has ended.

    Args:
        folder: of the run.
        space: its search space.
        terms: metrics of its objective by which the scenario's runs are compared.
        budget: its maximum number of evaluations.
        ks: of the times to the k-th critical scenario.
        apart: minimum distance of two different critical scenarios.

    Raises:
        StorageError: not a run, or damaged.
    """
    with Store.open(folder) as store:
        settings = Run.of(store).settings
        reader = _Reader(terms, store.metrics, points(budget))
        # Chunk by chunk: a run may be larger than memory, and a comparison has hundreds.
        for rows in store.rows():
            reader.take(rows)
        seconds, ended = store.seconds, store.finished or "not yet"
    critical = (
        np.concatenate(reader.critical) if reader.critical else np.empty((0, len(space.names)))
    )
    n = len(critical)
    # A greedy net in the run's own order. Single linkage forms chains: of 1,000 random rows of S4
    # it makes 8 clusters where the net counts 241.
    is_new = distinct(normalised(space, critical), apart, n_var=space.n_var)
    new_at = [reader.hits[k][0] for k in np.flatnonzero(is_new).tolist()]
    bins = coverage(space, critical, np.ones(n, np.bool_), strength=2, sample=0).ways
    hits = reader.hits
    return Record(
        terms=tuple(terms),
        parameters=space.variables,
        command=settings.command(Path("replay") / folder.name),
        ended=ended,
        evaluations=reader.count,
        failed=reader.failed,
        critical=n,
        # What was not found counts as +inf, which medians, tests and A12 take: a penalty (the
        # budget, say) would move medians by a choice of ours.
        reached={k: float(hits[k - 1][0]) if k <= n else float("inf") for k in ks},
        seconds=seconds,
        seconds_reached={k: hits[k - 1][1] if k <= n else float("inf") for k in ks},
        distinct=len(new_at),
        distinct_reached={DISTINCT: _reached(new_at, DISTINCT)},
        distinct_found=np.searchsorted(new_at, points(budget), side="right").astype(np.int64),
        modes=reader.modes,
        modes_reached={MODES: _reached(list(reader.modes_at.values()), MODES)},
        critical_bins=bins[0].critical,
        critical_pairs=bins[1].critical if len(bins) > 1 else 0,
        found=np.array(reader.found, np.int64),
        fronts=tuple(reader.fronts),
        low=reader.low,
        high=reader.high,
    )


def _reached(evaluations: Sequence[int], k: int) -> float:
    """Return the k-th of ascending numbers of evaluations; +inf if there is none."""
    return float(evaluations[k - 1]) if k <= len(evaluations) else float("inf")


def modes_of(findings: Findings) -> dict[tuple[str, ...], list[int]]:
    """Return the different conflicts of some rows, and the rows of each, ascending.

    Conflicts differ in type, responsible, rule or partner. Rows without a near miss or a contact
    have none.
    """
    columns = findings.columns()
    found: dict[tuple[str, ...], list[int]] = {}
    for row, key in enumerate(zip(*(columns[name].tolist() for name in MODE), strict=True)):
        if key[0]:
            found.setdefault(key, []).append(row)
    return found


class _Reader:
    """Reads a run chunk by chunk; memory grows only with the critical rows."""

    def __init__(self, terms: Sequence[str], metrics: Sequence[str], points: Int) -> None:
        self._terms, self._metrics, self._points = terms, metrics, points
        self.count = self.failed = 0
        self.hits: list[tuple[int, float]] = []
        self.critical: list[Float] = []
        self.modes: Counter[tuple[str, ...]] = Counter()
        self.modes_at: dict[tuple[str, ...], int] = {}  # the evaluations until the first of it
        self._front = np.empty((0, len(terms)))
        self.low: Float | None = None
        self.high: Float | None = None
        self._found: list[int] = []
        self._fronts: list[Float] = []

    @property
    def found(self) -> list[int]:
        """Number of critical scenarios at each point; constant after the end of the run."""
        return self._found + [len(self.hits)] * (len(self._points) - len(self._found))

    @property
    def fronts(self) -> list[Float]:
        """The front at each point, likewise."""
        return self._fronts + [self._front] * (len(self._points) - len(self._fronts))

    def take(self, rows: Rows) -> None:
        """Add the next rows."""
        x = positivised(rows.metrics, self._metrics, self._terms)
        ok: Bool = (rows.status == 0) & np.isfinite(x).all(axis=1)
        self.failed += int(np.count_nonzero(rows.status != 0))
        at = np.flatnonzero(rows.critical)
        numbers = (self.count + at + 1).tolist()
        before = len(self.hits)
        self.hits += zip(numbers, rows.seconds[at].tolist(), strict=True)
        self.critical.append(rows.X[at])
        for mode, found in modes_of(rows.findings.take(at)).items():
            self.modes[mode] += len(found)
            self.modes_at.setdefault(mode, numbers[found[0]])
        if ok.any():
            low, high = x[ok].min(axis=0), x[ok].max(axis=0)
            self.low = low if self.low is None else np.minimum(self.low, low)
            self.high = high if self.high is None else np.maximum(self.high, high)
        start, end = 0, self.count + len(rows)
        for point in self._points[len(self._found) :].tolist():
            # A point of the curve may lie within a chunk, so a chunk is seen in pieces.
            stop = min(point, end) - self.count
            self._see(x[start:stop][ok[start:stop]])
            start = stop
            if point > end:
                break
            self._found.append(before + int(np.searchsorted(at, stop)))
            self._fronts.append(self._front)
        self.count = end

    def _see(self, x: Float) -> None:
        if len(x):
            seen = -front(-np.concatenate([self._front, x]))
            # The same array is kept while the front does not change: fifty points of a curve mostly
            # share a few.
            if not np.array_equal(seen, self._front):
                self._front = seen
