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
from bridgegen.drivers.kinds import ANIMAL, OTHER, PEDESTRIAN
from bridgegen.recordings.lanes._placing_kernels import OVERHANG, place_tracks
from bridgegen.recordings.lanes.grid import grid_of
from bridgegen.recordings.lanes.model import NONE, RecordedLanes
from bridgegen.recordings.readers.table import RecordedTraffic

WALKS = (PEDESTRIAN, ANIMAL, OTHER)
"""What may be on a lane in any direction; a vehicle that crosses a lane is not on it."""


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
    first = np.cumsum([0, *(len(one) for one in lists)]).astype(np.int64)
    return first, np.array([one for each in lists for one in each], np.int64)
