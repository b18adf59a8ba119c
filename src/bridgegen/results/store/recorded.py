"""All evaluations of a run, of which memory holds little: long runs are larger than memory."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bridgegen.assess.cause import Cause
from bridgegen.assess.conflict.findings import Findings, unpacked
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.results.store.rows import Rows, column, digest_of, finite, unit_rows

if TYPE_CHECKING:
    from bridgegen.results.store.store import Store

Values = Sequence[tuple[Any, ...]]


@dataclass(frozen=True)
class Narrow:
    """What memory holds of n evaluations; attributes as of `Recorded`.

    Attributes:
        metrics: some columns, ``(n,)`` float64 each, by name.
    """

    batch: Int
    status: Int
    critical: Bool
    cause: npt.NDArray[np.int8]
    F: Float
    findings: Findings
    metrics: Mapping[str, Float]

    def __len__(self) -> int:
        return len(self.batch)


class Recorded:
    """The evaluations of a run, in the order of recording, as many as there were when it was made.

    From the first use of one of them, memory holds status, batch, critical, cause, F, findings and
    the columns of some metrics: 90 bytes a row with one objective, and 8 for each of these metrics.
    U, X and metrics are read when they are indexed, see `bridgegen.base.arrays.Numbers`.

    Args:
        store: read while it is open; what is in memory can be used afterwards.
        earlier: of the same run when it had fewer evaluations, or as many; what it has in memory
            is not read again.
        whole: names of metrics whose columns stay in memory; those that the run did not record are
            left out.

    Attributes:
        U: ``(n, n_var)`` float64, read when indexed.
        X: ``(n, len(parameters))`` float64, likewise.
        metrics: ``(n, M)`` float64, likewise.
    """

    def __init__(
        self, store: "Store", earlier: "Recorded | None" = None, *, whole: Sequence[str] = ()
    ) -> None:
        columns, n = store.columns, len(store)
        self._store, self._n = store, n
        self._whole = tuple(name for name in whole if name in store.metrics)
        self._earlier: Narrow | None = None
        if earlier is not None and len(earlier) <= n and earlier._whole == self._whole:
            self._earlier = earlier.__dict__.get("_narrow", earlier._earlier)
            if len(earlier) == n and "_digest" in earlier.__dict__:
                self._digest = earlier._digest
        self.U = OnDisk(
            store, n, ("u",), lambda found: unit_rows(found, 0, columns.n_var), width=columns.n_var
        )
        self.X = OnDisk(store, n, columns.X, lambda found: finite("a parameter", _floats(found)))
        self.metrics = OnDisk(store, n, columns.metrics, kept=self._metric)

    def __len__(self) -> int:
        return self._n

    @property
    def id(self) -> Int:
        """``(n,)`` int64, 0, 1, 2 and so on."""
        return np.arange(self._n)

    @property
    def batch(self) -> Int:
        """``(n,)`` int64, which transaction recorded the row."""
        return self._narrow.batch

    @property
    def status(self) -> Int:
        """``(n,)`` int64, 0 is success."""
        return self._narrow.status

    @property
    def critical(self) -> Bool:
        """``(n,)`` bool."""
        return self._narrow.critical

    @property
    def cause(self) -> npt.NDArray[np.int8]:
        """``(n,)``, a `Cause` each; NONE, too, of a run that did not seek causes."""
        return self._narrow.cause

    @property
    def F(self) -> Float:
        """``(n, n_obj)`` float64, smaller is more critical."""
        return self._narrow.F

    @property
    def findings(self) -> Findings:
        """The decisive conflict of each row; empty, too, of a run that recorded none."""
        return self._narrow.findings

    def take(self, at: Int | Bool) -> Rows:
        """Return the rows at some positions, in that order, read whole.

        Raises:
            StorageError: the database is damaged.
        """
        return self._store.at(_positions(at, self._n))

    def digest(self) -> str:
        """Return the digest of these evaluations; see `Rows.digest`."""
        return self._digest

    @cached_property
    def _digest(self) -> str:
        return digest_of(self)

    @cached_property
    def _narrow(self) -> Narrow:
        """What memory holds, read in one go."""
        # The earlier object is let go, so that its arrays do not stay beside the new ones.
        known, self._earlier = self._earlier, None
        if known is not None and len(known) == self._n:
            return known
        store, n, n_obj = self._store, self._n, self._store.n_obj
        of = dict(zip(store.metrics, store.columns.metrics, strict=True))
        last, width = store.columns.last, n_obj + len(self._whole)
        names = ("batch", *store.columns.F, *(of[name] for name in self._whole), *last)
        batch, status, critical = (
            np.empty(n, np.int64),
            np.empty(n, np.int64),
            np.empty(n, np.bool_),
        )
        cause, F = np.zeros(n, np.int8), np.empty((n, n_obj))
        metrics = {name: np.empty(n) for name in self._whole}
        at, findings = 0, []
        if known is not None:
            at, findings = len(known), [known.findings]
            batch[:at], status[:at], critical[:at] = known.batch, known.status, known.critical
            cause[:at], F[:at] = known.cause, known.F
            for name, values in known.metrics.items():
                metrics[name][:at] = values
        # In one pass over the table, and in parts: SQL's rows are Python's objects, ten times the
        # size of the arrays.
        for found in store.select(names, at, n):
            part, end = slice(at, at + len(found)), 1 + width
            with store.damage():
                batch[part] = column(found, "batch", 0, np.int64)
                status[part] = column(found, "status", end, np.int64)
                critical[part] = column(found, "critical", end + 1, np.bool_)
                if len(last) > 2:
                    named = [row[end + 2] for row in found]
                    cause[part] = [Cause.named(item) if item else Cause.NONE for item in named]
                if len(last) > 3:
                    findings.append(unpacked([row[end + 3 :] for row in found]))
                else:
                    findings.append(Findings.none(len(found)))
                numbers = _floats([row[1:end] for row in found])
            F[part] = numbers[:, :n_obj]
            for k, values in enumerate(metrics.values(), start=n_obj):
                values[part] = numbers[:, k]
            at += len(found)
        joined = Findings.join(findings) if findings else Findings.none(0)
        return Narrow(batch, status, critical, cause, F, joined, metrics)

    def _metric(self, j: int) -> Float | None:
        """Return a metric's column, if it is one of those that stay in memory."""
        name = self._store.metrics[j]
        return self._narrow.metrics[name] if name in self._whole else None


class OnDisk:
    """Numbers of a run's evaluations, read from its store whenever they are indexed.

    Args:
        store: open.
        n: rows.
        columns: of the table of evaluations.
        convert: what SQL reads of these → ``(k, width)`` float64; columns of numbers by default.
        width: of the table; as many as columns by default.
        kept: by its number, a column that is in memory; None of one that is not.
    """

    def __init__(
        self,
        store: "Store",
        n: int,
        columns: Sequence[str],
        convert: Callable[[Values], Float] | None = None,
        *,
        width: int | None = None,
        kept: Callable[[int], Float | None] = lambda j: None,
    ) -> None:
        self._store, self._n, self._columns = store, n, tuple(columns)
        self._convert, self._width, self._kept = convert or _floats, width, kept

    def __len__(self) -> int:
        return self._n

    def __getitem__(self, at: Any, /) -> Any:
        """Return rows, a column, or values of one, as an array would.

        Raises:
            StorageError: the database is damaged.
        """
        if not isinstance(at, tuple):
            return self._rows(at, self._columns)
        rows, j = at
        if self._width is not None:
            return self._rows(rows, self._columns)[..., j]
        j = range(len(self._columns))[j]
        kept = self._kept(j)
        return self._rows(rows, self._columns[j : j + 1])[..., 0] if kept is None else kept[rows]

    def _rows(self, at: Any, columns: Sequence[str]) -> Float:
        width = len(columns) if self._width is None else self._width
        if isinstance(at, slice):
            start, stop, step = at.indices(self._n)
            if step != 1:
                return self._rows(np.arange(start, stop, step), columns)
            found = self._store.select(columns, start, stop)
            return self._filled(max(stop - start, 0), width, found)
        rows = np.asarray(at)
        if rows.ndim == 0:
            (row,) = self._rows(rows[np.newaxis], columns)
            return np.asarray(row)
        # Asked for in the order of ids, each once: SQLite reads each page once, and the order that
        # was wanted is made afterwards.
        rows, inverse = np.unique(_positions(rows, self._n), return_inverse=True)
        whole = self._filled(len(rows), width, self._store.select_at(columns, rows))
        if len(inverse) == len(rows) and _ascends(inverse):
            return whole
        some: Float = whole[inverse]
        return some

    def _filled(self, n: int, width: int, parts: Iterator[Values]) -> Float:
        whole, at = np.empty((n, width)), 0
        for found in parts:
            with self._store.damage():
                whole[at : at + len(found)] = self._convert(found)
            at += len(found)
        return whole


def _floats(found: Values) -> Float:
    """Return numbers as float64; NULL arrives as None, which is taken as NaN."""
    return np.array(found, dtype=np.float64)


def _ascends(numbers: Int) -> bool:
    return bool((numbers[1:] > numbers[:-1]).all())


def _positions(at: npt.ArrayLike, n: int) -> Int:
    """Return the positions that a mask, or positions, name among n."""
    rows = np.asarray(at)
    if rows.dtype == np.bool_:
        return np.flatnonzero(rows)
    if rows.size and not (-n <= rows.min() and rows.max() < n):
        raise IndexError(f"positions must be in 0..{n - 1}")
    return np.where(rows < 0, rows + n, rows).astype(np.int64)
