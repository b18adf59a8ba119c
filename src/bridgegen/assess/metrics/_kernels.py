"""Compiled loops of the metrics, one scenario after the other; each metric's file wraps its own.

Only the first ``n_steps`` instants of a scenario count; the padding after them is never read.
"""

import math

import numpy as np

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import kernel

TIE = 1e-9
"""Difference up to which distances are equal [m]."""


@kernel
def closest_of(distance: Float, n: int) -> tuple[float, int]:
    """Return what ``closest`` writes, of one scenario."""
    best, at = np.inf, -1
    for e in range(1, distance.shape[0]):
        for k in range(n):
            best = min(best, distance[e, k])
    if best < np.inf:
        for e in range(1, distance.shape[0]):
            for k in range(n if at < 0 else at):
                if distance[e, k] <= best + TIE:
                    at = k
                    break
    return best, at


@kernel
def closest(distance: Float, n_steps: Int, least: Float, instant: Int) -> None:
    """Write the least distance and its first instant; +inf and −1 without other entities.

    The instant is the first within ``TIE`` of the least: at a constant gap, the last bits do not
    choose it.
    """
    for i in range(distance.shape[0]):
        least[i], instant[i] = closest_of(distance[i], n_steps[i])


@kernel
def contacts(distance: Float, n_steps: Int, merge_steps: int, out: Float) -> None:
    """Count contacts; one resumed within ``merge_steps`` of its last instant is the same."""
    n_rows, n_entities, _ = distance.shape
    for i in range(n_rows):
        count = 0
        for e in range(1, n_entities):
            last = -1
            for k in range(n_steps[i]):
                if distance[i, e, k] == 0.0:
                    if last < 0 or k - last > merge_steps:
                        count += 1
                    last = k
        out[i] = count


@kernel
def largest_offset(offset: Float, n_steps: Int, out: Float) -> None:
    """Write the ego's largest absolute offset."""
    for i in range(offset.shape[0]):
        most = 0.0
        for k in range(n_steps[i]):
            most = max(most, abs(offset[i, 0, k]))
        out[i] = most


@kernel
def widen(high: Float, low: Float, shift: int, n: int) -> None:
    """Extend window k by window k + shift: maximum and minimum, in place."""
    for k in range(n - shift):
        high[k] = max(high[k], high[k + shift])
        low[k] = min(low[k], low[k + shift])


@kernel
def acceleration_change(a: Float, n_steps: Int, window: int, out: Float) -> None:
    """Write the largest range of the ego's acceleration in any window of ``window`` steps.

    Windows grow by doubling: log₂(window) passes instead of comparing every pair.
    """
    n_rows, _, n_instants = a.shape
    high = np.empty(n_instants)
    low = np.empty(n_instants)
    for i in range(n_rows):
        n = n_steps[i]
        for k in range(n):
            high[k] = low[k] = a[i, 0, k]
        length = 1
        while 2 * length <= window + 1:
            widen(high, low, length, n)
            length *= 2
        # The rest of the window: both halves overlap, which neither maximum nor minimum minds.
        if window + 1 > length:
            widen(high, low, window + 1 - length, n)
        most = 0.0
        for k in range(n):
            most = max(most, high[k] - low[k])
        out[i] = most


@kernel
def braking_edges(a: Float, n_steps: Int, threshold: float, out: Float) -> None:
    """Count how often the ego's deceleration rises to the threshold; before instant 0 it is 0."""
    for i in range(a.shape[0]):
        count = 0
        braking = False
        for k in range(n_steps[i]):
            hard = -a[i, 0, k] >= threshold
            if hard and not braking:
                count += 1
            braking = hard
        out[i] = count


# --- Compiled box centres of bodies; public wrapper: ``motion.motion`` ---


@kernel
def place_row(
    box: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    n: int,
    centre_x: Float,
    centre_y: Float,
) -> None:
    """Write the centre of each body's box, ``(E, T)``."""
    for e in range(x.shape[0]):
        ahead = box[e, 2]
        for k in range(n):
            centre_x[e, k] = x[e, k] + ahead * cosine[e, k]
            centre_y[e, k] = y[e, k] + ahead * sine[e, k]


@kernel
def place(
    box: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    n_steps: Int,
    centre_x: Float,
    centre_y: Float,
) -> None:
    """Write the centre of each body's box."""
    for i in range(x.shape[0]):
        place_row(box, x[i], y[i], cosine[i], sine[i], n_steps[i], centre_x[i], centre_y[i])


# --- Compiled turning round of bodies that reverse; public wrapper: ``metric.motion`` ---


STANDS = 0.05
"""Speed below which a body stands, and does not turn round by the sign of noise [m/s]."""


@kernel
def turn_round(cosine: Float, sine: Float, v: Float, a: Float, reverses: Bool) -> None:
    """Have a body ``(T,)`` that reverses drive forwards in the opposite direction, in place.

    ``reverses`` becomes when it does: while it stands, as it did before. One that has not driven
    yet stands as it will drive; where it never drives, its sign decides.
    """
    n, first = len(v), 0
    while first < n and abs(v[first]) <= STANDS:
        first += 1
    backwards = first < n and v[first] < 0.0
    for k in range(n):
        # A body that stands has the sign of before; its noise must not make it drive the other way.
        if first == n or abs(v[k]) > STANDS:
            backwards = v[k] < 0.0
        reverses[k] = backwards
        if backwards:
            cosine[k], sine[k], v[k], a[k] = -cosine[k], -sine[k], -v[k], -a[k]
        if v[k] <= 0.0:
            v[k] = 0.0


@kernel
def turn_rows_round(cosine: Float, sine: Float, v: Float, a: Float, reverses: Bool) -> None:
    """Turn the bodies of N rows round, ``(N, E, T)``."""
    for i in range(v.shape[0]):
        for e in range(v.shape[1]):
            turn_round(cosine[i, e], sine[i, e], v[i, e], a[i, e], reverses[i, e])


# --- Compiled count of red lights run; public wrapper: ``r_red.r_red`` ---


RED, RED_AND_YELLOW = 1, 2  # of Rollout.lights


@kernel
def red_lights(
    front: float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    lines: Float,
    stop_lights: Int,
    lights: Int,
    n_steps: Int,
    aside: float,
    out: Float,
) -> None:
    """Count the lights whose stop line the ego crosses while they are red.

    ``front`` [m] is how far its front bumper is ahead of its reference point.
    """
    n_rows, n_lights, _ = lights.shape
    ran = np.empty(n_lights, dtype=np.bool_)
    for i in range(n_rows):
        ran[:] = False
        for j in range(lines.shape[1]):
            c, s = elementary.cos(lines[i, j, 2]), elementary.sin(lines[i, j, 2])
            light = stop_lights[j]
            before = math.inf
            for k in range(n_steps[i]):
                px = (x[i, 0, k] - lines[i, j, 0]) + front * cosine[i, 0, k]
                py = (y[i, 0, k] - lines[i, j, 1]) + front * sine[i, 0, k]
                past = px * c + py * s
                if before <= 0.0 and past > 0.0 and abs(py * c - px * s) <= aside:
                    # The state before the step in which the line was passed.
                    state = lights[i, light, k - 1]
                    ran[light] = ran[light] or state in (RED, RED_AND_YELLOW)
                before = past
        out[i] = np.sum(ran)


# --- Compiled RSS distances; public wrapper: ``rss.rss``, with its ``Parameters`` as an array ---


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
    half: Float,
    x: Float,
    y: Float,
    cosine: Float,
    sine: Float,
    v: Float,
    distance: Float,
    n_steps: Int,
    p: Float,
    out: Float,
) -> None:
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
