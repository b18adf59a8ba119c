"""Which exposure a command takes: the one that is named, or the scenario's own."""

import json
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.scenario.exposure.exposure import Exposure
from bridgegen.scenario.exposure.marginals import Conditional, Marginal, Shared
from bridgegen.scenario.exposure.reader import build_exposure, exposure_of, read_exposure
from bridgegen.scenario.language.distributions import Discrete
from bridgegen.scenario.language.plain_yaml import read_plain_yaml
from bridgegen.scenario.language.scenario import LogicalScenario, SearchedScenario
from bridgegen.scenario.language.space import SearchSpace

UNIFORM = "uniform"
"""Names the exposure in which each parameter is uniform over its range: no road is like that."""
ROWS = 200_000
"""Of an exposure, always the same ones, that show how likely parts of a search space are."""

_EVENLY = b"source: Uniform over the ranges, which no road is like.\nothers: uniform\n"


def chosen_exposure(
    scenario: SearchedScenario, given: str | Path | Exposure | None
) -> Exposure | None:
    """Return the exposure that was asked for; None where none was, and the scenario has none.

    Args:
        scenario: of which.
        given: a file, the name of an example, `UNIFORM`, or the exposure itself; by default that of
            the scenario's file.

    Raises:
        FileFormatError: a file cannot be read.
        UnknownNameError: no such example.
        ScenarioError: it breaks a rule.
        InputError: it is that of another scenario, or contradicts the scenario's constraints.
    """
    if isinstance(given, Exposure):
        if given.scenario.name != scenario.name:
            raise InputError(
                f"the exposure must be that of {scenario.name}, got one of {given.scenario.name}"
            )
        return given
    if given == UNIFORM:
        return build_exposure(read_plain_yaml(_EVENLY, UNIFORM), scenario, None)
    if given is not None:
        return read_exposure(given, scenario)
    return exposure_of(scenario) if isinstance(scenario, LogicalScenario) else None


def evenly(exposure: Exposure) -> Exposure:
    """Return the exposure that distributes the same parameters, each uniformly over its range.

    One that takes single values of its range takes each of them equally often.
    """
    even = {name: _even(one) for name, one in exposure.marginals.items()}
    node = {"source": "Uniform over the ranges.", "others": "default", "parameters": even}
    text = json.dumps(node).encode()
    return build_exposure(read_plain_yaml(text, UNIFORM), exposure.scenario, None)


def _even(marginal: Marginal | Conditional) -> dict[str, object]:
    if isinstance(marginal, Shared) and isinstance(marginal.distribution, Discrete):
        return {"distribution": "discrete", "values": list(marginal.distribution.values)}
    return {"distribution": "uniform"}


def rows_on_the_road(exposure: Exposure, space: SearchSpace, n: int = ROWS) -> Float:
    """Return rows of an exposure in the columns of a search space of its scenario.

    A parameter that the exposure does not distribute stands at its default.

    Args:
        exposure: of the space's scenario.
        space: it may search other parameters than the exposure distributes.
        n: how many.

    Returns:
        ``(n, len(space.names))``, always the same rows.

    Raises:
        InputError: the exposure contradicts the constraints.
    """
    X = exposure.sample(n, 0).X
    rows = np.empty((n, len(space.names)))
    for column, name in enumerate(space.names):
        if name in exposure.space.names:
            rows[:, column] = X[:, exposure.space.index(name)]
        else:
            rows[:, column] = space.parameters[name].default
    return rows
