"""A map's folder: what it is a map of, and the outcomes of the chunks of cells that are done."""

import io
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np

from bridgegen.base.disk import write_whole
from bridgegen.base.records import read_bytes
from bridgegen.jobs.preventability.classes import Codes, Outcome
from bridgegen.results.store.claimed import claim

CHUNK = 16_384
"""Cells of a chunk: what is lost at most when a map is stopped. No result depends on it."""

SETTINGS = "map.json"
CHUNKS = "chunks"


class ChunkStore:
    """The chunks of a map, a file each, which a later call with the same settings reads.

    Args:
        folder: of the map; made if it does not exist.
        settings: what the outcomes depend on, as JSON's types.
        drivers: how many outcomes a cell has.
        cells: how many cells the map has.

    Raises:
        StorageError: the folder holds another map or something else, or cannot be written.
    """

    def __init__(self, folder: Path, settings: Mapping[str, Any], drivers: int, cells: int) -> None:
        self.folder, self._drivers, self._cells = folder, drivers, cells
        claim(folder, settings, file=SETTINGS, pieces=CHUNKS, what="a map")

    @property
    def count(self) -> int:
        """The number of chunks."""
        return -(-self._cells // CHUNK)

    def bounds(self, i: int) -> tuple[int, int]:
        """Return the numbers of a chunk's first cell and of the one after its last."""
        return i * CHUNK, min((i + 1) * CHUNK, self._cells)

    def read(self, i: int) -> Codes | None:
        """Return a chunk's outcomes, ``(drivers, n)``; None if it is not there, whole and sound."""
        start, stop = self.bounds(i)
        try:
            found = np.load(io.BytesIO(read_bytes(self._path(i))), allow_pickle=False)
        except (OSError, ValueError, EOFError):
            return None
        if not isinstance(found, np.ndarray) or found.dtype != np.int8:
            return None
        if found.shape != (self._drivers, stop - start):
            return None
        return found if np.isin(found, list(Outcome)).all() else None

    def write(self, i: int, outcomes: Codes) -> None:
        """Keep a chunk's outcomes, whole or not at all.

        Raises:
            StorageError: it cannot be written.
        """
        data = io.BytesIO()
        np.save(data, outcomes, allow_pickle=False)
        write_whole(self._path(i), [data.getvalue()])

    def _path(self, i: int) -> Path:
        return self.folder / CHUNKS / f"{i:06d}.npy"
