"""ttc: smallest time to collision if all participants keep their velocity."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, distance, recorded, steps, without_failed
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def ttc(rollout: Rollout) -> Float:
    """Return the smallest two-dimensional time to collision of the ego with any other.

    At every instant both oriented boxes are predicted at constant velocity, speed v along the
    heading, without turning; the time to collision is when they first touch.

    Returns:
        ``(N,)`` float64 [s], 0 where the ego was in contact, +inf where no instant leads to a
        collision, NaN where the scenario failed.

    Source: paper, Table I; Jiao (2023), A fast calculation of two-dimensional Time-to-Collision.
    """
    from bridgegen.assess.metrics import _ttc_kernels

    out = np.empty(rollout.shape[0])
    _ttc_kernels.least_time(
        np.ascontiguousarray(rollout.box, dtype=np.float64),  # checked with the distance
        *(recorded(rollout, field) for field in ("x", "y", "h", "v")),
        distance(rollout),
        steps(rollout),
        out,
    )
    return without_failed(rollout, out)


def ttc_over_time(rollout: Rollout) -> Float:
    """Return the ego's least time to collision at each instant; its least is what ``ttc`` returns.

    Returns:
        ``(N, T)`` float64 [s], 0 in contact, +inf without a collision course; NaN where a scenario
        failed. Padded instants repeat the last.
    """
    from bridgegen.assess.metrics import _ttc_kernels

    n, e, t = rollout.shape

    def instants(of: Float) -> Float:  # each a scenario of one instant
        return np.ascontiguousarray(of.transpose(0, 2, 1)).reshape(n * t, e, 1)

    out = np.empty(n * t)
    _ttc_kernels.least_time(
        np.ascontiguousarray(rollout.box, dtype=np.float64),
        *(instants(recorded(rollout, field)) for field in ("x", "y", "h", "v")),
        instants(distance(rollout)),
        np.ones(n * t, dtype=np.int64),
        out,
    )
    return without_failed(rollout, out.reshape(n, t))


METRIC = Metric(
    name="ttc",
    unit="s",
    description="smallest two-dimensional time to collision at constant velocity",
    sense="smaller",
    cap=20.0,  # a whole scenario at the crossroads; conflicts begin below 1.5 to 5 s
    compute=ttc,
)
