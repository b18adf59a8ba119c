"""What an entity is, as numbers that compiled code can hold."""

CAR, TRUCK, BUS, MOTORBIKE, BICYCLE, PEDESTRIAN, ANIMAL, OTHER = range(8)
"""From OpenSCENARIO's vehicle category, pedestrian category or miscellaneous object."""

NAMES = ("car", "truck", "bus", "motorbike", "bicycle", "pedestrian", "animal", "other")
"""In words, by number."""
