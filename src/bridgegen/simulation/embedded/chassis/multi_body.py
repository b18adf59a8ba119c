"""The parameters of multi-body vehicles: measured cars, fitted to the body of the scenario."""

from dataclasses import dataclass, field, fields

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.simulation.embedded.chassis import _chassis_columns as common
from bridgegen.simulation.embedded.chassis import _multi_body_columns as columns
from bridgegen.simulation.embedded.chassis.parameters import CLASSES, Tyre
from bridgegen.simulation.vehicles import KINEMATIC, MULTI_BODY, SINGLE_TRACK

CLASS = "car"
"""The only object class with parameters; see `bridgegen.scenario.participants.OBJECT_CLASSES`."""


@dataclass(frozen=True, kw_only=True)
class Camber:
    """Coefficients of the magic formula for camber, of a wheel that leans by an angle.

    Those of CommonRoad's parameter set (Althoff and Würsching, CommonRoad: Vehicle Models, 2020,
    table 7), in Pacejka's axes, in which a tyre pushes to the side to which it leans.

    Attributes:
        d_y3: loss of the peak of the lateral force by the camber's square [1].
        h_y3: shift of the slip angle by the camber [1].
        v_y3: lateral force per load and camber, on a road of friction 1 [1/rad].
        v_yk3: likewise, of the force that a longitudinal slip induces.
        v_yk4: how that falls with the slip angle [1].
        v_yk5: its shape [1].
        v_yk6: its stiffness [1].
    """

    d_y3: float = -2.8821
    h_y3: float = 0.031415
    v_y3: float = -0.32931
    v_yk3: float = -0.27568
    v_yk4: float = 12.12
    v_yk5: float = 1.9
    v_yk6: float = -10.704


@dataclass(frozen=True, kw_only=True)
class Axle:
    """An axle with its suspension.

    Attributes:
        track: [m].
        unsprung: mass [kg].
        i_axle: its moment of inertia in roll [kg·m²].
        spring: of each wheel [N/m].
        damper: likewise [N·s/m].
        bar: the anti-roll bar [N·m/rad].
        camber: of a wheel, by the spring's travel [rad/m].
    """

    track: float
    unsprung: float
    i_axle: float
    spring: float
    damper: float
    bar: float
    camber: float


@dataclass(frozen=True, kw_only=True)
class MultiBody:
    """A car, of one of CommonRoad's parameter sets.

    Source: Allen et al., DOT HS 807 956, 1992, by Althoff and Würsching, CommonRoad: Vehicle
    Models, 2020, table 6, and version 3.0.2 of the package.

    Attributes:
        width: of the body [m].
        to_front: from the sprung mass's centre of gravity to the front axle [m].
        to_rear: likewise to the rear axle.
        mass: [kg].
        sprung: mass of the body [kg].
        height: of the centre of gravity [m].
        sprung_height: of the sprung mass's [m].
        i_roll: moment of inertia of the body [kg·m²]; so are the others.
        i_pitch: likewise.
        i_yaw: likewise.
        k_tyre: vertical stiffness of a tyre [N/m].
        shift: how far a lateral force moves the tyre's point of contact [m/N].
        drive_front: the front axle's share of the drive.
        axles: front and rear.
        radius: of the wheels [m].
        i_wheel: moment of inertia of a wheel about its own axis [kg·m²].
        k_joint: stiffness between body and axle, sideways [N/m].
        d_joint: likewise, damping [N·s/m].
        k_front: cornering stiffness of the front wheels per load [1/rad]: the class's, for the
            model has no compliance in steering and suspension. The tyres' own is 21.92, with which
            the cars steer neutrally, by 0.04 to 0.2 °/g.
        k_rear: likewise of the rear wheels.
        slip_lag: time constant of the control of slip [s]; ours.
        tyre: the tyres.
        camber: likewise, of camber.
    """

    width: float
    to_front: float
    to_rear: float
    mass: float
    sprung: float
    height: float
    sprung_height: float
    i_roll: float
    i_pitch: float
    i_yaw: float
    k_tyre: float
    shift: float
    drive_front: float
    axles: tuple[Axle, Axle]
    radius: float = 0.344
    i_wheel: float = 1.7
    k_joint: float = 175187.0
    d_joint: float = 10215.7
    k_front: float = CLASSES[CLASS].k_front
    k_rear: float = CLASSES[CLASS].k_rear
    slip_lag: float = 0.005
    tyre: Tyre = field(default_factory=Tyre)
    camber: Camber = field(default_factory=Camber)


CARS = {
    "Ford Escort": MultiBody(
        width=1.674, to_front=0.88392, to_rear=1.50876, mass=1225.89, sprung=1094.54,
        height=0.557784, sprung_height=0.59436, i_roll=244.047, i_pitch=1342.26, i_yaw=1538.85,
        k_tyre=189786.0, shift=1.02783e-5, drive_front=1.0,
        axles=(
            Axle(track=1.389888, unsprung=65.6726, i_axle=32.5396, spring=21898.3, damper=1459.39,
                 bar=12880.3, camber=-0.623360),
            Axle(track=1.423416, unsprung=65.6726, i_axle=32.5396, spring=21898.3, damper=1459.39,
                 bar=0.0, camber=-0.209974),
        ),
    ),
    "BMW 320i": MultiBody(
        width=1.61, to_front=1.156196, to_rear=1.422717, mass=1093.295, sprung=965.711,
        height=0.574869, sprung_height=0.613730, i_roll=207.265, i_pitch=1565.82, i_yaw=1791.60,
        k_tyre=158294.0, shift=1.64307e-5, drive_front=0.0,
        axles=(
            Axle(track=1.38684, unsprung=63.7922, i_axle=30.6733, spring=24453.1, damper=1786.24,
                 bar=6914.88, camber=-0.393701),
            Axle(track=1.36398, unsprung=63.7922, i_axle=29.6704, spring=19635.5, damper=1649.08,
                 bar=2643.60, camber=-0.905512),
        ),
    ),
    "VW Vanagon": MultiBody(
        width=1.844, to_front=1.150792, to_rear=1.321136, mass=1478.90, sprung=1316.61,
        height=0.747817, sprung_height=0.804491, i_roll=479.884, i_pitch=2204.32, i_yaw=2473.12,
        k_tyre=212642.0, shift=1.22313e-5, drive_front=0.0,
        axles=(
            Axle(track=1.574292, unsprung=81.1443, i_axle=50.2769, spring=33577.4, damper=2405.56,
                 bar=33948.2, camber=-0.328084),
            Axle(track=1.543812, unsprung=81.1443, i_axle=48.3489, spring=39125.0, damper=2769.73,
                 bar=7731.37, camber=-0.328084),
        ),
    ),
}  # fmt: skip
"""Parameters of the cars by name."""

MOTIONS = {
    KINEMATIC: 0,
    SINGLE_TRACK: common.MOTION,
    MULTI_BODY: columns.MOTION_OF_BODIES,
}
"""The length of ``State.chassis``, by vehicle."""

VAN = 1.8  # m, from which height on a body is taken to be a van's


def multi_body_of(wheelbase: float, body: Float) -> Float:
    """Return the multi-body chassis of a car's body, ``(MULTI_BODY,)``.

    Of a body as high as a van it is that of the Vanagon, else of the car whose wheelbase is nearer.

    Args:
        wheelbase: [m], > 0.
        body: the row of ``Program.bodies``.
    """
    if body[7] >= VAN:
        found = CARS["VW Vanagon"]
    else:
        cars = (CARS["BMW 320i"], CARS["Ford Escort"])
        found = min(cars, key=lambda car: abs(car.to_front + car.to_rear - wheelbase))
    return multi_body(
        found,
        wheelbase,
        float(body[1]),
        CLASSES[CLASS].height * float(body[7]),
        elementary.atan(wheelbase * float(body[6])),
    )


def multi_body(car: MultiBody, wheelbase: float, width: float, height: float, lock: float) -> Float:
    """Return the chassis of a car, stretched to other measures; masses and springs stay.

    Moments of inertia go with the square of length (yaw, pitch) or width (roll).

    Args:
        car: the car.
        wheelbase: [m], > 0.
        width: of the body [m].
        height: of the centre of gravity [m].
        lock: largest steering angle [rad].
    """
    actuators = CLASSES[CLASS]
    long, wide = wheelbase / (car.to_front + car.to_rear), width / car.width
    made = np.zeros(columns.MULTI_BODY)
    for class_ in (actuators, car, car.tyre, car.camber):
        for name in (each.name for each in fields(class_)):
            for names in (common, columns):
                column = getattr(names, name.upper(), None)
                if column is not None and isinstance(getattr(class_, name), float):
                    made[column] = getattr(class_, name)
    made[common.TO_FRONT], made[common.TO_REAR] = long * car.to_front, long * car.to_rear
    made[common.HEIGHT] = height * car.sprung_height / car.height
    made[common.LOCK] = lock
    made[columns.BEST] = car.tyre.slip(np.ones(1))[0]
    made[columns.PUSH] = car.mass + 4.0 * car.i_wheel / car.radius**2
    made[columns.I_ROLL] *= wide**2
    made[columns.I_PITCH] *= long**2
    made[columns.I_YAW] *= long**2
    for i, axle in enumerate(car.axles):
        at = columns.AXLE + i * columns.AXLE_COLUMNS
        for name in (each.name for each in fields(axle)):
            made[at + getattr(columns, name.upper())] = getattr(axle, name)
        made[at + columns.TRACK] *= wide
        made[at + columns.I_AXLE] *= wide**2
    return made
