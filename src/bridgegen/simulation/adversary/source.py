"""Where the concrete scenarios of an adversary come from."""

from collections.abc import Mapping
from dataclasses import replace
from functools import lru_cache

from bridgegen.base.arrays import Float
from bridgegen.drivers import DRIVERS
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.source import ConcreteScenario, OntologySource
from bridgegen.scenario.language.adversary import first_speed, limits, room, top_speed
from bridgegen.scenario.language.story import Adversary
from bridgegen.scenario.ontology.site import Site
from bridgegen.simulation.adversary.course import Course, Lane
from bridgegen.simulation.embedded.places.ways import Ways
from bridgegen.simulation.embedded.simulator import EmbeddedSimulator


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
            name: one
            for name, one in inner.constraints.parameters.items()
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
            lane, station, first_speed(who, values), top_speed(who, values), limits(who, values),
            room(who, values), program.time_step, program.n_steps,
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
