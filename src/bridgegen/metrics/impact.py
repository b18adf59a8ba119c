"""The ego's first contact: what the metrics of its impact share."""

import numpy as np

from bridgegen.arrays import Bool, Float, Int
from bridgegen.metrics.metric import distance, recorded, shared, steps
from bridgegen.simulation.rollout import Rollout


def first_contact(rollout: Rollout) -> tuple[Int, Int]:
    """Return with which entity the ego's first contact is, and at which instant.

    Returns:
        ``(N,)`` each; −1 where there is none. Of several at one instant, the first entity's.
    """
    return shared(rollout, _first_contact)


def _first_contact(rollout: Rollout) -> tuple[Int, Int]:
    n, _, t = rollout.shape
    real = np.arange(t)[np.newaxis, :] < steps(rollout)[:, np.newaxis]
    touching = (distance(rollout) <= 0.0) & real[:, np.newaxis, :]
    anyone: Bool = np.any(touching, axis=1)
    touched: Bool = np.any(anyone, axis=1)
    instant = np.where(touched, anyone.argmax(axis=1), -1)
    entity = touching[np.arange(n), :, np.maximum(instant, 0)].argmax(axis=1)
    return np.where(touched, entity, -1), instant


def at_contact(rollout: Rollout, field: str, entity: Int | int) -> Float:
    """Return a state at the first contact, ``(N,)``; where there is none, at the first instant.

    Args:
        rollout: N scenarios.
        field: "v", "h".
        entity: whose, one or ``(N,)``.
    """
    _, instant = first_contact(rollout)
    rows = np.arange(len(instant))
    state: Float = recorded(rollout, field)[rows, entity, np.maximum(instant, 0)]
    return state
