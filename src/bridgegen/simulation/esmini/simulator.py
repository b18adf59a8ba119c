"""The simulator esmini: each row runs in a process; as many run at a time as there are cores."""

import os
import threading
from collections.abc import Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path
from typing import TYPE_CHECKING, NamedTuple

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import InputError
from bridgegen.base.processes.isolated import CallError
from bridgegen.drivers import STORYBOARD, Driver
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario.model import OpenScenario
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.esmini.files import RoadFiles, ScenarioFile
from bridgegen.simulation.esmini.process import EsminiProcess, EsminiRow, Job
from bridgegen.simulation.rollout import SIMULATOR_FAILURES, Rollout, joined

if TYPE_CHECKING:
    from collections.abc import Iterator

LIBRARY = "ESMINI_LIB"
"""Environment variable with the path of the library, if no option names it."""

RELEASES = "https://github.com/esmini/esmini/releases"
"""Where the esmini project publishes it, in the folder ``bin`` of an archive."""

ROWS = 16
"""Number of rows of a chunk: they share their preparation."""

SECONDS = 30.0
"""Time limit for a step of esmini, and for loading a scenario with its map [s]."""


# More steps take away most of what esmini's rule of integration is off, but conditions are then
# looked at in each of them, so that events begin up to 0.04 s early: no nearer in all.
STEPS = 1
"""Default number of esmini's steps per time step of the scenario."""

MOST_STEPS = 100


def library_of(access: Mapping[str, object]) -> Path:
    """Return the path of the library from the option or the environment.

    Raises:
        InputError: neither is set.
    """
    named = access.get("--esmini-lib") or os.environ.get(LIBRARY)
    if not named:
        raise InputError(
            "the simulator esmini needs its library, libesminiLib.so of esmini 3 "
            f"({RELEASES}): name it by --esmini-lib, or in the environment variable {LIBRARY}"
        )
    return Path(str(named))


def steps_of(settings: Mapping[str, object]) -> int:
    """Return the number of esmini's steps per time step of the scenario.

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
    """Road networks for both simulators.

    Attributes:
        network: for the embedded simulator.
        files: for esmini.
    """

    network: Network
    files: RoadFiles


class EsminiSimulator:
    """A `Simulator`: esmini runs the storyboard, BridgeGen's drivers drive their vehicles.

    If the storyboard moves the ego, esmini's default controller does.

    Args:
        embedded: the embedded one of the same storyboard and driver.
        storyboard: the scenario file, validated.
        library: the path of esmini's library.
        steps: number of its steps per time step of the scenario.
        seconds: time limit for a step, and for loading a scenario [s].

    Attributes:
        embedded: the embedded one.
        version: of esmini.

    Raises:
        InputError: the library does not exist, is not esmini's, or is too old; or a number is out
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
        self.embedded = embedded
        driver = embedded.program.driver
        self._drives = driver != STORYBOARD
        program = embedded.program
        driven = (*((0,) if self._drives else ()), *program.attends.tolist())
        names = [program.names[e] for e in driven]
        slow = driver.time_limit if driver.is_own else 0.0
        self._job = Job(embedded, ScenarioFile(storyboard, names), driven, steps)
        self._library, self._seconds = library, seconds + slow
        self._lock, self._is_stopped = threading.Lock(), threading.Event()
        self._processes: list[EsminiProcess] = []
        self._idle: list[EsminiProcess] = []
        # Started now, so that a library that is none is reported before rows are simulated.
        with self._idle_process() as process:
            process.start()
            self.version = process.version

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
        """See `Simulator`: for the embedded simulator, and as files."""
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
        """See `Simulator`: one row after the other, in a process that only this call uses.

        Raises:
            InputError: see `Simulator`; or the user's driver cannot be created.
            CallError: the simulator has been stopped.
        """
        n = len(rows)
        if n == 0:
            return self.embedded.run(roads.network, rows, values)
        if not (rows.min() >= 0 and rows.max() < roads.network.n_networks):
            raise InputError(f"rows must name one of {roads.network.n_networks} road networks")
        self.embedded.program.fill(values, n)  # checks that all values are finite
        columns = {name: np.broadcast_to(value, n) for name, value in values.items()}
        parts: list[tuple[Int, Rollout]] = []
        with self._idle_process() as process:
            for i, network in enumerate(rows.tolist()):
                taken = {name: float(column[i]) for name, column in columns.items()}
                row = EsminiRow(network, taken, driver, dry)
                parts.append((np.array([i]), self._run_row(process, roads, row)))
        return joined(parts) if n > 1 else parts[0][1]

    def stop(self) -> None:
        """See `Simulator`."""
        self._is_stopped.set()
        with self._lock:
            for process in self._processes:
                process.kill()

    def _run_row(self, process: EsminiProcess, roads: EsminiRoads, row: EsminiRow) -> Rollout:
        try:
            return process.run(roads, row)
        except CallError as error:
            if self._is_stopped.is_set() or error.kind == "raised":  # an error of BridgeGen
                raise
            status = SIMULATOR_FAILURES[error.kind]
            return self.embedded.failed(roads.network, row.network, row.values, status, str(error))

    @contextmanager
    def _idle_process(self) -> "Iterator[EsminiProcess]":
        """Reserve a process."""
        with self._lock:
            if not self._idle:
                self._processes.append(EsminiProcess(self._library, self._job, self._seconds))
                self._idle.append(self._processes[-1])
            process = self._idle.pop()
        try:
            yield process
        finally:
            with self._lock:
                self._idle.append(process)
