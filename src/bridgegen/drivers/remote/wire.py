"""Frames to and from a driver in another process, each within a time limit."""

import os
import select
import socket
import sys
import time
import weakref
from collections.abc import Callable
from contextlib import suppress

from bridgegen.base.errors import InputError
from bridgegen.base.processes.child import Program
from bridgegen.drivers.address import Address, Command, Tcp, Unix
from bridgegen.drivers.remote.messages import length

BUFFER = 2**20
"""Size of the buffers of pipes and sockets [bytes]: an observation of some hundred rows."""

CONNECT_SECONDS = 10.0
"""Time limit for a server to accept a connection [s]."""

END_SECONDS = 2.0
"""Time for a program to end by itself after its standard output [s]."""

MAX_TEXT = 500
"""Largest number of characters of a text from elsewhere that is passed on."""

_PART = 2**14  # bytes to read at least: what a control of some hundred rows has
_SET_PIPE_SIZE = 1031  # F_SETPIPE_SZ of Linux


class ClosedError(Exception):
    """The other end is closed; says how."""


class Wire:
    """A connection to a driver's process, over two file descriptors.

    Args:
        reads: descriptor to read from.
        writes: descriptor to write to; may be the same.
        kill: ends the connection from any thread; a pending read then ends.
        release: closes the descriptors when the other end has closed them; returns how it ended.
    """

    def __init__(
        self, reads: int, writes: int, kill: Callable[[], None], release: Callable[[], str]
    ) -> None:
        self.kill, self._release = kill, release
        self._end = weakref.finalize(self, _end, kill, release)
        self._reads, self._writes = reads, writes
        for descriptor in (reads, writes):
            # A blocking read or write could wait beyond the time limit, and a full pipe on both
            # sides for ever.
            os.set_blocking(descriptor, False)
        self._readable, self._writable = select.poll(), select.poll()
        self._readable.register(reads, select.POLLIN)
        self._writable.register(writes, select.POLLOUT)
        self._ahead = bytearray()
        self.is_json = False  # whether the other end has answered in JSON

    @property
    def is_open(self) -> bool:
        """Whether it has not been closed."""
        return self._end.alive

    def close(self) -> None:
        """End the connection, as does this object's deletion."""
        self._end()

    def end(self) -> str:
        """Release a connection that the other end has closed; return how it ended, in words."""
        self._end.detach()
        return self._release()

    def ask(self, frame: bytes, seconds: float) -> bytes:
        """Send a frame; return the message that answers it.

        Raises:
            TimeoutError: not within so many seconds.
            ClosedError: the other end is closed.
            ProtocolError: it is too long, or more follows it.
        """
        deadline = time.monotonic() + seconds
        rest = memoryview(frame)
        try:
            while rest:
                try:
                    rest = rest[os.write(self._writes, rest) :]
                except BlockingIOError:
                    _wait(self._writable, deadline)
            return self._frame(deadline)
        except TimeoutError:
            raise
        except OSError as error:  # the network is down, for example
            raise ClosedError(str(error)) from None

    @property
    def has_more(self) -> bool:
        """Whether more has come than the answer."""
        return bool(self._ahead)

    def _frame(self, deadline: float) -> bytes:
        ahead = self._ahead
        self._fill(4, deadline)
        end = 4 + length(ahead[:4])
        self._fill(end, deadline)
        message = bytes(memoryview(ahead)[4:end])
        del ahead[:end]
        return message

    def _fill(self, least: int, deadline: float) -> None:
        """Read until there are so many bytes."""
        ahead = self._ahead
        while len(ahead) < least:
            _wait(self._readable, deadline)
            with suppress(BlockingIOError):
                part = os.read(self._reads, max(_PART, least - len(ahead)))
                if not part:
                    raise ClosedError
                ahead += part


def _end(kill: Callable[[], None], release: Callable[[], str]) -> None:
    kill()
    release()


def _wait(poll: select.poll, deadline: float) -> None:
    """Wait until a descriptor is ready.

    Raises:
        TimeoutError: the time is over.
    """
    left = deadline - time.monotonic()
    if left <= 0.0 or not poll.poll(1000.0 * left):
        raise TimeoutError


def connected(address: Address) -> Wire:
    """Return a connection to a driver's process; of a command, to a program that is started.

    Raises:
        InputError: there is no such program, or nobody listens there.
    """
    if isinstance(address, Command):
        return _started(address)
    try:
        connection = _socket(address)
    except TimeoutError:
        raise InputError(
            f"{named(address)} accepts no connection within {CONNECT_SECONDS:g} s"
        ) from None
    except ConnectionRefusedError:
        raise InputError(f"nobody listens on {named(address)}") from None
    except (OSError, UnicodeError) as error:
        reason = getattr(error, "strerror", None) or error
        raise InputError(f"{named(address)} cannot be reached: {reason}") from None

    def kill() -> None:
        with suppress(OSError):
            connection.shutdown(socket.SHUT_RDWR)

    def release() -> str:
        connection.close()
        return "it closed the connection"

    return Wire(connection.fileno(), connection.fileno(), kill, release)


def _socket(address: Tcp | Unix) -> socket.socket:
    if isinstance(address, Tcp):
        connection = socket.create_connection((address.host, address.port), CONNECT_SECONDS)
        # Messages are small and each is waited for; Nagle's algorithm would hold them back.
        connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
    else:
        connection = socket.socket(socket.AF_UNIX)
        connection.settimeout(CONNECT_SECONDS)
        try:
            connection.connect(address.path)
        except OSError:
            connection.close()
            raise
    for option in (socket.SO_SNDBUF, socket.SO_RCVBUF):
        connection.setsockopt(socket.SOL_SOCKET, option, BUFFER)
    return connection


def named(address: Tcp | Unix) -> str:
    """Return where a server is, in words."""
    if isinstance(address, Tcp):
        return f"port {address.port} of {address.host}"
    return f"the unix socket {address.path}"


def one_line(text: str) -> str:
    """Return a text from elsewhere as one line without control characters."""
    # A text from another program must not steer a terminal, nor fill a report.
    shown = "".join(name if name.isprintable() else " " for name in text[:MAX_TEXT])
    return " ".join(shown.split())


def _started(command: Command) -> Wire:
    path = command.program
    if path is None:
        raise InputError(f"there is no program '{command.words[0]}'")
    program = Program([path, *command.words[1:]])
    if sys.platform == "linux":
        import fcntl

        for pipe in program.pipes:
            with suppress(OSError):
                fcntl.fcntl(pipe, _SET_PIPE_SIZE, BUFFER)

    def release() -> str:
        return f"its process ended with status {program.end(END_SECONDS)}"

    return Wire(*program.pipes, program.kill, release)
