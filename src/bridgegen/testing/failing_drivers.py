"""Drivers that fail where the ego is asked to drive fast, and cruise elsewhere.

Named by this file, not as a module: their processes need no pytest.
"""

import os
import time

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.drivers.compiled import compiled_driver
from bridgegen.drivers.interface import Control, Observation, Scene

LIMIT = 7.5
"""[m/s], from which it is fast."""


class Raises:
    """Raises an exception."""

    def reset(self, n: int, scene: Scene) -> None:
        """Begin n scenarios."""

    def act(self, observation: Observation) -> Control:
        """Cruise, or fail."""
        demanded = np.clip(observation.target_speed - observation.v, -3.0, 2.0)
        fast = observation.running & (observation.target_speed > LIMIT)
        if fast.any() and observation.time > 1.0:
            demanded = self.fail(fast)
        return Control(demanded, np.zeros(len(demanded)))

    def fail(self, fast: Bool) -> Float:
        """Fail in this driver's way."""
        raise ValueError("too fast for me")


class EndsItsProcess(Raises):
    """Ends the process that it runs in."""

    def fail(self, fast: Bool) -> Float:
        """Fail in this driver's way."""
        os._exit(3)


class Hangs(Raises):
    """Does not answer."""

    def fail(self, fast: Bool) -> Float:
        """Fail in this driver's way."""
        time.sleep(60)
        return np.zeros(len(fast))


class AnswersNaN(Raises):
    """Answers what is no control."""

    def fail(self, fast: Bool) -> Float:
        """Fail in this driver's way."""
        return np.where(fast, np.nan, 0.0)


@compiled_driver()
def raises(scene, ego, route, tracks, memory):  # type: ignore[no-untyped-def]
    """Raise an exception in compiled code."""
    if ego.target_speed > LIMIT and ego.time > 1.0:
        raise ValueError("too fast for me")
    return min(max(ego.target_speed - ego.v, -3.0), 2.0), 0.0
