"""Positions by latitude and longitude, on a map that says how it was projected."""

import math
from collections.abc import Callable
from dataclasses import replace

from bridgegen.base import elementary
from bridgegen.base.errors import FileFormatError
from bridgegen.base.extras import require
from bridgegen.openx.opendrive.model import Header, OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element, rewritten, walk
from bridgegen.openx.openscenario.values import Expr, ParameterRef, Value

Project = Callable[[float, float], tuple[float, float]]
"""Function that takes longitude and latitude [°] of WGS 84, and returns x and y on the map [m]."""


def on_plane(scenario: osc.OpenScenario, roads: OpenDrive, place: str) -> osc.OpenScenario:
    """Return a scenario whose positions by latitude and longitude are positions of the world.

    Args:
        scenario: any scenario; one without such positions comes back as it is.
        roads: its map.
        place: what to call the scenario in messages.

    Raises:
        InputError: the extra is missing.
        FileFormatError: the map states no projection, or a position is not a constant, or cannot be
            projected; by line.
    """
    if not any(isinstance(node, osc.GeoPosition) for node in walk(scenario)):
        return scenario
    project = projection(roads.header, place)
    is_new = scenario.file_header.rev_minor not in (0, 1, 2)
    problems: list[str] = []

    def change(element: Element) -> Element:
        if isinstance(element, osc.Position) and isinstance(element.position, osc.GeoPosition):
            try:
                where = _projected(element.position, project, roads.header, is_new=is_new)
            except FileFormatError as error:
                line = element.position.line
                problems.extend(f"{place}: {problem} (line {line})" for problem in error.problems)
            else:
                return replace(element, position=where)
        return element

    made = rewritten(scenario, change)
    if problems:
        raise FileFormatError(*problems)
    return made


def projection(header: Header, place: str) -> Project:
    """Return the projection of a map, from its ``geoReference`` and its ``offset``.

    The offset is added to the map's coordinates, which are then turned by its heading.
    Source: ASAM OpenDRIVE 1.8, georeferencing.

    Raises:
        InputError: the extra is missing.
        FileFormatError: the map states no projection, or none that is known.
    """
    if header.geo_reference is None:
        raise FileFormatError(
            f"{place}: a GeoPosition needs a map whose header has a geoReference, its projection"
        )
    require("geo", "a GeoPosition")
    from pyproj import CRS, Transformer
    from pyproj.exceptions import ProjError

    try:
        crs = CRS.from_user_input(header.geo_reference.strip())
        # `always_xy`: by its definition EPSG:4326 has latitude first, and tools that follow it swap
        # the axes.
        to_map = Transformer.from_crs("EPSG:4326", crs.to_2d(), always_xy=True)
    except ProjError as error:
        raise FileFormatError(
            f"{place}: the map's geoReference is no projection: {str(error)[:200]}"
        ) from None
    offset = header.offset
    dx, dy, turn = (offset.x, offset.y, offset.hdg) if offset else (0.0, 0.0, 0.0)
    c, s = elementary.cos(turn), elementary.sin(turn)

    def project(longitude: float, latitude: float) -> tuple[float, float]:
        east, north = to_map.transform(longitude, latitude)
        if not (math.isfinite(east) and math.isfinite(north)):
            raise FileFormatError(
                f"latitude {latitude:g}°, longitude {longitude:g}° cannot be projected on the map"
            )
        return c * east + s * north - dx, c * north - s * east - dy

    return project


def _projected(
    where: osc.GeoPosition, project: Project, header: Header, *, is_new: bool
) -> osc.WorldPosition:
    """Return a position of the world; ``is_new``: without a type, an orientation is relative."""
    latitude = _degrees("latitude", where.latitude_deg, where.latitude)
    longitude = _degrees("longitude", where.longitude_deg, where.longitude)
    x, y = project(longitude, latitude)
    height = where.height if where.altitude is None else where.altitude
    turn = header.offset.hdg if header.offset else 0.0
    said = where.orientation or osc.Orientation()
    unsaid = is_new and said.type is None and (said.h, said.p, said.r) != (None, None, None)
    if unsaid or said.type is osc.ReferenceContext.RELATIVE:
        raise FileFormatError("a relative Orientation of a GeoPosition is relative to nothing")
    h = said.h
    if turn and h is not None:
        h = _constant("h of a GeoPosition", h) - turn
    return osc.WorldPosition(x, y, height, h, said.p, said.r, line=where.line)


def _degrees(name: str, degrees: Value | None, radians: Value | None) -> float:
    """Return an angle [°] that is stated in degrees, or in radians as in 1.1."""
    if degrees is not None:
        return _constant(f"{name}Deg", degrees)
    if radians is None:
        raise FileFormatError(f"a GeoPosition needs {name}Deg")
    return math.degrees(_constant(name, radians))


def _constant(name: str, value: Value) -> float:
    if isinstance(value, ParameterRef | Expr):
        raise FileFormatError(f"{name} must be a number, got {value}: it is projected beforehand")
    return float(value)
