"""The results of all evaluated rows, as an algorithm gets them."""

from array import array

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.base.arrays import Int
from bridgegen.results.store import Evaluated
from bridgegen.search.algorithms import Results


class ResultLog:
    """Results of every evaluated row, by row id; the same bits in a search and in its replay."""

    def __init__(self, n_obj: int, n_metrics: int) -> None:
        self._n_obj, self._n_metrics = n_obj, n_metrics
        self._F, self._metrics = array("d"), array("d")
        self._ok, self._critical, self._cause = array("b"), array("b"), array("b")

    def __len__(self) -> int:
        """The number of rows."""
        return len(self._ok)

    def add(self, result: Evaluated) -> None:
        """Append the results of the next rows."""
        # SQLite keeps neither the sign of zero nor the bits of NaN.
        F = np.asarray(result.F, np.float64) + 0.0
        metrics = np.asarray(result.metrics, np.float64) + 0.0
        metrics = np.where(np.isnan(metrics), np.nan, metrics)
        ok = (np.asarray(result.status) == 0) & np.isfinite(F).all(axis=1)
        critical = np.asarray(result.critical, np.bool_) & ok
        cause = np.full(len(F), Cause.NONE) if result.cause is None else np.asarray(result.cause)
        for kept, values in (
            (self._F, F),
            (self._metrics, metrics),
            (self._ok, ok),
            (self._critical, critical),
            (self._cause, cause.astype(np.int8)),
        ):
            kept.frombytes(values.tobytes())

    def results(self, ids: Int) -> Results:
        """Return the results of some rows; id −1 stands for a row that was not evaluated."""
        there = ids >= 0
        return Results(
            F=np.frombuffer(self._F).reshape(-1, self._n_obj)[ids],
            ok=np.frombuffer(self._ok, np.bool_)[ids] & there,
            critical=np.frombuffer(self._critical, np.bool_)[ids] & there,
            metrics=np.where(
                there[:, np.newaxis],
                np.frombuffer(self._metrics).reshape(-1, self._n_metrics)[ids],
                np.nan,
            ),
            cause=np.frombuffer(self._cause, np.int8)[ids],
        )
