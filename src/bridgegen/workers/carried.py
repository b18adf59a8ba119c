"""A driver of the user's own, carried to where a worker is."""

import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from bridgegen.ego import is_spec
from bridgegen.errors import InputError


@dataclass(frozen=True)
class CarriedDriver:
    """What names a driver, and its file.

    One that lies in a package is not carried: the package has to be installed where workers are;
    and so has whatever a file imports.

    Attributes:
        name: as ``--ego`` has it.
        data: the file's bytes; None of a driver without one.
    """

    name: str
    data: bytes | None

    @classmethod
    def of(cls, name: str) -> Self:
        """Return a driver with its file, if it has one.

        Raises:
            InputError: the file cannot be read.
        """
        path = _file(name)
        try:
            return cls(name, path.read_bytes() if path and path.is_file() else None)
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None

    def here(self) -> str:
        """Return what names it on this machine: the same if its file lies here, else a copy."""
        path = _file(self.name)
        if path is None or self.data is None or _holds(path, self.data):
            return self.name
        home = Path(tempfile.gettempdir()) / f"bridgegen-drivers-{os.getuid()}"
        folder = home / hashlib.blake2b(self.data, digest_size=16).hexdigest()
        folder.mkdir(parents=True, exist_ok=True, mode=0o700)
        copy = folder / path.name
        if not _holds(copy, self.data):
            part = folder / f".{path.name}.{os.getpid()}"
            part.write_bytes(self.data)
            part.replace(copy)
        return f"{copy}{self.name.removeprefix(str(path))}"


def _file(name: str) -> Path | None:
    """Return the file that a driver is in, if it is named by one."""
    if not is_spec(name):
        return None
    where = name if name.endswith(".fmu") else name.rpartition(":")[0]
    return Path(where) if where.endswith((".py", ".fmu")) else None


def _holds(path: Path, data: bytes) -> bool:
    try:
        return path.read_bytes() == data
    except OSError:
        return False
