"""Inputs, state and outputs of the compiled rollout: named arrays.

``Plan`` is the same for all rows. ``Roads`` holds P road networks, ``State`` and ``Record`` N rows;
all kernels but the outermost take a bundle of one, without its first axis (see
`compiled.bundled_row`). ``State`` is all that a row carries from one instant to the next.
"""

# mypy: allow-untyped-defs
# Numba infers what kernels take; their wrappers are typed.

from collections.abc import Mapping
from functools import cache
from typing import Annotated, Any, NamedTuple, get_args, get_type_hints

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int

N_STEPS, STATUS, STOPS, TICKS = 0, 1, 2, 3  # columns of State.ending

# See rollout.STATUS_MESSAGES.
OK, NOT_FINITE, OFF_ROUTE, NO_LANE, NO_PLACE, NO_WAY, NOT_THERE, OFF_LANES, BAD_TIMES = range(9)
# As in `rollout.FAILURES`.
RAISED, NO_CONTROL = 20, 23  # of a driver of the user's own
UNPLANNED = -1  # the row needs a way that is not planned yet, and runs again when it is


class Plan(NamedTuple):
    """The compiled storyboard; `Program` documents the tables' columns."""

    bodies: Float
    kinds: Int
    objects: Int
    init: Int
    routes: Int
    follows: Int
    starts: Int
    places: Int
    layouts: Int
    anchors: Int
    shapes: Float
    trajectories: Int
    triggers: Int
    groups: Int
    conditions: Int
    probes: Int
    marks: Int
    clearances: Int
    ranges: Float
    looks_closely: int
    elements: Int
    courses: Int
    entries: Int
    order: Int
    initial: Int
    actions: Int
    begins: Int
    follows_courses: int
    moves_laid: int
    poses_along: int
    tows: Int
    towers: Int
    couplings: Float
    stands_apart: Int
    tows_trailers: int
    starts_towed: int
    laterals: Int
    values: Int
    first_states: npt.NDArray[np.int8]
    first_phases: Int
    controllers: Int
    phases: Int
    changes: Int
    first_time: int
    time_passes: int
    absent: Int
    comes_and_goes: int
    leaves: int
    drives: Int
    weathers: Int
    limits: Float
    stops_in_lane: int
    scene: Float
    ghosts: Int
    tracker: Int
    others: Int
    attends: int
    heeds: int
    begins_waiting: int
    is_driven: int
    until_collision: int
    has_pedals: int
    driver_code: int
    own_code: int
    chassis: Float
    moves_chassis: int
    ideal_perception: int
    ideal_prediction: int
    ideal_control: int
    dt: float


class Roads(NamedTuple):
    """The paths on a road network, and what the driver knows of it.

    `Network` and `bridgegen.drivers.scene.Scene` document the shapes. ``slopes`` are ``(K, L, 3)``:
    of gravity [m/s²] what acts against the motion, and to the right, and the share [1] by which it
    presses less on the road; L is 0 on a network whose roads are level. ``bends`` ``(K, L)`` and
    ``drops`` ``(L,)`` are where the next bend of each path is, and the next lower speed limit; see
    ``ego._speed_kernels``. ``changes`` ``(V, 8)`` is where the ego's route may change lanes, see
    ``ego._gap_kernels``. ``lanes`` is ``lane_tables.lanes_along``, and ``pieces`` and
    what follows them are `bridgegen.drivers.map_grid.Grid`; without rows unless a driver wants
    them.
    """

    paths: Float
    bends: Int
    drops: Int
    counts: Int
    steps: Float
    follows: Int
    spans: Float
    slopes: Float
    span_counts: Int
    zones: Float
    points: Float
    spots: Float
    timetables: Float
    timetable_counts: Int
    nodes: Int
    ends: Float
    ways: Int
    ground: Float
    ground_nodes: Int
    cells: Float
    cell_nodes: Int
    road: Float
    classes: Float
    stops: Float
    halts: Float
    crosswalks: Float
    hypotheses: Float
    hypothesis_counts: Int
    hypothesis_steps: Float
    hypothesis_zones: Float
    hypothesis_ranks: Int
    hypothesis_first: Int
    path_ranks: Int
    claims: Int
    meets: Int
    meetings: Float
    lines: Float
    signs: Float
    changes: Float
    lanes: Float
    pieces: Float
    middles: Float
    grid_box: Float
    grid_starts: Int
    grid_order: Int


class State(NamedTuple):
    """One row between two instants; with a first axis N, all of them.

    Each array is declared here alone, with the names or numbers of its axes; `Batch` gives these
    sizes, sets what is not 0 before a row starts, and makes the rest zeros.

    Attributes:
        slots: ``(S,)`` the row's values.
        weather: ``(WEATHER,)`` what sensors and tyres feel, see ``ego/_weather_kernels``.
        transitions: ``(2,)`` int64, when the ego left its domain, see ``drivers/_odd_kernels``.
        shoulder: ``(4,)`` the shift by which it comes to stand on the shoulder, see
            ``_path_kernels``; zeros: it does not.
        ending: ``(4,)`` int64: recorded instants, 0 while it runs; status; whether it stops now;
            how many transitions there were.
        observed: ``(P,)`` bool, what the probes see.
        history: ``(C, D)`` bool, the conditions at the last D instants; instant k is in k mod D.
        phase: ``(X,)`` int64, of the storyboard's elements; see ``_codes``,
        executions: ``(X,)`` int64, how often each has started or been skipped,
        stamps: ``(X, 4)`` int64, the number of its last start, end, stop and skip,
        looked: ``(P, 2)`` int64, the last number when a probe looked: before this instant; at all.
        held: ``(P,)`` [s], how long a probe has seen what must last.
        marks: ``(M, 3)`` x, y [m], heading [rad] of the places that probes look at; NaN: nowhere.
        along: ``(P,)`` int64, the path along which a probe measures that asks for clearance; -1:
            none.
        action_ended: ``(J,)`` bool.
        selected: ``(E,)`` bool, the entities that made the present event's trigger fire.
        values: ``(U,)``, the parameters and variables that change.
        clock: ``(3,)`` [s], a date, how fast it passes, and when it was that date.
        lights: ``(L,)`` int8, the traffic lights' states.
        phase_now: ``(K,)`` int64, the phase that each controller is in,
        phase_until: ``(K,)`` [s], and until when.
        present: ``(E,)`` bool, whether each is present,
        hidden: ``(E, 2)`` bool, from whom; see ``_codes``,
        visible: ``(E,)`` bool, whether the ego's sensors may see it,
        heeded: ``(E,)`` bool, and a careful driver of the ego reacts to it,
        minded: ``(E,)`` bool, and attentive drivers may,
        switched: ``(E,)`` int64, its lamps as the storyboard has them; see
            `bridgegen.drivers.kinds`,
        lamps: ``(E,)`` int64, and what shows,
        holds: ``(E,)`` int64, which pedals are held, as bits; see ``_pedal_kernels``,
        pedals: ``(E, 5, 4)`` where they are,
        tower: ``(E,)`` int64, by which entity it is towed; -1: by none,
        straight: ``(E,)`` bool, it is put straight behind that one, which was teleported.
        drives: ``(2,)`` int64, whether the driver steers, and sets the speed; see ``_codes``.
        travelled: ``(E,)`` [m] since the start.
        stood: ``(E,)`` [s] for how long it has stood.
        route: ``(E,)`` int64, the route that a body follows where it can; 0: none.
        on: ``(E,)`` int64, the path that it is on; -1: none, it goes straight along its line,
        station: ``(E,)`` [m] along it,
        aside: ``(E,)`` [m] to its left,
        turn: ``(E,)`` [rad], by how much its nose is turned from the path's direction.
        line: ``(E, 3)`` x, y [m], heading [rad], where its line starts.
        to: ``(E,)`` int64, the path that it leaves on its way to the lane of its own, -1 if none,
        foot: ``(E,)`` [m], its station there.
        lateral_action: ``(E,)`` int64, the action that moves it across; -1: none,
        lateral_lasts: ``(E,)`` [s] or [m], how long,
        lateral_passed: ``(E,)`` [s] or [m], what of it has passed,
        lateral_origin: ``(E,)`` [m], how far left of its path it began,
        lateral_target: ``(E,)`` [m], how far left of its path it ends; see ``_aside_kernels``.
        follow: ``(E,)`` int64, the trajectory whose timetable moves it; -1: none,
        follow_action: ``(E,)`` int64, the action that leads it along a trajectory; -1: none,
        follow_began: ``(E,)`` [s], when the times of the timetable begin.
        laid: ``(E, V, 10)`` the segments of a trajectory that was laid, see ``_laying_kernels``,
        laid_count: ``(E,)`` int64, how many; 0: it is on none,
        passed: ``(E,)`` [m], how far along them.
        tail_first: ``(E,)`` bool, it follows its trajectory tail first.
        pose: ``(3,)`` scratch: x, y [m], heading [rad] of a place along a trajectory.
        timed: ``(E,)`` bool, a timetable moves it at this instant.
        given: ``(E,)`` bool, the ego's driver drives it, too; see `together`.
        placed: ``(E,)`` bool, it was teleported at this instant, and does not move on.
        goal: ``(E, 2)`` [m], the position that it is sent to,
        goal_action: ``(E,)`` int64, by which action; -1: none.
        wanted: ``(2,)`` int64, the route and the node of the way that is not planned yet.
        speed_action: ``(E,)`` int64, the action that changes its speed; -1: none,
        speed_began: ``(E,)`` [s], since when,
        speed_lasts: ``(E,)`` [s], and how long.
        command: ``(E,)`` [m/s], the speed that the storyboard asks for now,
        origin: ``(E,)`` [m/s], the one that it comes from,
        target: ``(E,)`` [m/s], the one that it is on its way to,
        rate: ``(E,)`` [m/s²], how fast at most,
        mean: ``(E,)`` [m/s], its mean speed up to the next instant, where a SpeedAction gives it;
            NaN: that of a constant acceleration,
        course: ``(E, 6)`` what a course by another entity keeps; see ``_codes``,
        profile: ``(E, R, 4)`` the course of a speed profile; see ``_course_kernels``,
        profile_rows: ``(E,)`` int64, how many rows of it count.
        waits: ``(E,)`` int64, the change of lane that waits for a gap; -1: none,
        allowed: ``(E,)`` [m/s²], the most that its driver allows; +inf: the storyboard's,
        minds: ``(E, MIND)`` state of that driver; see `bridgegen.drivers._attentive_kernels`.
        seen: ``(SEEN, E)`` what those drivers see; likewise,
        far: ``(E,)`` scratch of one driver.
        attention: ``(E, 3)``, a careful driver's state per body; see its kernel.
        chassis: ``(MOTION,)`` how the ego's vehicle moves, if it has dynamics; see
            ``_chassis_columns`` and ``_multi_body_columns``.
        key: ``(1,)`` uint64, of the row's random numbers; see `bridgegen.drivers.noise`.
        sensors: ``(E + G, MEMORY)``, between two frames; see ``ego._perception_kernels``.
        tracks: ``(E + G, TRACK)`` what it perceives, ghosts last; see ``ego._tracking_kernels``.
        around: ``(E + G, AROUND)`` the same from its route; see ``ego._surroundings_kernels``.
        beside: the same from the lane that its route changes to, see ``ego._gap_kernels``; no rows
            without one.
        passages: ``(·, PASSAGE)`` what it predicts; see ``ego._prediction_kernels``.
        feet: ``(W,)`` [m], stations of the tracks on the ways that they may be on.
        mind: ``(·,)`` its further state; see ``ego._reference_kernels``, or the memory of a user's
            compiled driver.
        inputs: ``(·,)`` inputs of such a driver on ego and scene, see ``_own_driver_kernels``,
        ahead: ``(·, 4)`` its route,
        others: ``(·, TRACK)`` the tracks,
        lanes: ``(·,)`` what it wants to know: the lanes, see ``_lane_view_kernels``,
        place: ``(·,)`` int64, what of the map is near, see ``_map_view_kernels``,
        nearby: ``(·,)`` what may soon be, likewise,
        signals: ``(·,)`` the states of the lights,
        conflicts: ``(·, W, CONFLICT)`` where others' ways meet its route,
        past: ``(F, ·, TRACK)`` the tracks of the last F instants,
        tracked: ``(·, H, TRACK)`` those of the last second,
        answer: ``(·,)`` and its output.
    """

    slots: Annotated[Float, "slots"]
    weather: Annotated[Float, "weather"]
    transitions: Annotated[Int, 2]
    shoulder: Annotated[Float, 4]
    ending: Annotated[Int, 4]
    observed: Annotated[Bool, "probes"]
    history: Annotated[Bool, "conditions", "instants"]
    phase: Annotated[Int, "elements"]
    executions: Annotated[Int, "elements"]
    stamps: Annotated[Int, "elements", 4]
    looked: Annotated[Int, "probes", 2]
    held: Annotated[Float, "probes"]
    marks: Annotated[Float, "marks", 3]
    along: Annotated[Int, "probes"]
    action_ended: Annotated[Bool, "actions"]
    selected: Annotated[Bool, "entities"]
    values: Annotated[Float, "values"]
    clock: Annotated[Float, 3]
    lights: Annotated[npt.NDArray[np.int8], "lights"]
    phase_now: Annotated[Int, "controllers"]
    phase_until: Annotated[Float, "controllers"]
    present: Annotated[Bool, "entities"]
    hidden: Annotated[Bool, "entities", 2]
    visible: Annotated[Bool, "entities"]
    heeded: Annotated[Bool, "entities"]
    minded: Annotated[Bool, "entities"]
    switched: Annotated[Int, "entities"]
    lamps: Annotated[Int, "entities"]
    holds: Annotated[Int, "entities"]
    pedals: Annotated[Float, "entities", 5, 4]
    tower: Annotated[Int, "entities"]
    straight: Annotated[Bool, "entities"]
    drives: Annotated[Int, 2]
    travelled: Annotated[Float, "entities"]
    stood: Annotated[Float, "entities"]
    route: Annotated[Int, "entities"]
    on: Annotated[Int, "entities"]
    station: Annotated[Float, "entities"]
    aside: Annotated[Float, "entities"]
    turn: Annotated[Float, "entities"]
    line: Annotated[Float, "entities", 3]
    to: Annotated[Int, "entities"]
    foot: Annotated[Float, "entities"]
    lateral_action: Annotated[Int, "entities"]
    lateral_lasts: Annotated[Float, "entities"]
    lateral_passed: Annotated[Float, "entities"]
    lateral_origin: Annotated[Float, "entities"]
    lateral_target: Annotated[Float, "entities"]
    follow: Annotated[Int, "entities"]
    follow_action: Annotated[Int, "entities"]
    follow_began: Annotated[Float, "entities"]
    laid: Annotated[Float, "laying", "vertices", 10]
    laid_count: Annotated[Int, "entities"]
    passed: Annotated[Float, "entities"]
    tail_first: Annotated[Bool, "entities"]
    pose: Annotated[Float, 3]
    timed: Annotated[Bool, "entities"]
    given: Annotated[Bool, "entities"]
    placed: Annotated[Bool, "entities"]
    goal: Annotated[Float, "entities", 2]
    goal_action: Annotated[Int, "entities"]
    wanted: Annotated[Int, 2]
    speed_action: Annotated[Int, "entities"]
    speed_began: Annotated[Float, "entities"]
    speed_lasts: Annotated[Float, "entities"]
    command: Annotated[Float, "entities"]
    origin: Annotated[Float, "entities"]
    target: Annotated[Float, "entities"]
    rate: Annotated[Float, "entities"]
    mean: Annotated[Float, "entities"]
    course: Annotated[Float, "entities", "course"]
    profile: Annotated[Float, "entities", "profile", 4]
    profile_rows: Annotated[Int, "entities"]
    waits: Annotated[Int, "entities"]
    allowed: Annotated[Float, "entities"]
    minds: Annotated[Float, "entities", "heed"]
    seen: Annotated[Float, "seen", "entities"]
    far: Annotated[Float, "entities"]
    attention: Annotated[Float, "entities", 3]
    chassis: Annotated[Float, "motion"]
    key: Annotated[npt.NDArray[np.uint64], 1]
    sensors: Annotated[Float, "perceived", "sensors"]
    tracks: Annotated[Float, "perceived", "track"]
    around: Annotated[Float, "perceived", "around"]
    beside: Annotated[Float, "beside", "around"]
    passages: Annotated[Float, "passages", "passage"]
    feet: Annotated[Float, "hypotheses"]
    mind: Annotated[Float, "mind"]
    inputs: Annotated[Float, "inputs"]
    ahead: Annotated[Float, "ahead", 4]
    others: Annotated[Float, "others", "track"]
    lanes: Annotated[Float, "lanes"]
    place: Annotated[Int, "place"]
    nearby: Annotated[Float, "nearby"]
    signals: Annotated[Float, "signals"]
    conflicts: Annotated[Float, "conflicts", "conflict_ways", "conflict"]
    past: Annotated[Float, "frames", "tracked", "track"]
    tracked: Annotated[Float, "tracked", "instants_tracked", "track"]
    answer: Annotated[Float, "answer"]


class Record(NamedTuple):
    """The outputs: ``(E, T)`` per body, ``(L, T)`` lights, ``(V,)`` events; see `Rollout`.

    ``detections`` are ``(E + G, T, 8)``, or ``(0, 0, 8)`` where the driver perceives nothing;
    ``present`` is ``(E, T)``, or ``(0, 0)`` if all entities always are; ``lamps`` ``(E, T)``, or
    ``(0, 0)`` if the storyboard switches none.
    """

    x: Float
    y: Float
    h: Float
    v: Float
    a: Float
    offset: Float
    detections: Float
    lights: npt.NDArray[np.int8]
    present: Bool
    lamps: npt.NDArray[np.int8]
    began: Int


def states(n: int, sizes: Mapping[str, int], given: Mapping[str, np.ndarray]) -> State:
    """Return the state of N rows: zeros, but for the arrays that are given.

    Args:
        n: N.
        sizes: of the axes that `State` names.
        given: ``(N, …)`` arrays by name.
    """
    arrays: dict[str, Any] = dict(given)
    for name, number, axes in _declared():
        if name not in arrays:
            shape = (axis if isinstance(axis, int) else sizes[axis] for axis in axes)
            arrays[name] = np.zeros((n, *shape), dtype=number)
    return State(**arrays)


# Derived once: sizes and types, derived in every batch, took 6 of the 25 ms of 128 rows, under the
# GIL.
@cache
def _declared() -> tuple[tuple[str, Any, tuple[Any, ...]], ...]:
    """Return name, type of number and axes of each array of a `State`."""
    found = []
    for name, declared in get_type_hints(State, include_extras=True).items():
        array, *axes = get_args(declared)
        found.append((name, NUMBERS[array], tuple(axes)))
    return tuple(found)


NUMBERS: dict[Any, Any] = {
    Float: np.float64,
    Int: np.int64,
    Bool: np.bool_,
    npt.NDArray[np.int8]: np.int8,
    npt.NDArray[np.uint64]: np.uint64,
}
"""The type of number of each type of array. Looked up, since the alias `NDArray` is made otherwise
in each version of NumPy."""
