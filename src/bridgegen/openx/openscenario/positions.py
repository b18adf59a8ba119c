"""Where something is, and the route there."""

from dataclasses import dataclass
from typing import Annotated

from bridgegen.openx.openscenario.element import AtLeast, Element, Range
from bridgegen.openx.openscenario.enumerations import ReferenceContext, RouteStrategy
from bridgegen.openx.openscenario.values import Boolean, Double, ParameterRef, String


@dataclass(frozen=True)
class Orientation(Element):
    """Heading, pitch and roll [rad].

    A missing ``type`` means absolute up to 1.2 and relative from 1.3 on: write it always.
    """

    type: ReferenceContext | ParameterRef | None = None
    h: Double | None = None
    p: Double | None = None
    r: Double | None = None


@dataclass(frozen=True)
class WorldPosition(Element):
    """A point of the world [m], with an orientation [rad]."""

    x: Double
    y: Double
    z: Double | None = None
    h: Double | None = None
    p: Double | None = None
    r: Double | None = None


@dataclass(frozen=True)
class LanePosition(Element):
    """A point on a lane [m]: along the road's reference line, and left of the lane's centre.

    A relative heading of 0 is the lane's driving direction, whichever way the road runs (so
    esmini reads it).
    """

    road_id: String
    lane_id: String
    s: Annotated[Double, Range(0.0)]
    offset: Double | None = None
    orientation: Orientation | None = None


@dataclass(frozen=True)
class Position(Element):
    """One of the ways to say where."""

    position: LanePosition | WorldPosition


@dataclass(frozen=True)
class Waypoint(Element):
    """A point that a route passes, and how it gets there."""

    route_strategy: RouteStrategy | ParameterRef
    position: Position


@dataclass(frozen=True)
class Route(Element):
    """A way along roads through two waypoints or more."""

    name: String
    closed: Boolean
    waypoints: Annotated[tuple[Waypoint, ...], AtLeast(2)]
