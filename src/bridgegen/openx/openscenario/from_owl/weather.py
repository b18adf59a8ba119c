"""OWL2OpenSCENARIO, its weather: from CARLA's percentages and degrees to the standard's units.

The ontology keeps the paper's weather parameters (percent and degrees, as CARLA has them); the
standard wants physical quantities. A bound parameter is converted by an expression in the file, so
it stays searchable; `bridgegen.scenario.weather.Law` says what expressions know. What has no
expression (classes, a time of day) is declared as a parameter of text, made from the present
values.

The originals are kept too, as properties of the road condition, for readers that know them.
"""

import math
from collections.abc import Callable, Mapping
from functools import partial
from typing import Any

from bridgegen.base.errors import OntologyError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.quantities import Quantities, Quantity
from bridgegen.openx.openscenario.values import format_double
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject
from bridgegen.scenario.weather import PARAMETERS, PARTS, PHYSICAL, SAME

_ELEMENTS: Mapping[str, Callable[..., Any]] = {
    "sun": osc.Sun,
    "fog": osc.Fog,
    "precipitation": osc.Precipitation,
    "wind": partial(osc.Wind, direction=0.0),
}
"""Of the standard's Weather, made of their attributes; the ontology knows no direction of wind."""

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
    for part, parameters in PARTS.items():
        node = individuals.optional_link(weather, part.link)
        if node is not None:
            found |= {
                one.name: quantities.get(node, one.owl_property)
                for one in parameters
                if one.is_required
                or individuals.optional_number(node, one.owl_property) is not None
            }
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
    elements: dict[str, dict[str, Any]] = {}
    for name, quantity in found.items():
        for of, formula in PARAMETERS[name].formulas:
            physical = PHYSICAL[of]
            if physical.element not in _ELEMENTS:
                continue
            element = elements.setdefault(physical.element, {})
            value = quantity if formula == SAME.formula else quantities.apply(formula, quantity)
            element[physical.attribute] = value
            if physical.element == "precipitation":
                element["precipitation_type"] = osc.PrecipitationType(of)
    made = {name: _ELEMENTS[name](**attributes) for name, attributes in elements.items()}
    return osc.Weather(cover, **made)


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
