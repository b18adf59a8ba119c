"""Where an adversary's participant is, by what has been decided so far."""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.scenario.language.adversary import PERIOD
from bridgegen.scenario.ontology.courses import rounded

BEYOND = 2.0
"""Metres, and one second, between the vertices of the way that is left at the scenario's end."""


@dataclass(frozen=True)
class Lane:
    """The way that a participant keeps to.

    Attributes:
        path: ``(L, 6)``: x, y [m], heading [rad], its cosine and sine, curvature [1/m].
        step: [m] between two samples.
        station: a, b: who starts at s on its road starts a + b·s along it.
    """

    path: Float
    step: float
    station: tuple[float, float]


class Course:
    """Where a participant is by what has been decided so far.

    Args:
        lane: its way.
        station: where on it the participant starts [m].
        speed: at the start [m/s].
        top: its highest [m/s].
        limits: of its acceleration and its braking [m/s²].
        room: how far it may be aside of the lane's centre [m].
        time_step: [s].
        n_steps: instants of the scenario.

    Attributes:
        points: ``(T, 4)`` time [s], x, y [m], heading [rad], as far as it is decided.
        state: see ``_steering_kernels``.
    """

    def __init__(
        self, lane: Lane, station: float, speed: float, top: float, limits: tuple[float, float],
        room: float, time_step: float, n_steps: int,
    ) -> None:  # fmt: skip
        from bridgegen.simulation.embedded.motion import (
            note,  # numba is slow to import
        )

        self._lane, self.top, self.room, self._dt = lane, top, room, time_step
        self._limits = limits
        self.state = np.array([station, 0.0, speed, 0.0, 0.0])
        self.points = np.zeros((n_steps, 4))
        self.steps = max(1, round(PERIOD / time_step))
        note(lane.path, len(lane.path), lane.step, self.state, 0, 0.0, self.points)
        self._start = station
        self.points[:] = self.points[0]  # until it is decided otherwise
        self.points[:, 0] = np.arange(n_steps) * time_step

    def decide(self, k: int, pace: float, place: float) -> None:
        """Move on by one period.

        Args:
            k: which decision it is.
            pace: the speed that it makes for, as a share of its highest.
            place: -1 at the right edge of the lane, 1 at the left one.
        """
        from bridgegen.simulation.embedded.motion import (
            steer,  # numba is slow to import
        )

        steer(
            self._lane.path, len(self._lane.path), self._lane.step, self.state, pace * self.top,
            place * self.room, *self._limits, self._dt, k * self.steps, self.steps, self.points,
        )  # fmt: skip

    @property
    def travelled(self) -> float:
        """How far it has come along its way [m]."""
        return float(self.state[0]) - self._start

    def whole(self) -> Float:
        """Return the course and the way that would be left, ``(V, 4)``, rounded.

        The way that is left is for those who look where the participant is going.
        """
        from bridgegen.simulation.embedded.motion import (
            note,  # numba is slow to import
        )

        lane = self._lane
        end, now = (len(lane.path) - 1) * lane.step, self.state.copy()
        now[4] = 0.0
        count = max(1, int((end - now[0]) / BEYOND))
        left = np.zeros((count, 4))
        for k in range(count):
            now[0] += BEYOND
            note(lane.path, len(lane.path), lane.step, now, k, self.points[-1, 0] + k + 1, left)
        return rounded(np.concatenate([self.points, left]))
