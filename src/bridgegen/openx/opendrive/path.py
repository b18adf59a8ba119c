"""The centre line of a chain of lanes, as a function of the distance travelled.

A chain is cut where any of its formulas changes. On most pieces the centre lies at a constant t
from a line or an arc, so it is itself a line or an arc and is evaluated in closed form, all of
them at once; the others (spirals, cubics, tapers) are followed by quadrature, one by one.
"""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace
from itertools import pairwise
from typing import Any, NamedTuple

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.geometry import (
    NODES,
    WEIGHTS,
    Curve,
    evaluate,
    geometry_index,
    integrate,
    invert,
    pose,
    stretch,
)
from bridgegen.openx.opendrive.lanes import (
    Coefficients,
    breaks,
    centre_of,
    shifted,
    width_of,
)
from bridgegen.openx.opendrive.model import Lane, LaneSection, Road
from bridgegen.openx.opendrive.plan_view import Arc, Geometry, Line, Spiral

# Records that begin at nearly the same s are one change; a piece of no length would have no
# direction.
SHORTEST = 1e-9
"""Length below which pieces are left out [m]."""
MOST_SAMPLES = 2_000_000


@dataclass(frozen=True, eq=False, slots=True)
class LanePath:
    """The centre line of a route at a uniform step.

    The last sample lies at the route's end or up to one step beyond it (where its last piece is
    continued), so that values can be interpolated everywhere on [0, ``length``].

    Attributes:
        ds: the step [m].
        length: of the route [m].
        s: ``(P,)`` float64 [m], distance travelled: 0, ds, 2·ds …
        x: ``(P,)`` float64 [m].
        y: ``(P,)`` float64 [m].
        h: ``(P,)`` float64 [rad], direction of travel, continuous (not wrapped).
        curvature: ``(P,)`` float64 [1/m], positive to the left.
        lane_width: ``(P,)`` float64 [m], ≥ 0.
    """

    ds: float
    length: float
    s: Float
    x: Float
    y: Float
    h: Float
    curvature: Float
    lane_width: Float


class Piece(NamedTuple):
    """A stretch of a lane's centre between two changes of formula, in the direction of travel.

    Attributes:
        road_id: the road it is on.
        station: distance travelled at its start [m].
        length: of the centre line [m].
        x: of its start [m].
        y: of its start [m].
        h: direction of travel at its start [rad], continuous along the chain.
        curvature: of the centre line [1/m], where it is an arc or a line.
        s: of its start, along the road [m].
        s_end: of its end, along the road [m]; less than ``s`` against the reference line.
        width: the lane's width over the distance along the road from ``s``, in road direction.
        taper: what to follow where the centre is neither line nor arc.
        is_aside: whether it leads from one lane to another, beside the lane's centre.
    """

    road_id: str
    station: float
    length: float
    x: float
    y: float
    h: float
    curvature: float
    s: float
    s_end: float
    width: Coefficients
    taper: "Taper | None" = None
    is_aside: bool = False

    @property
    def rate(self) -> float:
        """Metres along the road per metre travelled; negative against the reference line."""
        return (self.s_end - self.s) / self.length

    def stations(self, s: Float) -> Float:
        """Return the stations of places along the road, ``(P,)`` float64 [m].

        Places before the piece or after it continue it straight on.
        """
        if self.taper is None:
            b = self.length / (self.s_end - self.s)
            return (self.station - b * self.s) + b * s
        return self.station + self.taper.reached((s - self.s) * (1 if self.rate > 0.0 else -1))

    def as_json(self) -> dict[str, Any]:
        """Return what gives `stations` elsewhere: ``first + each * s``, or a taper.

        Raises:
            InputError: it follows a cubic.
        """
        low, high = sorted((self.s, self.s_end))
        if self.taper is not None:
            found = {"first": self.station, "s": self.s, **self.taper.as_json()}
        else:
            b = self.length / (self.s_end - self.s)
            found = {"first": self.station - b * self.s, "each": b}
        return {"low": low, "high": high, **found}


@dataclass(frozen=True, eq=False, slots=True)
class Taper:
    """A lane's centre at a changing t, or beside a curve that is no arc.

    Attributes:
        geometry: of the reference line.
        start: where the cubic of t begins [m after the geometry's start].
        t: of the centre, over the distance from there.
        direction: 1 along the reference line, -1 against it.
        nodes: ``(K,)`` float64, distance in the direction of travel along the road [m].
        travelled: ``(K,)`` float64, distance along the centre up to each node [m].
        entry: where the piece is entered [m after ``start``].
    """

    geometry: Geometry
    start: float
    t: Coefficients
    direction: int
    entry: float
    nodes: Float
    travelled: Float

    @classmethod
    def along(
        cls, geometry: Geometry, start: float, t: Coefficients, direction: int, span: float
    ) -> "Taper":
        """Return the taper over ``span`` [m] of road from ``start``."""
        entry = 0.0 if direction > 0 else span
        # A station is looked up between nodes and then corrected by quadrature, so the nodes decide
        # where to start, not how exact the result is.
        nodes = np.linspace(0.0, span, max(8, math.ceil(span / 0.5)) + 1)
        taper = cls(geometry, start, t, direction, entry, nodes, nodes)
        steps = integrate(taper.speed, nodes[:-1], nodes[1:])
        return replace(taper, travelled=np.concatenate(([0.0], np.cumsum(steps))))

    def speed(self, distance: Float) -> Float:
        """Return the metres of centre line per metre of road."""
        forward, sideways, _, _ = self._frame(distance)
        return elementary.hypot(forward, sideways)

    def least_stretch(self) -> float:
        """Return the least that the centre advances per metre of road; it must stay positive."""
        return float(np.min(self._frame(self.nodes)[0]))

    def reached(self, distance: Float) -> Float:
        """Return how far the centre leads up to distances in the direction of travel along s."""
        within = np.clip(distance, 0.0, self.nodes[-1])
        cell = np.clip(
            np.searchsorted(self.nodes, within, side="right") - 1, 0, len(self.nodes) - 2
        )
        travelled = self.travelled[cell] + integrate(self.speed, self.nodes[cell], within)
        beyond: Float = travelled + (distance - within)
        return beyond

    def as_json(self) -> dict[str, Any]:
        """Return what gives `reached` elsewhere; "curvature": at the geometry's start, its rate.

        Raises:
            InputError: it lies along a cubic.
        """
        shape = self.geometry.shape
        match shape:
            case Spiral():
                rate = (shape.curv_end - shape.curv_start) / self.geometry.length
                curvature = [shape.curv_start, rate]
            case Arc():
                curvature = [shape.curvature, 0.0]
            case Line():
                curvature = [0.0, 0.0]
            case _:
                raise InputError("an entity starts beside a cubic")
        return {
            **{"start": self.start, "t": self.t, "curvature": curvature, "entry": self.entry},
            **{"direction": self.direction, "nodes": self.nodes.tolist()},
            **{"travelled": self.travelled.tolist(), "weights": WEIGHTS.tolist()},
            "quadrature": NODES.tolist(),
        }

    def at(self, travelled: Float) -> tuple[Float, Float, Float, Float, Float]:
        """Return x, y, h, curvature, and the distance along the road from ``start``."""
        distance = invert(self.speed, self.nodes, self.travelled, travelled)
        forward, sideways, line, (t, dt, ddt) = self._frame(distance)
        square = forward * forward + sideways * sideways
        scale = stretch(self.geometry)
        slowing = -scale * (scale * line.curvature_rate * t + line.curvature * dt)
        tilt = elementary.atan2(sideways, forward)
        tilting = (ddt * forward - dt * slowing) / square
        curvature = (scale * line.curvature + tilting) / np.sqrt(square)
        h = line.h + tilt
        if self.direction < 0:
            h, curvature = h + math.pi, -curvature
        return (
            line.x - t * elementary.sin(line.h),
            line.y + t * elementary.cos(line.h),
            np.unwrap(h),
            curvature,
            self.entry + self.direction * distance,
        )

    def _frame(self, distance: Float) -> tuple[Float, Float, Curve, tuple[Float, Float, Float]]:
        local = self.entry + self.direction * distance.ravel()
        line = evaluate(self.geometry, self.start + local)
        a, b, c, d = self.t
        t = a + local * (b + local * (c + local * d))
        dt = b + local * (2.0 * c + local * 3.0 * d)
        forward = (stretch(self.geometry) * (1.0 - line.curvature * t)).reshape(distance.shape)
        return forward, dt.reshape(distance.shape), line, (t, dt, 2.0 * c + local * 6.0 * d)


def pieces_of(
    road: Road,
    section_index: int,
    lane_id: int,
    s: float,
    s_end: float,
    station: float,
    across: Coefficients | None = None,
) -> list[Piece]:
    """Cut a lane from ``s`` to ``s_end`` into pieces; ``station`` [m] is travelled before it.

    Args:
        road: the road.
        section_index: of its lane section.
        lane_id: OpenDRIVE's id.
        s: where to begin [m along the road].
        s_end: where to end.
        station: see above.
        across: t [m] over the distance from the lesser s, instead of the lane's centre.

    Raises:
        InputError: the road has no such lane there, or the lane folds over inside a bend.
    """
    section = road.sections[section_index]
    lane = section.lane(lane_id)
    if lane is None:
        raise InputError(f"road {road.id} has no lane {lane_id} at s={s:g} m")
    low, high = min(s, s_end), max(s, s_end)
    cuts = sorted({low, high, *(cut for cut in breaks(road, section, lane) if low < cut < high)})
    spans = [span for span in pairwise(cuts) if span[1] - span[0] > SHORTEST]
    direction = 1 if s_end > s else -1
    found: list[Piece] = []
    for a, b in spans if direction > 0 else reversed(spans):
        t = None if across is None else shifted(across, a - low)
        piece = _piece(road, section, lane, a, b, direction, station, t)
        station += piece.length
        found.append(piece)
    return found


def _piece(
    road: Road,
    section: LaneSection,
    lane: Lane,
    a: float,
    b: float,
    direction: int,
    station: float,
    across: Coefficients | None,
) -> Piece:
    inside = 0.5 * (a + b)
    geometry = road.plan_view[geometry_index(road, inside)]
    t = centre_of(road, section, lane, a, inside) if across is None else across
    width = width_of(section, lane, a, inside)
    s, s_end = (a, b) if direction > 0 else (b, a)
    if direction < 0:
        width = shifted(width, b - a)
    # A parallel of a line is a line, and of an arc an arc: closed formulas, for most of a map. All
    # else is followed by quadrature.
    if isinstance(geometry.shape, Line | Arc) and t[1:] == (0.0, 0.0, 0.0):
        x, y, h, curvature = pose(geometry, s - geometry.s)
        stretch = 1.0 - curvature * t[0]
        _check_fold(stretch, road, lane, inside)
        x, y = x - t[0] * elementary.sin(h), y + t[0] * elementary.cos(h)
        if direction < 0:
            h += math.pi
        bend = direction * curvature / stretch
        aside = across is not None
        length = stretch * (b - a)
        return Piece(road.id, station, length, x, y, h, bend, s, s_end, width, None, aside)
    taper = Taper.along(geometry, a - geometry.s, t, direction, b - a)
    _check_fold(taper.least_stretch(), road, lane, inside)
    x, y, h, bend = (float(part[0]) for part in taper.at(np.zeros(1))[:4])
    length = float(taper.travelled[-1])
    return Piece(
        road.id, station, length, x, y, h, bend, s, s_end, width, taper, across is not None
    )


def _check_fold(stretch: float, road: Road, lane: Lane, s: float) -> None:
    # Beyond the bend's centre a parallel runs backwards: cars on it would turn round on the spot.
    if stretch < 1e-3:
        raise InputError(
            f"a lane's centre must lie on the near side of a bend's centre, but lane {lane.id} of "
            f"road {road.id} lies beyond it at s={s:g} m"
        )


def joined(pieces: list[Piece]) -> list[Piece]:
    """Return the pieces with headings that do not jump by whole turns from one to the next."""
    found = pieces[:1]
    for piece in pieces[1:]:
        last = found[-1]
        if last.taper is None:
            before = last.h + last.curvature * last.length
        else:
            turned = last.taper.at(last.taper.travelled)[2]
            before = last.h + float(turned[-1] - turned[0])
        # Whole turns only: a kink within the file's tolerance stays in the heading, as it is drawn.
        turns = round((before - piece.h) / math.tau)
        found.append(piece._replace(h=piece.h + turns * math.tau) if turns else piece)
    return found


def sample(pieces: Sequence[Piece], length: float, ds: float) -> LanePath:
    """Evaluate a chain of pieces at a uniform step.

    Raises:
        InputError: the step is not positive, or so small that there are too many samples.
    """
    if not (ds > 0.0 and length / ds <= MOST_SAMPLES):
        raise InputError(
            f"{length / MOST_SAMPLES:g} <= ds [m] must hold on a route of {length:g} m, got {ds:g}"
        )
    s = np.arange(math.ceil(length / ds - 1e-9) + 1, dtype=np.float64) * np.float64(ds)
    starts = np.array([piece.station for piece in pieces])
    which = np.maximum(np.searchsorted(starts, s, side="right") - 1, 0)
    table = np.array(
        [
            (p.station, p.x, p.y, p.h, 0.5 * p.curvature, p.curvature, p.rate, *p.width)
            for p in pieces
        ]
    )
    start, x, y, h, half, curvature, rate, *width = table.T[:, which]
    local = s - start
    half *= local
    chord = local * np.sinc(half / math.pi)
    h += half
    x += chord * elementary.cos(h)
    y += chord * elementary.sin(h)
    h += half
    along = rate * local
    for index, piece in enumerate(pieces):
        if piece.taper is not None:
            at = np.flatnonzero(which == index)
            # The taper's own start comes with the samples, so that heading and place along the road
            # count from it.
            found = piece.taper.at(np.concatenate(([0.0], local[at])))
            x[at], y[at], curvature[at] = found[0][1:], found[1][1:], found[3][1:]
            h[at] = piece.h + (found[2][1:] - found[2][0])
            along[at] = found[4][1:] - found[4][0]
    a, b, c, d = width
    lane_width: Float = np.maximum(a + along * (b + along * (c + along * d)), 0.0)
    return LanePath(ds, length, s, x, y, h, curvature, lane_width)
