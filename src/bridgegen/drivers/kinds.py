"""What an entity is, as numbers that compiled code can hold: `OBJECT_CLASSES`, numbered."""

from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.scenario.participants import OBJECT_CLASSES, PARTICIPANTS

NAMES = tuple(object_class.name for object_class in OBJECT_CLASSES)
"""Names of the object classes, by code."""

CAR, TRUCK, BUS, MOTORCYCLE, BICYCLE, PEDESTRIAN, ANIMAL, OTHER = (
    NAMES.index(name)
    for name in ("car", "truck", "bus", "motorcycle", "bicycle", "pedestrian", "animal", "other")
)
"""The kinds that code refers to by name."""


# --- What a vehicle's lamps tell others: indicators and brake lights, as bits of a number ---
# Indicators are as the storyboard says. Brake lights light by themselves, unless it has switched
# them.


LEFT, RIGHT, BRAKE = 1, 2, 4
"""Bits of the indicators and brake lights that are lit; both indicators are hazard lights, which
announce no lane change."""

SWITCHED = 8
"""Bit beside ``BRAKE``: brake lights are as the storyboard has switched them."""

BLUE = 16
"""Bit of the blue lights of an emergency vehicle on a call; drivers know of them by its siren."""

HAZARD = LEFT | RIGHT


def other_side(lamps: npt.NDArray[Any]) -> npt.NDArray[Any]:
    """Return what lamps show with the left indicator for the right one, and the other way round."""
    bits = lamps.astype(np.int64)
    found = (bits & ~HAZARD) | ((bits & LEFT) << 1) | ((bits & RIGHT) >> 1)
    return found.astype(lamps.dtype)


BRAKE_LIGHTS_FROM = 1.3
"""Deceleration from which brake lights must be lit [m/s²]. Source: UN R13-H, 5.2.22: not below 0.7
m/s², always above 1.3 m/s²."""


# --- The columns of ``Rollout.detections``: how the ego's sensors detect an entity at an instant --
# A detection is in the row of the entity that caused it, or of the greater of those it is of.


SEEN_BY = 0
"""Sensors that saw the entity: `NO_FRAME`, `MISSED`, `CAMERA`, `LIDAR` or `BOTH`; other columns are
valid from `CAMERA` on."""
X, Y = 1, 2
"""The detected box's centre in the world [m]."""
HEADING = 3
"""The detected box's heading [rad], counter-clockwise from +x."""
LENGTH, WIDTH = 4, 5
"""The detected box's length and width [m], > 0."""
CONFIDENCE = 6
"""The detection's confidence, 0 to 1."""
KIND = 7
"""The class assigned to it, a code of `bridgegen.drivers.kinds`."""

DETECTION = 8
"""Number of columns of a detection."""

NO_FRAME, MISSED, CAMERA, LIDAR, BOTH, GHOST = -1, 0, 1, 2, 3, 4
"""Codes of `SEEN_BY`: no sensor took a frame at this instant; a frame missed the entity; the
sensors that saw it; a false positive, where nothing is."""


# --- Properties of each kind for compiled code, by its code in `bridgegen.drivers.kinds` ---


_CONDUCT = tuple(object_class.conduct for object_class in OBJECT_CLASSES)

IS_VEHICLE = tuple(item == "vehicle" for item in _CONDUCT)
"""Whether each kind is a motor vehicle, by code."""

IS_CYCLE = tuple(item == "bicycle" for item in _CONDUCT)
IS_PEDESTRIAN = tuple(item == "pedestrian" for item in _CONDUCT)
IS_ANIMAL = tuple(item == "animal" for item in _CONDUCT)
IS_OBSTACLE = tuple(item == "obstacle" for item in _CONDUCT)

USES_LANES = tuple(item in ("vehicle", "bicycle") for item in _CONDUCT)
"""Whether each kind drives or rides, by code."""

IS_ON_FOOT = tuple(item in ("pedestrian", "animal") for item in _CONDUCT)
"""Whether each kind walks, by code."""

NEEDS_ROOM = tuple(item in ("bicycle", "pedestrian") for item in _CONDUCT)
"""Whether each kind is passed with more room than a vehicle, by code."""

IS_VULNERABLE = tuple(item in ("bicycle", "pedestrian", "animal") for item in _CONDUCT)
"""Whether each kind is a vulnerable road user, or an animal, by code."""

HIDES_PEOPLE = tuple(object_class.hides_people for object_class in OBJECT_CLASSES)
"""Whether a person may step out from behind each kind, by code."""

LAMPS = tuple(object_class.lamps for object_class in OBJECT_CLASSES)
"""Luminous intensity of the lamps that each kind shows [cd]; UN R7 asks 4 of each of two rear
lamps."""

_BODIES = {kind.seen_as.name: kind.body for kind in reversed([*PARTICIPANTS.values()])}
HEIGHTS = tuple(_BODIES[name].height for name in NAMES)
"""Height of each kind's usual body [m], by code."""

REFLECTANCE = tuple(object_class.reflectance for object_class in OBJECT_CLASSES)
"""Reflectance of each kind at 905 nm: dark clothes 0.1; with plates and reflectors, vehicles
more."""

MISTAKEN_FOR = tuple(NAMES.index(object_class.mistaken_for) for object_class in OBJECT_CLASSES)
"""The class that each kind is mistaken for where its own is not recognised."""
