"""The driver's end of the protocol: serves a class in Python to BridgeGen.

    python -m bridgegen.drivers.remote my_driver.py:MyDriver                   # standard input,
    output python -m bridgegen.drivers.remote my_driver.py:MyDriver 127.0.0.1:5555    # listens
    there

This file and ``messages.py`` need NumPy and msgpack only, and Python 3.9: where BridgeGen is not
installed, copy the two, and run this one in the same way. ``protocol.json`` describes the messages.
"""

from __future__ import annotations

import importlib
import importlib.util
import os
import socket
import stat
import sys
import threading
import traceback
from collections.abc import Callable
from contextlib import suppress
from dataclasses import fields, is_dataclass, make_dataclass
from functools import lru_cache
from pathlib import Path
from typing import Any, BinaryIO

import numpy as np

try:
    from bridgegen.drivers.remote import messages
except ImportError:  # it is beside this file
    import messages  # type: ignore[import-not-found, no-redef]

STANDARD = "-"
"""The address of a program that BridgeGen starts: its standard input and output."""


def serve(make: Callable[[], Any], address: str = STANDARD) -> None:
    """Serve drivers, until the end of the standard input, or until this process ends.

    Args:
        make: returns a driver, as its class does: one for each connection, in a thread of its own.
        address: ``HOST:PORT``, ``unix:PATH`` or "-", the standard input and output; there, what
            the driver prints goes to the standard error. PORT 0 is any free one.

    Raises:
        ValueError: no such address.
        OSError: it is in use, or not this machine's.
    """
    if address == STANDARD:
        reads, writes = os.fdopen(os.dup(0), "rb"), os.fdopen(os.dup(1), "wb")
        with open(os.devnull) as nothing:
            os.dup2(nothing.fileno(), 0)
        os.dup2(2, 1)  # what the driver prints must not come between messages
        _converse(make, reads, writes)
        return
    with _listening(address) as listener:
        where = listener.getsockname()
        shown = f"unix:{where}" if isinstance(where, str) else _shown(where)
        print(f"serving on {shown}", file=sys.stderr, flush=True)
        while True:
            connection, _ = listener.accept()
            threading.Thread(target=_attend, args=(make, connection), daemon=True).start()


def _shown(where: tuple[Any, ...]) -> str:
    return f"[{where[0]}]:{where[1]}" if ":" in where[0] else f"{where[0]}:{where[1]}"


def _listening(address: str) -> socket.socket:
    """Return a socket that listens; what an earlier server left of a unix socket is removed."""
    if address.startswith("unix:"):
        path = address[len("unix:") :]
        with socket.socket(socket.AF_UNIX) as probe:
            with suppress(FileNotFoundError, ConnectionRefusedError):
                probe.connect(path)
                raise OSError(f"{path}: another server listens there")
            if os.path.exists(path):
                if not stat.S_ISSOCK(os.stat(path).st_mode):
                    raise OSError(f"{path}: is there already, and is no socket")
                os.unlink(path)
        listener = socket.socket(socket.AF_UNIX)
        listener.bind(path)
        listener.listen()
        return listener
    host, _, port = address.rpartition(":")
    if not host or not port.isdecimal():
        raise ValueError(f"an address is HOST:PORT or unix:PATH, got '{address}'")
    host = host[1:-1] if host.startswith("[") and host.endswith("]") else host
    family = socket.AF_INET6 if ":" in host else socket.AF_INET
    return socket.create_server((host, int(port)), family=family)


def _attend(make: Callable[[], Any], connection: socket.socket) -> None:
    """Converse over a connection."""
    with suppress(OSError), connection:
        if connection.family != socket.AF_UNIX:
            connection.setsockopt(socket.IPPROTO_TCP, socket.TCP_NODELAY, 1)
        with connection.makefile("rb") as reads, connection.makefile("wb") as writes:
            _converse(make, reads, writes)


def _converse(make: Callable[[], Any], reads: BinaryIO, writes: BinaryIO) -> None:
    """Answer messages until there are no more, or until what comes is no message."""
    driver, is_sound = None, True
    maps: list[Any] = []
    while is_sound and len(head := reads.read(4)) == 4:
        try:
            # A message that cannot be read leaves no way to tell where the next one begins.
            is_sound = False
            message = messages.unpack(reads.read(messages.length(head)))
            is_sound = True
            if message["type"] == "hello":
                driver = make()
            answer = messages.pack(_answer(driver, message, maps))
        except messages.ProtocolError as error:
            answer = messages.pack(
                {"type": "error", "kind": messages.NONSENSE, "message": str(error)}
            )
        except Exception as error:
            answer = messages.pack(
                {"type": "error", "kind": messages.RAISED, "message": _described(error)}
            )
        writes.write(answer)
        writes.flush()


def _answer(driver: Any, message: messages.Message, maps: list[Any]) -> messages.Message:
    """Return the answer to a message; road maps are kept for later ones."""
    kind = message["type"]
    if kind == "hello":
        return {
            "type": "hello",
            "protocol": messages.PROTOCOL,
            "name": type(driver).__name__,
            "wants": list(getattr(driver, "wants", ())),
            "period": getattr(driver, "period", None),
            "max_rows": getattr(driver, "max_rows", None),
            "keeps_maps": True,
        }
    if kind == "reset":
        scene = message["scene"]
        if (sent := message.get("maps")) is not None:
            # 235 kB a reset of cut-in without, 0.3 kB with it.
            maps[sent["kept"] :] = _part("maps", sent["new"])
            scene["maps"] = tuple(maps[i] for i in sent["numbers"])
        driver.reset(message["n"], _record("Scene", scene))
        return {"type": "ready"}
    if kind == "act":
        return _control(driver.act(_record("Observation", message["observation"])))
    raise messages.ProtocolError(
        f"the type of a message must be hello, reset or act, got '{kind[:40]}'"
    )


def _control(answer: Any) -> messages.Message:
    """Return a driver's answer as a message: a control, a pair, or a trajectory."""
    if hasattr(answer, "time") and hasattr(answer, "x"):
        names = ("time", "x", "y", "h", "v")
        return {"type": "trajectory", **{name: _floats(getattr(answer, name)) for name in names}}
    try:
        pair = (answer.acceleration, answer.curvature) if hasattr(answer, "curvature") else answer
        acceleration, curvature = (_floats(item) for item in pair)
    except (TypeError, ValueError) as error:
        text = f"act must return a Control or (acceleration, curvature): {error}"
        raise messages.ProtocolError(text) from None
    found = {"type": "control", "acceleration": acceleration, "curvature": curvature}
    demand = getattr(answer, "demand", None)
    return found if demand is None else {**found, "demand": _floats(demand)}


def _floats(values: Any) -> Any:
    return np.asarray(values, dtype=np.float64)


def _described(error: Exception) -> str:
    """Return an exception in one line, with the driver's line that raised it."""
    place = traceback.extract_tb(error.__traceback__)[-1]
    return f"{type(error).__name__}: {error} ({Path(place.filename).name}:{place.lineno})"


# --- What a driver is given -----------------------------------------------------------------------


def _take(record: Any, rows: Any) -> Any:
    """Return the observation of some of the scenarios."""
    found = {}
    for field in fields(record):
        value = getattr(record, field.name)
        if isinstance(value, np.ndarray):
            value = value[rows]
        elif is_dataclass(value):
            value = _take(value, rows)
        found[field.name] = value
    return type(record)(**found)


_classes: dict[tuple[str, ...], Any] = {}


def _record(name: str, values: messages.Message) -> Any:
    """Return a map as a frozen dataclass of its keys, lists as tuples, as BridgeGen has them."""
    key = (name, *values)
    if key not in _classes:
        _classes[key] = make_dataclass(name, values, frozen=True, namespace={"take": _take})
    record = object.__new__(_classes[key])
    parts = vars(record)  # a frozen class sets its attributes slowly
    for item, value in values.items():
        kind = type(value)
        parts[item] = _part(item, value) if kind is dict or kind is list else value
    return record


def _part(name: str, value: Any) -> Any:
    if isinstance(value, dict):
        return _record(name, value)
    return tuple(_part(name, item) for item in value) if isinstance(value, list) else value


# --- The command line -----------------------------------------------------------------------------


def main() -> None:
    """Serve the driver of the command line."""
    if not 2 <= len(sys.argv) <= 3 or ":" not in sys.argv[1]:
        sys.exit("usage: DRIVER [HOST:PORT | unix:PATH]; DRIVER is file.py:Class or module:Class")
    where, _, name = sys.argv[1].rpartition(":")
    try:
        if len(sys.argv) == 3:
            _module(where)
        serve(lambda: getattr(_module(where), name)(), *sys.argv[2:])
    except (ImportError, OSError, ValueError) as error:
        sys.exit(f"{sys.argv[1]}: {error}")
    except KeyboardInterrupt:
        pass


@lru_cache
def _module(where: str) -> Any:
    if not where.endswith(".py"):
        sys.path.insert(0, "")
        return importlib.import_module(where)
    found = importlib.util.spec_from_file_location(Path(where).stem, where)
    if found is None or found.loader is None:
        raise ImportError(f"{where} cannot be imported")
    module = importlib.util.module_from_spec(found)
    sys.modules[Path(where).stem] = module
    found.loader.exec_module(module)
    return module


if __name__ == "__main__":
    main()
