"""The weathers of a storyboard, at the start and in events, as rows of slots.

What they do to sensors and tyres: ``bridgegen.drivers._weather_kernels``.
"""

import math
import re
from typing import Any

from bridgegen.base.arrays import Int
from bridgegen.drivers._weather_columns import (
    CLOUD,
    ILLUMINANCE,
    RAIN,
    SNOW,
    STATED,
    SUN_AZIMUTH,
    SUN_ELEVATION,
)
from bridgegen.openx.openscenario import cloudiness
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.weather import COLUMNS, STATED_BY, Parameter, Physical, rain_formula
from bridgegen.simulation.embedded.compiler.tables import Tables, table
from bridgegen.simulation.embedded.program import UNSAID

_TIME = re.compile(r"T(\d\d):(\d\d):(\d\d)")


class Environments:
    """The weathers, each a row of slots, −1 for what it leaves as it was; row 0 is the start's.

    Args:
        tables: the compiler's; takes down what cannot be run.
    """

    def __init__(self, tables: Tables) -> None:
        self._tables = tables
        self._rows = [[UNSAID] * STATED]

    @property
    def rows(self) -> Int:
        """``(V, STATED)``, see ``bridgegen.drivers._weather_columns``."""
        return table([tuple(row) for row in self._rows], STATED)

    def begin_with(self, environment: osc.Environment) -> None:
        """Take an environment into the start's weather."""
        self._fill(self._rows[0], environment)

    def add(self, environment: osc.Environment) -> int:
        """Add the weather that an event brings; return its row."""
        self._rows.append([UNSAID] * STATED)
        self._fill(self._rows[-1], environment)
        return len(self._rows) - 1

    def _fill(self, row: list[int], environment: osc.Environment) -> None:
        sky = environment.weather or osc.Weather()
        if sky.fog is not None and sky.fog.bounding_box is not None:
            self._tables.unsupported(sky.fog.bounding_box, "the BoundingBox of a Fog")
        for index, column in enumerate(COLUMNS):
            if column.element == "precipitation":
                continue
            value = self._stated(column, environment)
            if value is None and index == CLOUD:
                value = self._cover(sky)
            if value is not None:
                row[index] = self._tables.slot(value)
        if sky.precipitation is not None:
            self._fall(row, sky.precipitation)
        if sky.sun is None and environment.time_of_day is not None:
            self._time(row, environment.time_of_day)

    def _stated(self, column: Physical, environment: osc.Environment) -> Value | None:
        """Return what an environment states of a physical quantity; None if it states nothing."""
        if not column.element:
            return self._of_property(STATED_BY[column.name], environment.road_condition)
        of_road = column.element == "road_condition"
        holder = environment if of_road else environment.weather
        element: Any = getattr(holder, column.element, None)
        if element is None:
            return None
        # ``intensity`` of a Sun is lux in 1.0 and W/m² later, and a share in many files: not used.
        value: Value | None = getattr(element, column.attribute)
        return column.clear if value is None else value

    def _of_property(self, one: Parameter, road: osc.RoadCondition | None) -> Value | None:
        """Return the quantity of a parameter that our files say as a property, in percent."""
        said = road.properties.get(one.name) if road and road.properties else None
        if isinstance(said, osc.ParameterRef) and said.name in self._tables.parameters:
            return Expr("${" + re.sub(r"\bx\b", said.text, one.law.formula) + "}")
        if isinstance(said, str):
            try:
                percent = min(max(float(said), 0.0), 100.0)
            except ValueError:
                return None  # another tool's property of that name
            return float(parse(one.law.formula).evaluate({"x": percent}))
        return None

    def _fall(self, row: list[int], falling: osc.Precipitation) -> None:
        rate: Value = 0.0
        if falling.precipitation_intensity is not None:
            rate = falling.precipitation_intensity
        elif falling.intensity is not None:  # 1.0's share of the most: as a percentage is to us
            share = f"({_bare(falling.intensity)})"
            rate = Expr(f"${{{rain_formula(share)}}}")
        kind = self._tables.choice(osc.PrecipitationType, falling.precipitation_type)
        none = self._tables.slot(0.0)
        row[RAIN] = row[SNOW] = none
        if kind is osc.PrecipitationType.RAIN:
            row[RAIN] = self._tables.slot(rate)
        elif kind is osc.PrecipitationType.SNOW:
            row[SNOW] = self._tables.slot(rate)

    def _time(self, row: list[int], time: osc.TimeOfDay) -> None:
        """Place the sun by the time of day, where a file says nothing else of it."""
        found = _TIME.search(self._tables.text(time.date_time))
        if found is None:
            return
        hours, minutes, seconds = (int(part) for part in found.groups())
        elevation, azimuth = sun_at(hours + minutes / 60 + seconds / 3600)
        row[SUN_ELEVATION] = self._tables.slot(elevation)
        row[SUN_AZIMUTH] = self._tables.slot(azimuth)
        row[ILLUMINANCE] = self._tables.slot(-1.0)

    def _cover(self, sky: osc.Weather) -> Value | None:
        """Return the share of the sky that clouds cover by classes; None where none is said."""
        if sky.fractional_cloud_cover is not None:
            cover = self._tables.choice(osc.FractionalCloudCover, sky.fractional_cloud_cover)
            return cloudiness.of_cover(cover) / 100.0
        if sky.cloud_state is not None:
            state = self._tables.choice(osc.CloudState, sky.cloud_state)
            if state in cloudiness.OF_STATE:
                return cloudiness.OF_STATE[state] / 100.0
        return None


def sun_at(hours: float) -> tuple[float, float]:
    """Return the sun's elevation and azimuth [rad] at a time of day [h].

    The day is that of `bridgegen.openx.openscenario.from_owl.weather.time_of_day`: −90° at
    midnight, 50° at noon. The sun goes round evenly, and stands in the south at noon.
    """
    phase = (hours / 12.0 - 0.5) * math.pi
    return math.radians(-20.0 + 70.0 * math.sin(phase)), hours / 24.0 * 2.0 * math.pi


def _bare(value: Value) -> str:
    """Return a value as a part of an expression."""
    if isinstance(value, Expr):
        return value.text[2:-1]
    return format(value, "f") if isinstance(value, float) else str(value)
