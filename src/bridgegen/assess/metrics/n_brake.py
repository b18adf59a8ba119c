"""n_brake: number of the ego's hard brakings."""

from math import isfinite

import numpy as np

from bridgegen.assess.metrics.metric import Metric, recorded, steps, without_failed
from bridgegen.base.arrays import Float
from bridgegen.base.physics import HARD_BRAKING
from bridgegen.simulation.rollout import Rollout


def n_brake(rollout: Rollout, threshold: float = HARD_BRAKING) -> Float:
    """Return how often the ego's deceleration rose to the threshold.

    Args:
        rollout: N scenarios.
        threshold: [m/s²]; 3.0 is also in use. Reaching it counts. Before the first instant the
            deceleration is taken as 0.

    Returns:
        ``(N,)`` float64, whole numbers; NaN where the scenario failed.

    Raises:
        ValueError: ``threshold`` is not a finite number > 0.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    if not (isfinite(threshold) and threshold > 0.0):
        raise ValueError(f"threshold [m/s²] must be finite and > 0, got {threshold}")
    out = np.empty(rollout.shape[0])
    _kernels.braking_edges(recorded(rollout, "a"), steps(rollout), float(threshold), out)
    return without_failed(rollout, out)


METRIC = Metric(
    name="n_brake",
    unit="count",
    description=f"rising edges of the ego's deceleration through {HARD_BRAKING:g} m/s²",
    sense="larger",
    cap=0.0,
    compute=n_brake,
)
