from pathlib import Path

import numpy as np
import pytest

from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.scenario import LogicalScenario
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build


def in_rain_and_haze(space: SearchSpace) -> dict[str, float]:
    """Return a feasible row at no boundary: as most rows are dry and clear, 0.4 of all would be."""
    shares = np.full(space.n_var, 0.4)
    for name in {"precipitation", "fog_density"} & set(space.variables):
        shares[space.index(name)] = 0.95
    return space.values(space.decode([shares])[0])


@pytest.fixture(scope="session")
def scenario() -> LogicalScenario:
    return load("crossroads-s4")


@pytest.fixture(scope="session")
def space(scenario) -> SearchSpace:
    """All axes searched."""
    return scenario.space(axes=["static", "participants", "weather"])


@pytest.fixture(scope="session")
def values(space) -> dict[str, float]:
    """A feasible row that is at no boundary, by name."""
    return in_rain_and_haze(space)


@pytest.fixture(scope="session")
def individuals(scenario, values) -> Individuals:
    return build(scenario, values, driver="route-follower")


@pytest.fixture(scope="session")
def everything() -> Individuals:
    """A scenario with lights, crosswalks, a jam, road works and a change of the weather.

    At its defaults, but for the weather's fog: none at first, 40 % later.
    """
    return at_defaults(load(Path(__file__).with_name("everything.yaml")))


def at_defaults(scenario: LogicalScenario) -> Individuals:
    whole = scenario.space(Axis)
    defaults = {one.name: one.default for one in scenario.parameters.values()}
    return build(scenario, whole.values(whole.row(defaults)), driver="reference")


@pytest.fixture(scope="session")
def individuals_of():
    """Build the individuals of a scenario of the catalogue, at its defaults."""
    return lambda name: at_defaults(load(name))
