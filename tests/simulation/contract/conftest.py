"""The simulators that the contract holds, how each is made, and how exact it is.

A simulator more is one line of `CONTENDERS`.
"""

import os
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager, nullcontext
from dataclasses import dataclass

import numpy as np
import pytest

from bridgegen import drivers as egos
from bridgegen.drivers.drivers import is_spec
from bridgegen.openx.opendrive.write import to_xml
from bridgegen.openx.openscenario.read import read
from bridgegen.simulation.choice import EMBEDDED, SimulatorChoice
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

from ..embedded.storyboards import crossroads


def esmini() -> SimulatorChoice:
    if not os.environ.get("ESMINI_LIB"):
        pytest.skip("ESMINI_LIB names no library of esmini's")
    return SimulatorChoice("esmini")


def carla() -> SimulatorChoice:
    from ..carla.stand_in import MACHINES

    *_, port = MACHINES
    return SimulatorChoice("carla", {"ego": "kinematic"}, {"--host": "localhost", "--port": port})


@contextmanager
def carla_stands_in(monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    client = pytest.importorskip("carla", reason="the package 'carla' is not installed")
    from ..carla.stand_in import DEFAULT_MAP, MACHINES, Client, Machine

    monkeypatch.setattr(client, "Client", Client)
    machine = Machine({DEFAULT_MAP: to_xml(crossroads()).decode()})
    monkeypatch.setitem(MACHINES, machine.port, machine)
    yield
    machine.die()


def live_carla() -> SimulatorChoice:
    """A server, where the environment names one."""
    if not (host := os.environ.get("CARLA_HOST")):
        pytest.skip("CARLA_HOST names no machine with a CARLA server")
    access = {"--host": host, "--port": int(os.environ.get("CARLA_PORT", "2000"))}
    return SimulatorChoice("carla", {"ego": "kinematic"}, access)


@dataclass(frozen=True)
class Contender:
    """A simulator, and how far it may be from what is worked out by hand.

    Attributes:
        name: of it.
        choose: returns the choice; skips the test where there is none.
        place: [m] where everything is constant.
        per_change: [m] for each m/s by which a speed changes: half a step, where one moves by the
            speed at a step's end and not by the mean.
        speed: [m/s].
        heading: [rad].
        instants: by which an event may begin earlier or later.
        marks: of its tests.
        prepare: what else a test of it needs.
    """

    name: str
    choose: Callable[[], SimulatorChoice]
    place: float = 1e-6
    per_change: float = 1e-9
    speed: float = 1e-9
    heading: float = 1e-6
    instants: int = 0
    marks: tuple[pytest.MarkDecorator, ...] = ()
    prepare: Callable[[pytest.MonkeyPatch], AbstractContextManager[None]] = nullcontext

    def made(self, text, driver="route-follower"):
        """Return the simulator of a storyboard's text."""
        return self._both(text, driver)[0]

    def _both(self, text, driver):
        """Return the simulator of a storyboard's text, and the embedded one."""
        storyboard = read(text.encode(), "test.xosc")
        limit = 5.0 if driver and is_spec(driver) else None
        ego = egos.get(driver, time_limit=limit) if driver else None
        embedded = EmbeddedSimulator(storyboard, "test.xosc", driver=ego)
        return self.choose().around(embedded, storyboard), embedded

    def run(self, text, driver="route-follower", roads=None, replay=None, **values):
        """Return the rollout of a storyboard's text on the crossroads, of sound form."""
        simulator, embedded = self._both(text, driver)
        n = len(next(iter(values.values()))) if values else 1
        ready = simulator.roads([roads or crossroads()])
        rollout = simulator.run(ready, np.zeros(n, dtype=np.int64), values, **(replay or {}))
        is_sound(rollout, embedded, n)
        return rollout


CONTENDERS = (
    Contender("embedded", lambda: EMBEDDED),
    Contender(
        "esmini",
        esmini,
        place=1e-3,
        per_change=0.026,
        speed=1e-4,
        heading=1e-3,
        instants=1,
        marks=(pytest.mark.esmini,),
    ),
    Contender("carla", carla, prepare=carla_stands_in),
    Contender("live-carla", live_carla, marks=(pytest.mark.live_carla,)),
)


@pytest.fixture(params=[pytest.param(one, id=one.name, marks=one.marks) for one in CONTENDERS])
def contender(request, monkeypatch):
    with request.param.prepare(monkeypatch):
        yield request.param


def is_sound(rollout, embedded, n):
    """Assert that a rollout is as `Rollout` says, whatever happened in it."""
    names = embedded.program.names
    e, t = len(names), round(embedded.duration / embedded.time_step) + 1
    assert rollout.names == names
    assert rollout.time_step == embedded.time_step
    for name in ("x", "y", "h", "v", "a", "offset"):
        array = getattr(rollout, name)
        assert array.shape == (n, e, t), name
        assert array.dtype == np.float64, name
        assert np.isfinite(array).all(), name
    assert (rollout.v >= 0.0).all()
    assert rollout.n_steps.shape == rollout.status.shape == (n,)
    assert rollout.n_steps.dtype == np.int64
    assert rollout.status.dtype == np.int8
    assert ((rollout.n_steps >= 1) & (rollout.n_steps <= t)).all()
    assert rollout.box.shape == (e, 3)
    assert rollout.began.shape == (n, len(rollout.event_names))
    assert (rollout.began < rollout.n_steps[:, np.newaxis]).all()
    assert rollout.lights.shape == (n, len(rollout.light_names), t)
    assert rollout.lights.dtype == np.int8
    assert set(rollout.messages) <= set(np.flatnonzero(rollout.status).tolist())
    for i, steps in enumerate(rollout.n_steps.tolist()):
        for name in ("x", "y", "h", "v", "offset"):
            last = getattr(rollout, name)[i, :, steps - 1 :]
            assert (last == last[:, :1]).all(), f"{name} after the end"
        assert np.abs(np.diff(rollout.h[i, :, :steps], axis=1)).max(initial=0.0) < np.pi
