"""One scenario that another simulator runs, as the embedded one sees it: instant by instant.

The storyboard and the ego's driver work on the states that the other simulator imposes. Which of
their answers it takes is its own affair: one that runs the storyboard itself takes the ego's
motion, one that does not takes everybody's.
"""

from collections.abc import Callable, Collection, Sequence

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.simulation.embedded import _memory_kernels as memory
from bridgegen.simulation.embedded.batch import Batch
from bridgegen.simulation.rollout import Rollout

Demand = Callable[[int], tuple[Float, Float]]
"""Function that returns the demands of an ego's driver at an instant: ``(1,)`` [m/s²] and ``(1,)``
[1/m]."""


class CoSimulation:
    """One row, made by `EmbeddedSimulator.co_simulation`; its first instant is set.

    At every instant k from 0 on while it ``runs``: ``impose`` what the other simulator knows,
    ``decide``, ask for ``demand``, ``move``. With nothing imposed it is the embedded simulator's
    own rollout, to the bit.

    Args:
        batch: of that row, not started.
        names: of the E entities; the ego is the first.
        time_step: [s].
        n_steps: T, instants at most.
        actors: of each of V events, the numbers of the entities that it moves.
        wheel: makes what asks the driver, once the first instant is set; the compiled one by
            default.

    Raises:
        DriverError: a driver of the user's own failed as it began.

    Attributes:
        names: see above.
        time_step: see above.
        n_steps: see above.
        events: ``(V,)`` int64, the instant at which each event began, -1 if it has not; see
            `Rollout.began`. To be written to by who runs the storyboard elsewhere.
    """

    def __init__(
        self,
        batch: Batch,
        names: Sequence[str],
        time_step: float,
        n_steps: int,
        actors: Sequence[Collection[int]],
        wheel: Callable[[Batch], Demand] | None = None,
    ) -> None:
        self.names, self.time_step, self.n_steps = tuple(names), time_step, n_steps
        self._acting = tuple(map(frozenset, actors))
        self._batch = batch
        batch.start()
        self.events: Int = batch.record.began[0]
        self._demand = wheel(batch) if wheel and self.runs else batch.demand

    @property
    def runs(self) -> bool:
        """Whether it has not ended."""
        return bool(self._batch.running[0])

    @property
    def stops(self) -> bool:
        """Whether the stop trigger has fired, the ego's way is over, or something went wrong.

        ``move`` ends the row then. Known after ``decide``.
        """
        return bool(self._batch.state.ending[0, memory.STOPS])

    @property
    def failed(self) -> bool:
        """Whether something went wrong."""
        return bool(self._batch.state.ending[0, memory.STATUS] != memory.OK)

    @property
    def is_through(self) -> bool:
        """Whether a driven ego is at the end of its route, or of the road."""
        return bool(self._batch.egos_are_through()[0])

    @property
    def target_speed(self) -> float:
        """What the storyboard asks of the ego [m/s]; known after ``decide``."""
        return float(self._batch.state.command[0, 0])

    @property
    def lights(self) -> npt.NDArray[np.int8]:
        """``(S,)`` int8, the traffic lights' states, see `Rollout.lights`."""
        lights: npt.NDArray[np.int8] = self._batch.state.lights[0].copy()
        return lights

    @property
    def weather(self) -> Float:
        """``(WEATHER,)`` as sensors and tyres feel it, see ``ego._weather_columns``."""
        weather: Float = self._batch.state.weather[0].copy()
        return weather

    def is_ours(self, event: int, driven: Sequence[int]) -> bool:
        """Return whether an event moves other entities than the ego, and only some that are driven.

        Args:
            event: its number.
            driven: the numbers of the entities that drivers drive.
        """
        actors = self._acting[event]
        return bool(actors) and 0 not in actors and actors <= set(driven)

    def states(self, k: int) -> Float:
        """Return ``(E, 4)`` x, y [m], heading [rad], speed [m/s] at an instant that is reached."""
        record = self._batch.record
        return np.stack([array[0, :, k] for array in (record.x, record.y, record.h, record.v)], 1)

    def present(self, k: int) -> Bool:
        """Return ``(E,)`` who is there at an instant that is reached."""
        record = self._batch.record
        if not record.present.size:
            return np.ones(len(self.names), dtype=np.bool_)
        present: Bool = record.present[0, :, k].copy()
        return present

    def impose(self, k: int, bodies: Sequence[int], states: npt.ArrayLike) -> None:
        """Put bodies where the other simulator says that they are at instant k.

        Args:
            k: the instant that is reached, before ``decide``.
            bodies: B numbers of entities, each once; 0 is the ego.
            states: ``(B, 4)`` x, y [m] of the reference point, heading [rad], speed [m/s] ≥ 0.
        """
        imposed = np.asarray(states, dtype=np.float64).reshape(1, len(bodies), 4)
        self._batch.impose(k, np.asarray(bodies, dtype=np.int64), imposed)

    def impose_presence(self, k: int, present: Sequence[bool]) -> None:
        """Say who is there at instant k, before ``decide``; nothing where everybody always is.

        Args:
            k: the instant that is reached.
            present: ``(E,)``.
        """
        record = self._batch.record
        if record.present.size:
            state = self._batch.state
            state.present[0] = present
            state.visible[0], state.minded[0] = state.present[0] & ~state.hidden[0].T
            record.present[0, :, k] = present

    def impose_lights(self, k: int, states: npt.ArrayLike) -> None:
        """Set all traffic lights at instant k, after ``decide``.

        Args:
            k: the instant.
            states: ``(S,)``, see `Rollout.lights`.
        """
        self._batch.state.lights[0] = states
        self._batch.record.lights[0, :, k] = states

    def decide(self, k: int) -> None:
        """Do at instant k what the storyboard says, up to what it asks of the ego."""
        self._batch.before_driver(k)

    def go_on(self) -> None:
        """Overrule the stop trigger: the other simulator says when it is over."""
        if not self.failed:
            self._batch.state.ending[0, memory.STOPS] = 0

    def demand(self, k: int) -> tuple[float, float]:
        """Return what the ego's driver demands: acceleration [m/s²] and curvature [1/m].

        Raises:
            DriverError: a driver of the user's own failed.
        """
        if self.failed:
            return 0.0, 0.0
        acceleration, curvature = self._demand(k)
        return float(acceleration[0]), float(curvature[0])

    def move(self, k: int, acceleration: float, curvature: float) -> None:
        """Move everybody on to instant k + 1; or end, where it stops or k is the last instant."""
        self._batch.after_driver(k, np.array([acceleration]), np.array([curvature]))

    def end(self) -> None:
        """Have ``move`` end it."""
        self._batch.state.ending[0, memory.STOPS] = 1

    def fail(self, status: int, message: str) -> None:
        """End it, if it runs, with a status of `STATUS_MESSAGES` and what else there is to say."""
        self._batch.fail(status, message)

    @property
    def left_hand(self) -> bool:
        """Whether it is the mirror image of left-hand traffic."""
        return self._batch.left_hand

    def rollout(self) -> Rollout:
        """Return what is recorded, N = 1; it must have ended."""
        return self._batch.rollout()
