"""drac: deceleration rate to avoid a crash."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.motion import motion
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout

MOST = 20.0
"""[m/s²] Twice what a tyre gives: anything harder counts as this, and so does a contact."""


def drac(rollout: Rollout) -> Float:
    """Return the largest deceleration rate to avoid a crash, in two dimensions.

    At an instant at which the ego and another are on a collision course at constant velocities,
    it is w² / (2 d): w is the speed of the one relative to the other, d the way until they touch
    along that relative velocity (w times the time to collision). When following, this is the
    classical (v₁ − v₂)² / (2 · gap); of oncoming or crossing traffic it is the deceleration of both
    together.

    Returns:
        ``(N,)`` float64 [m/s²] in 0..20; 0 where there was no collision course; NaN where the
        scenario failed.

    Source: Cooper, Ferguson, Traffic studies at T-junctions, Traffic Engineering & Control 17
    (1976) 306; Archer (2005); in two dimensions along the relative velocity, as Jiao (2023) has
    the time to collision.
    """
    from bridgegen.assess.metrics import _course_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    _course_kernels.avoidance_rate(
        m.half, m.x, m.y, m.cosine, m.sine, m.v, m.distance, m.n_steps, MOST, out
    )
    return without_failed(rollout, out)


METRIC = Metric(
    name="drac",
    unit="m/s²",
    description="largest deceleration rate to avoid a crash, at constant velocity",
    sense="larger",
    cap=0.0,
    compute=drac,
)
