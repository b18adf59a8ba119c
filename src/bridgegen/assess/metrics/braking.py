"""Metrics of braking: how abrupt and how hard the ego brakes, and how hard it would have to."""

from math import isfinite

import numpy as np

from bridgegen.assess.metrics.metric import (
    Metric,
    in_steps,
    motion,
    recorded,
    steps,
    without_failed,
)
from bridgegen.base.arrays import Float
from bridgegen.base.physics import GRIP, HARD_BRAKING
from bridgegen.simulation.rollout import Rollout

# --- a_change: the ego's most abrupt change of acceleration ---


ABRUPT = 0.5
"""Time within which changes of acceleration count [s]."""


def a_change(rollout: Rollout, window: float = ABRUPT) -> Float:
    """Return the ego's largest change of longitudinal acceleration within a window.

    Args:
        rollout: N scenarios.
        window: [s]; |a(t) − a(t')| counts where |t − t'| is at most this.

    Returns:
        ``(N,)`` float64 [m/s²], ≥ 0; NaN where the scenario failed.

    Raises:
        ValueError: ``window`` is not a positive number of seconds.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    n_window = in_steps("window", window, rollout.time_step)
    out = np.empty(rollout.shape[0])
    _kernels.acceleration_change(recorded(rollout, "a"), steps(rollout), n_window, out)
    return without_failed(rollout, out)


A_CHANGE = Metric(
    name="a_change",
    unit="m/s²",
    description="largest absolute change of the ego's longitudinal acceleration within 0.5 s",
    sense="larger",
    cap=0.0,
    compute=a_change,
)


# --- n_brake: number of the ego's hard brakings ---


def n_brake(rollout: Rollout, threshold: float = HARD_BRAKING) -> Float:
    """Return how often the ego's deceleration rose to the threshold.

    Args:
        rollout: N scenarios.
        threshold: [m/s²]; 3.0 is also in use. Reaching it counts. Before the first instant the
            deceleration is taken as 0.

    Returns:
        ``(N,)`` float64, whole numbers; NaN where the scenario failed.

    Raises:
        ValueError: ``threshold`` is not a finite number > 0.

    Source: paper, Table I.
    """
    from bridgegen.assess.metrics import _kernels

    if not (isfinite(threshold) and threshold > 0.0):
        raise ValueError(f"threshold [m/s²] must be finite and > 0, got {threshold}")
    out = np.empty(rollout.shape[0])
    _kernels.braking_edges(recorded(rollout, "a"), steps(rollout), float(threshold), out)
    return without_failed(rollout, out)


N_BRAKE = Metric(
    name="n_brake",
    unit="count",
    description=f"rising edges of the ego's deceleration through {HARD_BRAKING:g} m/s²",
    sense="larger",
    cap=0.0,
    compute=n_brake,
)


# --- drac: deceleration rate to avoid a crash ---


# An objective must be finite.
MOST = 20.0
"""Largest deceleration that is counted [m/s²], twice what a tyre gives: anything harder counts as
this, and so does a contact."""


def drac(rollout: Rollout) -> Float:
    """Return the largest deceleration rate to avoid a crash, in two dimensions.

    At an instant at which the ego and another are on a collision course at constant velocities,
    it is w² / (2 d): w is the speed of the one relative to the other, d the way until they touch
    along that relative velocity (w times the time to collision). When following, this is the
    classical (v₁ − v₂)² / (2 · gap); of oncoming or crossing traffic it is the deceleration of both
    together.

    Returns:
        ``(N,)`` float64 [m/s²] in 0..20; 0 where there was no collision course; NaN where the
        scenario failed.

    Source: Cooper, Ferguson, Traffic studies at T-junctions, Traffic Engineering & Control 17
    (1976) 306; Archer (2005); in two dimensions along the relative velocity, as Jiao (2023) has
    the time to collision.
    """
    from bridgegen.assess.metrics import _time_kernels as _course_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    _course_kernels.avoidance_rate(
        m.half, m.x, m.y, m.cosine, m.sine, m.v, m.distance, m.n_steps, MOST, out
    )
    return without_failed(rollout, out)


DRAC = Metric(
    name="drac",
    unit="m/s²",
    description="largest deceleration rate to avoid a crash, at constant velocity",
    sense="larger",
    cap=0.0,
    compute=drac,
)


# --- btn: brake threat number, the share of its brakes that the ego needs ---


def btn(rollout: Rollout, available: float = GRIP) -> Float:
    """Return the ego's largest brake threat number.

    It is the required longitudinal acceleration over the available one. Required is the least
    constant deceleration by which the ego, on its present heading, lets the other pass in front of
    it or stays behind it, if the other keeps its present heading and acceleration until it stops.
    If braking cannot avoid the contact, it is the one by which the ego stands when it is touched.
    0 if it need not brake, and for participants from behind.

    When following, this is Jansson's (v₁ − v₂)² / (2 · gap) − a₂, and v₁² / (2 · distance) if the
    other stops first.

    Args:
        rollout: N scenarios.
        available: [m/s²] deceleration that is at most available, > 0; on dry asphalt by default.

    Returns:
        ``(N,)`` float64, ≥ 0; from 1 on braking alone did not suffice; a required deceleration of
        more than 20 m/s² counts as that, and so does a contact. NaN where the scenario failed.

    Raises:
        ValueError: ``available`` is not a number > 0.

    Source: Jansson, Collision Avoidance Theory, Linköping 2005; Westhofen et al., Criticality
    metrics for automated driving, Arch. Comput. Methods Eng. 30 (2023) 1.
    """
    from bridgegen.assess.metrics import _brake_kernels

    if not 0.0 < available < np.inf:
        raise ValueError(f"available [m/s²] must be finite and > 0, got {available}")
    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    _brake_kernels.largest_required(
        m.half,
        m.x,
        m.y,
        m.cosine,
        m.sine,
        m.v,
        m.a,
        m.distance,
        m.n_steps,
        MOST,
        out,
    )
    return without_failed(rollout, out / available)


BTN = Metric(
    name="btn",
    unit="1",
    description="largest brake threat number: required deceleration over what tyres give",
    sense="larger",
    cap=0.0,
    compute=btn,
)
