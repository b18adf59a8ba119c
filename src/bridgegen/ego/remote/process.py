"""BridgeGen's end of the protocol: asks a driver in another process, instant by instant."""

import time
from collections.abc import Callable
from importlib.metadata import version
from typing import Any

from bridgegen.ego.address import Command, address_of
from bridgegen.ego.interface import Control, Observation, Scene, Trajectory
from bridgegen.ego.remote.messages import (
    NONSENSE,
    PROTOCOL,
    RAISED,
    Message,
    ProtocolError,
    pack,
    unpack,
)
from bridgegen.ego.remote.wire import ClosedError, Wire, connected
from bridgegen.ego.traits import Traits, traits_of
from bridgegen.errors import InputError
from bridgegen.isolated import CallError

AGAIN_SECONDS = 10.0
"""For so long [s] a server is tried again that has been there: it may be starting again."""

MAX_ITEMS = 1024
"""Most elements of the lists and maps of an answer."""

MAX_MESSAGE = 500
"""Most characters of an error message that are passed on."""

_PAUSE = 0.1
_TRAJECTORY = ("time", "x", "y", "h", "v")


class RemoteProcess:
    """A driver in another process; `bridgegen.isolated.IsolatedProcess` is its like for Python.

    Args:
        spec: ``connect:HOST:PORT``, ``unix:PATH`` or ``exec:COMMAND``.
        error: is raised if a call is not answered.
        checked: returns an answer of ``act`` as the simulator takes it; it is also given which
            scenarios are running.

    Raises:
        InputError: no such address can be.
    """

    def __init__(
        self, spec: str, error: type[CallError], checked: Callable[[Any, Any], Any]
    ) -> None:
        self._spec, self._error, self._checked = spec, error, checked
        self._address = address_of(spec)
        self._wire: Wire | None = None
        self._was_there = False

    @property
    def runs(self) -> bool:
        """Whether it has been started and not closed since."""
        return self._wire is not None

    def start(self, seconds: float) -> Traits:
        """Connect to the process, or start it, and greet it; return what it says of itself.

        Args:
            seconds: time limit [s].

        Raises:
            InputError: it cannot be reached, or it does not speak this protocol.
        """
        deadline = time.monotonic() + seconds
        is_command = isinstance(self._address, Command)
        try:
            self._wire = self._connected()
            hello = {"type": "hello", "protocol": PROTOCOL, "software": _software()}
            answer = self._message(hello, max(deadline - time.monotonic(), 0.0))
            traits = _greeted(answer)
        except (CallError, InputError, ProtocolError) as error:
            self.close()
            hint = ""
            if is_command and isinstance(error, ProtocolError):
                hint = " (its standard output is for messages; print to the standard error)"
            what = "does not start" if is_command else "does not answer"
            raise InputError(f"the driver '{self._spec}' {what}: {error}{hint}") from None
        self._was_there = True
        return traits

    def ask(
        self, what: str, *rest: Any, seconds: float, progress: Callable[[], int] | None = None
    ) -> Any:
        """Return the answer to "reset" or "act"; the process must run.

        Args:
            what: "reset", with n and a scene; or "act", with an observation.
            rest: its arguments.
            seconds: time limit [s].
            progress: is of no use here.

        Raises:
            CallError: it was not answered. The connection has ended, unless the kind is "raised",
                or the answer is a message.
        """
        if what == "reset":
            n, scene = rest
            return self._reset(n, scene, seconds)
        (observation,) = rest
        return self._act(observation, seconds)

    def kill(self) -> None:
        """End the connection from another thread: a waiting ``ask`` raises `CallError`."""
        wire = self._wire
        if wire is not None:
            wire.kill()

    def close(self) -> None:
        """End the connection, and the process of a command."""
        if self._wire is not None:
            self._wire.kill()
            self._wire.close()
        self._wire = None

    def __del__(self) -> None:
        if getattr(self, "_wire", None) is not None:
            self.close()

    def _connected(self) -> Wire:
        """Connect; wait a little for a server that has been there."""
        deadline = time.monotonic() + AGAIN_SECONDS
        while True:
            try:
                return connected(self._address)
            except InputError:
                if not self._was_there or time.monotonic() > deadline:
                    raise
            time.sleep(_PAUSE)

    def _reset(self, n: int, scene: Scene, seconds: float) -> None:
        answer = self._answer({"type": "reset", "n": n, "scene": scene}, seconds)
        self._judged(lambda: _expect(answer, "ready"))

    def _act(self, observation: Observation, seconds: float) -> Any:
        answer = self._answer({"type": "act", "observation": observation}, seconds)
        control = self._judged(lambda: _control(answer))
        return self._checked(control, observation.running)

    def _judged(self, take: Callable[[], Any]) -> Any:
        """Return what is taken of an answer."""
        try:
            return take()
        except ProtocolError as error:
            raise self._error(NONSENSE, str(error)) from None

    def _answer(self, message: Message, seconds: float) -> Message:
        """Send a message, return the answer; after bytes that are none, the connection ends."""
        try:
            return self._message(message, seconds)
        except ProtocolError as error:
            self.close()
            raise self._error(NONSENSE, str(error)) from None

    def _message(self, message: Message, seconds: float) -> Message:
        """Send a message, return the answer.

        Raises:
            CallError: timed out, the connection is closed, or the driver reports an error.
            ProtocolError: what came is no message.
        """
        assert self._wire is not None
        wire = self._wire
        frame = pack(message)
        try:
            answer = unpack(wire.ask(frame, seconds), MAX_ITEMS)
        except TimeoutError:
            self.close()
            raise self._error("timed out", f"no answer within {seconds:g} s") from None
        except ClosedError:
            self._wire = None
            raise self._error("died", wire.close()) from None
        if wire.has_more:
            raise ProtocolError("more than one message came as an answer")
        if answer["type"] == "error":
            kind = NONSENSE if answer.get("kind") == NONSENSE else RAISED
            raise self._error(kind, _line(str(answer.get("message", ""))))
        return answer


def _software() -> str:
    return f"BridgeGen {version('bridgegen')}"


def _greeted(answer: Message) -> Traits:
    """Return what a driver says of itself.

    Raises:
        InputError: it is none, or of another version.
    """
    _expect(answer, "hello")
    spoken = answer.get("protocol")
    if type(spoken) is not int or spoken != PROTOCOL:
        raise InputError(
            f"it speaks version {_short(spoken)} of the protocol, BridgeGen "
            f"{version('bridgegen')} speaks {PROTOCOL}"
        )
    return traits_of(answer)


def _expect(answer: Message, kind: str) -> None:
    """Raise an error unless a message is of a type.

    Raises:
        ProtocolError: it is not.
    """
    if answer["type"] != kind:
        raise ProtocolError(f"the answer must be of type '{kind}', got {_short(answer['type'])}")


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
    return Control(_array(answer, "acceleration"), _array(answer, "curvature"))


def _array(answer: Message, name: str) -> Any:
    found = answer.get(name)
    if not hasattr(found, "dtype"):
        raise ProtocolError(f"'{name}' of the answer must be an array, got {_short(found)}")
    return found


def _short(value: Any) -> str:
    return _line(repr(value))[:80]


def _line(text: str) -> str:
    """Return a text from elsewhere as one line without control characters."""
    shown = "".join(one if one.isprintable() else " " for one in text[:MAX_MESSAGE])
    return " ".join(shown.split())
