"""Logical scenarios: what happens, what may vary, and what counts as critical."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from typing import Literal

from bridgegen.odd.parameters import Axis, Bound, Derived, Parameter
from bridgegen.odd.space import SearchSpace


@dataclass(frozen=True)
class Waypoint:
    """Where a route starts or ends.

    Attributes:
        point: "P1" to "P8": legs A (south), B (west), C (north), D (east) have an odd point, where
            their inner inbound lane starts, and an even one, where their inner outbound lane ends.
        distance: [m] along the leg between the vehicle's reference point and the junction (the
            stop line, for a start); a parameter's name or a constant.
    """

    point: str
    distance: str | float

    @property
    def leg(self) -> str:
        """The leg, "A" to "D"."""
        return "ABCD"[(int(self.point[1:]) - 1) // 2]

    @property
    def direction(self) -> Literal["in", "out"]:
        """Whether it is on a lane that leads to the junction or away from it."""
        return "in" if int(self.point[1:]) % 2 else "out"


@dataclass(frozen=True)
class Participant:
    """A road user.

    Attributes:
        name: "ego" for the system under test.
        type: what it is.
        start: where it stands at time 0.
        end: where its route ends.
        speed: [m/s] at time 0; of the ego also its target. A parameter's name or a constant.
    """

    name: str
    type: Literal["car"]
    start: Waypoint
    end: Waypoint
    speed: str | float


@dataclass(frozen=True)
class ConditionSpec:
    """When an event starts.

    Attributes:
        kind: "time": simulation time has reached ``value``; "distance": the participant's
            reference point is ``value`` or less from the one of ``to``, as the crow flies.
        value: [s] or [m]; a parameter's name or a constant.
        to: the other participant, for a distance.
    """

    kind: Literal["time", "distance"]
    value: str | float
    to: str | None = None


@dataclass(frozen=True)
class EventSpec:
    """A participant's change of speed.

    Attributes:
        name: of the event.
        participant: who changes.
        speed: [m/s] that it changes to; a parameter's name or a constant.
        rate: [m/s²] at which; a parameter's name or a constant, > 0.
        when: alternatives: the first to hold starts the event.
    """

    name: str
    participant: str
    speed: str | float
    rate: str | float
    when: tuple[ConditionSpec, ...]


@dataclass(frozen=True)
class Term:
    """A metric in the objective.

    Attributes:
        metric: its name.
        weight: its share of the fitness; ``None`` where the weights come from entropy.
    """

    metric: str
    weight: float | None = None


@dataclass(frozen=True)
class Critical:
    """What makes a concrete scenario critical (paper, Table III).

    More than ``n_collision_above`` collisions, or the smallest distance below ``d_min_below`` [m]
    while the ego's speed there is at least ``v_d_at_least`` [m/s].
    """

    n_collision_above: float = 0.0
    d_min_below: float = 2.0
    v_d_at_least: float = 1.0


@dataclass(frozen=True)
class ObjectiveSpec:
    """What is optimised.

    Attributes:
        terms: the metrics.
        weights: "fixed": as the terms give them; "entropy": from a random sample (paper,
            Eqs. 4 to 7).
        scale: "raw": metrics as they are; "standardised": by the same sample.
        critical: what counts as critical.
    """

    terms: tuple[Term, ...]
    weights: Literal["fixed", "entropy"]
    scale: Literal["raw", "standardised"]
    critical: Critical = field(default_factory=Critical)


@dataclass(frozen=True)
class ParameterLine:
    """One line of a scenario's table of parameters; ranges are empty for a derived quantity.

    ``bounds`` holds the bounds on a parameter, or the formula of a derived quantity, as text.
    """

    name: str
    axis: Axis
    unit: str
    low: float | None
    high: float | None
    default: float | None
    bounds: str
    description: str


@dataclass(frozen=True)
class LogicalScenario:
    """A logical scenario (ISO 34501): a situation with ranges instead of values.

    Attributes:
        name: how it is called on the command line.
        title: one line.
        description: what happens.
        source: where it comes from.
        place: the file that it was read from.
        duration: [s] of simulated time.
        time_step: [s].
        template: the road network's construction.
        participants: the ego and the others.
        events: what the others do.
        axes: what is searched unless the user says otherwise.
        parameters: what may vary, by name.
        bounds: what limits it.
        derived: what follows from it.
        objective: what is optimised.
    """

    name: str
    title: str
    description: str
    source: str
    place: str = field(compare=False, repr=False)
    duration: float
    time_step: float
    template: Literal["crossroads"]
    participants: tuple[Participant, ...]
    events: tuple[EventSpec, ...]
    axes: tuple[Axis, ...]
    parameters: dict[str, Parameter]
    bounds: tuple[Bound, ...]
    derived: tuple[Derived, ...]
    objective: ObjectiveSpec

    @property
    def fingerprint(self) -> str:
        """A digest of all that it says: the same for the same scenario on any machine."""
        return sha256(repr(self).encode()).hexdigest()

    @property
    def ego(self) -> Participant:
        """The system under test."""
        return self.participant("ego")

    def participant(self, name: str) -> Participant:
        """Return a participant by name.

        Raises:
            KeyError: no such participant.
        """
        return {one.name: one for one in self.participants}[name]

    def space(
        self, axes: Iterable[str] | None = None, fixed: Mapping[str, float] | None = None
    ) -> SearchSpace:
        """Return the space of some axes, the scenario's own by default.

        Args:
            axes: which to search.
            fixed: parameters to hold at a value.

        Raises:
            UnknownNameError: no such axis.
            ScenarioError: what is fixed does not fit (see ``SearchSpace``).
        """
        return SearchSpace(self, axes, fixed)

    def measured(self, values: Mapping[str, float]) -> "LogicalScenario":
        """Return this scenario at a place where some parameters are what they are.

        Args:
            values: by name, as a map tells them. They leave the search, and what limits them
                here has no say over a map; what they limit, they limit still.
        """
        parameters = {
            name: replace(one, low=values[name], high=values[name], default=values[name])
            if name in values
            else one
            for name, one in self.parameters.items()
        }
        bounds = tuple(bound for bound in self.bounds if bound.target not in values)
        return replace(self, parameters=parameters, bounds=bounds)

    def table(self) -> tuple[ParameterLine, ...]:
        """Return every parameter and derived quantity with its range and rules, for people."""
        lines = [
            ParameterLine(
                p.name, p.axis, p.unit, p.low, p.high, p.default,
                "; ".join(str(bound) for bound in self.bounds if bound.target == p.name),
                p.description,
            )
            for p in self.parameters.values()
        ]  # fmt: skip
        lines += [
            ParameterLine(d.name, d.axis, d.unit, None, None, None, str(d), d.description)
            for d in self.derived
        ]
        return tuple(lines)
