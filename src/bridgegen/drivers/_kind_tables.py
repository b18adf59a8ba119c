"""Properties of each kind for compiled code, by its code in `bridgegen.drivers.kinds`."""

from bridgegen.drivers.kinds import NAMES
from bridgegen.scenario.participants import OBJECT_CLASSES

_CONDUCT = tuple(one.conduct for one in OBJECT_CLASSES)

IS_VEHICLE = tuple(one == "vehicle" for one in _CONDUCT)
"""Whether it is a motor vehicle."""

IS_CYCLE = tuple(one == "bicycle" for one in _CONDUCT)
IS_PEDESTRIAN = tuple(one == "pedestrian" for one in _CONDUCT)
IS_ANIMAL = tuple(one == "animal" for one in _CONDUCT)
IS_OBSTACLE = tuple(one == "obstacle" for one in _CONDUCT)

USES_LANES = tuple(one in ("vehicle", "bicycle") for one in _CONDUCT)
"""Whether it drives or rides."""

IS_ON_FOOT = tuple(one in ("pedestrian", "animal") for one in _CONDUCT)
"""Whether it walks."""

NEEDS_ROOM = tuple(one in ("bicycle", "pedestrian") for one in _CONDUCT)
"""Whether it is passed with more room than a vehicle."""

IS_VULNERABLE = tuple(one in ("bicycle", "pedestrian", "animal") for one in _CONDUCT)
"""Whether it is a vulnerable road user, or an animal."""

HIDES_PEOPLE = tuple(one.hides_people for one in OBJECT_CLASSES)
"""Whether a person may step out from behind it."""

LAMPS = tuple(one.lamps for one in OBJECT_CLASSES)
"""cd, of the lamps that each kind shows; UN R7 asks 4 of each of two rear lamps."""

REFLECTANCE = tuple(one.reflectance for one in OBJECT_CLASSES)
"""Of each kind at 905 nm: dark clothes 0.1; with plates and reflectors, vehicles more."""

MISTAKEN_FOR = tuple(NAMES.index(one.mistaken_for) for one in OBJECT_CLASSES)
"""The class that each kind is mistaken for where its own is not recognised."""
