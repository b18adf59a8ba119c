"""Metrics of time: to a collision, exposed to a short one, between two at one place."""

import numpy as np

from bridgegen.assess.metrics.metric import (
    Metric,
    distance,
    in_steps,
    motion,
    recorded,
    shared,
    steps,
    without_failed,
)
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout

# --- ttc: smallest time to collision if all participants keep their velocity ---


def ttc(rollout: Rollout) -> Float:
    """Return the smallest two-dimensional time to collision of the ego with any other.

    At every instant both oriented boxes are predicted at constant velocity, speed v along the
    heading, without turning; the time to collision is when they first touch.

    Returns:
        ``(N,)`` float64 [s], 0 where the ego was in contact, +inf where no instant leads to a
        collision, NaN where the scenario failed.

    Source: paper, Table I; Jiao (2023), A fast calculation of two-dimensional Time-to-Collision.
    """
    from bridgegen.assess.metrics import _time_kernels as _ttc_kernels

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
    from bridgegen.assess.metrics import _time_kernels as _ttc_kernels

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


TTC = Metric(
    name="ttc",
    unit="s",
    description="smallest two-dimensional time to collision at constant velocity",
    sense="smaller",
    cap=20.0,  # a whole scenario at the crossroads; conflicts begin below 1.5 to 5 s
    compute=ttc,
)


# --- tet: time exposed to a short time to collision ---


TARGET = 3.0
"""Largest short time to collision [s]: 3 s in Autey et al. 2012; 1 to 5 s are in use."""


def tet(rollout: Rollout) -> Float:
    """Return the time exposed to a two-dimensional time to collision of at most `TARGET`.

    At every instant the least time to collision with any other counts; each instant lasts a time
    step.

    Returns:
        ``(N,)`` float64 [s], ≥ 0; NaN where the scenario failed.

    Source: Minderhoud, Bovy, Extended time-to-collision measures for road traffic safety
    assessment, Accid. Anal. Prev. 33 (2001) 89.
    """
    return without_failed(rollout, short_times(rollout)[:, 0] * rollout.time_step)


def short_times(rollout: Rollout) -> Float:
    """Return the number of instants with a short time to collision, and their total shortfall.

    Returns:
        ``(N, 2)`` float64: a count, and the sum of the differences to `TARGET` [s].
    """
    return shared(rollout, _short_times)


def _short_times(rollout: Rollout) -> Float:
    from bridgegen.assess.metrics import _time_kernels as _course_kernels

    m = motion(rollout)
    out = np.empty((len(m.n_steps), 2))
    _course_kernels.short_times(
        m.half, m.x, m.y, m.cosine, m.sine, m.v, m.distance, m.n_steps, TARGET, out
    )
    return out


TET = Metric(
    name="tet",
    unit="s",
    description="time exposed to a time to collision of 3 s or less",
    sense="larger",
    cap=0.0,
    compute=tet,
)


# --- tit: time-integrated shortfall of the time to collision ---


def tit(rollout: Rollout) -> Float:
    """Return the time integral of the difference between the target and the time to collision.

    As `tet`, with every instant weighted by the missing seconds.

    Returns:
        ``(N,)`` float64 [s²], ≥ 0; NaN where the scenario failed.

    Source: Minderhoud, Bovy, Extended time-to-collision measures for road traffic safety
    assessment, Accid. Anal. Prev. 33 (2001) 89.
    """
    return without_failed(rollout, short_times(rollout)[:, 1] * rollout.time_step)


TIT = Metric(
    name="tit",
    unit="s²",
    description="time integral of the time to collision's shortfall from 3 s",
    sense="larger",
    cap=0.0,
    compute=tit,
)


# --- thw: smallest time headway of the ego ---


def thw(rollout: Rollout) -> Float:
    """Return the smallest time headway of the ego to any other.

    It is the time in which the ego, straight ahead at its present speed, first touches the area
    that the other's body covers now: bumper to bumper when following, and the time to the crossing
    of crossing traffic.

    Returns:
        ``(N,)`` float64 [s], 0 at contact, +inf if no body was ever in front of the moving ego,
        NaN where the scenario failed.

    Source: Jansson, Collision Avoidance Theory, Linköping 2005; Westhofen et al., Criticality
    metrics for automated driving, Arch. Comput. Methods Eng. 30 (2023) 1, with bodies for points.
    """
    from bridgegen.assess.metrics import _time_kernels as _course_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    _course_kernels.headway(m.half, m.x, m.y, m.cosine, m.sine, m.v, m.distance, m.n_steps, out)
    return without_failed(rollout, out)


THW = Metric(
    name="thw",
    unit="s",
    description="smallest time headway: until the ego is where another is now",
    sense="smaller",
    cap=10.0,  # too long to count as following; countries fine below 0.4 to 1 s
    compute=thw,
)


# --- pet: post-encroachment time ---


LONGEST = 10.0
"""Longest time between two bodies at a point that is an encroachment [s]; conflicts have 1 to 5
s."""


def pet(rollout: Rollout) -> Float:
    """Return the smallest post-encroachment time between the ego and any other.

    It is the least time between an instant at which the one covers a point and one at which the
    other does, in either order: between leaving and entering the conflict area for crossing or
    merging traffic, and the time gap when following. The bodies are the oriented boxes; the
    resolution is the time step. A time longer than `LONGEST` is no encroachment.

    Returns:
        ``(N,)`` float64 [s], 0 where they were in contact, +inf where they have no point in
        common within `LONGEST`, NaN where the scenario failed.

    Source: Allen, Shin, Cooper, Analysis of traffic conflicts and collisions, Transp. Res. Rec.
    667 (1978) 67; Westhofen et al., Criticality metrics for automated driving, Arch. Comput.
    Methods Eng. 30 (2023) 1; the conflict area is all that both bodies cover at some time.
    """
    from bridgegen.assess.metrics import _time_kernels as _pet_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    longest = in_steps("LONGEST", LONGEST, rollout.time_step)
    _pet_kernels.encroachment(
        m.half, m.x, m.y, m.cosine, m.sine, m.distance, m.n_steps, longest, out
    )
    return without_failed(rollout, out * rollout.time_step)


PET = Metric(
    name="pet",
    unit="s",
    description="smallest post-encroachment time: between two bodies at the same point",
    sense="smaller",
    cap=LONGEST,
    compute=pet,
)
