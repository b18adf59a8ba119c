"""The models of UN R157 as the regulation computes them, and RSS, instead of a simulation.

`bridgegen.drivers.preventable` steps them beside another vehicle whose body never turns and whose
lateral speed is constant. They stand beside the simulated drivers, under names of their own, in
the three disturbances of the regulation.
"""

import math
from collections.abc import Callable, Mapping

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import InputError
from bridgegen.drivers.preventable import KNOWN, avoids_cut_in, avoids_cut_out, avoids_deceleration
from bridgegen.jobs.preventability.classes import Codes, Outcome
from bridgegen.scenario.language.space import SearchSpace

PREFIX = "computed:"
NAMES = tuple(PREFIX + name for name in KNOWN)
"""Names of the computed models, which set them apart from drivers."""

SIDE = 0.375
"""Lateral offset from the middle of the lane beyond which the vehicle ahead cuts out [m] (UN R157,
annex 3)."""
LENGTH, LANE = 4.3, 3.5
"""Length of a car and width of a lane in the scenarios of the pack ``r157`` [m]."""


def outcomes(name: str, scenario: str, space: SearchSpace, X: Float) -> Codes:
    """Return whether a model avoids the collision in N rows.

    Args:
        name: one of `NAMES`.
        scenario: of the pack ``r157``, by its own name; see ``require``.
        space: names the columns of X.
        X: ``(N, len(space.names))``, feasible rows.

    Returns:
        ``(N,)``, `Outcome.AVOIDED` or `Outcome.COLLIDED`.
    """
    columns = {column: X[:, i] for i, column in enumerate(space.names)}
    avoids = _DISTURBANCES[scenario](columns, name.removeprefix(PREFIX))
    return np.where(avoids, Outcome.AVOIDED, Outcome.COLLIDED).astype(np.int8)


def require(scenario: str) -> None:
    """Do nothing if models can be computed in a scenario.

    Raises:
        InputError: otherwise.
    """
    if scenario not in _DISTURBANCES:
        raise InputError(
            f"{PREFIX}…: a model is computed in {', '.join(_DISTURBANCES)}, and not in {scenario}"
        )


def _cut_in(columns: Mapping[str, Float], driver: str) -> Bool:
    return avoids_cut_in(
        columns["ego_speed"],
        columns["other_speed"],
        columns["gap"],
        columns["lateral_speed"],
        driver=driver,
    )


def _cut_out(columns: Mapping[str, Float], driver: str) -> Bool:
    """The gap to the revealed vehicle, when the one ahead is more than 0.375 m aside."""
    speed = columns["ego_speed"]
    seconds = math.acos(1.0 - 2.0 * SIDE / LANE) / math.pi * LANE / columns["lateral_speed"]
    # The vehicle ahead moves aside along a cosine over the lane's width: until it is so far out,
    # the ego has driven on towards what it hides.
    gap = columns["headway"] * speed + LENGTH + columns["gap"] - speed * seconds
    return avoids_cut_out(speed, 0.0, np.maximum(gap, 0.0), driver=driver)


def _deceleration(columns: Mapping[str, Float], driver: str) -> Bool:
    speed = columns["ego_speed"]
    return avoids_deceleration(
        speed, speed, columns["headway"] * speed, columns["deceleration"], driver=driver
    )


_DISTURBANCES: Mapping[str, Callable[[Mapping[str, Float], str], Bool]] = {
    "r157-cut-in": _cut_in,
    "r157-cut-out": _cut_out,
    "r157-deceleration": _deceleration,
}
