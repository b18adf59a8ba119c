"""MAP-Elites: the most critical scenario of each kind."""

from collections.abc import Mapping
from dataclasses import dataclass
from math import isfinite
from typing import ClassVar

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError, UnknownNameError
from bridgegen.search.algorithms.algorithm import (
    JSON,
    Arity,
    Problem,
    Results,
    Setting,
    Value,
    resolve,
)
from bridgegen.search.algorithms.sampling import latin_hypercube

# The archive is a full grid of plain arrays, not a sparse one.
CELLS_AT_MOST = 100_000
ELITES_KEPT = 1000
"""Maximum number of elites in the run's notes, the most critical ones."""


class MAPElites:
    """An archive of cells, each with the most critical row whose behaviour falls into it.

    A behaviour is described by metrics or by searched parameters, as the user chooses; by default
    by the first two parameters: the most critical scenario of each combination of them. A new row
    is an elite that is moved along the line to another one and by a small random step. The goal is
    not one worst scenario but many different ones.

    Where the source is silent:

    - the first rows are a Latin hypercube;
    - a descriptor's range is the user's, or a parameter's whole range, or that of the first rows'
      values; values beyond it belong to the outermost cell, +inf (no collision ever) too;
    - a row with a descriptor that does not exist (NaN) is in no cell.

    This is an own implementation: pyribs loads scikit-learn, pandas, Numba and, where it is
    installed, PyTorch for an archive of five arrays.

    Source: Mouret and Clune (2015), "Illuminating search spaces by mapping elites"; the variation
    is Vassiliades and Mouret's (2018), "Discovering the elite hypervolume by leveraging
    interspecies correlation".
    """

    name: ClassVar[str] = "map-elites"
    description: ClassVar[str] = "the most critical row of each cell of a behaviour space"
    source: ClassVar[str] = "Mouret and Clune (2015), arXiv:1504.04909"
    settings: ClassVar[Mapping[str, Setting]] = {
        "descriptors": Setting(
            "",
            "metrics or parameters that distinguish kinds of scenarios, optionally with ranges: "
            "v_d=0:15,ttc (a parameter's range in shares of it); empty: the first two parameters",
        ),
        # 20 per descriptor make 400 cells of two descriptors, which is all that 1,000 rows can
        # fill: R_critic .14 and .08 (S1, S4) instead of .44 and .15 with 10
        # (docs/decisions/search.md).
        "cells": Setting(10, "cells per descriptor", 1, 10_000),
        "population": Setting(40, "rows per batch", 1, 100_000),
        "initial": Setting(40, "number of initial space-filling rows", 1, 1_000_000),
        "near": Setting(0.02, "standard deviation of a row's random step", 0.0, 1.0),
        # Distinct critical rows with 0.2 / 0.5 / 1.0: 17 / 43 / 71 in S1, 10 / 23 / 40 in S4.
        "line": Setting(1.0, "that of its step along the line, per distance", 0.0, 2.0),
    }
    objectives: ClassVar[Arity] = "one"
    asynchronous: ClassVar[bool] = True

    def __init__(self, problem: Problem, seed: int, **settings: Value) -> None:
        self._values = resolve(MAPElites, problem, seed, settings)
        self._problem = problem
        self._descriptors = _parse(self._values["descriptors"], problem)
        if self._values["cells"] ** len(self._descriptors) > CELLS_AT_MOST:
            raise InputError(
                f"map-elites: cells ** descriptors <= {CELLS_AT_MOST} must hold, "
                f"got {self._values['cells']} ** {len(self._descriptors)}"
            )
        self._rng = np.random.Generator(np.random.PCG64(seed))
        self._worst = -np.inf
        self._archive: _Archive | None = None

    def ask(self) -> Float:
        """Return a sample of the cube at first, then rows made of elites."""
        n_var, archive, rng = self._problem.n_var, self._archive, self._rng
        if archive is None or not len(archive.filled):
            n = self._values["initial" if archive is None else "population"]
            return latin_hypercube(rng, n, n_var)
        n = self._values["population"]
        item, other = archive.U[archive.filled[rng.integers(len(archive.filled), size=(2, n))]]
        anywhere = self._values["near"] * rng.standard_normal((n, n_var))
        along = self._values["line"] * rng.standard_normal((n, 1)) * (other - item)
        rows: Float = np.clip(item + anywhere + along, 0.0, 1.0)
        return rows

    def tell(self, U: Float, results: Results) -> None:
        """Put each row into its cell, if nothing more critical is there."""
        F = results.F[:, 0]
        behaviour = np.stack(
            [descriptor.of(U, results) for descriptor in self._descriptors], axis=1
        )
        good = results.ok & np.isfinite(F) & ~np.isnan(behaviour).any(axis=1)
        if self._archive is None:
            columns = zip(self._descriptors, behaviour[good].T, strict=True)
            spans = np.array([descriptor.span(column) for descriptor, column in columns])
            self._archive = _Archive(spans, self._values["cells"], self._problem.n_var)
        self._archive.add(U[good], F[good], behaviour[good], results.critical[good])
        self._worst = max(self._worst, float(F[good].max(initial=-np.inf)))

    def notes(self) -> Mapping[str, JSON]:
        """Return the archive's filled share, and its elites, the most critical first."""
        names = [descriptor.name for descriptor in self._descriptors]
        if self._archive is None:
            return {"descriptors": list(names), "cells filled": 0}
        archive, filled = self._archive, self._archive.filled
        F, cells = archive.F[filled], len(archive.F)
        spans = zip(names, archive.low.tolist(), archive.high.tolist(), strict=True)
        elites: list[JSON] = []
        for k in filled[np.argsort(F, kind="stable")][:ELITES_KEPT].tolist():
            elite: dict[str, JSON] = dict(zip(names, archive.behaviour[k].tolist(), strict=True))
            elite |= {"objective": float(archive.F[k]), "critical": bool(archive.critical[k])}
            elites.append(elite)
        with np.errstate(over="ignore"):
            score = float(np.minimum((self._worst - F).sum(), np.finfo(np.float64).max))
        return {
            "descriptors": [f"{name} {low:.4g} … {high:.4g}" for name, low, high in spans],
            "cells": cells,
            "cells filled": len(filled),
            "cells with a critical scenario": int(archive.critical[filled].sum()),
            "coverage": len(filled) / cells,
            "QD score, above the worst row": score,
            "elites": elites,
        }


class _Archive:
    """A grid of cells, each empty or with its best row.

    Attributes:
        low: ``(n,)`` float64, where each descriptor's cells begin.
        high: ``(n,)`` float64, where they end.
        F: ``(cells,)`` float64, +inf in empty ones.
        U: ``(cells, n_var)`` float64.
        behaviour: ``(cells, n)`` float64, within low and high.
        critical: ``(cells,)`` bool.
        filled: the cells that are not empty, ascending.
    """

    def __init__(self, spans: Float, per_descriptor: int, n_var: int) -> None:
        """Construct an empty archive.

        Args:
            spans: ``(n, 2)`` float64, where each descriptor's cells begin and end.
            per_descriptor: cells.
            n_var: columns of U.
        """
        self.low, self.high = spans.T
        self._sizes = (per_descriptor,) * len(spans)
        cells = per_descriptor ** len(spans)
        self.F, self.critical = np.full(cells, np.inf), np.zeros(cells, np.bool_)
        self.U, self.behaviour = np.empty((cells, n_var)), np.empty((cells, len(spans)))
        self.filled = np.empty(0, np.int64)

    def add(self, U: Float, F: Float, behaviour: Float, critical: Bool) -> None:
        """Add the rows that are better than their cells' elites; of equals the first."""
        within = np.clip(behaviour, self.low, self.high)
        shares = (within - self.low) / (self.high - self.low)
        places = np.minimum((shares * self._sizes[0]).astype(np.int64), self._sizes[0] - 1)
        cells = np.ravel_multi_index(tuple(places.T), self._sizes)
        # Sorted by cell, then by F: the first of each cell is its best row, and of equal ones the
        # earliest.
        order = np.lexsort((F, cells))
        best = order[np.unique(cells[order], return_index=True)[1]]
        best = best[F[best] < self.F[cells[best]]]
        at = cells[best]
        self.F[at], self.U[at], self.critical[at] = F[best], U[best], critical[best]
        self.behaviour[at] = within[best]
        self.filled = np.flatnonzero(np.isfinite(self.F))


@dataclass(frozen=True)
class _Descriptor:
    """One dimension of the behaviour space.

    Attributes:
        name: of a metric or a parameter.
        column: its column in the metrics, or in U.
        is_metric: which of the two.
        low: where its cells begin; NaN: at the first rows' minimum.
        high: where they end; NaN: at the first rows' maximum.
    """

    name: str
    column: int
    is_metric: bool
    low: float
    high: float

    def of(self, U: Float, results: Results) -> Float:
        """Return its value of each row, ``(n,)`` float64; NaN where it does not exist."""
        table = results.metrics if self.is_metric else U
        column: Float = table[:, self.column]
        return column

    def span(self, values: Float) -> tuple[float, float]:
        """Return where its cells begin and end, by default by the first rows' values."""
        if isfinite(self.low):
            return self.low, self.high
        # Differences of values near the largest float64 would be inf.
        known = np.clip(values[np.isfinite(values)], -1e300, 1e300)  # their distance is finite
        low, high = (float(known.min()), float(known.max())) if len(known) else (0.0, 1.0)
        # A constant is in the middle cells; later values may differ.
        room = max(abs(low), 1.0) / 2 if high - low <= 1e-9 * max(abs(low), 1.0) else 0.0
        return low - room, high + room


def _parse(text: str, problem: Problem) -> tuple[_Descriptor, ...]:
    """Parse the descriptors of a setting.

    Raises:
        UnknownNameError: no such metric or parameter.
        InputError: an invalid range, or a duplicate name.
    """
    parts = [part.strip() for part in text.split(",") if part.strip()]
    # Parameters, not metrics, tell kinds apart by default: their ranges are known before any row,
    # and every cell can be reached.
    parts = parts or list(problem.parameters[:2])
    found = []
    for part in parts:
        name, equals, span = (item.strip() for item in part.partition("="))
        known = (*problem.metrics, *problem.parameters)
        if name not in known:
            raise UnknownNameError("descriptor of map-elites", name, known)
        is_metric = name in problem.metrics
        low, high = (np.nan, np.nan) if is_metric else (0.0, 1.0)
        if equals:
            try:
                low, high = (float(edge) for edge in span.split(":"))
            except ValueError:
                low = high = np.nan
            if not (isfinite(low) and isfinite(high) and low < high):
                raise InputError(
                    f"map-elites: the range of {name} must be LOW:HIGH, two numbers with "
                    f"LOW < HIGH, got '{span}'"
                )
        place = problem.metrics if is_metric else problem.parameters
        found.append(_Descriptor(name, place.index(name), is_metric, low, high))
    names = [descriptor.name for descriptor in found]
    if len(set(names)) < len(names):
        raise InputError(f"map-elites: descriptors must be unique, got {', '.join(names)}")
    return tuple(found)
