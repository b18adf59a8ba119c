"""What the percentages of the weather stand for: CARLA's 0 to 100 % as physical quantities.

CARLA publishes no units. The laws are ours; OpenSCENARIO's files, the ontology and CARLA are
converted by them, in both directions.
"""

import math
from collections.abc import Callable
from dataclasses import dataclass

DRIZZLE, CLOUDBURST = 0.1, 500.0
"""[mm/h] Rain just above 0 %; and how many times more it is at 100 %: 50 mm/h."""

CLEAR_AIR, THICK_FOG = 1e4, 200.0
"""[m] Visual range at 0 % of fog; and how many times less it is at 100 %: 50 m."""

GALE = 20.0
"""[m/s] Wind at 100 %: Beaufort 8."""


@dataclass(frozen=True)
class Law:
    """A physical quantity of a percentage, and back.

    Attributes:
        formula: of the quantity, in ``x`` [%]. OpenSCENARIO 1.2 knows ``+ - * /``, ``round floor
            ceil sqrt pow`` and nothing more: no sine, no maximum, no comparison.
        share: of the quantity, the share of 100 %; beyond 0 to 1 where no percentage gives it.
    """

    formula: str
    share: Callable[[float], float]


def rain_formula(share: str) -> str:
    """Return the formula of the intensity [mm/h] of rain, of a formula of its share, 0 to 1."""
    return f"{DRIZZLE:g}*pow({CLOUDBURST:g},{share})*ceil({share})"


def _rain_share(rate: float) -> float:
    return math.log(rate / DRIZZLE, CLOUDBURST) if rate > 0.0 else 0.0


def _fog_share(visual_range: float) -> float:
    return math.log(CLEAR_AIR / max(visual_range, 1.0), THICK_FOG)


RAIN = Law(rain_formula("x/100"), _rain_share)
"""Intensity [mm/h] of precipitation: 0.1·500^(p/100), from drizzle to a cloudburst; none at 0.
Log-linear, as rain rates are distributed."""

VISIBILITY = Law(f"{CLEAR_AIR:g}/pow({THICK_FOG:g},x/100)", _fog_share)
"""Meteorological optical range [m] of fog density: 10⁴·200^(−f/100), from clear air to thick fog,
in the steps of WMO's visibility code."""

WIND = Law(f"{GALE / 100.0:g}*x", lambda speed: speed / GALE)
"""Speed [m/s] of wind intensity."""
