"""A vehicle with dynamics: what its driver demands, through actuators, to where it goes."""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.base.physics import GRAVITY
from bridgegen.drivers._weather_columns import FRICTION
from bridgegen.simulation.embedded.chassis._chassis_columns import (
    BRAKE_LAG,
    DRIVE_LAG,
    FORCE,
    LOCK,
    SPEED,
    STEER,
    STEERING_LAG,
    STEERING_RATE,
    TO_FRONT,
    TO_REAR,
    VX,
    VY,
    YAW_RATE,
    H,
    X,
    Y,
)
from bridgegen.simulation.embedded.chassis._multi_body_columns import AXLE_AT, PRESSED
from bridgegen.simulation.embedded.chassis._multi_body_kernels import (
    advance_bodies,
    settle,
    sub_steps_of_bodies,
)
from bridgegen.simulation.embedded.chassis._single_track_kernels import advance, sub_steps
from bridgegen.simulation.embedded.places._slope_kernels import slope

TRIMMED = 0.8  # of friction, that a vehicle uses at most where its motion begins


@kernel
def lagged(value, target, left, lag, rate):
    """Return a first-order lag's value, of which a share is left after a while, and rates bound it.

    Args:
        value: now.
        target: what it goes to.
        left: share of the distance that is left, e^(−t/lag).
        lag: [s].
        rate: at most, per second.
    """
    error = target - value
    most = rate * lag
    if abs(error) <= most:
        return target - left * error
    near = math.copysign(most, error)
    whole = (error - near) / math.copysign(rate, error)  # s, at that rate until it is near
    lasts = -lag * elementary.log(left)
    if lasts <= whole:
        return value + math.copysign(rate * lasts, error)
    return target - near * elementary.exp((whole - lasts) / lag)


@kernel
def _asked_of(k, demanded, curvature, plan, roads, state, record):
    """Return what actuators go to, and what the road does, at instant k.

    A vehicle that is not where it has come to begins there anew, on its wheels: at the start, after
    a teleport, or where the storyboard has moved it.

    Returns:
        front wheels' angle [rad] and force per mass [m/s²] that are asked for; gravity against the
        motion and to the right [m/s²], and how hard the road is pressed upon; whether it has begun.
    """
    chassis, motion, limits, dt = plan.chassis, state.chassis, plan.bodies[0], plan.dt
    x, y, h, v = record.x[0, k], record.y[0, k], record.h[0, k], record.v[0, k]
    uphill, aside, press = slope(0, roads, state)
    friction = state.weather[FRICTION]
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    wheelbase = front + rear
    # By the kinematic bicycle's inverse, which knows no slip: so the vehicle understeers, a car by
    # 1.6 °/g, and its driver has to cope with that.
    asked = min(max(elementary.atan(wheelbase * curvature), -chassis[LOCK]), chassis[LOCK])
    came = motion[X] == x and motion[Y] == y and motion[H] == h and motion[SPEED] == v
    if not came:
        most = TRIMMED * press * friction / max(v * v, 1e-6)
        bend = min(max(elementary.tan(asked) / wheelbase, -most), most)
        # Rolling, without sideslip: what it did before is not known.
        motion[VX], motion[YAW_RATE] = v, v * bend
        motion[VY], motion[STEER] = rear * motion[YAW_RATE], elementary.atan(wheelbase * bend)
        motion[FORCE] = uphill
    wanted = min(max(demanded + uphill, -limits[5]), limits[4])
    wanted = min(wanted, (limits[3] - v) / dt + uphill)
    return asked, wanted, uphill, aside, press, not came


@kernel
def move_chassis(k, demanded, curvature, plan, roads, state, record):
    """Move the ego's single-track vehicle on from instant k, to ``state.chassis``.

    The driver's demands become a steering angle, by the kinematic bicycle's inverse, and a force.
    """
    asked, wanted, uphill, aside, press, _ = _asked_of(
        k, demanded, curvature, plan, roads, state, record
    )
    chassis, motion, dt = plan.chassis, state.chassis, plan.dt
    x, y, h = record.x[0, k], record.y[0, k], record.h[0, k]
    friction, rear = state.weather[FRICTION], chassis[TO_REAR]
    vx, vy, turn = motion[VX], motion[VY], motion[YAW_RATE]
    angle, force = motion[STEER], motion[FORCE]
    steering, rate = chassis[STEERING_LAG], chassis[STEERING_RATE]
    parts = sub_steps(math.sqrt(vx * vx + vy * vy), dt, chassis)
    part = dt / parts
    angle_left = elementary.exp(-0.5 * part / steering)
    force_left = elementary.exp(-0.5 * part / chassis[BRAKE_LAG if wanted < force else DRIVE_LAG])
    heads = elementary.cos(h), elementary.sin(h)
    wheels = elementary.cos(angle), elementary.sin(angle)
    place = x + rear * heads[0], y + rear * heads[1], h
    for _ in range(parts):
        middle = lagged(angle, asked, angle_left, steering, rate)
        last = lagged(middle, asked, angle_left, steering, rate)
        acts = wanted - force_left * (wanted - force)
        force = wanted - force_left * (wanted - acts)
        place, vx, vy, turn, heads, wheels = advance(
            place, vx, vy, turn, heads, wheels, (middle - angle, last - middle), acts,
            friction / GRAVITY, press, uphill, aside, part, chassis,
        )  # fmt: skip
        angle = last
    motion[VX], motion[VY], motion[YAW_RATE] = vx, vy, turn
    motion[STEER], motion[FORCE] = angle, force
    motion[X], motion[Y] = place[0] - rear * heads[0], place[1] - rear * heads[1]
    motion[H] = place[2]
    # Of the rear axle's centre, in whatever direction it moves: OpenSCENARIO's reference point.
    motion[SPEED] = math.sqrt(vx * vx + (vy - rear * turn) ** 2)


@kernel
def move_multi_body(k, demanded, curvature, plan, roads, state, record):
    """Move the ego's multi-body vehicle on from instant k, to ``state.chassis``.

    Left and right wheels roll on the same friction, for roads have no other.
    """
    asked, wanted, uphill, aside, press, begins = _asked_of(
        k, demanded, curvature, plan, roads, state, record
    )
    chassis, motion, dt = plan.chassis, state.chassis, plan.dt
    if begins or motion[AXLE_AT + PRESSED] == 0.0:  # its memory is 0 before it first moves
        motion[X], motion[Y], motion[H] = record.x[0, k], record.y[0, k], record.h[0, k]
        settle(motion, press, chassis)
    friction = state.weather[FRICTION] / GRAVITY
    angle, force = motion[STEER], motion[FORCE]
    steering, rate = chassis[STEERING_LAG], chassis[STEERING_RATE]
    vx, vy = motion[VX], motion[VY]
    parts = sub_steps_of_bodies(math.sqrt(vx * vx + vy * vy), dt, chassis)
    part = dt / parts
    angle_left = elementary.exp(-0.5 * part / steering)
    force_left = elementary.exp(-0.5 * part / chassis[BRAKE_LAG if wanted < force else DRIVE_LAG])
    for _ in range(parts):
        middle = lagged(angle, asked, angle_left, steering, rate)
        last = lagged(middle, asked, angle_left, steering, rate)
        acts = wanted - force_left * (wanted - force)
        force = wanted - force_left * (wanted - acts)
        advance_bodies(
            motion,
            (angle, middle, last),
            acts,
            (friction, friction),
            press,
            uphill,
            aside,
            part,
            chassis,
        )
        angle = last
    motion[STEER], motion[FORCE] = angle, force
    past = motion[VY] - chassis[TO_REAR] * motion[YAW_RATE]
    motion[SPEED] = math.sqrt(motion[VX] * motion[VX] + past * past)
