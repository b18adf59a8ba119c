"""The multi-body model: a body on springs, two axles that lean and bounce, four wheels that spin.

Source: Allen, Szostak, Klyde, Rosenthal and Owens, Vehicle Dynamic Stability and Rollover, DOT HS
807 956, 1992; Althoff and Würsching, CommonRoad: Vehicle Models, 2020, "multi-body", here with y to
the left. Roll axes on the ground, no product of inertia, and camber linear in the spring's travel,
as all their parameter sets have it. Below walking pace the body goes as a kinematic bicycle does,
on forces that make it so, and in between both count by a smooth weight.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import kernel
from bridgegen.base.physics import GRAVITY
from bridgegen.simulation.embedded.chassis._chassis_columns import (
    BRAKE_FRONT,
    C_X,
    DRIVE_FRONT,
    FORCE,
    HEIGHT,
    K_FRONT,
    K_REAR,
    K_X,
    MU_X,
    SPEED,
    STEER,
    TO_FRONT,
    TO_REAR,
    VX,
    VY,
    YAW_RATE,
    H,
    X,
    Y,
)
from bridgegen.simulation.embedded.chassis._multi_body_columns import (
    ASIDE,
    AXLE,
    AXLE_AT,
    AXLE_COLUMNS,
    AXLE_STATES,
    BAR,
    BEST,
    CAMBER,
    D_JOINT,
    DAMPER,
    I_AXLE,
    I_PITCH,
    I_ROLL,
    I_WHEEL,
    I_YAW,
    K_JOINT,
    K_TYRE,
    LEAN,
    LEAN_RATE,
    MASS,
    OFF,
    PITCH,
    PITCH_RATE,
    PRESSED,
    PRESSES,
    PUSH,
    RADIUS,
    ROLL,
    ROLL_RATE,
    SHIFT,
    SINKS,
    SLIP_LAG,
    SLOPE,
    SPIN,
    SPRING,
    SPRUNG,
    STAGE,
    STATES,
    SUM,
    SUNK,
    TRACK,
    UNSPRUNG,
)
from bridgegen.simulation.embedded.chassis._single_track_kernels import (
    ALMOST,
    RELAXES,
    ROLLING,
    SLIPPING,
)
from bridgegen.simulation.embedded.chassis._tyre_kernels import rolling_tyre, slip_angle

FINENESS = 1.0  # sub-step times the rate at which a wheel answers, at most
# Halving changes no signal of 10 manoeuvres with three cars by more than 0.005 % of its peak. With
# 7.5 ms and a fineness of 2.4 it was up to 6 %, with 10 ms up to 15 %.
LONGEST = 0.004  # s, sub-step
ROLLED_OVER = 0.7  # rad of roll, from which on the model says nothing
# A locked wheel so rolls on at some 0.3 m/s; CommonRoad's stands from then on, whatever its tyre
# does.
FADES = 0.5  # m/s of the rim, below which a brake's torque fades, so that a locked wheel is calm
LEAST_FRICTION = 1e-6
SCRAPES = 0.45  # friction of a body on the road, ours


@kernel
def sub_steps_of_bodies(speed, dt, chassis):
    """Return into how many equal parts a step is divided, so that Runge–Kutta 4 has converged.

    A wheel answers the faster, the slower it rolls; below walking pace it just rolls along.
    """
    if speed < ROLLING:
        return max(int(dt / LONGEST + ALMOST), 1)
    load, radius = 0.25 * chassis[MASS] * GRAVITY, chassis[RADIUS]
    rate = chassis[K_X] * load * radius * radius / chassis[I_WHEEL] / max(speed, SLIPPING)
    return max(int(dt * max(rate / FINENESS, 1.0 / LONGEST) + ALMOST), 1)


@kernel
def _speeds_up(spin, along, ahead, torque, mu, chassis):
    """Return a wheel's angular acceleration [rad/s²].

    Control of slip (ABS, traction control) takes from the torque what would carry the wheel beyond
    the slip of the largest force straight ahead.

    Args:
        spin: its angular speed [rad/s].
        along: how fast its hub goes where it rolls [m/s].
        ahead: its tyre's longitudinal force [N].
        torque: of the drive, or less than 0 of the brake [N·m].
        mu: of the road [1].
        chassis: the vehicle.
    """
    radius, inertia, lag = chassis[RADIUS], chassis[I_WHEEL], chassis[SLIP_LAG]
    free = -radius * ahead / inertia
    if torque == 0.0:
        return free
    best = chassis[BEST] * mu * chassis[MU_X] * chassis[C_X] / chassis[K_X]
    slip = best * max(abs(along), ROLLING)
    if torque > 0.0:
        kept = ((along + slip) / radius - spin) / lag
        return min(free + torque / inertia, max(kept, free))
    sense = min(max(radius * spin / FADES, -1.0), 1.0)
    braked = free + sense * torque / inertia
    if sense >= 0.0:
        return max(braked, min(((along - slip) / radius - spin) / lag, free))
    return min(braked, max(((along + slip) / radius - spin) / lag, free))


@kernel
def _changes(motion, at, weight, cosine, sine, force, acts, mu, press, uphill, aside, chassis):
    """Write the derivatives of the states at ``motion[at:]`` to ``motion[SLOPE:]``.

    See ``advance_bodies``; ``weight`` is 1 of a dynamic body, 0 of a kinematic one, on which the
    force ``acts`` [m/s²].
    """
    front, rear = chassis[TO_FRONT], chassis[TO_REAR]
    wheelbase, mass, sprung = front + rear, chassis[MASS], chassis[SPRUNG]
    gravity, radius = press * GRAVITY, chassis[RADIUS]
    vx, vy, turn = motion[at + VX], motion[at + VY], motion[at + YAW_RATE]
    roll, rolls, pitch = motion[at + ROLL], motion[at + ROLL_RATE], motion[at + PITCH]
    pitches, sunk, sinks = motion[at + PITCH_RATE], motion[at + SUNK], motion[at + SINKS]
    cr, sr = elementary.cos(roll), elementary.sin(roll)
    above = chassis[HEIGHT] - radius
    presses = max(motion[at + AXLE_AT + PRESSED], 0.0)
    both = presses + max(motion[at + AXLE_AT + AXLE_STATES + PRESSED], 0.0)
    share = chassis[BRAKE_FRONT] if force < 0.0 else chassis[DRIVE_FRONT]
    if math.isnan(share):
        share = presses / both if both > 0.0 else 0.5
    fore = spin = sideways = overturns = lifts = raises = 0.0
    for axle in range(2):
        a, c = at + AXLE_AT + axle * AXLE_STATES, AXLE + axle * AXLE_COLUMNS
        ahead = front if axle == 0 else -rear
        carried = (rear if axle == 0 else front) / wheelbase * sprung
        stiffness = chassis[K_FRONT] if axle == 0 else chassis[K_REAR]
        cw, sw = (cosine, sine) if axle == 0 else (1.0, 0.0)
        torque = 0.5 * radius * chassis[PUSH] * force * (share if axle == 0 else 1.0 - share)
        half, unsprung = 0.5 * chassis[c + TRACK], chassis[c + UNSPRUNG]
        lean, leans, goes = motion[a + LEAN], motion[a + LEAN_RATE], motion[a + ASIDE]
        pressed, deepens, off = motion[a + PRESSED], motion[a + PRESSES], motion[a + OFF]
        cl, sl = elementary.cos(lean), elementary.sin(lean)
        # The joint that holds the axle below the body, sideways.
        below, twist, twists = above + pressed - sunk, roll - lean, rolls - leans
        drifts = vy + ahead * turn - goes
        sheared = -below * sr - off * cr - radius * elementary.sin(twist)
        shears = (
            (off * sr - below * cr) * rolls
            - (deepens - sinks) * sr
            - drifts * cr
            - radius * elementary.cos(twist) * twists
        )
        joint = chassis[K_JOINT] * sheared + chassis[D_JOINT] * shears
        # Springs, dampers and the anti-roll bar.
        travel, tilt = below / cr - above + ahead * pitch, half * twist
        spring, damper = chassis[c + SPRING], chassis[c + DAMPER]
        held = (
            0.5 * carried * GRAVITY - spring * travel - damper * (deepens - sinks + ahead * pitches)
        )
        rights = spring * tilt + damper * half * twists + chassis[c + BAR] * twist / (2.0 * half)
        left, right = held - rights, held + rights
        # The tyres.
        arm, deep = radius - pressed, pressed + radius * (cl - 1.0)
        # A wheel that lifts carries nothing; CommonRoad's tyre pulls at the road then (−215 N in a
        # double lane change of the Vanagon).
        load_left = max(chassis[K_TYRE] * (deep - half * sl), 0.0)
        load_right = max(chassis[K_TYRE] * (deep + half * sl), 0.0)
        across = vy + ahead * turn + leans * arm
        x_sum = x_off = y_sum = y_off = tips = 0.0
        for side in range(2):
            to_left = 1.0 - 2.0 * side
            load = load_left if side == 0 else load_right
            hub = vx - to_left * half * turn
            along, past = hub * cw + across * sw, across * cw - hub * sw
            w = at + SPIN + 2 * axle + side
            x = y = 0.0
            if weight > 0.0 and load > 0.0 and mu[side] > LEAST_FRICTION:
                kappa = (radius * motion[w] - along) / max(abs(along), ROLLING)
                # With another sign than CommonRoad's. Its coefficients are Pacejka's, with y to the
                # left, its equations have y to the right, in which slip angle and lateral force
                # change their sign and camber does not. Wheels push to the side to which they lean.
                camber = roll + chassis[c + CAMBER] * (tilt + to_left * travel)
                x, y = rolling_tyre(
                    kappa, slip_angle(past, along), camber, load, mu[side], stiffness, chassis
                )
            x_sum += x
            x_off -= to_left * x
            y_sum += y
            y_off += to_left * y
            tips += load * chassis[SHIFT] * weight * y
            change = weight * _speeds_up(motion[w], along, x, torque, mu[side], chassis)
            change += (1.0 - weight) * (along / radius - motion[w]) / RELAXES
            motion[SLOPE + SPIN + 2 * axle + side] = change
        to_side = y_sum * cw + x_sum * sw
        fore += x_sum * cw - y_sum * sw
        spin += ahead * to_side + half * (y_off * sw + x_off * cw)
        to_side *= weight
        to_side += (1.0 - weight) * (carried + unsprung) * (turn * vx + aside)
        # The axle.
        b = SLOPE + AXLE_AT + axle * AXLE_STATES
        tips += to_side * arm + half * (right - left) - radius * joint
        tips += (load_left + load_right) * radius * sl + (load_left - load_right) * half * cl
        motion[b + LEAN], motion[b + LEAN_RATE] = leans, tips / chassis[c + I_AXLE]
        motion[b + ASIDE] = (
            (to_side - joint * cr + (left + right) * sr) / unsprung - turn * vx - aside
        )
        motion[b + PRESSED], motion[b + OFF] = deepens, drifts
        upward = load_left + load_right - joint * sr - (left + right) * cr
        motion[b + PRESSES] = gravity - upward / unsprung
        # What it does to the body.
        sideways += joint * cr - (left + right) * sr
        overturns += half * (left - right) + joint / cr * (below + radius * cl)
        lifts += (left + right) * cr + joint * sr
        raises += ahead * (left + right)
    rolling = vx * sine / (cosine * wheelbase)
    other = 1.0 - weight
    raises += (weight * fore + other * mass * acts) * (chassis[HEIGHT] - sunk)
    motion[SLOPE + VX] = weight * (fore / mass + turn * vy) + other * acts - uphill
    motion[SLOPE + VY] = (
        weight * (sideways / sprung - turn * vx - aside) + other * (rear * rolling - vy) / RELAXES
    )
    motion[SLOPE + YAW_RATE] = weight * spin / chassis[I_YAW] + other * (rolling - turn) / RELAXES
    motion[SLOPE + STEER] = motion[SLOPE + FORCE] = motion[SLOPE + SPEED] = 0.0
    motion[SLOPE + ROLL], motion[SLOPE + ROLL_RATE] = rolls, overturns / chassis[I_ROLL]
    motion[SLOPE + PITCH], motion[SLOPE + PITCH_RATE] = pitches, raises / chassis[I_PITCH]
    motion[SLOPE + SUNK], motion[SLOPE + SINKS] = sinks, gravity - lifts / sprung
    ch, sh, past = elementary.cos(motion[at + H]), elementary.sin(motion[at + H]), vy - rear * turn
    motion[SLOPE + X], motion[SLOPE + Y] = vx * ch - past * sh, vx * sh + past * ch
    motion[SLOPE + H] = turn


@kernel
def settle(motion, press, chassis):
    """Put a vehicle on its springs and its rolling wheels, upright, where and as fast as it is.

    Args:
        motion: its states, see ``_multi_body_columns``; how it moves along the road stays.
        press: how hard the road is pressed upon [1].
        chassis: the vehicle.
    """
    for i in range(ROLL, STATES):
        motion[i] = 0.0
    vx, turn = motion[VX], motion[YAW_RATE]
    wheelbase = chassis[TO_FRONT] + chassis[TO_REAR]
    sunk = pitch = 0.0
    for axle in range(2):
        a, c = AXLE_AT + axle * AXLE_STATES, AXLE + axle * AXLE_COLUMNS
        ahead = chassis[TO_FRONT] if axle == 0 else -chassis[TO_REAR]
        share = (chassis[TO_REAR] if axle == 0 else chassis[TO_FRONT]) / wheelbase
        carried = share * chassis[SPRUNG]
        load = press * GRAVITY * (carried + chassis[c + UNSPRUNG])
        travel = 0.5 * (1.0 - press) * GRAVITY * carried / chassis[c + SPRING]
        motion[a + PRESSED] = 0.5 * load / chassis[K_TYRE]
        motion[a + ASIDE] = motion[VY] + ahead * turn
        lower = motion[a + PRESSED] - travel
        sunk += share * lower
        pitch -= math.copysign(lower, ahead) / wheelbase
        for side in range(2):
            along = vx - (1.0 - 2.0 * side) * 0.5 * chassis[c + TRACK] * turn
            motion[SPIN + 2 * axle + side] = along / chassis[RADIUS]
    motion[SUNK], motion[PITCH] = sunk, pitch


@kernel
def _slide_on(motion, mu, press, dt, chassis):
    """Move a vehicle that has rolled over on: it slides to a stop, and stays as it lies."""
    vx, vy, turn, rear = motion[VX], motion[VY], motion[YAW_RATE], chassis[TO_REAR]
    speed = math.sqrt(vx * vx + vy * vy)
    slows = min(min(0.5 * (mu[0] + mu[1]), SCRAPES) * press * GRAVITY * dt / max(speed, 1e-9), 1.0)
    mean, left, h = 1.0 - 0.5 * slows, 1.0 - slows, motion[H]
    turned = mean * turn * dt
    ch, sh = elementary.cos(h), elementary.sin(h)
    cn, sn = elementary.cos(h + turned), elementary.sin(h + turned)
    east, north = vx * ch - vy * sh, vx * sh + vy * ch
    motion[X] += mean * east * dt + rear * (ch - cn)
    motion[Y] += mean * north * dt + rear * (sh - sn)
    motion[H] = h + turned
    motion[VX] = left * (east * cn + north * sn)
    motion[VY] = left * (north * cn - east * sn)
    motion[YAW_RATE] = left * turn


@kernel
def advance_bodies(motion, steer, force, mu, press, uphill, aside, dt, chassis):
    """Move a multi-body vehicle on by a sub-step.

    Args:
        motion: its states, see ``_multi_body_columns``, which change; of the front wheels' angle
            and the force only the arguments count.
        steer: of the front wheels at begin, middle and end [rad].
        force: of brakes and drive in the middle, per mass [m/s²].
        mu: the road's friction under the left and the right wheels [1].
        press: how hard the road is pressed upon [1].
        uphill: gravity against the motion [m/s²].
        aside: gravity to the right [m/s²].
        dt: the sub-step [s].
        chassis: the vehicle, see ``_multi_body_columns``.
    """
    # The model has long stopped being one of a car by then.
    if abs(motion[ROLL]) >= ROLLED_OVER:
        _slide_on(motion, mu, press, dt, chassis)
        return
    vx, vy, x, y = motion[VX], motion[VY], motion[X], motion[Y]
    fast = min(max((math.sqrt(vx * vx + vy * vy) - ROLLING) / (SLIPPING - ROLLING), 0.0), 1.0)
    weight = fast * fast * (3.0 - 2.0 * fast)
    stands = vx == 0.0 and vy == 0.0 and force <= -abs(uphill)  # the brakes hold it
    most = 0.5 * (mu[0] + mu[1]) * press * GRAVITY
    acts = min(max(-force if force < 0.0 and vx < 0.0 else force, -most), most)
    if stands:
        acts = uphill
    middle = elementary.cos(steer[1]), elementary.sin(steer[1])
    ch, sh, h = elementary.cos(motion[H]), elementary.sin(motion[H]), motion[H]
    for stage in range(4):
        at = 0 if stage == 0 else STAGE
        if stage == 0:
            cosine, sine = elementary.cos(steer[0]), elementary.sin(steer[0])
        elif stage == 3:
            cosine, sine = elementary.cos(steer[2]), elementary.sin(steer[2])
        else:
            cosine, sine = middle
        _changes(motion, at, weight, cosine, sine, force, acts, mu, press, uphill, aside, chassis)
        ahead, counts = dt if stage == 2 else 0.5 * dt, 1.0 if stage % 3 == 0 else 2.0
        for i in range(STATES):
            change = motion[SLOPE + i]
            motion[SUM + i] = counts * change + (0.0 if stage == 0 else motion[SUM + i])
            motion[STAGE + i] = motion[i] + ahead * change
    for i in range(STATES):
        motion[i] += dt / 6.0 * motion[SUM + i]
    ends = motion[VX]
    turns_round = ends < 0.0 if vx >= 0.0 else ends > 0.0 and force < 0.0
    if stands or (turns_round and weight < 1.0):  # it has come to a stand
        far = 0.5 * vx * dt * vx / (vx - ends) if vx != 0.0 else 0.0
        motion[X], motion[Y], motion[H] = x + far * ch, y + far * sh, h
        motion[VX] = motion[VY] = motion[YAW_RATE] = 0.0
        for i in range(4):
            motion[SPIN + i] = 0.0
    if abs(motion[ROLL]) > ROLLED_OVER:
        motion[ROLL] = math.copysign(ROLLED_OVER, motion[ROLL])
