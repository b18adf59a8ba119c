"""OpenSCENARIO2OWL, its weather: from the standard's units to CARLA's percentages and degrees.

Our files keep the originals as properties of the road condition; where these are, they count. From
other people's files the laws of `bridgegen.scenario.weather` are solved for the percentage; what
lies beyond its 0 to 100 the comparison of the whole finds.
"""

import math
from collections.abc import Mapping
from typing import Any

import pyoxigraph as ox

from bridgegen.openx.openscenario import cloudiness
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.to_owl.build import NotExpressibleError, StoryBuilder, shortest
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.weather import PARAMETERS, PARTS, PHYSICAL, Parameter

CLASSES = {part.link: part.owl_class for part in PARTS}
"""The class of each part of the weather."""

_STATED = {
    element: [
        parameter
        for parameter in PARAMETERS.values()
        if parameter.stands_for and PHYSICAL[parameter.stands_for].element == element
    ]
    for element in dict.fromkeys(physical.element for physical in PHYSICAL.values())
    if element not in ("", "road_condition")
}
"""Parameters that stand for attributes of an element of the standard's Weather, by element."""

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
        NotExpressibleError: an original that is no number.
    """
    own = _originals(builder, environment.road_condition)
    found: dict[str, dict[str, Any]] = {}
    for part, parameters in PARTS.items():
        said = {
            parameter.owl_property: own[parameter.name]
            for parameter in parameters
            if parameter.name in own
        }
        if said:
            found[part.link] = said
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
        individual = builder.node(f"{prefix}weather_{CLASSES[link].lower()}", CLASSES[link])
        builder.put(node, link, individual)
        for name, value in values.items():
            builder.number(individual, name, value, environment)
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
    found: dict[str, Any] = {}
    for property_ in road.properties.properties:
        name = builder.text(property_.name)
        if name not in PARAMETERS:
            continue
        if (
            isinstance(property_.value, osc.ParameterRef)
            and property_.value.name in builder.numbers
        ):
            found[name] = property_.value
            continue
        try:
            found[name] = builder.now(float(builder.text(property_.value)), property_)
        except ValueError:
            raise NotExpressibleError(
                property_, f"the Property {name}, which must be a number,"
            ) from None
    return found


def _solved(builder: StoryBuilder, environment: osc.Environment) -> dict[str, dict[str, Any]]:
    """Return the parts of the weather that the standard's own elements say."""
    found: dict[str, dict[str, Any]] = {}
    now, weather = builder.now, environment.weather or osc.Weather()
    if weather.fractional_cloud_cover is not None:
        cover = builder.choice(osc.FractionalCloudCover, weather.fractional_cloud_cover)
        found["has_cloud"] = {"has_cloudiness": cloudiness.of_cover(cover)}
    elif weather.cloud_state is not None:
        state = builder.choice(osc.CloudState, weather.cloud_state)
        if state in cloudiness.OF_STATE:
            found["has_cloud"] = {"has_cloudiness": cloudiness.OF_STATE[state]}
    for name, parameters in _STATED.items():
        element = getattr(weather, name)
        if name == "precipitation":
            found |= _falling(builder, element)
        elif element is not None:
            for parameter in parameters:
                value = now(getattr(element, PHYSICAL[parameter.stands_for].attribute), element)
                found.setdefault(parameter.part.link, {})[parameter.owl_property] = _inverse(
                    parameter, value
                )
    road = environment.road_condition
    if road is not None and (road.wetness is not None or road.friction_scale_factor != 1.0):
        state_of_road: dict[str, Any] = {"has_friction": road.friction_scale_factor}
        if road.wetness is not None:
            wetness = builder.choice(osc.Wetness, road.wetness)
            state_of_road["has_wetness"] = _WETNESS[wetness]
        found["has_road_state"] = state_of_road
    return found


def _falling(
    builder: StoryBuilder, precipitation: osc.Precipitation | None
) -> dict[str, dict[str, Any]]:
    if precipitation is None or (
        precipitation.precipitation_intensity is None and precipitation.intensity is None
    ):
        return {}
    kind = builder.choice(osc.PrecipitationType, precipitation.precipitation_type)
    if (
        precipitation.precipitation_intensity is None
    ):  # 1.0's share of the most: as a percentage is to us
        percent = min(100.0 * builder.now(precipitation.intensity, precipitation), _MOST)
        formula = PARAMETERS["precipitation"].law.formula
        falls = osc.Precipitation(kind, float(parse(formula).evaluate({"x": percent})))
        return _falling(builder, falls)
    if kind is osc.PrecipitationType.SNOW:
        return {"has_snow": {"has_snowfall": precipitation.precipitation_intensity}}
    rate = builder.now(precipitation.precipitation_intensity, precipitation)
    if kind is osc.PrecipitationType.DRY or rate <= 0.0:
        return {"has_rain": {"has_precipitation": 0.0}} if kind is not kind.DRY else {}
    return {"has_rain": {"has_precipitation": _inverse(PARAMETERS["precipitation"], rate)}}


def _inverse(parameter: Parameter, value: float) -> float:
    """Return the parameter that stands for a physical quantity, within what it can say."""
    found = parameter.law.inverse(value)
    if parameter.unit == "deg":
        return shortest(found, value, math.radians)
    return min(max(found, 0.0), _MOST)
