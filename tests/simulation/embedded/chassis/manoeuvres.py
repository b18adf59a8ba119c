"""Standard manoeuvres in open loop: by our single-track model, and by CommonRoad's."""

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.simulation.embedded.chassis._single_track_kernels import advance, sub_steps
from bridgegen.simulation.embedded.chassis.parameters import Tyre, VehicleClass, chassis

STEP = 0.05
YAW_RATE, LATERAL, SLIP, SPEED = range(4)
SHIFTS = ("p_hx1", "p_vx1", "r_hx1", "r_hy1", "r_by3", "r_vy1")
"""Coefficients by which a tyre differs to its left and right, and rolls with drag; 0 in ours."""


@dataclass(frozen=True)
class Manoeuvre:
    """A manoeuvre.

    Attributes:
        angle: of the front wheels by time [rad].
        force: of brakes and drive by time, per mass [m/s²].
        speed: at its begin [m/s].
        lasts: [s].
        mu: of the road, as a share of the tyres' own.
    """

    angle: Callable[[float], float]
    force: Callable[[float], float]
    speed: float
    lasts: float
    mu: float = 1.0


def _steered(to: float, rate: float = 0.4, begin: float = 0.5) -> Callable[[float], float]:
    return lambda t: min(max((t - begin) * rate, 0.0), to)


def _sine(to: float) -> Callable[[float], float]:
    return lambda t: to * math.sin(math.pi * (t - 0.5)) if 0.5 <= t < 2.5 else 0.0


def _pressed(to: float) -> Callable[[float], float]:
    return lambda t: math.copysign(min(max(8.0 * (t - 2.0), 0.0), abs(to)), to)


MANOEUVRES = {
    "step steer": Manoeuvre(_steered(0.05), lambda t: 0.0, 20.0, 4.0),
    "step steer on ice": Manoeuvre(_steered(0.05), lambda t: 0.0, 20.0, 4.0, mu=0.4),
    "double lane change": Manoeuvre(_sine(0.06), lambda t: 0.0, 22.0, 4.0),
    "braking in a turn": Manoeuvre(_steered(0.024), _pressed(-4.0), 20.0, 4.5),
    "drive in a turn": Manoeuvre(_steered(0.03), _pressed(2.0), 15.0, 4.5),
}


def commonroad_car() -> Any:
    """Return CommonRoad's second parameter set, without its tyre's shifts."""
    from vehiclemodels.parameters_vehicle2 import parameters_vehicle2

    found = parameters_vehicle2()
    for name in SHIFTS:
        setattr(found.tire, name, 0.0)
    return found


def theirs(car: Any, what: Manoeuvre) -> Float:
    """Return yaw rate, lateral acceleration, slip angle and speed by time, ``(T, 4)``."""
    from vehiclemodels.vehicle_dynamics_std import vehicle_dynamics_std

    car, dt = deepcopy(car), 0.001
    car.tire.p_dx1 *= what.mu
    car.tire.p_dy1 *= what.mu
    rim = what.speed / car.R_w
    x = np.array([0.0, 0.0, what.angle(0.0), what.speed, 0.0, 0.0, 0.0, rim, rim])

    def rates(x: Float, t: float) -> Float:
        turns = (what.angle(t + 1e-6) - what.angle(t)) / 1e-6
        return np.array(vehicle_dynamics_std(x.tolist(), [turns, what.force(t)], car))

    found, each = [], round(STEP / dt)
    for i in range(round(what.lasts / dt) + 1):
        t, k1 = i * dt, rates(x, i * dt)
        if i % each == 0:
            v, turn, beta = x[3], x[5], x[6]
            across = v * math.cos(beta) * (k1[6] + turn) + k1[3] * math.sin(beta)
            found.append((turn, across, beta, v))
        k2 = rates(x + 0.5 * dt * k1, t + 0.5 * dt)
        k3 = rates(x + 0.5 * dt * k2, t + 0.5 * dt)
        k4 = rates(x + dt * k3, t + dt)
        x = x + dt / 6.0 * (k1 + 2.0 * k2 + 2.0 * k3 + k4)
    return np.array(found)


def like(car: Any) -> tuple[Float, float, float]:
    """Return our chassis of CommonRoad's car; its friction; and force per acceleration asked for.

    Its wheels have inertia: a torque gives less force than in balance, by their share of the mass.
    Its load transfer is that of the acceleration asked for.
    """
    tyre, wheels, wheelbase = car.tire, car.I_y_w / car.R_w**2, car.a + car.b
    gives = car.m / (car.m + 2.0 * wheels)

    def share(torque: float) -> float:
        return float((torque * (car.m + 2.0 * wheels) - wheels) / car.m)

    found = VehicleClass(
        front_load=car.b / wheelbase, height=car.h_s / gives,
        inertia=car.I_z / (car.m * car.a * car.b),
        k_front=-tyre.p_ky1, k_rear=-tyre.p_ky1, brake_front=share(car.T_sb),
        drive_front=share(car.T_se),
        tyre=Tyre(mu_x=tyre.p_dx1 / tyre.p_dy1, e_y=tyre.p_ey1),
    )  # fmt: skip
    return chassis(found, wheelbase, 1.0, 1.0), tyre.p_dy1, gives


def ours(
    found: Float, what: Manoeuvre, mu: float = 1.0, gives: float = 1.0, finer: int = 1
) -> Float:
    """Return the same of our model, with so many times its sub-steps."""
    place, vx, vy, turn = (0.0, 0.0, 0.0), what.speed, 0.0, 0.0
    heads, wheels = (1.0, 0.0), (math.cos(what.angle(0.0)), math.sin(what.angle(0.0)))

    def on(t: float, dt: float) -> Any:
        first, middle, last = what.angle(t), what.angle(t + 0.5 * dt), what.angle(t + dt)
        return advance(
            place, vx, vy, turn, heads, wheels, (middle - first, last - middle),
            gives * what.force(t + 0.5 * dt), mu * what.mu, 1.0, 0.0, 0.0, dt, found,
        )  # fmt: skip

    signals = []
    for i in range(round(what.lasts / STEP) + 1):
        across = turn * vx + (on(i * STEP, 1e-5)[2] - vy) / 1e-5
        signals.append((turn, across, math.atan2(vy, vx), math.hypot(vx, vy)))
        parts = finer * sub_steps(math.hypot(vx, vy), STEP, found)
        for j in range(parts):
            dt = STEP / parts
            place, vx, vy, turn, heads, wheels = on(i * STEP + j * dt, dt)
    return np.array(signals)
