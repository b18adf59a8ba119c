"""BridgeGen's end of the protocol: asks a driver in another process, instant by instant."""

import time
from collections.abc import Callable
from dataclasses import replace
from functools import partial
from importlib.metadata import version
from typing import Any

from bridgegen.base.errors import InputError
from bridgegen.base.processes.isolated import Answer, CallError
from bridgegen.drivers.address import Command, Grpc, address_of
from bridgegen.drivers.interface import BatchDriver, Control, Observation, Scene, Trajectory
from bridgegen.drivers.remote.egodriver import Calls, Egodriver
from bridgegen.drivers.remote.messages import (
    NONSENSE,
    PROTOCOL,
    RAISED,
    Message,
    ProtocolError,
    is_json,
    pack,
    pack_json,
    unpack,
)
from bridgegen.drivers.remote.wire import ClosedError, Wire, connected, one_line
from bridgegen.drivers.user_drivers import NAMES, Traits
from bridgegen.drivers.views import MapSender

# A server cannot be started from here. A thousand rows that fail because nobody listens would say
# nothing about the driver, so the job ends; what is evaluated is kept, and `resume` goes on to the
# same bits.
AGAIN_SECONDS = 10.0
"""Time for which a server that has answered before is tried again [s]: it may be starting again."""

MAX_ITEMS = 1024
"""Largest number of elements of the lists and maps of an answer."""

_PAUSE = 0.1
_TRAJECTORY = ("time", "x", "y", "h", "v")


class RemoteDriver:
    """A driver at the other end of a connection; its time limit is set before each call.

    Args:
        wire: the connection, on which the driver has been greeted.
        said: what the driver says of itself.
        error: is raised if a call is not answered.
    """

    def __init__(self, wire: Wire, said: Message, error: type[CallError]) -> None:
        self.wants, self.period, self.max_rows = (said.get(name) for name in NAMES)
        self.seconds = 0.0
        self._wire, self._error = wire, error
        self._maps = MapSender() if said.get("keeps_maps") is True else None

    def reset(self, n: int, scene: Scene) -> None:
        """See `BatchDriver`.

        Raises:
            CallError: it was not answered.
        """
        message: Message = {"type": "reset", "n": n, "scene": scene}
        if self._maps is not None and scene.maps:
            sent = self._maps.send(scene.maps)
            message["scene"] = replace(scene, maps=())
            message["maps"] = {"kept": sent.kept, "new": sent.new, "numbers": sent.numbers}
        self._ask(message, partial(_expect, "ready"))

    def act(self, observation: Observation) -> Control | Trajectory:
        """See `BatchDriver`.

        Raises:
            CallError: it was not answered.
        """
        answer: Control | Trajectory = self._ask(
            {"type": "act", "observation": observation}, _control
        )
        return answer

    def _ask(self, message: Message, take: Callable[[Message], Any]) -> Any:
        try:
            return take(exchange(self._wire, message, self.seconds, self._error))
        except ProtocolError as error:
            raise self._error(NONSENSE, str(error)) from None


class RemoteProcess:
    """A driver in another process and language; its like in Python is `isolated.IsolatedProcess`.

    Args:
        spec: ``connect:HOST:PORT``, ``unix:PATH``, ``exec:COMMAND``, ``egodriver://HOST:PORT``.
        error: is raised if a call is not answered.
        answering: returns what a driver says of itself, and the function that answers requests.

    Raises:
        InputError: no such address can be.
    """

    def __init__(
        self,
        spec: str,
        error: type[CallError],
        answering: Callable[[BatchDriver], tuple[Traits, Answer]],
    ) -> None:
        self._spec, self._error, self._answering = spec, error, answering
        self._address = address_of(spec)
        self._wire: Wire | Calls | None = None
        self._was_there = False

    @property
    def runs(self) -> bool:
        """Whether it has been started and not closed since."""
        return self._wire is not None and self._wire.is_open

    def start(self, seconds: float) -> Traits:
        """Connect to the process, or start it, and greet it; return what it says of itself.

        Args:
            seconds: time limit [s].

        Raises:
            InputError: it cannot be reached, or it does not speak this protocol.
        """
        is_command = isinstance(self._address, Command)
        try:
            self._wire = self._connected()
            self._driver = self._greeted(self._wire, seconds)
            traits, self._answer = self._answering(self._driver)
        except (CallError, InputError, ProtocolError) as error:
            self.close()
            hint = ""
            if is_command and isinstance(error, ProtocolError):
                hint = " (its standard output is for messages; print to the standard error)"
            elif self._was_there and not is_command:
                hint = "; start it again, and resume what has begun"
            what = "does not start" if is_command else "does not answer"
            raise InputError(f"the driver '{self._spec}' {what}: {error}{hint}") from None
        self._was_there = True
        return traits

    def ask(self, *request: Any, seconds: float, progress: Callable[[], int] | None = None) -> Any:
        """Return the answer to a request; the process must run.

        Args:
            request: "reset" or "act", and its arguments.
            seconds: time limit [s].
            progress: is of no use here.

        Raises:
            CallError: it was not answered. The connection has ended, unless the driver reports an
                error or answers a message that is none.
        """
        self._driver.seconds = seconds
        return self._answer(*request)

    def kill(self) -> None:
        """End the connection from another thread: a waiting ``ask`` raises `CallError`."""
        if self._wire is not None:
            self._wire.kill()

    def close(self) -> None:
        """End the connection, and the process of a command."""
        if self._wire is not None:
            self._wire.close()

    def _connected(self) -> Wire | Calls:
        """Connect; wait a little for a server that has been there."""
        deadline = time.monotonic() + AGAIN_SECONDS
        while True:
            try:
                if isinstance(self._address, Grpc):
                    return Calls(self._address, self._error)
                return connected(self._address)
            except InputError:
                if not self._was_there or time.monotonic() > deadline:
                    raise
            time.sleep(_PAUSE)

    def _greeted(self, wire: Wire | Calls, seconds: float) -> RemoteDriver | Egodriver:
        """Greet a driver that has just been connected to; return it."""
        if isinstance(wire, Calls):
            return Egodriver(wire, seconds)
        hello = {"type": "hello", "protocol": PROTOCOL, "software": _software()}
        said = exchange(wire, hello, seconds, self._error)
        _expect("hello", said)
        _refuse_version(said)
        return RemoteDriver(wire, said, self._error)


def exchange(wire: Wire, message: Message, seconds: float, error: type[CallError]) -> Message:
    """Send a message, return the answer; the connection is closed if none comes that can be read.

    Args:
        wire: the connection.
        message: to send.
        seconds: time limit [s].
        error: is raised if there is no answer.

    Raises:
        CallError: timed out, the connection is closed, or the driver reports an error.
        ProtocolError: what came is no message.
    """
    try:
        data = wire.ask((pack_json if wire.is_json else pack)(message), seconds)
        wire.is_json = is_json(data)
        answer = unpack(data, MAX_ITEMS)
        # One answer to one message: else each answer from here on would be the one before.
        if wire.has_more:
            raise ProtocolError("more than one message came as an answer")
    except TimeoutError:
        wire.close()
        raise error("timed out", f"no answer within {seconds:g} s") from None
    except ClosedError:
        raise error("died", wire.end()) from None
    except ProtocolError:
        wire.close()
        raise
    if answer["type"] == "error":
        kind = NONSENSE if answer.get("kind") == NONSENSE else RAISED
        raise error(kind, one_line(str(answer.get("message", ""))))
    return answer


def _software() -> str:
    return f"BridgeGen {version('bridgegen')}"


def _expect(kind: str, answer: Message) -> None:
    """Raise an error unless a message is of a type.

    Raises:
        ProtocolError: it is not.
    """
    if answer["type"] != kind:
        raise ProtocolError(f"the answer must be of type '{kind}', got {_short(answer['type'])}")


def _refuse_version(said: Message) -> None:
    """Refuse a driver that speaks another version of the protocol.

    Raises:
        InputError: it does.
    """
    spoken = said.get("protocol")
    if type(spoken) is not int or spoken != PROTOCOL:
        raise InputError(
            f"it speaks version {_short(spoken)} of the protocol, {_software()} speaks {PROTOCOL}"
        )


def _control(answer: Message) -> Control | Trajectory:
    """Return the control or the trajectory of an answer.

    Raises:
        ProtocolError: it is neither.
    """
    if answer["type"] == "trajectory":
        return Trajectory(*(_array(answer, name) for name in _TRAJECTORY))
    if answer["type"] != "control":
        raise ProtocolError(
            f"the answer must be of type 'control' or 'trajectory', got {_short(answer['type'])}"
        )
    demand = _array(answer, "demand") if answer.get("demand") is not None else None
    return Control(_array(answer, "acceleration"), _array(answer, "curvature"), demand)


def _array(answer: Message, name: str) -> Any:
    found = answer.get(name)
    if not hasattr(found, "dtype"):
        raise ProtocolError(f"'{name}' of the answer must be an array, got {_short(found)}")
    return found


def _short(value: Any) -> str:
    return one_line(repr(value))[:80]
