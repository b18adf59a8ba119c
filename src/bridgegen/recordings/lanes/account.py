"""What a recording's lanes are, in short: for tables and pictures."""

from dataclasses import dataclass

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.recordings.lanes.find import Located

LANES_DRAWN = 600
POINTS_DRAWN = 60
"""Number of points of a lane's border that are drawn."""


@dataclass(frozen=True)
class Carriageway:
    """A carriageway on which something was recorded.

    Attributes:
        number: in `RecordedLanes`, from 0.
        lanes: most driving lanes side by side; 0 of bicycle lanes and sidewalks alone.
        width: mean of its lanes, by states [m].
        length: between its least and greatest station of lanes with states [m].
        states: on it.
        rms: of the offsets from the middles of lanes [m].
        p95: of a lane, the greatest [m].
    """

    number: int
    lanes: int
    width: float
    length: float
    states: int
    rms: float
    p95: float


@dataclass(frozen=True, eq=False)
class LanesFound:
    """The lanes of a recording, in short.

    Attributes:
        source: as in `RecordedLanes`.
        carriageways: with states, most first.
        vehicle_share: as in `Fit`.
        km_on: of paths on lanes [km].
        km_off: of paths off lanes [km].
        notes: in sentences.
        borders: of lanes near the paths, left and right, ``(n, 2)`` each [m].
    """

    source: str
    carriageways: tuple[Carriageway, ...]
    vehicle_share: float
    km_on: float
    km_off: float
    notes: tuple[str, ...]
    borders: tuple[Float, ...]


def account_of(located: Located, low: Float, high: Float) -> LanesFound:
    """Return a recording's lanes in short; ``low``, ``high``: corners of what is drawn [m]."""
    lanes, fit = located.lanes, located.fit
    found = []
    for number in np.unique(lanes.carriageway[fit.states > 0]).tolist():
        on = np.flatnonzero((lanes.carriageway == number) & (fit.states > 0))
        states = fit.states[on]
        width = np.array([lanes.width[lanes.points(lane)].mean() for lane in on.tolist()])
        station = np.concatenate([lanes.station[lanes.points(lane)] for lane in on.tolist()])
        of = lanes.carriageway == number
        found.append(
            Carriageway(
                number,
                int(lanes.number[of].max()),
                float(np.average(width, weights=states)),
                float(np.ptp(station)),
                int(states.sum()),
                float(np.sqrt(np.average(fit.rms[on] ** 2, weights=states))),
                float(fit.p95[on].max()),
            )
        )
    found.sort(key=lambda carriageway: (-carriageway.states, carriageway.number))
    return LanesFound(
        lanes.source,
        tuple(found),
        fit.vehicle_share,
        fit.km_on,
        fit.km_off,
        lanes.notes,
        tuple(_borders(located, low, high)),
    )


def _borders(located: Located, low: Float, high: Float) -> list[Float]:
    """Return borders of lanes within what is drawn, of those with states first."""
    lanes, found = located.lanes, []
    for lane in np.argsort(-located.fit.states, kind="stable").tolist():
        part = lanes.points(lane)
        middle = np.column_stack([lanes.x[part], lanes.y[part]])
        inside = np.flatnonzero(((middle >= low) & (middle <= high)).all(axis=1))
        if len(inside) < 2:
            continue
        ends = inside[0], inside[-1]
        at = np.unique(np.linspace(*ends, min(POINTS_DRAWN, ends[1] - ends[0] + 1)).astype(int))
        h = lanes.heading[part][at]
        aside = 0.5 * lanes.width[part][at, None] * np.column_stack([-np.sin(h), np.cos(h)])
        found += [middle[at] + aside, middle[at] - aside]
        if len(found) >= 2 * LANES_DRAWN:
            break
    return found
