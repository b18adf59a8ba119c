"""Rows that a driver in Python drives: all by one instant, then all by the next.

Where the driver fails, the rows that it was driving are halved and begun again, until one is left
that it cannot drive. So a failure costs the row that it belongs to, whatever the batch.
"""

from collections.abc import Callable
from dataclasses import replace
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.drivers import mirror
from bridgegen.drivers._ghost_kernels import WHAT
from bridgegen.drivers._tracking_kernels import TRACK
from bridgegen.drivers._weather_columns import STATED
from bridgegen.drivers.compiled import CONFLICT
from bridgegen.drivers.driver_process import DriverError, DriverProcess
from bridgegen.drivers.interface import (
    CONFLICT_WAYS,
    NEAR_PIECES,
    ROUTE_POINTS,
    ROUTE_STEP,
    Observation,
    Scene,
)
from bridgegen.drivers.trajectory import Follower, Plans
from bridgegen.simulation.embedded.batch import Batch
from bridgegen.simulation.embedded.drivers import LANES, MEMORY
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.rollout import FAILURES, Rollout, joined

Note = Callable[[int, Plans, Bool], None]
"""Function that takes the instant at which plans were made, these, and ``(N,)`` which rows ran."""


def drive_in_lock_step(
    program: Program,
    setup: Callable[[Int], Batch],
    n: int,
    driver: DriverProcess,
    is_stopped: Callable[[], bool] = lambda: False,
    note: Callable[[Int], Note] | None = None,
) -> Rollout:
    """Roll out rows 0 … n − 1 with a user's driver.

    Args:
        program: the compiled storyboard.
        setup: makes a batch of some of the rows.
        n: how many there are.
        driver: the user's own; its process is started if it is not running.
        is_stopped: returns whether it has been stopped from elsewhere.
        note: returns what takes the plans of some of the rows. Where the driver fails, rows are
            driven again.

    Raises:
        DriverError: it has been stopped.
        InputError: the driver cannot be made.
    """
    parts: list[tuple[Int, Rollout]] = []
    driver.start()
    waiting = _batches(n, driver.traits.max_rows)
    while waiting:
        rows = waiting.pop()
        batch = setup(rows)
        try:
            _together(program, batch, driver, note(rows) if note else None)
        except DriverError as error:
            if is_stopped():
                raise
            if len(rows) > 1:
                half = len(rows) // 2
                # The rows were asked about together, so the one that fails is not known.
                waiting += [rows[half:], rows[:half]]
                continue
            batch.fail(FAILURES[error.kind], str(error))
        parts.append((rows, batch.rollout()))
    if len(parts) == 1:
        return parts[0][1]
    return joined(parts)


def _batches(n: int, most: int | None) -> list[Int]:
    """Return rows 0 … n − 1 in batches of at most so many, the last batch first."""
    if most is None or n <= most:
        return [np.arange(n)]
    return [np.arange(at, min(at + most, n)) for at in range(0, n, most)][::-1]


def _together(program: Program, batch: Batch, driver: DriverProcess, note: Note | None) -> None:
    """Drive a batch from its first instant to its last.

    Raises:
        DriverError: the driver failed; the batch stands where it did.
    """
    batch.start()
    if not batch.running.any():
        return
    wheel = Wheel(program, batch, driver, note)
    for k in range(program.n_steps):
        if not batch.running.any():
            return
        batch.before_driver(k)
        batch.after_driver(k, *wheel.demand(k))


class Wheel:
    """A driver in Python at the wheel of a batch that has started.

    It is asked once per period; meanwhile its control is held, or its plan is followed.

    Args:
        program: the compiled storyboard.
        batch: which has started.
        driver: the user's own.
        note: takes the plans that it makes.

    Raises:
        DriverError: the driver failed.
    """

    def __init__(
        self, program: Program, batch: Batch, driver: DriverProcess, note: Note | None = None
    ) -> None:
        n, m = len(batch.running), len(program.names) - 1 + len(program.ghosts)
        self._time_step, self._batch, self._driver = program.time_step, batch, driver
        self._route, self._tracks = np.zeros((n, ROUTE_POINTS, 4)), np.zeros((n, m, TRACK))
        self._stop, self._light = np.full(n, np.inf), np.zeros(n, dtype=np.int8)
        driver.start()
        self._note = note
        self._every, self._asked = driver.traits.steps(program.time_step), 0
        self._answer: tuple[Float, ...] | Follower
        self._missed: list[Float] = []
        self._wants = wants = driver.traits.wants
        self._scene = _scene(program)
        if "map" in wants:
            maps, map_of = batch.maps()
            if batch.left_hand:
                maps = tuple(map(mirror.road_map, maps))
            self._scene = replace(self._scene, maps=maps, map_of=map_of)
            self._nearby, self._places = np.zeros((n, MEMORY)), np.full((n, 1 + NEAR_PIECES), -1)
        if "seed" in wants:
            self._scene = replace(self._scene, seed=batch.seeds)
        self._views: dict[str, npt.NDArray[Any]] = {}
        if "lanes" in wants:
            self._views["lanes"] = np.zeros((n, LANES))
        if "conflicts" in wants:
            shape = (n, m, CONFLICT_WAYS, CONFLICT.itemsize // 8)
            self._views["conflicts"] = np.full(shape, np.nan)
        driver.reset(n, self._scene)

    def demand(self, k: int) -> tuple[Float, Float]:
        """Return what it demands at instant k: ``(N,)`` [m/s²] and ``(N,)`` [1/m].

        Args:
            k: each instant in order, from 0 on.

        Raises:
            DriverError: it failed.
        """
        batch, record = self._batch, self._batch.record
        # At every instant, though the driver is asked once a period: sensors look on, and tracks
        # have no gaps.
        batch.observe(k, ROUTE_STEP, self._route, self._tracks, self._stop, self._light)
        if k % self._every == 0:
            answer, self._asked = self._ask(k), k
            if isinstance(answer, Plans):
                # Here, not in the driver's process: between two calls nothing is sent, and each row
                # is followed by itself, so that its bits do not depend on the batch.
                self._answer = Follower(answer, self._time_step)
                if self._note:
                    self._note(k, answer, batch.running)
            else:
                self._answer = answer[:2]
                for demand in answer[2:]:
                    batch.note_demands(k, demand)
        elif "history" in self._wants:
            self._missed.append(self._tracks.copy())
        if not isinstance(self._answer, Follower):
            acceleration, curvature = self._answer
            return acceleration, curvature
        since = (k - self._asked) * self._time_step
        ego = [array[:, 0, k] for array in (record.x, record.y, record.h, record.v)]
        return self._answer.demand(since, np.stack(ego, axis=1), batch.running)

    def _ask(self, k: int) -> tuple[Float, ...] | Plans:
        """Ask the driver at instant k.

        Raises:
            DriverError: it failed.
        """
        self._look(k)
        batch, record, state = self._batch, self._batch.record, self._batch.state
        x, y, h, v = (array[:, 0, k] for array in (record.x, record.y, record.h, record.v))
        observation = Observation(
            time=k * self._time_step,
            running=batch.running,
            x=x,
            y=y,
            h=h,
            v=v,
            a=record.a[:, 0, k - 1] if k else np.zeros(len(x)),
            target_speed=state.command[:, 0],
            offset=state.aside[:, 0] if state.beside.size else record.offset[:, 0, k],
            route=self._route,
            tracks=self._tracks,
            stop_distance=self._stop,
            light=self._light,
            weather=state.weather[:, :STATED],
        )
        takes_two = self._driver.traits.max_rows != 1
        if len(x) == 1 and takes_two and not self._driver.answers_each_row:
            self._try_two(observation)
        if not batch.left_hand:
            return self._driver.act(observation, self._views)
        seen = mirror.observation(observation)
        return mirror.answer(self._driver.act(seen, mirror.views(self._views)))

    def _look(self, k: int) -> None:
        """Fill the views of instant k."""
        batch, views = self._batch, self._views
        if self._missed:
            views["missed"] = np.stack(self._missed, axis=1)
            self._missed = []
        if "lanes" in self._wants:
            batch.see_lanes(views["lanes"])
        if "map" in self._wants:
            batch.see_map(k, self._nearby, self._places)
            views["map"] = self._places.astype(np.int32)
            views["lights"] = batch.state.lights
        if "conflicts" in self._wants:
            batch.see_conflicts(k, views["conflicts"])

    def _try_two(self, observation: Observation) -> None:
        """Show the only row twice: one answer for all rows has the right shape for one row.

        Raises:
            DriverError: it failed.
        """
        scene = self._scene
        both = replace(scene, map_of=np.repeat(scene.map_of, 2), seed=np.repeat(scene.seed, 2))
        self._driver.reset(2, both)
        twice = {word: np.repeat(view, 2, axis=0) for word, view in self._views.items()}
        seen = observation.take(np.zeros(2, dtype=np.int64))
        if self._batch.left_hand:
            seen, twice = mirror.observation(seen), mirror.views(twice)
        self._driver.act(seen, twice)
        self._driver.reset(1, self._scene)


def _scene(program: Program) -> Scene:
    sizes: Any = (float(value) for value in program.bodies[0, :7])
    names = program.names[1:] + tuple(f"ghost_{g + 1}" for g in range(len(program.ghosts)))
    kinds = np.concatenate((program.kinds[1:], program.ghosts[:, WHAT]))
    return Scene(program.time_step, program.n_steps, names, kinds, *sizes)
