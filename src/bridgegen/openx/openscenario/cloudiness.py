"""How much of the sky clouds cover [%], of the standard's classes."""

from collections.abc import Mapping

from bridgegen.openx.openscenario import model as osc

OF_STATE: Mapping[osc.CloudState, float] = {
    osc.CloudState.FREE: 0.0,
    osc.CloudState.CLOUDY: 50.0,
    osc.CloudState.OVERCAST: 100.0,
    osc.CloudState.RAINY: 100.0,
}
"""Cloudiness [%] by the cloud state of 1.0 and 1.1; unknown for states that are not listed."""


def of_cover(cover: osc.FractionalCloudCover) -> float:
    """Return the percentage of a number of eighths; of the ninth, sky obscured, all of it."""
    return 12.5 * min(list(osc.FractionalCloudCover).index(cover), 8)
