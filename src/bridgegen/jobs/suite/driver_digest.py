"""A digest of a user's driver: whether results are those of the driver as it is now."""

import hashlib
from functools import lru_cache
from pathlib import Path

from bridgegen.base.errors import InputError
from bridgegen.drivers import is_remote
from bridgegen.drivers.address import Command, address_of
from bridgegen.engine.workers import CarriedDriver


def driver_digest(name: str) -> str:
    """Return a digest of the files that a driver's name holds, not of what they import.

    Empty where it holds none: a driver that ships, in a package, or of a server.
    """
    try:
        if is_remote(name):
            return _digest_of_command(name)
        data = CarriedDriver.of(name).data
    except (InputError, OSError, ValueError):
        return ""
    return "" if data is None else hashlib.sha256(data).hexdigest()


def _digest_of_command(name: str) -> str:
    """Return a digest of a program and of the files among its arguments."""
    command = address_of(name)
    if not isinstance(command, Command):
        return ""
    digest = hashlib.sha256()
    for path in (Path(word) for word in (command.program or "", *command.words[1:])):
        if path.is_file():
            stat = path.stat()
            digest.update(_digest_of_file(path, stat.st_mtime_ns, stat.st_size))
    return digest.hexdigest()


@lru_cache(maxsize=64)
def _digest_of_file(path: Path, modified: int, size: int) -> bytes:
    """Return the digest of a file that was modified then."""
    with path.open("rb") as file:
        return hashlib.file_digest(file, "sha256").digest()
