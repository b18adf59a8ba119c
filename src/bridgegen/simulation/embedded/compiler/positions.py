"""Positions of a scenario file as a table: what the rollout needs to find one when it is asked for.

Their numbers may vary by row, but for those that only the roads can resolve: t of a RoadPosition,
and where on a route a RoutePosition is.
"""

from dataclasses import replace
from typing import TYPE_CHECKING

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.simulation.embedded._codes import (
    BY_LANES,
    BY_OBJECT,
    BY_ROAD,
    BY_TRAJECTORY,
    BY_WORLD,
    IN_WORLD,
    ON_LANE,
    ON_ROAD,
)
from bridgegen.simulation.embedded.compiler.tables import Tables
from bridgegen.simulation.embedded.program import (
    LanePoint,
    LaneSpot,
    Point,
    RoadSpot,
    RouteSpot,
    Spot,
    WorldSpot,
)

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.compiler.layouts import Layouts

RELATIVE_SINCE = 3
"""The minor version from which a missing type of an Orientation means relative."""


def is_fixed(position: osc.Position) -> bool:
    """Return whether a position is the same whatever rows and entities do, and is told by the file.

    One on a lane, by numbers, or one of the world.
    """
    where = position.position
    if isinstance(where, osc.LanePosition) and where.orientation is None:
        numbers: tuple[Value | None, ...] = (where.s, where.offset)
    elif isinstance(where, osc.WorldPosition):
        numbers = (where.x, where.y)
    else:
        return False
    return not any(isinstance(number, osc.ParameterRef | Expr) for number in numbers)


class Positions:
    """The positions of a scenario file.

    Attributes:
        rows: ``(·, 8)`` as ``_codes`` names the columns.
        spots: per position what its road network has to resolve, None where there is nothing.
        points: the places that are the same whatever rows and entities do.
        layouts: takes the trajectories along which positions are.

    Args:
        tables: the compiler's; takes down what cannot be run.
        minor_version: of the file's OpenSCENARIO.
    """

    def __init__(self, tables: Tables, minor_version: int) -> None:
        self._tables, self.minor = tables, minor_version
        self.rows: list[tuple[int, ...]] = []
        self.spots: list[Spot | None] = []
        self.points: list[Point] = []
        self.layouts: Layouts | None = None

    def place(self, position: osc.Position) -> int:
        """Return the number of a place: of a point, or, from -1 down, of a position."""
        if not is_fixed(position):
            return -1 - self.add(position)
        point, aside = self._tables.point(position)
        if isinstance(point, LanePoint):
            point = replace(point, aside=self._tables.declared(aside))
        if point is None:
            return 0
        self.points.append(point)
        return len(self.points) - 1

    def add(self, position: osc.Position) -> int:
        """Return a position's number; what cannot be run is taken down."""
        where = position.position
        if isinstance(where, osc.LanePosition):
            spot = self._lane_spot(where)
            return self._append(where, ON_LANE, where.s, where.offset or 0.0, spot=spot)
        if isinstance(where, osc.WorldPosition):
            return self._append(where, IN_WORLD, where.x, where.y, heading=where.h)
        if isinstance(where, osc.RoutePosition) and isinstance(
            inner := where.in_route_position.position, osc.PositionOfCurrentEntity
        ):  # where it is
            return self._append(where, BY_OBJECT, 0.0, 0.0, whose=inner.entity_ref)
        if isinstance(where, osc.RoadPosition | osc.RoutePosition):
            return self._append(where, ON_ROAD, 0.0, 0.0, spot=self.spot(position))
        if isinstance(where, osc.RelativeLanePosition):
            # ``ds`` counts along the road, ``dsLane`` along the traffic of the other entity's lane,
            # and with it what is to the left, as in esmini.
            by_lane = where.ds_lane is not None
            metres = where.ds_lane if where.ds_lane is not None else where.ds
            return self._append(
                where,
                BY_LANES,
                metres or 0.0,
                where.offset or 0.0,
                whose=where.entity_ref,
                count=int(self._tables.literal(where, "dLane", where.d_lane)),
                by_lane=by_lane,
            )
        if isinstance(where, osc.RelativeRoadPosition):
            return self._append(where, BY_ROAD, where.ds, where.dt, whose=where.entity_ref)
        if isinstance(where, osc.RelativeObjectPosition):
            return self._append(where, BY_OBJECT, where.dx, where.dy, whose=where.entity_ref)
        if isinstance(where, osc.RelativeWorldPosition):
            return self._append(where, BY_WORLD, where.dx, where.dy, whose=where.entity_ref)
        if isinstance(where, osc.TrajectoryPosition):
            number = self.layouts.add_line(where) if self.layouts else 0
            return self._append(where, BY_TRAJECTORY, where.s, where.t or 0.0, count=number)
        self._tables.unsupported(where, type(where).__name__)
        return 0

    def add_own(self, entity: int) -> int:
        """Return the number of the position where an entity is."""
        slot = self._tables.slot(0.0)
        self.rows.append((BY_OBJECT, entity, 0, slot, slot, 0, slot, 0))
        self.spots.append(None)
        return len(self.rows) - 1

    def spot(self, position: osc.Position) -> Spot | None:
        """Return a position that does not depend on where entities are; others are taken down.

        Rows may not vary it, but for s on a lane: a way leads there by its declared value.
        """
        where, literal = position.position, self._tables.literal
        if isinstance(where, osc.WorldPosition):
            x, y, h = (
                literal(where, name, getattr(where, name) or 0.0) for name in ("x", "y", "h")
            )
            return WorldSpot(x, y, h, where.line)
        if isinstance(where, osc.LanePosition):
            spot, s = self._lane_spot(where), self._tables.declared(where.s)
            return spot and LaneSpot(spot.road, spot.lane, s, where.line)
        if isinstance(where, osc.RoadPosition):
            road = self._tables.text(where.road_id)
            s, t = literal(where, "s", where.s), literal(where, "t", where.t)
            return RoadSpot(road, s, t, where.line)
        if isinstance(where, osc.RoutePosition):
            return self._route_spot(where)
        self._tables.unsupported(where, f"{type(where).__name__} here")
        return None

    def _lane_spot(self, where: osc.LanePosition) -> LaneSpot | None:
        lane = self._lane_id(where)
        if lane is None:
            return None
        varies = isinstance(where.s, osc.ParameterRef | Expr)
        s = None if varies else self._tables.declared(where.s)
        return LaneSpot(self._tables.text(where.road_id), lane, s, where.line)

    def _lane_id(self, where: osc.LanePosition | osc.PositionInLaneCoordinates) -> int | None:
        text = self._tables.text(where.lane_id)
        try:
            return int(text)
        except ValueError:
            self._tables.unsupported(where, f'laneId="{text}" (a whole number is needed)')
            return None

    def _route_spot(self, where: osc.RoutePosition) -> RouteSpot | None:
        literal = self._tables.literal
        found = [self.spot(waypoint.position) for waypoint in where.route_ref.route.waypoints]
        waypoints = tuple(spot for spot in found if spot is not None)
        inner = where.in_route_position.position
        if isinstance(inner, osc.PositionOfCurrentEntity):
            self._tables.unsupported(inner, "FromCurrentEntity")
            return None
        s = literal(inner, "pathS", inner.path_s)
        if isinstance(inner, osc.PositionInRoadCoordinates):
            return RouteSpot(waypoints, s, None, literal(inner, "t", inner.t), where.line)
        aside = literal(inner, "laneOffset", inner.lane_offset or 0.0)
        return RouteSpot(waypoints, s, self._lane_id(inner), aside, where.line)

    def _is_absolute(self, turned: osc.Orientation | None) -> bool:
        """Return whether an orientation counts from the world's x axis."""
        return turned is not None and (
            turned.type is osc.ReferenceContext.ABSOLUTE
            or (turned.type is None and self.minor < RELATIVE_SINCE)
        )

    def _append(
        self,
        where: Element,
        kind: int,
        u: Value,
        w: Value,
        *,
        whose: object = None,
        count: int = 0,
        by_lane: bool = False,
        heading: Value | None = None,
        spot: Spot | None = None,
    ) -> int:
        turned = getattr(where, "orientation", None)
        # A WorldPosition without ``h`` faces 0; all others face along something.
        absolute = kind == IN_WORLD
        if turned is not None:
            heading, absolute = turned.h, self._is_absolute(turned)
        entity = -1 if whose is None else self._tables.entity(whose)
        slots = (self._tables.slot(u), self._tables.slot(w))
        h = self._tables.slot(heading or 0.0)
        self.rows.append((kind, entity, count, *slots, int(absolute), h, int(by_lane)))
        self.spots.append(spot)
        return len(self.rows) - 1
