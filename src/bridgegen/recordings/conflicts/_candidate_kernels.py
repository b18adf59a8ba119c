"""Compiled search for participants that come near each other; wrapper: ``candidates``."""

from math import sqrt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel


@kernel
def mark_pairs(
    order: Int,
    first: Int,
    participant: Int,
    x: Float,
    y: Float,
    vx: Float,
    vy: Float,
    reach: Float,
    moves: Bool,
    horizon: float,
    farthest: float,
    keys: Int,
) -> int:
    """Write the pairs that would come within reach of each other at constant velocity.

    A pair is p · P + q with p < q, P participants; it is written at each instant.

    Args:
        order: ``(S,)`` states by instant and then by x.
        first: ``(K + 1,)`` where each instant begins in ``order``.
        participant: ``(S,)`` of each state.
        x: ``(S,)`` [m].
        y: ``(S,)`` [m].
        vx: ``(S,)`` [m/s].
        vy: ``(S,)`` [m/s].
        reach: ``(P,)`` radius around the centre [m].
        moves: ``(P,)`` whether a participant ever does.
        horizon: how far ahead [s].
        farthest: pairs that are farther apart are none [m].
        keys: takes the pairs; what exceeds it is counted, not written.

    Returns:
        How many there are.
    """
    count, total = 0, len(reach)
    for k in range(len(first) - 1):
        for i in range(first[k], first[k + 1]):
            a = order[i]
            p = participant[a]
            for j in range(i + 1, first[k + 1]):
                b = order[j]
                dx = x[b] - x[a]
                if dx > farthest:
                    break
                dy = y[b] - y[a]
                q = participant[b]
                if abs(dy) > farthest or not (moves[p] or moves[q]):
                    continue
                wx, wy = vx[b] - vx[a], vy[b] - vy[a]
                square = wx * wx + wy * wy
                t = 0.0
                if square > 1e-12:
                    t = min(max(-(dx * wx + dy * wy) / square, 0.0), horizon)
                mx, my = dx + wx * t, dy + wy * t
                if sqrt(mx * mx + my * my) < reach[p] + reach[q]:
                    if count < len(keys):
                        keys[count] = min(p, q) * total + max(p, q)
                    count += 1
    return count
