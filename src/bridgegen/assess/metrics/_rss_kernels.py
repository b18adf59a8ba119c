"""Compiled RSS distances; public wrapper: ``rss.rss``, with its ``Parameters`` as an array."""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import kernel

EGO_RESPONSE, OTHER_RESPONSE, ACCEL, BRAKE, HARD_BRAKE, SIDE_ACCEL, SIDE_BRAKE, MARGIN = range(8)


@kernel
def advance(v: float, response: float, accel: float, brake: float) -> float:
    """Return the worst-case distance [m] of a body that approaches at v [m/s]; < 0: it recedes.

    It accelerates during its response time, then brakes to a stop.
    """
    after = v + response * accel
    return 0.5 * (v + after) * response + after * abs(after) / (2.0 * brake)


@kernel
def approach(v: float, toward: float, response: float, p: Float) -> float:
    """Return `advance` on an axis; ``toward`` is the cosine of the body's heading to it.

    A receding one may brake hard at once, as a leader does, except for its lateral motion.
    """
    share = abs(toward)
    across = math.sqrt(max(1.0 - share * share, 0.0))
    accel = max(toward, 0.0) * p[ACCEL] + across * p[SIDE_ACCEL]
    brake = share * p[BRAKE] + across * p[SIDE_BRAKE]
    worst: float = advance(v * toward, response, accel, brake)
    if toward < 0.0:
        braking = -((v * toward) ** 2) / (2.0 * p[HARD_BRAKE])
        worst = share * share * braking + across * across * worst
    return worst


@kernel
def share_of_safe(gap: float, safe: float) -> float:
    """Return a distance as a share of the safe one; 1 if it is safe."""
    if gap <= 0.0:
        return 0.0
    return gap / safe if gap < safe else 1.0


@kernel
def missing_share(
    half: Float, x: Float, y: Float, cosine: Float, sine: Float, v: Float, distance: Float,
    n_steps: Int, p: Float, out: Float,
) -> None:  # fmt: skip
    """Write the largest share of the safe distances that is missing both along and across."""
    n_rows, n_entities, n_instants = x.shape
    la, wa = half[0, 0], half[0, 1]
    ego_across = approach(0.0, 0.0, p[EGO_RESPONSE], p)
    ego_ahead, ego_back = np.empty(n_instants), np.empty(n_instants)
    for i in range(n_rows):
        least = 1.0
        for k in range(n_steps[i]):
            ego_ahead[k] = approach(v[i, 0, k], 1.0, p[EGO_RESPONSE], p)
            ego_back[k] = approach(v[i, 0, k], -1.0, p[EGO_RESPONSE], p)
        for e in range(1, n_entities):
            lb, wb = half[e, 0], half[e, 1]
            for k in range(n_steps[i]):
                if distance[i, e, k] == math.inf:
                    continue
                ca, sa = cosine[i, 0, k], sine[i, 0, k]
                dx, dy = x[i, e, k] - x[i, 0, k], y[i, e, k] - y[i, 0, k]
                c = ca * cosine[i, e, k] + sa * sine[i, e, k]
                s = ca * sine[i, e, k] - sa * cosine[i, e, k]
                ahead, left = dx * ca + dy * sa, dy * ca - dx * sa
                vb = v[i, e, k]
                gap = abs(ahead) - (la + (abs(c) * lb + abs(s) * wb))
                side = abs(left) - (wa + (abs(s) * lb + abs(c) * wb))
                across = 0.0
                if side > 0.0:
                    to = 1.0 if left > 0.0 else -1.0
                    safe = ego_across + approach(vb, -to * s, p[OTHER_RESPONSE], p)
                    across = share_of_safe(side, p[MARGIN] + max(safe, 0.0))
                    if across >= least:  # most are: vehicles in another lane
                        continue
                along = 0.0
                if gap > 0.0:
                    to = 1.0 if ahead > 0.0 else -1.0
                    safe = ego_ahead[k] if ahead > 0.0 else ego_back[k]
                    safe += approach(vb, -to * c, p[OTHER_RESPONSE], p)
                    along = share_of_safe(gap, safe)
                least = min(least, max(along, across))
        out[i] = 1.0 - least
