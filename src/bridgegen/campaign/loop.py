"""The loop of a campaign: ask → decode → evaluate → record → tell.

Resume is its replay, from the start or from the state that the algorithm was saved in.
"""

import time
from collections.abc import Callable
from dataclasses import dataclass
from enum import StrEnum

import numpy as np

from bridgegen.arrays import Float, as_float
from bridgegen.campaign.known_rows import KnownRows
from bridgegen.campaign.result_log import ResultLog
from bridgegen.errors import InputError, StorageError
from bridgegen.search import Algorithm, Restorable, TakesNotes
from bridgegen.store import Checkpoint, Evaluated, Rows, Store

PATIENCE = 100
"""Batches in a row without a new row, after which a search has converged."""


class Reason(StrEnum):
    """Why a loop ended. The first three finish the run; after the others it can be resumed."""

    BUDGET = "budget"
    CONVERGED = "converged"
    EXHAUSTED = "exhausted"
    STOPPED = "stopped"
    INTERRUPTED = "interrupted"

    @property
    def final(self) -> bool:
        """Whether the run is finished, its budget unchanged."""
        return self in (Reason.BUDGET, Reason.CONVERGED, Reason.EXHAUSTED)


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


def run_loop(
    algorithm: Algorithm,
    decode: Callable[[Float], Float],
    evaluate: Callable[[Float], Evaluated],
    store: Store,
    budget: int,
    on_batch: Callable[[Progress], None] | None = None,
    stop: Callable[[], bool] | None = None,
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
    the run was killed.

    Args:
        algorithm: new, made with the run's seed and settings.
        decode: ``(n, n_var)`` unit-cube rows → X ``(n, len(store.parameters))``; each row's
            result depends on that row alone.
        evaluate: X → metrics, F, critical and status of its rows; may contain NaN and ±inf.
        store: open for writing.
        budget: evaluations in the store at the end.
        on_batch: called after each batch with new evaluations, recorded or replayed; those that a
            restored algorithm knows come a few thousand at a time.
        stop: called before each batch; True ends the loop.

    Returns:
        The end of the loop. Ctrl-C ends it, too; finished batches are in the store by then.

    Raises:
        StorageError: the store cannot be written, or was made by another version or other inputs.
    """
    n_before = len(store)
    session = _Session(algorithm, decode, evaluate, store, budget, on_batch)
    reason: Reason | None = Reason.BUDGET if n_before >= budget else None
    try:
        if reason is None:
            session.restore()
        while reason is None:
            reason = Reason.STOPPED if stop is not None and stop() else session.batch()
        if reason.final and store.finished != reason:
            store.finish(reason)
    except KeyboardInterrupt:
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


class _Session:
    """One call of the loop: the known rows, and its progress."""

    def __init__(
        self,
        algorithm: Algorithm,
        decode: Callable[[Float], Float],
        evaluate: Callable[[Float], Evaluated],
        store: Store,
        budget: int,
        on_batch: Callable[[Progress], None] | None,
    ) -> None:
        self.batches = self.repeated = 0
        self._algorithm, self._decode, self._evaluate = algorithm, decode, evaluate
        self._store, self._budget, self._on_batch = store, budget, on_batch
        self._recorded, self._seconds_before = len(store), store.seconds
        self._began: float | None = None
        self._known = KnownRows()
        self._log = ResultLog(store.n_obj, len(store.metrics))
        self._idle = 0

    @property
    def seconds(self) -> float:
        """Duration of the run [s]; the replay does not count."""
        running = 0.0 if self._began is None else time.perf_counter() - self._began
        return self._seconds_before + running

    def restore(self) -> None:
        """Restore the algorithm's saved state, if there is one; later rows are replayed."""
        algorithm, saved = self._algorithm, self._store.checkpoint()
        if saved is None or not isinstance(algorithm, Restorable):
            return
        for rows in self._store.rows(0, saved.evaluations):
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
        done = len(self._known)
        if done >= self._recorded:
            self._start_clock()
        U = self._ask()
        if len(U) == 0:
            return self._nothing_new(Reason.EXHAUSTED)
        # No −0.0: SQLite would lose its sign, and a row is simulated as it is recorded.
        X = as_float("X", self._decode(U), (len(U), len(self._store.parameters))) + 0.0
        ids, fresh = self._known.add(X, self._budget)
        old = fresh[: max(0, self._recorded - done)]
        for rows, take in ((old, self._replay), (fresh[len(old) :], self._simulate)):
            if rows:
                self._log.add(take(U[rows], X[rows], int(ids[rows[0]])))
        self.batches += 1
        self.repeated += int(np.count_nonzero(ids >= 0)) - len(fresh)
        if len(self._known) >= self._budget:
            # The budget may have cut this batch short, and it is the last one.
            if isinstance(self._algorithm, TakesNotes):
                self._algorithm.tell(U, self._log.results(ids))
            return Reason.BUDGET

        self._algorithm.tell(U, self._log.results(ids))
        self._idle = 0 if fresh else self._idle + 1
        if len(self._known) >= self._recorded:
            self._save()
        return self._nothing_new(Reason.CONVERGED) if self._idle >= PATIENCE else None

    def keep_notes(self) -> None:
        """Record the algorithm's notes, once it has got all results of the store."""
        if (
            isinstance(self._algorithm, TakesNotes)
            and self.batches
            and len(self._known) >= self._recorded
        ):
            self._store.keep_notes(self._algorithm.notes())

    def _save(self) -> None:
        if isinstance(self._algorithm, Restorable):
            self._store.save(Checkpoint(len(self._known), self._idle, self._algorithm.state()))

    def _ask(self) -> Float:
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
        differ = np.argwhere(now != then)
        if len(differ):
            k, j = (int(i) for i in differ[0])
            detail = f"{name}[{j}] is {float(now[k, j])}, recorded {float(then[k, j])}"
            raise self._other(f"evaluation {start + k}: {detail}")

    def _simulate(self, U: Float, X: Float, start: int) -> Evaluated:
        """Evaluate new rows and record them."""
        self._start_clock()
        result = self._evaluate(X)
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
        if len(self._known) < self._recorded:
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
