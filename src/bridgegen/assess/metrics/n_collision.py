"""n_collision: number of the ego's collisions."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, distance, in_steps, steps, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def n_collision(rollout: Rollout, merge_within: float = 5.0) -> Float:
    """Return the number of contacts between the ego's oriented box and another's.

    Args:
        rollout: N scenarios.
        merge_within: [s]; a contact that begins no later than this after the last instant of a
            contact with the same actor is part of it.

    Returns:
        ``(N,)`` float64, whole numbers; NaN where the scenario failed.

    Raises:
        ValueError: ``merge_within`` is not a positive number of seconds.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    merge_steps = in_steps("merge_within", merge_within, rollout.time_step)
    out = np.empty(rollout.shape[0])
    _kernels.contacts(distance(rollout), steps(rollout), merge_steps, out)
    return without_failed(rollout, out)


METRIC = Metric(
    name="n_collision",
    unit="count",
    description="collisions of the ego; those with the same actor within 5 s count once",
    sense="larger",
    cap=0.0,
    compute=n_collision,
)
