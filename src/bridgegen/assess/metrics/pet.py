"""pet: post-encroachment time."""

import numpy as np

from bridgegen.assess.metrics.metric import Metric, in_steps, without_failed
from bridgegen.assess.metrics.motion import motion
from bridgegen.base.arrays import Float
from bridgegen.simulation.rollout import Rollout

LONGEST = 10.0
"""[s] Conflicts have 1 to 5 s."""


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
    from bridgegen.assess.metrics import _pet_kernels

    m = motion(rollout)
    out = np.empty(len(m.n_steps))
    longest = in_steps("LONGEST", LONGEST, rollout.time_step)
    _pet_kernels.encroachment(
        m.half, m.x, m.y, m.cosine, m.sine, m.distance, m.n_steps, longest, out
    )
    return without_failed(rollout, out * rollout.time_step)


METRIC = Metric(
    name="pet",
    unit="s",
    description="smallest post-encroachment time: between two bodies at the same point",
    sense="smaller",
    cap=LONGEST,
    compute=pet,
)
