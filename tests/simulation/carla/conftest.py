"""A CARLA server to test with: the stand-in."""

from collections.abc import Iterator
from typing import Any

import pytest

carla = pytest.importorskip("carla", reason="the package 'carla' is not installed")

from bridgegen.adapters.carla import server  # noqa: E402
from bridgegen.engine.options import PipelineOptions  # noqa: E402
from bridgegen.engine.pipeline import Pipeline  # noqa: E402
from bridgegen.openx.opendrive.write import to_xml  # noqa: E402
from bridgegen.scenario.language.reader import load  # noqa: E402
from bridgegen.simulation.choice import SimulatorChoice  # noqa: E402

from .stand_in import DEFAULT_MAP, MACHINES, Client, Machine  # noqa: E402


@pytest.fixture(autouse=True)
def _no_real_server(monkeypatch: pytest.MonkeyPatch) -> None:
    """What is tested here is the stand-in; the contract is what a real server is held to."""
    monkeypatch.delenv("CARLA_HOST", raising=False)
    monkeypatch.delenv("CARLA_PORT", raising=False)


@pytest.fixture(scope="session")
def crossroads() -> str:
    """The roads of a crossroads, as OpenDRIVE."""
    logical = load("crossroads-s1")
    pipeline = Pipeline(logical, logical.space(), PipelineOptions(ego="route-follower"))
    return to_xml(pipeline.runner.concrete(pipeline.space.row({})).roads).decode()


@pytest.fixture
def machine(monkeypatch: pytest.MonkeyPatch, crossroads: str) -> Iterator[Any]:
    """A stand-in of a server, with nobody in it."""
    monkeypatch.setattr(carla, "Client", Client)
    monkeypatch.setattr(server, "BACK_OFF", (0.01, 0.01))
    one = Machine({DEFAULT_MAP: crossroads})
    MACHINES[one.port] = one
    yield one
    if one.listener is not None:
        one.die()
    del MACHINES[one.port]


@pytest.fixture
def made(machine: Any) -> Any:
    """Return what makes the pipeline of a scenario, run by the server."""

    def make(scenario: str, driver: str | None, /, **settings: Any) -> Pipeline:
        logical = load(scenario)
        choice = SimulatorChoice("carla", settings, {"--port": machine.port})
        return Pipeline(logical, logical.space(), PipelineOptions(ego=driver), simulator=choice)

    return make
