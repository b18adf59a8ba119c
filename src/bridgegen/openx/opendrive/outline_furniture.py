"""What stands on and beside the roads, for a bird's-eye view: crosswalks, stop lines, signs."""

import math
from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.openx.opendrive.furniture import Object, Signal
from bridgegen.openx.opendrive.geometry import reference_pose
from bridgegen.openx.opendrive.lanes import points
from bridgegen.openx.opendrive.model import OpenDrive, Road

STRIPE = 0.5
"""Width of a crosswalk's stripes and of the gaps between them [m]; source: RMS-1, sign 293."""

_SIGN_WIDTH = 0.7  # m, where the file says none
_CORNERS = 4


@dataclass(frozen=True)
class Light:
    """A traffic light.

    Attributes:
        id: as the road network has it.
        x: [m].
        y: [m].
        h: the direction of the traffic that it is for [rad].
    """

    id: str
    x: float
    y: float
    h: float


def crosswalk_stripes(road: Road) -> Iterator[Float]:
    """Yield the stripes of a road's crosswalks, each as its four corners ``(4, 2)`` [m]."""
    for one in road.objects:
        corners = outline_of(road, one) if one.type == "crosswalk" else None
        if corners is None or len(corners) != _CORNERS:
            continue
        a, b, c, d = corners
        if math.dist(a, b) < math.dist(b, c):  # the stripes lie beside each other along a to b
            a, b, c, d = b, c, d, a
        long = math.dist(a, b)
        count = max(round((long / STRIPE - 1.0) / 2.0), 1)
        gap = long / (2 * count + 1)
        for k in range(count):
            u, v = (2 * k + 1) * gap / long, (2 * k + 2) * gap / long
            yield np.array([a + u * (b - a), a + v * (b - a), d + v * (c - d), d + u * (c - d)])


def stop_lines(road: Road) -> Iterator[tuple[float, Float]]:
    """Yield the stop lines that a road's objects are: s [m], and both ends ``(2, 2)`` [m]."""
    for one in road.objects:
        t = [corner for _, corner in one.corners]
        if t and (one.subtype or "").lower() == "stopline":
            yield one.s, points(road, np.array([one.s, one.s]), np.array([min(t), max(t)]))


def signs(road: Road) -> Iterator[Float]:
    """Yield the signs beside a road as they look from above: a line across, ``(2, 2)`` [m]."""
    for one in road.signals:
        if one.dynamic == "no":
            half = 0.5 * (one.width or _SIGN_WIDTH)
            yield points(road, np.array([one.s, one.s]), np.array([one.t - half, one.t + half]))


def lights(model: OpenDrive) -> list[Light]:
    """Return the traffic lights of a road network."""
    return [
        _light(road, one) for road in model.roads for one in road.signals if one.dynamic == "yes"
    ]


def _light(road: Road, one: Signal) -> Light:
    ((x, y),) = points(road, np.array([one.s]), np.array([one.t]))
    h = reference_pose(road, min(max(one.s, 0.0), road.length)).h
    return Light(one.id, float(x), float(y), h if one.orientation != "-" else h + math.pi)


def outline_of(road: Road, one: Object) -> Float | None:
    """Return the corners of an object's outline, ``(P, 2)`` [m]; None if it has none."""
    outline = one.outline or (one.outlines[0] if one.outlines else None)
    if outline is None:
        return None
    if outline.corners_road:
        s, t = (np.array([getattr(each, name) for each in outline.corners_road]) for name in "st")
        found = points(road, np.clip(s, 0.0, road.length), t)
    elif outline.corners_local:
        ((x, y),) = points(road, np.array([min(one.s, road.length)]), np.array([one.t]))
        h = reference_pose(road, min(one.s, road.length)).h + (one.hdg or 0.0)
        u, v = (np.array([getattr(each, name) for each in outline.corners_local]) for name in "uv")
        found = np.stack(
            [x + u * math.cos(h) - v * math.sin(h), y + u * math.sin(h) + v * math.cos(h)], axis=1
        )
    else:
        return None
    closed = len(found) > 1 and np.allclose(found[0], found[-1])
    return found[:-1] if closed else found
