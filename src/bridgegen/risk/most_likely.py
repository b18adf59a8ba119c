"""The most likely harmful row: found, written as a scenario, and shown as a moving picture."""

from dataclasses import replace
from pathlib import Path

import numpy as np

from bridgegen.arrays import Float
from bridgegen.campaign.scenario_files import write_scenario
from bridgegen.conflict.analysis import analyse
from bridgegen.conflict.harm import Count, decisive
from bridgegen.conflict.summary import summarise
from bridgegen.errors import StorageError
from bridgegen.exposure import Exposure
from bridgegen.mining.replays.picture import moving_picture
from bridgegen.pipeline import Pipeline
from bridgegen.risk.estimators import design_point
from bridgegen.risk.estimators.problem import block_of
from bridgegen.risk.estimators.weighted import Weighted
from bridgegen.risk.experiment import Experiment
from bridgegen.risk.result import MOST_LIKELY
from bridgegen.simulation.rollout import Rollout

_STREAM = 4  # of random numbers, beside those of estimators
BEFORE, AFTER = 4.0, 2.0  # s, of the picture, around the conflict's most urgent instant


def find_most_likely(
    experiment: Experiment, exposure: Exposure, known: Weighted, threshold: float, budget: int,
    seed: int,
) -> Float | None:  # fmt: skip
    """Return the harmful row that is most likely on the road; None if none is known.

    Args:
        experiment: simulates rows.
        exposure: how likely they are.
        known: what an estimator found.
        threshold: of the score, from which a row is harmful.
        budget: the estimate's; a tenth of it is simulated at most.
        seed: of all random numbers.
    """
    at = known.there(threshold) > 0.0
    if not at.any():
        return None

    def log_density(Z: Float) -> Float:
        return exposure.log_density(exposure.from_normal(Z))

    evaluations = min(design_point.EVALUATIONS, budget // 10)
    random = block_of(seed, 0, _STREAM)
    z = design_point.find(experiment, log_density, known.Z[at], threshold, evaluations, random)
    row: Float = exposure.from_normal(z[np.newaxis])[0]
    return row


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
