"""The most likely harmful row as a scenario and a moving picture."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from bridgegen.arrays import Float
from bridgegen.campaign.scenario_files import write_scenario
from bridgegen.conflict.analysis import analyse
from bridgegen.conflict.harm import Count, decisive
from bridgegen.conflict.summary import summarise
from bridgegen.errors import StorageError
from bridgegen.mining.replays.picture import moving_picture
from bridgegen.pipeline import Pipeline
from bridgegen.risk.result import MOST_LIKELY
from bridgegen.simulation.rollout import Rollout

BEFORE, AFTER = 4.0, 2.0  # s, of the picture, around the conflict's most urgent instant


def write_most_likely(pipeline: Pipeline, x: Float, count: Count, folder: Path) -> str:
    """Write the most likely harmful row as a scenario; return its moving picture.

    Raises:
        StorageError: it cannot be written.
    """
    rollout = pipeline.rollout(x[np.newaxis])
    conflicts = analyse(rollout)
    try:
        write_scenario(
            pipeline,
            x,
            folder,
            MOST_LIKELY,
            rollout=rollout,
            conflict=summarise(conflicts, count=count),
        )
    except OSError as error:
        raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
    other = int(decisive(conflicts, count)[0][0])
    instant, step = int(conflicts.instant[0, other]), rollout.time_step
    first = max(instant - round(BEFORE / step), 0)
    shown = _between(rollout, first, instant + round(AFTER / step) + 1)
    when = (instant - first) * step
    return moving_picture(shown, other, when, "the most likely harmful encounter, from above")


def _between(rollout: Rollout, first: int, last: int) -> Rollout:
    """Return where everyone is between two instants."""
    there = rollout.present
    return replace(
        rollout,
        x=rollout.x[:, :, first:last],
        y=rollout.y[:, :, first:last],
        h=rollout.h[:, :, first:last],
        present=there[:, :, first:last] if there.size else there,
    )
