"""One row: esmini runs the storyboard, and BridgeGen's drivers drive the ego and others in it.

At instant k the states of all participants are known. The drivers compute the next states of their
vehicles; esmini evaluates its conditions at k and moves all participants, in steps that may be
finer than the scenario's. Between two instants the states of driven vehicles are interpolated.

Actions of driven participants are executed by the embedded simulator's storyboard: esmini regards
them as complete at once.
"""

import math
from collections.abc import Callable, Sequence
from pathlib import Path

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.simulation.embedded.co_simulation import CoSimulation
from bridgegen.simulation.esmini.library import Library

SAME = 1e-3
"""Difference below which sizes are equal [m]."""

SOON = 1e-6
"""Tolerance of a time as a share of a step, for rounding."""


class EsminiError(Exception):
    """A scenario that esmini cannot run."""


def run_together(
    library: Library,
    scenario: Path,
    log: Path,
    joint: CoSimulation,
    *,
    driven: Sequence[int],
    boxes: Float,
    events: Sequence[str],
    steps: int,
    alive: Callable[[], None],
) -> None:
    """Run a row to its end; ``joint`` records it.

    Args:
        library: holds no scenario.
        scenario: the row's file.
        log: to be written.
        joint: the row, at its first instant.
        driven: the numbers of the entities that our drivers drive; esmini moves the others.
        boxes: ``(E, 3)`` [m]: length and width of each entity, and more.
        events: what esmini calls each event.
        steps: how many of esmini's make one of ours.
        alive: is called again and again, to say that it gets on.

    Raises:
        EsminiError: esmini does not take the scenario.
        DriverError: a driver of the user's own failed.
    """
    began: dict[str, float] = {}

    def begins(path: str) -> None:
        began.setdefault(path, library.time)

    try:
        if not library.begin(scenario, log, begins):
            raise EsminiError("esmini did not take the scenario")
        _Row(library, joint, driven, boxes, steps).run(alive)
    finally:
        library.close()
    last = int(joint.rollout().n_steps[0]) - 1
    for i, path in enumerate(events):
        if joint.is_ours(i, driven):
            continue
        joint.events[i] = -1
        if path in began:
            k = math.ceil(began[path] / joint.time_step - SOON)
            joint.events[i] = min(k, last)


class _Row:
    def __init__(
        self,
        library: Library,
        joint: CoSimulation,
        driven: Sequence[int],
        boxes: Float,
        steps: int,
    ) -> None:
        self._library, self._joint = library, joint
        self._driven, self._drives, self._steps = driven, 0 in driven, steps
        self._numbers = [library.number(name) for name in joint.names]
        self._ego = self._numbers[0]
        self._own_step = joint.time_step / steps
        # esmini runs the files, which drive on the left where ours is their mirror image.
        self._side = -1.0 if joint.left_hand else 1.0
        self._before = joint.states(0)
        for name, number, is_there in zip(
            joint.names, self._numbers, joint.present(0), strict=True
        ):
            if is_there and number < 0:
                raise EsminiError(f"esmini has no entity '{name}'")
        # A structure of another version would be read at the wrong places; sizes are at its end.
        if not np.allclose(library.size(self._ego), boxes[0, :2], atol=SAME):
            raise EsminiError(
                "the ego's size is not the file's: this is an esmini whose states are others than "
                "those of version 3"
            )

    def run(self, alive: Callable[[], None]) -> None:
        joint, library = self._joint, self._library
        for k in range(joint.n_steps):
            if not joint.runs:
                return
            alive()
            self._impose(k)
            joint.decide(k)
            is_through = self._drives and joint.stops and joint.is_through
            # esmini runs the storyboard, so its stop trigger counts, and not ours.
            joint.go_on()
            demand = joint.demand(k)
            if is_through or library.is_over:
                joint.end()
            elif k < joint.n_steps - 1:
                # For the present instant, before the step: esmini looks at conditions at the time
                # that is, and moves afterwards. So nothing lags.
                self._report(k, joint.states(k))
                library.step(self._own_step)
                if library.is_over:
                    joint.end()
            joint.move(k, *demand)
            if joint.runs and self._steps > 1:
                self._move_on(k)

    def _impose(self, k: int) -> None:
        """Pass the states of esmini's participants to the drivers."""
        bodies, states, present = [], [], []
        late = k * self._joint.time_step - self._library.time if self._library.is_over else 0.0
        there = self._joint.present(k)
        for e, name in enumerate(self._joint.names):
            if e in self._driven:
                present.append(bool(there[e]))
                continue
            state = self._library.state(self._numbers[e]) if self._numbers[e] >= 0 else None
            if state is None:
                self._numbers[e] = self._library.number(name)
                if self._numbers[e] >= 0:
                    state = self._library.state(self._numbers[e])
            present.append(state is not None)
            if state is not None:
                if not all(map(math.isfinite, state)):
                    raise EsminiError(f"a state of '{name}' became NaN or infinite")
                x, y, h, v = state[0], self._side * state[1], self._side * state[2], state[3]
                # Only with several steps, of which one may fire the stop trigger.
                way = v * late  # it stopped between two instants: they go on as they were going
                bodies.append(e)
                states.append(
                    (x + way * elementary.cos(h), y + way * elementary.sin(h), h, max(v, 0.0))
                )
        self._joint.impose_presence(k, present)
        self._joint.impose(k, bodies, states)

    def _move_on(self, k: int) -> None:
        """Step esmini to the next instant; it has made one step."""
        here, there = self._joint.states(k), self._joint.states(k + 1)
        for i in range(1, self._steps):
            self._report(k, here + i / self._steps * (there - here))
            self._library.step(self._own_step)
            if self._library.is_over:
                return  # seen at the next instant

    def _report(self, k: int, states: Float) -> None:
        """Pass the states of driven entities, ``(E, 4)``, to esmini."""
        there = self._joint.present(k)
        for e in self._driven:
            if there[e] and self._numbers[e] >= 0:
                x, y, h, v = states[e].tolist()
                *_, before_h, before_v = self._before[e].tolist()
                a, turn = (v - before_v) / self._own_step, (h - before_h) / self._own_step
                place = x, self._side * y, self._side * h
                self._library.report(self._numbers[e], *place, v, a, self._side * turn)
        self._before = states
