"""Plain data from which a worker builds its pipeline; no file has to exist on its machine."""

import hashlib
import io
import pickle
from collections.abc import Callable
from dataclasses import dataclass
from types import MappingProxyType
from typing import Any, Self


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
