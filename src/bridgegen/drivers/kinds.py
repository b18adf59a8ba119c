"""What an entity is, as numbers that compiled code can hold: `OBJECT_CLASSES`, numbered."""

from bridgegen.scenario.participants import OBJECT_CLASSES

NAMES = tuple(one.name for one in OBJECT_CLASSES)
"""In words, by number."""

CAR, TRUCK, BUS, MOTORCYCLE, BICYCLE, PEDESTRIAN, ANIMAL, OTHER = (
    NAMES.index(name)
    for name in ("car", "truck", "bus", "motorcycle", "bicycle", "pedestrian", "animal", "other")
)
"""The kinds that code refers to by name."""
