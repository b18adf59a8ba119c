"""Compiled search of neighbours along lanes; public wrapper: ``neighbours.Neighbours``."""

import math

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.compiled import inlined_kernel, kernel

MOST_VISITS = 64
"""Largest number of lanes that are searched for one neighbour."""


@inlined_kernel
def _block(keys: Int, key: int) -> int:
    low, high = 0, len(keys)
    while low < high:
        middle = (low + high) // 2
        if keys[middle] < key:
            low = middle + 1
        else:
            high = middle
    return low if low < len(keys) and keys[low] == key else -1


@kernel
def nearest(
    lane: Int,
    target: Int,
    instant: Int,
    station: Float,
    rank: Int,
    order: Int,
    keys: Int,
    first: Int,
    ends: Float,
    next_first: Int,
    following: Int,
    ahead: bool,
    horizon: float,
    out_state: Int,
    out_distance: Float,
) -> None:
    """Find the nearest other state ahead or behind, at the same instant, along each target lane.

    ``order``: states on lanes, sorted by instant, lane and station; ``rank``: their places in it,
    -1 off the lanes; ``keys``, ``first``: the stretches of it of one instant and lane, by
    instant · L + lane; ``ends``: ``(L, 2)`` stations; ``following``: lanes that follow (ahead) or
    lead to (behind) each.
    """
    n_lanes = len(ends)
    waiting = np.zeros(MOST_VISITS, np.int64)
    before = np.zeros(MOST_VISITS)
    for i in range(len(lane)):
        if lane[i] < 0 or target[lane[i]] < 0:
            continue
        own = target[lane[i]]
        base = instant[i] * n_lanes
        s = station[i]
        least, found = horizon, -1
        block = _block(keys, base + own)
        if block >= 0:
            low, high = first[block], first[block + 1]
            if own == lane[i] and rank[i] >= 0:
                at = rank[i] + 1 if ahead else rank[i] - 1
            else:
                a, b = low, high
                while a < b:
                    middle = (a + b) // 2
                    if station[order[middle]] < s:
                        a = middle + 1
                    else:
                        b = middle
                at = a if ahead else a - 1
            if low <= at < high:
                distance = abs(station[order[at]] - s)
                if distance <= least:
                    least, found = distance, order[at]
        if found < 0:
            waiting[0] = own
            before[0] = ends[own, 1] - s if ahead else s - ends[own, 0]
            done, count = 0, 1
            while done < count:
                here, distance = waiting[done], max(before[done], 0.0)
                done += 1
                if distance >= least:
                    continue
                for k in range(next_first[here], next_first[here + 1]):
                    lane_on = following[k]
                    block = _block(keys, base + lane_on)
                    if block >= 0:
                        low, high = first[block], first[block + 1]
                        if ahead:
                            other = order[low]
                            total = distance + station[other] - ends[lane_on, 0]
                        else:
                            other = order[high - 1]
                            total = distance + ends[lane_on, 1] - station[other]
                        if total <= least and other != i:
                            least, found = total, other
                    elif count < MOST_VISITS:
                        waiting[count] = lane_on
                        before[count] = distance + ends[lane_on, 1] - ends[lane_on, 0]
                        count += 1
        out_state[i] = found
        out_distance[i] = least if found >= 0 else math.inf
