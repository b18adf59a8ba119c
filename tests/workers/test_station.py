"""An actor's own side, without Ray: what it answers, and when it leaves."""

import threading
import time

import numpy as np
import pytest

from bridgegen.errors import InputError
from bridgegen.workers import open_workers
from bridgegen.workers.bench import KEPT, Bench, Unprepared
from bridgegen.workers.recipe import Recipe
from bridgegen.workers.station import Station


class Sleeper:
    def __init__(self, seconds: float = 0.0) -> None:
        self.seconds = seconds

    def sleep(self, X: np.ndarray) -> int:
        time.sleep(self.seconds)
        return len(X)


def test_it_leaves_once_nobody_asks_and_not_before():
    left = threading.Event()
    station = Station(left.set, idle_seconds=0.3)
    recipe = Recipe.of(Sleeper, 1.0)
    assert station.prepare(lambda: recipe, recipe.key) == ("answer", None)
    assert station.work(recipe.key, "sleep", np.zeros(3), ()) == ("answer", 3)
    assert not left.is_set()  # it was busy for longer
    assert left.wait(10.0)


def test_a_recipe_is_fetched_once():
    station, fetched = Station(lambda: None), []
    recipe = Recipe.of(Sleeper)

    def fetch() -> Recipe:
        fetched.append(1)
        return recipe

    for _ in range(3):
        station.prepare(fetch, recipe.key)
    assert fetched == [1]


def test_what_is_raised_is_answered():
    kind, error = Station(lambda: None).work("unknown", "sleep", np.zeros(1), ())
    assert kind == "raised"
    assert isinstance(error, Unprepared)


def test_the_latest_used_are_kept():
    bench = Bench()
    recipes = [Recipe.of(Sleeper, float(k) / 1e6) for k in range(KEPT + 1)]
    for one in recipes[:-1]:
        bench.prepare(one)
    bench.work(recipes[0].key, "sleep", np.zeros(1), ())
    bench.prepare(recipes[-1])
    assert bench.holds(recipes[0].key)
    assert not bench.holds(recipes[1].key)


def test_without_ray_the_extra_is_named(monkeypatch):
    monkeypatch.setattr("importlib.util.find_spec", lambda name: None)
    with (
        pytest.raises(InputError, match=r"need the extra 'ray': pip install 'bridgegen\[ray\]'"),
        open_workers("ray"),
    ):
        pass
