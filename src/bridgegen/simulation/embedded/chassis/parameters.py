"""The parameters of vehicles with dynamics: by class, fitted to the body of the scenario.

Where no source is named the figure is ours.
"""

import math
from dataclasses import dataclass, field, fields

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.simulation.embedded.chassis import _chassis_columns as columns


@dataclass(frozen=True, kw_only=True)
class Tyre:
    """Coefficients of the magic formula, of one and the same tyre on both axles.

    Those of CommonRoad's parameter set, of a car's tyre: Althoff and Würsching, CommonRoad: Vehicle
    Models, 2020, table 7. Its friction is the road's here, in both directions.

    Attributes:
        c_x: shape of the longitudinal force [1].
        mu_x: its peak on a road of friction 1 [1].
        e_x: its curvature [1].
        k_x: slip stiffness per load [1].
        c_y: likewise of the lateral force.
        mu_y: likewise.
        e_y: likewise.
        b_xa: how the longitudinal force falls with the slip angle [1].
        b_xa2: and how that changes with the longitudinal slip [1].
        c_xa: its shape [1].
        e_xa: its curvature [1].
        b_yk: how the lateral force falls with the longitudinal slip [1].
        b_yk2: and how that changes with the slip angle [1].
        c_yk: its shape [1].
        e_yk: its curvature [1].
    """

    c_x: float = 1.6411
    mu_x: float = 1.0
    e_x: float = 0.46403
    k_x: float = 22.303
    c_y: float = 1.3507
    mu_y: float = 1.0
    e_y: float = 0.0  # −0.007 there
    b_xa: float = 13.276
    b_xa2: float = -13.778
    c_xa: float = 1.2568
    e_xa: float = 0.65225
    b_yk: float = 7.1433
    b_yk2: float = 9.1916
    c_yk: float = 1.0719
    e_yk: float = -0.27572

    def slip(self, share: Float) -> Float:
        """Return B·κ of shares of the largest longitudinal force: the magic formula's inverse."""
        bent = elementary.tan(elementary.asin(share) / self.c_x)
        z, e = bent.copy(), self.e_x
        for _ in range(50):
            z -= (z - e * (z - elementary.atan(z)) - bent) / (1.0 - e + e / (1.0 + z * z))
        return z


@dataclass(frozen=True, kw_only=True)
class VehicleClass:
    """What vehicles of a class have in common.

    Attributes:
        front_load: share of the weight on the front axle, standing.
        height: of the centre of gravity, as a share of the body's.
        inertia: about the vertical axis, per mass and the axles' distances from the centre of
            gravity [1]; 1: as of two masses on the axles.
        k_front: cornering stiffness of the front axle per load [1/rad], suspension and steering
            included.
        k_rear: likewise of the rear axle.
        steering_lag: time constant of the steering [s].
        steering_rate: how fast the front wheels turn at most [rad/s].
        brake_lag: time constant of the brakes [s].
        drive_lag: likewise of engine or motor.
        brake_front: front axle's share of the brakes' force; NaN: that of its load, which
            electronic brake force distribution approaches.
        drive_front: likewise of the drive's.
        tyre: the tyres.
    """

    front_load: float
    height: float
    inertia: float
    k_front: float
    k_rear: float
    steering_lag: float = 0.1  # as of the reference driver, see ``ego._control_kernels``
    steering_rate: float = 0.4  # CommonRoad: Vehicle Models, table 6
    brake_lag: float = 0.2  # as of the reference driver: lag and build-up, 0.1 s each
    drive_lag: float = 0.2
    brake_front: float = math.nan
    drive_front: float = 1.0
    tyre: Tyre = field(default_factory=Tyre)


CLASSES = {
    # Heights: 0.36 to 0.40 of a car's, Heydinger et al., SAE 1999-01-1336. Inertia: 0.94 and 1.00
    # of CommonRoad's two cars. Stiffness: for an understeer gradient of 1.6 °/g.
    # Steering: 550 °/s of a wheel at 16 : 1. CommonRoad's 0.4 rad/s and Apollo's 400 °/s of a car
    # are limits for planners; that car's drive-by-wire kit takes 1,000 °/s (Dataspeed), and sine
    # with dwell of UN R140 is 1,190 °/s (0.7 Hz, 270°).
    "car": VehicleClass(
        front_load=0.58, height=0.38, inertia=0.97, k_front=12.0, k_rear=18.0, steering_rate=0.6
    ),
    # Stiffness of truck tyres: about 0.1 per degree of slip and load, Fancher et al., A Factbook of
    # the Mechanical Properties of the Components for Single-Unit and Articulated Heavy Trucks,
    # UMTRI-86-12, 1986. Air brakes: 75 % of the pressure within 0.6 s, UN R13, annex 6. Inertia:
    # of a box of even density, as long and wide as the body.
    "truck": VehicleClass(
        front_load=0.35, height=0.38, inertia=1.2, k_front=6.0, k_rear=7.0, steering_lag=0.15,
        brake_lag=0.43, drive_lag=0.4, drive_front=0.0,
    ),
    "bus": VehicleClass(
        front_load=0.36, height=0.36, inertia=1.5, k_front=6.0, k_rear=7.0, steering_lag=0.15,
        brake_lag=0.43, drive_lag=0.4, drive_front=0.0,
    ),
}  # fmt: skip
"""Chassis parameters by the name of an object class, see
`bridgegen.scenario.participants.OBJECT_CLASSES`."""


def chassis_of(name: str, wheelbase: float, body: Float) -> Float:
    """Return the chassis of a body, ``(CHASSIS,)``; see ``_chassis_columns``.

    Args:
        name: of `CLASSES`.
        wheelbase: [m], > 0.
        body: the row of ``Program.bodies``.
    """
    return chassis(
        CLASSES[name], wheelbase, float(body[7]), elementary.atan(wheelbase * float(body[6]))
    )


def chassis(found: VehicleClass, wheelbase: float, height: float, lock: float) -> Float:
    """Return the chassis of a class.

    Args:
        found: the class.
        wheelbase: [m], > 0.
        height: of the body [m].
        lock: largest steering angle [rad].
    """
    front = (1.0 - found.front_load) * wheelbase
    rear = found.front_load * wheelbase
    made = np.zeros(columns.CHASSIS)
    made[columns.TO_FRONT], made[columns.TO_REAR] = front, rear
    made[columns.HEIGHT] = found.height * height
    made[columns.AGILITY] = 1.0 / (found.inertia * front * rear)
    made[columns.LOCK] = lock
    at = np.linspace(0.0, 1.0, columns.SLIPS + 1)
    made[columns.SLIP :] = found.tyre.slip(1.0 - at * at)
    for class_ in (found, found.tyre):
        for name in (each.name for each in fields(class_)):
            if (column := getattr(columns, name.upper(), None)) is not None and name not in (
                "height",
                "inertia",
            ):
                made[column] = getattr(class_, name)
    return made
