"""Actors of a Ray cluster, on as many machines as it has."""

import importlib.util
import itertools
import queue
import re
import tempfile
from importlib.metadata import version
from typing import IO, Any

from bridgegen.arrays import Float
from bridgegen.errors import InputError, WorkersError
from bridgegen.workers.crew import Crew
from bridgegen.workers.process import Process, Said
from bridgegen.workers.recipe import Recipe
from bridgegen.workers.workers import Part, Portable


class Cluster(Crew[int]):
    """`Workers` in a Ray cluster: one for each of its cores, or of its graphics cards.

    Args:
        address: of the cluster: "ray://HOST:PORT" from outside of it, "HOST:PORT" on a machine of
            it; None is the one that RAY_ADDRESS names, or that this machine belongs to.

    Raises:
        InputError: Ray is not installed.
    """

    are_here = False

    def __init__(self, address: str | None) -> None:
        super().__init__()
        if importlib.util.find_spec("ray") is None:
            raise InputError(
                "workers in a cluster need the extra 'ray': pip install 'bridgegen[ray]'"
            )
        self._address = address
        self._gate: Process | None = None
        self._said: Said = queue.SimpleQueue()
        self._numbers = itertools.count()
        self._places: dict[int, int] = {}
        self._reasons: dict[int, str] = {}
        self._log: IO[bytes] | None = None
        self._device, self._room, self._has_joined = "CPU", 0, False
        self._actors, self._has_lost = 0, False

    @property
    def count(self) -> int:
        """See `Workers`: as many as the cluster has room for now."""
        return max(1, self._room)

    def map(self, portable: Portable, work: str, X: Float, *given: Any) -> list[Part]:
        """See `Workers`."""
        if self._gate is None or portable.device != self._device:
            self.close()
            self._device = portable.device
            self._join()
        return super().map(portable, work, X, *given)

    def close(self) -> None:
        """See `Workers`; the actors, which are all campaigns', end when they have been idle."""
        super().close()
        if self._gate is not None:
            self._gate.end()
            self._gate, self._room, self._has_joined = None, 0, False
            self._actors, self._has_lost = 0, False
        if self._log is not None:
            self._log.close()
            self._log = None

    def _join(self) -> None:
        """Connect to the cluster.

        Raises:
            WorkersError: there is none there, or none with room for a worker.
        """
        self._log = tempfile.TemporaryFile()  # noqa: SIM115 (``close`` does)
        self._gate = Process(self._said, "bridgegen.workers.gate", self._log)
        self._gate.ask("join", self._address, self._device)
        try:
            while not self._has_joined:
                self._said_by_gate()
            if not self._room:
                raise WorkersError(f"{self._where} has no {self._device} for workers")
        except BaseException:
            self.close()
            raise

    def _said_by_gate(self) -> tuple[int, tuple[Any, ...]] | None:
        """Take what the gate says next; return it if it is about a worker."""
        gate, (who, *rest) = self._said.get()
        if gate is not self._gate:
            return None  # an earlier one's last words
        if who == "joined":
            self._room, actors = rest
            self._actors, self._has_joined = max(actors, self._actors, self._room), True
        elif who == "lost":
            hint = (
                ""
                if self._address
                else "; 'ray start --head' begins one, ray://HOST:PORT names one"
            )
            raise WorkersError(f"{self._where} cannot be reached: {rest[0]}{hint}")
        elif who == "died":
            raise WorkersError(f"{self._where} is lost: {self._last_words()}")
        elif who != "begun":
            return who, rest[0]
        return None

    def _hear(self) -> tuple[int, tuple[Any, ...]]:
        while True:
            heard = self._said_by_gate()
            if heard is None:
                continue
            number, said = heard
            if said[0] == "begun" and said[1] != version("bridgegen"):
                raise InputError(
                    f"{self._where} must have bridgegen {version('bridgegen')}, as this machine "
                    f"has, got {said[1]}"
                )
            if said[0] == "died":
                self._reasons[number], self._has_lost = said[1], True
            return number, said

    def _missing(self, chunks: int) -> int:
        """See `Crew`; of actors that have no room for them all, Ray alone knows which have some."""
        if chunks and (self._has_lost or self._actors > self._room):
            return self._actors - len(self._posts)
        return super()._missing(chunks)

    def _hire(self) -> int:
        number, taken = next(self._numbers), set(self._places.values())
        place = next(one for one in itertools.count() if one not in taken)
        self._places[number] = place
        self._ask("hire", number, place)
        return number

    def _greet(self, hand: int) -> None:
        self._ask("greet", hand)

    def _prepare(self, hand: int, recipe: Recipe) -> None:
        self._ask("prepare", hand, recipe)

    def _work(self, hand: int, key: str, work: str, X: Float, given: tuple[Any, ...]) -> None:
        self._ask("work", hand, key, work, X, given)

    def _dismiss(self, hand: int) -> str:
        self._places.pop(hand, None)
        self._ask("dismiss", hand)
        return self._reasons.pop(hand, "")

    def _ask(self, *request: Any) -> None:
        if self._gate is not None:
            self._gate.ask(*request)

    @property
    def _where(self) -> str:
        return f"the Ray cluster at {self._address}" if self._address else "the Ray cluster"

    def _last_words(self) -> str:
        """Return what the gate wrote last: Ray says there why it ends a process."""
        if self._log is None:
            return "its connection ended"
        self._log.seek(0)
        lines = self._log.read().decode("utf-8", "replace").strip().splitlines()
        said = [line for line in lines if "[state-dump]" not in line]
        if not said:
            return "its connection ended"
        _, _, told = said[-1].rpartition("] ")
        return re.sub(r"^\S+:\d+: ", "", told).partition(". ")[0]  # without Ray's own source line
