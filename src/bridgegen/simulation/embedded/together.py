"""Rows in which the ego's driver drives further vehicles: one batch for each of them, in lock-step.

Each is the ego of a batch of its own: the same storyboard, compiled with the two in each other's
places. So all that concerns an ego concerns it by the same code. At every instant each batch moves
its ego; then all take over where the other egos are, and move the rest, which is the same in all.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.simulation.embedded import _memory_kernels as memory
from bridgegen.simulation.embedded import _rollout_kernels as kernels
from bridgegen.simulation.embedded.batch import Batch
from bridgegen.simulation.embedded.co_simulation import Demand
from bridgegen.simulation.rollout import Rollout


class Together(Batch):
    """A batch, and those in which its further driven vehicles are the ego; see `Batch`.

    A row ends when it ends for the ego. A further vehicle whose route has ended before goes on
    along its road at the speed that it has. If its row fails, the row has failed.

    Args:
        partners: these batches; and what makes what asks the driver, once a batch has started.
        arguments: see `Batch`.
    """

    def __init__(
        self, partners: Sequence[tuple[Batch, Callable[[], Demand]]], *arguments: Any
    ) -> None:
        super().__init__(*arguments)
        self._wheels = [wheel for _, wheel in partners]
        self._batches: list[Batch] = [self, *(batch for batch, _ in partners)]
        self._egos = [self._program.names.index(each._program.names[0]) for each in self._batches]

    def run(self, simulate_rows: Callable[..., Any] | None = None) -> Rollout:
        """See `Batch`: by one instant at a time."""
        self.start()
        for k in range(self.record.x.shape[2]):
            if self.running.any():
                self.before_driver(k)
                self.after_driver(k, *self.demand(k))
        return self.rollout()

    def start(self) -> None:
        """See `Batch`."""
        for batch in self._batches:
            Batch.start(batch)
        self._agree(0)
        self._asks = [wheel() for wheel in self._wheels] if self.running.any() else []

    def before_driver(self, k: int) -> None:
        """See `Batch`."""
        for batch in self._batches:
            Batch.before_driver(batch, k)

    def after_driver(self, k: int, demanded: Float, curvature: Float) -> None:
        """See `Batch`; the further vehicles' drivers are asked, too."""
        demands = [(demanded, curvature), *(ask(k) for ask in self._asks)]
        for batch, demand in zip(self._batches, demands, strict=True):
            batch._do(kernels.move_driven_rows, k, *demand)
        driven = np.stack([_motion(batch, k) for batch in self._batches], axis=1)
        for ego, batch in zip(self._egos, self._batches, strict=True):
            given = driven[:, [e != ego for e in self._egos]]
            given[:, :, 7] = [e or ego for e in self._egos if e != ego]  # it has the ego's place
            batch._do(kernels.move_others_rows, k, given)
        self._agree(k)

    def fail(self, status: int, message: str) -> None:
        """See `Batch`."""
        for batch in self._batches:
            Batch.fail(batch, status, message)

    def rollout(self) -> Rollout:
        """See `Batch`; with the rollouts of the further vehicles."""
        return replace(super().rollout(), egos=tuple(b.rollout() for b in self._batches[1:]))

    def _agree(self, k: int) -> None:
        """Have rows end together at instant k, and note whose drivers still drive."""
        status = np.max([batch.state.ending[:, memory.STATUS] for batch in self._batches], axis=0)
        for batch in self._batches:
            failed = status > memory.OK
            batch.state.ending[failed, memory.STATUS] = status[failed]
            _end(batch, batch.running & (failed | ~self.running), k)
        after = min(k + 1, self.record.x.shape[2] - 1)
        for ego, batch in zip(self._egos, self._batches, strict=True):
            for e, other in zip(self._egos, self._batches, strict=True):
                if e != ego:
                    at, state = e or ego, batch.state
                    over = state.given[:, at] & ~other.running
                    state.target[over, at] = batch.record.v[over, at, after]
                    state.command[over, at] = state.target[over, at]
                    state.given[:, at] = other.running


def _motion(batch: Batch, k: int) -> Float:
    """Return how the egos of a batch move on from instant k, and room, ``(N, 8)``; see `take`."""
    record, state, after = batch.record, batch.state, min(k + 1, batch.record.x.shape[2] - 1)
    there = [array[:, 0, after] for array in (record.x, record.y, record.h, record.v)]
    more = (state.travelled[:, 0], state.stood[:, 0], np.zeros(len(record.x)))
    return np.stack([*there, record.a[:, 0, k], *more], axis=1)


def _end(batch: Batch, rows: Bool, k: int) -> None:
    """End rows ``(N,)`` of a batch at instant k, which is repeated."""
    batch.state.ending[rows, memory.N_STEPS] = k + 1
    for array in batch.record:
        if rows.any() and array.ndim > 2 and array.shape[2]:
            array[rows, :, k + 1 :] = array[rows, :, k : k + 1]
