"""A user's driver in a process of its own, so that it cannot end a search.

A driver that raises, times out or crashes its process costs only the row that it was driving: the
process is ended, and another is started for the next batch.
"""

import os
import sys
import time
import traceback
from collections import deque
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.base.plugins import module_of
from bridgegen.base.processes.child import ONE_THREAD
from bridgegen.base.processes.isolated import Answer, CallError, IsolatedProcess, serve
from bridgegen.drivers.address import is_remote
from bridgegen.drivers.compiled import CompiledDriver
from bridgegen.drivers.drivers import TIME_LIMIT, is_spec
from bridgegen.drivers.interface import BatchDriver, Control, Observation, Scene, Trajectory
from bridgegen.drivers.remote.process import RemoteProcess
from bridgegen.drivers.trajectory import Plans, checked_plans
from bridgegen.drivers.tunable import Settings, checked_tunable, values_of
from bridgegen.drivers.user_drivers import NAMES, Traits, traits_of
from bridgegen.drivers.views import MapSender, Viewer, Views

START_SECONDS = 120.0
"""Time limit [s] to import and construct a driver, which may load a network."""

TIMED_CALLS = 10_000
"""Calls whose duration is kept."""


class DriverError(CallError):
    """A driver did not answer, or its answer is invalid.

    Attributes:
        kind: "raised", "timed out", "died" or "answered nonsense".
    """


class DriverProcess:
    """A driver that runs in another process, which starts when it is first needed.

    Args:
        spec: ``package.module:Class``, ``file.py:Class``, the same of a compiled driver's function,
            a co-simulation unit, ``file.fmu``; or a driver in a process of the user's own, see
            `bridgegen.drivers.remote`.
        time_limit: seconds that a call may take.
        settings: values of its tunable numbers.

    Attributes:
        settings: likewise; new ones hold from the next call on.
        traits: what the driver says of itself. Known when the process has started.
        answers_each_row: whether it has answered several rows at once in the right shape.
        answers: what it has answered so far: "control", "trajectory" or both.
        asked_at: the time of the last observation that it was shown [s].
        call_seconds: how long its last calls took [s], the way there and back included.
    """

    traits: Traits
    answers_each_row: bool = False

    def __init__(self, spec: str, time_limit: float = TIME_LIMIT, settings: Settings = ()) -> None:
        if not 0.0 < time_limit < float("inf"):
            raise InputError(f"a driver's time limit [s] must be > 0 and finite, got {time_limit}")
        if not is_spec(spec):
            raise InputError(
                "a driver is named package.module:Class, file.py:Class, file.fmu, "
                "connect:HOST:PORT, unix:PATH, exec:COMMAND or egodriver://HOST:PORT; "
                f"got '{spec}'"
            )
        self.spec = spec
        self.time_limit = time_limit
        self.settings = settings
        self._set: Settings = ()  # those that the process has
        self.answers: set[str] = set()
        self.asked_at = 0.0
        self.call_seconds: deque[float] = deque(maxlen=TIMED_CALLS)
        self._process: IsolatedProcess | RemoteProcess
        if is_remote(spec):
            self._process = RemoteProcess(spec, DriverError, answering_of)
        else:
            # Threads change how products round, and slow a small network down.
            # What the user has set stays.
            own = {name: n for name, n in ONE_THREAD.items() if name not in os.environ}
            self._process = IsolatedProcess(
                "bridgegen.drivers.driver_process", [spec], DriverError, own
            )

    def start(self) -> None:
        """Start the process, if it is not running, construct the driver in it, and set its numbers.

        Raises:
            InputError: there is no such module or class, it cannot be constructed, or has no such
                settings.
        """
        if not self._process.runs:
            self._begin()
        if self.settings != self._set:
            values = values_of(self.traits.tunable, self.settings, self.spec)
            self._process.ask("set", values, seconds=self.time_limit)
            self._set = self.settings

    def _begin(self) -> None:
        self._set = ()
        self._maps = MapSender()
        try:
            self.traits = self._process.start(START_SECONDS)
        except DriverError as error:
            raise InputError(f"the driver '{self.spec}' cannot be made: {error}") from None

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`.

        Raises:
            DriverError: it raised, timed out or died.
            InputError: it cannot be made.
        """
        self.start()
        sent = self._maps.send(scene.maps) if scene.maps else None
        # Maps go once, then their numbers: Town05 is 5.7 MB, and a batch that is halved would send
        # it again.
        scene = replace(scene, maps=())
        self._process.ask("reset", n, scene, sent, seconds=self.time_limit)

    def act(
        self, observation: Observation, views: Views | None = None
    ) -> tuple[Float, ...] | Plans:
        """Return its control or its plans, see `checked`.

        Args:
            observation: without what the driver wants.
            views: what it wants, for `Viewer.complete`.

        Raises:
            DriverError: it raised, timed out, died, or its answer is invalid: another shape, NaN or
                an infinite value for a scenario that is running, or a trajectory that
                `checked_plans` refuses.
        """
        self.asked_at, start = observation.time, time.perf_counter()
        answer: tuple[Float, ...] | Plans = self._process.ask(
            "act", observation, views or {}, seconds=self.time_limit
        )
        self.call_seconds.append(time.perf_counter() - start)
        # It has been checked: another shape would have raised.
        self.answers_each_row = self.answers_each_row or len(observation.x) > 1
        self.answers.add("trajectory" if isinstance(answer, Plans) else "control")
        return answer

    def call(
        self,
        function: Callable[..., Any],
        *arguments: Any,
        progress: Callable[[], int] | None = None,
        seconds: float | None = None,
    ) -> Any:
        """Call a function in the process, with the compiled driver's address first.

        Args:
            function: importable by its name.
            arguments: its further arguments.
            progress: returns a number that changes as it proceeds; the limit is for each change.
            seconds: the limit; the driver's by default.

        Raises:
            DriverError: it raised, timed out or died.
            InputError: the driver cannot be made.
        """
        self.start()
        limit = seconds or self.time_limit
        return self._process.ask("call", function, *arguments, progress=progress, seconds=limit)

    def kill(self) -> None:
        """End the process from another thread; pending calls raise a `DriverError`."""
        self._process.kill()

    def close(self) -> None:
        """End the process, if it is running; deleting this object does so too."""
        self._process.close()


# --- In the other process -------------------------------------------------------------------------


def make(spec: str) -> BatchDriver | CompiledDriver:
    """Construct a driver.

    Raises:
        InputError: no such module, file or class, or the class lacks ``reset`` or ``act``; or a
            function that is not a compiled driver, or that cannot be compiled.
    """
    if spec.endswith(".fmu"):
        from bridgegen.drivers.fmu import fmu_driver

        return fmu_driver(spec)
    where, _, name = spec.rpartition(":")
    try:
        # In the driver's own process. Only what a person has typed comes here: a name in a file or
        # folder is never imported.
        module = module_of(where)
    except ImportError as error:
        raise InputError(f"{where} cannot be imported: {error}") from error
    found = getattr(module, name, None)
    if isinstance(found, CompiledDriver):
        assert found.address  # it compiles
        return found
    if not isinstance(found, type):
        raise InputError(f"{where} must have a class, or a compiled driver, '{name}'")
    lacking = [item for item in ("reset", "act") if not callable(getattr(found, item, None))]
    if lacking:
        raise InputError(f"{name} must have the methods reset and act, lacks {', '.join(lacking)}")
    driver: BatchDriver = found()
    return driver


def checked(answer: Any, seen: Observation, period: float) -> tuple[Float, ...] | Plans:
    """Return a driver's answer: plans, or arrays ``(N,)``, 0 where a scenario has ended.

    These are its acceleration [m/s²] and curvature [1/m], and, if it says so, 1 where it demands a
    transition and 0 where it does not.

    Args:
        answer: of ``act``.
        seen: what it was asked about.
        period: the time until it is asked again [s].

    Raises:
        DriverError: another shape, not numbers, not finite, or a trajectory that cannot be driven.
    """
    if isinstance(answer, Trajectory):
        try:
            return checked_plans(answer, seen, period)
        except InputError as error:
            raise DriverError("answered nonsense", str(error)) from None
    running = seen.running
    pair = (answer.acceleration, answer.curvature) if isinstance(answer, Control) else answer
    try:
        acceleration, curvature = pair
        arrays = [np.asarray(buffer, dtype=np.float64) for buffer in (acceleration, curvature)]
        if isinstance(answer, Control) and answer.demand is not None:
            arrays.append(np.asarray(answer.demand, dtype=np.bool_).astype(np.float64))
    except (TypeError, ValueError) as error:
        text = f"act must return a Control, (acceleration, curvature) or a Trajectory: {error}"
        raise DriverError("answered nonsense", text) from None
    for what, array in zip(("acceleration", "curvature", "demand"), arrays, strict=False):
        if array.shape != running.shape:
            raise DriverError(
                "answered nonsense",
                f"{what} must have the shape {running.shape}, got {array.shape}",
            )
        bad = running & ~np.isfinite(array)
        if bad.any():
            raise DriverError("answered nonsense", f"{what} must be finite, got {array[bad][0]}")
    return tuple(np.where(running, array, 0.0) for array in arrays)


def answering(spec: str) -> tuple[Traits, Answer]:
    """Construct a driver; return what it says of itself, and its answering function."""
    driver = make(spec)
    if isinstance(driver, CompiledDriver):
        address = driver.address

        def call(what: str, first: Any, *arguments: Any) -> Any:
            return driver.set(first) if what == "set" else first(address, *arguments)

        return Traits(memory=driver.memory, wants=driver.wants, tunable=driver.tunable), call

    return answering_of(driver)


def answering_of(driver: BatchDriver) -> tuple[Traits, Answer]:
    """Return what a driver says of itself, and the function that answers requests to it."""
    traits = traits_of({name: getattr(driver, name, None) for name in NAMES})
    owner: Any = driver
    if tunable := checked_tunable(getattr(driver, "tunable", None)):
        traits = replace(traits, tunable=tunable)
        owner.settings = values_of(tunable, (), "")
    viewer = Viewer(traits.wants)
    period = 0.0

    def answer(what: str, *rest: Any) -> Any:
        nonlocal period
        if what == "set":
            owner.settings = dict(*rest)
            return None
        if what == "reset":
            period = traits.steps(rest[1].time_step) * rest[1].time_step
            driver.reset(rest[0], viewer.reset(*rest))
            return None
        observation = viewer.complete(*rest)
        return checked(driver.act(observation), observation, period)

    return traits, answer


def _described(error: Exception) -> str:
    """Return an exception in one line, with the driver's line that raised it."""
    if isinstance(error, InputError):
        return str(error)
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"


if __name__ == "__main__":
    serve(partial(answering, sys.argv[1]), _described)
