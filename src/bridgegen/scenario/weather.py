"""The weather in one table: parameters, the physical quantities they stand for, CARLA's fields.

From it derive what every scenario must declare, the individuals of the ontology, both converters of
OpenSCENARIO, the columns of the simulator's weather, CARLA's weather and the words of the report.
What a quantity does to sensors and tyres is a law of its own, in ``ego._weather_kernels``.

A new quantity needs besides its entries here: its part and property in ``bridgegen.owl``; its
parameter in ``catalogue/weather.yaml``; if it is simulated, the name of its column in
``ego._weather_columns`` and its effect. Kernels read their columns from this module:
``compilation.sources`` counts it as a source of theirs.

CARLA publishes no units for its percentages. The laws that make physical quantities of them are
ours.
"""

import math
from collections.abc import Callable, Mapping
from dataclasses import dataclass
from types import MappingProxyType
from typing import Literal

from bridgegen.base import elementary
from bridgegen.base.errors import InputError, UnknownNameError

# -- laws ------------------------------------------------------------------------------------------

DRIZZLE, CLOUDBURST = 0.1, 500.0
"""Rain just above 0 % [mm/h], and the factor by which it is heavier at 100 %, where it is 50
mm/h."""

CLEAR_AIR, THICK_FOG = 1e4, 200.0
"""Visual range at 0 % of fog [m], and the factor by which it is shorter at 100 %, where it is 50
m."""

GALE = 20.0
"""Wind speed at 100 % [m/s]: Beaufort 8."""


@dataclass(frozen=True)
class Law:
    """The physical quantity that a parameter stands for, and back.

    Attributes:
        formula: of the physical quantity, in ``x``, the parameter. OpenSCENARIO 1.2 knows
            ``+ - * /``, ``round floor ceil sqrt pow`` and nothing more: no sine, no maximum, no
            comparison.
        inverse: the parameter of the physical quantity; beyond its range where the parameter cannot
            say it.
    """

    formula: str
    inverse: Callable[[float], float]


def rain_formula(share: str) -> str:
    """Return the formula of the intensity [mm/h] of rain, of a formula of its share, 0 to 1."""
    return f"{DRIZZLE:g}*pow({CLOUDBURST:g},{share})*ceil({share})"


def rain_share(rate: float) -> float:
    """Return the share, 0 to 1 and beyond, of an intensity [mm/h] of rain."""
    return elementary.log(rate / DRIZZLE) / elementary.log(CLOUDBURST) if rate > 0.0 else 0.0


def _fog_density(visual_range: float) -> float:
    return 100.0 * elementary.log(CLEAR_AIR / max(visual_range, 1.0)) / elementary.log(THICK_FOG)


RAIN = Law(rain_formula("x/100"), lambda rate: 100.0 * rain_share(rate))
"""Law of the rain's intensity [mm/h] by precipitation [%]: 0.1·500^(p/100), from drizzle to a
cloudburst; none at 0. Log-linear, as rain rates are distributed."""

VISIBILITY = Law(f"{CLEAR_AIR:g}/pow({THICK_FOG:g},x/100)", _fog_density)
"""Law of the meteorological optical range [m] by fog density [%]: 10⁴·200^(−f/100), from clear air
to thick fog, in the steps of WMO's visibility code."""

WIND = Law(f"{GALE / 100.0:g}*x", lambda speed: 100.0 * (speed / GALE))
"""Law of the wind's speed [m/s] by its intensity [%]."""

SHARE = Law("x/100", lambda share: 100.0 * share)
"""Law of a share, 0 to 1, by a percentage."""

ELEVATION = Law(f"x*{math.radians(1.0)!r}", math.degrees)
"""Law of the sun's elevation [rad] by its altitude angle [deg]."""

AZIMUTH = Law(f"(x/360-floor(x/360))*{math.tau!r}", math.degrees)
"""Law of the azimuth [rad], 0 to 2π, by an angle [deg]."""

SAME = Law("x", lambda value: value)
"""Law of a parameter that is the physical quantity itself."""

ILLUMINANCE = "ceil(x/91)*400000*x*(180-x)/(40500-x*(180-x))"
"""Formula of the illuminance on the ground [lx], in the sun's altitude angle [deg], without clouds:
100,000 lx (OpenSCENARIO's figure of direct sunlight) times the sine of the altitude, none below the
horizon. The sine is Bhaskara I's, exact to 0.0017."""

# -- physical quantities ---------------------------------------------------------------------------


@dataclass(frozen=True)
class Physical:
    """A physical quantity of the weather, which a storyboard states.

    Attributes:
        name: of its column, see `bridgegen.drivers._weather_columns`.
        unit: of its values.
        clear: its value where a file states nothing.
        element: of OpenSCENARIO's Weather, or its RoadCondition, as `bridgegen.openx.openscenario`
            names the field; empty: the standard has none, a property of the road condition states
            the parameter that stands for it.
        attribute: of the element.
        is_simulated: whether it has a column: something depends on it.
    """

    name: str
    unit: str
    clear: float
    element: Literal["", "fog", "precipitation", "wind", "sun", "road_condition"] = ""
    attribute: str = ""
    is_simulated: bool = True


_PHYSICAL = (
    # WMO's clear air
    Physical("visual_range", "m", CLEAR_AIR, "fog", "visual_range"),
    # of water; named as the types of OpenSCENARIO's Precipitation
    Physical("rain", "mm/h", 0.0, "precipitation", "precipitation_intensity"),
    Physical("snow", "mm/h", 0.0, "precipitation", "precipitation_intensity"),
    Physical("wind_speed", "m/s", 0.0, "wind", "speed", is_simulated=False),
    # clockwise from north (+y): in the south
    Physical("sun_azimuth", "rad", math.pi, "sun", "azimuth"),
    Physical("sun_elevation", "rad", math.radians(45.0), "sun", "elevation"),
    # of the sun on the ground without clouds; negative: as the sun stands
    Physical("illuminance", "lx", -1.0, "sun", "illuminance"),
    # share of the sky; OpenSCENARIO has classes only
    Physical("cloud", "1", 0.0),
    # factor on that of the dry road
    Physical("friction_scale", "1", 1.0, "road_condition", "friction_scale_factor"),
)

PHYSICAL: Mapping[str, Physical] = MappingProxyType(
    {physical.name: physical for physical in _PHYSICAL}
)
"""Physical quantities of the weather by name, in the order of the elements in which files are
read."""

COLUMNS = tuple(physical for physical in _PHYSICAL if physical.is_simulated)
"""Physical quantities of the simulated weather that a storyboard states, by column."""


def column(name: str) -> int:
    """Return the column of a physical quantity that is simulated."""
    return COLUMNS.index(PHYSICAL[name])


# -- parameters ------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Part:
    """A part of the weather: an individual of the ontology.

    Attributes:
        owl_class: its class.
        link: the property by which the weather has it.
    """

    owl_class: str
    link: str


@dataclass(frozen=True)
class Parameter:
    """A parameter of the weather; its data property in the ontology is ``has_`` and its name.

    Attributes:
        name: in scenario files and OpenSCENARIO's properties.
        unit: of its values.
        part: the part of the weather that has it.
        stands_for: the name of a physical quantity; empty for none.
        law: of that.
        also: other physical quantities that follow from it, with their formulas in ``x``.
        carla: CARLA's field; empty where CARLA has none.
        is_declared: whether scenario files declare it, each of them.
        is_required: whether a part always has it; else the standard's own elements do not say it,
            and files of others may leave it open.
    """

    name: str
    unit: str
    part: Part
    stands_for: str = ""
    law: Law = SAME
    also: tuple[tuple[str, str], ...] = ()
    carla: str = ""
    is_declared: bool = True
    is_required: bool = True

    @property
    def owl_property(self) -> str:
        """Its data property in the ontology."""
        return f"has_{self.name}"

    @property
    def formulas(self) -> tuple[tuple[str, str], ...]:
        """The physical quantities that follow from it, with their formulas in ``x``."""
        return ((self.stands_for, self.law.formula), *self.also) if self.stands_for else ()


_RAIN = Part("Rain", "has_rain")
_CLOUD = Part("Cloud", "has_cloud")
_WIND = Part("Wind", "has_wind")
_FOG = Part("Fog", "has_fog")
_SUN = Part("Sun", "hasSun")
_ROAD = Part("RoadState", "has_road_state")
_SNOW = Part("Snow", "has_snow")

_PARAMETERS = (
    Parameter("precipitation", "%", _RAIN, "rain", RAIN, carla="precipitation"),
    Parameter(
        "precipitation_deposits", "%", _RAIN, carla="precipitation_deposits", is_required=False
    ),
    Parameter("cloudiness", "%", _CLOUD, "cloud", SHARE, carla="cloudiness"),
    Parameter("wind_intensity", "%", _WIND, "wind_speed", WIND, carla="wind_intensity"),
    Parameter("fog_density", "%", _FOG, "visual_range", VISIBILITY, carla="fog_density"),
    Parameter("fog_distance", "m", _FOG, carla="fog_distance", is_required=False),
    Parameter("fog_falloff", "1", _FOG, carla="fog_falloff", is_required=False),
    Parameter(
        "sun_altitude_angle",
        "deg",
        _SUN,
        "sun_elevation",
        ELEVATION,
        also=(("illuminance", ILLUMINANCE),),
        carla="sun_altitude_angle",
    ),
    Parameter("sun_azimuth_angle", "deg", _SUN, "sun_azimuth", AZIMUTH, carla="sun_azimuth_angle"),
    Parameter("wetness", "%", _ROAD, carla="wetness", is_required=False),
    Parameter("friction", "1", _ROAD, "friction_scale"),
    Parameter("snowfall", "mm/h", _SNOW, "snow", is_declared=False),
)

PARAMETERS: Mapping[str, Parameter] = MappingProxyType(
    {parameter.name: parameter for parameter in _PARAMETERS}
)
"""Weather parameters by name; parameters of one part follow each other."""

PARTS: Mapping[Part, tuple[Parameter, ...]] = MappingProxyType(
    {
        part: tuple(parameter for parameter in _PARAMETERS if parameter.part == part)
        for part in dict.fromkeys(parameter.part for parameter in _PARAMETERS)
    }
)
"""The parts of the weather, with their parameters."""

STATED_BY: Mapping[str, Parameter] = MappingProxyType(
    {parameter.stands_for: parameter for parameter in _PARAMETERS if parameter.stands_for}
)
"""Weather parameters by the physical quantity that they stand for."""

# -- limits ----------------------------------------------------------------------------------------

ROAD_TYPES = ("town", "rural", "motorway")
"""Classes of roads, by the number that limits have of ``road_type``."""

OF_THE_ROAD = ("road_type", "lane_marking")
"""Quantities of the road that limits may name: its class, see `ROAD_TYPES`, and whether its lane
has markings, 1 or 0."""


@dataclass(frozen=True)
class Limit:
    """An interval of a physical quantity.

    Attributes:
        name: of a physical quantity that is simulated, or of those `OF_THE_ROAD`.
        low: its least value, in its unit.
        high: its greatest.
    """

    name: str
    low: float
    high: float

    def __str__(self) -> str:
        """Return it as a file states it; `read_limits` reads the same bits again."""
        return f"{self.low!r} <= {self.name} <= {self.high!r}"


Limits = tuple[tuple[Limit, ...], ...]
"""What a weather keeps: of each group one limit at least."""


def limits_text(limits: Limits) -> str:
    """Return limits as a file states them."""
    return "; ".join(" or ".join(map(str, group)) for group in limits)


def read_limits(text: str) -> Limits:
    """Return the limits that a file states.

    Raises:
        InputError: it is no list of limits, or names what is not simulated.
    """
    names = [*(column.name for column in COLUMNS), *OF_THE_ROAD]
    try:
        found = tuple(
            tuple(
                Limit(name.strip(), float(low), float(high))
                for low, name, high in (limit.split("<=") for limit in group.split(" or "))
            )
            for group in text.split(";")
        )
        # A comparison with NaN does not hold either.
        if not all(limit.low <= limit.high for group in found for limit in group):
            raise ValueError
    except ValueError:
        raise InputError(f"limits read '0.0 <= rain <= 5.0; …', got '{text[:80]}'") from None
    for limit in (limit for group in found for limit in group):
        if limit.name not in names:
            raise UnknownNameError("quantity of the weather or the road", limit.name, names)
    return found


# -- CARLA -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class CarlaField:
    """A field of ``carla.WeatherParameters``.

    Attributes:
        low: its least value.
        high: its greatest; CARLA's client passes on whatever it is given.
        preset: of CARLA's ClearNoon, where no physical quantity of the simulation tells it.
    """

    low: float
    high: float
    preset: float | None = None


CARLA_FIELDS: Mapping[str, CarlaField] = MappingProxyType(
    {
        "cloudiness": CarlaField(0.0, 100.0),
        "precipitation": CarlaField(0.0, 100.0),
        "precipitation_deposits": CarlaField(0.0, 100.0),
        "wind_intensity": CarlaField(0.0, 100.0, 10.0),
        "fog_density": CarlaField(0.0, 100.0),
        "fog_distance": CarlaField(0.0, math.inf),
        "fog_falloff": CarlaField(0.0, math.inf),
        "wetness": CarlaField(0.0, 100.0),
        "sun_azimuth_angle": CarlaField(0.0, 360.0),
        "sun_altitude_angle": CarlaField(-90.0, 90.0),
        "scattering_intensity": CarlaField(0.0, 100.0, 1.0),
        "mie_scattering_scale": CarlaField(0.0, 5.0, 0.03),
        "rayleigh_scattering_scale": CarlaField(0.0, 2.0, 0.0331),
        "dust_storm": CarlaField(0.0, 100.0, 0.0),
    }
)
"""Fields of CARLA's weather by name."""

CARLA_NAMES: Mapping[str, str] = MappingProxyType(
    {name: name for name in CARLA_FIELDS}
    | {parameter.name: parameter.carla for parameter in _PARAMETERS if parameter.carla}
)
"""CARLA's field by the name of a property of our files."""

# -- words -----------------------------------------------------------------------------------------


@dataclass(frozen=True)
class Phrase:
    """What is said of a physical quantity within limits.

    Attributes:
        text: with ``{}`` for the number, if there is one.
        above: it is said above this …
        below: … and below this, in the unit of the quantity.
        times: the number is so many times the quantity.
    """

    text: str
    above: float = -math.inf
    below: float = math.inf
    times: float = 1.0


PHRASES: Mapping[str, tuple[Phrase, ...]] = MappingProxyType(
    {
        "sun_elevation": (
            Phrase("night", below=math.radians(-6.0)),
            Phrase("dusk", below=0.0),
            Phrase("day"),
        ),
        "visual_range": (
            Phrase("fog, visibility {} m", below=1000.0),
            Phrase("haze, visibility {} km", below=5000.0, times=1e-3),
        ),
        "rain": (Phrase("rain {} mm/h", above=0.0),),
        "snow": (Phrase("snow {} mm/h", above=0.0),),
        "friction_scale": (Phrase("friction {} % of dry", below=0.95, times=100.0),),
    }
)
"""Phrases by physical quantity, in the order of a sentence; the first of each that holds is
used."""


def in_words(values: Mapping[str, float]) -> str:
    """Return a weather in words.

    Args:
        values: by physical quantity; those of `PHRASES` at least.
    """
    said = []
    for name, phrases in PHRASES.items():
        value = values[name]
        for phrase in phrases:
            if phrase.above < value < phrase.below:
                said.append(phrase.text.format(_rounded(value * phrase.times)))
                break
    return ", ".join(said)


def _rounded(value: float) -> str:
    """Return a number with two significant digits, and with all that stand before the point."""
    value = float(f"{value:.4g}")
    whole = max(1, math.floor(math.log10(abs(value))) + 1) if value else 1
    return f"{value:.{0 if value == round(value) else max(0, 2 - whole)}f}"
