"""The ego's detections of other participants, extracted from a rollout frame by frame."""

import numpy as np

from bridgegen.assess.metrics.perception import THRESHOLDS, perceived
from bridgegen.drivers import kinds as column
from bridgegen.drivers.kinds import NAMES
from bridgegen.pages.playback import Sensed
from bridgegen.simulation.rollout import Rollout

# The strictest of nuScenes's average precision, from which on a detection is no hit.
TOLERANCE = float(THRESHOLDS[0])
"""Largest distance of a matching detection at the strictest of nuScenes's thresholds [m]."""


def sensed(rollout: Rollout) -> list[Sensed]:
    """Return the detections of the egos of N scenarios; an empty list without sensors.

    Which entities count, and how detections match them, is as in the metrics of perception.
    """
    if not rollout.detections.size:
        return []
    # Which entities count is taken from the metrics, so that page and figures agree.
    counts = perceived(rollout).counts
    found = []
    for row, n_steps in enumerate(rollout.n_steps.tolist()):
        detections = rollout.detections[row, :, :n_steps]
        steps = np.flatnonzero((detections[1:, :, column.SEEN_BY] >= column.MISSED).any(axis=0))
        frames = detections[:, steps]
        seen_by = frames[:, :, column.SEEN_BY].astype(np.int64)
        # The ego does not see itself.
        seen_by[0] = -1
        if rollout.present.size:
            seen_by[~rollout.present[row][:, steps]] = -1
        nothing = seen_by <= column.MISSED

        def of(name: int, frames: np.ndarray = frames, nothing: np.ndarray = nothing) -> np.ndarray:
            return np.where(nothing, np.nan, frames[:, :, name])

        found.append(
            Sensed(
                steps=steps,
                seen_by=seen_by,
                counts=counts[row][:, steps],
                x=of(column.X),
                y=of(column.Y),
                h=of(column.HEADING),
                length=of(column.LENGTH),
                width=of(column.WIDTH),
                confidence=of(column.CONFIDENCE),
                kind=np.where(nothing, -1, frames[:, :, column.KIND]).astype(np.int64),
                kinds=NAMES,
                kind_of=rollout.kinds,
                tolerance=TOLERANCE,
                ghosts=rollout.ghosts[row, :, steps].swapaxes(0, 1)
                if rollout.ghosts.size
                else np.zeros((0, len(steps), column.DETECTION)),
            )
        )
    return found
