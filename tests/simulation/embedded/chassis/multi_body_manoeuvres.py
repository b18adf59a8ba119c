"""Standard manoeuvres in open loop: by our multi-body model, and by CommonRoad's."""

import math
from collections.abc import Callable
from copy import deepcopy
from dataclasses import dataclass
from typing import Any

import numpy as np
from scipy.integrate import solve_ivp
from vehiclemodels import vehicle_dynamics_mb as commonroad
from vehiclemodels.init_mb import init_mb
from vehiclemodels.utils import tire_model

from bridgegen.base.arrays import Float
from bridgegen.simulation.embedded.chassis import _chassis_columns as common
from bridgegen.simulation.embedded.chassis import _multi_body_columns as columns
from bridgegen.simulation.embedded.chassis._multi_body_kernels import (
    advance_bodies,
    sub_steps_of_bodies,
)
from bridgegen.simulation.embedded.chassis.multi_body import Axle, Camber, MultiBody, multi_body
from bridgegen.simulation.embedded.chassis.parameters import Tyre

STEP = 0.05
YAW_RATE, LATERAL, ROLL, SPEED, X, Y = range(6)
SHIFTS = (
    "p_hx1", "p_vx1", "r_hx1", "r_hy1", "r_by3", "r_vy1", "p_hy1", "p_vy1",
)  # fmt: skip
"""Coefficients by which a tyre differs to its left and right, and rolls with drag; 0 in ours."""


@dataclass(frozen=True)
class Manoeuvre:
    """A manoeuvre.

    Attributes:
        angle: of the front wheels by time [rad].
        force: of brakes and drive by time, per mass [m/s²].
        speed: at its begin [m/s].
        lasts: [s].
        mu: of the road under the left and the right wheels, as a share of the tyres' own.
    """

    angle: Callable[[float], float]
    force: Callable[[float], float]
    speed: float
    lasts: float
    mu: tuple[float, float] = (1.0, 1.0)


def steered(to: float, rate: float = 0.4, begin: float = 0.5) -> Callable[[float], float]:
    return lambda t: min(max((t - begin) * rate, 0.0), to)


def sine(to: float) -> Callable[[float], float]:
    return lambda t: to * math.sin(math.pi * (t - 0.5)) if 0.5 <= t < 2.5 else 0.0


def pressed(to: float, begin: float = 2.0) -> Callable[[float], float]:
    return lambda t: math.copysign(min(max(8.0 * (t - begin), 0.0), abs(to)), to)


MANOEUVRES = {
    "step steer": Manoeuvre(steered(0.05), lambda t: 0.0, 20.0, 4.0),
    "double lane change": Manoeuvre(sine(0.06), lambda t: 0.0, 22.0, 4.0),
    "braking in a turn": Manoeuvre(steered(0.024), pressed(-4.0), 20.0, 4.5),
    "drive in a turn": Manoeuvre(steered(0.03), pressed(2.0), 15.0, 4.5),
    "braking on split friction": Manoeuvre(
        lambda t: 0.0, pressed(-5.0, 0.5), 22.0, 2.0, mu=(1.0, 0.3)
    ),
    "split friction in a turn": Manoeuvre(
        steered(0.03), pressed(-2.0), 20.0, 4.0, mu=(0.9, 0.5)
    ),
}  # fmt: skip


def commonroad_car(number: int) -> Any:
    """Return one of CommonRoad's parameter sets, without its tyre's shifts."""
    from vehiclemodels import parameters_vehicle1, parameters_vehicle2, parameters_vehicle3

    module = (parameters_vehicle1, parameters_vehicle2, parameters_vehicle3)[number - 1]
    found = getattr(module, f"parameters_vehicle{number}")()
    for name in SHIFTS:
        setattr(found.tire, name, 0.0)
    return found


class _SplitTyres:
    """CommonRoad's tyre model, which is called for left and right wheels in turn.

    Its axes are SAE's, with y to the right: its left is our right.
    """

    def __init__(self, tyre: Any, mu: tuple[float, float]) -> None:
        self.tyres, self.calls = [deepcopy(tyre), deepcopy(tyre)], 0
        for each, share in zip(self.tyres, mu[::-1], strict=True):
            each.p_dx1 *= share
            each.p_dy1 *= share
            each.p_vy3 *= share  # Pacejka's λ_μ

    def _next(self) -> Any:
        self.calls += 1
        return self.tyres[(self.calls - 1) % 2]

    def formula_longitudinal(self, kappa, gamma, load, _):
        return tire_model.formula_longitudinal(kappa, gamma, load, self._next())

    def formula_lateral(self, alpha, gamma, load, _):
        return tire_model.formula_lateral(alpha, gamma, load, self._next())

    formula_longitudinal_comb = staticmethod(tire_model.formula_longitudinal_comb)
    formula_lateral_comb = staticmethod(tire_model.formula_lateral_comb)


def theirs(car: Any, what: Manoeuvre, monkeypatch: Any) -> Float:
    """Return our signals by time, ``(T, 6)``, of CommonRoad's model, integrated to 1e-8."""
    monkeypatch.setattr(commonroad, "tireModel", _SplitTyres(car.tire, what.mu))

    def rates(t: float, x: Float) -> Float:
        turns = (what.angle(t + 1e-6) - what.angle(t)) / 1e-6
        x = x.copy()
        x[2] = what.angle(t)
        return np.array(commonroad.vehicle_dynamics_mb(x.tolist(), [turns, what.force(t)], car))

    times = np.arange(0.0, what.lasts + 0.5 * STEP, STEP)
    start = init_mb([0.0, 0.0, what.angle(0.0), what.speed, 0.0, 0.0, 0.0], car)
    got = solve_ivp(
        rates, (0.0, times[-1]), start, "RK45", times, rtol=1e-8, atol=1e-9, max_step=0.02
    )
    assert got.success
    rows = []
    for t, x in zip(times, got.y.T, strict=True):
        change = rates(t, x)
        rows.append((x[5], change[10] + x[5] * x[3], -x[6], math.hypot(x[3], x[10]), x[0], x[1]))
    return np.array(rows)


def multi_body_like(car: Any) -> MultiBody:
    """Return our parameters of CommonRoad's car.

    Its camber is that of axes with y to the left, its roll of axes with y to the right: a tyre
    pushes to the side from which it leans.
    """
    tyre = car.tire
    axles = [
        Axle(
            track=getattr(car, f"T_{end}"), unsprung=getattr(car, f"m_u{end}"),
            i_axle=getattr(car, f"I_u{end}"), spring=getattr(car, f"K_s{end}"),
            damper=getattr(car, f"K_sd{end}"), bar=-getattr(car, f"K_ts{end}"),
            camber=getattr(car, f"D_{end}"),
        )
        for end in "fr"
    ]  # fmt: skip
    camber = Camber(
        d_y3=tyre.p_dy3, h_y3=-tyre.p_hy3, v_y3=-tyre.p_vy3 / tyre.p_dy1, v_yk3=tyre.r_vy3,
        v_yk4=tyre.r_vy4, v_yk5=tyre.r_vy5, v_yk6=tyre.r_vy6,
    )  # fmt: skip
    return MultiBody(
        width=car.w, to_front=car.a, to_rear=car.b, mass=car.m, sprung=car.m_s, height=car.h_cg,
        sprung_height=car.h_s, i_roll=car.I_Phi_s, i_pitch=car.I_y_s, i_yaw=car.I_z,
        k_tyre=car.K_zt, shift=car.K_lt, drive_front=float(car.T_se), axles=tuple(axles),
        radius=car.R_w, i_wheel=car.I_y_w, k_joint=car.K_ras, d_joint=car.K_rad,
        k_front=-tyre.p_ky1, k_rear=-tyre.p_ky1,
        tyre=Tyre(mu_x=tyre.p_dx1 / tyre.p_dy1, e_y=tyre.p_ey1), camber=camber,
    )  # fmt: skip


def like(car: Any) -> tuple[Float, float]:
    """Return our chassis of CommonRoad's car, without control of slip; and its friction.

    Its torque does not make up for the wheels' inertia.
    """
    made = multi_body(multi_body_like(car), car.a + car.b, car.w, car.h_cg, 1.0)
    made[columns.PUSH], made[common.BRAKE_FRONT] = car.m, car.T_sb
    made[columns.BEST] = math.inf
    return made, car.tire.p_dy1


def begun(car: Float, speed: float) -> Float:
    """Return a motion straight ahead that begins as CommonRoad's, the body 2 cm too high."""
    motion = np.zeros(columns.MOTION_OF_BODIES)
    motion[common.VX] = speed
    motion[columns.SPIN : columns.SPIN + 4] = speed / car[columns.RADIUS]
    wheelbase = car[common.TO_FRONT] + car[common.TO_REAR]
    for axle, share in enumerate((car[common.TO_REAR], car[common.TO_FRONT])):
        unsprung = car[columns.AXLE + axle * columns.AXLE_COLUMNS + columns.UNSPRUNG]
        load = (share / wheelbase * car[columns.SPRUNG] + unsprung) * 9.81
        at = columns.AXLE_AT + axle * columns.AXLE_STATES + columns.PRESSED
        motion[at] = 0.5 * load / car[columns.K_TYRE]
    return motion


def ours(car: Float, what: Manoeuvre, mu: float = 1.0, finer: int = 1) -> Float:
    """Return the same of our model, with so many times its sub-steps."""
    motion = begun(car, what.speed)
    rear, mus = car[common.TO_REAR], (mu * what.mu[0], mu * what.mu[1])
    motion[common.X] = -rear

    def on(motion: Float, t: float, dt: float) -> None:
        angles = what.angle(t), what.angle(t + 0.5 * dt), what.angle(t + dt)
        advance_bodies(motion, angles, what.force(t + 0.5 * dt), mus, 1.0, 0.0, 0.0, dt, car)

    rows = []
    for i in range(round(what.lasts / STEP) + 1):
        then = motion.copy()
        on(then, i * STEP, 1e-5)
        vx, vy, turn = motion[:3]
        c, s = math.cos(motion[common.H]), math.sin(motion[common.H])
        rows.append((
            turn, (then[common.VY] - vy) / 1e-5 + turn * vx, motion[columns.ROLL],
            math.hypot(vx, vy), motion[common.X] + rear * c, motion[common.Y] + rear * s,
        ))  # fmt: skip
        parts = finer * sub_steps_of_bodies(math.hypot(vx, vy), STEP, car)
        for j in range(parts):
            on(motion, i * STEP + j * STEP / parts, STEP / parts)
    return np.array(rows)
