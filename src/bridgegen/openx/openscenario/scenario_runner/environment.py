"""The weather as ScenarioRunner maps it to CARLA's.

ScenarioRunner makes of a Sun's intensity 1 − cloudiness, of a Precipitation's intensity the share
of CARLA's heaviest rain (with all puddles), of any visual range below 1000 m the densest fog, and
of the friction factor CARLA's tyre friction. It needs all parts of an environment at every change,
and a moment without a zone or fractions of a second. CARLA's own fields, which it has no place for,
go to our controller (`carla_fields`).

Source: ScenarioRunner 0.9.16, srunner/tools/openscenario_parser.py, get_weather_from_env_action.
"""

import math
from typing import Any

from bridgegen.base.errors import UnsupportedError
from bridgegen.openx.openscenario import cloudiness as cloud_classes
from bridgegen.openx.openscenario import model as osc
from bridgegen.scenario.weather import CARLA_FIELDS, CARLA_NAMES, rain_share

CLEAR = osc.Environment(
    "environment",
    osc.TimeOfDay(False, "2025-06-21T12:00:00"),
    osc.Weather(
        cloud_state=osc.CloudState.FREE,
        sun=osc.Sun(azimuth=math.pi, elevation=math.pi / 4, intensity=1.0),
        fog=osc.Fog(1e5),
        precipitation=osc.Precipitation(osc.PrecipitationType.DRY, intensity=0.0),
    ),
    osc.RoadCondition(1.0),
)
"""Environment of a clear noon, for what a scenario leaves open."""

_SECONDS = len("2025-06-21T12:00:00")
_FREE, _OVERCAST = 12.5, 87.5  # [%], an eighth, and all but one


def environment(new: osc.Environment, before: osc.Environment) -> osc.Environment:
    """Return an environment of version 1.0 with all its parts.

    Args:
        new: without references to parameters.
        before: as this made it, for what the new one leaves as it was.

    Raises:
        UnsupportedError: snow, which CARLA has not.
    """
    weather, was = new.weather or osc.Weather(), before.weather
    assert was is not None
    falls = _precipitation(weather.precipitation, new) or was.precipitation
    assert falls is not None
    cloudiness = _cloudiness(weather, new)
    raining = falls.precipitation_type is osc.PrecipitationType.RAIN
    moment = new.time_of_day or before.time_of_day
    assert moment is not None
    return osc.Environment(
        new.name,
        osc.TimeOfDay(False, str(moment.date_time)[:_SECONDS]),  # else it moves the sun
        osc.Weather(
            cloud_state=_cloud_state(cloudiness, raining) or was.cloud_state,
            sun=_sun(weather.sun, was.sun, cloudiness),
            fog=osc.Fog(weather.fog.visual_range) if weather.fog else was.fog,
            precipitation=falls,
        ),
        _road(new.road_condition) or before.road_condition,
    )


def carla_fields(environment: osc.Environment) -> dict[str, float]:
    """Return what an environment says of CARLA's own weather fields, by their names."""
    said = {
        CARLA_NAMES[name]: value
        for name, value in _originals(environment).items()
        if name in CARLA_NAMES
    }
    found = {name: said[name] for name in CARLA_FIELDS if name in said}
    if "sun_azimuth_angle" in found:
        found["sun_azimuth_angle"] %= 360.0
    return found


def _originals(environment: osc.Environment) -> dict[str, float]:
    road = environment.road_condition
    properties = road.properties.properties if road and road.properties else ()
    found = {}
    for property_ in properties:
        try:
            found[str(property_.name)] = float(str(property_.value))
        except ValueError:
            continue  # another tool's property
    return found


def _cloudiness(weather: osc.Weather, new: osc.Environment) -> float | None:
    """Return how much of the sky is covered [%]; None where nothing is said."""
    if (said := _originals(new).get("cloudiness")) is not None:
        return said
    cover: Any = weather.fractional_cloud_cover
    if cover is not None:
        return cloud_classes.of_cover(cover)
    state: Any = weather.cloud_state
    return cloud_classes.OF_STATE.get(state)


def _cloud_state(cloudiness: float | None, raining: bool) -> osc.CloudState | None:
    if raining:
        return osc.CloudState.RAINY
    if cloudiness is None:
        return None
    if cloudiness < _FREE:
        return osc.CloudState.FREE
    return osc.CloudState.CLOUDY if cloudiness < _OVERCAST else osc.CloudState.OVERCAST


def _sun(new: osc.Sun | None, was: osc.Sun | None, cloudiness: float | None) -> osc.Sun:
    assert was is not None
    clear: Any = was.intensity if cloudiness is None else 1.0 - cloudiness / 100.0
    place = new or was
    return osc.Sun(azimuth=place.azimuth, elevation=place.elevation, intensity=clear)


def _precipitation(
    new: osc.Precipitation | None, environment: osc.Environment
) -> osc.Precipitation | None:
    if new is None:
        return None
    kind: Any = new.precipitation_type
    if kind is osc.PrecipitationType.SNOW:
        raise UnsupportedError(f"CARLA has no snow (line {new.line})")
    share: Any = _originals(environment).get("precipitation")
    rate: Any = new.precipitation_intensity
    if share is not None:
        share /= 100.0
    elif rate is not None:  # [mm/h]
        share = min(max(rain_share(rate), 0.0), 1.0)
    else:
        share = new.intensity or 0.0
    if kind is osc.PrecipitationType.DRY or share <= 0.0:
        return osc.Precipitation(osc.PrecipitationType.DRY, intensity=0.0)
    return osc.Precipitation(kind, intensity=share)


def _road(new: osc.RoadCondition | None) -> osc.RoadCondition | None:
    return new and osc.RoadCondition(new.friction_scale_factor, None, new.properties)
