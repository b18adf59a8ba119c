"""Every simulator keeps the contract; a stand-in plays the part of CARLA's server."""

import os

import pytest

from bridgegen.openx.opendrive.write import to_xml
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.testing import SimulatorContract
from bridgegen.testing.storyboards import crossroads


class TestEmbedded(SimulatorContract):
    simulator = EMBEDDED


@pytest.mark.esmini
class TestEsmini(SimulatorContract):
    place, per_change, speed, heading, instants = 1e-3, 0.026, 1e-4, 1e-3, 1

    @pytest.fixture(autouse=True)
    def library(self):
        if not os.environ.get("ESMINI_LIB"):
            pytest.skip("ESMINI_LIB names no library of esmini's")
        self.simulator = SimulatorChoice("esmini")


class TestCarla(SimulatorContract):
    @pytest.fixture(autouse=True)
    def server(self, monkeypatch):
        client = pytest.importorskip("carla", reason="the package 'carla' is not installed")
        from .carla.stand_in import DEFAULT_MAP, MACHINES, Client, Machine

        monkeypatch.setattr(client, "Client", Client)
        machine = Machine({DEFAULT_MAP: to_xml(crossroads()).decode()})
        monkeypatch.setitem(MACHINES, machine.port, machine)
        access = {"--host": "localhost", "--port": machine.port}
        self.simulator = SimulatorChoice("carla", {"ego": "kinematic"}, access)
        yield
        machine.die()


@pytest.mark.live_carla
class TestLiveCarla(SimulatorContract):
    @pytest.fixture(autouse=True)
    def server(self):
        if not (host := os.environ.get("CARLA_HOST")):
            pytest.skip("CARLA_HOST names no machine with a CARLA server")
        access = {"--host": host, "--port": int(os.environ.get("CARLA_PORT", "2000"))}
        self.simulator = SimulatorChoice("carla", {"ego": "kinematic"}, access)
