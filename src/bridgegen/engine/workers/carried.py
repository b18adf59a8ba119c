"""A user's driver with the contents of its file, sent to workers."""

import hashlib
import os
import tempfile
from dataclasses import dataclass
from pathlib import Path
from typing import Self

from bridgegen.base.errors import InputError
from bridgegen.drivers import file_of


@dataclass(frozen=True)
class CarriedDriver:
    """The name of a driver, and the contents of its file.

    A driver in a package is not sent: the package must be installed on the workers' machines, and
    so must the modules that a driver's file imports.

    Attributes:
        name: the value of ``--ego``.
        data: the file's bytes; None if the driver has no file.
    """

    name: str
    data: bytes | None

    @classmethod
    def of(cls, name: str) -> Self:
        """Return a driver with the contents of its file, if it has one.

        Raises:
            InputError: the file cannot be read.
        """
        path = file_of(name)
        try:
            return cls(name, path.read_bytes() if path and path.is_file() else None)
        except OSError as error:
            raise InputError(f"{path}: cannot be read: {error.strerror}") from None

    @property
    def digest(self) -> str | None:
        """A digest of the file; None if the driver has none."""
        return None if self.data is None else hashlib.sha256(self.data).hexdigest()

    def here(self) -> str:
        """Return its name here: unchanged if the same file exists, else that of a copy."""
        path = file_of(self.name)
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


def _holds(path: Path, data: bytes) -> bool:
    try:
        return path.read_bytes() == data
    except OSError:
        return False
