"""Trajectories: lines to follow, at the entity's own speed or by a timetable."""

import math
from collections.abc import Sequence
from itertools import pairwise

import numpy as np

from bridgegen.arrays import Float
from bridgegen.errors import InputError
from bridgegen.openx.openscenario import model as osc
from bridgegen.simulation.embedded.program import AlongTrajectory, LanePoint, Point
from bridgegen.simulation.embedded.tables import Tables

STEP = 0.2
"""Between two samples of a path [m]: 0.6 mm from the arc in a bend of 8 m radius."""

LONGEST = 100_000.0  # m, a trajectory

SAME_TIME = 1e-9  # s, an instant this close to a vertex's is the vertex's

Corner = tuple[float, float, float | None]
"""A vertex: x, y [m], and the heading [rad] if it states one."""


def compile_trajectory(tables: Tables, action: osc.FollowTrajectoryAction) -> AlongTrajectory:
    """Return the path of a trajectory; what cannot be run is taken down in ``tables``."""
    mode = action.trajectory_following_mode.following_mode
    if mode is not osc.FollowingMode.POSITION:
        tables.unsupported(action.trajectory_following_mode, f'followingMode="{mode}"')
    if action.initial_distance_offset not in (None, 0.0):
        tables.unsupported(action, f'initialDistanceOffset="{action.initial_distance_offset}"')
    trajectory = action.trajectory_ref.trajectory
    if trajectory.closed is not False:
        tables.unsupported(trajectory, 'a Trajectory with closed="true"')
    line = trajectory.shape.shape
    if not isinstance(line, osc.Polyline):
        tables.unsupported(line, type(line).__name__)
        return AlongTrajectory((), action.line)
    vertices = line.vertices
    points: list[Point] = []
    for vertex in vertices:
        point, aside = tables.point(vertex.position)
        if isinstance(point, LanePoint):
            where = vertex.position.position
            s = tables.literal(where, "s", point.s)
            aside = tables.literal(where, "offset", aside)
            point = LanePoint(point.road, point.lane, s, point.line, aside)
        if point is not None:
            points.append(point)
    timing = action.time_reference.reference
    times = () if isinstance(timing, osc.NoTime) else _times(tables, timing, vertices)
    return AlongTrajectory(tuple(points), action.line, times)


def _times(tables: Tables, timing: osc.Timing, vertices: Sequence[osc.Vertex]) -> tuple[float, ...]:
    """Return when to be at each vertex [s]; an initial action's time is the simulation's."""
    scale = tables.literal(timing, "scale", timing.scale)
    offset = tables.literal(timing, "offset", timing.offset)
    times: list[float] = []
    for vertex in vertices:
        if vertex.time is None:
            tables.unsupported(vertex, "a Vertex without a time in a trajectory with times")
            continue
        times.append(scale * tables.literal(vertex, "time", vertex.time) + offset)
        if not math.isfinite(times[-1]):
            tables.unsupported(vertex, f"a Vertex at {times[-1]:g} s")
        elif len(times) > 1 and not times[-1] > times[-2]:
            tables.unsupported(
                vertex, f"a Vertex at {times[-1]:g} s after one at {times[-2]:g} s (not later)"
            )
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
    lengths = [math.dist(a[:2], b[:2]) for a, b in pairwise(corners)]
    total = sum(lengths)
    if total > LONGEST:
        raise InputError(f"a trajectory must be at most {LONGEST:g} m long, got {total:g} m")
    if total <= 0.0:
        if not may_stand:
            raise InputError("a trajectory must have a length, got one point")
        x, y, h = corners[0]
        h = h or 0.0
        end = (x + 1e-3 * math.cos(h), y + 1e-3 * math.sin(h), h)
        return polyline((corners[0], end))
    count = math.ceil(total / STEP)
    step = total / count
    knots = np.concatenate([[0.0], np.cumsum(lengths)])
    s = np.arange(count + 1) * step
    x_s = np.interp(s, knots, [corner[0] for corner in corners])
    y_s = np.interp(s, knots, [corner[1] for corner in corners])
    headings = np.unwrap([math.atan2(b[1] - a[1], b[0] - a[0]) for a, b in pairwise(corners)])
    at = np.clip(np.searchsorted(knots, s, side="right") - 1, 0, len(headings) - 1)
    h_s = headings[at]
    return np.stack([x_s, y_s, h_s, np.cos(h_s), np.sin(h_s), np.zeros_like(s)], axis=1), step


def timetable(corners: Sequence[Corner], times: Sequence[float], instants: Float) -> Float:
    """Return the states of who follows a trajectory by its times.

    Position is linear between two vertices, and exactly a vertex's at its time. Heading turns the
    short way round between two vertices that state one, and else is the direction of travel. Speed
    is distance by time, at a vertex that of the segment which ends there. Before the first vertex
    and after the last one the entity stands.

    Args:
        corners: V ≥ 2 vertices.
        times: their times [s], increasing.
        instants: ``(T,)`` [s], increasing.

    Returns:
        ``(T, 6)``: x, y [m], heading [rad] (continuous), speed [m/s], acceleration up to the next
        instant [m/s²] (at the end of the trajectory what it was before), metres travelled.
    """
    clock = np.asarray(times, dtype=np.float64)
    place = np.array([corner[:2] for corner in corners], dtype=np.float64)
    leg = np.hypot(*np.diff(place, axis=0).T)
    knots = np.concatenate([[0.0], np.cumsum(leg)])
    after = np.searchsorted(clock, instants - SAME_TIME)  # the vertex that comes now or next
    moving = (instants >= clock[0] - SAME_TIME) & (after < len(clock))
    i = np.clip(after, 1, len(clock) - 1) - 1
    span = clock[i + 1] - clock[i]
    u = np.clip((instants - clock[i]) / span, 0.0, 1.0)
    u[np.abs(instants - clock[i + 1]) <= SAME_TIME] = 1.0
    at_end = u == 1.0  # start + 1·(end - start) may miss the end by a rounding
    begins, ends = _headings(corners, place)
    table = np.empty((len(instants), 6))
    table[:, :2] = np.where(
        at_end[:, None], place[i + 1], place[i] + u[:, None] * (place[i + 1] - place[i])
    )
    table[:, 2] = np.unwrap(np.where(at_end, ends[i], begins[i] + u * (ends[i] - begins[i])))
    table[:, 3] = np.where(moving, leg[i] / span, 0.0)
    table[:, 4] = np.append(np.diff(table[:, 3]) / np.diff(instants), 0.0)
    table[:, 5] = knots[i] + u * leg[i]
    last = np.flatnonzero(moving)[-1:]
    table[last, 4] = table[last - 1, 4] if last > 0 else 0.0
    return table


def _headings(corners: Sequence[Corner], place: Float) -> tuple[Float, Float]:
    """Return the heading at the beginning and at the end of every segment [rad]."""
    begins, ends = [], []
    direction = corners[0][2] or 0.0
    for (_, _, h), (_, _, following), (dx, dy) in zip(
        corners[:-1], corners[1:], np.diff(place, axis=0).tolist(), strict=True
    ):
        if dx or dy:
            direction = math.atan2(dy, dx)
        if h is None or following is None:
            h = following = direction
        begins.append(h)
        ends.append(following - math.tau * round((following - h) / math.tau))
    return np.array(begins), np.array(ends)
