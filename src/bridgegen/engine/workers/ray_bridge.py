"""The connection to a Ray cluster, in a process of its own.

Ray ends a process that has lost its cluster, so this must not be the campaign's process. It is
started by `bridgegen.engine.workers.cluster` and sends it messages: a worker's number, with that
worker's message. Ray decides where an actor runs, when, and whether it is restarted.
"""

import os
import pickle
import threading
import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

from bridgegen.base.arrays import Float
from bridgegen.base.processes.child import Say, connect
from bridgegen.engine.workers.pipeline_cache import PipelineCache, picklable
from bridgegen.engine.workers.recipe import Recipe
from bridgegen.engine.workers.workers import Work

# --- A worker in a Ray cluster: an actor that all campaigns on the cluster share ---
# So ten campaigns have no more workers than the cluster has cores (or graphics cards, each with its
# simulator's server): their chunks take turns in each actor's queue.


IDLE_SECONDS = 60.0
"""Idle time after which an actor ends and frees its core [s]."""


class RayActor:
    """The actor itself, without Ray; its methods return messages, see `process.py`.

    Args:
        leave: ends this actor for good; called when it has been idle for ``idle_seconds``.
        idle_seconds: how long [s].
    """

    def __init__(self, leave: Callable[[], None], idle_seconds: float = IDLE_SECONDS) -> None:
        self._cache, self._leave, self._idle_seconds = PipelineCache(), leave, idle_seconds
        self._is_busy, self._since = False, time.monotonic()
        threading.Thread(target=self._leave_when_idle, daemon=True).start()

    def ping(self) -> tuple[Any, ...]:
        """Return that it has started, with the version of its bridgegen."""
        return self._answer(lambda: ("started", version("bridgegen")))

    def prepare(self, recipe: Callable[[], Any], key: str) -> tuple[Any, ...]:
        """Build a recipe's pipeline; the recipe is fetched only if it is needed."""

        def make() -> tuple[Any, ...]:
            if key not in self._cache:
                self._cache.prepare(recipe())
            return ("answer", None)

        return self._answer(make)

    def run(self, key: str, work: Work, X: Float, args: tuple[Any, ...]) -> tuple[Any, ...]:
        """Evaluate rows."""
        return self._answer(lambda: ("answer", self._cache.run(key, work, X, args)))

    def _answer(self, call: Callable[[], tuple[Any, ...]]) -> tuple[Any, ...]:
        self._is_busy = True
        try:
            return call()
        except Exception as error:
            return ("raised", picklable(error))
        finally:
            self._is_busy, self._since = False, time.monotonic()

    def _leave_when_idle(self) -> None:
        while self._is_busy or time.monotonic() - self._since < self._idle_seconds:
            time.sleep(min(1.0, self._idle_seconds / 4.0))
        self._leave()


CONNECT_ATTEMPTS = 3
"""Attempts to connect from outside of the cluster."""

POLL_SECONDS = 2.0
"""Interval at which the size of the cluster is read [s]."""

IDLE = "BRIDGEGEN_IDLE_SECONDS"
"""Environment variable that overrides `IDLE_SECONDS`."""


class RayBridge:
    """Actors of a cluster, by numbers that the campaign assigns.

    Args:
        say: sends a message to the campaign.
        address: of the cluster, as Ray takes it; None is the one that RAY_ADDRESS names, or that
            this machine belongs to.
        device: "CPU" or "GPU"; each actor needs one.
    """

    def __init__(self, say: Say, address: str | None, device: str) -> None:
        import ray

        self._ray, self._say, self._device = ray, say, device
        # By version: campaigns of another one have actors of their own.
        self._namespace = f"bridgegen-{version('bridgegen')}"
        self._actors: dict[int, Any] = {}
        self._recipes: dict[str, Any] = {}
        self._connect(address=address or "auto", namespace=self._namespace, log_to_driver=False)
        self._class = ray.remote(_RemoteActor)
        self._capacity = self._read_capacity()
        say("joined", self._capacity, self._count_actors())
        threading.Thread(target=self._watch_capacity, daemon=True).start()

    def _connect(self, **options: Any) -> None:
        """Connect; from outside of the cluster, try again after a failure.

        The cluster's server forks for each client, and sometimes the fork fails.
        """
        for remaining in reversed(range(CONNECT_ATTEMPTS)):
            try:
                self._ray.init(**options)
                return
            except ConnectionAbortedError:
                if not remaining:
                    raise

    def start_worker(self, number: int, slot: int) -> None:
        """Start the actor of a slot, or use it if it exists."""
        self._actors[number] = self._class.options(
            name=f"{self._device}-{slot}",
            # Actors of a campaign's own would hold the cluster until it ends; tasks would lose what
            # is compiled whenever Ray reuses a process.
            lifetime="detached",
            get_if_exists=True,
            num_cpus=1 if self._device == "CPU" else 0,
            num_gpus=1 if self._device == "GPU" else 0,
            max_restarts=-1,
            max_task_retries=0,  # the pool repeats the chunk, on any worker
            scheduling_strategy="SPREAD",
        ).remote(float(os.environ.get(IDLE, IDLE_SECONDS)))
        self.ping(number)

    def ping(self, number: int) -> None:
        """Have an actor answer, as soon as Ray has started or restarted it."""
        # Only a greeting waits for a restarted actor. Work does not: the actor may be waiting for a
        # machine that is gone.
        ping = self._actors[number].ping.options(max_task_retries=-1)
        self._forward(number, ping.remote())

    def prepare(self, number: int, recipe: Recipe) -> None:
        """Have an actor build a recipe's pipeline."""
        # Once for the cluster: a recipe with a large map is 4 MB, and each actor fetches it from
        # the store of its machine.
        if recipe.key not in self._recipes:
            self._recipes[recipe.key] = self._ray.put(recipe)
        # In a list, Ray passes the reference instead of the recipe.
        self._forward(
            number, self._actors[number].prepare.remote([self._recipes[recipe.key]], recipe.key)
        )

    def run(self, number: int, key: str, work: Work, X: Float, args: tuple[Any, ...]) -> None:
        """Have an actor evaluate rows."""
        self._forward(number, self._actors[number].run.remote(key, work, X, args))

    def release(self, number: int) -> None:
        """Forget an actor; it stays, for other campaigns."""
        self._actors.pop(number, None)

    def _forward(self, number: int, reference: Any) -> None:
        """Send an actor's message to the campaign when it arrives."""

        def arrived(future: Any) -> None:
            try:
                self._say(number, future.result())
            except self._ray.exceptions.RayTaskError as error:  # raised before our code ran
                self._say(number, ("raised", RuntimeError(f"in a worker: {error}")))
            except self._ray.exceptions.RayError as error:
                self._say(number, ("died", _reason(error)))
            except Exception as error:
                self._say("lost", f"{type(error).__name__}: {_reason(error)}")

        reference.future().add_done_callback(arrived)

    def _read_capacity(self) -> int:
        """Return how many workers the cluster has room for."""
        return int(self._ray.cluster_resources().get(self._device, 0))

    def _count_actors(self) -> int:
        """Return the number of actors of all campaigns, including those that wait for room."""
        names = self._ray.util.list_named_actors()
        return sum(name.startswith(f"{self._device}-") for name in names)

    def _watch_capacity(self) -> None:
        """Send a message whenever the cluster has grown or shrunk."""
        while True:
            time.sleep(POLL_SECONDS)
            try:
                capacity = self._read_capacity()
            except Exception as error:
                self._say("lost", f"{type(error).__name__}: {_reason(error)}")
                return
            if capacity != self._capacity:
                self._capacity = capacity
                self._say("joined", capacity, self._count_actors())


class _RemoteActor(RayActor):
    """The actor with its calls to Ray."""

    def __init__(self, idle_seconds: float) -> None:
        import ray

        def leave() -> None:
            # Ray would begin it again otherwise, without limit (``max_restarts=-1``).
            ray.kill(ray.get_runtime_context().current_actor, no_restart=True)

        super().__init__(leave, idle_seconds)

    def prepare(self, recipe: Any, key: str) -> tuple[Any, ...]:
        import ray

        return super().prepare(lambda: ray.get(recipe[0]), key)


def _reason(error: Exception) -> str:
    """Return the most informative line of an error of Ray."""
    lines = [line.strip() for line in str(error).splitlines() if line.strip()]
    causes = [line for line in lines if "Error" in line or "because" in line]
    return (causes or lines or [type(error).__name__])[-1]


def main() -> None:
    """Connect to a cluster, then call methods of the bridge until the campaign ends.

    The first request is the address and the device; each other one is a method and its arguments.
    """
    requests, say = connect()
    say("started")
    bridge: RayBridge | None = None
    while True:
        request = pickle.loads(requests.get())
        try:
            if bridge is None:
                bridge = RayBridge(say, *request)
            else:
                method, *args = request
                method(bridge, *args)
        except Exception as error:
            say("lost", f"{type(error).__name__}: {_reason(error)}")
