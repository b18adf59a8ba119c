"""tit: for how long, and by how much, the time to collision was short."""

from bridgegen.arrays import Float
from bridgegen.metrics.metric import Metric, without_failed
from bridgegen.metrics.tet import short_times
from bridgegen.simulation.rollout import Rollout


def tit(rollout: Rollout) -> Float:
    """Return the time integral of what the time to collision falls short of the target.

    As `tet`, with every instant weighed by the seconds that are missing.

    Returns:
        ``(N,)`` float64 [s²], ≥ 0; NaN where the scenario failed.

    Source: Minderhoud, Bovy, Extended time-to-collision measures for road traffic safety
    assessment, Accid. Anal. Prev. 33 (2001) 89.
    """
    return without_failed(rollout, short_times(rollout)[:, 1] * rollout.time_step)


METRIC = Metric(
    name="tit",
    unit="s²",
    description="time integral of what the time to collision falls short of 3 s",
    sense="larger",
    cap=0.0,
    compute=tit,
)
