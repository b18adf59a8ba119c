"""impact_speed: the ego's speed at its first contact."""

import numpy as np

from bridgegen.assess.metrics.impact import at_contact, first_contact
from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def impact_speed(rollout: Rollout) -> Float:
    """Return the ego's speed at the first instant of its first contact.

    Returns:
        ``(N,)`` float64 [m/s], ≥ 0, ahead or in reverse; 0 without a contact, or if it stands; NaN
        where the scenario failed.

    Source: Vimpact of Euro NCAP's Crash Avoidance protocol, Frontal Collisions, 1.1 (2025).
    """
    _, instant = first_contact(rollout)
    speed = np.abs(at_contact(rollout, "v")[:, 0])
    return without_failed(rollout, np.where(instant < 0, 0.0, speed))


METRIC = Metric(
    name="impact_speed",
    unit="m/s",
    description="ego speed at its first contact",
    sense="larger",
    cap=0.0,
    compute=impact_speed,
)
