"""Exposure: how often a scenario is met on the road, and with which values of its parameters.

`reader` makes an `Exposure` of a file; `fit` makes one of recorded events. `exposure` is what
estimators of risk sample: rows, their density, and the transform to standard normal space.
"""

from bridgegen.scenario.exposure.exposure import Encounters, Exposure, FeasibleShare, Rate, Sample
from bridgegen.scenario.exposure.reader import example_names, exposure_of, read_exposure

__all__ = [
    "Encounters",
    "Exposure",
    "FeasibleShare",
    "Rate",
    "Sample",
    "example_names",
    "exposure_of",
    "read_exposure",
]
