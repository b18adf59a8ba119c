"""From what a driver demands, acceleration and curvature, to throttle, brake and steering."""

import math
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.adapters.carla import frame
from bridgegen.adapters.carla.settings import TIME_STEP

if TYPE_CHECKING:
    import carla

FULL_THROTTLE, FULL_BRAKE = 4.0, 9.0
"""Approximate acceleration at full throttle, and deceleration at full braking [m/s²], from which
the controller starts: a car's 0 to 100 km/h in 7 s is 4 on average; braking on a dry road 0.9 g."""

PROPORTIONAL, INTEGRAL = 0.5, 0.4
"""Gains of the controller of the speed error: proportional [pedal per m/s], integral [pedal per
m/s·s]."""

LEAD = 1.5
"""Largest difference of the demanded speed from the car's [m/s]: else a car that has no grip, or no
power, would make up for it long afterwards."""

PEDAL_RATE, STEERING_RATE = 8.0, 2.5
"""Shares of full travel per second: a foot goes from throttle to brake in 0.25 s; a wheel is turned
from straight to full lock in 0.4 s, as in an emergency."""

STANDING = 0.1
"""Speed below which the brake holds a car that is not meant to go [m/s]."""


@dataclass(frozen=True)
class Car:
    """What the pedals and the steering need to know of a vehicle.

    Attributes:
        wheelbase: [m].
        lock: of its front wheels [rad].
        curve: ``(·, 2)`` speed [km/h] and the share of the lock that CARLA lets it have there.
    """

    wheelbase: float
    lock: float
    curve: tuple[tuple[float, float], ...] = ((0.0, 1.0),)

    @classmethod
    def of(cls, control: "carla.VehiclePhysicsControl") -> "Car":
        """Return it from a vehicle's physics; its wheels' positions are in centimetres."""
        wheels = list(control.wheels)
        steered = [wheel for wheel in wheels if wheel.max_steer_angle > 0.0]
        others = [wheel for wheel in wheels if wheel.max_steer_angle <= 0.0]
        if not (steered and others):  # as a bicycle's may be listed
            return cls(2.8, math.radians(35.0))
        wheelbase = math.dist(_middle(steered), _middle(others)) / 100.0
        curve = tuple((item.x, item.y) for item in control.steering_curve) or ((0.0, 1.0),)
        return cls(wheelbase, math.radians(max(item.max_steer_angle for item in steered)), curve)

    def share(self, curvature: float, v: float) -> float:
        """Return the share of full lock, −1 to 1, left positive, for a curvature [1/m]."""
        speeds, shares = zip(*self.curve, strict=True)
        most = self.lock * float(np.interp(3.6 * v, speeds, shares))
        return min(max(math.atan(self.wheelbase * curvature) / max(most, 1e-3), -1.0), 1.0)


class Pedals:
    """Drives one car for one scenario.

    The pedals are fed forward by the demanded acceleration, and corrected by how far the speed is
    from the one that all demands so far come to.

    Args:
        car: what it is.
        v: its speed at the start [m/s].
    """

    def __init__(self, car: Car, v: float) -> None:
        self._car, self._meant, self._sum = car, v, 0.0
        self._pedal = self._steering = 0.0

    def control(self, acceleration: float, curvature: float, v: float) -> "carla.VehicleControl":
        """Return what to do for the next step.

        Args:
            acceleration: demanded [m/s²].
            curvature: demanded [1/m], left positive.
            v: the speed now [m/s].
        """
        import carla

        behind = self._meant - v
        pedal = acceleration / (FULL_THROTTLE if acceleration >= 0.0 else FULL_BRAKE)
        pedal += PROPORTIONAL * behind + INTEGRAL * self._sum
        if abs(pedal) < 1.0:  # pressed down, it cannot do more
            self._sum += behind * TIME_STEP
        self._meant = min(max(self._meant + acceleration * TIME_STEP, v - LEAD, 0.0), v + LEAD)
        self._pedal = _towards(self._pedal, pedal, PEDAL_RATE * TIME_STEP)
        turn = self._car.share(curvature, v)
        self._steering = _towards(self._steering, turn, STEERING_RATE * TIME_STEP)
        if acceleration <= 0.0 and v < STANDING:
            self._pedal, self._sum = -1.0, 0.0
        return carla.VehicleControl(
            throttle=max(self._pedal, 0.0),
            brake=max(-self._pedal, 0.0),
            steer=frame.steering(self._steering),
        )


def _towards(now: float, wanted: float, most: float) -> float:
    return min(max(min(max(wanted, -1.0), 1.0), now - most), now + most)


def _middle(wheels: "Sequence[carla.WheelPhysicsControl]") -> tuple[float, float, float]:
    places = [(wheel.position.x, wheel.position.y, wheel.position.z) for wheel in wheels]
    x, y, z = np.mean(places, axis=0).tolist()
    return x, y, z
