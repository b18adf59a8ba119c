"""The rows that a search has asked for, and the results of all evaluated ones."""

from array import array
from hashlib import blake2b

import numpy as np

from bridgegen.assess.cause import Cause
from bridgegen.base.arrays import Float, Int
from bridgegen.results.store import Evaluated
from bridgegen.search.algorithms import Results

FIRST_SLOTS = 1 << 12


class KnownRows:
    """The distinct rows of X that a search has asked for; ids number them from 0, in their order.

    Rows are distinguished by digests of 16 bytes, held in the order of ids. An open-addressing hash
    table of ids, at most half full, finds them. (A dict takes 200 bytes a row.)
    """

    def __init__(self) -> None:
        self._digests, self._slots = array("Q"), array("i")
        self._resize(FIRST_SLOTS)

    def __len__(self) -> int:
        return len(self._digests) // 2

    def add(self, X: Float, most: int) -> tuple[Int, list[int]]:
        """Return the id of each row, ``(n,)``, and the positions of those that are new.

        Args:
            X: ``(n, k)`` float64, without −0.0.
            most: at most so many rows are known; the id of a further new one is −1.
        """
        # Digests in an array with a hash table of ids take 24 to 32 bytes a row; a dict took 130
        # more, at the same speed.
        whole = b"".join([blake2b(row.tobytes(), digest_size=16).digest() for row in X])
        keys = np.frombuffer(whole, np.uint64).reshape(-1, 2).tolist()
        ids, fresh, n = [-1] * len(keys), [], len(self)
        slots, digests, mask = self._slots, self._digests, len(self._slots) - 1
        for k, (low, high) in enumerate(keys):
            at = low & mask
            # Linear probing; at most half of the slots are full.
            while (known := slots[at]) >= 0:
                if digests[2 * known] == low and digests[2 * known + 1] == high:
                    ids[k] = known
                    break
                at = (at + 1) & mask
            else:
                if n < most:
                    slots[at] = ids[k] = n
                    digests.append(low)
                    digests.append(high)
                    fresh.append(k)
                    n += 1
                    if 2 * n > mask:
                        self._resize(2 * len(slots))
                        slots, mask = self._slots, len(self._slots) - 1
        return np.array(ids, dtype=np.int64), fresh

    def _resize(self, size: int) -> None:
        """Rebuild the table with so many slots, a power of two."""
        slots = np.full(size, -1, np.int32)
        low = np.frombuffer(self._digests, np.uint64)[::2]
        at, left = (low & np.uint64(size - 1)).astype(np.int64), np.arange(len(low))
        while len(left):
            free = slots[at] < 0
            slots[at[free]] = left[free]  # one of several rows gets a slot
            out = slots[at] != left
            at, left = (at[out] + 1) & (size - 1), left[out]
        self._slots = array("i", slots.tobytes())


# --- The results of all evaluated rows, as an algorithm gets them ---


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
