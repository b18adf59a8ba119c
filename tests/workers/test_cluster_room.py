"""A cluster that shrinks keeps some actors and has no room for the others: work goes on.

Without Ray: what its side of the bridge says is scripted here. With Ray: test_cluster.
"""

import queue
from contextlib import closing
from typing import Any

import numpy as np
import pytest

from bridgegen.base import extras
from bridgegen.engine.workers import cluster
from bridgegen.engine.workers.cluster import Cluster

X = np.arange(1.0)


class Shrunken:
    """Ray's side of a cluster: of the actors asked for, those in ``has_room`` begin."""

    has_room: set[int]
    joins: tuple[int, int]
    kills: bool

    def __init__(self, said: "queue.SimpleQueue[Any]", *_: Any) -> None:
        self.said, self.slots = said, dict[int, int]()

    def ask(self, *request: Any) -> None:
        match [getattr(one, "__name__", one) for one in request]:
            case [None, _]:  # an address and a device
                self.say("joined", *self.joins)
            case ["start_worker", number, slot]:
                self.slots[number] = slot
                if slot in self.has_room:
                    self.say(number, ("started", cluster.version("bridgegen")))
            case ["prepare", number, _]:
                self.say(number, ("answer", None))
            case ["ping", number]:
                self.say(number, ("started", cluster.version("bridgegen")))
            case ["run", number, _, _, rows, _]:
                if Shrunken.kills:  # the node, with it one of two actors; the other one moves
                    Shrunken.kills = False
                    Shrunken.has_room = {1 - self.slots[number]}
                    self.say(number, ("died", "its node ended"))
                    self.say("joined", 1, 2)
                else:
                    self.say(number, ("answer", 2.0 * rows))

    def say(self, who: Any, *rest: Any) -> None:
        self.said.put((self, (who, *rest)))

    def end(self) -> int:
        return 0


class Impatient(queue.Queue):
    """Raises where a campaign would wait for ever."""

    def get(self) -> Any:
        return super().get(timeout=1.0)


@pytest.fixture
def doubles(doubles_can_be_imported):
    import worker_doubles

    return worker_doubles


@pytest.fixture
def shrunken(monkeypatch):
    monkeypatch.setattr(extras, "find_spec", lambda _: True)
    monkeypatch.setattr(cluster, "Process", Shrunken)
    workers = Cluster(None)
    workers._said = Impatient()
    with closing(workers):
        yield workers


def test_the_actor_that_has_room_works_whichever_it_is(shrunken, doubles):
    Shrunken.joins, Shrunken.has_room, Shrunken.kills = (2, 2), {0, 1}, True
    (part,) = shrunken.map(doubles.Doubler(), doubles.Doubler.double, X)
    assert (part.result == 2.0 * X).all()


def test_a_campaign_that_joins_later_finds_it_too(shrunken, doubles):
    Shrunken.joins, Shrunken.has_room, Shrunken.kills = (1, 2), {1}, False
    (part,) = shrunken.map(doubles.Doubler(), doubles.Doubler.double, X)
    assert (part.result == 2.0 * X).all()
