"""A trained policy as a driver, with Gymnasium's spaces for one scenario.

    from stable_baselines3 import PPO
    from bridgegen.drivers.policy import PolicyDriver

    class MyDriver(PolicyDriver):
        def load(self):
            return PPO.load("my_policy.zip")

A policy is anything with ``predict(observation, state=None, deterministic=True)`` that returns
(action, state), as Stable-Baselines3's are; the observation is a vector in ``[-1, 1]``, the action
a pair there. It is called with blocks of one size, see `bridgegen.drivers.batches`.
"""

from abc import ABC, abstractmethod
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.drivers.batches import SIZE as BLOCK
from bridgegen.drivers.batches import blocks, checked_size, equal_places
from bridgegen.drivers.interface import Control, Observation, Scene

if TYPE_CHECKING:
    import gymnasium

NEAREST = 6
"""Number of other participants in an observation, the nearest first."""

ROUTE_EVERY = 4
"""Stride of the route's points in an observation: every how-many-th is in it."""

SPEED, ACCELERATION, LENGTH, CURVATURE = 40.0, 10.0, 100.0, 0.2
"""Scales of an observation [m/s, m/s², m, 1/m]; values beyond are clipped to 1."""

SIZE = 6 + 5 + 10 * 3 + NEAREST * 8
"""Length of an observation."""


class PolicyDriver(ABC):
    """A driver that runs a policy; derive from it and implement ``load``.

    Attributes:
        block: how many scenarios the policy is called with, a multiple of 64, or 1.
    """

    block: int = BLOCK

    @abstractmethod
    def load(self) -> Any:
        """Return the policy; called once per process."""

    @staticmethod
    def spaces() -> "tuple[gymnasium.spaces.Box, gymnasium.spaces.Box]":
        """Return Gymnasium's spaces of observation and action, to train a policy with."""
        from gymnasium.spaces import Box

        return Box(-1.0, 1.0, (SIZE,), np.float32), Box(-1.0, 1.0, (2,), np.float32)

    def __init__(self) -> None:
        checked_size(self.block)
        self._policy = self.load()
        self._places: Int | None = None

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`."""
        self._scene = scene
        self._states: dict[int, Any] = {}  # of each block, by its first row
        self._first = np.ones(self.block, dtype=bool)

    def act(self, observation: Observation) -> Control:
        """See `BatchDriver`."""
        seen = vectors(observation)
        if self._places is None:
            self._places = equal_places(self._twice, [seen], self.block)
        actions = np.empty((len(seen), 2))
        for rows, (block,) in blocks(seen, size=self.block, places=self._places):
            state = self._states.get(rows.start)
            answer, self._states[rows.start] = self._predict(block, state, self._first)
            actions[rows] = answer[self._places[: rows.stop - rows.start]]
        self._first = np.zeros_like(self._first)
        return control(actions, self._scene)

    def _predict(self, block: npt.NDArray[Any], state: Any, first: Bool) -> tuple[Float, Any]:
        answer, after = self._policy.predict(
            block, state=state, episode_start=first, deterministic=True
        )
        return np.asarray(answer), after

    def _twice(self, blocks: list[npt.NDArray[Any]]) -> list[Float]:
        """Return the answers to a block at an episode's first two instants."""
        first = np.ones(self.block, dtype=bool)
        answer, state = self._predict(blocks[0], None, first)
        return [answer, self._predict(blocks[0], state, ~first)[0]]


def control(action: Float, scene: Scene) -> Control:
    """Return the control for actions ``(N, 2)`` in [-1, 1]: 1 is the vehicle's limit."""
    pedal, wheel = np.clip(action[:, 0], -1.0, 1.0), np.clip(action[:, 1], -1.0, 1.0)
    most = np.where(pedal > 0.0, scene.max_acceleration, scene.max_deceleration)
    return Control(pedal * most, wheel * scene.max_curvature)


def vectors(observation: Observation) -> npt.NDArray[np.float32]:
    """Return observations as ``(N, SIZE)`` float32 in [-1, 1], seen from the ego.

    First speed, acceleration, target speed, offset from the route, distance to the stop line,
    whether there is one; then the light's state, one of five; ten points of the route (ahead, left,
    heading); ``NEAREST`` other participants (1, ahead, left, heading's cosine and sine, speed ahead
    and to the left relative to the ego's, width), zeros where there are fewer.
    """
    o = observation
    n = len(o.x)
    ahead, left = np.cos(o.h)[:, None], np.sin(o.h)[:, None]
    out = np.zeros((n, SIZE))
    stop = np.isfinite(o.stop_distance)
    out[:, 0] = o.v / SPEED
    out[:, 1] = o.a / ACCELERATION
    out[:, 2] = o.target_speed / SPEED
    out[:, 3] = o.offset / 5.0
    out[:, 4] = np.where(stop, o.stop_distance, LENGTH) / LENGTH
    out[:, 5] = stop
    out[np.arange(n), 6 + np.clip(o.light, 0, 4)] = 1.0
    at = 11
    route = o.route[:, ::ROUTE_EVERY]
    dx, dy = route[:, :, 0] - o.x[:, None], route[:, :, 1] - o.y[:, None]
    turn = route[:, :, 2] - o.h[:, None]
    for values in (
        (dx * ahead + dy * left) / LENGTH,
        (dy * ahead - dx * left) / LENGTH,
        np.arctan2(np.sin(turn), np.cos(turn)) / np.pi,
    ):
        out[:, at : at + values.shape[1]] = values
        at += values.shape[1]
    tracks = o.tracks
    there = tracks[:, :, 0] >= 2.0
    dx, dy = tracks[:, :, 1] - o.x[:, None], tracks[:, :, 2] - o.y[:, None]
    distance = np.where(there, np.hypot(dx, dy), np.inf)
    nearest = np.argsort(distance, axis=1, kind="stable")[:, :NEAREST]
    turn = tracks[:, :, 3] - o.h[:, None]
    vx = tracks[:, :, 4] - o.v[:, None] * ahead
    vy = tracks[:, :, 5] - o.v[:, None] * left
    features = np.stack(
        [
            np.ones_like(dx),
            (dx * ahead + dy * left) / LENGTH,
            (dy * ahead - dx * left) / LENGTH,
            np.cos(turn),
            np.sin(turn),
            (vx * ahead + vy * left) / SPEED,
            (vy * ahead - vx * left) / SPEED,
            tracks[:, :, 7] / 5.0,
        ],
        axis=2,
    )
    features = np.where(there[:, :, None], features, 0.0)
    features = np.take_along_axis(features, nearest[:, :, None], axis=1)
    out[:, at : at + features[0].size] = features.reshape(n, -1)
    return np.clip(out, -1.0, 1.0).astype(np.float32)
