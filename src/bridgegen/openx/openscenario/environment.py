"""The weather, the light and the road's state."""

from dataclasses import dataclass, field
from math import pi
from typing import Annotated

from bridgegen.openx.openscenario.declarations import File, ParameterDeclarations, Properties
from bridgegen.openx.openscenario.element import Element, Range, Tag
from bridgegen.openx.openscenario.entities import BoundingBox
from bridgegen.openx.openscenario.enumerations import (
    CloudState,
    FractionalCloudCover,
    PrecipitationType,
    Wetness,
)
from bridgegen.openx.openscenario.values import Boolean, DateTime, Double, ParameterRef, String

_NOT_NEGATIVE = Range(0.0)
_TURN = Range(0.0, 2 * pi)


@dataclass(frozen=True)
class TimeOfDay(Element):
    """Date and time at the start, and whether it passes."""

    animation: Boolean
    date_time: DateTime


@dataclass(frozen=True)
class Sun(Element):
    """Where the sun stands [rad] and how bright it is [lx].

    Azimuth is clockwise from north, elevation from the horizon up. ``intensity`` [W/m²] is
    ``illuminance``'s predecessor.
    """

    azimuth: Annotated[Double, _TURN]
    elevation: Annotated[Double, Range(-pi, pi)]
    illuminance: Annotated[Double | None, _NOT_NEGATIVE] = None
    intensity: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class Fog(Element):
    """How far one sees [m], everywhere or in a box."""

    visual_range: Annotated[Double, _NOT_NEGATIVE]
    bounding_box: BoundingBox | None = None


@dataclass(frozen=True)
class Precipitation(Element):
    """What falls, and how much [mm/h]; ``intensity`` (0 to 1) is 1.0's."""

    precipitation_type: PrecipitationType | ParameterRef
    precipitation_intensity: Annotated[Double | None, _NOT_NEGATIVE] = None
    intensity: Annotated[Double | None, _NOT_NEGATIVE] = None


@dataclass(frozen=True)
class Wind(Element):
    """Where the wind blows [rad, as a heading] and how fast [m/s]."""

    direction: Annotated[Double, _TURN]
    speed: Annotated[Double, _NOT_NEGATIVE]


@dataclass(frozen=True)
class DomeImage(Element):
    """A picture of the sky, turned [rad]."""

    dome_file: Annotated[File, Tag("DomeFile")]
    azimuth_offset: Annotated[Double | None, _TURN] = None


@dataclass(frozen=True)
class Weather(Element):
    """Pressure in [Pa], temperature in [K]; ``cloud_state`` is up to 1.1."""

    fractional_cloud_cover: FractionalCloudCover | ParameterRef | None = None
    cloud_state: CloudState | ParameterRef | None = None
    atmospheric_pressure: Annotated[Double | None, _NOT_NEGATIVE] = None
    temperature: Annotated[Double | None, _NOT_NEGATIVE] = None
    sun: Sun | None = None
    fog: Fog | None = None
    precipitation: Precipitation | None = None
    wind: Wind | None = None
    dome_image: DomeImage | None = None


@dataclass(frozen=True)
class RoadCondition(Element):
    """What the weather does to the road; the factor is on dry friction."""

    friction_scale_factor: Annotated[Double, _NOT_NEGATIVE]
    wetness: Wetness | ParameterRef | None = None
    properties: Properties | None = None


@dataclass(frozen=True)
class Environment(Element):
    """Weather, light and road; what is missing stays as it was."""

    parameter_declarations: ParameterDeclarations | None = field(default=None, kw_only=True)
    name: String
    time_of_day: TimeOfDay | None = None
    weather: Weather | None = None
    road_condition: RoadCondition | None = None
