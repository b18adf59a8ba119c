"""btn: brake threat number, the share of its brakes that the ego needs."""

import numpy as np

from bridgegen.assess.metrics.drac import MOST
from bridgegen.assess.metrics.metric import Metric, without_failed
from bridgegen.assess.metrics.motion import motion
from bridgegen.base.arrays import Float
from bridgegen.base.physics import GRIP
from bridgegen.simulation.rollout import Rollout


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
        m.half, m.x, m.y, m.cosine, m.sine, m.v, m.a, m.distance, m.n_steps,
        MOST, out,
    )  # fmt: skip
    return without_failed(rollout, out / available)


METRIC = Metric(
    name="btn",
    unit="1",
    description="largest brake threat number: required deceleration over what tyres give",
    sense="larger",
    cap=0.0,
    compute=btn,
)
