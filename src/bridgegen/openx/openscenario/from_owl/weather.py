"""OWL2OpenSCENARIO, its weather: from CARLA's percentages and degrees to the standard's units.

The ontology keeps the paper's weather parameters (percent and degrees, as CARLA has them); the
standard wants physical quantities. A bound parameter is converted by an expression in the file, so
it stays searchable; `bridgegen.weather.Law` says what expressions know. What has no expression
(classes, a time of day) is declared as a parameter of text, made from the present values.

The originals are kept too, as properties of the road condition, for readers that know them.
"""

import math

from bridgegen.errors import OntologyError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.quantities import Quantities, Quantity
from bridgegen.openx.openscenario.values import format_double
from bridgegen.weather import RAIN, VISIBILITY, WIND

ELEVATION = "x*0.017453292519943295"
"""Elevation [rad] of the sun's altitude angle [deg]."""

AZIMUTH = "(x/360-floor(x/360))*6.283185307179586"
"""Azimuth [rad], 0 to 2π, of an angle [deg]."""

ILLUMINANCE = "ceil(x/91)*400000*x*(180-x)/(40500-x*(180-x))"
"""Illuminance on the ground [lx] of the sun's altitude angle [deg], without clouds: 100,000 lx (the
standard's figure of direct sunlight) times the sine of the altitude, none below the horizon.
The sine is Bhaskara I's, exact to 0.0017."""

PROPERTIES = (
    ("has_rain", ("has_precipitation", "has_precipitation_deposits")),
    ("has_cloud", ("has_cloudiness",)),
    ("has_wind", ("has_wind_intensity",)),
    ("has_fog", ("has_fog_density", "has_fog_distance", "has_fog_falloff")),
    ("hasSun", ("has_sun_altitude_angle", "has_sun_azimuth_angle")),
    ("has_road_state", ("has_wetness", "has_friction")),
    ("has_snow", ("has_snowfall",)),
)
"""The data properties of each part of the weather; a property's name loses its ``has_``."""

_OPTIONAL = frozenset(
    {"has_precipitation_deposits", "has_fog_distance", "has_fog_falloff", "has_wetness"}
)
"""What the standard's own elements do not say, so that a file of others may leave it open."""

CLOUD_COVER = "fractional_cloud_cover"
ROAD_WETNESS = "road_wetness"
TIME_OF_DAY = "time_of_day"
_WET = 40.0  # [%], where the paper's friction formula turns from moist to wet


def environment(
    individuals: Individuals, weather: Subject, quantities: Quantities, name: str = ""
) -> tuple[osc.Environment, list[osc.ParameterDeclaration]]:
    """Return the environment of a weather individual, and the text parameters that it refers to.

    Args:
        individuals: one scenario.
        weather: a Weather.
        quantities: the scenario's numbers.
        name: of the event that brings it; empty for the scenario's own.

    Raises:
        OntologyError: a part of the weather lacks a property, or it rains and snows at once.
    """
    found: dict[str, Quantity] = {}
    for link, names in PROPERTIES:
        part = individuals.optional_link(weather, link)
        if part is not None:
            said = [
                one
                for one in names
                if one not in _OPTIONAL or individuals.optional_number(part, one) is not None
            ]
            found |= {one.removeprefix("has_"): quantities.get(part, one) for one in said}
    if "precipitation" in found and "snowfall" in found:
        raise OntologyError(
            f"{individuals.describe(weather)} must have has_rain or has_snow, not both"
        )
    texts: list[osc.ParameterDeclaration] = []

    def declare(text: str, value: str) -> osc.ParameterRef:
        own = f"{name}_{text}" if name else text
        texts.append(osc.ParameterDeclaration(own, osc.ParameterType.STRING, value))
        return osc.ParameterRef(f"${own}")

    def now(part: str) -> float:
        return quantities.value(found[part])

    cover = wetness = time = None
    if "cloudiness" in found:
        cover = declare(CLOUD_COVER, cloud_cover(now("cloudiness")))
    if "wetness" in found:
        wetness = declare(ROAD_WETNESS, road_wetness(now("wetness")))
    if "sun_altitude_angle" in found:
        # A string, not a dateTime: esmini supports no parameters of that type.
        time = declare(TIME_OF_DAY, time_of_day(now("sun_altitude_angle")))
    result = osc.Environment(
        name=f"{name}_environment" if name else "environment",
        time_of_day=None if time is None else osc.TimeOfDay(animation=False, date_time=time),
        weather=_weather(found, cover, quantities),
        road_condition=osc.RoadCondition(
            friction_scale_factor=found.get("friction", 1.0),
            wetness=wetness,
            properties=osc.Properties(
                tuple(osc.Property(part, _text(value)) for part, value in found.items())
            ),
        ),
    )
    return result, texts


def _weather(
    found: dict[str, Quantity], cover: osc.ParameterRef | None, quantities: Quantities
) -> osc.Weather:
    apply = quantities.apply
    sun = fog = rain = wind = None
    if "sun_altitude_angle" in found:
        altitude = found["sun_altitude_angle"]
        sun = osc.Sun(
            azimuth=apply(AZIMUTH, found["sun_azimuth_angle"]),
            elevation=apply(ELEVATION, altitude),
            illuminance=apply(ILLUMINANCE, altitude),
        )
    if "fog_density" in found:
        fog = osc.Fog(apply(VISIBILITY.formula, found["fog_density"]))
    if "precipitation" in found:
        rain = osc.Precipitation(
            osc.PrecipitationType.RAIN, apply(RAIN.formula, found["precipitation"])
        )
    if "snowfall" in found:
        rain = osc.Precipitation(osc.PrecipitationType.SNOW, found["snowfall"])
    if "wind_intensity" in found:
        wind = osc.Wind(direction=0.0, speed=apply(WIND.formula, found["wind_intensity"]))
    return osc.Weather(cover, sun=sun, fog=fog, precipitation=rain, wind=wind)


def cloud_cover(percent: float) -> osc.FractionalCloudCover:
    """Return the eighths of sky that clouds cover; 0 and 8 mean none and all of it.

    Source: WMO code table 2700.
    """
    eighths = math.floor(percent * 8 / 100 + 0.5)
    if percent <= 0.0:
        eighths = 0
    elif percent >= 100.0:
        eighths = 8
    else:
        eighths = min(max(eighths, 1), 7)
    return list(osc.FractionalCloudCover)[eighths]


def road_wetness(percent: float) -> osc.Wetness:
    """Return the class of a road's wetness [%]: wet from where friction stops falling (40 %)."""
    if percent <= 0.0:
        return osc.Wetness.DRY
    return osc.Wetness.MOIST if percent < _WET else osc.Wetness.WET_WITH_PUDDLES


def time_of_day(altitude_deg: float) -> str:
    """Return when, before noon, the sun stands at an altitude.

    The day is the one behind the paper's azimuth formula (CARLA's ``dynamic_weather.py``):
    altitude = −20 + 70·sin(t), from −90° at midnight to 50° at noon. Its date means nothing.
    """
    phase = math.asin(min(max((altitude_deg + 20.0) / 70.0, -1.0), 1.0))
    seconds = round((phase / math.pi + 0.5) * 12 * 3600)
    return f"2025-03-20T{seconds // 3600:02}:{seconds // 60 % 60:02}:{seconds % 60:02}"


def _text(quantity: Quantity) -> str | osc.ParameterRef:
    return quantity if isinstance(quantity, osc.ParameterRef) else format_double(quantity)
