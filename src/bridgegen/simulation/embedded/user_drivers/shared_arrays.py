"""Arrays that this process and another one both see: they lie in a file that both have mapped."""

import mmap
import os
import tempfile
import weakref
from collections.abc import Sequence
from typing import NamedTuple

import numpy as np

ALIGNED = 64  # bytes, a line of the processor's cache


class Layout(NamedTuple):
    """Where arrays lie.

    Attributes:
        path: of the file.
        size: in bytes.
        arrays: type, shape and offset of each.
    """

    path: str
    size: int
    arrays: tuple[tuple[str, tuple[int, ...], int], ...]


class SharedArrays:
    """A file that holds one batch's arrays at a time, and grows with them; it ends with this."""

    def __init__(self) -> None:
        self._path, self._size = "", 0
        self._map: mmap.mmap | None = None

    def put(self, arrays: Sequence[np.ndarray]) -> tuple[Layout, list[np.ndarray]]:
        """Copy arrays in, over the ones before; return where they lie, and the copies."""
        placed, size = [], 0
        for array in arrays:
            placed.append((array.dtype.str, array.shape, size))
            size += -(-array.nbytes // ALIGNED) * ALIGNED
        size = max(size, 1)  # nothing cannot be mapped
        # Grown, never made anew: the other process keeps its map while the size is the same.
        if size > self._size:
            if not self._path:
                number, self._path = tempfile.mkstemp(prefix="bridgegen-")
                os.close(number)
                weakref.finalize(self, os.unlink, self._path)
            os.truncate(self._path, size)
            self._map, self._size = _map(self._path, size), size
        layout = Layout(self._path, self._size, tuple(placed))
        views = [] if self._map is None else _views(self._map, layout)
        for view, array in zip(views, arrays, strict=True):
            view[...] = array
        return layout, views


_mapped: dict[str, tuple[int, mmap.mmap]] = {}


def seen(layout: Layout) -> list[np.ndarray]:
    """Return, in the other process, the arrays of a layout."""
    size, mapped = _mapped.get(layout.path, (0, None))
    if mapped is None or size != layout.size:
        mapped = _map(layout.path, layout.size)
        _mapped[layout.path] = layout.size, mapped
    return _views(mapped, layout)


def _views(mapped: mmap.mmap, layout: Layout) -> list[np.ndarray]:
    return [np.ndarray(shape, kind, mapped, offset) for kind, shape, offset in layout.arrays]


def _map(path: str, size: int) -> mmap.mmap:
    with open(path, "r+b") as file:
        return mmap.mmap(file.fileno(), size)
