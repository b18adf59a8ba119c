"""Pickles of strangers, of which nothing is executed: plain containers and NumPy's arrays only.

No class of the pickle's choice is ever imported or called. The names with which NumPy pickles an
array stand for classes of this file, which hold what the pickle says and make an array of its bytes
when they are asked; so NumPy's own unpickling does not run either.
"""

import io
import pickle
import re
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from bridgegen.base.errors import FileFormatError
from bridgegen.openx.xml import read_bytes

MOST_BYTES = 256 * 2**20
_TYPE = re.compile(r"[|<>=]?[biuf][1248]")


class _Refused(Exception):
    """The pickle asks for more than arrays."""


class PickledType:
    """A NumPy type of a pickle."""

    def __init__(self, name: object, *_: object) -> None:
        # Numbers of fixed size only: an array of objects would be a pickle within the pickle.
        if not isinstance(name, str) or not _TYPE.fullmatch(name):
            raise _Refused(f"arrays must be of numbers, got the type {str(name)[:40]!r}")
        self.name, self.order = name.lstrip("|<>="), "<"

    def __setstate__(self, state: object) -> None:
        order = state[1] if isinstance(state, tuple) and len(state) > 1 else None
        self.order = ">" if order == ">" else "<"

    def dtype(self) -> np.dtype[Any]:
        """Return NumPy's type."""
        return np.dtype(self.order + self.name)


class PickledArray:
    """An array of a pickle."""

    def __init__(self, *_: object) -> None:
        self.state: object = None

    def __setstate__(self, state: object) -> None:
        self.state = state

    def array(self) -> npt.NDArray[Any]:
        """Return it.

        Raises:
            ValueError: its bytes are not those of an array of its shape and type.
        """
        match self.state:
            # The state that NumPy's ``ndarray.__reduce__`` writes: version, shape, type, order,
            # bytes. Python's matching checks the types before anything is used.
            case (int(), tuple(shape), PickledType() as kind, bool(fortran), bytes(data)):
                if not all(isinstance(size, int) and 0 <= size < 2**31 for size in shape):
                    raise ValueError("an array's shape must be of whole numbers")
                # A view of bytes that are there: a shape of any size costs no memory, for `reshape`
                # refuses one that does not fit.
                flat = np.frombuffer(data, dtype=kind.dtype())
                return flat.reshape(shape, order="F" if fortran else "C")
        raise ValueError("an array must have a shape, a type of numbers, and bytes")


def _scalar(kind: object, data: object = b"") -> float:
    if not isinstance(kind, PickledType) or not isinstance(data, bytes):
        raise _Refused("a scalar must have a type of numbers, and bytes")
    values = np.frombuffer(data, dtype=kind.dtype())
    if len(values) != 1:
        raise _Refused("a scalar must be one number")
    return values[0].item()  # type: ignore[no-any-return]


class _Marker:
    """What stands for a class that a pickle only names: of an array, of a dictionary's defaults."""

    def __init__(self, *_: object) -> None:
        raise _Refused("it calls a class that it may only name")


def _reconstruct(*_: object) -> PickledArray:
    return PickledArray()


def _dictionary(*_: object) -> dict[Any, Any]:
    """Stand for a dictionary with defaults or an order; its entries follow in the pickle."""
    return {}


_ALLOWED: dict[tuple[str, str], Callable[..., Any]] = {
    # A table of what may be named, not of what may not: a new way to run code has a new name.
    ("numpy", "ndarray"): _Marker,
    ("numpy", "dtype"): PickledType,
    ("collections", "defaultdict"): _dictionary,
    ("collections", "OrderedDict"): _dictionary,
    **{("builtins", name): _Marker for name in ("dict", "list", "set", "int", "float")},
    **{
        (f"numpy.{core}.multiarray", name): made
        # NumPy 2 renamed the module, and files of both versions are about.
        for core in ("core", "_core")
        for name, made in (("_reconstruct", _reconstruct), ("scalar", _scalar))
    },
}


class _Reader(pickle.Unpickler):
    def find_class(self, module: str, name: str) -> Any:
        try:
            return _ALLOWED[module, name]
        except KeyError:
            raise _Refused(f"it asks for {module[:40]}.{name[:40]}") from None

    def persistent_load(self, pid: object) -> Any:
        # Persistent ids are references to a store of the writer's, which a reader does not have.
        raise _Refused("it asks for an object from outside")


def read_pickle(path: Path) -> Any:
    """Return what a pickle holds, its arrays as `PickledArray`.

    Raises:
        FileFormatError: unreadable, too large, no pickle, or one that asks for anything but
            containers, numbers, texts and arrays of numbers.
    """
    data = read_bytes(path, limit=MOST_BYTES)
    try:
        return _Reader(io.BytesIO(data)).load()
    except _Refused as error:
        raise FileFormatError(
            f"{path}: this pickle is refused: {error} (only containers, numbers, texts and arrays "
            "are read; nothing of it was executed)"
        ) from None
    # A few bytes of a pickle may ask for a text or a list of any size.
    except MemoryError:
        raise FileFormatError(f"{path}: this pickle is refused: it is too large") from None
    except Exception as error:  # whatever a malformed pickle makes the reader raise
        raise FileFormatError(f"{path}: no valid pickle: {type(error).__name__}") from None
