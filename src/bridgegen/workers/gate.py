"""In a process of its own: the way to a Ray cluster.

Ray ends a process that has lost its cluster: so it is not the campaign's. Begun by
`bridgegen.workers.cluster`, with which it exchanges messages: (a worker's number, what it says).
What a worker is, when it may run and where, what becomes of one that dies: that is Ray's.
"""

import os
import pickle
import threading
import time
from importlib.metadata import version
from typing import Any

from bridgegen.child import Say, connect
from bridgegen.workers.recipe import Recipe
from bridgegen.workers.station import IDLE_SECONDS, Station

TRIES = 3
"""To connect from outside of the cluster."""

LOOKS = 2.0
"""How often it looks how many workers the cluster has room for [s]."""

IDLE = "BRIDGEGEN_IDLE_SECONDS"
"""Overrules `IDLE_SECONDS`."""


class Gate:
    """Actors of a cluster, by the numbers that we give them.

    Args:
        say: how to answer.
        address: of the cluster, as Ray takes it; None is the one that RAY_ADDRESS names, or that
            this machine belongs to.
        device: "CPU" or "GPU", of which each actor needs one.
    """

    def __init__(self, say: Say, address: str | None, device: str) -> None:
        import ray

        self._ray, self._say, self._device = ray, say, device
        self._namespace = f"bridgegen-{version('bridgegen')}"
        self._actors: dict[int, Any] = {}
        self._recipes: dict[str, Any] = {}
        self._connect(address=address or "auto", namespace=self._namespace, log_to_driver=False)
        self._class = ray.remote(_Actor)
        self._count = self._room()
        say("joined", self._count, self._actors_there())
        threading.Thread(target=self._look, daemon=True).start()

    def _connect(self, **given: Any) -> None:
        """Connect; from outside of the cluster, more than once.

        Its server forks for each client, which now and then ends what it has forked.
        """
        for left in reversed(range(TRIES)):
            try:
                self._ray.init(**given)
                return
            except ConnectionAbortedError:
                if not left:
                    raise

    def hire(self, number: int, place: int) -> None:
        """Have the actor of a place, which may be there already."""
        self._actors[number] = self._class.options(
            name=f"{self._device}-{place}",
            lifetime="detached",
            get_if_exists=True,
            num_cpus=1 if self._device == "CPU" else 0,
            num_gpus=1 if self._device == "GPU" else 0,
            max_restarts=-1,
            max_task_retries=0,  # not here again, but wherever there is somebody now
            scheduling_strategy="SPREAD",
        ).remote(float(os.environ.get(IDLE, IDLE_SECONDS)))
        self.greet(number)

    def greet(self, number: int) -> None:
        """Have an actor answer, once Ray has begun it, or begun it again, where there is room."""
        greet = self._actors[number].greet.options(max_task_retries=-1)
        self._tell(number, greet.remote())

    def prepare(self, number: int, recipe: Recipe) -> None:
        """Have an actor make what a recipe says."""
        if recipe.key not in self._recipes:
            self._recipes[recipe.key] = self._ray.put(recipe)
        # In a list, so that the actor is given not the recipe, but where it is to be had.
        self._tell(
            number, self._actors[number].prepare.remote([self._recipes[recipe.key]], recipe.key)
        )

    def work(self, number: int, *arguments: Any) -> None:
        """Have an actor work on rows."""
        self._tell(number, self._actors[number].work.remote(*arguments))

    def dismiss(self, number: int) -> None:
        """Forget an actor: it is not ours alone."""
        self._actors.pop(number, None)

    def _tell(self, number: int, reference: Any) -> None:
        """Pass on what an actor answers, when it does."""

        def came(future: Any) -> None:
            try:
                self._say(number, future.result())
            except self._ray.exceptions.RayTaskError as error:  # before our own part of it
                self._say(number, ("raised", RuntimeError(f"in a worker: {error}")))
            except self._ray.exceptions.RayError as error:
                self._say(number, ("died", _reason(error)))
            except Exception as error:
                self._say("lost", f"{type(error).__name__}: {_reason(error)}")

        reference.future().add_done_callback(came)

    def _room(self) -> int:
        return int(self._ray.cluster_resources().get(self._device, 0))

    def _actors_there(self) -> int:
        """How many actors there are, all campaigns', with room or waiting for some."""
        names = self._ray.util.list_named_actors()
        return sum(name.startswith(f"{self._device}-") for name in names)

    def _look(self) -> None:
        """Say whenever the cluster has grown or shrunk."""
        while True:
            time.sleep(LOOKS)
            try:
                count = self._room()
            except Exception as error:
                self._say("lost", f"{type(error).__name__}: {_reason(error)}")
                return
            if count != self._count:
                self._count = count
                self._say("joined", count, self._actors_there())


class _Actor(Station):
    """A station that is an actor."""

    def __init__(self, idle_seconds: float) -> None:
        import ray

        def leave() -> None:
            ray.kill(ray.get_runtime_context().current_actor, no_restart=True)

        super().__init__(leave, idle_seconds)

    def prepare(self, recipe: Any, key: str) -> tuple[Any, ...]:
        import ray

        return super().prepare(lambda: ray.get(recipe[0]), key)


def _reason(error: Exception) -> str:
    """Return the line of an error of Ray's that says most."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    told = [line for line in lines if "Error" in line or "because" in line]
    return (told or lines or [type(error).__name__])[-1]


def main() -> None:
    """Do what is asked for, until nobody asks."""
    requests, say = connect()
    say("begun")
    gate: Gate | None = None
    while True:
        name, *arguments = pickle.loads(requests.get())
        try:
            if gate is None:
                gate = Gate(say, *arguments)
            else:
                getattr(gate, name)(*arguments)
        except Exception as error:
            say("lost", f"{type(error).__name__}: {_reason(error)}")
