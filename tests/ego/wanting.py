"""What drivers that want more are shown, in this process."""

from collections.abc import Iterable
from dataclasses import replace
from pathlib import Path

import numpy as np

from bridgegen.drivers.interface import Observation
from bridgegen.drivers.user_drivers import Traits
from bridgegen.drivers.views import MapSender, Viewer
from bridgegen.engine.options import PipelineOptions
from bridgegen.engine.pipeline import Pipeline
from bridgegen.scenario.language.reader import load
from bridgegen.simulation.embedded.user_drivers.lock_step import drive_in_lock_step

DRIVERS = Path(__file__).with_name("drivers.py")


class Recorder:
    """A driver process that is none: it follows its route, and keeps all that it is shown."""

    answers_each_row = True

    def __init__(self, wants: Iterable[str]) -> None:
        self.traits = Traits(wants=tuple(wants))
        self._viewer, self._sender = Viewer(self.traits.wants), MapSender()
        self.seen: list[Observation] = []

    def start(self) -> None: ...

    def reset(self, n, scene) -> None:
        sent = self._sender.send(scene.maps) if scene.maps else None
        self.scene = self._viewer.reset(n, replace(scene, maps=()), sent)

    def act(self, observation, views):
        o = self._viewer.complete(observation, views)
        self.seen.append(_copied(o))
        dx, dy = o.route[:, 3, 0] - o.x, o.route[:, 3, 1] - o.y
        left = dy * np.cos(o.h) - dx * np.sin(o.h)
        return np.clip(o.target_speed - o.v, -3.0, 2.0), 2.0 * left / (dx * dx + dy * dy)


def _copied(observation: Observation) -> Observation:
    return observation.take(np.arange(len(observation.x)))


def pipeline_of(scenario: str, **options) -> Pipeline:
    logical = load(scenario)
    return Pipeline(logical, logical.space(), PipelineOptions(**options))


def watched(scenario: str, wants: Iterable[str], n: int = 4, seed: int = 4) -> Recorder:
    """Return what a route follower is shown in some rows of a scenario."""
    driver = Recorder(wants)
    pipeline = pipeline_of(scenario, ego=f"{DRIVERS}:Cruises")
    X = pipeline.space.decode(np.random.default_rng(seed).random((n, pipeline.space.n_var)))
    driver.pipeline, driver.X = pipeline, X
    networks, rows = pipeline.runner.roads_of(X)
    values = {name: X[:, i] for i, name in enumerate(pipeline.space.names)}
    networks.provide(driver.traits.wants)
    program = pipeline.runner.simulator.program
    driver.networks, driver.network_of = networks, rows

    def setup(at):
        some = {name: np.broadcast_to(one, len(rows))[at] for name, one in values.items()}
        return pipeline.runner.simulator.batch(networks, rows[at], some, own=driver.traits)

    driver.rollout = drive_in_lock_step(program, setup, n, driver)
    return driver
