"""The simulator esmini: rows by one of its processes each, as many at a time as there are cores."""

import os
import threading
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Float, Int
from bridgegen.ego import STORYBOARD, Driver
from bridgegen.errors import InputError
from bridgegen.isolated import CallError
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.simulation.around import AroundEmbedded
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.esmini.files import RoadFiles, ScenarioFile
from bridgegen.simulation.esmini.seat import Job, Row, Seat
from bridgegen.simulation.rollout import SIMULATOR_FAILURES, Rollout, joined

if TYPE_CHECKING:
    from collections.abc import Iterator

LIBRARY = "ESMINI_LIB"
"""The environment variable that names the library, where nothing else does."""

ROWS = 16
"""Rows that a process runs at a time: they share what is to be made ready for them."""

SECONDS = 30.0
"""esmini may take so long for a step, or to load a scenario with its map."""


STEPS = 1
"""Steps of esmini's that make one of ours, by default."""

MOST_STEPS = 100


def library_of(access: Mapping[str, object]) -> Path:
    """Return the path of the library: what the option says, or the environment.

    Raises:
        InputError: neither says one.
    """
    named = access.get("--esmini-lib") or os.environ.get(LIBRARY)
    if not named:
        raise InputError(
            "the simulator esmini needs its library, libesminiLib.so of esmini 3: name it by "
            f"--esmini-lib, or in the environment variable {LIBRARY}"
        )
    return Path(str(named))


def steps_of(settings: Mapping[str, object]) -> int:
    """Return how many steps of esmini's make one of ours.

    Raises:
        InputError: out of range.
    """
    steps = settings.get("steps", STEPS)
    if isinstance(steps, bool) or not isinstance(steps, int) or not 1 <= steps <= MOST_STEPS:
        raise InputError(
            f"steps of the simulator esmini must be a whole number in 1 to {MOST_STEPS}, got "
            f"{steps}"
        )
    return steps


class EsminiRoads(NamedTuple):
    """Road networks, made ready.

    Attributes:
        network: as ours.
        files: as esmini's.
    """

    network: Network
    files: RoadFiles


class EsminiSimulator(AroundEmbedded):
    """A `Simulator` that has esmini run the storyboard, and our drivers whom they drive.

    Where the storyboard moves the ego, esmini's own controller does.

    Args:
        embedded: the embedded one of the same storyboard and driver.
        storyboard: the scenario file, validated.
        library: the path of esmini's library.
        steps: how many of its steps make one of ours.
        seconds: that it may take for a step, or to load a scenario.

    Attributes:
        embedded: see `Simulator`.
        version: of esmini, as its library says.

    Raises:
        InputError: the library is not there, is none of esmini's, or is too old; or a number is out
            of range.
    """

    def __init__(
        self,
        embedded: EmbeddedSimulator,
        storyboard: OpenScenario,
        library: Path,
        *,
        steps: int,
        seconds: float = SECONDS,
    ) -> None:
        super().__init__(embedded)
        driver = embedded.program.driver
        self._drives = driver != STORYBOARD
        program = embedded.program
        driven = (*((0,) if self._drives else ()), *program.attends.tolist())
        names = [program.names[e] for e in driven]
        slow = driver.time_limit if driver.is_own else 0.0
        self._job = Job(embedded, ScenarioFile(storyboard, names), driven, steps)
        self._library, self._seconds = library, seconds + slow
        self._lock, self._is_stopped = threading.Lock(), threading.Event()
        self._seats: list[Seat] = []
        self._idle: list[Seat] = []
        with self._seat() as seat:
            seat.start()
            self.version = seat.version

    @property
    def rows_at_once(self) -> int:
        """See `Simulator`."""
        return ROWS

    @property
    def runs_at_once(self) -> int:
        """See `Simulator`."""
        return os.cpu_count() or 1

    def roads(
        self, models: Sequence[OpenDrive], courses: Sequence[Mapping[str, Float]] = ()
    ) -> EsminiRoads:
        """See `Simulator`: as the embedded one has them, and as files."""
        return EsminiRoads(self.embedded.roads(models, courses), RoadFiles(models, courses))

    def run(
        self,
        roads: EsminiRoads,
        rows: Int,
        values: Mapping[str, npt.ArrayLike],
        *,
        driver: Driver | None = None,
        dry: bool = False,
    ) -> Rollout:
        """See `Simulator`: one row after the other, in a process of this call's own.

        Raises:
            InputError: see `Simulator`; or a user's driver that cannot be made.
            CallError: it has been stopped.
        """
        n = len(rows)
        if n == 0:
            return self.embedded.run(roads.network, rows, values)
        if not (rows.min() >= 0 and rows.max() < roads.network.n_networks):
            raise InputError(f"rows must name one of {roads.network.n_networks} road networks")
        self.embedded.program.fill(values, n)  # says what is not finite
        columns = {name: np.broadcast_to(one, n) for name, one in values.items()}
        parts: list[tuple[Int, Rollout]] = []
        with self._seat() as seat:
            for i, network in enumerate(rows.tolist()):
                taken = {name: float(column[i]) for name, column in columns.items()}
                row = Row(network, taken, driver, dry)
                parts.append((np.array([i]), self._one(seat, roads, row)))
        return joined(parts) if n > 1 else parts[0][1]

    def stop(self) -> None:
        """See `Simulator`."""
        self._is_stopped.set()
        with self._lock:
            for seat in self._seats:
                seat.kill()

    def _one(self, seat: Seat, roads: EsminiRoads, row: Row) -> Rollout:
        try:
            return seat.run(roads, row)
        except CallError as error:
            if self._is_stopped.is_set() or error.kind == "raised":  # a fault of ours
                raise
            status = SIMULATOR_FAILURES[error.kind]
            return self.embedded.failed(roads.network, row.network, row.values, status, str(error))

    @contextmanager
    def _seat(self) -> "Iterator[Seat]":
        """Lend a process that nobody else uses."""
        with self._lock:
            if not self._idle:
                self._seats.append(Seat(self._library, self._job, self._seconds))
                self._idle.append(self._seats[-1])
            seat = self._idle.pop()
        try:
            yield seat
        finally:
            with self._lock:
                self._idle.append(seat)
