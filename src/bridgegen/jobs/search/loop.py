"""The loop of a campaign: ask → decode → evaluate → record → tell.

Resume is its replay, from the start or from the state that the algorithm was saved in.

A search may run ahead of its results: it asks for more rows while some that it asked for before are
evaluated. Which results it has by then is fixed by the number of rows that it may be ahead, never
by what has ended, so the rows that it asks for do not depend on how long any of them takes.
"""

import time
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from enum import StrEnum
from typing import Protocol, Self

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int, as_float
from bridgegen.base.errors import InputError, StorageError
from bridgegen.jobs.search.known_rows import KnownRows, ResultLog
from bridgegen.results.store import Checkpoint, Evaluated, Rows, Store
from bridgegen.search.algorithms import Algorithm, Restorable, TakesNotes

PATIENCE = 100
"""Number of batches in a row without a new row, after which a search has converged."""


class Reason(StrEnum):
    """Why a loop ended. The first four finish the run; after the others it can be resumed."""

    BUDGET = "budget"
    CONVERGED = "converged"
    EXHAUSTED = "exhausted"
    ENOUGH = "enough"
    STOPPED = "stopped"
    INTERRUPTED = "interrupted"

    @property
    def final(self) -> bool:
        """Whether the run is finished, its budget unchanged."""
        return self not in (Reason.STOPPED, Reason.INTERRUPTED)


@dataclass(frozen=True)
class Progress:
    """The progress of a loop after a batch.

    Attributes:
        evaluations: recorded so far, in the order of the store.
        budget: of evaluations.
        seconds: [s] since the start of the run.
        result: the new evaluations of this batch, at least one.
        metrics: the names of the result's metrics.
        replayed: whether they were read from the store instead of simulated.
    """

    evaluations: int
    budget: int
    seconds: float
    result: Evaluated
    metrics: tuple[str, ...]
    replayed: bool


@dataclass(frozen=True)
class LoopResult:
    """The end of a loop.

    Attributes:
        reason: why it ended.
        evaluations: rows in the store.
        simulated: of these, rows that this call evaluated.
        batches: batches that this call asked for, replayed ones included.
        repeated: rows that were asked for again and cost nothing.
        seconds: duration of the run [s], earlier sessions included.
    """

    reason: Reason
    evaluations: int
    simulated: int
    batches: int
    repeated: int
    seconds: float


class Stream(Protocol):
    """Evaluates rows while the loop goes on."""

    def submit(self, X: Float) -> None:
        """Add rows of X."""

    def take(self, n: int) -> Evaluated:
        """Wait for the results of the next n rows, in the order in which they were added."""


class _Direct:
    """A `Stream` that evaluates rows when their results are taken, all of them at once."""

    def __init__(self, evaluate: Callable[[Float], Evaluated]) -> None:
        self._evaluate, self._waiting = evaluate, list[Float]()

    def submit(self, X: Float) -> None:
        self._waiting += list(X)

    def take(self, n: int) -> Evaluated:
        rows, self._waiting = self._waiting[:n], self._waiting[n:]
        return self._evaluate(np.array(rows))


def run_loop(
    algorithm: Algorithm,
    decode: Callable[[Float], Float],
    evaluate: Callable[[Float], Evaluated] | Stream,
    store: Store,
    budget: int,
    on_batch: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
    *,
    ahead: int = 0,
    enough: Callable[[], bool] | None = None,
) -> LoopResult:
    """Search until the budget is spent: exactly ``budget`` evaluations, never one more.

    A row whose decoded X is known, to the last bit, is not evaluated again: the algorithm gets the
    recorded result, and the budget is not charged. A batch that exceeds the budget is recorded up
    to it; the algorithm then gets no results, unless it takes notes: to it, rows beyond the budget
    are failed ones.

    A store that holds evaluations is resumed: a new algorithm asks again, gets the recorded
    results, and must ask for exactly those rows. So a run that was killed, or ended with a smaller
    budget, becomes the run that it would have been undisturbed.

    An algorithm that is `Restorable` is saved after each batch. It resumes from there, and asks
    again only for the rows recorded since: at most the batch whose results it had not yet got when
    the run was killed. A search that runs ahead is not saved: its state does not say which rows are
    being evaluated.

    With ``ahead``, the rows that the algorithm asks for are told in the same order, later: it is
    asked for the next batch as soon as all but ``ahead`` of its rows are told. The first batch is
    told as a whole before the second is asked for, so that no search learns from a part of its
    first sample. Rows are recorded as they are told; those that are being evaluated when the loop
    is interrupted are evaluated again.

    Args:
        algorithm: new, made with the run's seed and settings.
        decode: ``(n, n_var)`` unit-cube rows → X ``(n, len(store.parameters))``; each row's
            result depends on that row alone.
        evaluate: X → metrics, F, critical and status of its rows; may contain NaN and ±inf. Or a
            stream of rows, which evaluates them while the algorithm is asked for more.
        store: open for writing.
        budget: evaluations in the store at the end.
        on_batch: called after each batch with new evaluations, recorded or replayed; those that a
            restored algorithm knows come a few thousand at a time.
        stop: called before each batch; True ends the loop.
        ahead: rows whose results the algorithm need not have when it is asked for a batch, ≥ 0;
            0 unless it is `asynchronous`.
        enough: called after each batch that is not a replay of recorded ones; True finishes the
            run. It depends on the recorded rows alone.

    Returns:
        The end of the loop. Ctrl-C ends it, too; finished batches are in the store by then.

    Raises:
        StorageError: the store cannot be written, or was made by another version or other inputs.
    """
    n_before = len(store)
    stream = _Direct(evaluate) if callable(evaluate) else evaluate
    session = _Session(algorithm, decode, stream, store, budget, on_batch, ahead)
    reason: Reason | None = Reason.BUDGET if n_before >= budget else None
    try:
        # Replaying from the seed is the way to resume: no pickle, no state to forget. A million
        # evaluations of PSO replay in a minute and a half.
        if reason is None:
            session.restore()
        while reason is None:
            reason = Reason.STOPPED if stop is not None and stop() else session.batch()
            if reason is None and enough is not None and session.is_up_to_date and enough():
                reason = Reason.ENOUGH
        if reason.final and store.finished != reason:
            store.finish(reason)
    except KeyboardInterrupt:
        # Notes are kept after Ctrl-C, too; after a kill they are missing until the run is resumed:
        # writing them after each batch would double the writes.
        reason = Reason.INTERRUPTED
    session.keep_notes()
    return LoopResult(
        reason,
        evaluations=len(store),
        simulated=len(store) - n_before,
        batches=session.batches,
        repeated=session.repeated,
        seconds=session.seconds,
    )


@dataclass(frozen=True)
class _Pending:
    """Rows that an algorithm has asked for and has no results of, in its order.

    Attributes:
        U: ``(n, n_var)`` float64.
        X: ``(n, len(store.parameters))`` float64.
        ids: ``(n,)`` int64, see `KnownRows.add`.
        fresh: ``(n,)`` bool, whether it was asked for the first time.
    """

    U: Float
    X: Float
    ids: Int
    fresh: Bool

    def __len__(self) -> int:
        return len(self.ids)

    @classmethod
    def none(cls, n_var: int, n_parameters: int) -> Self:
        """Return no rows."""
        nothing = np.empty(0, np.int64)
        return cls(np.empty((0, n_var)), np.empty((0, n_parameters)), nothing, nothing > 0)

    def followed_by(self, U: Float, X: Float, ids: Int, fresh: Sequence[int]) -> "_Pending":
        """Return these rows and more; ``fresh`` are the positions of new ones among these."""
        return _Pending(
            np.concatenate([self.U, U]),
            np.concatenate([self.X, X]),
            np.concatenate([self.ids, ids]),
            np.concatenate([self.fresh, np.isin(np.arange(len(ids)), fresh)]),
        )

    def take(self, rows: slice) -> "_Pending":
        """Return some of the rows."""
        return _Pending(self.U[rows], self.X[rows], self.ids[rows], self.fresh[rows])


class _Session:
    """One call of the loop: the known rows, those that are not told, and its progress."""

    def __init__(
        self,
        algorithm: Algorithm,
        decode: Callable[[Float], Float],
        stream: Stream,
        store: Store,
        budget: int,
        on_batch: Callable[[Progress], None] | None,
        ahead: int,
    ) -> None:
        self.batches = self.repeated = 0
        self._algorithm, self._decode, self._stream = algorithm, decode, stream
        self._store, self._budget, self._on_batch = store, budget, on_batch
        self._recorded, self._seconds_before = len(store), store.seconds
        self._began: float | None = None
        self._known = KnownRows()
        self._log = ResultLog(store.n_obj, len(store.metrics))
        self._ahead, self._idle = ahead, 0
        self._untold = _Pending.none(store.columns.n_var, len(store.parameters))

    @property
    def seconds(self) -> float:
        """Duration of the run [s]; the replay does not count."""
        running = 0.0 if self._began is None else time.perf_counter() - self._began
        return self._seconds_before + running

    @property
    def is_up_to_date(self) -> bool:
        """Whether all recorded rows have been asked for."""
        return len(self._known) >= self._recorded

    def restore(self) -> None:
        """Restore the algorithm's saved state, if there is one; later rows are replayed."""
        algorithm, saved = self._algorithm, self._store.checkpoint()
        if saved is None or not isinstance(algorithm, Restorable):
            return
        for rows in self._store.rows(0, saved.evaluations):
            # The decoder is not part of the saved state: rows that it gives otherwise now would be
            # other scenarios under the same numbers.
            X = as_float("X", self._decode(rows.U), rows.X.shape) + 0.0
            self._compare("X", X, rows.X, int(rows.id[0]))
            self._known.add(X, self._budget)
            self._log.add(rows)
            self._report(int(rows.id[-1]) + 1, rows, replayed=True)
        self._idle = saved.idle
        try:
            algorithm.restore(saved.state)
        except ValueError as error:
            raise StorageError(
                f"{self._store.folder}: the saved state of the search cannot be restored: "
                f"{error}; its results can still be read"
            ) from error

    def batch(self) -> Reason | None:
        """Do one batch; return the reason if it was the last one."""
        if self.is_up_to_date:
            self._start_clock()
        U = self._ask()
        if len(U) == 0:
            if len(self._untold):  # their results may lead to more rows
                self._tell(len(self._untold))
                return None
            return self._nothing_new(Reason.EXHAUSTED)
        # No −0.0: SQLite would lose its sign, and a row is simulated as it is recorded.
        X = as_float("X", self._decode(U), (len(U), len(self._store.parameters))) + 0.0
        ids, fresh = self._known.add(X, self._budget)
        self._submit(X[[k for k in fresh if ids[k] >= self._recorded]])
        self._untold = self._untold.followed_by(U, X, ids, fresh)
        self.batches += 1
        self.repeated += int(np.count_nonzero(ids >= 0)) - len(fresh)
        if len(self._known) >= self._budget:
            # The budget may have cut this batch short, and it is the last one.
            self._tell(len(self._untold), last=True)
            return Reason.BUDGET

        self._idle = 0 if fresh else self._idle + 1
        converged = self._idle >= PATIENCE
        # The first batch is told whole: no model of four rows, no archive whose ranges are those of
        # two.
        may_wait = 0 if converged or self.batches == 1 else self._ahead
        # By number of rows, in the order in which they were asked for: told by whichever ends
        # first, a search would depend on the machine's load.
        self._tell(len(self._untold) - may_wait)
        return self._nothing_new(Reason.CONVERGED) if converged else None

    def _submit(self, X: Float) -> None:
        """Have new rows evaluated."""
        if len(X):
            self._start_clock()
            self._stream.submit(X)

    def _tell(self, n: int, *, last: bool = False) -> None:
        """Record the results of the first n rows that are not told, if n > 0, and tell them.

        Args:
            n: at most all of them.
            last: whether nothing more is asked for; only who takes notes is told then.
        """
        if n <= 0:
            return
        told, self._untold = self._untold.take(slice(n)), self._untold.take(slice(n, None))
        new = told.ids >= self._recorded
        for rows, take in ((told.fresh & ~new, self._replay), (told.fresh & new, self._simulate)):
            if rows.any():
                self._log.add(take(told.U[rows], told.X[rows], int(told.ids[rows][0])))
        if last and not isinstance(self._algorithm, TakesNotes):
            return
        self._algorithm.tell(told.U, self._log.results(told.ids))
        # With `--ahead` a state would have to hold the rows in flight, too: none is saved, and a
        # search that resumes replays.
        if not last and not self._ahead and self.is_up_to_date:
            self._save()

    def keep_notes(self) -> None:
        """Record the algorithm's notes, once it has got all results of the store."""
        if (
            isinstance(self._algorithm, TakesNotes)
            and self.batches
            and len(self._log) >= self._recorded
        ):
            self._store.keep_notes(self._algorithm.notes())

    def _save(self) -> None:
        if isinstance(self._algorithm, Restorable):
            # In a transaction of its own right after `tell`. Killed in between, the last batch is
            # asked again on the state before it, compared bit for bit and answered from the store:
            # no instant is left at which the two disagree.
            self._store.save(Checkpoint(len(self._known), self._idle, self._algorithm.state()))

    def _ask(self) -> Float:
        # An algorithm of the user's may return anything: it is checked here, where the error can
        # name it.
        name, n_var = self._algorithm.name, self._store.columns.n_var
        try:
            # A copy: the algorithm may reuse its array.
            U = as_float("its rows", self._algorithm.ask(), (None, n_var)).copy()
        except ValueError as error:
            raise InputError(f"algorithm '{name}': {error}") from error
        if len(U) and not (U.min() >= 0.0 and U.max() <= 1.0):
            got = f"{U.min():g} .. {U.max():g}"
            raise InputError(f"algorithm '{name}': its rows must be in [0, 1], got {got}")
        return U

    def _replay(self, U: Float, X: Float, start: int) -> Rows:
        """Return the recorded results of rows, which must be those that were asked for."""
        rows = self._store.read(start, start + len(U))
        self._compare("U", U, rows.U, start)
        self._compare("X", X, rows.X, start)
        self._report(start + len(U), rows, replayed=True)
        return rows

    def _compare(self, name: str, now: Float, then: Float, start: int) -> None:
        """Check that rows are those that were recorded."""
        # Bit for bit: a difference in the last digit is another search from there on.
        differ = np.argwhere(now != then)
        if len(differ):
            k, j = (int(i) for i in differ[0])
            detail = f"{name}[{j}] is {float(now[k, j])}, recorded {float(then[k, j])}"
            raise self._other(f"evaluation {start + k}: {detail}")

    def _simulate(self, U: Float, X: Float, start: int) -> Evaluated:
        """Wait for the results of new rows and record them."""
        result = self._stream.take(len(U))
        self._store.append(U, X, result, self.seconds)
        self._report(start + len(U), result, replayed=False)
        return result

    def _report(self, evaluations: int, result: Evaluated, *, replayed: bool) -> None:
        if self._on_batch:
            names = self._store.metrics
            self._on_batch(
                Progress(evaluations, self._budget, self.seconds, result, names, replayed)
            )

    def _nothing_new(self, reason: Reason) -> Reason:
        if not self.is_up_to_date:
            raise self._other(f"the search ends after {len(self._known)} evaluations ({reason})")
        return reason

    def _other(self, detail: str) -> StorageError:
        store = self._store
        return StorageError(
            f"{store.folder}: this run cannot be resumed: from its seed, the search "
            f"must repeat the {self._recorded} recorded evaluations bit for bit; {detail}. It was "
            f"made by another version of BridgeGen ({store.version}) or of a library, "
            "or from another scenario; its results can still be read"
        )

    def _start_clock(self) -> None:
        if self._began is None:
            self._began = time.perf_counter()
