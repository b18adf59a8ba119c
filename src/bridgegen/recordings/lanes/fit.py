"""How well lanes fit a recording."""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.recordings.lanes.model import RecordedLanes
from bridgegen.recordings.lanes.placing import WALKS, Placed
from bridgegen.recordings.readers.table import RecordedTraffic

BIN = 0.01
"""Of offsets, from which the percentiles are taken [m]."""
BINS = 1000
DRIVES = 5.0
"""How far a vehicle gets that is not parked [m]; more than the noise of trackers."""


@dataclass(frozen=True, eq=False)
class Fit:
    """How well lanes fit a recording.

    Attributes:
        states: ``(L,)`` int64 on each lane.
        rms: ``(L,)`` of the offsets from the lane's middle [m]; NaN where nothing was.
        p95: ``(L,)`` 95th percentile of the offsets' absolute values, within 0.01 m [m].
        vehicle_share: share of the states on a lane, of vehicles that drive; pedestrians, animals,
            objects and parked vehicles are left out. NaN without any.
        km_on: of all participants' paths, from one state on a lane to the next [km].
        km_off: the rest [km].
    """

    states: Int
    rms: Float
    p95: Float
    vehicle_share: float
    km_on: float
    km_off: float


def fit_of(traffic: RecordedTraffic, placed: Placed, lanes: RecordedLanes) -> Fit:
    """Return how well lanes fit a recording."""
    count = len(lanes)
    on = placed.on_lane
    lane = placed.lane[on].astype(np.int64)
    offset = np.abs(placed.offset[on]).astype(np.float64)
    states = np.bincount(lane, minlength=count)
    with np.errstate(invalid="ignore"):
        rms = np.sqrt(np.bincount(lane, offset**2, minlength=count) / states)
    bins = np.minimum((offset / BIN).astype(np.int64), BINS - 1)
    used = np.flatnonzero(states)
    row = np.searchsorted(used, lane)
    below = np.bincount(row * BINS + bins, minlength=len(used) * BINS).reshape(-1, BINS)
    reached = np.cumsum(below, axis=1) >= 0.95 * states[used, None]
    p95 = np.full(count, np.nan)
    p95[used] = (reached.argmax(axis=1) + 1) * BIN
    vehicles = ~np.isin(traffic.kind, WALKS) & _drive(traffic)
    of_vehicles = np.repeat(vehicles, np.diff(traffic.first))
    steps = np.hypot(np.diff(traffic.x), np.diff(traffic.y))
    steps[traffic.first[1:-1] - 1] = 0.0
    km_on = float(steps[on[1:] & on[:-1]].sum()) / 1000.0
    share = float(on[of_vehicles].mean()) if of_vehicles.any() else float("nan")
    return Fit(
        states, rms, p95, share, km_on,
        max(float(steps.sum()) / 1000.0 - km_on, 0.0),
    )  # fmt: skip


def _drive(traffic: RecordedTraffic) -> Bool:
    """Return which participants get farther than `DRIVES`; ``(P,)``."""
    begin = traffic.first[:-1]
    across = [
        np.maximum.reduceat(value, begin) - np.minimum.reduceat(value, begin)
        for value in (traffic.x, traffic.y)
    ]
    far: Bool = np.hypot(*across) > DRIVES
    return far
