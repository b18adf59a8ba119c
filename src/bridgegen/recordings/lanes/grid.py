"""Pieces of centre lines by the square of the plane in which they, and their lane, lie."""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.recordings.lanes.model import RecordedLanes

EDGE = 4.0
"""Of a square [m]."""
MOST_ENTRIES = 50_000_000


@dataclass(frozen=True, eq=False)
class Grid:
    """Which pieces are near a place.

    Attributes:
        segments: ``(G, 3)`` int64: first point, lane, and 1 at its first piece plus 2 at its last.
        keys: ``(C,)`` int64, the squares that hold pieces, ascending: column times ``rows`` + row.
        first: ``(C + 1,)`` int64; the pieces in square c are ``entries[first[c]:first[c + 1]]``.
        entries: numbers of pieces.
        frame: x and y of the corner [m], edge of a square [m], number of rows.
    """

    segments: Int
    keys: Int
    first: Int
    entries: Int
    frame: Float


def grid_of(lanes: RecordedLanes, margin: float) -> Grid:
    """Return the squares of a recording's lanes.

    Args:
        lanes: of the recording.
        margin: by how much a lane counts as wider and longer than it is [m].

    Raises:
        FileFormatError: the lanes cover too large an area.
    """
    counts = np.diff(lanes.first)
    lane = np.repeat(np.arange(len(lanes)), counts)
    point = np.flatnonzero(np.append(lane[1:] == lane[:-1], False)) if len(lane) else lane
    of = lane[point]
    ends = 1 * (point == lanes.first[of]) + 2 * (point == lanes.first[of + 1] - 2)
    segments = np.column_stack([point, of, ends]).astype(np.int64)
    if not len(segments):
        empty = np.zeros(0, np.int64)
        return Grid(segments, empty, np.zeros(1, np.int64), empty, np.array([0, 0, EDGE, 1.0]))
    reach = 0.5 * np.maximum(lanes.width[point], lanes.width[point + 1]) + margin
    low, high = (
        np.column_stack([
            choose(values[point], values[point + 1]) + side * reach
            for values in (lanes.x, lanes.y)
        ])
        for choose, side in ((np.minimum, -1.0), (np.maximum, 1.0))
    )  # fmt: skip
    corner = low.min(axis=0)
    begin = np.floor((low - corner) / EDGE).astype(np.int64)
    spans = np.floor((high - corner) / EDGE).astype(np.int64) - begin + 1
    rows = int((begin[:, 1] + spans[:, 1]).max())
    cells = spans.prod(axis=1)
    if cells.sum() > MOST_ENTRIES:
        raise FileFormatError(
            f"lanes ({lanes.source}) must be within {MOST_ENTRIES:,} squares of {EDGE:g} m, got "
            f"{cells.sum():,}: they are too wide or too long; the widest has "
            f"{lanes.width.max():g} m"
        )
    which = np.repeat(np.arange(len(point)), cells)
    at = np.arange(len(which)) - np.repeat(np.cumsum(cells) - cells, cells)
    column = begin[which, 0] + at // spans[which, 1]
    key = column * rows + begin[which, 1] + at % spans[which, 1]
    order = np.argsort(key, kind="stable")
    keys, first = np.unique(key[order], return_index=True)
    return Grid(
        segments, keys, np.append(first, len(key)).astype(np.int64), which[order],
        np.array([*corner, EDGE, rows], np.float64),
    )  # fmt: skip
