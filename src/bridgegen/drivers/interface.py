"""What a user's own driver gets and returns: arrays over N scenarios at once.

A driver is a class without arguments:

    class MyDriver:
        def reset(self, n, scene): ...
        def act(self, observation): return Control(acceleration, curvature)

``reset`` is called before the first instant of every batch, ``act`` once per instant. Scenario i of
a batch must not depend on the other ones: how batches are cut depends on the machine.

What costs time is given only to a driver that asks for it, by a class attribute:

    class MyDriver:
        wants = ("lanes", "map")

A driver that can drive so many scenarios at once at most says so likewise: ``max_rows = 1``.
"""

from dataclasses import dataclass, field, fields, is_dataclass
from typing import Any, Protocol, Self, TypeVar

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int

ROUTE_POINTS = 40
"""Number P of points of the route ahead in an observation."""

ROUTE_STEP = 2.0
"""Distance between two points of the route ahead [m]."""

HISTORY, HISTORY_STEP = 11, 0.1
"""Number H of instants of a history, and time between two of them [s]."""


NEAR_PIECES = 128
"""Largest number Q of the nearest pieces of the map that a `MapView` has."""

CONFLICT_WAYS = 6
"""Largest number W of ways of a participant in `Conflicts`."""

WANTS = {
    "lanes": "speed limit, width and the lanes beside along the route; the way to its end",
    "map": "the road network: lanes, markings, crosswalks, lights; the part of it around the ego",
    "conflicts": "where the ways of others meet the route, and who gives way there",
    "history": "the tracks of the last second",
    "seed": "a seed for each scenario's random numbers; another one in each repeat (--repeats)",
}
"""Inputs that a driver may ask for by its attribute ``wants``, with descriptions."""


@dataclass(frozen=True)
class Scene:
    """What does not change while a batch runs.

    Attributes:
        time_step: seconds between two calls of ``act``.
        n_steps: how many calls there are at most.
        names: of the M other participants.
        kinds: ``(M,)`` int64, what they are, see ``bridgegen.drivers.kinds``.
        length: of the ego's body [m].
        width: of the ego's body [m].
        centre: of the body, ahead of the reference point, the rear axle's centre [m].
        max_speed: [m/s].
        max_acceleration: [m/s²].
        max_deceleration: [m/s²], > 0.
        max_curvature: of its path at full lock [1/m].
        maps: of the R road networks of the batch, if the driver wants "map"; else empty.
        map_of: ``(N,)`` int64, which of them each scenario has; empty if it does not.
        seed: ``(N,)`` int64, 0 .. 2**32 - 1, of each scenario's random numbers, if the driver wants
            "seed"; else empty.
    """

    time_step: float
    n_steps: int
    names: tuple[str, ...]
    kinds: Int
    length: float
    width: float
    centre: float
    max_speed: float
    max_acceleration: float
    max_deceleration: float
    max_curvature: float
    maps: tuple["RoadMap", ...] = ()
    map_of: Int = field(default_factory=lambda: np.zeros(0, dtype=np.int64))
    seed: Int = field(default_factory=lambda: np.zeros(0, dtype=np.int64))


@dataclass(frozen=True)
class Observation:
    """One instant of N scenarios, in world coordinates.

    Attributes:
        time: since the scenario's start [s].
        running: ``(N,)`` bool; a scenario that has ended stays in the batch, and the control for
            it is ignored.
        x: ``(N,)`` float64 [m], the ego's reference point.
        y: ``(N,)`` float64 [m].
        h: ``(N,)`` float64 [rad], heading, counter-clockwise from +x.
        v: ``(N,)`` float64 [m/s], forward speed.
        a: ``(N,)`` float64 [m/s²], acceleration of the last step.
        target_speed: ``(N,)`` float64 [m/s], what the scenario asks of the ego.
        offset: ``(N,)`` float64 [m], of the reference point from the route, left positive.
        route: ``(N, P, 4)`` float64: x, y [m], heading [rad], curvature [1/m] of the route's points
            ahead, every ``ROUTE_STEP`` metres from the point beside the ego; straight on beyond
            its end.
        tracks: ``(N, M, 13)`` float64, the other participants as the sensors track them: state (0
            none or absent, 1 tentative, 2 confirmed, 3 coasting), x, y of the box's
            centre [m], heading [rad], velocity in x and y [m/s], length, width [m], class (see
            ``bridgegen.drivers.kinds``), confidence, seconds since last seen, seconds tracked,
            indicators and brake lights (see ``bridgegen.drivers.kinds``). With
            ``--ideal perception`` they are the truth.
        stop_distance: ``(N,)`` float64 [m], from the front of the ego to the next stop line of a
            light on its route; +inf where there is none.
        light: ``(N,)`` int8, that light's state, see `Rollout.lights`; 0 where there is none.
        weather: ``(N, 8)`` float64, the weather as it is: visual range [m], rain and snow [mm/h of
            water], the sun's azimuth and elevation [rad], its illuminance on the ground [lx] (< 0:
            as the sun stands), clouds' share of the sky, friction as a share of that of a dry road.
        lanes: along the route, if the driver wants "lanes".
        map: what of the road network is near, if it wants "map".
        conflicts: where others' ways meet the route, if it wants "conflicts".
        history: ``(N, M, H, 13)`` float64, if it wants "history": `tracks` of the last second, now
            first, one for each ``HISTORY_STEP``; state 0 before the scenario began.
    """

    time: float
    running: Bool
    x: Float
    y: Float
    h: Float
    v: Float
    a: Float
    target_speed: Float
    offset: Float
    route: Float
    tracks: Float
    stop_distance: Float
    light: npt.NDArray[np.int8]
    weather: Float | None = None
    lanes: "Lanes | None" = None
    map: "MapView | None" = None
    conflicts: "Conflicts | None" = None
    history: Float | None = None

    def take(self, rows: Int | slice) -> Self:
        """Return the observation of some of the scenarios."""
        return _taken(self, rows)


Part = TypeVar("Part")


def _taken(part: Part, rows: Int | slice) -> Part:
    """Return some of the rows of an observation, or of a part of one."""
    found = {}
    for item in fields(part):  # type: ignore[arg-type]
        value = getattr(part, item.name)
        if isinstance(value, np.ndarray):
            value = value[rows]
        elif is_dataclass(value):
            value = _taken(value, rows)
        found[item.name] = value
    return type(part)(**found)


@dataclass(frozen=True)
class Lanes:
    """The road along the route, at its P points.

    Attributes:
        speed_limit: ``(N, P)`` float64 [m/s]; +inf where none is posted.
        width: ``(N, P)`` float64 [m], of the route's own lane.
        junction: ``(N, P)`` bool, whether the point is inside a junction.
        beside: ``(N, P, 2, 4)`` float64, the lane to the left (0) and to the right (1): how far to
            the left of the route its centre is [m] (so the right one's is negative), its width
            [m], its direction (1 as the route, -1 against it, 0: there is none), and whether the
            marking between allows to change to it (1).
        ends: ``(N,)`` float64 [m], along the route to its end, where the scenario's goal is.
        goal: ``(N, 3)`` float64, x, y [m] and heading [rad] there.
        stop_sign: ``(N,)`` float64 [m], from the front of the ego to the line of the next stop sign
            on the route; +inf where there is none.
        crosswalk: ``(N, 4)`` float64 [m] of the first crosswalk on the route that the ego has not
            left: from its front to where the route enters it, from its rear to where the route
            leaves it, and how far that reaches to the left of the route and (negative) to the
            right; +inf where there is none.

    Lanes beside are those that cars travel on, 2.2 m wide at least, as for the reference driver.
    Beyond the route's end the values are those of its end. Where the ego is on a path other than
    its first route (its storyboard gave it a new one), only ``ends`` and ``goal`` are known, those
    of that path; elsewhere there is no limit, no lane beside, no stop sign, no crosswalk, and the
    width is 0.
    """

    speed_limit: Float
    width: Float
    junction: Bool
    beside: Float
    ends: Float
    goal: Float
    stop_sign: Float
    crosswalk: Float


@dataclass(frozen=True)
class MapView:
    """What of the road networks is near the ego, in the frame of `RoadMap`: the world.

    `bridgegen.drivers.polylines` makes of it arrays of fixed size in the ego's frame, as learned
    planners take them.

    Attributes:
        lane: ``(N,)`` int64, the index in `RoadMap.lanes` of the lane that the ego is on; -1 off
            all lanes.
        near: ``(N, Q)`` int32, the indices of the nearest pieces of `RoadMap.pieces`, the nearest
            first; -1 beyond the last one.
        lights: ``(N, L)`` int8, the states of all traffic lights, in the order of
            `RoadMap.lights`.
    """

    lane: Int
    near: npt.NDArray[np.int32]
    lights: npt.NDArray[np.int8]


@dataclass(frozen=True)
class Conflicts:
    """Where ways that others may take meet the ego's route; a participant may have W ways.

    Attributes:
        zones: ``(N, M, W, 6)`` float64: from the ego's front along the route to the zone's begin
            and from its rear to its end [m] (negative once passed); the same of the other's box
            along its way; the priority: 1 they give way, 0 no rule, -1 the ego gives way; and how
            they meet: 0 the ways cross, 1 they merge, 2 they run together and part again.
            NaN where there is no way, no meeting, or the participant is not tracked. The zones that
            the ego reaches first come first.

    They are those of the reference driver: a zone begins where both bodies, 0.6 m apart, would
    touch. A vehicle is expected on all ways that the map offers from where it is; one that is on
    none of these, and who walks or rides a bicycle, straight ahead, too.
    """

    zones: Float


@dataclass(frozen=True)
class Trajectory:
    """What a driver plans in N scenarios, instead of a `Control`; the house follows it.

    A driver may say how often it is asked, by a class attribute ``period`` [s], 0.05 to 0.5: the
    nearest whole number of time steps. Its last plan is followed, or its last control held,
    meanwhile. `bridgegen.drivers.trajectory.checked_plans` says what is refused.

    Attributes:
        time: ``(K,)`` or ``(N, K)`` float64 [s] from now on, increasing; the first one before the
            next call, the last one not before it. K is 1000 at most.
        x: ``(N, K)`` float64 [m], the reference point, the rear axle's centre.
        y: ``(N, K)`` float64 [m].
        h: ``(N, K)`` float64 [rad], heading.
        v: ``(N, K)`` float64 [m/s], forward speed, >= 0.
    """

    time: npt.ArrayLike
    x: npt.ArrayLike
    y: npt.ArrayLike
    h: npt.ArrayLike
    v: npt.ArrayLike


@dataclass(frozen=True)
class Control:
    """What a driver demands in N scenarios; tyres and the vehicle's limits bound it.

    Attributes:
        acceleration: ``(N,)`` [m/s²], forward; braking is negative.
        curvature: ``(N,)`` [1/m], of the path of the rear axle's centre; left is positive.
        demand: ``(N,)`` bool, whether the driver demands that a human takes over; nobody does. The
            first such instant counts, see `Rollout.transitions`. None: it does not.
    """

    acceleration: npt.ArrayLike
    curvature: npt.ArrayLike
    demand: npt.ArrayLike | None = None


class BatchDriver(Protocol):
    """A driver of N scenarios at once."""

    def reset(self, n: int, scene: Scene) -> None:
        """Begin N scenarios; discard the state of earlier ones."""

    def act(self, observation: Observation) -> Control | Trajectory | Any:
        """Return a `Control`, a pair (acceleration, curvature), or a `Trajectory`."""


# --- The road network, for drivers that want "map" ------------------------------------------------

CENTRE, BORDER, CROSSWALK, STOP_LINE = range(4)
"""Kinds of the pieces of a map."""

UNMARKED, BROKEN, SOLID = range(3)
"""Markings of a border: none, one that may be crossed (from either side), or a line that may not be
crossed, from one side at least."""

PIECE_POINTS = 11
"""Largest number V of points of a piece, 2 m apart at most."""


@dataclass(frozen=True)
class Lane:
    """One lane of one section of a road, in its direction of travel.

    Attributes:
        id: ``road:section:lane``, as OpenDRIVE names them.
        kind: OpenDRIVE's type of the lane: "driving", "shoulder", "biking" …
        centre: ``(K, 3)`` float64: x, y [m], heading [rad], every 2 m at most.
        left: ``(K, 2)`` float64 [m], its left border at the same stations.
        right: ``(K, 2)`` float64 [m].
        speed_limit: ``(K,)`` float64 [m/s]; +inf where none is posted.
        junction: the id of the junction that it leads through, or "".
        next: ids of the lanes that lead on.
        previous: ids of the lanes that lead here.
        left_lane: the id of the lane on its left, or "".
        right_lane: the id of the lane on its right, or "".
        left_is_same_way: whether that one goes the same way.
        right_is_same_way: likewise.
        left_marking: OpenDRIVE's type of the marking: "solid", "broken", "none" …
        right_marking: likewise.
        may_change_left: whether the marking allows it, and there is a lane of the same way.
        may_change_right: likewise.
    """

    id: str
    kind: str
    centre: Float
    left: Float
    right: Float
    speed_limit: Float
    junction: str
    next: tuple[str, ...]
    previous: tuple[str, ...]
    left_lane: str
    right_lane: str
    left_is_same_way: bool
    right_is_same_way: bool
    left_marking: str
    right_marking: str
    may_change_left: bool
    may_change_right: bool


@dataclass(frozen=True)
class Light:
    """A traffic light.

    Attributes:
        id: as OpenDRIVE names it.
        lanes: ids of the lanes that it governs.
        stop: ``(2, 2)`` float64, x and y [m] of the ends of its stop line.
    """

    id: str
    lanes: tuple[str, ...]
    stop: Float


@dataclass(frozen=True)
class RoadMap:
    """A road network, in world coordinates.

    Attributes:
        lanes: all that vehicles, cyclists or pedestrians use.
        route: ids of the lanes of the ego's route, in its order; empty off the lanes.
        crosswalks: their outlines, ``(C, 2)`` float64 [m] each.
        lights: the traffic lights that change.
        pieces: ``(K, V, 3)`` float64: the same as polylines of V points: x, y [m], heading [rad].
        piece_points: ``(K,)`` int64, how many points count; the last is repeated.
        piece_kind: ``(K,)`` int8: CENTRE, BORDER, CROSSWALK or STOP_LINE.
        piece_lane: ``(K,)`` int64, the index of the lane that it belongs to, or -1.
        piece_light: ``(K,)`` int64, the index of the light that governs that lane, or of which it
            is the stop line; or -1.
        piece_marking: ``(K,)`` int8: of a border UNMARKED, BROKEN or SOLID; else UNMARKED.

    A border between two lanes of a road is one piece: that of the lane whose outer border it is,
    seen from the road's centre; the centre's belongs to a lane beside it.
    """

    lanes: tuple[Lane, ...]
    route: tuple[str, ...]
    crosswalks: tuple[Float, ...]
    lights: tuple[Light, ...]
    pieces: Float
    piece_points: Int
    piece_kind: npt.NDArray[np.int8]
    piece_lane: Int
    piece_light: Int
    piece_marking: npt.NDArray[np.int8]
