"""A driver that drives as another one does, and records what it sees: for one row at a time.

It is a driver of the user's own in a file, so it runs in a process of its own as any other:
`observer` writes that file, and `recorded` reads what it has seen.
"""

import pickle
from collections.abc import Iterator
from pathlib import Path
from typing import IO, Any

from bridgegen.base.errors import InputError
from bridgegen.drivers.driver_process import make
from bridgegen.drivers.interface import BatchDriver, Observation, Scene
from bridgegen.drivers.user_drivers import NAMES

_FILE = "observer.py"
_SEEN = "seen.bin"


def observer(spec: str, folder: Path) -> str:
    """Write a driver that observes another one; return its name, as given to ``--ego``.

    Args:
        spec: of the other one.
        folder: exists, and is written to by us alone.
    """
    text = (
        "from bridgegen.jobs.benchmark.observing import observing\n\n"
        f"Observer = observing({spec!r}, {str(folder / _SEEN)!r})\n"
    )
    path = folder / _FILE
    path.write_text(text, encoding="utf-8")
    return f"{path}:Observer"


def observing(spec: str, seen: str) -> type:
    """Return the class of a driver that observes another one.

    Raises:
        InputError: the other one cannot be made, or is compiled.
    """
    inner: Any = make(spec)
    if not hasattr(inner, "act"):
        raise InputError(f"{spec} is compiled: what it sees is not recorded")

    class Observer:
        def __init__(self) -> None:
            self._driver: BatchDriver = inner
            self._file: IO[bytes] | None = None

        def reset(self, n: int, scene: Scene) -> None:
            self._write(scene, afresh=True)
            self._driver.reset(n, scene)

        def act(self, observation: Observation) -> Any:
            self._write(observation)
            return self._driver.act(observation)

        def _write(self, what: Scene | Observation, *, afresh: bool = False) -> None:
            if afresh or self._file is None:
                self._file = Path(seen).open("wb")  # noqa: SIM115 - until the next row
            pickle.dump(what, self._file)
            self._file.flush()

    for name in NAMES:
        if hasattr(inner, name):
            setattr(Observer, name, getattr(inner, name))
    return Observer


def recorded(folder: Path) -> tuple[Scene, list[Observation]]:
    """Return what the observer saw last: of one row, or of that row twice.

    Args:
        folder: of `observer`: what it holds was written by this program.
    """
    found = list(_read(folder / _SEEN))
    scene, seen = found[0], found[1:]
    assert isinstance(scene, Scene)
    return scene, [one.take(slice(0, 1)) for one in seen]


def _read(path: Path) -> Iterator[Any]:
    with path.open("rb") as file:
        while True:
            try:
                yield pickle.load(file)
            except EOFError:
                return
