"""The server: connection, restart, synchronous mode, and the diagnosis of its failures."""

import os
import signal
import socket
import subprocess
import sys
import tempfile
import threading
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import IO, TYPE_CHECKING

from bridgegen.adapters.carla.settings import TIME_STEP, Access
from bridgegen.adapters.carla.worlds import Worlds
from bridgegen.base.errors import InputError
from bridgegen.simulation.rollout import SIMULATOR_FAILURES

if TYPE_CHECKING:
    import carla

# --- A lock of a server: one scenario runs at a time, of all processes on this machine ---
# Two that ticked one server would each disturb the other's scenarios.


POLL = 0.02
"""Interval between two attempts to get the lock [s]."""


class Turn:
    """A lock against other threads, and by a file against other processes; may be nested.

    Args:
        name: of what it is for.
    """

    def __init__(self, name: str) -> None:
        self._lock, self._depth = threading.RLock(), 0
        user = os.getuid() if hasattr(os, "getuid") else 0
        plain = "".join(item if item.isalnum() else "-" for item in name)
        self._path = Path(tempfile.gettempdir()) / f"bridgegen-{user}-carla-{plain}.lock"
        self._file: IO[str] | None = None

    def __enter__(self) -> None:
        self._lock.acquire()
        self._depth += 1
        if self._depth == 1 and sys.platform != "win32":
            import fcntl

            # `flock` ends with the process, for whatever reason; a lock that is a file's existence
            # would outlive a process that is killed.
            self._file = self._path.open("a")
            while True:
                try:
                    fcntl.flock(self._file, fcntl.LOCK_EX | fcntl.LOCK_NB)
                except BlockingIOError:
                    time.sleep(POLL)
                else:
                    return

    def __exit__(self, *_: object) -> None:
        self._depth -= 1
        if self._depth == 0 and self._file is not None:
            self._file.close()  # which unlocks it
            self._file = None
        self._lock.release()


_turns: dict[str, Turn] = {}


def turn_at(address: str) -> Turn:
    """Return the lock of a server, one per process."""
    return _turns.setdefault(address, Turn(address))


VERSIONS = ("0.9.13", "0.9.14", "0.9.15", "0.9.16")

BACK_OFF = (0.5, 1.0, 2.0, 4.0, 8.0)
"""Waiting times before each further attempt to reach a lost server [s]."""

START_SECONDS = 180.0
"""Time limit for a started server to answer [s]."""

LOAD_SECONDS = 180.0
"""Time limit for loading a world [s]."""

ERROR, DIED, HUNG = (SIMULATOR_FAILURES[name] for name in ("raised", "died", "timed out"))
"""Statuses of rows that failed because of the server."""

MINE = "bridgegen"
"""Prefix of the role names of BridgeGen's actors except the ego."""


class ServerError(Exception):
    """The server failed.

    Args:
        status: `ERROR`, `DIED` or `HUNG`.
        message: what it said.
    """

    def __init__(self, status: int, message: str) -> None:
        super().__init__(message)
        self.status = status


class Server:
    """A CARLA server with the connection to it.

    Args:
        access: where it is.

    Attributes:
        turn: to be had for each row: the server is one scenario's at a time.
        maps: the server's own, by name.
        worlds: what it has loaded.

    Raises:
        InputError: the package is not installed, no server answers, or its version is not
            supported.
    """

    def __init__(self, access: Access) -> None:
        self.access = access
        self.turn = turn_at(access.address)
        self._process: subprocess.Popen[bytes] | None = None
        self._client: carla.Client | None = None
        self._is_down = False
        self._why = ServerError(DIED, "")
        self.maps: list[str] = []
        self.worlds = Worlds()
        self._first_connection()

    @property
    def client(self) -> "carla.Client":
        """The connection.

        Raises:
            ServerError: there is none.
        """
        if self._client is None:
            raise ServerError(DIED, f"no server answers at {self.access.address}")
        return self._client

    @property
    def world(self) -> "carla.World":
        """The loaded world."""
        return self.worlds.world

    @contextmanager
    def stepped(self) -> Iterator[None]:
        """Have the server wait for our ticks of `TIME_STEP`; put settings and weather back after.

        Raises:
            RuntimeError: as CARLA raises them.
        """
        world = self.world
        # Put back after every row, by two calls: a search that is killed between batches leaves no
        # server that waits for ticks which no client sends.
        before, now, weather = world.get_settings(), world.get_settings(), world.get_weather()
        now.synchronous_mode = True
        now.fixed_delta_seconds = TIME_STEP
        try:
            world.apply_settings(now)
            yield
        finally:
            with suppress(RuntimeError):  # then it is gone, and its settings with it
                world.apply_settings(before)
                world.freeze_all_traffic_lights(False)
                world.set_weather(weather)

    def tick(self) -> "carla.WorldSnapshot":
        """Advance the world by one step; return its snapshot."""
        frame = self.world.tick(self.access.timeout)
        snapshot = self.world.get_snapshot()
        # Two clients that tick one server disturb each other without any error of CARLA's.
        if snapshot.frame != frame:
            raise ServerError(
                ERROR,
                f"another client ticks the server: frame {frame} was ours, and it is at "
                f"{snapshot.frame}",
            )
        return snapshot

    def load(self, world: Callable[["carla.Client"], "carla.World"], key: str) -> None:
        """Load a world, unless it is there; see `Worlds`."""
        self.client.set_timeout(max(LOAD_SECONDS, self.access.timeout))
        try:
            self.worlds.load(self.client, world, key)
        finally:
            self.client.set_timeout(self.access.timeout)

    def diagnosis(self, error: RuntimeError | ServerError) -> ServerError:
        """Return the kind of a CARLA error, which has only a text."""
        if isinstance(error, ServerError):
            return error
        text = str(error)
        if not is_listening(self.access):
            return ServerError(DIED, text)
        return ServerError(HUNG if "time-out" in text else ERROR, text)

    def reconnect(self) -> None:
        """Connect again, with several attempts; start the server if a command is known.

        Raises:
            ServerError: it is gone.
        """
        self._client = None
        self.worlds.forget()
        if self._answers():
            return
        waits = () if self._is_down else BACK_OFF  # it has been waited for before
        if self.access.command:
            self._start()
            return
        for seconds in waits:
            time.sleep(seconds)
            if self._answers():
                return
        self._is_down = True
        raise self._why

    def close(self) -> None:
        """End the server, if it was started here."""
        process, self._process = self._process, None
        if process is not None and process.poll() is None:
            _end(process)

    def _first_connection(self) -> None:
        try:
            import carla  # noqa: F401
        except ImportError:
            raise InputError(
                "carla: the package 'carla' must be installed, of the server's version (extra "
                "'carla', for Python up to 3.12)"
            ) from None
        if self._answers():
            return
        if self.access.command:
            try:
                return self._start()
            except ServerError as error:
                raise InputError(f"carla: {error}") from None
        raise InputError(
            f"carla: no server answers at {self.access.address}; start one, or give --host, "
            "--port; --carla-command starts it"
        )

    def _answers(self) -> bool:
        """Connect; return whether a server answers.

        Raises:
            InputError: it is there, in a version that we do not know.
        """
        import carla

        self._why = ServerError(DIED, f"no server answers at {self.access.address}")
        if not is_listening(self.access):  # the client would wait for its whole time
            return False
        try:
            client = carla.Client(self.access.host, self.access.port)
            client.set_timeout(self.access.timeout)
            version = client.get_server_version()
            if not version.startswith(VERSIONS):
                raise InputError(
                    f"carla: the server at {self.access.address} must be CARLA {VERSIONS[0]} to "
                    f"{VERSIONS[-1]}, got {version}"
                )
            self.maps = list(client.get_available_maps())
            with self.turn:  # other actors belong to no row of ours
                self.worlds.take(client.get_world())
                sweep(client, self.world)
        except RuntimeError as error:
            self._why = self.diagnosis(error)
            return False
        self._client, self._is_down = client, False
        return True

    def _start(self) -> None:
        """Start the server with the user's command; wait until it answers.

        Raises:
            ServerError: it ended, or does not answer.
        """
        self.close()
        command = self.access.command
        self._process = subprocess.Popen(
            command,
            shell=True,
            stdin=subprocess.DEVNULL,
            stdout=subprocess.DEVNULL,
            stderr=subprocess.DEVNULL,
            # A session of its own, so that the server and all that its script begins can be ended
            # together.
            start_new_session=True,
        )
        until = time.monotonic() + START_SECONDS
        while time.monotonic() < until:
            if self._answers():
                return
            status = self._process.poll()
            if status not in (None, 0):  # 0: it has put the server into the background
                raise ServerError(DIED, f"'{command}' (--carla-command) ended with status {status}")
            time.sleep(BACK_OFF[0])
        raise ServerError(
            HUNG,
            f"'{command}' (--carla-command) has started no server that answers at "
            f"{self.access.address} within {START_SECONDS:g} s",
        )


def is_listening(access: Access) -> bool:
    """Return whether the server's port is open, which is also true if it hangs."""
    try:
        with socket.create_connection((access.host, access.port), timeout=access.timeout):
            return True
    except OSError:
        return False


def sweep(client: "carla.Client", world: "carla.World") -> None:
    """Destroy the actors that a killed run of BridgeGen left behind.

    Its ego differs from another client's ``hero`` by BridgeGen's sensors on it.
    """
    mine = [
        actor
        for actor in world.get_actors()
        if actor.attributes.get("role_name", "").startswith(MINE)
    ]
    # The ego is called ``hero``, as other clients expect, so its name does not say whose it is.
    egos = {item.parent.id for item in mine if item.parent is not None}
    destroy(client, [*(item.id for item in mine), *egos])


def destroy(client: "carla.Client", actors: list[int]) -> None:
    """Destroy actors; those that no longer exist are ignored."""
    import carla

    if actors:
        client.apply_batch_sync([carla.command.DestroyActor(actor) for actor in actors], False)


def _end(process: "subprocess.Popen[bytes]") -> None:
    """End a process and its descendants."""
    for number in (
        (signal.SIGTERM, signal.SIGKILL) if sys.platform != "win32" else (signal.SIGTERM,)
    ):
        with suppress(ProcessLookupError, PermissionError):
            if sys.platform == "win32":
                process.terminate()
            else:
                os.killpg(process.pid, number)
        with suppress(subprocess.TimeoutExpired):
            process.wait(10.0)
            return
