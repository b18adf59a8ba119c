"""A driver that does next to nothing: what is measured with it is the lock-step around it."""

import numpy as np

from bridgegen.drivers.interface import Control, Observation, Scene


class Cruises:
    """Holds the speed that it is asked to drive, straight on."""

    def reset(self, n: int, scene: Scene) -> None:
        """See `bridgegen.drivers.interface.BatchDriver`."""
        self.straight = np.zeros(n)

    def act(self, observation: Observation) -> Control:
        """See `bridgegen.drivers.interface.BatchDriver`."""
        return Control(np.clip(observation.target_speed - observation.v, -3.0, 2.0), self.straight)
