"""The columns of ``Rollout.detections``: what the ego's sensors made of an entity at an instant.

Association is perfect: a detection stands in the row of the entity that caused it.
"""

SEEN_BY = 0
"""`NO_FRAME`, `NOBODY`, `CAMERA`, `LIDAR` or `BOTH`; the other columns count from `CAMERA` on."""
X, Y = 1, 2
"""The detected box's centre in the world [m]."""
HEADING = 3
"""[rad], counter-clockwise from +x."""
LENGTH, WIDTH = 4, 5
"""[m], > 0."""
CONFIDENCE = 6
"""0 to 1."""
KIND = 7
"""What it was taken for, as `bridgegen.ego.kinds` numbers it."""

DETECTION = 8
"""How many columns."""

NO_FRAME, NOBODY, CAMERA, LIDAR, BOTH = -1, 0, 1, 2, 3
"""No sensor took a frame at this instant; one did and missed the entity; who saw it."""
