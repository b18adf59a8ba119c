"""How large participants are, and what they can do: one body per type.

The dimensions are those of common models, rounded; accelerations are what such bodies reach on a
dry road. Reference point: the rear axle's centre of a vehicle, the centre of anything else.
"""

from collections.abc import Mapping
from dataclasses import dataclass
from types import MappingProxyType


@dataclass(frozen=True)
class Body:
    """A body.

    Attributes:
        length: [m].
        width: [m].
        height: [m].
        center_ahead: of the reference point [m].
        wheelbase: [m]; 0 for what has no axles.
        max_speed: [m/s].
        max_acceleration: [m/s²].
        max_deceleration: [m/s²].
        mass: [kg].
    """

    length: float
    width: float
    height: float
    center_ahead: float = 0.0
    wheelbase: float = 0.0
    max_speed: float = 0.0
    max_acceleration: float = 0.0
    max_deceleration: float = 0.0
    mass: float = 0.0

    @property
    def front(self) -> float:
        """From the reference point to the front [m]."""
        return self.center_ahead + 0.5 * self.length

    @property
    def rear(self) -> float:
        """From the reference point back to the rear [m]."""
        return 0.5 * self.length - self.center_ahead


BODIES: Mapping[str, Body] = MappingProxyType(
    {
        "car": Body(4.6, 1.9, 1.5, 1.4, 2.8, 60.0, 5.0, 9.0, 1500.0),  # a mid-size saloon
        "van": Body(5.9, 2.0, 2.6, 1.8, 3.6, 45.0, 3.5, 8.0, 3000.0),  # a delivery van
        "truck": Body(10.0, 2.5, 3.6, 3.4, 5.6, 25.0, 1.5, 6.0, 16000.0),  # two axles
        "bus": Body(12.0, 2.55, 3.1, 2.9, 5.9, 28.0, 1.5, 6.0, 18000.0),  # a solo city bus
        "motorcycle": Body(2.2, 0.8, 1.5, 0.7, 1.45, 60.0, 6.0, 8.0, 300.0),
        "emergency": Body(6.5, 2.2, 2.9, 2.0, 3.8, 45.0, 3.0, 7.0, 4500.0),  # an ambulance
        "bicycle": Body(1.8, 0.6, 1.8, 0.5, 1.05, 12.0, 1.5, 5.0, 95.0),  # with its rider
        "pedestrian": Body(0.5, 0.6, 1.75, max_speed=4.0, mass=75.0),
        "animal": Body(1.2, 0.4, 0.9, max_speed=12.0, mass=25.0),  # a roe deer
        "obstacle": Body(1.0, 1.0, 1.0, mass=50.0),
        "cone": Body(0.4, 0.4, 0.75, mass=4.0),  # 75 cm, as on fast roads
        "sign": Body(0.1, 0.9, 2.2, mass=20.0),  # a warning triangle on a post
    }
)
"""By type of participant, and of what stands at road works."""
