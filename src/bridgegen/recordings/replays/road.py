"""A road along the ego's recorded path, for recordings whose lanes are not known.

Its one lane is where the ego's rear axle went, and runs on straight at both ends. So a driver who
takes the ego's place has a lane that leads where the ego went; everyone else is on a timetable and
needs no road.
"""

from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.openx.opendrive.model import Header, Lane, LaneSection, OpenDrive, Road, Width
from bridgegen.openx.opendrive.plan_view import Cubic, Geometry, Line, ParamPoly3

ROAD, LANE = "1", -1
WIDTH = 3.5  # m
BEFORE = 30.0  # m, of the road before the ego's start
BEYOND = 150.0  # m, after its end
PIECE = 4.0  # m, of the path to a cubic
STANDS = 0.05  # m; steps that are shorter have no direction
_SAMPLES = 33

Knot = tuple[float, float, float]
"""x, y [m] and direction [rad]."""


def along(x: Float, y: Float, h: Float) -> tuple[OpenDrive, float]:
    """Return a road network of one road along a path, and where on the road the path begins [m].

    Args:
        x: ``(T,)`` of the rear axle [m].
        y: ``(T,)`` [m].
        h: ``(T,)`` heading [rad], continuous.
    """
    knots = list(_knots(x, y, h))
    pieces = [Geometry(0.0, *_behind(knots[0], BEFORE), BEFORE, Line())]
    for one, two in pairwise(knots):
        pieces.append(_cubic(_end(pieces), one, two))
    last = knots[-1]
    pieces.append(Geometry(_end(pieces), *last, BEYOND, Line()))
    lanes = LaneSection(
        0.0, center=(Lane(0),),
        right=(Lane(LANE, "driving", widths=(Width(0.0, WIDTH, 0.0, 0.0, 0.0),)),),
    )  # fmt: skip
    shift = Cubic(0.0, 0.5 * WIDTH, 0.0, 0.0, 0.0)  # the lane's middle is the reference line
    road = Road(
        ROAD, _end(pieces), name="the ego's path", plan_view=tuple(pieces),
        lane_offsets=(shift,), sections=(lanes,),
    )  # fmt: skip
    header = Header(1, 7, name="the ego's path", version="1.00", vendor="BridgeGen")
    return OpenDrive(header, (road,), (), ()), BEFORE


def _end(pieces: list[Geometry]) -> float:
    return pieces[-1].s + pieces[-1].length


def _behind(knot: Knot, by: float) -> Knot:
    x, y, h = knot
    return x - by * float(np.cos(h)), y - by * float(np.sin(h)), h


def _knots(x: Float, y: Float, h: Float) -> Iterator[Knot]:
    """Yield points of the path, at least `PIECE` apart, with its direction there."""
    last = 0
    yield float(x[0]), float(y[0]), float(h[0])
    for k in range(1, len(x)):
        ahead = (x[k] - x[last]) * np.cos(h[last]) + (y[k] - y[last]) * np.sin(h[last])
        if ahead >= PIECE or (k == len(x) - 1 and ahead > STANDS):
            yield float(x[k]), float(y[k]), float(h[k])
            last = k


def _cubic(s: float, one: Knot, two: Knot) -> Geometry:
    """Return the cubic with both points and both directions."""
    x, y, h = one
    dx, dy, turn = two[0] - x, two[1] - y, two[2] - h
    u = dx * np.cos(h) + dy * np.sin(h)
    v = -dx * np.sin(h) + dy * np.cos(h)
    chord = float(np.hypot(u, v))
    end_u, end_v = chord * float(np.cos(turn)), chord * float(np.sin(turn))
    c_u, d_u = 3.0 * u - 2.0 * chord - end_u, chord + end_u - 2.0 * u
    c_v, d_v = 3.0 * v - end_v, end_v - 2.0 * v
    p = np.linspace(0.0, 1.0, _SAMPLES)
    speed = np.hypot(chord + 2.0 * c_u * p + 3.0 * d_u * p * p, 2.0 * c_v * p + 3.0 * d_v * p * p)
    length = float(np.sum(speed * _simpson(_SAMPLES)) / (_SAMPLES - 1))
    shape = ParamPoly3(
        0.0, chord, float(c_u), float(d_u), 0.0, 0.0, float(c_v), float(d_v)
    )  # fmt: skip
    return Geometry(s, x, y, h, length, shape)


def _simpson(n: int) -> Float:
    """Return the weights of Simpson's rule over n points, n odd, one apart."""
    weights = np.full(n, 2.0 / 3.0)
    weights[1::2], weights[[0, -1]] = 4.0 / 3.0, 1.0 / 3.0
    return weights
