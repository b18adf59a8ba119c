"""OpenSCENARIO2OWL, its weather: from the standard's units to CARLA's percentages and degrees.

Our files keep the originals as properties of the road condition; where these are, they count. From
other people's files the laws of `bridgegen.weather` are solved for the percentage; what lies beyond
its 0 to 100 the comparison of the whole finds.
"""

import math
from collections.abc import Mapping
from typing import Any

import pyoxigraph as ox

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.weather import PROPERTIES
from bridgegen.openx.openscenario.to_owl.build import StoryBuilder, UnsayableError, shortest
from bridgegen.weather import RAIN, VISIBILITY, WIND

CLASSES = {
    "has_rain": "Rain",
    "has_cloud": "Cloud",
    "has_wind": "Wind",
    "has_fog": "Fog",
    "hasSun": "Sun",
    "has_road_state": "RoadState",
    "has_snow": "Snow",
}
"""The class of each part of the weather."""

_CLOUDS = {
    osc.CloudState.FREE: 0.0,
    osc.CloudState.CLOUDY: 50.0,
    osc.CloudState.OVERCAST: 100.0,
    osc.CloudState.RAINY: 100.0,
}
_WETNESS = {
    osc.Wetness.DRY: 0.0,
    osc.Wetness.MOIST: 20.0,
    osc.Wetness.WET_WITH_PUDDLES: 60.0,
    osc.Wetness.LOW_FLOODED: 100.0,
    osc.Wetness.HIGH_FLOODED: 100.0,
}
_MOST = 100.0  # [%]


def add_weather(
    builder: StoryBuilder, environment: osc.Environment, event: str = ""
) -> ox.NamedNode | None:
    """Add the weather of an environment; None where it says nothing of it.

    Args:
        builder: where to.
        environment: the standard's.
        event: that brings it; empty for the scenario's own.

    Raises:
        UnsayableError: an original that is no number.
    """
    own = _originals(builder, environment.road_condition)
    found: dict[str, dict[str, Any]] = {}
    for link, names in PROPERTIES:
        said = {name: own[key] for name in names if (key := name.removeprefix("has_")) in own}
        if said:
            found[link] = said
    for link, values in _solved(builder, environment).items():
        known = {"has_rain", "has_snow"} if link in ("has_rain", "has_snow") else {link}
        if not known & found.keys():
            found[link] = values
    if not found:
        return None
    prefix = _prefix(found) if event else ""
    prefix = f"{event}_" if prefix is None else prefix
    node = builder.node(f"{prefix}weather", "Weather")
    for link, values in found.items():
        part = builder.node(f"{prefix}weather_{CLASSES[link].lower()}", CLASSES[link])
        builder.put(node, link, part)
        for name, value in values.items():
            builder.number(part, name, value, environment)
    return node


def _prefix(found: Mapping[str, Mapping[str, Any]]) -> str | None:
    """Return what the names of all parameters begin with before the property's; None if nothing."""
    prefixes = {
        str(value.name).removesuffix(name.removeprefix("has_"))
        for values in found.values()
        for name, value in values.items()
        if isinstance(value, osc.ParameterRef) and value.name.endswith(name.removeprefix("has_"))
    }
    return prefixes.pop() if len(prefixes) == 1 else None


def _originals(builder: StoryBuilder, road: osc.RoadCondition | None) -> dict[str, Any]:
    if road is None or road.properties is None:
        return {}
    known = {name.removeprefix("has_") for _, names in PROPERTIES for name in names}
    found: dict[str, Any] = {}
    for one in road.properties.properties:
        name = builder.text(one.name)
        if name not in known:
            continue
        if isinstance(one.value, osc.ParameterRef) and one.value.name in builder.numbers:
            found[name] = one.value
            continue
        try:
            found[name] = builder.now(float(builder.text(one.value)), one)
        except ValueError:
            raise UnsayableError(one, f"the Property {name}, which must be a number,") from None
    return found


def _solved(builder: StoryBuilder, environment: osc.Environment) -> dict[str, dict[str, Any]]:
    """Return the parts of the weather that the standard's own elements say."""
    found: dict[str, dict[str, Any]] = {}
    now, weather = builder.now, environment.weather or osc.Weather()
    if weather.fractional_cloud_cover is not None:
        cover = builder.choice(osc.FractionalCloudCover, weather.fractional_cloud_cover)
        eighths = min(list(osc.FractionalCloudCover).index(cover), 8)
        found["has_cloud"] = {"has_cloudiness": eighths * 12.5}
    elif weather.cloud_state is not None:
        state = builder.choice(osc.CloudState, weather.cloud_state)
        if state in _CLOUDS:
            found["has_cloud"] = {"has_cloudiness": _CLOUDS[state]}
    if weather.fog is not None:
        sight = now(weather.fog.visual_range, weather.fog)
        found["has_fog"] = {"has_fog_density": _percent(VISIBILITY.share(sight))}
    found |= _falling(builder, weather.precipitation)
    if weather.wind is not None:
        speed = now(weather.wind.speed, weather.wind)
        found["has_wind"] = {"has_wind_intensity": _percent(WIND.share(speed))}
    if weather.sun is not None:
        angles = (
            ("altitude", weather.sun.elevation),
            ("azimuth", weather.sun.azimuth),
        )
        found["hasSun"] = {
            f"has_sun_{name}_angle": _degrees(now(angle, weather.sun)) for name, angle in angles
        }
    road = environment.road_condition
    if road is not None and (road.wetness is not None or road.friction_scale_factor != 1.0):
        state_of_road: dict[str, Any] = {"has_friction": road.friction_scale_factor}
        if road.wetness is not None:
            wetness = builder.choice(osc.Wetness, road.wetness)
            state_of_road["has_wetness"] = _WETNESS[wetness]
        found["has_road_state"] = state_of_road
    return found


def _falling(builder: StoryBuilder, one: osc.Precipitation | None) -> dict[str, dict[str, Any]]:
    if one is None or one.precipitation_intensity is None:
        return {}
    kind = builder.choice(osc.PrecipitationType, one.precipitation_type)
    if kind is osc.PrecipitationType.SNOW:
        return {"has_snow": {"has_snowfall": one.precipitation_intensity}}
    rate = builder.now(one.precipitation_intensity, one)
    if kind is osc.PrecipitationType.DRY or rate <= 0.0:
        return {"has_rain": {"has_precipitation": 0.0}} if kind is not kind.DRY else {}
    return {"has_rain": {"has_precipitation": _percent(RAIN.share(rate))}}


def _percent(share: float) -> float:
    return min(max(share, 0.0), 1.0) * _MOST


def _degrees(angle: float) -> float:
    return shortest(math.degrees(angle), angle, math.radians)
