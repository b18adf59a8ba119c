"""Metrics of distance: the smallest, the speed at it, what Responsibility-Sensitive Safety asks."""

from dataclasses import astuple, dataclass

import numpy as np

from bridgegen.assess.metrics.metric import (
    Metric,
    distance,
    motion,
    recorded,
    steps,
    without_failed,
)
from bridgegen.base.arrays import Float, Int
from bridgegen.simulation.rollout import Rollout

# --- d_min: the ego's smallest distance to another participant ---


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


D_MIN = Metric(
    name="d_min",
    unit="m",
    description="smallest distance between the ego's oriented box and any other's",
    sense="smaller",
    cap=200.0,  # beyond a LiDAR's range
    compute=d_min,
)


# --- v_d: the ego's speed at its smallest distance ---


def v_d(rollout: Rollout) -> Float:
    """Return the ego's speed at the moment of d_min, the first within 1e-9 m of it.

    Returns:
        ``(N,)`` float64 [m/s], ≥ 0, ahead or in reverse: on a collision the speed at first contact;
        0 where there is no other entity; NaN where the scenario failed.

    Source: paper, Table I.
    """
    _, instant = closest(rollout)
    speed = recorded(rollout, "v")[np.arange(len(instant)), 0, instant]
    return without_failed(rollout, np.where(instant < 0, 0.0, np.abs(speed)))


V_D = Metric(
    name="v_d",
    unit="m/s",
    description="ego speed at the moment of d_min",
    sense="larger",
    cap=0.0,
    compute=v_d,
)


# --- rss: missing share of the distance that Responsibility-Sensitive Safety requires ---


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
    from bridgegen.assess.metrics import _kernels as _rss_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    _rss_kernels.missing_share(
        m.half,
        m.x,
        m.y,
        m.cosine,
        m.sine,
        m.v,
        m.distance,
        m.n_steps,
        np.array(astuple(parameters or Parameters())),
        out,
    )
    return without_failed(rollout, out)


RSS = Metric(
    name="rss",
    unit="1",
    description="largest share of the RSS safe distance that was missing, along and across",
    sense="larger",
    cap=0.0,
    compute=rss,
)
