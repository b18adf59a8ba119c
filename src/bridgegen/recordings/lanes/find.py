"""Where a recording is on lanes: of a map, of its own lanelets or markings, or of its paths."""

import math
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.model import Offset
from bridgegen.openx.opendrive.read import read
from bridgegen.openx.opendrive.road_map import map_bytes
from bridgegen.recordings.lanes.inferred import infer_lanes
from bridgegen.recordings.lanes.lanelets import lanes_of_lanelets
from bridgegen.recordings.lanes.model import RecordedLanes
from bridgegen.recordings.lanes.placing import WALKS, Placed, place
from bridgegen.recordings.lanes.road_map import lanes_of_map
from bridgegen.recordings.readers.table import RecordedTraffic, wrap

# --- How well lanes fit a recording ---


BIN = 0.01
"""Bin width of offsets, from which the percentiles are taken [m]."""
BINS = 1000
# Of cars that a vehicle recorded, up to 96 % are parked off lanes (nuScenes). Counting them, the
# lanes of six of 14 files would have been refused.
DRIVES = 5.0
"""Distance that a vehicle covers if it is not parked [m]; more than the noise of trackers."""


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
        states,
        rms,
        p95,
        share,
        km_on,
        max(float(steps.sum()) / 1000.0 - km_on, 0.0),
    )


def _drive(traffic: RecordedTraffic) -> Bool:
    """Return which participants get farther than `DRIVES`; ``(P,)``."""
    begin = traffic.first[:-1]
    across = [
        np.maximum.reduceat(value, begin) - np.minimum.reduceat(value, begin)
        for value in (traffic.x, traffic.y)
    ]
    far: Bool = np.hypot(*across) > DRIVES
    return far


LEAST_SHARE = 0.5
"""Least share of driving vehicles' states that are on lanes of a map; with less it is refused."""
USUAL_SHARE = 0.9
"""Share of driving vehicles' states on lanes of a map below which there is a warning."""


@dataclass(frozen=True, eq=False)
class MapLanes:
    """The lanes of an OpenDRIVE map.

    Attributes:
        path: of the file.
        lanes: in its coordinates.
        offset: from its header, of its coordinates in the geographical projection.
        warnings: of reading.
    """

    path: Path
    lanes: RecordedLanes
    offset: Offset | None
    warnings: tuple[str, ...]


@dataclass(frozen=True, eq=False)
class Located:
    """Where a recording is: the lanes in its coordinates, its states on them, how well they fit."""

    lanes: RecordedLanes
    placed: Placed
    fit: Fit


def read_map(path: Path) -> MapLanes:
    """Read the lanes of an OpenDRIVE map.

    Raises:
        FileFormatError: missing, unreadable, malformed or inconsistent.
        InputError: it has no driving lane, or is too large.
    """
    warnings: list[str] = []
    model = read(map_bytes(path, warnings), str(path), warnings)
    lanes = lanes_of_map(model, str(path))
    return MapLanes(path, lanes, model.header.offset, tuple(warnings))


def locate(traffic: RecordedTraffic, road_map: MapLanes | None = None) -> Located:
    """Say where a recording is: on a map if one is given, else its own lanes, else those inferred.

    Args:
        traffic: cleaned.
        road_map: in the recording's coordinates, or in those that its header's offset leads to.

    Raises:
        InputError: less than half of the states of vehicles that drive are on the map's lanes.
    """
    if road_map is not None:
        return _on_map(traffic, road_map)
    if not traffic.facts.lanelets:
        return _on(traffic, infer_lanes(traffic))
    found = _on(traffic, lanes_of_lanelets(traffic.facts.lanelets))
    # So written, NaN (nobody drives) keeps the lanes that the recording brings.
    if not found.fit.vehicle_share < LEAST_SHARE:
        return found
    note = (
        f"the recording's own lanes hold {found.fit.vehicle_share:.0%} of the states of vehicles "
        "that drive, and are not used"
    )
    lanes = infer_lanes(traffic)
    return _on(traffic, replace(lanes, notes=(note, *lanes.notes)))


def _on(traffic: RecordedTraffic, lanes: RecordedLanes) -> Located:
    placed = place(traffic, lanes)
    return Located(lanes, placed, fit_of(traffic, placed, lanes))


def _on_map(traffic: RecordedTraffic, road_map: MapLanes) -> Located:
    found = _on(traffic, road_map.lanes)
    share = found.fit.vehicle_share
    # Recordings are in the map's own coordinates or in those of its projection, and seldom say in
    # which; the one that fits is taken.
    if share < LEAST_SHARE and road_map.offset is not None:
        moved = _on(traffic, _projected(road_map.lanes, road_map.offset))
        found = moved if moved.fit.vehicle_share > share else found
    best = found.fit.vehicle_share
    if LEAST_SHARE <= best < USUAL_SHARE:
        note = (
            f"{traffic.facts.source}: only {best:.0%} of the states of vehicles that drive are on "
            "the map's lanes: is it the map of the place?"
        )
        lanes = replace(found.lanes, notes=(*found.lanes.notes, note))
        return Located(lanes, found.placed, found.fit)
    if not best < LEAST_SHARE:
        return found
    raise InputError(
        f"{traffic.facts.source}: {best:.0%} of the states of vehicles that drive are on lanes of "
        f"the map {road_map.path}, and {LEAST_SHARE:.0%} must be; the recording spans "
        f"{_span(traffic.x, traffic.y)}, the map {_span(road_map.lanes.x, road_map.lanes.y)}: give "
        "the map of the place, in the recording's coordinates"
    )


def _projected(lanes: RecordedLanes, offset: Offset) -> RecordedLanes:
    """Return lanes in the coordinates of the map's projection.

    Source: ASAM OpenDRIVE 1.8, georeferencing (see `bridgegen.openx.geo.projection`).
    """
    c, s = math.cos(offset.hdg), math.sin(offset.hdg)
    x, y = lanes.x + offset.x, lanes.y + offset.y
    note = (
        "the recording's coordinates are those of the map's projection: the map's lanes are moved "
        f"by its header's offset, ({offset.x:g}, {offset.y:g}) m, {offset.hdg:g} rad"
    )
    return replace(
        lanes,
        x=c * x - s * y,
        y=s * x + c * y,
        heading=wrap(lanes.heading + offset.hdg),
        notes=(*lanes.notes, note),
    )


def _span(x: Float, y: Float) -> str:
    low, high = (np.array([f(x), f(y)]) for f in (np.min, np.max))
    return f"x {low[0]:.0f} to {high[0]:.0f} m, y {low[1]:.0f} to {high[1]:.0f} m"
