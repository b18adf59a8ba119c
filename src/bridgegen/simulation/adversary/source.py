"""Where an adversary's participant is, and the concrete scenarios that follow."""

from collections.abc import Mapping
from dataclasses import dataclass, replace
from functools import lru_cache

import numpy as np

from bridgegen.base.arrays import Float
from bridgegen.drivers import DRIVERS
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.source import ConcreteScenario, OntologySource
from bridgegen.scenario.language.adversary import PERIOD, first_speed, limits, room, top_speed
from bridgegen.scenario.language.story import Adversary
from bridgegen.scenario.ontology.builder import rounded
from bridgegen.scenario.ontology.site import Site
from bridgegen.simulation.embedded.places.ways import Ways
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator

# --- Where an adversary's participant is, by what has been decided so far ---


BEYOND = 2.0
"""Distance between the vertices of the way that is left at the scenario's end [m]; they are one
second apart."""


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
        self,
        lane: Lane,
        station: float,
        speed: float,
        top: float,
        limits: tuple[float, float],
        room: float,
        time_step: float,
        n_steps: int,
    ) -> None:
        from bridgegen.simulation.embedded.motion import (
            note,  # numba is slow to import
        )

        self._lane, self.top, self.room, self._dt = lane, top, room, time_step
        self._limits = limits
        self.state = np.array([station, 0.0, speed, 0.0, 0.0])
        self.points = np.zeros((n_steps, 4))
        self.steps = max(1, round(PERIOD / time_step))
        note(lane.path, len(lane.path), lane.step, self.state, 0, 0.0, self.points)
        self._start = station
        self.points[:] = self.points[0]  # until it is decided otherwise
        self.points[:, 0] = np.arange(n_steps) * time_step

    # A speed that it makes for, not an acceleration: at random these brake more than they
    # accelerate (8 m/s² against 3), so that random search left the participant standing.
    def decide(self, k: int, pace: float, place: float) -> None:
        """Move on by one period.

        Args:
            k: which decision it is.
            pace: the speed that it makes for, as a share of its highest.
            place: -1 at the right edge of the lane, 1 at the left one.
        """
        from bridgegen.simulation.embedded.motion import (
            steer,  # numba is slow to import
        )

        steer(
            self._lane.path,
            len(self._lane.path),
            self._lane.step,
            self.state,
            pace * self.top,
            place * self.room,
            *self._limits,
            self._dt,
            k * self.steps,
            self.steps,
            self.points,
        )

    @property
    def travelled(self) -> float:
        """How far it has come along its way [m]."""
        return float(self.state[0]) - self._start

    def whole(self) -> Float:
        """Return the course and the way that would be left, ``(V, 4)``, rounded.

        The way that is left is for those who look where the participant is going.
        """
        from bridgegen.simulation.embedded.motion import (
            note,  # numba is slow to import
        )

        lane = self._lane
        end, now = (len(lane.path) - 1) * lane.step, self.state.copy()
        now[4] = 0.0
        count = max(1, int((end - now[0]) / BEYOND))
        left = np.zeros((count, 4))
        for k in range(count):
            now[0] += BEYOND
            note(lane.path, len(lane.path), lane.step, now, k, self.points[-1, 0] + k + 1, left)
        # As the file has them (9 decimals), with a vertex at every instant: so the rollout of the
        # file has the bits of the evaluation.
        return rounded(np.concatenate([self.points, left]))


class AdversarySource:
    """A `bridgegen.openx.source.Source` of scenarios in which an adversary drives a participant.

    Args:
        inner: makes the scenarios without the adversary's course.
        nominal: a value of every parameter.
    """

    variant_names: tuple[str, ...] = ()
    variants: tuple[tuple[float, ...], ...] = ()

    def __init__(self, inner: OntologySource, nominal: Mapping[str, float]) -> None:
        assert inner.constraints.adversary is not None
        self.adversary: Adversary = inner.constraints.adversary
        self._inner = inner
        left = {
            name: parameter
            for name, parameter in inner.constraints.parameters.items()
            if name not in self.adversary.controls
        }
        self.constraints = replace(inner.constraints, parameters=left)
        self.static_names, self.unused_names = inner.static_names, inner.unused_names
        self.course_names = tuple(nominal)  # decisions, and what limits and places the participant
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

    def place(self, values: Mapping[str, float]) -> Site | None:
        """See `Source`."""
        return self._inner.place(values)

    def bodies(self, values: Mapping[str, float]) -> Mapping[str, str]:
        """See `Source`."""
        return self._inner.bodies(values)

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
            lane,
            station,
            first_speed(who, values),
            top_speed(who, values),
            limits(who, values),
            room(who, values),
            program.time_step,
            program.n_steps,
        )

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
