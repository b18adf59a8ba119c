"""The single-track model: a rigid body on a front and a rear axle, with tyres that slip.

Source: Althoff and Würsching, CommonRoad: Vehicle Models, 2020, "single-track drift model", with
wheels in balance with their torques. Below walking pace slip says nothing; there the body relaxes
to the kinematic bicycle, and in between both count by a smooth weight.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import inlined_kernel, kernel
from bridgegen.base.physics import GRAVITY
from bridgegen.simulation.embedded.chassis._chassis_columns import (
    AGILITY,
    BRAKE_FRONT,
    DRIVE_FRONT,
    HEIGHT,
    K_FRONT,
    K_REAR,
    MU_Y,
    TO_FRONT,
    TO_REAR,
)
from bridgegen.simulation.embedded.chassis._tyre_kernels import (
    SMALL_ANGLE,
    lateral,
    lateral_left,
    longitudinal,
    slip_angle,
    stiffness_factor,
)

ROLLING, SLIPPING = 1.0, 3.0  # m/s, up to which the body is kinematic, and from which it is dynamic
RELAXES = 0.05  # s, in which it becomes kinematic
TURNS = 0.1  # m/s, below which the sense in which a wheel rolls is not clear-cut
# At 1.0 the slip angle of an abrupt step at 15 m/s was off by 2.4 % of its peak, at 0.5 nothing
# changed by more than 0.8 %; at 0.7 all signals of all manoeuvres are within 1 %.
FINENESS = 0.7  # sub-step times the fastest rate of the lateral motion, at most
LONGEST = 0.05  # s, sub-step
ALMOST = 1.0 - 1e-9  # rounds up


@kernel
def sub_steps(speed, dt, chassis):
    """Return into how many equal parts a step is divided, so that Runge–Kutta 4 has converged.

    The lateral motion is the faster, the slower the vehicle: the rate is that of its stiffer axle.
    """
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    stiff = max(chassis[K_FRONT], chassis[K_REAR])
    rate = stiff * GRAVITY * max(1.0, front * rear * chassis[AGILITY]) / max(speed, SLIPPING)
    return max(int(dt * max(rate / FINENESS, 1.0 / LONGEST) + ALMOST), 1)


@kernel
def axle_loads(force, press, mu, chassis):
    """Return the loads on front and rear axle per mass [m/s²], while a force acts along it."""
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    weight = press * GRAVITY
    moved = min(max(force, -mu * weight), mu * weight) * chassis[HEIGHT]
    # An axle that lifts carries nothing; it does not pull at the road.
    load = min(max((weight * rear - moved) / (front + rear), 0.0), weight)
    return load, weight - load


@inlined_kernel
def _share(force, load, weight, chassis):
    """Return the front axle's share of the force of brakes or drive."""
    share = chassis[BRAKE_FRONT] if force < 0.0 else chassis[DRIVE_FRONT]
    return load / weight if math.isnan(share) else share


@kernel
def turned(cosine, sine, angle):
    """Return cosine and sine of an angle that is larger by so much, by series where it is small."""
    if abs(angle) > SMALL_ANGLE:
        c, s = elementary.cos(angle), elementary.sin(angle)
    else:
        q = angle * angle
        c = 1.0 - q * (0.5 - q * (1.0 / 24.0 - q * (1.0 / 720.0)))
        s = angle * (1.0 - q * (1.0 / 6.0 - q * (1.0 / 120.0 - q * (1.0 / 5040.0))))
    return cosine * c - sine * s, sine * c + cosine * s


@inlined_kernel
def _slip_angles(vx, vy, turn, cosine, sine, chassis):
    """Return the slip angles of front and rear axle [rad]."""
    ahead = vy + chassis[TO_FRONT] * turn
    along, across = vx * cosine + ahead * sine, ahead * cosine - vx * sine
    return slip_angle(across, along), slip_angle(vy - chassis[TO_REAR] * turn, vx)


@inlined_kernel
def _changes(vx, vy, turn, cosine, sine, given, most, b, weight, uphill, aside, chassis):
    """Return the derivatives of forward and lateral speed [m/s²] and of the yaw rate [rad/s²].

    Of front and rear axle, ``given`` are the longitudinal forces, ``most`` the largest lateral
    ones and ``b`` their factors B; ``weight`` is 1 of a dynamic body, 0 of a kinematic one.
    """
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    forward, sideways, spin = given[0] + given[1] - uphill, 0.0, 0.0
    if weight > 0.0:
        of_front, of_rear = _slip_angles(vx, vy, turn, cosine, sine, chassis)
        side = lateral(of_front, most[0], b[0], chassis)
        back = lateral(of_rear, most[1], b[1], chassis)
        steered = side * cosine + given[0] * sine
        dynamic = turn * vy + given[1] + given[0] * cosine - side * sine - uphill
        forward = weight * dynamic + (1.0 - weight) * forward
        sideways = weight * (back + steered - turn * vx - aside)
        spin = weight * (front * steered - rear * back) * chassis[AGILITY]
    if weight < 1.0:
        rolls = vx * sine / (cosine * (front + rear))
        sideways += (1.0 - weight) * (rear * rolls - vy) / RELAXES
        spin += (1.0 - weight) * (rolls - turn) / RELAXES
    return forward, sideways, spin


@kernel
def advance(
    place, vx, vy, turn, heads, wheels, steered, forces, mu, press, uphill, aside, dt, chassis
):
    """Return (place, vx, vy, yaw rate, heads, wheels) of the centre of gravity one sub-step on.

    Args:
        place: x, y [m] and heading [rad].
        vx: forward speed [m/s]; ``vy`` is the one to the left.
        vy: likewise.
        turn: yaw rate [rad/s].
        heads: cosine and sine of the heading.
        wheels: cosine and sine of the front wheels' angle.
        steered: by how much they turn up to the middle, and from there to the end [rad].
        forces: of brakes and drive in the middle, per mass [m/s²].
        mu: the road's friction [1].
        press: how hard the road is pressed upon [1].
        uphill: gravity against the motion [m/s²].
        aside: gravity to the right [m/s²].
        dt: the sub-step [s].
        chassis: the vehicle, see ``_chassis_columns``.
    """
    speed = math.sqrt(vx * vx + vy * vy)
    fast = min(max((speed - ROLLING) / (SLIPPING - ROLLING), 0.0), 1.0)
    weight = fast * fast * (3.0 - 2.0 * fast)
    c0, s0 = wheels
    c1, s1 = turned(c0, s0, steered[0])
    c2, s2 = turned(c1, s1, steered[1])
    if vx == 0.0 and vy == 0.0 and forces <= -abs(uphill):  # the brakes hold it
        return place, 0.0, 0.0, 0.0, heads, (c2, s2)
    acts = forces
    if forces < 0.0 and (
        weight == 1.0 or vx < 0.0
    ):  # brakes act against the motion, backwards, too
        acts *= min(max(vx / TURNS, -1.0), 1.0) if weight == 1.0 else -1.0
    loads = axle_loads(acts, press, mu, chassis)
    share = _share(forces, loads[0], loads[0] + loads[1], chassis)
    ahead = share * acts
    behind = acts - ahead
    of_front = of_rear = 0.0
    if weight > 0.0:
        of_front, of_rear = _slip_angles(vx, vy, turn, c0, s0, chassis)
    # Held over the sub-step's four stages. A wheel is in balance with its torque within 5 ms at 30
    # m/s; as a state it would need sub-steps of 2 ms.
    fx, slip = longitudinal(ahead, of_front, loads[0], mu, chassis)
    rx, slide = longitudinal(behind, of_rear, loads[1], mu, chassis)
    given = (fx, rx)
    peak = mu * chassis[MU_Y]
    most = (
        peak * loads[0] * lateral_left(of_front, slip, chassis),
        peak * loads[1] * lateral_left(of_rear, slide, chassis),
    )
    b = (
        stiffness_factor(chassis[K_FRONT], mu, chassis),
        stiffness_factor(chassis[K_REAR], mu, chassis),
    )
    half = 0.5 * dt
    a1, b1, r1 = _changes(vx, vy, turn, c0, s0, given, most, b, weight, uphill, aside, chassis)
    a2, b2, r2 = _changes(
        vx + half * a1,
        vy + half * b1,
        turn + half * r1,
        c1,
        s1,
        given,
        most,
        b,
        weight,
        uphill,
        aside,
        chassis,
    )
    a3, b3, r3 = _changes(
        vx + half * a2,
        vy + half * b2,
        turn + half * r2,
        c1,
        s1,
        given,
        most,
        b,
        weight,
        uphill,
        aside,
        chassis,
    )
    a4, b4, r4 = _changes(
        vx + dt * a3,
        vy + dt * b3,
        turn + dt * r3,
        c2,
        s2,
        given,
        most,
        b,
        weight,
        uphill,
        aside,
        chassis,
    )
    sixth = dt / 6.0
    ends = vx + sixth * (a1 + 2.0 * (a2 + a3) + a4)
    x, y, h = place
    ch, sh = heads
    turns_round = ends < 0.0 if vx >= 0.0 else ends > 0.0 and forces < 0.0
    if turns_round and weight < 1.0:  # it has come to a stand
        stops = 0.5 * vx * dt * vx / (vx - ends) if vx != 0.0 else 0.0
        return (x + stops * ch, y + stops * sh, h), 0.0, 0.0, 0.0, heads, (c2, s2)
    across = vy + sixth * (b1 + 2.0 * (b2 + b3) + b4)
    spins = turn + sixth * (r1 + 2.0 * (r2 + r3) + r4)
    # Simpson's rule, with the mean of both middle stages.
    mid_x, mid_y = vx + 0.25 * dt * (a1 + a2), vy + 0.25 * dt * (b1 + b2)
    to_middle = half * (turn + 0.125 * dt * (r1 + r2))
    whole = dt * (turn + sixth * (r1 + r2 + r3))
    cm, sm = turned(ch, sh, to_middle)
    ce, se = turned(cm, sm, whole - to_middle)
    x += sixth * (vx * ch - vy * sh + 4.0 * (mid_x * cm - mid_y * sm) + ends * ce - across * se)
    y += sixth * (vx * sh + vy * ch + 4.0 * (mid_x * sm + mid_y * cm) + ends * se + across * ce)
    return (x, y, h + whole), ends, across, spins, (ce, se), (c2, s2)
