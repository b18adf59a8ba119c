"""OpenSCENARIO2OWL, its places: from a lane position to a distance along a leg of the map.

The other way round than `bridgegen.openx.openscenario.from_owl.entities`. Roads that lead to the
scenario's intersection count from there (`bridgegen.openx.openscenario.to_owl.legs`); any other
counts by itself, from its end at a junction, or from its start where none or both ends are at one.
"""

import math
import re
from typing import Any

import pyoxigraph as ox

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lanes import lane_at, section_index
from bridgegen.openx.opendrive.legs import junction_end
from bridgegen.openx.opendrive.map_names import lane_name
from bridgegen.openx.opendrive.model import Road
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.entities import RADIANS
from bridgegen.openx.openscenario.to_owl.build import (
    POSITION,
    NotExpressibleError,
    StoryBuilder,
    node_of,
    shortest,
    simplest,
)
from bridgegen.openx.openscenario.to_owl.legs import Stretch

_LENGTH_SLACK = 1e-6  # [m]
_NAME = r"\(?\s*\$(?P<name>[A-Za-z_][A-Za-z0-9_]*)\s*\)?"
_REST = re.compile(rf"\$\{{\s*(?P<length>\d+\.?\d*|\.\d+)\s*-\s*{_NAME}\s*\}}")
_BEYOND = re.compile(rf"\$\{{\s*{_NAME}\s*-\s*(?P<length>\d+\.?\d*|\.\d+)\s*\}}")
_TURNED = re.compile(rf"\$\{{\s*{_NAME}\s*\*\s*{re.escape(RADIANS)}\s*\}}")
_MIRRORED = re.compile(rf"\$\{{\s*-\s*{_NAME}\s*\}}")


def add_position(builder: StoryBuilder, name: str, position: osc.Position) -> ox.NamedNode:
    """Add the individual of a position.

    Args:
        builder: where to.
        name: of the individual.
        position: on a lane of the map, or a point of the world.

    Raises:
        NotExpressibleError: it is off the map, or given by an expression that is no distance.
    """
    where = position.position
    if isinstance(where, osc.LanePosition) and _is_off(builder, where):
        return _position(builder, name, position)
    return node_of(builder, name, POSITION, position, lambda: _position(builder, name, position))


def _is_off(builder: StoryBuilder, where: osc.LanePosition) -> bool:
    """Return whether a place on a lane is off the map, in whatever words."""
    try:
        road, lane_id = _lane_of(builder, where)
        lane_at(road, lane_id, builder.now(where.s, where))
    except (InputError, NotExpressibleError):
        return True
    return False


def _position(builder: StoryBuilder, name: str, position: osc.Position) -> ox.NamedNode:
    where = position.position
    if isinstance(where, osc.WorldPosition):
        return _world_position(builder, name, where)
    if not isinstance(where, osc.LanePosition):
        raise NotExpressibleError(where, type(where).__name__)
    road, lane_id = _lane_of(builder, where)
    now = builder.now(where.s, where)
    try:
        lane_at(road, lane_id, now)
    except InputError as error:
        raise NotExpressibleError(where, f"a LanePosition off the map: {error}") from None
    _check_orientation(where)
    node = builder.node(name, "LanePosition")
    lane = lane_name(road.id, section_index(road, now), lane_id)
    builder.put(node, "on_lane", builder.iri(lane))
    builder.number(node, "has_distance", _distance(builder, road, where, now), where)
    if where.offset is not None:
        offset = where.offset if lane_id < 0 else _mirrored(builder, where)
        builder.number(node, "has_lateral_offset", offset, where)
    turned = where.orientation
    if turned is not None and turned.h not in (None, 0.0):
        builder.number(node, "has_relative_heading", _in_degrees(builder, turned), turned)
    return node


def same_place(position: osc.Position, other: osc.Position) -> bool:
    """Return whether two positions are one place, whichever way one looks there."""
    a, b = position.position, other.position
    if isinstance(a, osc.LanePosition) and isinstance(b, osc.LanePosition):
        return (a.road_id, a.lane_id, a.s, a.offset) == (b.road_id, b.lane_id, b.s, b.offset)
    return a == b


def _lane_of(builder: StoryBuilder, where: osc.LanePosition) -> tuple[Road, int]:
    try:
        road = builder.roads.road(builder.text(where.road_id))
        return road, int(builder.text(where.lane_id))
    except InputError as error:
        raise NotExpressibleError(where, f"a LanePosition off the map: {error}") from None
    except ValueError:
        raise NotExpressibleError(where, f'laneId="{where.lane_id}" of LanePosition') from None


def _check_orientation(where: osc.LanePosition) -> None:
    turned = where.orientation
    if turned is None or turned.type is osc.ReferenceContext.RELATIVE:
        return
    if any(value is not None for value in (turned.h, turned.p, turned.r)):
        raise NotExpressibleError(turned, "an Orientation that is not relative to its lane")


def _in_degrees(builder: StoryBuilder, turned: osc.Orientation) -> Any:
    """Return how far a position is turned from its lane [deg], or the parameter that it is."""
    if isinstance(turned.h, osc.Expr) and (found := _TURNED.fullmatch(turned.h.text)):
        return osc.ParameterRef(f"${found['name']}")
    if isinstance(turned.h, osc.ParameterRef | osc.Expr) and not builder.in_substance:
        raise NotExpressibleError(
            turned, f'h="{turned.h}" of Orientation, which must read ${{($name)*{RADIANS}}}'
        )
    now = builder.now(turned.h, turned)
    return shortest(math.degrees(now), now, lambda angle: angle * float(RADIANS))


def _distance(builder: StoryBuilder, road: Road, where: osc.LanePosition, now: float) -> Any:
    """Return the distance from the leg's beginning [m], or the parameter that it is.

    Along the road it is ``s`` plus what lies before, against it all of that minus ``s``.
    """
    s, stretch = simplest(where.s), builder.legs.get(road.id) or Stretch(junction_end(road))
    against, before = stretch.near == "end", stretch.before
    if not against and before == 0.0:
        return s
    total = before + float(road.length)
    form, known = (_REST, total) if against else (_BEYOND, before)
    if isinstance(s, osc.Expr):
        found = form.fullmatch(s.text)
        if found and abs(float(found["length"]) - known) <= _LENGTH_SLACK:
            return osc.ParameterRef(f"${found['name']}")
    if isinstance(s, osc.ParameterRef | osc.Expr) and not builder.in_substance:
        wanted = f"${{{known!r}-($name)}}" if against else f"${{($name)-{known!r}}}"
        raise NotExpressibleError(where, f's="{s}" of LanePosition, which must read {wanted} there')

    def station(distance: float) -> float:
        if not before <= distance <= total:
            return math.nan
        return total - distance if against else distance - before

    return shortest(total - now if against else before + now, now, station)


def _mirrored(builder: StoryBuilder, where: osc.LanePosition) -> Any:
    """Return an offset left of the direction of travel, on a lane against the road's."""
    offset = where.offset
    if isinstance(offset, osc.Expr) and (found := _MIRRORED.fullmatch(offset.text)):
        return osc.ParameterRef(f"${found['name']}")
    if isinstance(offset, osc.ParameterRef | osc.Expr) and not builder.in_substance:
        raise NotExpressibleError(
            where, f'offset="{offset}" of LanePosition, which must read ${{-($name)}} on this lane'
        )
    return -builder.now(offset, where)


def _world_position(builder: StoryBuilder, name: str, where: osc.WorldPosition) -> ox.NamedNode:
    node = builder.node(name, "WorldPosition")
    builder.number(node, "has_world_x", where.x, where)
    builder.number(node, "has_world_y", where.y, where)
    if where.z is not None:
        builder.put(node, "has_world_z", builder.now(where.z, where))
    for field, angle in (("yaw", where.h), ("pitch", where.p), ("roll", where.r)):
        if angle is not None:
            now = builder.now(angle, where)
            degrees = shortest(math.degrees(now), now, math.radians)
            builder.put(node, f"has_world_{field}", degrees)
    return node
