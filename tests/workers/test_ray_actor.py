"""An actor without Ray: what it answers, and when it ends."""

import threading
import time

import numpy as np
from tests.approval import refuses

from bridgegen.base import extras
from bridgegen.base.errors import InputError
from bridgegen.engine.workers import open_workers
from bridgegen.engine.workers.pipeline_cache import CAPACITY, NotPrepared, PipelineCache
from bridgegen.engine.workers.ray_bridge import RayActor
from bridgegen.engine.workers.recipe import Recipe


class Sleeper:
    def __init__(self, seconds: float = 0.0) -> None:
        self.seconds = seconds

    def sleep(self, X: np.ndarray) -> int:
        time.sleep(self.seconds)
        return len(X)


def test_it_ends_when_it_has_been_idle_and_not_before():
    left = threading.Event()
    actor = RayActor(left.set, idle_seconds=0.3)
    recipe = Recipe.of(Sleeper, 1.0)
    assert actor.prepare(lambda: recipe, recipe.key) == ("answer", None)
    assert actor.run(recipe.key, Sleeper.sleep, np.zeros(3), ()) == ("answer", 3)
    assert not left.is_set()  # it was busy for longer
    assert left.wait(10.0)


def test_a_recipe_is_fetched_once():
    actor, fetched = RayActor(lambda: None), []
    recipe = Recipe.of(Sleeper)

    def fetch() -> Recipe:
        fetched.append(1)
        return recipe

    for _ in range(3):
        actor.prepare(fetch, recipe.key)
    assert fetched == [1]


def test_what_is_raised_is_answered():
    kind, error = RayActor(lambda: None).run("unknown", Sleeper.sleep, np.zeros(1), ())
    assert kind == "raised"
    assert isinstance(error, NotPrepared)


def test_the_latest_used_are_kept():
    cache = PipelineCache()
    recipes = [Recipe.of(Sleeper, float(k) / 1e6) for k in range(CAPACITY + 1)]
    for one in recipes[:-1]:
        cache.prepare(one)
    cache.run(recipes[0].key, Sleeper.sleep, np.zeros(1), ())
    cache.prepare(recipes[-1])
    assert recipes[0].key in cache
    assert recipes[1].key not in cache


def test_without_ray_the_extra_is_named(monkeypatch):
    monkeypatch.setattr(extras, "find_spec", lambda name: None)
    with (
        refuses(InputError, "ray", "bridgegen[ray]"),
        open_workers("ray"),
    ):
        pass
