"""Plain data from which a worker makes what it works with: no file need be where it is."""

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
        data: it.
        key: a digest of it: two recipes of one key make the same.
    """

    data: bytes
    key: str

    @classmethod
    def of(cls, make: Callable[..., Any], *arguments: Any, **more: Any) -> Self:
        """Return the recipe of a call.

        Args:
            make: importable by its name.
            arguments: of it; all that is needed must be in them, files by their bytes.
            more: by name.
        """
        file = io.BytesIO()
        _Pickler(file, protocol=5).dump((make, arguments, more))
        data = file.getvalue()
        return cls(data, hashlib.blake2b(data, digest_size=16).hexdigest())

    def make(self) -> Any:
        """Call it.

        Raises:
            Exception: whatever it raises; ModuleNotFoundError if it is not to be found here.
        """
        function, arguments, more = pickle.loads(self.data)
        return function(*arguments, **more)


class _Pickler(pickle.Pickler):
    def reducer_override(self, obj: Any) -> Any:
        if isinstance(obj, MappingProxyType):  # a mapping that may not be changed, nothing more
            return _read_only, (dict(obj),)
        return NotImplemented


def _read_only(mapping: dict[Any, Any]) -> MappingProxyType[Any, Any]:
    return MappingProxyType(mapping)
