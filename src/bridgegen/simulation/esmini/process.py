"""A process in which esmini runs scenarios, one after the other, with BridgeGen's driver.

esmini has global state, and may hang, crash or end its process.
"""

import sys
from collections.abc import Callable, Mapping
from functools import cache, partial
from pathlib import Path
from shutil import rmtree
from typing import TYPE_CHECKING, Any, NamedTuple

from bridgegen.base.errors import BridgeGenError, InputError, StorageError
from bridgegen.base.processes.isolated import Answer, CallError, IsolatedProcess, serve
from bridgegen.simulation.esmini.library import Library

if TYPE_CHECKING:
    from bridgegen.drivers import Driver
    from bridgegen.simulation.embedded.places.network import Network
    from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
    from bridgegen.simulation.embedded.user_drivers import Layout
    from bridgegen.simulation.esmini.files import RoadFiles, ScenarioFile
    from bridgegen.simulation.rollout import Rollout

# --- What esmini writes about a scenario: it may fail, and say so nowhere else ---


_MARK = "[error] "
_REMARK = "INFO: "  # esmini marks elements of a map that it skips as errors, with this word
_LONGEST = 300


def error_in(log: Path) -> str | None:
    """Return the first error in a log; None if there is none, or no log.

    Warnings are ignored, and remarks on elements of the map that esmini does not draw: it warns of
    missing 3D models, for example.
    """
    try:
        text = log.read_text(encoding="utf-8", errors="replace")
    except OSError:
        return None
    for line in text.splitlines():
        _, mark, said = line.partition(_MARK)
        if mark and not said.startswith(_REMARK):
            return said.strip()[:_LONGEST]
    return None


PROGRAM = "bridgegen.simulation.esmini.process"
"""The module that the process runs: this one."""

START_SECONDS = 60.0
"""Time limit for loading the library [s]."""

WARM_SECONDS = 900.0
"""Time limit for the compilation of kernels [s]."""

LOG, SCENARIO = "esmini.log", "row.xosc"
"""Files of the current row in the folder of the process."""


class Job(NamedTuple):
    """The data that all rows of a simulator share.

    Attributes:
        embedded: the storyboard and the driver in the embedded simulator.
        scenario: the storyboard for esmini.
        driven: the numbers of the entities with drivers of BridgeGen.
        steps: steps of esmini per time step of the scenario.
    """

    embedded: "EmbeddedSimulator"
    scenario: "ScenarioFile"
    driven: tuple[int, ...]
    steps: int


class EsminiRow(NamedTuple):
    """The data of one row.

    Attributes:
        network: the number of its road network.
        values: its parameters.
        driver: another driver, or None.
        dry: whether the road is dry.
    """

    network: int
    values: Mapping[str, float]
    driver: "Driver | None"
    dry: bool


class EsminiProcess:
    """A process that runs rows; this is the side of its parent.

    Args:
        library: path of esmini's library.
        job: what it runs.
        seconds: time limit for a step of esmini, and for loading a scenario [s].

    Attributes:
        version: of esmini.
    """

    def __init__(self, library: Path, job: Job, seconds: float) -> None:
        from bridgegen.simulation.embedded.user_drivers import SharedArrays
        from bridgegen.simulation.esmini.files import Folder

        self._job, self._seconds = job, seconds
        self._folder = Folder()
        self._process = IsolatedProcess(PROGRAM, [str(library), str(self._folder.path)])
        self._shared = SharedArrays()
        self._roads: object = None  # those that the process has
        self._is_warm = False
        self.version = ""

    def start(self) -> None:
        """Start the process, if it is not running.

        Raises:
            InputError: the library is not a usable esmini library.
        """
        import numpy as np

        if self._process.runs:
            return
        try:
            self.version = self._process.start(START_SECONDS)
        except CallError as error:
            raise InputError(str(error)) from None
        self._layout, (self._beats,) = self._shared.put([np.zeros(1, dtype=np.int64)])
        self._roads, self._is_warm = None, False
        self._process.ask("take", self._job, self._layout, seconds=START_SECONDS)

    def run(self, roads: "tuple[Network, RoadFiles]", row: EsminiRow) -> "Rollout":
        """Return the rollout of a row.

        Raises:
            InputError: the library, or the user's driver, is not usable.
            StorageError: its files cannot be written.
            CallError: the process ended, or did not answer in time.
        """
        self.start()
        sent = None if self._roads is roads else roads
        self._roads = None  # until the process has confirmed them
        try:
            if not self._is_warm:
                self._process.ask("warm", sent, row.network, seconds=WARM_SECONDS)
                sent, self._is_warm = None, True
            # One request is one row, so that what goes wrong costs that row. The counter says that
            # it gets on, so the limit is for an instant.
            rollout: Rollout = self._process.ask(
                "run", sent, row, seconds=self._seconds, progress=lambda: int(self._beats[0])
            )
        except CallError as error:
            if error.kind in REFUSALS:
                raise REFUSALS[error.kind](str(error)) from None
            if problem := error_in(self._folder.path / LOG):
                raise type(error)(error.kind, f"{error}; its log: {problem}") from None
            raise
        self._roads = roads
        return rollout

    def kill(self) -> None:
        """End the process from another thread."""
        self._process.kill()


# --- In the esmini process ------------------------------------------------------------------------

REFUSALS: dict[str, type[BridgeGenError]] = {
    function.__name__: function for function in (InputError, StorageError)
}
"""Errors that are passed to the user unchanged, whichever process raises them."""


LEFT: set[Path] = set()
"""Folders, and a file, to remove when the parent process has ended."""


def clear() -> None:
    """Remove the files that a killed parent process left behind."""
    for path in LEFT:
        if path.is_dir():
            rmtree(path, ignore_errors=True)
        else:
            path.unlink(missing_ok=True)


def answering(path: str, folder: str) -> tuple[str, Answer]:
    """Load the library; return its version, and the function that answers requests."""
    library = Library(Path(path))
    return library.version, Answers(library, Path(folder)).answer


class Answers:
    """Answers the requests to the process.

    Args:
        library: of esmini.
        folder: for its files.
    """

    def __init__(self, library: Library, folder: Path) -> None:
        self._library, self._folder = library, folder
        LEFT.add(folder)

    def answer(self, what: str, *rest: Any) -> Any:
        """Answer a request: take a job, warm up for it, or run a row of it."""
        answers: dict[str, Answer] = {"take": self._take, "warm": self._warm, "run": self._run}
        try:
            return answers[what](*rest)
        except tuple(REFUSALS.values()) as error:
            kind = next(name for name, refusal in REFUSALS.items() if isinstance(error, refusal))
            raise CallError(kind, str(error)) from None

    def _take(self, job: Job, layout: "Layout") -> None:
        from bridgegen.simulation.embedded.user_drivers import seen

        self._job, (self._beats,) = job, seen(layout)
        LEFT.add(Path(layout.path))
        self._events = job.scenario.event_paths()

    def _hold(self, roads: "tuple[Network, RoadFiles] | None") -> None:
        if roads is not None:
            self._network, files = roads
            LEFT.update(path.parent for path in files.paths)
            self._template = cache(partial(_template, self._job.scenario, files))

    def _warm(self, roads: "tuple[Network, RoadFiles] | None", network: int) -> None:
        """Compile or load the kernels that a row needs; esmini's time limit excludes it."""
        from bridgegen.drivers import DRIVERS

        self._hold(roads)
        embedded = self._job.embedded
        driver = DRIVERS["route-follower"] if embedded.program.driver.is_own else None
        joint = embedded.co_simulation(self._network, network, {}, driver=driver)
        for k in range(2):
            joint.impose(k, [0], joint.states(k)[:1])
            joint.decide(k)
            if joint.is_through or not joint.runs:
                return
            joint.move(k, *joint.demand(k))

    def _run(self, roads: "tuple[Network, RoadFiles] | None", row: EsminiRow) -> "Rollout":
        from bridgegen.drivers.driver_process import DriverError
        from bridgegen.simulation.esmini.together import EsminiError, run_together
        from bridgegen.simulation.rollout import FAILURES, SIMULATOR_FAILURES

        self._hold(roads)
        job, log, scenario = self._job, self._folder / LOG, self._folder / SCENARIO
        log.unlink(missing_ok=True)
        program = job.embedded.program
        known = {name: value for name, value in row.values.items() if name in program.parameters}
        self._template(row.network).write(scenario, {**program.parameters, **known})
        problem, joint = None, None
        try:
            joint = job.embedded.co_simulation(
                self._network, row.network, row.values, driver=row.driver, dry=row.dry
            )
            if joint.runs:
                run_together(
                    self._library,
                    scenario,
                    log,
                    joint,
                    driven=job.driven,
                    boxes=program.box,
                    events=self._events,
                    steps=job.steps,
                    alive=self._alive,
                )
        except EsminiError as error:
            problem = str(error)
        except DriverError as error:
            return _failed(job, self._network, row, FAILURES[error.kind], str(error))
        logged = error_in(log)
        if logged or problem:
            message = ": ".join(filter(None, (problem, logged)))
            return _failed(job, self._network, row, SIMULATOR_FAILURES["raised"], message)
        assert joint is not None
        return joint.rollout()

    def _alive(self) -> None:
        self._beats[0] += 1


def _template(scenario: "ScenarioFile", files: "RoadFiles", network: int) -> Any:
    course = files.courses[network] if files.courses else {}
    return scenario.on(files.paths[network], course)


def _failed(job: Job, network: "Network", row: EsminiRow, status: int, message: str) -> "Rollout":
    return job.embedded.failed(network, row.network, row.values, status, message)


def main(start: Callable[[str, str], tuple[str, Answer]] = answering) -> None:
    """Serve the library and the folder that the command line names."""
    import os

    nowhere = os.open(os.devnull, os.O_WRONLY)
    serve(partial(start, *sys.argv[1:3]), stdout=nowhere, at_end=clear)


if __name__ == "__main__":
    main()
