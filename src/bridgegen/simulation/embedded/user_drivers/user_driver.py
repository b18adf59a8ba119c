"""The user's own driver in the simulator: in lock-step if it is Python, else in the rollout.

A compiled driver is called by the compiled rollout, in a process of its own for each thread that
asks for rollouts: what it does to its memory, or an endless loop, ends that process alone.
"""

import sys
import threading
import traceback
from collections.abc import Callable
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import call_from_python
from bridgegen.drivers import Driver
from bridgegen.drivers.driver_process import START_SECONDS, DriverError, DriverProcess
from bridgegen.drivers.trajectory import Plans
from bridgegen.drivers.user_drivers import Traits
from bridgegen.simulation.embedded._memory_kernels import (
    N_STEPS,
    NO_CONTROL,
    RAISED,
    STATUS,
    Plan,
    Record,
    Roads,
    State,
)
from bridgegen.simulation.embedded._rollout_kernels import simulate_rows
from bridgegen.simulation.embedded.addresses import addressed, here
from bridgegen.simulation.embedded.batch import Batch
from bridgegen.simulation.embedded.drivers import (
    ACCELERATION,
    ANSWER,
    CURVATURE,
    EGO,
    RETURNED,
    ask,
)
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.embedded.user_drivers.lock_step import Note, Wheel, drive_in_lock_step
from bridgegen.simulation.embedded.user_drivers.shared_arrays import Layout, SharedArrays, seen
from bridgegen.simulation.rollout import FAILURES, Rollout, joined


class OwnDriver:
    """A driver of the user's own, and the processes that it lives in.

    Args:
        driver: it.
    """

    def __init__(self, driver: Driver) -> None:
        self._driver = driver
        self._lock, self._turn = threading.Lock(), threading.Lock()
        self._first = self._seat()
        self._idle, self._seats = [self._first], [self._first]
        self._is_stopped = threading.Event()
        self._is_known = False

    @property
    def traits(self) -> Traits:
        """What the driver says of itself.

        Raises:
            InputError: the driver cannot be made.
        """
        with self._lock:
            if not self._is_known:
                self._first.process.start()
                self._is_known = True
        return self._first.process.traits

    def drive(self, program: Program, setup: Callable[[Int], Batch], n: int) -> Rollout:
        """Roll out rows 0 … n − 1.

        Args:
            program: the compiled storyboard.
            setup: makes a batch of some of the rows.
            n: how many there are.

        Raises:
            InputError: the driver cannot be made.
        """
        if self.traits.memory is None:
            with self._turn:  # it is one, and has all rows at once
                self._first.process.settings = program.driver.settings
                return drive_in_lock_step(
                    program, setup, n, self._first.process, self._is_stopped.is_set
                )
        with self._lock:
            # A process for each thread that drives at the same time: a compiled loop cannot be
            # interrupted, and code that writes where it should not takes its process down.
            if not self._idle:
                self._idle.append(self._seat())
                self._seats.append(self._idle[0])
            seat = self._idle.pop()
        seat.process.settings = program.driver.settings
        try:
            return _drive(setup, n, seat, self._is_stopped.is_set)
        finally:
            with self._lock:
                self._idle.append(seat)

    @property
    def process(self) -> DriverProcess:
        """The process of one in Python; of a compiled one, the first."""
        return self._first.process

    def restart(self) -> None:
        """End its processes; others begin when it drives next. Nothing may be driven meanwhile."""
        with self._lock:
            for seat in self._seats:
                seat.close()

    @property
    def has_planned(self) -> bool:
        """Whether it has answered a trajectory so far."""
        return "trajectory" in self._first.process.answers

    def plans(
        self, program: Program, setup: Callable[[Int], Batch], n: int
    ) -> tuple[dict[int, Float], ...]:
        """Drive rows 0 … n − 1 again; return the trajectories of each by the instant of the call.

        Args:
            program: as of ``drive``, and so are those that follow.
            setup: likewise.
            n: likewise.
        """
        found: tuple[dict[int, Float], ...] = tuple({} for _ in range(n))

        def note(rows: Int) -> Note:
            def keep(k: int, plans: Plans, running: Bool) -> None:
                for i in np.flatnonzero(running).tolist():
                    found[rows[i]][k] = plans.states[i]

            return keep

        with self._turn:
            self._first.process.settings = program.driver.settings
            drive_in_lock_step(
                program, setup, n, self._first.process, self._is_stopped.is_set, note
            )
        return found

    def wheel(self, program: Program, batch: Batch) -> Callable[[int], tuple[Float, Float]]:
        """Return what asks the driver at an instant of a batch of one row that has started.

        Raises:
            InputError: the driver cannot be made.
            DriverError: it failed as it began, or when it is asked.
        """
        self._first.process.settings = program.driver.settings
        if self.traits.memory is None:
            return Wheel(program, batch, self._first.process).demand
        return partial(_ask, self._first.process, batch)

    def stop(self) -> None:
        """End the processes: what is being driven ends in a `DriverError`, and nothing follows."""
        self._is_stopped.set()
        with self._lock:
            for seat in self._seats:
                seat.process.kill()

    def _seat(self) -> "Seat":
        driver = self._driver
        return Seat(DriverProcess(driver.spec, driver.time_limit, driver.settings))


class Seat:
    """A process in which a compiled driver drives, and the arrays that it shares with this one."""

    def __init__(self, process: DriverProcess) -> None:
        self.process = process
        self._arrays = SharedArrays()
        self._roads: Roads | None = None  # those that it has been sent

    def simulate_rows(
        self, plan: Plan, roads: Roads, rows: Int, state: State, record: Record
    ) -> dict[int, str]:
        """Have the kernel of this name run there; return messages by row.

        Raises:
            DriverError: the driver timed out or died; ``ending`` holds which rows had ended.
        """
        if self._roads is None:
            self._begin(plan, roads, state, record)
        whole: tuple[np.ndarray, ...] = (*state, *record)
        layout, views = self._arrays.put(whole)
        ending = views[State._fields.index("ending")]

        # Rows that have ended are the progress: the time limit is for one row, not for the batch.
        def ended() -> int:
            return int(np.count_nonzero(ending[:, N_STEPS]))

        sent = None if roads is self._roads else roads
        # A process that has died takes the road networks with it.
        self._roads = None  # until it is known to have them
        try:
            messages: dict[int, str] = self.process.call(
                _simulate, layout, plan, sent, rows, progress=ended
            )
        except DriverError:
            state.ending[:] = ending
            raise
        self._roads = roads
        for array, view in zip(whole, views, strict=True):
            array[...] = view
        return messages

    def close(self) -> None:
        """End the process; the next one is sent the road networks again."""
        self.process.close()
        self._roads = None

    def _begin(self, plan: Plan, roads: Roads, state: State, record: Record) -> None:
        """Let the kernel be compiled here, if need be, and loaded there: no driver's time."""
        rows = np.zeros(0, dtype=np.int64)
        states: Any = [array[:0] for array in state]
        records: Any = [array[:0] for array in record]
        simulate_rows(plan, roads, rows, State(*states), Record(*records))
        here(plan, roads, State(*states), Record(*records))(ask)
        layout, _ = self._arrays.put((*states, *records))
        self.process.start()
        self.process.call(_simulate, layout, plan, roads, rows, seconds=START_SECONDS)
        self._roads = roads


def _drive(
    setup: Callable[[Int], Batch], n: int, seat: Seat, is_stopped: Callable[[], bool]
) -> Rollout:
    """Roll rows out with a compiled driver; one that it does not bring to an end costs itself.

    Raises:
        DriverError: it has been stopped.
    """
    parts: list[tuple[Int, Rollout]] = []
    waiting = [np.arange(n)]
    while waiting:
        rows = waiting.pop()
        batch = setup(rows)
        try:
            parts.append((rows, batch.run(seat.simulate_rows)))
        except DriverError as error:
            if is_stopped():
                raise
            # So the first that has not ended is the one that hung or crashed, and no halving is
            # needed.
            at = int(np.argmax(batch.running))  # they are driven one after the other
            waiting += [each for each in (rows[at + 1 :], rows[:at]) if len(each)]
            culprit = setup(rows[at : at + 1])
            culprit.start()
            culprit.fail(FAILURES[error.kind], str(error))
            parts.append((rows[at : at + 1], culprit.rollout()))
    return parts[0][1] if len(parts) == 1 else joined(parts)


def _ask(process: DriverProcess, batch: Batch, k: int) -> tuple[Float, Float]:
    """Ask a compiled driver at one instant of one row.

    Raises:
        DriverError: it failed.
    """
    batch.fill_inputs(k)
    state = batch.state
    answer, memory, raised = process.call(
        _answer,
        state.inputs[0],
        state.ahead[0],
        state.others[0],
        state.mind[0],
        state.lanes[0],
        batch.pieces,
        state.place[0],
        state.signals[0],
        state.conflicts[0],
        state.tracked[0],
    )
    if answer[RETURNED] == 0.0:
        raise DriverError("raised", raised)
    if problem := _not_finite(answer):
        raise DriverError("answered nonsense", problem)
    state.mind[0] = memory
    return answer[[ACCELERATION]], answer[[CURVATURE]]


def _not_finite(answer: Float) -> str | None:
    """Return the problem with an answer."""
    for name, column in (("acceleration", ACCELERATION), ("curvature", CURVATURE)):
        if not np.isfinite(answer[column]):
            return f"{name} must be finite, got {answer[column]}"
    return None


# --- In the other process -------------------------------------------------------------------------

_roads: list[Roads] = []
"""The road networks that were sent last."""


def _simulate(
    address: int, layout: Layout, plan: Plan, roads: Roads | None, rows: Int
) -> dict[int, str]:
    """Roll out the rows whose arrays are shared; return messages by row that failed."""
    if roads is not None:
        _roads[:] = [roads]
    arrays: Any = seen(layout)
    state, record = State(*arrays[: len(State._fields)]), Record(*arrays[len(State._fields) :])
    raised: list[str] = []
    # What a C callback raises cannot reach its caller; Python hands it to this hook.
    sys.unraisablehook = lambda error: raised.append(_described(error))
    try:
        plan = addressed(plan, ask, here(plan, _roads[0], state, record))
        plan = plan._replace(own_code=address)
        simulate_rows(plan, _roads[0], rows, state, record)
    finally:
        sys.unraisablehook = sys.__unraisablehook__
    status = state.ending[:, STATUS]
    messages = dict(zip(np.flatnonzero(status == RAISED).tolist(), raised, strict=False))
    for row in np.flatnonzero(status == NO_CONTROL).tolist():
        if problem := _not_finite(state.answer[row]):
            messages[row] = problem
    return messages


def _answer(
    address: int, inputs: Float, ahead: Float, others: Float, memory: Float, *wanted: Float
) -> tuple[Float, Float, str]:
    """Ask the driver; return its answer, what it keeps, and what it raised."""
    answer = np.zeros(ANSWER)
    raised: list[str] = []
    sys.unraisablehook = lambda error: raised.append(_described(error))
    try:
        call_from_python(
            address, (inputs[EGO:], inputs[:EGO], ahead, others, memory, answer, *wanted)
        )
    finally:
        sys.unraisablehook = sys.__unraisablehook__
    return answer, memory, "".join(raised)


def _described(unraisable: Any) -> str:
    """Return in one line what a compiled driver raised; numba knows the line of most."""
    error, here = unraisable.exc_value, Path(__file__).name
    for place in reversed(traceback.extract_tb(unraisable.exc_traceback)):
        if Path(place.filename).name != here:
            return f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"
    return f"{type(error).__name__}: {error}"
