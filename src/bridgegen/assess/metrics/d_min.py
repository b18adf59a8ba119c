"""d_min: the ego's smallest distance to another participant."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, distance, steps, without_failed
from bridgegen.base.arrays import Float, Int
from bridgegen.simulation.rollout import Rollout


def d_min(rollout: Rollout) -> Float:
    """Return the smallest distance between the ego's oriented box and any other's.

    Returns:
        ``(N,)`` float64 [m], 0 at contact, +inf where there is no other entity, NaN where the
        scenario failed.

    Source: paper, Table I.
    """
    return without_failed(rollout, closest(rollout)[0])


def closest(rollout: Rollout) -> tuple[Float, Int]:
    """Return the smallest distance ``(N,)`` [m] and the first instant within 1e-9 m of it ``(N,)``.

    The instant is −1 where there is no other entity.
    """
    from bridgegen.assess.metrics import _kernels

    n = rollout.shape[0]
    least, instant = np.empty(n), np.empty(n, dtype=np.int64)
    _kernels.closest(distance(rollout), steps(rollout), least, instant)
    return least, instant


def first_closest(distance: Float) -> int:
    """Return the first instant within 1e-9 m of the least of ``(T,)`` distances [m]."""
    from bridgegen.assess.metrics import _kernels

    return int((distance <= distance.min() + _kernels.TIE).argmax())


METRIC = Metric(
    name="d_min",
    unit="m",
    description="smallest distance between the ego's oriented box and any other's",
    sense="smaller",
    cap=200.0,  # beyond a LiDAR's range
    compute=d_min,
)
