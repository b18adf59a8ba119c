"""Where every state of a recording is: on which lane, how far along and beside its middle.

Of all sequences of lanes that hold a track's states, the one is taken that is nearest to the
middles of the lanes and to their directions, and that does not jump between lanes that neither
follow one another nor lie side by side (Viterbi's algorithm). So where lanes overlap, as on a
crossing, the whole path decides.
"""

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import FileFormatError
from bridgegen.drivers.kinds import ANIMAL, OTHER, PEDESTRIAN
from bridgegen.recordings.lanes._placing_kernels import OVERHANG, place_tracks
from bridgegen.recordings.lanes.model import NONE, RecordedLanes
from bridgegen.recordings.readers.table import RecordedTraffic

# --- Pieces of centre lines by the square of the plane in which they, and their lane, lie ---


EDGE = 4.0
"""Edge of a square of the grid in which lanes are looked up [m]."""
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
        np.column_stack(
            [
                choose(values[point], values[point + 1]) + side * reach
                for values in (lanes.x, lanes.y)
            ]
        )
        for choose, side in ((np.minimum, -1.0), (np.maximum, 1.0))
    )
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
        segments,
        keys,
        np.append(first, len(key)).astype(np.int64),
        which[order],
        np.array([*corner, EDGE, rows], np.float64),
    )


WALKS = (PEDESTRIAN, ANIMAL, OTHER)
"""Kinds that may be on a lane in any direction; a vehicle that crosses a lane is not on it."""


@dataclass(frozen=True, eq=False)
class Placed:
    """Where the states of a recording are, in the order of `RecordedTraffic`.

    All but ``lane`` is NaN off the lanes. A vehicle is on a lane if its centre is between the
    lane's borders and its heading within 50° of the lane's direction or of its opposite; a
    pedestrian whatever the heading. A result depends on the participant's own states alone.

    Attributes:
        lane: ``(S,)`` int32, number in `RecordedLanes`; -1 off the lanes.
        station: ``(S,)`` float64 along the lane's carriageway [m].
        offset: ``(S,)`` float32 of the centre from the lane's middle [m], left positive.
        heading: ``(S,)`` float32 less the lane's direction, in [-π, π) [rad].
        along: ``(S,)`` float32, speed in the lane's direction [m/s].
        across: ``(S,)`` float32, speed to the lane's left [m/s].
    """

    lane: npt.NDArray[np.int32]
    station: Float
    offset: npt.NDArray[np.float32]
    heading: npt.NDArray[np.float32]
    along: npt.NDArray[np.float32]
    across: npt.NDArray[np.float32]

    def __post_init__(self) -> None:
        for value in vars(self).values():
            value.flags.writeable = False

    @property
    def on_lane(self) -> Bool:
        """``(S,)`` bool."""
        return np.asarray(self.lane != NONE)


def place(traffic: RecordedTraffic, lanes: RecordedLanes) -> Placed:
    """Return where a cleaned recording's states are."""
    n = len(traffic.time)
    lane = np.full(n, NONE, np.int32)
    station = np.full(n, np.nan)
    rest = np.full((4, n), np.nan, np.float32)
    grid = grid_of(lanes, OVERHANG)
    succ_first, succ = flattened(lanes.successors)
    points = np.column_stack([lanes.x, lanes.y, lanes.heading, lanes.width, lanes.station])
    place_tracks(
        traffic.x, traffic.y, traffic.heading, traffic.vx, traffic.vy, traffic.first,
        np.isin(traffic.kind, WALKS), points, grid.segments, lanes.left, lanes.right, succ_first,
        succ, grid.keys, grid.first, grid.entries, grid.frame, lane, station, rest,
    )  # fmt: skip
    return Placed(lane, station, *rest)


def flattened(lists: tuple[tuple[int, ...], ...]) -> tuple[Int, Int]:
    """Return lists of numbers as one: where each begins, ``(L + 1,)``, and their numbers."""
    first = np.cumsum([0, *(len(list_) for list_ in lists)]).astype(np.int64)
    return first, np.array([number for each in lists for number in each], np.int64)
