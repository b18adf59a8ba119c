"""Logical scenarios: what happens, what may vary, and what counts as critical."""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field, replace
from hashlib import sha256
from typing import TYPE_CHECKING, Any, Literal

import numpy as np

from bridgegen.base.arrays import Bool, Float
from bridgegen.base.errors import UnsupportedError
from bridgegen.scenario.language.constraints import Constraints, order
from bridgegen.scenario.language.kinds import slack
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter, at
from bridgegen.scenario.language.roads import RoadsSpec
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.language.story import Adversary, EventSpec, Participant, Story
from bridgegen.scenario.language.thresholds import Thresholds

if TYPE_CHECKING:  # the checks of individuals start without pydantic
    from bridgegen.scenario.language.criteria import Criterion
    from bridgegen.scenario.language.plain_yaml import Document
    from bridgegen.scenario.language.protocols import Clause, Grid
    from bridgegen.scenario.language.storyboard import RecordedSpec


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
class ObjectiveSpec:
    """What is optimised.

    Attributes:
        terms: the metrics.
        weights: "fixed": as the terms give them; "entropy": from a random sample (paper,
            Eqs. 4 to 7).
        scale: "raw": metrics as they are; "standardised": by the same sample.
        critical: the thresholds of what counts as critical by the rule "thresholds".
        rule: "harm": critical is what the conflict analysis finds harmful; "thresholds"; or
            "criteria": what violates a criterion.
        count: whose conflicts are harm: "ego", those that the ego is responsible for or could have
            prevented; or "any".
        criteria: the margins that count by the rule "criteria"; empty: all.
        gated: whether implausible scenarios are neither critical nor fit.
    """

    terms: tuple[Term, ...]
    weights: Literal["fixed", "entropy"]
    scale: Literal["raw", "standardised"]
    critical: Thresholds = field(default_factory=Thresholds)
    rule: Literal["harm", "thresholds", "criteria"] = "thresholds"
    count: Literal["ego", "any"] = "ego"
    criteria: tuple[str, ...] = field(default=(), repr=False)
    gated: bool = field(default=True, repr=False)


@dataclass(frozen=True)
class ParameterLine:
    """One line of a scenario's table of parameters; ranges are empty for a derived quantity.

    ``bounds`` holds the bounds on a parameter, or the formula of a derived quantity, as text;
    ``range`` and ``standard`` are range and default as people read them.
    """

    name: str
    axis: Axis
    unit: str
    low: float | None
    high: float | None
    default: float | None
    bounds: str
    description: str
    range: str = "derived"
    standard: str = ""


@dataclass(frozen=True)
class SearchedScenario:
    """A logical scenario (ISO 34501), ranges instead of values: what a search has to know of it.

    Attributes:
        name: how it is called on the command line.
        title: one line.
        description: what happens.
        place: the file that it was read from.
        axes: searched by default.
        parameters: what may vary, by name.
        bounds: what limits it.
        derived: what follows from it.
        objective: what is optimised.
        driver: default driver of the ego; None leaves it to a file.
        budget: evaluations, likewise.
        seed: of the search, likewise.
        checks: limits that a row may break, for they leave some combinations no value, or do not
            shape how a value is drawn: it is no scenario then.
        notes: what is searched otherwise than its files may lead one to expect.
        criteria: pass criteria, which a search measures besides.
        clauses: of a regulation or protocol, which a suite judges besides.
        odd: the operational design domain that bounds it, a `bridgegen.scenario.odd.bounding.Fit`;
            None: none does.
    """

    name: str
    title: str
    description: str
    place: str = field(compare=False, repr=False)
    axes: tuple[Axis, ...]
    parameters: dict[str, Parameter]
    bounds: tuple[Bound, ...]
    derived: tuple[Derived, ...]
    objective: ObjectiveSpec
    driver: str | None
    budget: int = field(default=1000, kw_only=True)
    seed: int = field(default=0, kw_only=True)
    checks: tuple[Bound, ...] = field(default=(), kw_only=True, compare=False, repr=False)
    notes: tuple[str, ...] = field(default=(), kw_only=True, compare=False, repr=False)
    criteria: "tuple[Criterion, ...]" = field(default=(), kw_only=True, repr=False)
    clauses: "tuple[Clause, ...]" = field(default=(), kw_only=True, repr=False)
    odd: Any = field(default=None, kw_only=True, compare=False, repr=False)

    @property
    def fingerprint(self) -> str:
        """A digest of its contents: the same for the same scenario on any machine."""
        return sha256(content_of(self).encode()).hexdigest()

    @property
    def rules(self) -> Constraints:
        """What its search space is made of."""
        return Constraints(self.parameters, self.bounds, self.derived, self.axes)

    @property
    def decisions(self) -> tuple[str, ...]:
        """The parameters that are an adversary's decisions."""
        return ()

    def usual_values(self) -> dict[str, float]:
        """Return the defaults of the parameters, and the derived quantities that follow."""
        values = {name: parameter.default for name, parameter in self.parameters.items()}
        derived = {each.name: each.value for each in self.derived}
        for name in order((*values, *derived), self.bounds, self.derived):
            if name in derived:
                values[name] = float(derived[name].evaluate(values))
        return values

    def states(self) -> Any:
        """Return what it states of an ODD, a `bridgegen.scenario.odd.states.States`.

        Raises:
            UnsupportedError: nothing that is read.
        """
        raise UnsupportedError(f"{self.name}: nothing of it is read that an ODD asks")

    def broken(self, table: Mapping[str, Float]) -> dict[str, Bool]:
        """Return which rows break a check, ``(N,)`` by the rule; a rule that all keep is left out.

        Args:
            table: ``(N,)`` per parameter and derived quantity.
        """
        found: dict[str, Bool] = {}
        for check in self.checks:
            value = table[check.target]
            kept = np.ones(len(value), np.bool_)
            if check.lo is not None:
                limit = np.asarray(check.lo.evaluate(table))
                kept &= value >= limit - slack(limit)
            if check.hi is not None:
                limit = np.asarray(check.hi.evaluate(table))
                kept &= value <= limit + slack(limit)
            if not kept.all():
                found[f"{check} must hold{at(check.place)}"] = ~kept
        return found

    def space(
        self, axes: Iterable[str] | None = None, fixed: Mapping[str, float | str] | None = None
    ) -> SearchSpace:
        """Return the space of some axes, the scenario's own by default.

        Args:
            axes: which to search.
            fixed: parameters to hold at a value.

        Raises:
            UnknownNameError: no such axis.
            ScenarioError: what is fixed does not fit (see ``SearchSpace``).
        """
        return SearchSpace(self.rules, axes, fixed, name=self.name, decisions=self.decisions)

    def table(self) -> tuple[ParameterLine, ...]:
        """Return every parameter and derived quantity with its range and rules, for people."""
        lines = [
            ParameterLine(
                p.name,
                p.axis,
                p.unit,
                p.low,
                p.high,
                p.default,
                "; ".join(str(bound) for bound in self.bounds if bound.target == p.name),
                p.description,
                p.kind.span_text(p.low, p.high, "{:g}".format, f" {p.unit}"),
                p.kind.text(p.default, "{:g}".format),
            )
            for p in self.parameters.values()
        ]
        lines += [
            ParameterLine(d.name, d.axis, d.unit, None, None, None, str(d), d.description)
            for d in self.derived
        ]
        return tuple(lines)


@dataclass(frozen=True)
class LogicalScenario(SearchedScenario):
    """A logical scenario of five layers, as a YAML file declares it.

    Attributes:
        source: where it comes from.
        duration: [s] of simulated time.
        time_step: [s].
        road_end: what participants other than the ego do where their road ends.
        roads: the road network.
        story: participants and events.
        driver: default driver of the ego.
        effects: the user's functions that add to each scenario, as ``file.py:function`` or the
            name of an entry point.
        adversary: driver of a participant, if `bridgegen.scenario.language.adversary.adversarial`
            made it.
        matrix: values that are tested of it, by edition.
        recorded: the recorded events that are this scenario; no part of its fingerprint, because
            it does not change what is simulated.
        domain: the file's block ``odd``, the ego's operational design domain; see
            `bridgegen.scenario.odd.exit`.
        exposure: the file's block of that name, which no search depends on; see
            `bridgegen.scenario.exposure`.
    """

    source: str
    duration: float
    time_step: float
    roads: RoadsSpec
    story: Story
    driver: str
    effects: tuple[str, ...]
    road_end: Literal["leave", "stand"] = field(default="leave", kw_only=True)
    adversary: Adversary | None = field(default=None, repr=False, kw_only=True)
    matrix: "tuple[Grid, ...]" = field(default=(), repr=False, kw_only=True)
    recorded: "RecordedSpec | None" = field(default=None, repr=False, kw_only=True)
    domain: "Document | None" = field(default=None, compare=False, repr=False, kw_only=True)
    exposure: "Document | None" = field(default=None, compare=False, repr=False, kw_only=True)

    @property
    def fingerprint(self) -> str:
        """See `SearchedScenario`; what a scenario does without has no part in it."""
        content = content_of(self)
        # These fields came after the first runs recorded a digest. They are left out of the repr,
        # and count only where they are set: the digests of scenarios without them stay as they
        # were.
        bare = ("", "scripted")
        drivers = {
            participant.name: participant.driver
            for participant in self.participants
            if participant.driver not in bare
        }
        headings = {
            participant.name: participant.heading
            for participant in self.participants
            if participant.heading != 0.0
        }
        lifted = {
            participant.name: participant.exceeds_limit
            for participant in self.participants
            if participant.exceeds_limit
        }
        astray = {
            participant.name: participant.off_crosswalk
            for participant in self.participants
            if participant.off_crosswalk
        }
        sirens = [participant.name for participant in self.participants if participant.siren]
        bodies = {
            participant.name: participant.own_body
            for participant in self.participants
            if participant.own_body
        }
        types = {
            participant.name: (participant.type_by, participant.types)
            for participant in self.participants
            if participant.type_by
        }
        ways = {
            participant.name: (participant.place_by, participant.ways)
            for participant in self.participants
            if participant.ways
        }
        models = {
            participant.name: participant.model
            for participant in self.participants
            if participant.model
        }
        changes = {item.name: item.change for item in self.participants if item.change}
        priors = {name: item.prior for name, item in self.parameters.items() if item.prior}
        parts = (
            priors,
            drivers,
            headings,
            lifted,
            astray,
            sirens,
            bodies,
            types,
            models,
            ways,
            self.story.ghosts,
            (
                *(one.mirrors for one in self.story.ghosts if one.mirrors),
                *self.story.tracker.items(),
            ),
            changes,
            self.criteria,
            self.clauses,
            self.matrix,
            self.domain.data if self.domain else None,
        )
        more = "".join(repr(part) for part in parts if part)
        return sha256((content + more).encode()).hexdigest()

    @property
    def decisions(self) -> tuple[str, ...]:
        """See `SearchedScenario`."""
        return self.adversary.controls if self.adversary else ()

    @property
    def participants(self) -> tuple[Participant, ...]:
        """The ego and the others."""
        return self.story.participants

    @property
    def events(self) -> tuple[EventSpec, ...]:
        """What happens."""
        return self.story.events

    @property
    def ego(self) -> Participant:
        """The system under test."""
        return self.participant("ego")

    def participant(self, name: str) -> Participant:
        """Return a participant by name.

        Raises:
            KeyError: no such participant.
        """
        return {item.name: item for item in self.participants}[name]

    def measured(self, values: Mapping[str, float]) -> "LogicalScenario":
        """Return this scenario at a place where some parameters are what they are.

        Args:
            values: by name, as a map has them. They leave the search, and what limits them
                here has no say over a map; what they limit, they limit still.
        """
        parameters = {
            name: replace(parameter, low=values[name], high=values[name], default=values[name])
            if name in values
            else parameter
            for name, parameter in self.parameters.items()
        }
        bounds = tuple(bound for bound in self.bounds if bound.target not in values)
        return replace(self, parameters=parameters, bounds=bounds)


def content_of(scenario: SearchedScenario) -> str:
    """Return the contents of a scenario as text.

    `Thresholds` is written as the class was called when the first runs recorded a digest of it.
    """
    return repr(scenario).replace("critical=Thresholds(", "critical=Critical(")
