"""Plain data from which a worker builds its pipeline, with the files of a user's driver."""

import hashlib
import io
import os
import pickle
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any, Self

from bridgegen.base.errors import InputError
from bridgegen.drivers import file_of
from bridgegen.drivers.tunable import split_settings


@dataclass(frozen=True)
class Recipe:
    """A call, pickled, with its arguments.

    Attributes:
        data: the pickled call.
        key: a digest of it; recipes with the same key build the same.
    """

    data: bytes
    key: str

    @classmethod
    def of(cls, make: Callable[..., Any], *arguments: Any, **more: Any) -> Self:
        """Return the recipe of a call.

        Args:
            make: importable by its name.
            arguments: its positional arguments, complete: files are passed by their bytes.
            more: its keyword arguments.
        """
        file = io.BytesIO()
        _Pickler(file, protocol=5).dump((make, arguments, more))
        data = file.getvalue()
        return cls(data, hashlib.blake2b(data, digest_size=16).hexdigest())

    def make(self) -> Any:
        """Call the function and return its result.

        Raises:
            Exception: raised by the function; ModuleNotFoundError if it is not installed here.
        """
        function, arguments, more = pickle.loads(self.data)
        return function(*arguments, **more)


class _Pickler(pickle.Pickler):
    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, MappingProxyType):  # which pickle does not support
            return _read_only, (dict(obj),)
        return NotImplemented


def _read_only(mapping: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(mapping)


# --- A user's driver with the contents of its file, sent to workers ---


@dataclass(frozen=True)
class CarriedDriver:
    """The name of a driver, and the contents of its file.

    A driver in a package is not sent: the package must be installed on the workers' machines, and
    so must the modules that a driver's file imports.

    Attributes:
        name: the value of ``--ego``.
        data: the file's bytes; None if the driver has no file.
        settings: the bytes of its file of settings; None if it has none.
    """

    name: str
    data: bytes | None
    settings: bytes | None = None

    @classmethod
    def of(cls, name: str) -> Self:
        """Return a driver with the contents of its file, if it has one.

        Raises:
            InputError: the file cannot be read.
        """
        path, settings = file_of(name), split_settings(name)[1]
        try:
            # The file's bytes, now: a search that takes days goes on with the driver that it began
            # with.
            return cls(
                name,
                path.read_bytes() if path and path.is_file() else None,
                settings.read_bytes() if settings else None,
            )
        except OSError as error:
            raise InputError(f"{error.filename}: cannot be read: {error.strerror}") from None

    def here(self) -> str:
        """Return its name here: unchanged if the same file exists, else that of a copy."""
        plain, settings = split_settings(self.name)
        path, end = file_of(plain), ""
        if settings is not None and self.settings is not None:
            end = f"@{_copied(settings, self.settings)}"
        if path is None or self.data is None:
            return f"{plain}{end}"
        if (copy := _copied(path, self.data)) != path:
            plain = f"{copy}{plain.removeprefix(str(path))}"
        return f"{plain}{end}"


def _copied(path: Path, data: bytes) -> Path:
    """Return the path of a file with these contents: itself if it has them, else a copy."""
    if _holds(path, data):
        return path
    # The file may be imported as code, so its folder is this user's alone.
    home = Path(tempfile.gettempdir()) / f"bridgegen-drivers-{os.getuid()}"
    folder = home / hashlib.blake2b(data, digest_size=16).hexdigest()
    folder.mkdir(parents=True, exist_ok=True, mode=0o700)
    copy = folder / path.name
    if not _holds(copy, data):
        # Workers of one machine write at the same time: each reads a whole file.
        part = folder / f".{path.name}.{os.getpid()}"
        part.write_bytes(data)
        part.replace(copy)
    return copy


def _holds(path: Path, data: bytes) -> bool:
    try:
        return path.read_bytes() == data
    except OSError:
        return False
