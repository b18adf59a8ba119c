"""A participant driven by an adversary: decisions become a course, and the course a scenario.

The course of a row depends on the row alone: the participant moves along its route as its
decisions say, whatever the others do. So a scenario that an agent has found in closed loop,
deciding by what it saw, is an ordinary row of decisions afterwards: evaluated, recorded and handed
over like any other, as the trajectory that came of it.
"""

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass, replace
from functools import lru_cache
from typing import TYPE_CHECKING

import numpy as np

from bridgegen.arrays import Bool, Float, Int
from bridgegen.ego import DRIVERS
from bridgegen.errors import InputError
from bridgegen.odd.adversary import PERIOD, Adversary
from bridgegen.odd.space import SearchSpace
from bridgegen.ontology.courses import rounded
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.source import ConcreteScenario, OntologySource
from bridgegen.simulation.embedded.network import Network
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator
from bridgegen.simulation.embedded.ways import Ways

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.batch import Batch

BEYOND = 2.0
"""Metres, and one second, between the vertices of the way that is left at the scenario's end."""

OBSERVED = (
    "time", "speed", "place in the lane", "top speed",
    "ego ahead", "ego to the left", "ego's heading, cosine", "ego's heading, sine",
    "ego's speed", "ego's acceleration", "distance from the ego",
    "way to the conflict", "ego's way to it", "time to the conflict", "ego's time to it",
)  # fmt: skip
"""What an adversary sees at each decision, each scaled to about -1 .. 1 and cut at -3 and 3.

Ways lead to where its route and the ego's meet, times are at present speeds; 3 where they never do.
"""

FAR, LONG, FAST, HARD = 30.0, 5.0, 10.0, 5.0  # m, s, m/s, m/s²: what counts as 1

Act = Callable[[Float, Bool], Float]
"""``(N, len(OBSERVED))`` observations and ``(N,)`` whether a row still runs → ``(N, 2)`` decisions
in [0, 1]: the speed that it makes for, up to its highest; its place, from right to left."""


@dataclass(frozen=True)
class Lane:
    """The way that a participant keeps to.

    Attributes:
        path: ``(L, 6)``: x, y [m], heading [rad], its cosine and sine, curvature [1/m].
        step: [m] between two samples.
        station: a, b: who starts at s on its road starts a + b·s along it.
    """

    path: Float
    step: float
    station: tuple[float, float]


class Course:
    """Where a participant is by what has been decided so far.

    Args:
        lane: its way.
        station: where on it the participant starts [m].
        speed: at the start [m/s].
        top: its highest [m/s].
        limits: of its acceleration and its braking [m/s²].
        room: how far it may be aside of the lane's centre [m].
        time_step: [s].
        n_steps: instants of the scenario.

    Attributes:
        points: ``(T, 4)`` time [s], x, y [m], heading [rad], as far as it is decided.
        state: see ``_steering_kernels``.
    """

    def __init__(
        self, lane: Lane, station: float, speed: float, top: float, limits: tuple[float, float],
        room: float, time_step: float, n_steps: int,
    ) -> None:  # fmt: skip
        from bridgegen.simulation.embedded._steering_kernels import note  # numba is slow to import

        self._lane, self.top, self.room, self._dt = lane, top, room, time_step
        self._limits = limits
        self.state = np.array([station, 0.0, speed, 0.0, 0.0])
        self.points = np.zeros((n_steps, 4))
        self.steps = max(1, round(PERIOD / time_step))
        note(lane.path, len(lane.path), lane.step, self.state, 0, 0.0, self.points)
        self._start = station
        self.points[:] = self.points[0]  # until it is decided otherwise
        self.points[:, 0] = np.arange(n_steps) * time_step

    def decide(self, k: int, pace: float, place: float) -> None:
        """Move on by one period.

        Args:
            k: which decision it is.
            pace: the speed that it makes for, as a share of its highest.
            place: -1 at the right edge of the lane, 1 at the left one.
        """
        from bridgegen.simulation.embedded._steering_kernels import steer  # numba is slow to import

        steer(
            self._lane.path, len(self._lane.path), self._lane.step, self.state, pace * self.top,
            place * self.room, *self._limits, self._dt, k * self.steps, self.steps, self.points,
        )  # fmt: skip

    @property
    def travelled(self) -> float:
        """How far it has come along its way [m]."""
        return float(self.state[0]) - self._start

    def whole(self) -> Float:
        """Return the course and the way that would be left, ``(V, 4)``, rounded.

        The way that is left is for those who look where the participant is going.
        """
        from bridgegen.simulation.embedded._steering_kernels import note  # numba is slow to import

        lane = self._lane
        end, now = (len(lane.path) - 1) * lane.step, self.state.copy()
        now[4] = 0.0
        count = max(1, int((end - now[0]) / BEYOND))
        left = np.zeros((count, 4))
        for k in range(count):
            now[0] += BEYOND
            note(lane.path, len(lane.path), lane.step, now, k, self.points[-1, 0] + k + 1, left)
        return rounded(np.concatenate([self.points, left]))


class AdversarySource:
    """A `bridgegen.openx.source.Source` of scenarios in which an adversary drives somebody.

    Args:
        inner: makes the scenarios without the adversary's course.
        nominal: a value of every parameter.
    """

    def __init__(self, inner: OntologySource, nominal: Mapping[str, float]) -> None:
        assert inner.constraints.adversary is not None
        self.adversary: Adversary = inner.constraints.adversary
        self._inner = inner
        left = {
            name: one
            for name, one in inner.constraints.parameters.items()
            if name not in self.adversary.controls
        }
        self.constraints = replace(inner.constraints, parameters=left)
        self.static_names, self.unused_names = inner.static_names, inner.unused_names
        parked = inner.concrete(nominal)
        # Only where lanes lead is asked of it; the ego's own driver need not be there for that.
        plain, name = DRIVERS["route-follower"], inner.constraints.name
        self.program = EmbeddedSimulator(parked.storyboard, name, driver=plain).program
        self.entity = self.program.names.index(self.adversary.participant)
        self._lane = lru_cache(maxsize=64)(self._find_lane)
        self._roads = lru_cache(maxsize=64)(self._find_roads)

    @property
    def road(self) -> str:
        """See `Source`."""
        return self._inner.road

    @property
    def junction(self) -> str | None:
        """See `Source`."""
        return self._inner.junction

    @property
    def bodies(self) -> Mapping[str, str]:
        """See `Source`."""
        return self._inner.bodies

    def roads(self, values: Mapping[str, float]) -> OpenDrive:
        """See `Source`."""
        return self._roads(self._static(values))

    def begin(self, values: Mapping[str, float]) -> Course:
        """Return the course of a row before anything is decided."""
        lane = self._lane(self._static(values))
        program, who = self.program, self.adversary
        slot = program.start_slots[self.entity]
        known = {name: values[name] for name in program.parameters if name in values}
        a, b = lane.station
        station = a + b * float(program.fill(known, 1)[0, slot]) if slot >= 0 else a
        return Course(
            lane, station, who.first_speed(values), who.top_speed(values), who.limits(values),
            who.room(values), program.time_step, program.n_steps,
        )  # fmt: skip

    def courses(self, values: Mapping[str, float]) -> Mapping[str, Float]:
        """See `Source`: where the decisions lead the participant."""
        course, who = self.begin(values), self.adversary
        for k, names in enumerate(zip(who.paces, who.offsets, strict=True)):
            course.decide(k, *(values[name] for name in names))
        return {who.participant: course.whole()}

    def concrete(self, values: Mapping[str, float], road_file: str = "") -> ConcreteScenario:
        """See `Source`."""
        return self._inner.concrete(values, road_file, self.courses(values))

    def _static(self, values: Mapping[str, float]) -> tuple[float, ...]:
        return tuple(values[name] for name in self.static_names)

    def _find_roads(self, static: tuple[float, ...]) -> OpenDrive:
        return self._inner.roads(dict(zip(self.static_names, static, strict=True)))

    def _find_lane(self, static: tuple[float, ...]) -> Lane:
        ways = Ways(self.program, self._roads(static))
        path = ways.paths[self.entity]
        return Lane(path.table, path.step, ways.station[self.entity])


class Arena:
    """Where an agent drives the participant in closed loop, many scenarios at a time.

    Args:
        source: of the scenarios.
        simulator: holds their storyboard.
        space: the search space; names the columns of U and X.

    Attributes:
        n_decisions: of each scenario.
        n_observed: numbers that the agent sees at each.
        decisions: ``(n_decisions, 2)`` int64, the columns of U that are decided: pace and place.

    Raises:
        InputError: the ego's driver cannot be asked instant by instant.
    """

    def __init__(
        self, source: AdversarySource, simulator: EmbeddedSimulator, space: SearchSpace
    ) -> None:
        if simulator.program.driver.is_own:
            raise InputError(
                "an adversary in closed loop meets the drivers of 'bridgegen list drivers', got "
                f"{simulator.program.driver.name}; search its decisions with another algorithm"
            )
        who = source.adversary
        names = np.array([who.paces, who.offsets]).T
        if missing := {*who.controls} - {*space.variables}:
            raise InputError(
                f"an adversary in closed loop needs all of its decisions, got no {min(missing)}: "
                "it is held at a value, or its axis (extension) is not searched"
            )
        self._source, self._simulator, self._space = source, simulator, space
        self._entity = simulator.program.names.index(who.participant)
        self.n_decisions, self.n_observed = len(names), len(OBSERVED)
        self.decisions: Int = np.vectorize(space.variables.index, otypes=[np.int64])(names)

    def play(self, U: Float, act: Act) -> Float:
        """Let an agent decide, and return the rows that came of it.

        Args:
            U: ``(N, n_var)``; the columns of decisions do not count.
            act: decides.

        Returns:
            ``(N, n_var)``, U with what was decided; after a scenario's end nothing is, and the
            columns are 0.5.
        """
        space, who, n = self._space, self._source.adversary, len(U)
        U = U.copy()
        U[:, self.decisions.ravel()] = 0.5
        X = space.decode(U)
        rows = [space.values(x) for x in X]
        courses = [self._source.begin(one) for one in rows]
        models = [self._source.roads(one) for one in rows]
        told = [{who.participant: course.whole()} for course in courses]
        network = self._simulator.roads(models, told)
        columns = {name: X[:, i] for i, name in enumerate(space.names)}
        batch = self._simulator.batch(network, np.arange(n), columns)
        batch.start()
        pairs = zip(who.paces, who.offsets, strict=True)
        at = [[space.index(name) for name in pair] for pair in pairs]
        for k in range(self._simulator.program.n_steps):
            if not batch.running.any():
                break
            steps = courses[0].steps
            if k % steps == 0 and k // steps < self.n_decisions:
                number = k // steps
                running = batch.running
                decided = act(self._observe(k, batch, network, courses), running)
                U[np.ix_(running, self.decisions[number])] = decided[running]
                values = space.decode(U)[:, at[number]]
                for course, value in zip(courses, values.tolist(), strict=True):
                    course.decide(number, *value)
                part = np.array([one.points[k : k + steps + 1] for one in courses])
                network.amend(who.participant, k, rounded(part.reshape(-1, 4)).reshape(part.shape))
            batch.before_driver(k)
            batch.after_driver(k, *batch.demand(k))
        return U

    def _observe(
        self, k: int, batch: "Batch", network: Network, courses: Sequence[Course]
    ) -> Float:
        """Return what the adversary sees at instant k, ``(N, len(OBSERVED))``; see `OBSERVED`."""
        record, e = batch.record, self._entity
        x, y, h, v = (one[:, e, k] for one in (record.x, record.y, record.h, record.v))
        dx, dy = record.x[:, 0, k] - x, record.y[:, 0, k] - y
        turned, ego_v = record.h[:, 0, k] - h, record.v[:, 0, k]
        ego_a = record.a[:, 0, k - 1] if k else np.zeros(len(x))
        zone = network.zones(self._source.adversary.participant)
        way = zone[:, 2] - np.array([one.travelled for one in courses])
        ego_way = zone[:, 0] - batch.state.station[:, 0]
        top, room = (np.array([getattr(one, name) for one in courses]) for name in ("top", "room"))
        aside = np.array([one.state[1] for one in courses])
        with np.errstate(invalid="ignore", divide="ignore"):
            seen = [
                np.full(len(x), k / self._simulator.program.n_steps),
                v / FAST, aside / np.maximum(room, 1e-9), top / FAST,
                (dx * np.cos(h) + dy * np.sin(h)) / FAR, (dy * np.cos(h) - dx * np.sin(h)) / FAR,
                np.cos(turned), np.sin(turned),
                ego_v / FAST, ego_a / HARD, np.hypot(dx, dy) / FAR,
                way / FAR, ego_way / FAR,
                way / np.maximum(v, 0.1) / LONG, ego_way / np.maximum(ego_v, 0.1) / LONG,
            ]  # fmt: skip
        found: Float = np.clip(np.nan_to_num(np.column_stack(seen), nan=3.0), -3.0, 3.0)
        return found
