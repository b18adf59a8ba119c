"""tit: time-integrated shortfall of the time to collision."""

from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.tet import short_times
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


def tit(rollout: Rollout) -> Float:
    """Return the time integral of the difference between the target and the time to collision.

    As `tet`, with every instant weighted by the missing seconds.

    Returns:
        ``(N,)`` float64 [s²], ≥ 0; NaN where the scenario failed.

    Source: Minderhoud, Bovy, Extended time-to-collision measures for road traffic safety
    assessment, Accid. Anal. Prev. 33 (2001) 89.
    """
    return without_failed(rollout, short_times(rollout)[:, 1] * rollout.time_step)


METRIC = Metric(
    name="tit",
    unit="s²",
    description="time integral of the time to collision's shortfall from 3 s",
    sense="larger",
    cap=0.0,
    compute=tit,
)
