"""Actors of a Ray cluster, on all of its machines."""

import itertools
import queue
import re
import tempfile
from collections.abc import Callable
from importlib.metadata import version
from typing import IO, Any

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError, WorkersError
from bridgegen.base.extras import require
from bridgegen.engine.workers.pool import PoolStream, WorkerPool
from bridgegen.engine.workers.processes import Process, Said
from bridgegen.engine.workers.ray_bridge import RayBridge
from bridgegen.engine.workers.recipe import Recipe
from bridgegen.engine.workers.workers import Args, Evaluator, Part, Result, Work


class Cluster(WorkerPool[int]):
    """`Workers` in a Ray cluster: one for each of its cores, or of its graphics cards.

    Args:
        address: of the cluster: "ray://HOST:PORT" from outside of it, "HOST:PORT" on one of its
            machines; None is the one that RAY_ADDRESS names, or that this machine belongs to.

    Raises:
        InputError: Ray is not installed.
    """

    are_here = False

    def __init__(self, address: str | None) -> None:
        super().__init__()
        require("ray", "a cluster of workers")
        self._address = address
        self._bridge: Process | None = None
        self._said: Said = queue.SimpleQueue()
        self._numbers = itertools.count()
        self._slots: dict[int, int] = {}
        self._reasons: dict[int, str] = {}
        self._log: IO[bytes] | None = None
        self._device, self._capacity, self._has_joined = "CPU", 0, False
        self._actors, self._has_lost_actors = 0, False

    @property
    def count(self) -> int:
        """See `Workers`: as many as the cluster has room for now."""
        return max(1, self._capacity)

    def map(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        X: Float,
        *args: *Args,
    ) -> list[Part[Result]]:
        """See `Workers`."""
        self._join(portable.device)
        return super().map(portable, work, X, *args)

    def stream(
        self,
        portable: Evaluator,
        work: Callable[[Evaluator, Float, *Args], Result],
        *args: *Args,
    ) -> PoolStream[Result]:
        """See `Workers`."""
        self._join(portable.device)
        return super().stream(portable, work, *args)

    def close(self) -> None:
        """See `Workers`; the actors, which campaigns share, end when they have been idle."""
        super().close()
        if self._bridge is not None:
            self._bridge.end()
            self._bridge, self._capacity, self._has_joined = None, 0, False
            self._actors, self._has_lost_actors = 0, False
        if self._log is not None:
            self._log.close()
            self._log = None

    def _join(self, device: str) -> None:
        """Connect to the cluster, unless that has been done for workers with such a device.

        Raises:
            WorkersError: no cluster is there, or it has no room for a worker.
        """
        if self._bridge is not None and device == self._device:
            return
        self.close()
        self._device = device
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (``close`` does)
        # Ray ends a process that has lost its cluster, with exit status 1 and no exception, after a
        # minute of trying: so it must not be this one, which says what is lost and how to go on.
        self._bridge = Process(self._said, "bridgegen.engine.workers.ray_bridge", self._log)
        self._bridge.ask(self._address, self._device)
        try:
            while not self._has_joined:
                self._receive_from_bridge()
            if not self._capacity:
                raise WorkersError(f"{self._where} has no {self._device} for workers")
        except BaseException:
            self.close()
            raise

    def _receive_from_bridge(self) -> tuple[int | None, tuple[Any, ...]] | None:
        """Wait for the bridge's next message; return it if it is a worker's or `wake`'s."""
        bridge, (kind, *rest) = self._said.get()
        if bridge is not self._bridge:
            return None  # the last message of an earlier bridge
        if kind == "joined":
            self._capacity, actors = rest
            self._actors, self._has_joined = max(actors, self._actors, self._capacity), True
        elif kind == "lost":
            hint = (
                ""
                if self._address
                else "; 'ray start --head' starts one, ray://HOST:PORT names one"
            )
            raise WorkersError(f"{self._where} cannot be reached: {rest[0]}{hint}")
        elif kind == "died":
            raise WorkersError(f"{self._where} is lost: {self._last_error()}")
        elif kind == "wake":
            return None, (kind,)
        elif kind != "started":
            return kind, rest[0]
        return None

    def wake(self) -> None:
        """See `WorkerPool`."""
        self._said.put((self._bridge, ("wake",)))

    def _receive(self) -> tuple[int | None, tuple[Any, ...]]:
        while True:
            received = self._receive_from_bridge()
            if received is None:
                continue
            number, message = received
            if number is None:
                return received
            # Recipes are pickles of this version's classes, and results must have this version's
            # bits.
            if message[0] == "started" and message[1] != version("bridgegen"):
                raise InputError(
                    f"{self._where} must have bridgegen {version('bridgegen')}, as this machine "
                    f"has, got {message[1]}"
                )
            if message[0] == "died":
                self._reasons[number], self._has_lost_actors = message[1], True
            return number, message

    def _missing(self, chunks: int) -> int:
        """See `WorkerPool`; if not all actors have room, only Ray knows which of them have."""
        if chunks and (self._has_lost_actors or self._actors > self._capacity):
            return self._actors - len(self._workers)
        return super()._missing(chunks)

    def _start_worker(self) -> int:
        # A new number at each start, and an old slot if one is free: messages that come late for an
        # earlier number are then nobody's, and the actor of the slot is used again.
        number, taken = next(self._numbers), set(self._slots.values())
        slot = next(item for item in itertools.count() if item not in taken)
        self._slots[number] = slot
        self._request(RayBridge.start_worker, number, slot)
        return number

    def _ping(self, worker: int) -> None:
        self._request(RayBridge.ping, worker)

    def _prepare(self, worker: int, recipe: Recipe) -> None:
        self._request(RayBridge.prepare, worker, recipe)

    def _run(self, worker: int, key: str, work: Work, X: Float, args: tuple[Any, ...]) -> None:
        self._request(RayBridge.run, worker, key, work, X, args)

    def _release(self, worker: int) -> str:
        self._slots.pop(worker, None)
        self._request(RayBridge.release, worker)
        return self._reasons.pop(worker, "")

    def _request(self, method: Callable[[RayBridge, *Args], None], *args: *Args) -> None:
        if self._bridge is not None:
            self._bridge.ask(method, *args)

    @property
    def _where(self) -> str:
        return f"the Ray cluster at {self._address}" if self._address else "the Ray cluster"

    def _last_error(self) -> str:
        """Return the last line of the bridge's standard error: Ray says there why it ended it."""
        if self._log is None:
            return "its connection ended"
        self._log.seek(0)
        lines = self._log.read().decode("utf-8", "replace").strip().splitlines()
        lines = [line for line in lines if "[state-dump]" not in line]
        if not lines:
            return "its connection ended"
        _, _, reason = lines[-1].rpartition("] ")
        return re.sub(r"^\S+:\d+: ", "", reason).partition(". ")[0]  # without Ray's source line
