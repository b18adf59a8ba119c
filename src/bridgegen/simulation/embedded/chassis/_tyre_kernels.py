"""The tyres: the magic formula with combined slip.

Source: Pacejka, Tyre and Vehicle Dynamics, 2nd ed., section 4.3.2, without turn slip and shifts,
and with camber where said. Friction scales the peak, and not the stiffness.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.base import _elementary_kernels as elementary
from bridgegen.base.compiled import inlined_kernel, kernel
from bridgegen.simulation.embedded.chassis._chassis_columns import (
    B_XA,
    B_XA2,
    B_YK,
    B_YK2,
    C_X,
    C_XA,
    C_Y,
    C_YK,
    E_X,
    E_XA,
    E_Y,
    E_YK,
    K_X,
    MU_X,
    MU_Y,
    SLIP,
    SLIPS,
)
from bridgegen.simulation.embedded.chassis._multi_body_columns import (
    D_Y3,
    H_Y3,
    V_Y3,
    V_YK3,
    V_YK4,
    V_YK5,
    V_YK6,
)


@inlined_kernel
def slip_angle(across, along):
    """Return atan2(across, |along|), by its series where it is small."""
    along = max(abs(along), 1e-6)
    if abs(across) > SMALL_ANGLE * along:
        return elementary.atan2(across, along)
    x = across / along
    q = x * x
    return x * (1.0 - q * (1.0 / 3.0 - q * (0.2 - q * (1.0 / 7.0 - q * (1.0 / 9.0)))))


SMALL_ANGLE = 0.05  # the fifth term is below 1e-14 of the sum


@inlined_kernel
def _bent(z, e):
    """Return the argument of the magic formula's arc tangent."""
    return z if e == 0.0 else z - e * (z - elementary.atan(z))


@inlined_kernel
def lateral(alpha, most, b, chassis):
    """Return an axle's lateral force per mass [m/s²], left positive.

    Args:
        alpha: its slip angle [rad], positive where it moves to its left.
        most: its largest force, μ times the load, as far as brakes and drive leave it [m/s²].
        b: the magic formula's B [1/rad], see ``stiffness_factor``.
        chassis: see ``_chassis_columns``.
    """
    shape, z = chassis[C_Y], _bent(b * alpha, chassis[E_Y])
    if abs(z) < SMALL:  # the series, to a millionth
        return -most * shape * z * (1.0 - z * z * (2.0 + shape * shape) * (1.0 / 6.0))
    return -most * elementary.sin(shape * elementary.atan(z))


@inlined_kernel
def stiffness_factor(stiffness, mu, chassis):
    """Return B of the lateral force [1/rad] for a cornering stiffness per load [1/rad]."""
    return stiffness / (chassis[C_Y] * mu * chassis[MU_Y])


SMALL = 0.03


@kernel
def lateral_left(alpha, kappa, chassis):
    """Return the share of the lateral force that is left at a longitudinal slip."""
    if kappa == 0.0:
        return 1.0
    along = chassis[B_YK2] * alpha
    z = chassis[B_YK] / math.sqrt(1.0 + along * along) * kappa
    return elementary.cos(chassis[C_YK] * elementary.atan(_bent(z, chassis[E_YK])))


@kernel
def longitudinal_left(alpha, kappa, chassis):
    """Return the share of the longitudinal force that is left at a slip angle."""
    along = chassis[B_XA2] * kappa
    z = chassis[B_XA] / math.sqrt(1.0 + along * along) * alpha
    return max(elementary.cos(chassis[C_XA] * elementary.atan(_bent(z, chassis[E_XA]))), LEAST)


LEAST = 0.01  # of the longitudinal force, however far a tyre slides sideways


@inlined_kernel
def _slip_of(share, chassis):
    """Return B·κ of a share of the largest longitudinal force, from the table."""
    at = math.sqrt(1.0 - min(share, 1.0)) * SLIPS
    i = min(int(at), SLIPS - 1)
    return chassis[SLIP + i] + (at - i) * (chassis[SLIP + i + 1] - chassis[SLIP + i])


@kernel
def longitudinal(wanted, alpha, load, mu, chassis):
    """Return an axle's longitudinal force per mass [m/s²], and the slip that gives it [1].

    The force is the one that is wanted, as far as the tyres can: control of slip (ABS, traction
    control) keeps the slip at the one of the largest force straight ahead. The wheel is taken to be
    in balance: it follows its brake within milliseconds.

    Args:
        wanted: of brakes or drive, per mass [m/s²].
        alpha: see ``lateral``, and so are the others.
        load: on the axle.
        mu: of the road.
        chassis: the vehicle.
    """
    if wanted == 0.0 or load <= 0.0:
        return 0.0, 0.0
    # All forces go with the load, so the mass cancels, and classes of vehicles differ by geometry,
    # stiffness and lags alone.
    peak = mu * chassis[MU_X]
    most, b = peak * load, chassis[K_X] / (chassis[C_X] * peak)
    share, best = abs(wanted) / most, chassis[SLIP] / b
    # The slip follows from the force that is wanted, the other way round than in the formula: by a
    # table of its inverse, and rounds for the combined slip.
    kappa, left = 0.0, longitudinal_left(alpha, 0.0, chassis)
    for i in range(ROUNDS):
        before, kappa = kappa, _slip_of(share / left, chassis) / b
        if abs(kappa - before) < NEAR * best:
            break
        if kappa == best:
            left = longitudinal_left(alpha, best, chassis)  # more than without slip
            if share >= left:
                return math.copysign(most * left, wanted), math.copysign(best, wanted)
        if i > 0:  # half way, so that it does not go to and fro
            kappa = 0.5 * (before + kappa)
        left = longitudinal_left(alpha, kappa, chassis)
    return wanted, math.copysign(kappa, wanted)


ROUNDS, NEAR = 12, 0.01  # to find the slip, to such a share of the largest one


@kernel
def rolling_tyre(kappa, alpha, camber, load, mu, stiffness, chassis):
    """Return a tyre's forces ahead and to the left [N], at a slip, an angle and a camber.

    Args:
        kappa: longitudinal slip [1], positive of a wheel that is driven.
        alpha: slip angle [rad], see ``lateral``.
        camber: how far the wheel leans to the right [rad].
        load: [N], ≥ 0.
        mu: of the road [1].
        stiffness: cornering stiffness per load [1/rad].
        chassis: the vehicle, a multi-body one.
    """
    peak = mu * chassis[MU_X]
    z = _bent(chassis[K_X] / (chassis[C_X] * peak) * kappa, chassis[E_X])
    ahead = peak * load * elementary.sin(chassis[C_X] * elementary.atan(z))
    grip = mu * (1.0 - chassis[D_Y3] * camber * camber)
    most = grip * chassis[MU_Y] * load
    b = stiffness_factor(stiffness, grip, chassis)
    left = lateral(alpha + chassis[H_Y3] * camber, most, b, chassis)
    left = (left + mu * load * chassis[V_Y3] * camber) * lateral_left(alpha, kappa, chassis)
    far = chassis[V_YK4] * alpha
    turned = chassis[V_YK3] * camber / math.sqrt(1.0 + far * far)
    left += most * turned * elementary.sin(chassis[V_YK5] * elementary.atan(chassis[V_YK6] * kappa))
    return ahead * longitudinal_left(alpha, kappa, chassis), left
