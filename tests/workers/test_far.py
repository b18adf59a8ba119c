"""A simulator that only the workers' machines have: this one gets by with the embedded one."""

from types import MappingProxyType

import numpy as np
import pytest
from tests.approval import refuses

from bridgegen.adapters.carla.settings import Access
from bridgegen.base.errors import InputError
from bridgegen.engine.pipeline import REMOTE_CHUNK_ROWS, Pipeline
from bridgegen.engine.workers import Lost, Part
from bridgegen.engine.workers.workers import cut
from bridgegen.scenario.language.reader import load
from bridgegen.simulation import choice
from bridgegen.simulation.choice import Kind, SimulatorChoice
from bridgegen.simulation.rollout import WORKER_ENDED


class Elsewhere:
    """Workers that have a simulator; this machine may not ask for it."""

    are_here = False
    count = 2
    lost: int | None = None

    def __init__(self) -> None:
        self.made = None

    def map(self, portable, work, X, *args):
        choice.SIMULATORS["there"].access["here"] = "yes"  # we are on that machine now
        if self.made is None:
            self.made = portable.recipe.make()
        parts = []
        for a, b in cut(len(X), self.count, portable.rows_at_once):
            gone = self.lost is not None and a <= self.lost < b
            parts.append(Part(b - a, Lost("by test") if gone else work(self.made, X[a:b], *args)))
        del choice.SIMULATORS["there"].access["here"]
        return parts

    def close(self) -> None: ...


@pytest.fixture
def there(monkeypatch) -> SimulatorChoice:
    def make(embedded, storyboard, settings, access):
        if "here" not in choice.SIMULATORS["there"].access:
            raise InputError("there is no such simulator on this machine")
        return embedded

    kind = Kind("there", "The embedded one, on another machine.", make, access={}, device="GPU")
    known = MappingProxyType({**choice.SIMULATORS, "there": kind})
    monkeypatch.setattr(choice, "SIMULATORS", known)
    return SimulatorChoice("there")


def test_only_workers_have_it(there):
    scenario = load("crossroads-s4")
    space = scenario.space()
    X = space.decode(np.random.default_rng(0).random((3, space.n_var)))
    with refuses(InputError):
        Pipeline(scenario, space, simulator=there)
    pool = Elsewhere()
    pipeline = Pipeline(scenario, space, simulator=there, workers=pool)
    assert (pipeline.device, pipeline.rows_at_once) == ("GPU", REMOTE_CHUNK_ROWS)
    pipeline.warm_up()
    pipeline.choose_objective()
    plain = Pipeline(scenario, space)
    plain.choose_objective()
    assert pipeline.evaluate(X).metrics.tobytes() == plain.evaluate(X).metrics.tobytes()
    ((_, replay),) = pipeline.replays(X, plans=True).parts
    assert replay.intentions is None
    motion, expected = pipeline.rollout(X), plain.rollout(X)
    assert motion.x.tobytes() == expected.x.tobytes()
    pool.lost, pool.count = 1, 3
    motion = pipeline.rollout(X)
    assert motion.status.tolist() == [0, WORKER_ENDED, 0]
    assert motion.messages == {1: "by test"}
    with refuses(InputError):
        pipeline.arena()


def test_a_workers_machine_says_where_its_server_is(monkeypatch):
    monkeypatch.delenv("CARLA_HOST", raising=False)
    monkeypatch.delenv("CARLA_PORT", raising=False)
    assert Access.of({}).address == "localhost:2000"
    monkeypatch.setenv("CARLA_HOST", "carla-1")
    monkeypatch.setenv("CARLA_PORT", "2010")
    assert Access.of({}).address == "carla-1:2010"
    assert Access.of({"--host": "mine", "--port": 3000}).address == "mine:3000"
