"""N rows of one compiled storyboard: set up, rolled out at once, or by one instant at a time."""

from collections.abc import Callable, Mapping
from functools import partial
from typing import Any, TypeVar

import numpy as np
import numpy.typing as npt

from bridgegen.base.arrays import Bool, Float, Int
from bridgegen.base.compiled import compile_for_kernels, row_type
from bridgegen.base.errors import InputError
from bridgegen.drivers._attentive_kernels import MIND as HEED
from bridgegen.drivers._attentive_kernels import SEEN
from bridgegen.drivers._perception_kernels import MEMORY
from bridgegen.drivers._prediction_kernels import LOST, PASSAGE
from bridgegen.drivers._reference_kernels import MIND
from bridgegen.drivers._surroundings_kernels import AROUND
from bridgegen.drivers._tracking_kernels import TRACK
from bridgegen.drivers._weather_columns import FRICTION, WEATHER
from bridgegen.drivers.compiled import CONFLICT
from bridgegen.drivers.drivers import DEMAND, MANOEUVRES, SCRIPTED, STAGES, STORYBOARD, TESTED
from bridgegen.drivers.interface import CONFLICT_WAYS, HISTORY, NEAR_PIECES, ROUTE_POINTS, RoadMap
from bridgegen.drivers.kinds import DETECTION, NEEDS_ROOM
from bridgegen.drivers.lane_tables import STRAYS
from bridgegen.drivers.noise import driver_seeds, noise_key
from bridgegen.drivers.user_drivers import Traits
from bridgegen.drivers.views import frames
from bridgegen.simulation.embedded import _memory_kernels as memory
from bridgegen.simulation.embedded import _rollout_kernels as kernels
from bridgegen.simulation.embedded import drivers, specialised
from bridgegen.simulation.embedded._codes import (
    CLOSELY,
    COURSE_MEMORY,
    DELAY,
    DOES,
    PRESS,
)
from bridgegen.simulation.embedded.addresses import addressed, here
from bridgegen.simulation.embedded.chassis.multi_body import MOTIONS
from bridgegen.simulation.embedded.drivers import (
    ANSWER,
    DEMANDS,
    LANES,
    N_INPUTS,
    fill_input_rows,
    observe_rows,
    see_conflicts_of_rows,
    see_lanes_of_rows,
    see_map_of_rows,
)
from bridgegen.simulation.embedded.places.network import Network
from bridgegen.simulation.embedded.program import Program
from bridgegen.simulation.embedded.storyboard import start
from bridgegen.simulation.rollout import Rollout


class Batch:
    """N rows between their first instant and their last.

    Either ``run`` once, with the compiled driver; or, for a driver in Python, ``start``, and then,
    at every instant k from 0 on while rows run, ``before_driver(k)`` and ``after_driver(k, …)``.
    Both give the same bits for the same demands.

    Args:
        program: the compiled storyboard.
        roads: P road networks, made ready for it.
        rows: ``(N,)`` int64 in 0..P-1, the road network of each row.
        values: ``(N,)`` float64 per parameter; see `Simulator.run`.
        own: what a driver of the user's own needs; None without one.
        noise: ``(N,)`` uint64, keys of the rows' random numbers; see `noise_keys`.
        until_collision: whether a row ends once the ego collides, see ``_collision_kernels``; not
            where there are trailers, whose boxes may overlap the one of what tows them.
        repeat: which evaluation of the rows it is, for the seeds of a user's driver.

    Attributes:
        record: x, y, h, v, a, offset ``(N, E, T)`` and more, up to the present instant.
        state: all else that a driver may look at; see ``_memory_kernels.State``.
        plan: the compiled storyboard, with the addresses that this process needs.
        seeds: ``(N,)`` of a user's driver; see `driver_seeds`.

    Raises:
        InputError: a road network that is not there, or a value that is not finite.
    """

    def __init__(
        self,
        program: Program,
        roads: Network,
        rows: Int,
        values: Mapping[str, npt.ArrayLike],
        own: Traits | None = None,
        noise: npt.NDArray[np.uint64] | None = None,
        until_collision: bool = False,
        repeat: int = 0,
    ) -> None:
        n = len(rows)
        if n and not (rows.min() >= 0 and rows.max() < roads.n_networks):
            raise InputError(f"rows must name one of {roads.n_networks} road networks")
        self._program, self._roads, self._rows = program, roads, rows
        self.plan = _plan(program, until_collision and not len(program.tows))
        slots = program.fill(values, n)
        # A key depends on the row's values alone: so its random numbers are the same in any batch,
        # in any order, and on any worker.
        key = noise_keys(program, values, n) if noise is None else noise
        self.seeds = driver_seeds(key, repeat)
        state = _state(program, roads, rows, slots, key, own)
        # One block, since ``_do`` copies the state before every call: that took a fifth off the 99
        # ms of a row in esmini.
        self._block, self.state = _packed(state)
        self.record = _record(program, n, program.switches_lamps or bool(roads.turnings))
        self._messages: dict[int, str] = {}
        self._has_addresses = False

    @property
    def pieces(self) -> Float:
        """The pieces of the first row's map, ``(K, ·)`` as `PIECE` has them."""
        pieces: Float = self._roads.tables.pieces[self._rows[0]]
        return pieces

    @property
    def running(self) -> Bool:
        """``(N,)`` which rows have not ended."""
        running: Bool = self.state.ending[:, memory.N_STEPS] == 0
        return running

    def take_addresses(self) -> None:
        """Compile what this plan needs and others do not, once."""
        if self._has_addresses:
            return
        self._has_addresses = True
        drives = DEMANDS.get(self._program.driver.kernel)
        at = here(self.plan, self._roads.tables, self.state, self.record)
        self.plan = addressed(self.plan, drives, at)

    def run(self, simulate_rows: Callable[..., Any] | None = None) -> Rollout:
        """Roll all rows out with the compiled driver; runs without the GIL.

        Args:
            simulate_rows: has the kernel of that name called elsewhere, and returns messages by
                row; by default it, or code that does the same, is called here.
        """
        self._do(simulate_rows or partial(specialised.simulate_rows, self._program))
        return self.rollout()

    def start(self) -> None:
        """Set the first instant."""
        self._do(kernels.start_rows)

    def before_driver(self, k: int) -> None:
        """Execute the storyboard at instant k, up to its commands for the ego.

        ``state.command[:, 0]`` is then the commanded speed [m/s].
        """
        self._do(kernels.before_drivers, k)

    def demand(self, k: int) -> tuple[Float, Float]:
        """Return what the compiled driver demands: ``(N,)`` [m/s²] and ``(N,)`` [1/m]."""
        self.take_addresses()
        demanded, curvature = np.zeros((2, len(self._rows)))
        tables = self._roads.tables
        kernels.demand_rows(
            k, self.plan, tables, self._rows, self.state, self.record, demanded, curvature
        )
        return demanded, curvature

    def after_driver(self, k: int, demanded: Float, curvature: Float) -> None:
        """Move all rows that run on to instant k + 1, or end them.

        Args:
            k: the instant.
            demanded: ``(N,)`` float64, the ego's acceleration [m/s²].
            curvature: ``(N,)`` float64, of its path [1/m], left positive.
        """
        self._do(kernels.after_drivers, k, demanded, curvature)

    def compile_start(self) -> None:
        """Compile the parts of ``run`` that its first instant and this plan alone need."""
        compile_for_kernels(start, self.kinds())
        self.take_addresses()

    def compile_instants(self) -> None:
        """Compile the parts of ``run`` that each instant needs, the last first."""
        kinds = self.kinds()
        for function, first in kernels.PARTS:
            compile_for_kernels(function, (*first, *kinds))

    def standing(self) -> Rollout:
        """Return a rollout in which all entities stand far apart, to try metrics on."""
        for array in self.record:
            array[...] = 0
        self.record.x[:, :, :] = FAR_APART * np.arange(self.record.x.shape[1])[:, np.newaxis]
        self.state.ending[:, memory.N_STEPS] = self.record.x.shape[2]
        return Batch.rollout(self)

    def kinds(self) -> tuple[Any, ...]:
        """Return the types of what kernels of a row take: plan, roads, state and record."""
        rows = (self._roads.tables, self.state, self.record)
        return (row_type(self.plan, 0), *map(row_type, rows))

    def _do(self, kernel: Callable[..., Any], *arguments: int | Float) -> None:
        """Call a kernel; rows for which a way is not planned yet do the same again when it is."""
        self.take_addresses()
        # A way that is missing ends a row in the middle of its work, so that the work is done again
        # from here.
        before = self._block.copy(), self.record.began.copy()
        messages = kernel(
            *arguments, self.plan, self._roads.tables, self._rows, self.state, self.record
        )
        self._messages |= messages or {}
        while (
            again := np.flatnonzero(self.state.ending[:, memory.STATUS] == memory.UNPLANNED)
        ).size:
            # Planned for all rows at once, then the rows do their work again. A way depends on its
            # route and node alone, so it does not matter when, or for which row, it was planned.
            wanted = np.column_stack((self._rows[again], self.state.wanted[again]))
            self._roads.plan(tuple(item) for item in wanted.tolist())
            state = taken(_seen(before[0], self.state), again)
            record = taken(self.record, again)
            # An event that began in the first attempt counts from the second one only.
            record.began[:] = before[1][again]
            mine = (
                argument[again] if isinstance(argument, np.ndarray) else argument
                for argument in arguments
            )
            messages = kernel(
                *mine, self.plan, self._roads.tables, self._rows[again], state, record
            )
            self._messages |= {int(again[row]): text for row, text in (messages or {}).items()}
            put_back(self.state, state, again)
            put_back(self.record, record, again)

    def observe(
        self,
        k: int,
        step: float,
        route: Float,
        tracks: Float,
        stop: Float,
        light: npt.NDArray[np.int8],
    ) -> None:
        """Fill the observations of a driver in Python for the running rows; see `Observation`.

        Args:
            k: the instant; once each, in order, for the sensors look.
            step: between two points of the route [m].
            route: ``(N, P, 4)`` float64.
            tracks: ``(N, E − 1, 13)`` float64.
            stop: ``(N,)`` float64, the distance to the next stop line [m].
            light: ``(N,)`` int8, the state of its light.
        """
        observe_rows(
            k,
            self.plan,
            self._roads.tables,
            self._rows,
            self.state,
            self.record,
            step,
            route,
            tracks,
            stop,
            light,
        )

    def note_demands(self, k: int, demanded: Float) -> None:
        """Note of which rows ``(N,)`` the driver demands a transition at instant k: not 0."""
        first = self.state.transitions[:, DEMAND]
        first[(first == 0) & (demanded != 0.0)] = k + 1

    def see_lanes(self, views: Float) -> None:
        """Fill what running rows see of the lanes, ``(N, LANES)``; see ``_lane_view_kernels``."""
        body, roads = self._program.bodies[0], self._roads.tables
        see_lanes_of_rows(body, roads, self._rows, self.state, views)

    def see_map(self, k: int, memories: Float, places: Int) -> None:
        """Fill what is near of running rows ``(N, 1 + Q)``; see ``_map_view_kernels``."""
        tables, rows = self._roads.tables, self._rows
        see_map_of_rows(k, tables, rows, self.state, self.record, memories, places)

    def see_conflicts(self, k: int, found: Float) -> None:
        """Fill the conflicts of running rows ``(N, M, W, CONFLICT)``, after ``observe``."""
        tables, rows = self._roads.tables, self._rows
        see_conflicts_of_rows(k, self.plan, tables, rows, self.state, self.record, found)

    @property
    def left_hand(self) -> bool:
        """Whether it is the mirror image of left-hand traffic."""
        return self._roads.left_hand

    def maps(self) -> tuple[tuple[RoadMap, ...], Int]:
        """Return the road maps of the rows, and which of them each row has, ``(N,)``."""
        used, of = np.unique(self._rows, return_inverse=True)
        return tuple(self._roads.maps[p] for p in used.tolist()), of.reshape(-1)

    def impose(self, k: int, bodies: Int, states: Float) -> None:
        """Move bodies ``(B,)`` of the running rows to poses ``(N, B, 4)``; see `CoSimulation`."""
        drivers.impose_rows(
            k, bodies, states, self.plan, self._roads.tables, self._rows, self.state, self.record
        )

    def egos_are_through(self) -> Bool:
        """Return ``(N,)``: whether a driven ego is at the end of its route, or of the road."""
        through = np.zeros(len(self._rows), dtype=np.bool_)
        drivers.egos_are_through(self.plan, self._roads.tables, self._rows, self.state, through)
        return through

    def fill_inputs(self, k: int) -> None:
        """Fill the inputs of a user's compiled driver for the running rows."""
        fill_input_rows(k, self.plan, self._roads.tables, self._rows, self.state, self.record)

    def fail(self, status: int, message: str) -> None:
        """End all running rows, where they are, with a status and a message."""
        state, record = self.state, self.record
        for i in np.flatnonzero(self.running):
            record.a[i] = 0.0
            state.ending[i, memory.STATUS] = status
            state.ending[i, memory.N_STEPS] = 1
            for array in (record.x, record.y, record.h, record.v, record.offset):
                array[i, :, 1:] = array[i, :, :1]
            record.lights[i] = 0
            self._messages[int(i)] = message

    def rollout(self) -> Rollout:
        """Return what is recorded; all rows must have ended."""
        program, roads, record = self._program, self._roads, self.record
        corridors, corridor_of = self._corridors()
        seen = record.detections
        return Rollout(
            time_step=program.time_step,
            names=program.names,
            box=program.box,
            kinds=program.kinds,
            x=record.x,
            y=record.y,
            h=record.h,
            v=record.v,
            a=record.a,
            offset=record.offset,
            light_names=program.lights,
            lights=record.lights,
            event_names=program.event_names,
            began=record.began,
            event_actors=tuple(program.actors),
            present=NO_PRESENCE if record.present.all() else record.present,
            lamps=record.lamps if record.lamps.size else NO_LAMPS,
            detections=seen[:, : len(program.names)] if seen.size else NO_DETECTIONS,
            ghosts=seen[:, len(program.names) :] if len(program.ghosts) else NO_DETECTIONS,
            stop_lines=roads.stop_lines[self._rows],
            stop_lights=roads.stop_lights,
            stop_entities=roads.stop_entities,
            claims=roads.scene.claims[self._rows],
            towed_by=_towed_by(program),
            crosswalks=roads.crosswalks[self._rows],
            friction=self.state.weather[:, FRICTION].copy(),
            progress=self._progress(),
            transitions=self._transitions(),
            corridors=corridors,
            corridor_of=corridor_of,
            left_hand=roads.left_hand,
            country=roads.country,
            n_steps=self.state.ending[:, memory.N_STEPS].copy(),
            status=self.state.ending[:, memory.STATUS].astype(np.int8),
            messages=self._messages,
        )

    def _corridors(self) -> tuple[Float, Int]:
        """Return `Rollout.corridors` and `Rollout.corridor_of`."""
        matters = np.abs(self.record.offset[:, 0]).max(axis=1) > STRAYS
        matters |= bool(np.array(NEEDS_ROOM)[self._program.kinds].any())
        # A corridor is looked up along the first path.
        # else it has left that path for another
        matters &= np.isin(self.state.on[:, 0], [0, *self._roads.turnings])
        networks, of = np.unique(self._rows[matters], return_inverse=True)
        corridor_of = np.full(len(self._rows), -1)
        corridor_of[matters] = of
        return self._roads.corridors(networks.tolist()), corridor_of

    def _transitions(self) -> Int:
        """Return `Rollout.transitions`; no rows where the ego has no operational design domain."""
        return self.state.transitions - 1 if len(self._program.limits) else NO_TRANSITIONS

    def _progress(self) -> Float:
        """Return `Rollout.progress`; no rows where the storyboard moves the ego."""
        if self._program.driver == STORYBOARD:
            return NO_PROGRESS
        state, tables, on = self.state, self._roads.tables, self.state.on[:, 0]
        end = (tables.counts[self._rows, on] - 1) * tables.steps[self._rows, on]
        return np.stack([state.travelled[:, 0], end - state.station[:, 0]], axis=1)


FAR_APART = 1000.0  # [m]

ALIGNED = 64  # bytes, a line of the processor's cache

NO_DETECTIONS = np.zeros((0, 0, 0, DETECTION))

NO_PRESENCE = np.zeros((0, 0, 0), dtype=np.bool_)

NO_PROGRESS = np.zeros((0, 2))

NO_TRANSITIONS = np.zeros((0, 2), dtype=np.int64)

NO_LAMPS = np.zeros((0, 0, 0), dtype=np.int8)


def noise_keys(
    program: Program, values: Mapping[str, npt.ArrayLike], n: int
) -> npt.NDArray[np.uint64]:
    """Return the keys of N rows' random numbers, ``(N,)``: the file's, or a hash of the values.

    Args:
        program: the compiled storyboard.
        values: ``(N,)`` float64 per parameter; see `Simulator.run`.
        n: N.
    """
    if program.noise_key is not None:
        return np.full(n, program.noise_key, dtype=np.uint64)
    return noise_key({**program.parameters, **_known(program, values)}, n)


def _towed_by(program: Program) -> Int:
    """Return which entity tows each at any time, -1 for none; empty without trailers."""
    found = np.full(len(program.names) if len(program.tows) else 0, -1, dtype=np.int64)
    found[program.tows[:, 1]] = program.tows[:, 0]
    return found


def _known(program: Program, values: Mapping[str, npt.ArrayLike]) -> dict[str, npt.ArrayLike]:
    """Return the values of the parameters that the file has."""
    return {name: value for name, value in values.items() if name in program.parameters}


def _plan(program: Program, until_collision: bool) -> memory.Plan:
    """Return the program's tables, and the rest of a plan."""
    stages = {f"ideal_{stage}": int(stage in program.driver.ideal) for stage in STAGES}
    given: dict[str, Any] = {
        "looks_closely": int(program.probes[:, CLOSELY].any()),
        "comes_and_goes": int(program.comes_and_goes),
        "leaves": int(program.leaves),
        "scene": _scene(program),
        "stops_in_lane": ["", *MANOEUVRES].index(program.driver.manoeuvre),
        "attends": int(program.attends.size > 0),
        "begins": np.zeros(len(program.actions), dtype=np.int64),
        "follows_courses": 0,
        "moves_laid": 0,
        "poses_along": 0,
        "tows_trailers": 0,
        "starts_towed": 0,
        "heeds": 0,
        "begins_waiting": 0,
        "is_driven": int(program.driver != STORYBOARD),
        "until_collision": int(until_collision),
        "has_pedals": int((program.actions[:, DOES] == PRESS).any()),
        "driver_code": 0,
        "moves_chassis": 0,
        "own_code": 0,
        "dt": program.time_step,
        **stages,
    }
    given["others"] = np.where(program.others == TESTED, SCRIPTED, program.others)
    tables = {name: getattr(program, name) for name in memory.Plan._fields if name not in given}
    return memory.Plan(**tables, **given)


def _scene(program: Program) -> Float:
    """Return the scene for a user's compiled driver."""
    return np.array([program.time_step, program.n_steps, *program.bodies[0, :7]])


Rows = TypeVar("Rows", memory.State, memory.Record)


def _packed(state: memory.State) -> tuple[npt.NDArray[np.uint8], memory.State]:
    """Return the bytes of all arrays of a state, and these in there: one copy copies them all."""
    ends = np.cumsum([_room(array) for array in state])
    block = np.empty(int(ends[-1]), dtype=np.uint8)
    packed = _seen(block, state)
    views: Any = packed
    for view, array in zip(views, state, strict=True):
        view[...] = array
    return block, packed


def _seen(block: npt.NDArray[np.uint8], like: memory.State) -> memory.State:
    """Return the arrays of a state that lie in a block, one after the other."""
    views: list[Any] = []
    at = 0
    for array in like:
        views.append(np.ndarray(array.shape, array.dtype, block.data, at))
        at += _room(array)
    return memory.State(*views)


def _room(array: np.ndarray) -> int:
    """Return the bytes that an array takes, so that the next one is aligned."""
    return -(-array.nbytes // ALIGNED) * ALIGNED


def taken(rows: Rows, some: Int) -> Rows:
    """Return a copy of some of the rows."""
    arrays: Any = (array[some] for array in rows)
    return type(rows)(*arrays)


def put_back(rows: Rows, part: Rows, some: Int) -> None:
    """Overwrite some of the rows."""
    arrays: Any = rows
    for rows_of_all, array in zip(arrays, part, strict=True):
        rows_of_all[some] = array


def starts_of(program: Program, roads: Network, rows: Int, slots: Float) -> tuple[Float, Float]:
    """Return where entities start, along their paths and to the left of them, ``(N, E)`` each [m].

    Args:
        program: the compiled storyboard.
        roads: see `Batch`,
        rows: likewise.
        slots: ``(N, S)``, see `Program.fill`.
    """
    start = slots[:, np.maximum(program.start_slots, 0)]  # of no effect where there is no slot
    varied = slots[:, np.maximum(program.aside_slots, 0)]
    aside = np.where(program.aside_slots >= 0, roads.sides[rows] * varied, 0.0)
    return roads.stations(rows, start), aside


def _state(
    program: Program,
    roads: Network,
    rows: Int,
    slots: Float,
    key: npt.NDArray[np.uint64],
    own: Traits | None,
) -> memory.State:
    """Return the state of N rows before they start; ``start`` sets what else is not 0."""
    n, e = len(rows), len(program.names)
    m = e - 1 + len(program.ghosts)
    station, aside = starts_of(program, roads, rows, slots)
    hypotheses = roads.scene.hypotheses.shape[1]
    compiled = own if own and own.memory is not None else None  # else it has arrays of its own
    wants = compiled.wants if compiled else ()
    sizes = {
        "entities": e,
        "perceived": m + 1,
        "slots": slots.shape[1],
        "weather": WEATHER,
        "probes": len(program.probes),
        "conditions": len(program.conditions),
        "instants": int(program.conditions[:, DELAY].max(initial=0)) + 2,
        "elements": len(program.elements),
        "marks": len(program.marks),
        "actions": len(program.actions),
        "values": len(program.values),
        "lights": len(program.lights),
        "controllers": len(program.controllers),
        "course": COURSE_MEMORY,
        "profile": 3 * len(program.entries) + 5 if len(program.entries) else 0,
        "laying": e if len(program.layouts) else 0,
        "vertices": program.most_vertices,
        "heed": HEED,
        "seen": SEEN,
        "sensors": MEMORY,
        "track": TRACK,
        "motion": MOTIONS[program.vehicle],
        "around": AROUND,
        "beside": m + 1 if roads.turnings else 0,
        "passages": 2 * (m + 1) + hypotheses,
        "passage": PASSAGE,
        "hypotheses": hypotheses,
        "mind": MIND if compiled is None else compiled.memory or 0,
        "inputs": N_INPUTS,
        "ahead": ROUTE_POINTS if compiled else 0,
        "others": m if compiled else 0,
        "lanes": LANES if "lanes" in wants else 0,
        "place": 1 + NEAR_PIECES if "map" in wants else 0,
        "nearby": drivers.MEMORY if "map" in wants else 0,
        "signals": len(program.lights) if "map" in wants else 0,
        "conflicts": m if "conflicts" in wants else 0,
        "conflict_ways": CONFLICT_WAYS,
        "conflict": CONFLICT.itemsize // 8,
        "tracked": m if "history" in wants else 0,
        "instants_tracked": HISTORY,
        "frames": frames(program.time_step) if "history" in wants else 0,
        "answer": ANSWER,
    }
    given = {
        "slots": slots,
        "station": station,
        "aside": aside,
        "key": key[:, None],
        "feet": np.full((n, hypotheses), LOST),
    }
    return memory.states(n, sizes, given)


def _record(program: Program, n: int, lamps: bool) -> memory.Record:
    shape = (n, len(program.names), program.n_steps)
    perceived = (n, len(program.names) + len(program.ghosts), program.n_steps, DETECTION)
    # Not zeros: kernels write every instant up to the row's last, and repeat that one to the end.
    x, y, h, v, a, offset = (np.empty(shape) for _ in range(6))
    perceives = program.driver.perceives
    seen = perceived if perceives else (n, 0, 0, DETECTION)
    there = shape if program.comes_and_goes else (n, 0, 0)
    return memory.Record(
        x=x,
        y=y,
        h=h,
        v=v,
        a=a,
        offset=offset,
        detections=np.zeros(seen),
        lights=np.empty((n, len(program.lights), program.n_steps), dtype=np.int8),
        present=np.zeros(there, dtype=np.bool_),
        lamps=np.zeros(shape if lamps else (n, 0, 0), dtype=np.int8),
        began=np.full((n, len(program.event_names)), -1, dtype=np.int64),
    )
