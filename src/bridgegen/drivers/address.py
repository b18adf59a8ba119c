"""Where a driver in another process is, as ``--ego`` says it."""

import shlex
import shutil
from dataclasses import dataclass

from bridgegen.base.errors import InputError

CONNECT, UNIX, EXEC, EGODRIVER = "connect:", "unix:", "exec:", "egodriver://"

MAX_PATH = 103
"""Largest length of a unix socket's path [bytes]: Linux takes 107, macOS 103."""


@dataclass(frozen=True)
class Tcp:
    """A server that listens on a port."""

    host: str
    port: int


@dataclass(frozen=True)
class Grpc(Tcp):
    """A server of AlpaSim's egodriver contract."""


@dataclass(frozen=True)
class Unix:
    """A server that listens on a unix socket."""

    path: str


@dataclass(frozen=True)
class Command:
    """A program to start, with its arguments."""

    words: tuple[str, ...]

    @property
    def program(self) -> str | None:
        """The path of the program; None if there is none."""
        return shutil.which(self.words[0])


Address = Tcp | Unix | Command


def is_remote(name: str) -> bool:
    """Return whether a driver's name says that it runs in another process, and where."""
    return name.startswith((CONNECT, UNIX, EXEC, EGODRIVER))


def address_of(name: str) -> Address:
    """Return where a driver is that runs in another process.

    Args:
        name: ``connect:HOST:PORT``, ``unix:PATH``, ``exec:COMMAND``, quoted as in a shell, or
            ``egodriver://HOST:PORT``.

    Raises:
        InputError: it is none of these.
    """
    rest = name.partition(":")[2]
    if name.startswith(UNIX):
        size = len(rest.encode("utf-8", "surrogateescape"))
        if not 0 < size <= MAX_PATH or "\0" in rest:
            raise InputError(
                f"unix:PATH must have a path of 1 to {MAX_PATH} bytes, got {size} ('{name}')"
            )
        return Unix(rest)
    if name.startswith(EXEC):
        try:
            words = shlex.split(rest)
        except ValueError as error:
            raise InputError(f"the command of '{name}' cannot be read: {error}") from None
        if not words or not words[0]:
            raise InputError(f"exec: must be followed by a command, got '{name}'")
        return Command(tuple(words))
    start = EGODRIVER if name.startswith(EGODRIVER) else CONNECT
    host, colon, port = name.removeprefix(start).rpartition(":")
    bare = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    is_port = port.isascii() and port.isdecimal() and len(port) <= 5 and 0 < int(port) < 2**16
    if not (colon and bare and is_port) or (":" in host and bare == host):
        raise InputError(
            f"a server is named {start}HOST:PORT with a port from 1 to 65535, or "
            f"{start}[ADDRESS]:PORT with an address of IPv6; got '{name}'"
        )
    return (Grpc if start == EGODRIVER else Tcp)(bare, int(port))
