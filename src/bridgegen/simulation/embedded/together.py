"""Rows in which the ego's driver drives further vehicles: one batch for each of them, in lock-step.

Every vehicle that it drives is the ego of a batch of its own: the same storyboard, compiled with
the two in each other's places. So all that concerns an ego (its driver, sensors, route, vehicle,
and in the end the analysis of its conflicts) concerns each of them, by the same code. At every
instant each batch moves its ego; then the egos' motion is exchanged, and all else moves.
"""

from collections.abc import Callable, Sequence
from dataclasses import replace
from typing import Any, NamedTuple

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.simulation.embedded import _memory_kernels as memory
from bridgegen.simulation.embedded import _rollout_kernels as kernels
from bridgegen.simulation.embedded import drivers
from bridgegen.simulation.embedded.batch import Batch, _put_back, _taken
from bridgegen.simulation.rollout import Rollout

Demand = Callable[[int], tuple[Float, Float]]
"""Function that returns the demands of an ego's driver at an instant, ``(N,)`` [m/s²], [1/m]."""


class Partner(NamedTuple):
    """A further vehicle that the ego's driver drives.

    Attributes:
        entity: its number.
        batch: in which it has changed places with the ego.
        wheel: makes what asks its driver, once the first instant is set; None: the compiled one.
    """

    entity: int
    batch: Batch
    wheel: Callable[[Batch], Demand] | None


class Together(Batch):
    """A batch, and those in which its other driven vehicles are the ego; see `Batch`.

    A row ends when it ends for the ego. A further vehicle whose route has ended before goes on
    along its road at the speed that it has, as the storyboard's. If the driver of one fails, or
    its row does, the row has failed.

    Args:
        partners: the further vehicles.
        arguments: see `Batch`.
    """

    def __init__(self, partners: Sequence[Partner], *arguments: Any) -> None:
        super().__init__(*arguments)
        self._partners = tuple(partners)
        self._batches: tuple[Batch, ...] = (self, *(partner.batch for partner in partners))
        self._entities = (0, *(partner.entity for partner in partners))
        self._asks: list[Demand] = []

    def run(self, simulate_rows: Callable[..., Any] | None = None) -> Rollout:
        """See `Batch`: by one instant at a time."""
        self.start()
        for k in range(self.record.x.shape[2]):
            if not self.running.any():
                break
            self.before_driver(k)
            self.after_driver(k, *self.demand(k))
        return self.rollout()

    def start(self) -> None:
        """See `Batch`."""
        for batch in self._batches:
            Batch.start(batch)
        self._agree(0)
        if self.running.any():
            self._asks = [
                partner.wheel(partner.batch) if partner.wheel else partner.batch.demand
                for partner in self._partners
            ]

    def before_driver(self, k: int) -> None:
        """See `Batch`."""
        for batch in self._batches:
            Batch.before_driver(batch, k)

    def after_driver(self, k: int, demanded: Float, curvature: Float) -> None:
        """See `Batch`; the further vehicles' drivers are asked, too."""
        demands = [(demanded, curvature), *(ask(k) for ask in self._asks)]
        for batch, demand in zip(self._batches, demands, strict=True):
            batch._do(kernels.move_driven_rows, k, *demand)
        after = min(k + 1, self.record.x.shape[2] - 1)
        driven = np.stack([_motion(batch, k, after) for batch in self._batches], axis=1)
        for i, batch in enumerate(self._batches):
            others = [b for b in range(len(self._batches)) if b != i]
            given = driven[:, others]
            given[:, :, 7] = [self._place(i, self._entities[b]) for b in others]
            batch._do(kernels.take_rows, k, given)
        for batch in self._batches:
            batch._do(kernels.move_others_rows, k)
        self._agree(k)
        if after > k:
            self._follow(after)

    def fail(self, status: int, message: str) -> None:
        """See `Batch`."""
        for batch in self._batches:
            Batch.fail(batch, status, message)

    def standing(self) -> Rollout:
        """See `Batch`."""
        for partner in self._partners:
            partner.batch.standing()
        return super().standing()

    def rollout(self) -> Rollout:
        """See `Batch`; with the rollouts of the further vehicles."""
        egos = tuple(partner.batch.rollout() for partner in self._partners)
        return replace(super().rollout(), egos=egos)

    def _place(self, batch: int, entity: int) -> int:
        """Return the number that an entity has in one of the batches."""
        ego = self._entities[batch]
        return {0: ego, ego: 0}.get(entity, entity)

    def _agree(self, k: int) -> None:
        """Have rows end together at instant k, and note whose drivers still drive."""
        own = self.state.ending
        for partner in self._partners:
            other = partner.batch.state.ending
            failed = self.running & (other[:, memory.STATUS] > memory.OK)
            self._messages |= {
                row: f"{partner.batch._program.names[0]}: {text}"
                for row, text in partner.batch._messages.items()
                if failed[row]
            }
            own[failed, memory.STATUS] = other[failed, memory.STATUS]
            _end(self, failed, k)
        for partner in self._partners:
            batch, ending = partner.batch, partner.batch.state.ending
            _end(batch, ~self.running & batch.running, k)
            ending[~self.running, memory.STATUS] = own[~self.running, memory.STATUS]
        last = self.record.x.shape[2] - 1
        for i, batch in enumerate(self._batches):
            for b, there in enumerate(self._batches):
                if b == i:
                    continue
                e, state = self._place(i, self._entities[b]), batch.state
                over = state.given[:, e] & ~there.running
                speed = batch.record.v[over, e, min(k + 1, last)]
                state.command[over, e] = state.target[over, e] = speed
                state.given[:, e] = there.running

    def _follow(self, k: int) -> None:
        """Put bodies that no driver drives where they are in the first batch.

        They are there already, unless a condition that asks for a place along a path was rounded
        otherwise, and an event began one instant sooner or later.
        """
        bodies = np.setdiff1d(np.arange(self.record.x.shape[1]), self._entities)
        poses = _poses(self, bodies, k)
        for partner in self._partners:
            batch = partner.batch
            differs: Bool = (_poses(batch, bodies, k) != poses).any(axis=(1, 2))
            some: Int = np.flatnonzero(differs & batch.running)
            if some.size:
                state, record = _taken(batch.state, some), _taken(batch.record, some)
                tables, rows = batch._roads.tables, batch._rows[some]
                drivers.impose_rows(k, bodies, poses[some], batch.plan, tables, rows, state, record)
                _put_back(batch.state, state, some)
                _put_back(batch.record, record, some)


def _motion(batch: Batch, k: int, after: int) -> Float:
    """Return how the egos of a batch move on from instant k, ``(N, 8)``; see ``take``.

    The last column is room for the number that they have elsewhere.
    """
    record, state = batch.record, batch.state
    parts = [array[:, 0, after] for array in (record.x, record.y, record.h, record.v)]
    more = record.a[:, 0, k], state.travelled[:, 0], state.stood[:, 0], state.stood[:, 0]
    return np.stack([*parts, *more], axis=1)


def _poses(batch: Batch, bodies: Int, k: int) -> Float:
    record = batch.record
    arrays = (record.x, record.y, record.h, record.v)
    return np.stack([array[:, bodies, k] for array in arrays], axis=2)


def _end(batch: Batch, rows: Bool, k: int) -> None:
    """End rows ``(N,)`` of a batch at instant k, which is repeated."""
    if not rows.any():
        return
    batch.state.ending[rows, memory.N_STEPS] = k + 1
    record = batch.record
    motion = (record.x, record.y, record.h, record.v, record.a, record.offset)
    for array in (*motion, record.lights, record.lamps, record.present):
        if array.shape[2]:
            array[rows, :, k + 1 :] = array[rows, :, k : k + 1]
