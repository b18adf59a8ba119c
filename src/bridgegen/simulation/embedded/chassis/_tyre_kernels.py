"""The tyres: the magic formula with combined slip.

Source: Pacejka, Tyre and Vehicle Dynamics, 2nd ed., section 4.3.2, without camber, turn slip and
shifts. Friction scales the peak, and not the stiffness.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

import math

from bridgegen.compiled import inlined_kernel, kernel
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
    PEAK,
)


@inlined_kernel
def _bent(z, e):
    """Return the argument of the magic formula's arc tangent."""
    return z - e * (z - math.atan(z))


@inlined_kernel
def lateral(alpha, kappa, load, mu, stiffness, chassis):
    """Return an axle's lateral force per mass [m/s²], left positive.

    Args:
        alpha: its slip angle [rad], positive where it moves to its left.
        kappa: its longitudinal slip [1], negative where it brakes.
        load: on it, per mass [m/s²].
        mu: the road's friction [1].
        stiffness: cornering stiffness, per load [1/rad].
        chassis: see ``_chassis_columns``.
    """
    peak = mu * chassis[MU_Y]
    z = stiffness / (chassis[C_Y] * peak) * alpha
    force = -peak * load * math.sin(chassis[C_Y] * math.atan(_bent(z, chassis[E_Y])))
    if kappa != 0.0:
        along = chassis[B_YK2] * alpha
        z = chassis[B_YK] / math.sqrt(1.0 + along * along) * kappa
        force *= math.cos(chassis[C_YK] * math.atan(_bent(z, chassis[E_YK])))
    return force


@kernel
def longitudinal(wanted, alpha, load, mu, chassis):
    """Return an axle's longitudinal force per mass [m/s²], and the slip that gives it [1].

    The force is the one that is wanted, as far as the tyres can: control of slip (ABS, traction
    control) keeps the slip at the one of the largest force. The wheel is taken to be in balance:
    it follows its brake within milliseconds.

    Args:
        wanted: of brakes or drive, per mass [m/s²].
        alpha: see ``lateral``, and so are the others.
        load: on the axle.
        mu: of the road.
        chassis: the vehicle.
    """
    if wanted == 0.0 or load <= 0.0:
        return 0.0, 0.0
    peak = mu * chassis[MU_X]
    most, stiffness = peak * load, chassis[K_X] / (chassis[C_X] * peak)
    best = chassis[PEAK] / stiffness
    force = most * _left_by(alpha, best, chassis)
    if abs(wanted) >= force:
        return math.copysign(force, wanted), math.copysign(best, wanted)
    kappa = 0.0
    for _ in range(2):
        share = min(abs(wanted) / (most * _left_by(alpha, kappa, chassis)), 1.0)
        bent = math.tan(math.asin(share) / chassis[C_X])
        e, z = chassis[E_X], bent
        for _ in range(2):  # Newton's steps for (1 − E)·z + E·atan z = bent
            z -= (_bent(z, e) - bent) / (1.0 - e + e / (1.0 + z * z))
        kappa = min(z / stiffness, best)
    return wanted, math.copysign(kappa, wanted)


@inlined_kernel
def _left_by(alpha, kappa, chassis):
    """Return the share of the longitudinal force that is left at a slip angle."""
    along = chassis[B_XA2] * kappa
    z = chassis[B_XA] / math.sqrt(1.0 + along * along) * alpha
    return max(math.cos(chassis[C_XA] * math.atan(_bent(z, chassis[E_XA]))), LEAST)


LEAST = 0.01  # of the longitudinal force, however far a tyre slides sideways
