"""What gravity does to a vehicle along its path, where the map's roads rise, fall or bank."""

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.physics import GRAVITY
from bridgegen.openx.opendrive.lanes import values
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.plan_view import Cubic
from bridgegen.openx.opendrive.routes import Route

LEVEL = np.empty((0, 3))
"""The slopes of a path on which gravity does nothing."""


def slopes(model: OpenDrive, route: Route, step: float, count: int) -> Float:
    """Return what gravity does along a route: see `bridgegen.simulation.embedded._memory_kernels`.

    The grade is that of the road's reference line, over the distance travelled along the lane; a
    change of superelevation tilts lanes beside it no further.

    Args:
        model: the road network.
        route: the chain of lanes.
        step: between two samples [m].
        count: of samples.

    Returns:
        ``(count, 3)`` float64, or ``LEVEL`` where all roads of the route are level:
        gravity against the direction of travel [m/s²], positive uphill; to the right [m/s²], as a
        road does that falls to the right; and by what share it presses less on the road [1].
    """
    roads = {piece.road_id: model.road(piece.road_id) for piece in route.pieces}
    if not any(map(_is_sloped, roads.values())):
        # No table at all: on level roads no bit changes, and kernels do not look anything up.
        return LEVEL
    stations = np.arange(count) * step
    starts = np.array([piece.station for piece in route.pieces])
    which = np.maximum(np.searchsorted(starts, stations, side="right") - 1, 0)
    rise, bank = np.zeros((2, count))
    for i, piece in enumerate(route.pieces):
        on = which == i
        road = roads[piece.road_id]
        s = piece.s + (stations[on] - piece.station) * piece.rate
        s = np.clip(s, min(piece.s, piece.s_end), max(piece.s, piece.s_end))
        # Of the reference line: for 6 % of bank that changes over 50 m, a lane 5 m aside rises by
        # 0.6 %, which is left out.
        rise[on] = values(_derived(road.elevations), s) * piece.rate
        bank[on] = values(road.superelevations, s) * np.sign(piece.rate)
    grade = elementary.atan(rise)
    press = elementary.cos(grade) * elementary.cos(bank)
    gravity = (elementary.sin(grade), elementary.sin(bank) * elementary.cos(grade))
    return np.stack((GRAVITY * gravity[0], GRAVITY * gravity[1], 1.0 - press), axis=1)


def _is_sloped(road: Road) -> bool:
    """Return whether a road rises, falls or banks anywhere."""
    rises = any(elevation.b or elevation.c or elevation.d for elevation in road.elevations)
    return rises or any(
        superelevation.a or superelevation.b or superelevation.c or superelevation.d
        for superelevation in road.superelevations
    )


def _derived(records: tuple[Cubic, ...]) -> tuple[Cubic, ...]:
    """Return the cubics' derivatives."""
    return tuple(
        Cubic(record.s, record.b, 2.0 * record.c, 3.0 * record.d, 0.0) for record in records
    )
