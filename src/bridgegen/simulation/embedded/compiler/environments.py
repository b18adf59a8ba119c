"""The weathers of a storyboard, at the start and in events, as rows of slots.

What they do to sensors and tyres: ``bridgegen.ego._weather_kernels``.
"""

import math
import re

from bridgegen.arrays import Int
from bridgegen.ego._weather_columns import (
    CLOUD,
    FRICTION_SCALE,
    ILLUMINANCE,
    RAIN,
    SNOW,
    STATED,
    SUN_AZIMUTH,
    SUN_ELEVATION,
    VISUAL_RANGE,
)
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.simulation.embedded.compiler.tables import Tables, table
from bridgegen.simulation.embedded.program import UNSAID
from bridgegen.weather import rain_formula

_CLOUDINESS = (
    "cloudiness"  # property of our files' road condition: percent, where classes are coarse
)
_CLOUDS = {
    osc.CloudState.FREE: 0.0, osc.CloudState.CLOUDY: 0.5,
    osc.CloudState.OVERCAST: 1.0, osc.CloudState.RAINY: 1.0,
}  # fmt: skip
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
        """``(V, STATED)``, see ``bridgegen.ego._weather_columns``."""
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
        if sky.fog is not None:
            if sky.fog.bounding_box is not None:
                self._tables.unsupported(sky.fog.bounding_box, "the BoundingBox of a Fog")
            row[VISUAL_RANGE] = self._tables.slot(sky.fog.visual_range)
        if sky.precipitation is not None:
            self._fall(row, sky.precipitation)
        if sky.sun is not None:
            row[SUN_AZIMUTH] = self._tables.slot(sky.sun.azimuth)
            row[SUN_ELEVATION] = self._tables.slot(sky.sun.elevation)
            # ``intensity`` is lux in 1.0 and W/m² later, and a share in many files: not used.
            stated = sky.sun.illuminance
            row[ILLUMINANCE] = self._tables.slot(-1.0 if stated is None else stated)
        elif environment.time_of_day is not None:
            self._time(row, environment.time_of_day)
        cover = self._cover(sky, environment.road_condition)
        if cover is not None:
            row[CLOUD] = self._tables.slot(cover)
        if environment.road_condition is not None:
            scale = environment.road_condition.friction_scale_factor
            row[FRICTION_SCALE] = self._tables.slot(scale)

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

    def _cover(self, sky: osc.Weather, road: osc.RoadCondition | None) -> Value | None:
        """Return the share of the sky that clouds cover; None where nothing is said."""
        percent = road.properties.get(_CLOUDINESS) if road and road.properties else None
        if isinstance(percent, osc.ParameterRef) and percent.name in self._tables.parameters:
            return Expr(f"${{{percent.text}/100}}")
        if isinstance(percent, str):
            try:
                return min(max(float(percent) / 100.0, 0.0), 1.0)
            except ValueError:
                pass  # somebody else's property of that name
        if sky.fractional_cloud_cover is not None:
            cover = self._tables.choice(osc.FractionalCloudCover, sky.fractional_cloud_cover)
            return min(list(osc.FractionalCloudCover).index(cover), 8) / 8
        if sky.cloud_state is not None:
            return _CLOUDS.get(self._tables.choice(osc.CloudState, sky.cloud_state))
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
