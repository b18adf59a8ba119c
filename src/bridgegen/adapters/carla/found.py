"""What there is of a row beside its motion: incidents, detections, what was recorded."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridgegen.adapters.carla.eyes import Eyes
from bridgegen.adapters.carla.incidents import Incidents, write_incidents
from bridgegen.base.errors import InputError
from bridgegen.simulation.rollout import Rollout
from bridgegen.simulation.trace import write_trace


@dataclass(frozen=True)
class Found:
    """What there is of a row beside its motion.

    Attributes:
        incidents: what CARLA noticed.
        eyes: whose detections are the row's; None: the driver's sensors' are.
        folder: where it is recorded; None: it is not.
    """

    incidents: Incidents
    eyes: Eyes | None
    folder: Path | None

    def added(self, rollout: Rollout) -> Rollout:
        """Return the row's rollout, N = 1, with it."""
        incidents = self.incidents.all(rollout)
        if incidents:
            rollout = replace(rollout, incidents={0: incidents})
        if self.folder is not None:
            write_incidents(self.folder, incidents, rollout.time_step)
            write_trace(self.folder / "trace.csv", rollout)
        if self.eyes is not None:
            detections = self.eyes.detections
            n = int(rollout.n_steps[0])
            detections[:, n:] = detections[:, n - 1 : n]
            rollout = replace(rollout, detections=detections[np.newaxis])
        return rollout


def refuse_used(folder: Path) -> None:
    """Refuse to record where something is.

    Raises:
        InputError: it is a file, or not empty.
    """
    if folder.exists() and (not folder.is_dir() or any(folder.iterdir())):
        raise InputError(f"--record: {folder} must be a new folder, or an empty one")
