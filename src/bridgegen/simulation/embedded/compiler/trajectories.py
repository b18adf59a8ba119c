"""Trajectories that the road network gives: lines to follow, at a speed or by a timetable.

Those that depend on the row, or on entities, are laid when they begin (`layouts`).
"""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bridgegen.base import elementary
from bridgegen.base.arrays import Float
from bridgegen.base.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.simulation.embedded.compiler.curves import bends
from bridgegen.simulation.embedded.compiler.tables import Tables
from bridgegen.simulation.embedded.program import AlongTrajectory, Bend, LanePoint, Point

STEP = 0.2
"""Distance between two samples of a path [m]: 0.6 mm from the arc in a bend of 8 m radius."""

LONGEST = 100_000.0  # m, a trajectory

Corner = tuple[float, float, float | None]
"""A vertex: x, y [m], and the heading [rad] if it states one."""


def compile_trajectory(tables: Tables, action: osc.FollowTrajectoryAction) -> AlongTrajectory:
    """Return the path of a trajectory; unsupported elements are reported to ``tables``."""
    trajectory = action.trajectory_ref.trajectory
    if trajectory.closed is not False:
        tables.unsupported(trajectory, 'a Trajectory with closed="true"')
    line, timing = trajectory.shape.shape, action.time_reference.reference
    curve: tuple[Bend, ...] = ()
    if isinstance(line, osc.Polyline):
        positions = [vertex.position for vertex in line.vertices]
        stated = [
            None if vertex.time is None else tables.literal(vertex, "time", vertex.time)
            for vertex in line.vertices
        ]
    elif isinstance(line, osc.Clothoid | osc.ClothoidSpline):
        origin, curve, ends = bends(tables, line)
        assert origin is not None  # else it is laid
        positions, stated = [origin], list(ends)
    else:
        tables.unsupported(line, type(line).__name__)
        return AlongTrajectory((), action.line)
    points = [point for position in positions if (point := _point(tables, position)) is not None]
    elements = line.vertices if isinstance(line, osc.Polyline) else (line,) * len(stated)
    times = () if isinstance(timing, osc.NoTime) else usable_times(tables, line, stated)
    if times and isinstance(timing, osc.Timing):
        times = check_times(tables, timing, times, elements)
    start = tables.literal(action, "initialDistanceOffset", action.initial_distance_offset or 0.0)
    absolute = osc.ReferenceContext.ABSOLUTE
    if times and start and getattr(timing, "domain_absolute_relative", None) is absolute:
        tables.note(action, "absolute times say where it is, whatever its initialDistanceOffset")
        start = 0.0
    return AlongTrajectory(tuple(points), action.line, times, curve, start)


def _point(tables: Tables, position: osc.Position) -> Point | None:
    point, aside = tables.point(position)
    if not isinstance(point, LanePoint):
        return point
    where = position.position
    s, aside = tables.literal(where, "s", point.s), tables.literal(where, "offset", aside)
    return LanePoint(point.road, point.lane, s, point.line, aside)


def usable_times(
    tables: Tables, line: Element, stated: Sequence[float | None]
) -> tuple[float, ...]:
    """Return the times of a line [s], NaN for those that lengths give; none if they give no speed.

    A line that states none for its start begins at 0.
    """
    times = [math.nan if time is None else time for time in stated]
    known = len(times) - stated.count(None)
    if known and math.isnan(times[0]):
        times[0] = 0.0
    if len(times) - sum(map(math.isnan, times)) < 2:
        what = "one time" if known else "no times"
        tables.note(line, f"it states {what}: followed at the entity's own speed")
        return ()
    if known < len(times):
        tables.note(
            line,
            f"{len(times) - known} of its {len(times)} times are missing: a missing first one is "
            "0, the others follow from the lengths between those that are stated",
        )
    return tuple(times)


def filled(times: Sequence[float], knots: Float) -> list[float]:
    """Return times in which those that are NaN follow from the distances along the line [m].

    After the last known time, the speed is that of the stretch before it.

    Raises:
        InputError: they do not increase.
    """
    clock = np.array(times, dtype=np.float64)
    known = np.flatnonzero(~np.isnan(clock))
    if len(known) < len(clock):
        a, b = known[-2:]
        after = np.arange(b + 1, len(clock))
        with np.errstate(all="ignore"):
            pace = (clock[b] - clock[a]) / (knots[b] - knots[a])
            end = clock[b] + pace * (knots[after] - knots[b])
        clock = np.append(np.interp(knots[: b + 1], knots[known], clock[known]), end)
        clock[known] = np.asarray(times)[known]
    if not (np.isfinite(clock).all() and (np.diff(clock) > 0.0).all()):
        shown = ", ".join(f"{time:g}" for time in clock[:10])
        raise InputError(f"a trajectory whose times [s] do not increase: {shown}")
    return [float(time) for time in clock]


def begun(
    corners: Sequence[Corner], times: Sequence[float], start: float
) -> tuple[list[Corner], list[float]]:
    """Return the rest of a line from a distance on [m], where one is when the line would begin.

    Raises:
        InputError: it is not that long.
    """
    steps = [elementary.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(corners)]
    knots = np.cumsum([0.0, *steps])
    if not start < knots[-1]:
        limit = f"less than the trajectory's length, {knots[-1]:g}"
        raise InputError(f"initialDistanceOffset [m] must be {limit}, got {start:g}")
    i = int(np.searchsorted(knots, start, side="right")) - 1
    share = float((start - knots[i]) / steps[i])
    (x, y, h), (x_end, y_end, h_end) = corners[i : i + 2]
    if h is not None and h_end is not None:
        h += share * math.remainder(h_end - h, math.tau)
    late = times[i] + share * (times[i + 1] - times[i]) - times[0]
    first = (x + share * (x_end - x), y + share * (y_end - y), h)
    rest = [time - late for time in times[i + 1 :]]
    return [first, *corners[i + 1 :]], [times[0], *rest]


def check_times(
    tables: Tables, timing: osc.Timing, stated: Sequence[float], where: Sequence[Element]
) -> tuple[float, ...]:
    """Return when to be at each vertex [s]: a stated time, scaled and then moved; NaN stays."""
    scale = tables.literal(timing, "scale", timing.scale)
    offset = tables.literal(timing, "offset", timing.offset)
    times: list[float] = []
    before = math.nan
    for time, element in zip(stated, where, strict=True):
        what = f"a {type(element).__name__}"
        if math.isnan(time):
            times.append(time)
            continue
        # As the standard says: a scale of 2 takes twice as long. esmini divides by the scale, and
        # subtracts the offset.
        times.append(scale * time + offset)
        if not math.isfinite(times[-1]):
            tables.unsupported(element, f"{what} at {times[-1]:g} s")
        elif times[-1] <= before:
            tables.unsupported(
                element, f"{what} at {times[-1]:g} s after one at {before:g} s (not later)"
            )
        before = times[-1]
    return tuple(times)


def polyline(corners: Sequence[Corner], *, may_stand: bool = False) -> tuple[Float, float]:
    """Return the samples of the line from corner to corner as a path, and their distance [m].

    Args:
        corners: two or more.
        may_stand: whether all may be one point, which gives a path of a millimetre.

    Returns:
        ``(L, 6)``: x, y [m], heading [rad], its cosine and sine, curvature 0; and the step.

    Raises:
        InputError: the corners are one point and may not be, are not finite, or lie too far apart.
    """
    if not all(math.isfinite(value) for corner in corners for value in corner if value is not None):
        raise InputError("the vertices of a trajectory must be finite")
    lengths = [elementary.hypot(b[0] - a[0], b[1] - a[1]) for a, b in pairwise(corners)]
    total = sum(lengths)
    if total > LONGEST:
        raise InputError(f"a trajectory must be at most {LONGEST:g} m long, got {total:g} m")
    if total <= 0.0:
        if not may_stand:
            raise InputError("a trajectory must have a length, got one point")
        x, y, h = corners[0]
        h = h or 0.0
        end = (x + 1e-3 * elementary.cos(h), y + 1e-3 * elementary.sin(h), h)
        return polyline((corners[0], end))
    count = math.ceil(total / STEP)
    step = total / count
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    s = np.arange(count + 1) * step
    x_s = np.interp(s, knots, [corner[0] for corner in corners])
    y_s = np.interp(s, knots, [corner[1] for corner in corners])
    headings = np.unwrap([elementary.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(corners)])
    at = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(headings) - 1)
    h_s = headings[at]
    return np.stack(
        [x_s, y_s, h_s, elementary.cos(h_s), elementary.sin(h_s), np.zeros_like(s)], axis=1
    ), step


def timetable(corners: Sequence[Corner], times: Sequence[float], start: float = 0.0) -> Float:
    """Return the timed poses of an entity that follows a trajectory.

    Position is linear between two vertices. Heading turns the short way round between two that
    state one, and else is the direction of travel. Before the first vertex the entity stands.

    Args:
        corners: V ≥ 2 vertices.
        times: their times [s], increasing.
        start: how far along its line the first one is [m].

    Returns:
        ``(V - 1, 10)``, a row per segment; see ``_follow_kernels``.
    """
    clock = np.asarray(times, dtype=np.float64)
    place = np.array([corner[:2] for corner in corners], dtype=np.float64)
    steps = np.diff(place, axis=0)
    knots = np.cumsum([start, *elementary.hypot(steps[:, 0], steps[:, 1])])
    begins, ends = _headings(corners, place)
    columns = (clock[:-1], clock[1:], *place[:-1].T, *place[1:].T, begins, ends)
    return np.stack((*columns, knots[:-1], knots[1:]), axis=1)


def _headings(corners: Sequence[Corner], place: Float) -> tuple[Float, Float]:
    """Return the heading at the beginning and at the end of every segment [rad]."""
    begins, ends = [], []
    direction = corners[0][2] or 0.0
    for (_, _, h), (_, _, following), (dx, dy) in zip(
        corners[:-1], corners[1:], np.diff(place, axis=0).tolist(), strict=True
    ):
        if dx or dy:
            direction = elementary.atan2(dy, dx)
        if h is None or following is None:
            h = following = direction
        begins.append(h)
        ends.append(following - math.tau * round((following - h) / math.tau))
    return np.array(begins), np.array(ends)
