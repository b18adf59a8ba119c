import pytest

from bridgegen.odd.reader import load
from bridgegen.odd.scenario import LogicalScenario
from bridgegen.odd.space import SearchSpace
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.individuals import build


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
    return space.values(space.decode([[0.4] * space.n_var])[0])


@pytest.fixture(scope="session")
def individuals(scenario, values) -> Individuals:
    return build(scenario, values, driver="route-follower")
