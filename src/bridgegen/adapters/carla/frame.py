"""Between OpenDRIVE's right-handed world and CARLA's left-handed one; nowhere else is it done.

Ours: x, y, z up, headings counter-clockwise [rad], an entity's reference point is its rear axle's
centre on the ground. CARLA's: y is ours negated, yaw is ours negated [deg], an actor's origin is a
point of its model. What both have in common is the middle of the body's box.
"""

import math
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float

if TYPE_CHECKING:
    import carla


def location(x: float, y: float, z: float = 0.0) -> "carla.Location":
    """Return a point of our world [m] in CARLA's."""
    import carla

    return carla.Location(x=float(x), y=-float(y), z=float(z))


def point(location: "carla.Location | carla.Vector3D") -> tuple[float, float]:
    """Return x, y [m] in our world of a point, or a vector, of CARLA's."""
    return location.x, -location.y


def heading(rotation: "carla.Rotation") -> float:
    """Return the heading [rad], in −π to π, of a rotation of CARLA's."""
    turn = -math.radians(rotation.yaw)
    return math.remainder(turn, 2.0 * math.pi)


def rotation(h: float) -> "carla.Rotation":
    """Return the rotation in CARLA's world of a heading [rad]."""
    import carla

    return carla.Rotation(yaw=math.degrees(math.remainder(-h, 2.0 * math.pi)))


def velocity(h: float, v: float) -> "carla.Vector3D":
    """Return the velocity in CARLA's world of a speed [m/s] along a heading [rad]."""
    import carla

    return carla.Vector3D(x=v * math.cos(h), y=-v * math.sin(h), z=0.0)


def steering(left: float) -> float:
    """Return what CARLA takes, right positive, for a share of full lock to the left."""
    return -left


def placed(
    state: Float, centre: float, box: "carla.BoundingBox", ground: float = 0.0
) -> "carla.Transform":
    """Return where an actor's origin is if its box stands on the ground where an entity's does.

    Args:
        state: ``(4,)`` x, y [m] of the reference point, heading [rad], and what is not looked at.
        centre: of the entity's box, ahead of the reference point [m].
        box: the actor's, in its own frame.
        ground: the height of the road there [m].
    """
    import carla

    x, y, h = float(state[0]), float(state[1]), float(state[2])
    # The middle of the box is what both worlds have in common: an actor's origin is somewhere in
    # its model, an entity's reference point is its rear axle.
    ahead, aside = centre - box.location.x, box.location.y  # aside: the origin, left of the centre
    cos, sin = math.cos(h), math.sin(h)
    return carla.Transform(
        location(
            x + ahead * cos - aside * sin,
            y + ahead * sin + aside * cos,
            ground + box.extent.z - box.location.z,
        ),
        rotation(h),
    )


def seen(
    transform: "carla.Transform",
    moves: "carla.Vector3D",
    centre: float,
    box: "carla.BoundingBox",
) -> Float:
    """Return an entity's state from its actor's; the inverse of `placed`.

    Args:
        transform: the actor's.
        moves: its velocity.
        centre: of the entity's box, ahead of its reference point [m].
        box: the actor's, in its own frame.

    Returns:
        ``(4,)`` float64: x, y [m] of the reference point, heading [rad], forward speed [m/s] ≥ 0.
    """
    x, y = point(transform.location)
    h = heading(transform.rotation)
    ahead, aside = centre - box.location.x, box.location.y
    cos, sin = math.cos(h), math.sin(h)
    v_x, v_y = point(moves)
    return np.array(
        [
            x - ahead * cos + aside * sin,
            y - ahead * sin - aside * cos,
            h,
            # The component along the heading: a car that settles or slides has speed across, which
            # is no motion of its wheels.
            max(v_x * cos + v_y * sin, 0.0),
        ]
    )


def points(
    scan: npt.NDArray[np.float32], place: tuple[float, float, float]
) -> npt.NDArray[np.float32]:
    """Return a LiDAR's points in the ego's frame.

    Args:
        scan: ``(P, 4)`` x, y, z [m] in the sensor's frame, CARLA's, which looks ahead; intensity.
        place: where the sensor is in the ego's frame [m].
    """
    seen = scan.copy()
    seen[:, 1] *= -1.0
    seen[:, :3] += np.array(place, np.float32)
    return seen
