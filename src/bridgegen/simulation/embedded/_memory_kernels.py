"""What the compiled rollout reads, remembers and writes: arrays with names.

``Plan`` is the same for all rows. ``Roads`` holds P road networks, ``State`` and ``Record`` N rows;
``roads_of``, ``state_of`` and ``record_of`` take one out, without its first axis, and that is what
all other kernels see. ``State`` is all that a row needs to go on from one instant to the next.
"""

from collections.abc import Callable
from typing import Any, NamedTuple

import numpy as np
import numpy.typing as npt

from bridgegen.arrays import Bool, Float, Int
from bridgegen.compiled import borrowed, inlined_kernel

N_STEPS, STATUS, STOPS, TICKS = 0, 1, 2, 3  # columns of State.ending

OK, NOT_FINITE, OFF_ROUTE, NO_LANE = 0, 1, 2, 3  # see rollout.STATUS_MESSAGES


class Plan(NamedTuple):
    """The compiled storyboard; `Program` tells the tables' columns."""

    bodies: Float
    init: Int
    timed: Int
    triggers: Int
    groups: Int
    conditions: Int
    probes: Int
    elements: Int
    actions: Int
    first_states: npt.NDArray[np.int8]
    weathers: Int
    driver: int
    dt: float


class Roads(NamedTuple):
    """The paths on a road network; `Network` tells the shapes."""

    paths: Float
    counts: Int
    steps: Float
    zones: Float
    points: Float
    tracks: Float


class State(NamedTuple):
    """One row between two instants; with a first axis N, all of them.

    Attributes:
        slots: ``(S,)`` the row's values.
        weather: ``(WEATHER,)`` what sensors and tyres feel, see ``ego/_weather_kernels``.
        ending: ``(4,)`` int64: recorded instants, 0 while it runs; status; whether it stops now;
            how many transitions there were.
        observed: ``(P,)`` bool, what the probes see.
        history: ``(C, D)`` bool, the conditions at the last D instants; instant k is in k mod D.
        phase: ``(X,)`` int64, of the storyboard's elements; see ``_codes``,
        executions: ``(X,)`` int64, how often each has started or been skipped,
        stamps: ``(X, 4)`` int64, the number of its last start, end, stop and skip,
        looked: ``(P, 2)`` int64, the last number when a probe looked: before this instant; at all.
        action_ended: ``(J,)`` bool.
        selected: ``(E,)`` bool, the entities that made the present event's trigger fire.
        lights: ``(L,)`` int8, the traffic lights' states.
        travelled: ``(E,)`` [m] since the start.
        stood: ``(E,)`` [s] since it last moved.
        on: ``(E,)`` int64, the path that a body is on,
        station: ``(E,)`` [m] along it,
        aside: ``(E,)`` [m] to its left.
        to: ``(E,)`` int64, the path that it changes to, -1 if none,
        foot: ``(E,)`` [m], its station there.
        lane_action: ``(E,)`` int64, the action that changes its lane; -1: none,
        lane_began: ``(E,)`` [s], since when,
        lane_lasts: ``(E,)`` [s] or [m], and how long,
        lane_from: ``(E,)`` [m], what it had travelled when it began.
        speed_action: ``(E,)`` int64, the action that changes its speed; -1: none,
        speed_began: ``(E,)`` [s], since when,
        speed_lasts: ``(E,)`` [s], and how long.
        command: ``(E,)`` [m/s], the speed that the storyboard asks for now,
        origin: ``(E,)`` [m/s], the one that it comes from,
        target: ``(E,)`` [m/s], the one that it is on its way to,
        rate: ``(E,)`` [m/s²], how fast at most.
        attention: ``(E, 3)``, what a careful driver keeps of each body; see its kernel.
    """

    slots: Float
    weather: Float
    ending: Int
    observed: Bool
    history: Bool
    phase: Int
    executions: Int
    stamps: Int
    looked: Int
    action_ended: Bool
    selected: Bool
    lights: npt.NDArray[np.int8]
    travelled: Float
    stood: Float
    on: Int
    station: Float
    aside: Float
    to: Int
    foot: Float
    lane_action: Int
    lane_began: Float
    lane_lasts: Float
    lane_from: Float
    speed_action: Int
    speed_began: Float
    speed_lasts: Float
    command: Float
    origin: Float
    target: Float
    rate: Float
    attention: Float


class Record(NamedTuple):
    """What is written: ``(E, T)`` per body, ``(L, T)`` lights, ``(V,)`` events; see `Rollout`."""

    x: Float
    y: Float
    h: Float
    v: Float
    a: Float
    offset: Float
    lights: npt.NDArray[np.int8]
    began: Int


def view(kind: type[NamedTuple], at: str = "") -> Callable[..., Any]:
    """Return the kernel that borrows a tuple's arrays; of N rows' those of row i if at="[i]"."""
    items = ", ".join(
        f"rows.{name}" if type_ in (int, float) else f"borrowed(rows.{name}{at})"
        for name, type_ in kind.__annotations__.items()
    )
    code = f"lambda rows{', i' if at else ''}: kind({items})"
    return inlined_kernel(eval(code, {"kind": kind, "borrowed": borrowed}))


plan_of = view(Plan)
roads_of, state_of, record_of = (view(kind, "[i]") for kind in (Roads, State, Record))
