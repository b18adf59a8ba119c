"""A road that meets no junction: straight, or a chain of lines, arcs and spirals."""

from collections.abc import Iterator

from bridgegen.base.errors import OntologyError
from bridgegen.openx.opendrive.from_owl.arms import Arm, road_of
from bridgegen.openx.opendrive.geometry import pose
from bridgegen.openx.opendrive.model import Header, OpenDrive
from bridgegen.openx.opendrive.plan_view import Arc, Geometry, Line, Spiral

Bend = tuple[float, float, float]
"""A bend: length [m], curvature at the start and at the end [1/m]."""

_LEAST_MARGIN = 1.0
"""Least distance between a bend's centre and the nearest edge of the road [m]."""


def build(name: str, arm: Arm, bends: tuple[Bend, ...]) -> OpenDrive:
    """Return a road network of one road, which starts at the origin along +x.

    Args:
        name: of the road network.
        arm: the road; its outbound lanes run along it.
        bends: its parts; empty: straight.

    Raises:
        OntologyError: a bend that is tighter than the road is wide.
    """
    left, left_strips, right, right_strips = arm.sides()
    for _, start, end in bends:
        for side, lanes, strips in ((1.0, left, left_strips), (-1.0, right, right_strips)):
            inside = sum(lanes) + sum(width for _, width in strips) + _LEAST_MARGIN
            tightest = max(side * start, side * end)
            if tightest * inside >= 1.0:
                raise OntologyError(
                    f"road {arm.name}: a bend must have a radius > {inside:g} m, the road's width "
                    f"on its inner side and {_LEAST_MARGIN:g} m, got {1.0 / tightest:.3g} m"
                )
    line = tuple(plan_view(bends or ((arm.length, 0.0, 0.0),)))
    header = Header(1, 7, name=name, version="1.00", vendor="BridgeGen")
    return OpenDrive(header, (road_of(arm, line, None),), (), ())


def plan_view(bends: tuple[Bend, ...]) -> Iterator[Geometry]:
    """Yield a reference line from the origin along +x."""
    s, x, y, h = 0.0, 0.0, 0.0, 0.0
    for length, start, end in bends:
        shape: Line | Arc | Spiral = Spiral(start, end)
        # A spiral of equal curvatures is valid, but netconvert takes 12 GB of memory on it, and
        # others divide by zero.
        if start == end:
            shape = Arc(start) if start else Line()
        geometry = Geometry(s, x, y, h, length, shape)
        yield geometry
        x, y, h, _ = pose(geometry, length)
        s += length
