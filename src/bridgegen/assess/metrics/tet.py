"""tet: time exposed to a short time to collision."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, shared, without_failed
from bridgegen.assess.metrics.motion import motion
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout

TARGET = 3.0
"""[s] A time to collision up to this is short (3 s in Autey et al. 2012; 1 to 5 s are in use)."""


def tet(rollout: Rollout) -> Float:
    """Return the time exposed to a two-dimensional time to collision of at most `TARGET`.

    At every instant the least time to collision with any other counts; each instant lasts a time
    step.

    Returns:
        ``(N,)`` float64 [s], ≥ 0; NaN where the scenario failed.

    Source: Minderhoud, Bovy, Extended time-to-collision measures for road traffic safety
    assessment, Accid. Anal. Prev. 33 (2001) 89.
    """
    return without_failed(rollout, short_times(rollout)[:, 0] * rollout.time_step)


def short_times(rollout: Rollout) -> Float:
    """Return the number of instants with a short time to collision, and their total shortfall.

    Returns:
        ``(N, 2)`` float64: a count, and the sum of the differences to `TARGET` [s].
    """
    return shared(rollout, _short_times)


def _short_times(rollout: Rollout) -> Float:
    from bridgegen.assess.metrics import _course_kernels

    m = motion(rollout)
    out = np.empty((len(m.n_steps), 2))
    _course_kernels.short_times(
        m.half, m.x, m.y, m.cosine, m.sine, m.v, m.distance, m.n_steps, TARGET, out
    )
    return out


METRIC = Metric(
    name="tet",
    unit="s",
    description="time exposed to a time to collision of 3 s or less",
    sense="larger",
    cap=0.0,
    compute=tet,
)
