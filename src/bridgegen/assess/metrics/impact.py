"""The ego's first contact: what the metrics of its impact share."""

import numpy as np

from bridgegen.assess.metrics.metric import distance, recorded, shared, steps
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.simulation.rollout import Rollout


def first_contact(rollout: Rollout) -> tuple[Bool, Int]:
    """Return which entities the ego's first contact is with, and at which instant.

    Returns:
        ``(N, E)`` bool, several where it touches them at the same instant; and ``(N,)``, −1 where
        there is no contact.
    """
    return shared(rollout, _first_contact)


def _first_contact(rollout: Rollout) -> tuple[Bool, Int]:
    n, _, t = rollout.shape
    real = np.arange(t)[np.newaxis, :] < steps(rollout)[:, np.newaxis]
    touching = (distance(rollout) <= 0.0) & real[:, np.newaxis, :]
    anyone: Bool = np.any(touching, axis=1)
    touched: Bool = np.any(anyone, axis=1)
    instant = np.where(touched, anyone.argmax(axis=1), -1)
    return touching[np.arange(n), :, np.maximum(instant, 0)], instant


def at_contact(rollout: Rollout, field: str) -> Float:
    """Return a state of all entities at the first contact; where there is none, at the start.

    Args:
        rollout: N scenarios.
        field: "v", "h".

    Returns:
        ``(N, E)``.
    """
    _, instant = first_contact(rollout)
    state: Float = recorded(rollout, field)[np.arange(len(instant)), :, np.maximum(instant, 0)]
    return state
