"""Speed control: over a time or at a rate, by a profile, to a gap, to arrive in time.

Formulas of one body, without the storyboard; ``_speed_kernels`` selects between them. Choices that
the standard leaves open are in docs/decisions.md.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base.compiled import kernel
from bridgegen.simulation.embedded._motion_kernels import (
    CUBIC,
    RATE,
    SINUSOIDAL,
    STEP,
    TIME,
    progress,
)

# esmini's figure; the standard leaves open how a distance is reached.
STIFFNESS = 0.4  # 1/m, of the spring that closes a gap, per m/s² of the strongest acceleration
T, V, A, J = 0, 1, 2, 3  # columns of a profile: from when on [s], speed, acceleration, jerk there


@kernel
def steepest(shape):
    """Return the largest slope of a shape from 0 to 1 over 0 to 1."""
    # A rate is a limit, so it counts at the steepest place, as in esmini: 3/2 of a cubic's mean,
    # π/2 of a sinusoidal's.
    if shape == CUBIC:
        return 1.5
    if shape == SINUSOIDAL:
        return 0.5 * math.pi
    return 1.0


@kernel
def change_time(shape, dimension, value, before, after, most):
    """Return how long [s] a change of speed takes; 0 at once.

    By a rate [m/s²], the steepest of the shape; a time [s]; or a distance [m], over which the mean
    speed of every shape is the mean of both ends. ``most`` [m/s²] is never exceeded: a change
    takes longer instead.
    """
    change = abs(after - before)
    if shape == STEP or change == 0.0:
        return 0.0
    least = steepest(shape) * change / most
    if dimension == TIME:
        return max(value, least)
    if dimension == RATE:
        return max(steepest(shape) * change / abs(value), least)
    # Over the time, not the distance itself: by distance, braking to rest would never end, and a
    # start from rest never begin.
    return max(2.0 * value / max(before + after, 1e-9), least)


@kernel
def changed(shape, before, after, share):
    """Return the speed at a share of the time of its change."""
    return before + progress(shape, share)[0] * (after - before)


@kernel
def spring(gap_error, closing, acceleration, limits, dt):
    """Return the acceleration [m/s²] that brings a body to its place beside another one.

    A critically damped spring: its stiffness goes with the acceleration that ends the approach
    (`STIFFNESS`), which is a deceleration if the body is behind its place.

    Args:
        gap_error: how far it is behind its place [m].
        closing: its speed less the other's [m/s].
        acceleration: its present one [m/s²].
        limits: acceleration, deceleration [m/s²], speed [m/s], rates of both [m/s³].
        dt: [s].
    """
    stiffness = STIFFNESS * (limits[1] if gap_error > 0.0 else limits[0])
    wanted = gap_error * stiffness - closing * 2.0 * math.sqrt(stiffness)
    wanted = min(max(wanted, -limits[1]), limits[0])
    if wanted < min(acceleration, 0.0):
        return max(wanted, acceleration - limits[4] * dt)
    if wanted > max(acceleration, 0.0):
        return min(wanted, acceleration + limits[3] * dt)
    return wanted


@kernel
def meeting_speed(left, time, v, final, has_final, dt):
    """Return the speed [m/s] a step on of a body that is to be somewhere at a certain time.

    With a final speed, it accelerates and decelerates (or the other way round) equally strongly,
    and stands in between if it must; without, its acceleration is constant. Asked again at every
    instant, it follows the same course if the time to go turns out as foreseen.

    Args:
        left: the way that is left [m], > 0.
        time: the remaining time [s], > 0; inf: unknown.
        v: its speed now [m/s].
        final: its speed there [m/s].
        has_final: whether there is one.
        dt: [s].
    """
    if not has_final:
        if time == math.inf:
            return max(v - 0.5 * v * v / left * dt, 0.0)
        return max(v + 2.0 * (left - v * time) / (time * time) * dt, 0.0)
    mean = left / time
    root = math.sqrt((mean - 0.5 * (v + final)) ** 2 + 0.25 * (v - final) ** 2)
    apex = mean + root if mean > 0.5 * (v + final) else mean - root
    # The speed in between would be below 0.
    if apex < 0.0 or time == math.inf:  # it stops on the way, and waits
        return max(v - 0.5 * (v * v + final * final) / left * dt, 0.0)
    slope = (2.0 * apex - v - final) / time
    turn = (apex - v) / slope if slope != 0.0 else math.inf
    if dt <= turn:
        return v + slope * dt
    return max(apex - slope * (min(dt, time) - turn), 0.0)


@kernel
def lay_out(v, acceleration, speeds, times, n, follow, limits, profile):
    """Write the course of a speed through n entries to ``profile``, and return its rows.

    Straight from entry to entry, no steeper than the limits allow: then an entry comes later. If
    it is to be followed smoothly, its corners are rounded at the greatest jerk; where there is no
    room to round them, they stay.

    Args:
        v: the speed now [m/s].
        acceleration: and its change [m/s²].
        speeds: ``(≥ n,)`` [m/s].
        times: ``(≥ n,)`` after the entry before [s]; NaN: as soon as can be.
        n: how many entries.
        follow: whether corners are rounded.
        limits: acceleration, deceleration [m/s²], speed [m/s], rates of both [m/s³].
        profile: ``(≥ 3·n + 5, 4)``, written: T, V, A, J of each part, in order.
    """
    count, now = 1, 0.0
    profile[0, T], profile[0, V] = 0.0, v
    for i in range(n):
        speed, takes = min(max(speeds[i], 0.0), limits[2]), times[i]
        change = speed - profile[count - 1, V]
        if takes == 0.0 and not (follow and i == 0):
            profile[count - 1, V] = speed
            continue
        if takes == 0.0:
            continue
        least = abs(change) / (limits[0] if change > 0.0 else limits[1])
        if change == 0.0 and math.isnan(takes):
            continue
        takes = least if math.isnan(takes) else max(takes, least)
        now += takes
        profile[count - 1, A] = change / takes
        profile[count, T], profile[count, V] = now, speed
        count += 1
    profile[count - 1, A] = 0.0
    for i in range(count):
        profile[i, J] = 0.0
    if not follow or count == 1 or (limits[3] == math.inf and limits[4] == math.inf):
        return count
    if count == 2:
        # One entry is the trapezoid of acceleration that a change of speed with a jerk means;
        # esmini, too, treats it as a case of its own.
        rows = _one_change(profile[1, T], acceleration, limits, profile[count:], profile)
    else:
        rows = _rounded(count, acceleration, limits, profile[count:], profile)
    for i in range(rows):
        for column in range(profile.shape[1]):  # a whole row would compile the text of an error
            profile[i, column] = profile[count + i, column]
    return rows if rows > 0 else count


@kernel
def _one_change(time, acceleration, limits, out, profile):
    """Write a change to one speed: rise to an acceleration, hold it, let it go; in time if it can.

    Takes the change from the first two rows of ``profile``; returns the rows of ``out``, 0 if there
    is none.
    """
    v, final = profile[0, V], profile[1, V]
    way = 1.0 if final > v else -1.0
    change = abs(final - v)
    if change == 0.0:
        return 0
    most, rise, fall = limits[0], limits[3], limits[4]
    if way < 0.0:
        most, rise, fall = limits[1], limits[4], limits[3]
    u, w = 1.0 / rise, 1.0 / fall
    own = max(way * acceleration, 0.0)
    room = change + 0.5 * own * own * u
    inner = (time + own * u) ** 2 - 2.0 * (u + w) * room
    if inner >= 0.0:  # the lesser root, without the difference that a small change would cancel
        held = 2.0 * room / (time + own * u + math.sqrt(inner))
    else:
        held = math.sqrt(2.0 * room / (u + w))
    held = min(held, most)
    own = min(own, held)
    up, down = (held - own) * u, held * w
    gained = 0.5 * (held + own) * up
    lost = 0.5 * held * down
    holds = max(change - gained - lost, 0.0) / held
    out[0, T], out[0, V], out[0, A], out[0, J] = 0.0, v, way * own, way * rise if u > 0.0 else 0.0
    out[1, T], out[1, V], out[1, A], out[1, J] = up, v + way * gained, way * held, 0.0
    out[2, T], out[2, V] = up + holds, final - way * lost
    out[2, A], out[2, J] = way * held, -way * fall if w > 0.0 else 0.0
    out[3, T], out[3, V], out[3, A], out[3, J] = up + holds + down, final, 0.0, 0.0
    return 4


@kernel
def _rounded(count, acceleration, limits, out, profile):
    """Write the first rows of ``profile`` with their corners rounded; return how many rows.

    A corner becomes a parabola that joins its lines smoothly. 0: there is no room for one.
    """
    v, slope = profile[0, V], acceleration
    jerk = limits[3] if profile[0, A] > slope else -limits[4]
    takes = (profile[0, A] - slope) / jerk
    out[0, T], out[0, V], out[0, A], out[0, J] = 0.0, v, slope, jerk if takes > 0.0 else 0.0
    v += 0.5 * (slope + profile[0, A]) * takes
    now, slope, rows = takes, profile[0, A], 2
    out[1, T], out[1, V], out[1, A], out[1, J] = now, v, slope, 0.0
    for i in range(1, count):
        after = profile[i, A]
        if after == slope:
            continue
        meet = (profile[i, V] - after * profile[i, T] - v + slope * now) / (slope - after)
        jerk = limits[3] if after > slope else -limits[4]
        takes = (after - slope) / jerk
        begins = meet - 0.5 * takes
        if not begins >= now - 1e-9:
            return 0
        v += slope * (begins - now)
        out[rows, T], out[rows, V], out[rows, A] = begins, v, slope
        out[rows, J] = jerk if takes > 0.0 else 0.0
        v += 0.5 * (slope + after) * takes
        now, slope = begins + takes, after
        out[rows + 1, T], out[rows + 1, V], out[rows + 1, A] = now, v, slope
        out[rows + 1, J] = 0.0
        rows += 2
    return rows


@kernel
def profile_speed(profile, n, passed):
    """Return the speed [m/s] so many seconds after a profile of n rows began."""
    i = 0
    while i + 1 < n and profile[i + 1, T] <= passed:
        i += 1
    t = passed - profile[i, T]
    return profile[i, V] + t * (profile[i, A] + 0.5 * t * profile[i, J])
