"""Where the entities of a file start, and how fast: what is said relative to one becomes absolute.

So far as the map and the parameters' values say it: on the road where the other entity starts.
"""

import math
from dataclasses import replace

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.geometry import reference_line
from bridgegen.openx.opendrive.lanes import borders, lane_along, lane_at, lane_pose, section_index
from bridgegen.openx.opendrive.model import OpenDrive, Road
from bridgegen.openx.opendrive.routes import plan_route
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters

_UP_TO_1_2 = (0, 1, 2)

InRoad = osc.RoadPosition | osc.RelativeRoadPosition | osc.RoutePosition


class Starts:
    """The starts of a file's entities.

    Args:
        scenario: the file.
        actions: its initial actions.
        roads: its map.
    """

    def __init__(
        self, scenario: osc.OpenScenario, actions: osc.InitActions, roads: OpenDrive
    ) -> None:
        self._roads = roads
        self._is_old = scenario.file_header.rev_minor in _UP_TO_1_2
        self._numbers = parameters.numbers(scenario)
        self._texts = parameters.values(scenario)
        self._of: dict[str, osc.Position] = {}
        self._speeds: dict[str, osc.SpeedAction] = {}
        for private in actions.privates:
            name = self.text(private.entity_ref)
            for wrapped in private.private_actions:
                action = wrapped.action
                inner = getattr(action, "action", action)
                if isinstance(action, osc.TeleportAction):
                    self._of.setdefault(name, action.position)
                elif isinstance(inner, osc.SpeedAction):
                    self._speeds.setdefault(name, inner)

    def absolute(self, wrapped: osc.PrivateAction) -> osc.PrivateAction:
        """Return an initial action whose place is on a lane, and whose speed is a number."""
        action = wrapped.action
        if isinstance(action, osc.TeleportAction):
            place = self.place(action.position)
            if place is None:
                place = self._in_world(action.position)
            if place is not None and place is not action.position:
                return replace(wrapped, action=replace(action, position=place))
        elif isinstance(action, osc.LongitudinalAction) and isinstance(
            action.action, osc.SpeedAction
        ):
            speed = self._speed(action.action, 0)
            if speed is not None and not _is_absolute(action.action):
                target = osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(speed))
                changed = replace(action.action, speed_action_target=target)
                return replace(wrapped, action=replace(action, action=changed))
        return wrapped

    def place(self, position: osc.Position) -> osc.Position | None:
        """Return a place of the map as one on a lane, or of the world; None where it is neither."""
        found = self._on_lane(position, 0)
        where = position.position if found is None else found.position
        try:
            if isinstance(where, osc.LanePosition):
                return self._turned(position if found is None else found, where)
            if isinstance(where, osc.RoadPosition):
                return replace(position, position=self._beside_lanes(where))
        except (InputError, ValueError):
            return None
        return found

    def pose(self, position: osc.Position) -> tuple[float, float, float] | None:
        """Return where a place is: x, y [m], heading [rad]; None where it is not known."""
        found = self.place(position)
        where = position.position if found is None else found.position
        if isinstance(where, osc.WorldPosition):
            return self.number(where.x), self.number(where.y), self.number(where.h or 0.0)
        if not isinstance(where, osc.LanePosition):
            return None
        try:
            return self._pose(where)
        except (InputError, ValueError):
            return None

    def _beside_lanes(self, where: osc.RoadPosition) -> osc.WorldPosition:
        """Return a place beside all lanes of a road as a point of the world.

        Raises:
            InputError: there is no such road.
        """
        road, t = self._roads.road(self.text(where.road_id)), self.number(where.t)
        line = reference_line(road, np.array([self.number(where.s)]))
        x, y, h = (float(array[0]) for array in (line.x, line.y, line.h))
        turned, facing = where.orientation, h
        if turned is not None and turned.h is not None:
            own = self.number(turned.h)
            facing = own if self._is_absolute(turned) else h + own
        facing = math.remainder(facing, math.tau)
        at = x - t * elementary.sin(h), y + t * elementary.cos(h)
        return osc.WorldPosition(*at, None, facing, None, None, line=where.line)

    def lane(self, entity: str) -> tuple[str, int] | None:
        """Return the road and the lane that an entity starts on; None where it is on none."""
        position = self._of.get(entity)
        place = None if position is None else self._on_lane(position, 0)
        if place is None or not isinstance(place.position, osc.LanePosition):
            return None
        try:
            return self.text(place.position.road_id), int(self.text(place.position.lane_id))
        except ValueError:
            return None

    def way(self, entity: str) -> int:
        """Return 1 where an entity's lane leads along its road, -1 against it; 0: unknown."""
        found = self.lane(entity)
        try:
            return 0 if found is None else self._roads.road(found[0]).direction(found[1])
        except InputError:
            return 0

    def text(self, value: osc.ParameterRef | str) -> str:
        """Return a text, at the parameters' values."""
        return str(self._texts[value.name] if isinstance(value, osc.ParameterRef) else value)

    def number(self, value: object) -> float:
        """Return a number, at the parameters' values."""
        if isinstance(value, osc.ParameterRef | osc.Expr):
            return float(value.resolve(self._numbers))
        return float(str(value))

    def _speed(self, action: osc.SpeedAction, depth: int) -> float | None:
        target = action.speed_action_target.target
        if isinstance(target, osc.AbsoluteTargetSpeed):
            return self.number(target.value)
        # A continuous target follows the other's speed from then on, and is no number. A circle of
        # references ends by the depth.
        other = self._speeds.get(self.text(target.entity_ref))
        if other is None or depth > len(self._speeds) or target.continuous is not False:
            return None
        base = self._speed(other, depth + 1)
        if base is None:
            return None
        factor = self.text(target.speed_target_value_type) == osc.SpeedTargetValueType.FACTOR
        return base * self.number(target.value) if factor else base + self.number(target.value)

    def _on_lane(self, position: osc.Position, depth: int) -> osc.Position | None:
        """Return the same place as one on a lane; None where it is on none, or is not known."""
        where = position.position
        try:
            if isinstance(where, osc.LanePosition):
                return self._turned(position, where)
            if isinstance(where, osc.RoutePosition):
                return replace(position, position=self._on_route(where))
            if isinstance(where, osc.RoadPosition):
                road = self.text(where.road_id)
                found = self._at(road, self.number(where.s), self.number(where.t), where)
                return replace(position, position=found)
            if not isinstance(where, osc.RelativeLanePosition | osc.RelativeRoadPosition):
                return None
            base = self._of.get(self.text(where.entity_ref))
            # Each step leads to another entity: more steps than entities are a circle of
            # references.
            if base is None or depth > len(self._of):
                return None
            other = self._on_lane(base, depth + 1)
            if other is None or not isinstance(other.position, osc.LanePosition):
                return None
            return replace(position, position=self._beside(other.position, where))
        except (InputError, ValueError):
            return None

    def _turned(self, position: osc.Position, where: osc.LanePosition) -> osc.Position:
        """Return a place whose orientation is relative to its lane.

        Raises:
            InputError: it is off the map.
            ValueError: its lane is no number.
        """
        turned = where.orientation
        if turned is None or turned.h is None or not self._is_absolute(turned):
            return position
        road, lane = self._roads.road(self.text(where.road_id)), int(self.text(where.lane_id))
        along = lane_pose(road, lane, self.number(where.s)).h
        h = math.remainder(self.number(turned.h) - along, math.tau)
        relative = replace(turned, type=osc.ReferenceContext.RELATIVE, h=h)
        return replace(position, position=replace(where, orientation=relative))

    def _is_absolute(self, turned: osc.Orientation) -> bool:
        """Return whether an orientation counts from the world's axes: without a type, up to 1.2."""
        if turned.type is None:
            return self._is_old
        return turned.type is osc.ReferenceContext.ABSOLUTE

    def _in_world(self, position: osc.Position) -> osc.Position | None:
        """Return a place relative to an entity as a point of the world; None where it is not."""
        where = position.position
        if not isinstance(where, osc.RelativeObjectPosition | osc.RelativeWorldPosition):
            return None
        base = self._of.get(self.text(where.entity_ref))
        try:
            at = None if base is None else self._on_lane(base, 0)
            if at is None or not isinstance(at.position, osc.LanePosition):
                return None
            x, y, h = self._pose(at.position)
        except (InputError, ValueError):
            return None
        dx, dy = self.number(where.dx), self.number(where.dy)
        if isinstance(where, osc.RelativeObjectPosition):
            dx, dy = (
                dx * elementary.cos(h) - dy * elementary.sin(h),
                dx * elementary.sin(h) + dy * elementary.cos(h),
            )
        turned = where.orientation
        if turned is not None and turned.h is not None:
            own = self.number(turned.h)
            h = own if self._is_absolute(turned) else h + own
        h = math.remainder(h, math.tau)
        point = osc.WorldPosition(x + dx, y + dy, None, h, None, None, line=where.line)
        return replace(position, position=point)

    def _pose(self, at: osc.LanePosition) -> tuple[float, float, float]:
        """Return where a place on a lane is in the world, and its heading [m, rad].

        Raises:
            InputError: it is off the map.
            ValueError: its lane is no number.
        """
        road, lane = self._roads.road(self.text(at.road_id)), int(self.text(at.lane_id))
        pose = lane_pose(road, lane, self.number(at.s))
        aside = self.number(at.offset or 0.0) * road.direction(lane)
        turned = at.orientation
        own = 0.0 if turned is None or turned.h is None else self.number(turned.h)
        return (
            pose.x - aside * elementary.sin(pose.h),
            pose.y + aside * elementary.cos(pose.h),
            pose.h + own,
        )

    def _on_route(self, where: osc.RoutePosition) -> osc.LanePosition:
        """Return the place so far along a route, on a lane that leads along it.

        Raises:
            InputError: no lane leads along the route, or it is shorter.
            ValueError: a waypoint is on no lane, or the place is that of an entity.
        """
        points = [
            self._on_lane(waypoint.position, 1) for waypoint in where.route_ref.route.waypoints
        ]
        places = []
        for point in points:
            if point is None or not isinstance(point.position, osc.LanePosition):
                raise ValueError("a waypoint is on no lane")
            at = point.position
            places.append((self.text(at.road_id), int(self.text(at.lane_id)), self.number(at.s)))
        said = where.in_route_position.position
        if isinstance(said, osc.PositionOfCurrentEntity) or len(places) < 2:
            raise ValueError("where an entity is on its route is not known")
        left = self.number(said.path_s)
        for step in plan_route(self._roads, places[0], places[1:-1], places[-1]).steps:
            length = abs(step.s_end - step.s)
            if left <= length:
                way = 1 if step.s_end >= step.s else -1
                s = step.s + way * left
                if isinstance(said, osc.PositionInRoadCoordinates):
                    return self._at(step.road_id, s, self.number(said.t), where, way)
                road, stated = self._roads.road(step.road_id), int(self.text(said.lane_id))
                lane = lane_along(road, stated, s, way)
                offset = self.number(said.lane_offset or 0.0) * (1 if lane == stated else -1)
                return self._along_road(road, lane, s, offset, where, way)
            left -= length
        raise ValueError("the route is shorter")

    def _beside(
        self, at: osc.LanePosition, where: osc.RelativeLanePosition | osc.RelativeRoadPosition
    ) -> osc.LanePosition:
        """Return the place beside and along from another one, on the same road.

        Raises:
            InputError: it is off the road.
            ValueError: no such lane, or no distance along the road.
        """
        road = self._roads.road(self.text(at.road_id))
        lane = int(self.text(at.lane_id))
        if where.ds is None:
            raise ValueError("ds is missing")
        s = self.number(at.s) + self.number(where.ds)
        if isinstance(where, osc.RelativeRoadPosition):
            aside = self.number(at.offset or 0.0) + self.number(where.dt)
            return self._along_road(road, lane, s, aside, where)
        lane = beside(lane, int(self.number(where.d_lane)))
        lane_at(road, lane, s)
        offset = None if where.offset is None else self.number(where.offset)
        return osc.LanePosition(road.id, str(lane), s, offset, where.orientation, line=where.line)

    def _at(
        self, road_id: str, s: float, t: float, where: InRoad, way: int = 1
    ) -> osc.LanePosition:
        """Return the place on the lane that holds a t [m].

        Raises:
            InputError: there is no such road.
            ValueError: no lane holds it.
        """
        road = self._roads.road(road_id)
        index = section_index(road, s)
        edges = borders(road, index, np.array([s]))
        for lane in road.sections[index].lanes:
            inner = float(edges[lane.id - (1 if lane.id > 0 else -1)][0])
            outer = float(edges[lane.id][0])
            if min(inner, outer) <= t <= max(inner, outer) and inner != outer:
                return self._along_road(road, lane.id, s, t - 0.5 * (inner + outer), where, way)
        raise ValueError(f"no lane holds t={t:g}")

    def _along_road(
        self, road: Road, lane: int, s: float, offset: float, where: InRoad, way: int = 1
    ) -> osc.LanePosition:
        """Return a place whose heading counts from a way along the road, as from its lane's.

        Raises:
            InputError: there is no such lane there.
        """
        lane_at(road, lane, s)
        turned = where.orientation
        if road.direction(lane) != way and (turned is None or not self._is_absolute(turned)):
            own = 0.0 if turned is None or turned.h is None else self.number(turned.h)
            h = math.remainder(own + math.pi, math.tau)
            turned = osc.Orientation(osc.ReferenceContext.RELATIVE, h)
        return osc.LanePosition(road.id, str(lane), s, offset, turned, line=where.line)


def beside(lane: int, across: int) -> int:
    """Return the id of the lane so many further left of the reference line's direction."""
    found = lane + across
    return found + (1 if across > 0 else -1) if across and lane * found <= 0 else found


def _is_absolute(action: osc.SpeedAction) -> bool:
    return isinstance(action.speed_action_target.target, osc.AbsoluteTargetSpeed)
