"""Following a planned trajectory: a car's acceleration and curvature at one instant.

A plan is ``(K, 6)`` float64: time since it was made [s], x, y [m], heading [rad], speed [m/s], and
its station, the length of its path up to there [m]. Its path is taken apart from its schedule: the
path says where to steer, the schedule how fast to go and how far to be. So a car that is late, or
that the tyres did not stop in time, still steers along the path beside it.

Steering is the curvature of the path over the next step, and feedback of the offset d and of the
heading's error e: κ = κ_path − d/L² − (2/L)·sin e. Over the distance travelled, this is the
critically damped law of Kanayama et al. (1990) with the length L. Speed is the plan's acceleration
over the next step, and feedback of the speed's error and of the distance that the car is ahead,
critically damped as well.

Source: Y. Kanayama, Y. Kimura, F. Miyazaki, T. Noguchi, A stable tracking control method for an
autonomous mobile robot, IEEE ICRA 1990, equation 8 and proposition 3.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel

TIME, X, Y, H, V, STATION = 0, 1, 2, 3, 4, 5
SIZE = 6

RATE = 1.5  # 1/s, of the errors along the path, at which they decay
SECONDS, LEAST_LENGTH = 0.6, 3.0  # s at the car's speed, m at least: L, over which others decay
MOST = 2.0  # m, of an error that counts: what is farther off is not approached any faster
STANDS = 0.01  # m/s, below which a plan stands
STOPS = 0.3  # m/s, below which a car stops at once where its plan stands
SHORT = 0.01  # m, the shortest path over which a curvature is measured
FEET = 4  # steps to the foot on the path; an error of an offset d decays by d·κ each


@kernel
def lay(plan):
    """Make the headings of a plan continuous, and fill its stations: arcs between its states."""
    plan[0, STATION] = 0.0
    for i in range(1, len(plan)):
        turn = plan[i, H] - plan[i - 1, H]
        turn -= 2.0 * math.pi * math.floor(turn / (2.0 * math.pi) + 0.5)
        plan[i, H] = plan[i - 1, H] + turn
        chord = elementary.hypot(plan[i, X] - plan[i - 1, X], plan[i, Y] - plan[i - 1, Y])
        half = min(0.5 * abs(turn), 0.5 * math.pi)
        arc = chord * half / elementary.sin(half) if half > 1e-6 else chord
        plan[i, STATION] = plan[i - 1, STATION] + arc


@kernel
def pose(plan, s):
    """Return (x, y, heading) at a station of a plan's path; straight on beyond its ends.

    Between two states: a cubic Hermite curve with their headings, and a heading that is linear.
    """
    last = len(plan) - 1
    if s <= 0.0 or s >= plan[last, STATION]:
        i = 0 if s <= 0.0 else last
        h, beyond = plan[i, H], s - plan[i, STATION]
        return plan[i, X] + beyond * elementary.cos(h), plan[i, Y] + beyond * elementary.sin(h), h
    i = 0
    while plan[i + 1, STATION] <= s:
        i += 1
    length = plan[i + 1, STATION] - plan[i, STATION]
    u = (s - plan[i, STATION]) / length
    before, after = plan[i, H], plan[i + 1, H]
    at = u * u * (3.0 - 2.0 * u)
    leaves, arrives = length * u * (1.0 - u) * (1.0 - u), length * u * u * (u - 1.0)
    x = plan[i, X] + at * (plan[i + 1, X] - plan[i, X])
    y = plan[i, Y] + at * (plan[i + 1, Y] - plan[i, Y])
    return (
        x + leaves * elementary.cos(before) + arrives * elementary.cos(after),
        y + leaves * elementary.sin(before) + arrives * elementary.sin(after),
        before + u * (after - before),
    )


@kernel
def schedule(plan, since):
    """Return (station, speed) that a plan has at a time; its speed is linear between states."""
    i = 0
    while i < len(plan) - 2 and plan[i + 1, TIME] <= since:
        i += 1
    u = (since - plan[i, TIME]) / (plan[i + 1, TIME] - plan[i, TIME])
    u = min(max(u, 0.0), 1.0)
    v, gained = plan[i, V], plan[i + 1, V] - plan[i, V]
    whole = 2.0 * v + gained
    share = (2.0 * v + gained * u) * u / whole if whole > 0.0 else u
    length = plan[i + 1, STATION] - plan[i, STATION]
    return plan[i, STATION] + share * length, v + u * gained


@kernel
def follow(plan, since, dt, x, y, h, v):
    """Return (acceleration [m/s²], curvature [1/m]) of a car that follows a plan for one step.

    ``since`` is the time since the plan was made, ``dt`` the step [s]; x, y [m], h [rad] and
    v [m/s] are the car's. Where the plan stands, a slow car stops, and does not move up to it.
    """
    planned, pace = schedule(plan, since)
    _, later = schedule(plan, since + dt)
    s = planned
    px, py, ph = pose(plan, s)
    # By the foot on the path, not by the state planned for now: on a bend of 20 m, ten metres late,
    # that is 2.4 m to the side, and would be steered towards.
    for _ in range(FEET):
        s += elementary.cos(ph) * (x - px) + elementary.sin(ph) * (y - py)
        px, py, ph = pose(plan, s)
    ahead = min(max(s - planned, -MOST), MOST)
    # The plan's mean over the step, not its value now: so a plan that the kinematic bicycle can
    # drive leaves no error.
    a = (later - pace) / dt - 2.0 * RATE * (v - pace) - RATE * RATE * ahead
    if pace <= STANDS and later <= STANDS and v <= STOPS:
        a = -v / dt
    travels = max(v * dt + 0.5 * a * dt * dt, SHORT)
    _, _, bent = pose(plan, s + travels)
    aside = elementary.cos(ph) * (y - py) - elementary.sin(ph) * (x - px)
    aside = min(max(aside, -MOST), MOST)
    length = max(SECONDS * v, LEAST_LENGTH)
    curvature = (bent - ph) / travels - aside / (length * length)
    return a, curvature - 2.0 / length * elementary.sin(h - ph)


@kernel
def lay_rows(plans):
    """Prepare the plans ``(N, K, 6)`` of N rows; see ``lay``."""
    for i in range(len(plans)):
        lay(plans[i])


@kernel
def follow_rows(plans, since, dt, states, running, demanded, curvature):
    """Fill ``(N,)`` what the running rows demand; ``states`` ``(N, 4)`` are x, y, h, v."""
    for i in range(len(plans)):
        if running[i]:
            demanded[i], curvature[i] = follow(
                plans[i], since, dt, states[i, 0], states[i, 1], states[i, 2], states[i, 3]
            )
