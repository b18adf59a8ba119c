"""What a user's own driver gets and returns: arrays over N scenarios at once.

A driver is a class without arguments:

    class MyDriver:
        def reset(self, n, scene): ...
        def act(self, observation): return Control(acceleration, curvature)

``reset`` is called before the first instant of every batch, ``act`` once per instant. Scenario i of
a batch must not depend on the other ones: how batches are cut depends on the machine.
"""

from dataclasses import dataclass, fields
from typing import Any, Protocol, Self

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float, Int

ROUTE_POINTS = 40
"""P, how many points of the route ahead an observation has."""

ROUTE_STEP = 2.0
"""Metres between two of them."""


@dataclass(frozen=True)
class Scene:
    """What does not change while a batch runs.

    Attributes:
        time_step: seconds between two calls of ``act``.
        n_steps: how many calls there are at most.
        names: of the M other participants.
        kinds: ``(M,)`` int64, what they are, see ``bridgegen.ego.kinds``.
        length: of the ego's body [m].
        width: of the ego's body [m].
        centre: of the body, ahead of the reference point, the rear axle's centre [m].
        max_speed: [m/s].
        max_acceleration: [m/s²].
        max_deceleration: [m/s²], > 0.
        max_curvature: of its path at full lock [1/m].
    """

    time_step: float
    n_steps: int
    names: tuple[str, ...]
    kinds: Int
    length: float
    width: float
    centre: float
    max_speed: float
    max_acceleration: float
    max_deceleration: float
    max_curvature: float


@dataclass(frozen=True)
class Observation:
    """One instant of N scenarios, in world coordinates.

    Attributes:
        time: since the scenario's start [s].
        running: ``(N,)`` bool; a scenario that has ended stays in the batch, and the control for
            it is ignored.
        x: ``(N,)`` float64 [m], the ego's reference point.
        y: ``(N,)`` float64 [m].
        h: ``(N,)`` float64 [rad], heading, counter-clockwise from +x.
        v: ``(N,)`` float64 [m/s], forward speed.
        a: ``(N,)`` float64 [m/s²], acceleration of the last step.
        target_speed: ``(N,)`` float64 [m/s], what the scenario asks of the ego.
        offset: ``(N,)`` float64 [m], of the reference point from the route, left positive.
        route: ``(N, P, 4)`` float64: x, y [m], heading [rad], curvature [1/m] of the route's points
            ahead, every ``ROUTE_STEP`` metres from the point beside the ego; straight on beyond
            its end.
        tracks: ``(N, M, 13)`` float64, the other participants as the sensors track them: state (0
            none or absent, 1 tentative, 2 confirmed, 3 coasting), x, y of the box's
            centre [m], heading [rad], velocity in x and y [m/s], length, width [m], class (see
            ``bridgegen.ego.kinds``), confidence, seconds since last seen, seconds tracked,
            indicators and brake lights (see ``bridgegen.ego.lamps``). With
            ``--ideal perception`` they are the truth.
        stop_distance: ``(N,)`` float64 [m], from the front of the ego to the next stop line of a
            light on its route; +inf where there is none.
        light: ``(N,)`` int8, that light's state, see `Rollout.lights`; 0 where there is none.
    """

    time: float
    running: Bool
    x: Float
    y: Float
    h: Float
    v: Float
    a: Float
    target_speed: Float
    offset: Float
    route: Float
    tracks: Float
    stop_distance: Float
    light: npt.NDArray[np.int8]

    def take(self, rows: Int | slice) -> Self:
        """Return the observation of some of the scenarios."""
        named = {one.name: getattr(self, one.name) for one in fields(self)}
        return type(self)(**{k: v if k == "time" else v[rows] for k, v in named.items()})


@dataclass(frozen=True)
class Control:
    """What a driver demands in N scenarios; tyres and the vehicle's limits bound it.

    Attributes:
        acceleration: ``(N,)`` [m/s²], forward; braking is negative.
        curvature: ``(N,)`` [1/m], of the path of the rear axle's centre; left is positive.
    """

    acceleration: npt.ArrayLike
    curvature: npt.ArrayLike


class BatchDriver(Protocol):
    """A driver of N scenarios at once."""

    def reset(self, n: int, scene: Scene) -> None:
        """Begin N scenarios; discard the state of earlier ones."""

    def act(self, observation: Observation) -> Control | Any:
        """Return the control at one instant: a `Control`, or a pair (acceleration, curvature)."""
