"""The single-track model: a rigid body on a front and a rear axle, with tyres that slip.

Source: Althoff and Würsching, CommonRoad: Vehicle Models, 2020, "single-track drift model", with
wheels in balance with their torques. Below walking pace slip says nothing; there the body relaxes
to the kinematic bicycle, and in between both count by a smooth weight.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.compiled import inlined_kernel, kernel
from bridgegen.physics import GRAVITY
from bridgegen.simulation.embedded.chassis._chassis_columns import (
    BRAKE_FRONT,
    DRIVE_FRONT,
    HEIGHT,
    INERTIA,
    K_FRONT,
    K_REAR,
    TO_FRONT,
    TO_REAR,
)
from bridgegen.simulation.embedded.chassis._tyre_kernels import lateral, longitudinal

ROLLS, SLIPS = 1.0, 3.0  # m/s, up to which the body is kinematic, and from which it is dynamic
RELAXES = 0.05  # s, in which it becomes kinematic
TURNS = 0.1  # m/s, below which the sense in which a wheel rolls is not clear-cut
FINENESS = 0.5  # sub-step times the fastest rate of the lateral motion, at most
LONGEST = 0.05  # s, sub-step


@kernel
def sub_steps(speed, dt, chassis):
    """Return into how many equal parts a step is divided, so that Runge–Kutta 4 has converged.

    The lateral motion is the faster, the slower the vehicle: the rate is that of its stiffer axle.
    """
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    stiff = max(chassis[K_FRONT], chassis[K_REAR])
    rate = stiff * GRAVITY * max(1.0, front * rear / chassis[INERTIA]) / max(speed, SLIPS)
    return int(math.ceil(dt * max(rate / FINENESS, 1.0 / LONGEST) - 1e-9))


@kernel
def axle_loads(force, press, mu, chassis):
    """Return the loads on front and rear axle per mass [m/s²], while a force acts along it."""
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    weight = press * GRAVITY
    moved = min(max(force, -mu * weight), mu * weight) * chassis[HEIGHT]
    load = min(max((weight * rear - moved) / (front + rear), 0.0), weight)
    return load, weight - load


@inlined_kernel
def _shares(force, load, weight, chassis):
    """Return the front axle's share of the force of brakes or drive."""
    share = chassis[BRAKE_FRONT] if force < 0.0 else chassis[DRIVE_FRONT]
    return load / weight if math.isnan(share) else share


@inlined_kernel
def _slip_angles(vx, vy, turn, cosine, sine, chassis):
    """Return the slip angles of front and rear axle [rad]."""
    ahead = vy + chassis[TO_FRONT] * turn
    along, across = vx * cosine + ahead * sine, ahead * cosine - vx * sine
    return (
        math.atan2(across, max(abs(along), 1e-6)),
        math.atan2(vy - chassis[TO_REAR] * turn, max(abs(vx), 1e-6)),
    )


@inlined_kernel
def _changes(
    vx, vy, turn, angle, cosine, sine, given, slips, loads, mu, weight, uphill, aside, chassis
):
    """Return the derivatives of forward and lateral speed [m/s²] and of the yaw rate [rad/s²].

    ``given`` and ``slips`` are the longitudinal forces and slips of front and rear axle; ``weight``
    is 1 of a dynamic body, 0 of a kinematic one.
    """
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    forward, left, spin = given[0] + given[1] - uphill, 0.0, 0.0
    if weight > 0.0:
        of_front, of_rear = _slip_angles(vx, vy, turn, cosine, sine, chassis)
        side = lateral(of_front, slips[0], loads[0], mu, chassis[K_FRONT], chassis)
        back = lateral(of_rear, slips[1], loads[1], mu, chassis[K_REAR], chassis)
        steered = side * cosine + given[0] * sine
        dynamic = turn * vy + given[1] + given[0] * cosine - side * sine - uphill
        forward = weight * dynamic + (1.0 - weight) * forward
        left = weight * (back + steered - turn * vx - aside)
        spin = weight * (front * steered - rear * back) / chassis[INERTIA]
    if weight < 1.0:
        rolls = vx * math.tan(angle) / (front + rear)
        left += (1.0 - weight) * (rear * rolls - vy) / RELAXES
        spin += (1.0 - weight) * (rolls - turn) / RELAXES
    return forward, left, spin


@kernel
def advance(x, y, h, vx, vy, turn, angles, forces, mu, press, uphill, aside, dt, chassis):
    """Return (x, y, h, vx, vy, yaw rate) of the centre of gravity one sub-step on.

    Args:
        x: [m], and so is y.
        y: likewise.
        h: heading [rad].
        vx: forward speed [m/s]; ``vy`` is the one to the left.
        vy: likewise.
        turn: yaw rate [rad/s].
        angles: of the front wheels at the begin, the middle and the end [rad].
        forces: of brakes and drive in the middle, per mass [m/s²].
        mu: the road's friction [1].
        press: how hard the road is pressed upon [1].
        uphill: gravity against the motion [m/s²].
        aside: gravity to the right [m/s²].
        dt: the sub-step [s].
        chassis: the vehicle, see ``_chassis_columns``.
    """
    speed = math.hypot(vx, vy)
    share = min(max((speed - ROLLS) / (SLIPS - ROLLS), 0.0), 1.0)
    weight = share * share * (3.0 - 2.0 * share)
    first, middle, last = angles
    c0, s0 = math.cos(first), math.sin(first)
    c1, s1 = math.cos(middle), math.sin(middle)
    c2, s2 = math.cos(last), math.sin(last)
    loads = axle_loads(forces, press, mu, chassis)
    ahead = _shares(forces, loads[0], loads[0] + loads[1], chassis) * forces
    behind = forces - ahead
    if forces < 0.0 and weight == 1.0:  # brakes act against the motion, of a spinning car, too
        rolls = min(max(vx / TURNS, -1.0), 1.0)
        ahead, behind = ahead * rolls, behind * rolls
    if vx == 0.0 and vy == 0.0 and forces <= uphill and forces <= -uphill:  # they hold it
        return x, y, h, 0.0, 0.0, 0.0
    of_front = of_rear = 0.0
    if weight > 0.0:
        of_front, of_rear = _slip_angles(vx, vy, turn, c0, s0, chassis)
    fx, slip = longitudinal(ahead, of_front, loads[0], mu, chassis)
    rx, slide = longitudinal(behind, of_rear, loads[1], mu, chassis)
    given, slips = (fx, rx), (slip, slide)
    half = 0.5 * dt
    a1, b1, r1 = _changes(
        vx, vy, turn, first, c0, s0, given, slips, loads, mu, weight, uphill, aside, chassis
    )
    a2, b2, r2 = _changes(
        vx + half * a1, vy + half * b1, turn + half * r1, middle, c1, s1,
        given, slips, loads, mu, weight, uphill, aside, chassis,
    )  # fmt: skip
    a3, b3, r3 = _changes(
        vx + half * a2, vy + half * b2, turn + half * r2, middle, c1, s1,
        given, slips, loads, mu, weight, uphill, aside, chassis,
    )  # fmt: skip
    a4, b4, r4 = _changes(
        vx + dt * a3, vy + dt * b3, turn + dt * r3, last, c2, s2,
        given, slips, loads, mu, weight, uphill, aside, chassis,
    )  # fmt: skip
    sixth = dt / 6.0
    ends = vx + sixth * (a1 + 2.0 * (a2 + a3) + a4)
    if ends < 0.0 and weight < 1.0 and vx >= 0.0:  # it has come to a stand
        stops = 0.5 * vx * dt * vx / (vx - ends) if vx > 0.0 else 0.0
        return x + stops * math.cos(h), y + stops * math.sin(h), h, 0.0, 0.0, 0.0
    across = vy + sixth * (b1 + 2.0 * (b2 + b3) + b4)
    spins = turn + sixth * (r1 + 2.0 * (r2 + r3) + r4)
    # Simpson's rule, with the mean of both middle stages' rates for the way to the middle.
    mid_x, mid_y = vx + 0.25 * dt * (a1 + a2), vy + 0.25 * dt * (b1 + b2)
    mid_h = h + half * (turn + 0.25 * half * (r1 + r2))
    end_h = h + dt * (turn + sixth * (r1 + r2 + r3))
    ch, sh = math.cos(h), math.sin(h)
    cm, sm = math.cos(mid_h), math.sin(mid_h)
    ce, se = math.cos(end_h), math.sin(end_h)
    go_x = vx * ch - vy * sh + 4.0 * (mid_x * cm - mid_y * sm) + ends * ce - across * se
    go_y = vx * sh + vy * ch + 4.0 * (mid_x * sm + mid_y * cm) + ends * se + across * ce
    return x + sixth * go_x, y + sixth * go_y, end_h, ends, across, spins
