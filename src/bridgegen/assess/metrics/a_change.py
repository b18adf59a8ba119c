"""a_change: the ego's most abrupt change of acceleration."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, in_steps, recorded, steps, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def a_change(rollout: Rollout, window: float = 0.5) -> Float:
    """Return the ego's largest change of longitudinal acceleration within a window.

    Args:
        rollout: N scenarios.
        window: [s]; |a(t) − a(t')| counts where |t − t'| is at most this.

    Returns:
        ``(N,)`` float64 [m/s²], ≥ 0; NaN where the scenario failed.

    Raises:
        ValueError: ``window`` is not a positive number of seconds.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    n_window = in_steps("window", window, rollout.time_step)
    out = np.empty(rollout.shape[0])
    _kernels.acceleration_change(recorded(rollout, "a"), steps(rollout), n_window, out)
    return without_failed(rollout, out)


METRIC = Metric(
    name="a_change",
    unit="m/s²",
    description="largest absolute change of the ego's longitudinal acceleration within 0.5 s",
    sense="larger",
    cap=0.0,
    compute=a_change,
)
