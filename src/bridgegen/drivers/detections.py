"""The columns of ``Rollout.detections``: how the ego's sensors detect an entity at an instant.

Association is perfect: a detection is in the row of the entity that caused it.
"""

SEEN_BY = 0
"""`NO_FRAME`, `MISSED`, `CAMERA`, `LIDAR` or `BOTH`; other columns are valid from `CAMERA` on."""
X, Y = 1, 2
"""The detected box's centre in the world [m]."""
HEADING = 3
"""[rad], counter-clockwise from +x."""
LENGTH, WIDTH = 4, 5
"""[m], > 0."""
CONFIDENCE = 6
"""0 to 1."""
KIND = 7
"""The class assigned to it, a code of `bridgegen.drivers.kinds`."""

DETECTION = 8
"""Number of columns."""

NO_FRAME, MISSED, CAMERA, LIDAR, BOTH = -1, 0, 1, 2, 3
"""No sensor took a frame at this instant; a frame missed the entity; the sensors that saw it."""
