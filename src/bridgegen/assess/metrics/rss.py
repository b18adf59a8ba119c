"""rss: missing share of the distance that Responsibility-Sensitive Safety requires."""

from dataclasses import astuple, dataclass

import numpy as np

from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.motion import motion
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout


@dataclass(frozen=True)
class Parameters:
    """The assumptions of RSS on traffic participants.

    The defaults are those of Intel's ad-rss-lib (its documentation, Parameter discussion); the
    authors of RSS define none.

    Attributes:
        ego_response: [s] until the ego brakes.
        other_response: [s] until another participant brakes.
        accel_max: [m/s²], along its heading, while it does not respond yet.
        brake_min: [m/s²], along its heading, that it brakes with at least.
        brake_max: [m/s²], along its heading, that one in front brakes with at most.
        lateral_accel_max: [m/s²], across its heading.
        lateral_brake_min: [m/s²], across its heading.
        lateral_margin: [m], for swaying in the lane.
    """

    ego_response: float = 1.0
    other_response: float = 2.0
    accel_max: float = 3.5
    brake_min: float = 4.0
    brake_max: float = 8.0
    lateral_accel_max: float = 0.2
    lateral_brake_min: float = 0.8
    lateral_margin: float = 0.1


def rss(rollout: Rollout, parameters: Parameters | None = None) -> Float:
    """Return the largest share of the RSS safe distances that was missing.

    A situation is dangerous where both the longitudinal and the lateral distance are less than
    safe. Its share is 1 − max(longitudinal, lateral), each distance as a share of the safe one. The
    axes are the ego's: a rollout does not know the roads. Bodies drive in all directions, so
    another's limits along and across its own heading count in proportion to the cosine and the sine
    of the angle between the headings: a crossing one brakes across the ego's way as hard as it can
    brake at all.

    Args:
        rollout: N scenarios.
        parameters: other assumptions.

    Returns:
        ``(N,)`` float64 in 0..1: 0 where no situation was dangerous, 1 at contact; NaN where the
        scenario failed.

    Source: Shalev-Shwartz, Shammah, Shashua, On a formal model of safe and scalable self-driving
    cars (2017), definitions 1 (following), 2 (opposite directions) with the same brakes for both,
    and 6 (lateral).
    """
    from bridgegen.assess.metrics import _rss_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    _rss_kernels.missing_share(
        m.half, m.x, m.y, m.cosine, m.sine, m.v, m.distance, m.n_steps,
        np.array(astuple(parameters or Parameters())), out,
    )  # fmt: skip
    return without_failed(rollout, out)


METRIC = Metric(
    name="rss",
    unit="1",
    description="largest share of the RSS safe distance that was missing, along and across",
    sense="larger",
    cap=0.0,
    compute=rss,
)
