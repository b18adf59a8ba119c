"""Lanes of the paths themselves, for carriageways without a map.

The distances of a carriageway's paths from its reference line pile up in the middles of lanes.
Lanes are claimed only where those piles are apart, as wide as lanes are, and hold most of the
traffic.
"""

import itertools
from dataclasses import dataclass

import numpy as np
from scipy.ndimage import gaussian_filter1d

from bridgegen.base.arrays import Float, Int
from bridgegen.recordings.lanes.model import (
    NONE,
    RecordedLanes,
    Strip,
    along,
    assemble,
    headings_along,
)
from bridgegen.recordings.lanes.paths import (
    LEAST_VEHICLES,
    REACH,
    Pieces,
    carriageways,
    coordinates,
    pieces_of,
    reference_line,
)
from bridgegen.recordings.readers.table import RecordedTraffic, wrap

NARROWEST, WIDEST, USUAL = 2.5, 4.5, 3.5
"""Least, greatest and usual width of a lane [m]."""
SPREAD = 0.35  # m, of the kernel density of distances
BIN = 0.05  # m
VALLEY = 0.7
"""Largest density between two lanes, as a share of the lesser one's highest."""
LEAST_IN_LANE, LEAST_ON_AVERAGE = 3, 6
"""Least number of vehicles in each lane, and on average per lane."""
SHORTEST = 50.0  # m, a lane
STRETCH, GAP = 20.0, 3  # m; stretches in a row without a vehicle that do not end a lane
MOST_RMS, MOST_IN_LANE = 0.19, 0.22
"""Largest root mean square of distances from the middles of lanes, of all lanes and of each [lane
widths]: 0.29 if paths are spread evenly."""
LEAST_SHARE = 0.85
"""Least share of the paths' length that is on the lanes."""
SKEW = np.radians(30.0)
MOST_CARRIAGEWAYS = 200


@dataclass(frozen=True, eq=False)
class _Found:
    """A carriageway's lanes: reference line, borders, extents along the line, note."""

    line: Float
    borders: Float  # (n, 2) right and left [m]
    extents: list[tuple[int, int]]  # of points of the line
    lane: Int  # (n,) which pile each extent belongs to


def infer_lanes(traffic: RecordedTraffic) -> RecordedLanes:
    """Return the lanes that a cleaned recording's paths show; notes say why others are missing."""
    pieces = pieces_of(traffic)
    waiting = carriageways(pieces)
    strips: list[Strip] = []
    refused: list[str] = []
    group = 0
    # Bounded: each turn may put back what lies off the line that was found.
    for _ in range(MOST_CARRIAGEWAYS):
        if not waiting:
            break
        some = waiting.pop(0)
        line = reference_line(some)
        if line is None or along(line)[-1] < SHORTEST:
            continue
        s, t = coordinates(line, np.column_stack([some.x, some.y]))
        rest = some.take(~np.isfinite(t))
        if len(rest) < len(some) and len(np.unique(rest.participant)) >= LEAST_VEHICLES:
            waiting.append(rest)
        found = _lanes(some, line, s, t)
        if isinstance(found, str):
            middle = line[len(line) // 2]
            refused.append(f"no lanes around ({middle[0]:.0f}, {middle[1]:.0f}): {found}")
            continue
        strips += _strips(found, group, len(strips))
        group += 1
    notes = [
        "lanes inferred from the paths; the outer lanes are taken to be as wide as those beside "
        f"them, one alone {USUAL:g} m"
    ] * bool(strips) + refused[:5]
    if not strips:
        notes.append("no lanes found in the paths: give a map")
    return assemble("inferred" if strips else "none", strips, notes)


def _lanes(pieces: Pieces, line: Float, s: Float, t: Float) -> _Found | str:
    """Return a carriageway's lanes, or why none are claimed."""
    station, course = along(line), headings_along(line)
    known = np.isfinite(t)
    at = np.clip(np.searchsorted(station, s[known]), 0, len(line) - 1)
    # Who crosses the carriageway says nothing of its lanes.
    straight = np.abs(wrap(pieces.heading[known] - course[at])) < SKEW
    s, t = s[known][straight], t[known][straight]
    vehicle = pieces.participant[known][straight]
    if len(np.unique(vehicle)) < LEAST_VEHICLES:
        return "too few vehicles"
    middles = _piles(t, vehicle)
    if not len(middles):
        return f"no lane with {LEAST_IN_LANE} vehicles"
    if len(np.unique(vehicle)) < LEAST_ON_AVERAGE * len(middles):
        return f"less than {LEAST_ON_AVERAGE} vehicles per lane"
    borders = _borders(middles)
    inside = (t[:, None] > borders[:, 0]) & (t[:, None] <= borders[:, 1])
    share = float(inside.any(axis=1).mean())
    if share < LEAST_SHARE:
        return f"only {share:.0%} of the paths keep to lanes"
    lane, on = inside.argmax(axis=1), inside.any(axis=1)
    offset = (t - borders.mean(axis=1)[lane]) / np.diff(borders, axis=1)[lane, 0]
    squares = np.bincount(lane[on], offset[on] ** 2) / np.maximum(np.bincount(lane[on]), 1)
    # A wrong lane is worse than none: paths that are spread evenly have piles by chance, too, and
    # their root mean square, 0.29 lane widths, tells.
    rms = float(np.sqrt((offset[on] ** 2).mean()))
    worst = float(np.sqrt(squares.max()))
    if rms > MOST_RMS or worst > MOST_IN_LANE:
        return f"the paths are {rms:.2f} lane widths (RMS) off the middles, in a lane {worst:.2f}"
    extents, which = [], []
    for k in range(len(borders)):
        here = inside[:, k]
        for begin, end in _extents(s[here], vehicle[here], station[-1]):
            extents.append(
                (
                    int(np.searchsorted(station, begin, side="right")) - 1,
                    min(int(np.searchsorted(station, end)), len(line) - 1) + 1,
                )
            )
            which.append(k)
    if not extents:
        return f"no lane of {SHORTEST:g} m"
    middle = 0.5 * (borders.min() + borders.max())
    line = line + middle * np.column_stack([-np.sin(course), np.cos(course)])
    return _Found(line, borders - middle, extents, np.array(which))


def _piles(t: Float, vehicle: Int) -> Float:
    """Return the middles of the lanes, from the right [m]."""
    edges = np.arange(-REACH - 2.0, REACH + 2.0 + BIN, BIN)
    density = gaussian_filter1d(np.histogram(t, edges)[0].astype(float), SPREAD / BIN)
    inner = density[1:-1]
    peaks = (np.flatnonzero((inner > density[:-2]) & (inner >= density[2:])) + 1).tolist()
    centre = 0.5 * (edges[1:] + edges[:-1])
    peaks = [
        k
        for k in peaks
        if len(np.unique(vehicle[np.abs(t - centre[k]) < 0.5 * NARROWEST])) >= LEAST_IN_LANE
    ]
    while True:
        for a, b in itertools.pairwise(peaks):
            lower = min(density[a], density[b])
            if density[a:b].min() > VALLEY * lower or centre[b] - centre[a] < NARROWEST:
                peaks.remove(a if density[a] < density[b] else b)
                break
        else:
            break
    return np.array([np.median(t[np.abs(t - centre[k]) < 0.5 * NARROWEST]) for k in peaks])


def _borders(middles: Float) -> Float:
    """Return the right and left borders of lanes: midway between two that are side by side."""
    apart = np.diff(middles)
    is_beside = apart <= WIDEST
    usual = float(np.median(apart[is_beside])) if is_beside.any() else USUAL
    found = np.column_stack([middles - 0.5 * usual, middles + 0.5 * usual])
    for k in np.flatnonzero(is_beside).tolist():
        found[k, 1] = found[k + 1, 0] = 0.5 * (middles[k] + middles[k + 1])
    return found


def _extents(s: Float, vehicle: Int, length: float) -> list[tuple[float, float]]:
    """Return where along the line a lane has traffic."""
    count = max(int(length // STRETCH), 1)
    stretch = np.minimum((s / length * count).astype(np.int64), count - 1)
    used = np.unique(stretch)
    found = []
    for run in np.split(used, np.flatnonzero(np.diff(used) > GAP + 1) + 1):
        if not len(run):
            continue
        here = (stretch >= run[0]) & (stretch <= run[-1])
        ends = float(s[here].min()), float(s[here].max())
        if ends[1] - ends[0] >= SHORTEST and len(np.unique(vehicle[here])) >= LEAST_IN_LANE:
            found.append(ends)
    return found


def _strips(found: _Found, group: int, first: int) -> list[Strip]:
    """Return a carriageway's lanes, all of one cross-section; ``first``: number of the first."""
    station, course = along(found.line), headings_along(found.line)
    sideways = np.column_stack([-np.sin(course), np.cos(course)])
    middle, width = found.borders.mean(axis=1), np.diff(found.borders, axis=1)[:, 0]
    made = []
    for (begin, end), k in zip(found.extents, found.lane.tolist(), strict=True):
        part = slice(begin, end)
        made.append(
            Strip(
                name=f"{group + 1}.{k + 1}",
                kind="driving",
                group=group,
                points=found.line[part] + middle[k] * sideways[part],
                width=np.full(end - begin, width[k]),
                station=station[part],
                left=_beside(found, begin, end, k, 1, first),
                right=_beside(found, begin, end, k, -1, first),
            )
        )
    return made


def _beside(found: _Found, begin: int, end: int, k: int, side: int, first: int) -> int:
    """Return the lane to the left (1) or right (-1) that is beside one for longest."""
    other = k + side
    if not 0 <= other < len(found.borders):
        return NONE
    if abs(found.borders[k, (side + 1) // 2] - found.borders[other, (1 - side) // 2]) > 1e-6:
        return NONE
    shared = [
        (min(end, b) - max(begin, a), -index)
        for index, ((a, b), lane) in enumerate(zip(found.extents, found.lane, strict=True))
        if lane == other
    ]
    best = max(shared, default=(0, 0))
    return first - best[1] if best[0] > 0 else NONE
