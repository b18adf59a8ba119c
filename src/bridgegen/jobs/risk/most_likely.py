"""Finds, writes and pictures the most likely harmful encounter of each failure mode."""

from collections.abc import Mapping
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridgegen.assess.conflict.analysis import encounters
from bridgegen.assess.conflict.harm import Count, decisive
from bridgegen.assess.conflict.summary import summarise
from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import StorageError
from bridgegen.engine.pipeline import Pipeline
from bridgegen.jobs.risk.estimators import exploration as design_point
from bridgegen.jobs.risk.estimators.problem import block_of
from bridgegen.jobs.risk.estimators.weighted import Weighted
from bridgegen.jobs.risk.experiment import Experiment
from bridgegen.jobs.risk.ledger import MOST_LIKELY
from bridgegen.jobs.risk.outcomes import Column
from bridgegen.jobs.risk.result import Likely
from bridgegen.jobs.search.scenario_files import write_scenario
from bridgegen.recordings.replays.write import moving_picture
from bridgegen.scenario.exposure import Exposure
from bridgegen.simulation.rollout import Rollout

_STREAM = 4  # of random numbers, beside those of estimators
MOST_MODES = 5
BEFORE, AFTER = 4.0, 2.0  # s, of the picture, around the conflict's most urgent instant


def find_most_likely(
    experiment: Experiment, exposure: Exposure, known: Weighted, threshold: float, budget: int,
    seed: int,
) -> dict[str, Float]:  # fmt: skip
    """Return the harmful row of each failure mode that is most likely on the road.

    Args:
        experiment: simulates rows.
        exposure: how likely they are.
        known: what an estimator found.
        threshold: of the score, from which a row is harmful.
        budget: the estimate's; a tenth of it is simulated at most.
        seed: of all random numbers.

    Returns:
        By the words of the failure mode, the likeliest first, `MOST_MODES` at most.
    """
    at = known.there(threshold) > 0.0
    Z, numbers = known.Z[at], known.outcomes[at, Column.MODE].astype(np.int64)
    sums = np.bincount(numbers, known.weights[at], len(experiment.modes))
    chosen = [int(k) for k in np.argsort(-sums, kind="stable")[:MOST_MODES] if sums[k] > 0.0]

    def log_density(Z: Float) -> Float:
        return exposure.log_density(exposure.from_normal(Z))

    evaluations = min(design_point.EVALUATIONS, budget // (10 * max(len(chosen), 1)))
    words = list(experiment.modes)
    found = {}
    for mode in chosen:
        random = block_of(seed, 0, _STREAM, mode)

        def happens(outcomes: Float, mode: int = mode) -> Bool:
            same = outcomes[:, Column.MODE] == mode
            inside: Bool = same & (outcomes[:, Column.SCORE] >= threshold)
            return inside

        z = design_point.find(
            experiment, log_density, Z[numbers == mode], happens, evaluations, random
        )
        found[words[mode]] = exposure.from_normal(z[np.newaxis])[0]
    return found


def write_most_likely(
    pipeline: Pipeline, rows: Mapping[str, Float], count: Count, folder: Path
) -> tuple[Likely, ...]:
    """Write the most likely harmful row of each failure mode as a scenario, and picture it.

    Raises:
        StorageError: they cannot be written.
    """
    found = []
    for number, (mode, x) in enumerate(rows.items(), 1):
        name = f"{MOST_LIKELY}{number}"
        rollout = pipeline.rollout(x[np.newaxis])
        conflicts = encounters(rollout)
        conflict = summarise(conflicts, count=count)
        try:
            write_scenario(pipeline, x, folder, name, rollout=rollout, conflict=conflict)
        except OSError as error:
            raise StorageError(f"{folder}: cannot be written: {error.strerror}") from None
        other = int(decisive(conflicts, count)[0][0])
        instant, step = int(conflicts.instant[0, other]), rollout.time_step
        first = max(instant - round(BEFORE / step), 0)
        shown = _between(rollout, first, instant + round(AFTER / step) + 1)
        caption = f"the most likely harmful encounter ({mode}), from above"
        picture = moving_picture(shown, other, (instant - first) * step, caption)
        found.append(Likely(mode, x, name, picture))
    return tuple(found)


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
