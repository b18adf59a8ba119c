"""relative_impact_speed: how much faster the ego is than what it touches first."""

import numpy as np

from bridgegen.assess.metrics.impact import at_contact, first_contact
from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def relative_impact_speed(rollout: Rollout) -> Float:
    """Return the ego's speed less the other's speed along the ego's heading, at the first contact.

    Returns:
        ``(N,)`` float64 [m/s], ≥ 0: the ego's own speed if the other crosses at a right angle, the
        sum of both head-on; the largest, if it touches several at once; 0 without a contact, or if
        the other is faster; NaN where the scenario failed.

    Source: Vrel_impact of Euro NCAP's Crash Avoidance protocol, Frontal Collisions, 1.1 (2025).
    """
    touching, _ = first_contact(rollout)
    v, h = (at_contact(rollout, field) for field in ("v", "h"))
    relative = v[:, :1] - v * np.cos(h - h[:, :1])
    largest = np.where(touching, relative, 0.0).max(axis=1)
    return without_failed(rollout, np.maximum(largest, 0.0))


METRIC = Metric(
    name="relative_impact_speed",
    unit="m/s",
    description="ego speed less the other's along the ego's heading, at its first contact",
    sense="larger",
    cap=0.0,
    compute=relative_impact_speed,
)
