"""How bodies move: the bicycle of the ego, and speeds and lanes that change by a shape."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.drivers._path_kernels import X, Y, project

STEP, LINEAR, CUBIC, SINUSOIDAL = 0, 1, 2, 3
RATE, TIME, DISTANCE = 0, 1, 2
SAME_SPEED, SAME_TIME = 1e-9, 1e-9  # m/s, s, what is less is rounding
SLOW = 1.0  # m/s, below which no bend is sharp enough to slide down a bank: the wheels roll
STANDS = 1e-6  # m/s, below which a body stands
SEARCH_STEP = 5.0  # m, between the points at which a foot on another path is first looked for


@kernel
def bicycle(x, y, h, v, demanded, curvature, limits, friction_limit, uphill, aside, dt):
    """Return (x, y, h, v, a) one step on, and the acceleration that engine, brakes, tyres gave.

    Kinematic bicycle at the rear axle. ``limits`` are those of speed, acceleration, deceleration,
    and curvature (full lock) on a level road. Gravity acts against the motion by ``uphill`` and to
    the right by ``aside`` [m/s²]; engine, brakes and tyres act against it. Inside the friction
    circle the demand is met; outside, both parts of the tyres' force shrink to the circle.
    """
    # Gravity changes what engine and brakes can give, not what the driver gets: the control of a
    # production vehicle makes up for the grade.
    a = min(max(demanded, -limits[2] - uphill), limits[1] - uphill)
    bend = min(max(curvature, -limits[3]), limits[3])
    # What the tyres must give, gravity included: on a downgrade of 6 % a dry road leaves 7.7 m/s²
    # of braking instead of 8.3.
    total = elementary.hypot(a + uphill, v * v * bend + aside)
    if total > friction_limit:
        share = friction_limit / total
        a = share * (a + uphill) - uphill
        # What the tyres cannot hold against the bank lets the vehicle slide down it.
        bend = share * bend - (1.0 - share) * aside / max(v * v, SLOW * SLOW)
        bend = min(max(bend, -limits[3]), limits[3])
    # A brake does not drive backwards: within the step the car comes to a stand.
    end = min(max(v + a * dt, 0.0), limits[0])
    a = (end - v) / dt
    # The trapezoidal rule, exact for a constant acceleration. esmini moves by the speed at the
    # step's end.
    travelled = 0.5 * (v + end) * dt
    middle = h + 0.5 * travelled * bend
    return (
        x + travelled * elementary.cos(middle),
        y + travelled * elementary.sin(middle),
        h + travelled * bend,
        end,
        a,
    )


@kernel
def ramped(value, target, most):
    """Return a value moved towards its target by no more than so much."""
    return value + min(max(target - value, -most), most)


@kernel
def ramp_mean(value, target, rate, dt):
    """Return the mean over a step of a value that moves to its target at a rate, and stays there.

    Exact: an infinite rate reaches the target at once.
    """
    lasts = abs(target - value) / rate if rate > 0.0 else 0.0
    if lasts >= dt:
        return 0.5 * (value + ramped(value, target, rate * dt))
    # The trapezoidal rule over the whole step would lose half a step's way where the speed jumps:
    # 0.5 m of the 40 m of 10 m/s for 1 s, then 30 m/s.
    return target - 0.5 * (target - value) * (lasts / dt)


@kernel
def standing(stood, before, after, dt):
    """Return for how long a body has stood [s] at the end of a step, by its speeds [m/s]."""
    return stood + dt if abs(before) <= STANDS and abs(after) <= STANDS else 0.0


@kernel
def progress(shape, u):
    """Return (share of the change, its derivative) at the share u of its time or distance."""
    if u >= 1.0:
        return 1.0, 0.0
    if shape == SINUSOIDAL:
        return 0.5 - 0.5 * elementary.cos(math.pi * u), 0.5 * math.pi * elementary.sin(math.pi * u)
    if shape == CUBIC:
        return u * u * (3.0 - 2.0 * u), 6.0 * u * (1.0 - u)
    return u, 1.0


@kernel
def shifted(x, y, h, aside):
    """Return the point so far to the left of another one [m]."""
    return x - aside * elementary.sin(h), y + aside * elementary.cos(h)


@kernel
def nearest(path, n, ds, x, y):
    """Return the station of a point's foot on a path, looked for all along it."""
    stride = max(int(SEARCH_STEP / ds), 1)
    best, at = math.inf, 0
    for i in range(0, n, stride):
        gap = (path[i, X] - x) ** 2 + (path[i, Y] - y) ** 2
        if gap < best:
            best, at = gap, i
    # Twice: from up to half a search step away, the first foot is not yet exact.
    s, _ = project(path, n, ds, at * ds, x, y)
    s, _ = project(path, n, ds, s, x, y)
    return s
