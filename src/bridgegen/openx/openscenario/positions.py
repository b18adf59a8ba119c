"""Where something is, and the lines that lead there: routes and trajectories."""

from dataclasses import dataclass, field
from typing import Annotated

from bridgegen.openx.openscenario.declarations import CATALOG, ParameterDeclarations
from bridgegen.openx.openscenario.element import (
    BARE,
    ENTITY,
    FINITE,
    ROAD,
    AtLeast,
    Element,
    FiniteDouble,
    Range,
    Tag,
)
from bridgegen.openx.openscenario.enumerations import FollowingMode, ReferenceContext, RouteStrategy
from bridgegen.openx.openscenario.values import (
    Boolean,
    Double,
    Int,
    ParameterRef,
    String,
    UnsignedInt,
)


@dataclass(frozen=True)
class Orientation(Element):
    """Heading, pitch and roll [rad].

    A missing ``type`` means absolute up to 1.2 and relative from 1.3 on: write it always.
    """

    type: ReferenceContext | ParameterRef | None = None
    h: FiniteDouble | None = None
    p: FiniteDouble | None = None
    r: FiniteDouble | None = None


@dataclass(frozen=True)
class WorldPosition(Element):
    """A point of the world [m], with an orientation [rad]."""

    x: FiniteDouble
    y: FiniteDouble
    z: FiniteDouble | None = None
    h: FiniteDouble | None = None
    p: FiniteDouble | None = None
    r: FiniteDouble | None = None


@dataclass(frozen=True)
class RelativeWorldPosition(Element):
    """A point so far from an entity's, along the axes of the world [m]."""

    entity_ref: Annotated[String, ENTITY]
    dx: FiniteDouble
    dy: FiniteDouble
    dz: FiniteDouble | None = None
    orientation: Orientation | None = None


@dataclass(frozen=True)
class RelativeObjectPosition(Element):
    """A point so far from an entity's, along the axes of that entity [m]: ahead, left, up."""

    entity_ref: Annotated[String, ENTITY]
    dx: FiniteDouble
    dy: FiniteDouble
    dz: FiniteDouble | None = None
    orientation: Orientation | None = None


@dataclass(frozen=True)
class RoadPosition(Element):
    """A point by its road's coordinates [m]: along the reference line, and left of it."""

    road_id: Annotated[String, ROAD]
    s: Annotated[Double, Range(0.0, FINITE)]
    t: FiniteDouble
    orientation: Orientation | None = None


@dataclass(frozen=True)
class RelativeRoadPosition(Element):
    """A point so far from an entity's in its road's coordinates [m]."""

    entity_ref: Annotated[String, ENTITY]
    ds: FiniteDouble
    dt: FiniteDouble
    orientation: Orientation | None = None


@dataclass(frozen=True)
class LanePosition(Element):
    """A point on a lane [m]: along the road's reference line, and left of the lane's centre.

    A relative heading of 0 is the lane's driving direction, whichever way the road runs (so
    esmini reads it).
    """

    road_id: Annotated[String, ROAD]
    lane_id: String
    s: Annotated[Double, Range(0.0, FINITE)]
    offset: FiniteDouble | None = None
    orientation: Orientation | None = None


@dataclass(frozen=True)
class RelativeLanePosition(Element):
    """A point so many lanes to the left of an entity's, and so far along [m].

    Either ``ds`` along the road's reference line or ``ds_lane`` along the lane's centre.
    """

    entity_ref: Annotated[String, ENTITY]
    d_lane: Int
    ds: FiniteDouble | None = None
    ds_lane: FiniteDouble | None = None
    offset: FiniteDouble | None = None
    orientation: Orientation | None = None


@dataclass(frozen=True)
class GeoPosition(Element):
    """A point on the globe [°, m]; those without ``_deg`` [rad] are 1.1's."""

    latitude_deg: Annotated[Double | None, Range(-90.0, 90.0)] = None
    longitude_deg: Annotated[Double | None, Range(-180.0, 180.0)] = None
    altitude: FiniteDouble | None = None
    vertical_road_selection: Int | None = None
    latitude: FiniteDouble | None = None
    longitude: FiniteDouble | None = None
    height: FiniteDouble | None = None
    orientation: Orientation | None = None


@dataclass(frozen=True)
class PositionOfCurrentEntity(Element):
    """Where an entity is on the route."""

    entity_ref: Annotated[String, ENTITY]


@dataclass(frozen=True)
class PositionInRoadCoordinates(Element):
    """So far along the route, and left of its roads' reference lines [m]."""

    path_s: Annotated[Double, Range(0.0, FINITE)]
    t: FiniteDouble


@dataclass(frozen=True)
class PositionInLaneCoordinates(Element):
    """So far along the route, on a lane, and left of its centre [m].

    The lane is one that leads along the route, see `lane_along`.
    """

    path_s: Annotated[Double, Range(0.0, FINITE)]
    lane_id: String
    lane_offset: FiniteDouble | None = None


@dataclass(frozen=True)
class InRoutePosition(Element):
    """One of the ways to say where on a route."""

    position: Annotated[
        PositionOfCurrentEntity | PositionInRoadCoordinates | PositionInLaneCoordinates,
        Tag("FromCurrentEntity"),
        Tag("FromRoadCoordinates"),
        Tag("FromLaneCoordinates"),
    ]


@dataclass(frozen=True)
class Waypoint(Element):
    """A point that a route passes, and how it gets there."""

    route_strategy: RouteStrategy | ParameterRef
    position: "Position"


@dataclass(frozen=True)
class Route(Element):
    """A way along roads through two waypoints or more."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    closed: Boolean
    waypoints: Annotated[tuple[Waypoint, ...], AtLeast(2)]


@dataclass(frozen=True)
class RouteRef(Element):
    """The route that is meant."""

    route: Annotated[Route, CATALOG]


@dataclass(frozen=True)
class RoutePosition(Element):
    """A point on a route."""

    route_ref: RouteRef
    in_route_position: InRoutePosition
    orientation: Orientation | None = None


@dataclass(frozen=True)
class Vertex(Element):
    """A point of a polyline, and when to be there [s]."""

    position: "Position"
    time: FiniteDouble | None = None


@dataclass(frozen=True)
class Polyline(Element):
    """Straight lines from vertex to vertex."""

    vertices: Annotated[tuple[Vertex, ...], AtLeast(2)]


@dataclass(frozen=True)
class Clothoid(Element):
    """A curve whose curvature [1/m] changes evenly over its length [m], and when [s].

    ``curvature_dot`` is 1.0's name of ``curvature_prime`` [1/m²].
    """

    curvature: FiniteDouble
    length: Annotated[Double, Range(0.0, FINITE)]
    position: "Position"
    curvature_prime: FiniteDouble | None = None
    curvature_dot: FiniteDouble | None = None
    start_time: FiniteDouble | None = None
    stop_time: FiniteDouble | None = None


@dataclass(frozen=True)
class ClothoidSplineSegment(Element):
    """A clothoid between two curvatures [1/m]; it begins where the last one ends.

    ``h_offset`` [rad] is a kink at its start.
    """

    curvature_start: FiniteDouble
    curvature_end: FiniteDouble
    length: Annotated[Double, Range(0.0, FINITE)]
    h_offset: FiniteDouble | None = None
    time_start: FiniteDouble | None = None
    position_start: Annotated["Position | None", Tag("PositionStart")] = None


@dataclass(frozen=True)
class ClothoidSpline(Element):
    """Clothoids one after the other, and when the last one ends [s]."""

    segments: Annotated[tuple[ClothoidSplineSegment, ...], AtLeast(1)]
    time_end: FiniteDouble | None = None


@dataclass(frozen=True)
class ControlPoint(Element):
    """A control point of a NURBS curve."""

    position: "Position"
    time: FiniteDouble | None = None
    weight: FiniteDouble | None = None


@dataclass(frozen=True)
class Knot(Element):
    """A knot of a NURBS curve."""

    value: FiniteDouble


@dataclass(frozen=True)
class Nurbs(Element):
    """A non-uniform rational B-spline."""

    order: Annotated[UnsignedInt, Range(2)]
    control_points: Annotated[tuple[ControlPoint, ...], AtLeast(2)]
    knots: Annotated[tuple[Knot, ...], AtLeast(2)]


@dataclass(frozen=True)
class Shape(Element):
    """The line of a trajectory."""

    shape: Polyline | Clothoid | ClothoidSpline | Nurbs


@dataclass(frozen=True)
class Trajectory(Element):
    """A line by its name."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    closed: Boolean
    shape: Shape


@dataclass(frozen=True)
class TrajectoryRef(Element):
    """The trajectory that is meant."""

    trajectory: Annotated[Trajectory, CATALOG]


@dataclass(frozen=True)
class TrajectoryPosition(Element):
    """A point on a trajectory [m]: along it, and left of it."""

    trajectory_ref: TrajectoryRef
    s: FiniteDouble
    t: FiniteDouble | None = None
    orientation: Orientation | None = None


@dataclass(frozen=True)
class Position(Element):
    """One of the ways to say where."""

    position: (
        WorldPosition
        | RelativeWorldPosition
        | RelativeObjectPosition
        | RoadPosition
        | RelativeRoadPosition
        | LanePosition
        | RelativeLanePosition
        | RoutePosition
        | GeoPosition
        | TrajectoryPosition
    )


# --- Following a trajectory, with or without times ---


@dataclass(frozen=True)
class NoTime(Element):
    """Times of the vertices do not count: the entity keeps its own speed."""


@dataclass(frozen=True)
class Timing(Element):
    """Times of the vertices count, moved [s] and scaled."""

    domain_absolute_relative: ReferenceContext | ParameterRef
    scale: FiniteDouble
    offset: FiniteDouble


@dataclass(frozen=True)
class TimeReference(Element):
    """Whether the times of the vertices count."""

    reference: Annotated[NoTime | Timing, Tag("None"), Tag("Timing")]


@dataclass(frozen=True)
class TrajectoryFollowingMode(Element):
    """Whether to be on the line exactly or to steer along it."""

    following_mode: FollowingMode | ParameterRef


@dataclass(frozen=True)
class FollowTrajectoryAction(Element):
    """Moving along a trajectory, from so far on it [m].

    1.0 has no ``TrajectoryRef``: the trajectory stands in the action itself.
    """

    time_reference: TimeReference
    trajectory_following_mode: TrajectoryFollowingMode
    trajectory_ref: Annotated[TrajectoryRef, BARE]
    initial_distance_offset: Annotated[Double | None, Range(0.0)] = None
