"""OWL2OpenSCENARIO, what the standard has no place for: kept as properties of the file's header.

So that a file says all that its individuals do, and gives them back
(`bridgegen.openx.openscenario.to_owl`). A name has three parts, separated by dots: what it is
about, which one, and what is said of it; what may be said several times is numbered, from 1.

====================================  ============================================================
``time_step``                         step of the evaluation [s]
``road_end``                          ``stand``: others stand where their road ends; else they leave
``parameter.NAME.axis``               of the search space
``parameter.NAME.unit``               of its value and its range
``parameter.NAME.expression``         that derives it from others, if any does
``parameter.NAME.value``              if it is derived and only limits others
``parameter.NAME.constraint.1``       a rule that it obeys, with the reason
``event.NAME.class``                  of a temporary change: ``TrafficJam``, ``RoadWorks`` …
``event.NAME.who.1``                  a participant that it consists of
``event.NAME.element.1``              a thing that stands at it
``event.NAME.on_lane.1``              where it is: road, lane id, start of the lane section [m]
``event.NAME.closes_lane.1``          a lane that it closes, likewise
``event.NAME.on_road.1``              a road that it is on
``event.NAME.time``                   when it happens [s]
``signals.NAME.offset``               of a controller: time of its first phase that has passed [s]
``cause``                             of its harm, as `bridgegen.assess.cause` names it
``conflict_type``                     of its decisive conflict
``responsible``                       for it: ego, other, shared or none
``severity``                          of it: probability of a MAIS3+ injury
====================================  ============================================================
"""

from collections.abc import Iterator
from urllib.parse import quote

from bridgegen.base.errors import OntologyError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.declarations import (
    CAUSE,
    CONFLICT_TYPE,
    RESPONSIBLE,
    ROAD_END,
    SEVERITY,
    TIME_STEP,
)
from bridgegen.openx.openscenario.from_owl.entities import Places, plain_text
from bridgegen.openx.openscenario.from_owl.quantities import Quantities
from bridgegen.openx.openscenario.from_owl.signals import Signals
from bridgegen.openx.openscenario.values import format_double
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject

CHANGES = ("TrafficJam", "RoadWorks", "TrafficAccident", "NearMiss", "TemporaryChange")
"""The classes of temporary changes, a class before those above it."""

FINDINGS = {
    CAUSE: "has_cause",
    CONFLICT_TYPE: "has_conflict_type",
    RESPONSIBLE: "has_responsibility",
}
"""The header's texts on why a scenario is critical, with the scenario's data properties."""

PARAMETER, EVENT, SIGNALS = "parameter", "event", "signals"


class Notes:
    """Writes statements that the rest of the file cannot express.

    Args:
        individuals: one scenario.
        scenario: its node.
        quantities: its numbers.
        places: its positions.
    """

    def __init__(
        self, individuals: Individuals, scenario: Subject, quantities: Quantities, places: Places
    ) -> None:
        self._individuals, self._scenario = individuals, scenario
        self._quantities, self._places = quantities, places

    def properties(self, signals: Signals) -> Iterator[osc.Property]:
        """Yield the properties of the header.

        Raises:
            OntologyError: a name would be read as a reference, or is not one participant's.
        """
        step = self._individuals.optional_number(self._scenario, "has_time_step")
        if step is not None:
            yield osc.Property(TIME_STEP, format_double(step))
        if self._individuals.optional_text(self._scenario, "has_road_end") is not None:
            said = plain_text(self._individuals, self._scenario, "has_road_end")
            yield osc.Property(ROAD_END, said)
        yield from self._parameters()
        yield from self._changes()
        for name, passed in signals.offsets.items():
            yield osc.Property(f"{SIGNALS}.{name}.offset", format_double(passed))
        for name, term in FINDINGS.items():
            if self._individuals.optional_text(self._scenario, term) is not None:
                yield osc.Property(name, plain_text(self._individuals, self._scenario, term))
        severity = self._individuals.optional_number(self._scenario, "has_severity")
        if severity is not None:
            yield osc.Property(SEVERITY, format_double(severity))

    def _parameters(self) -> Iterator[osc.Property]:
        ind = self._individuals
        for parameter in ind.links(self._scenario, "has_parameter_declaration"):
            if ind.text(parameter, "has_axis") == Axis.STATIC:
                continue
            name = f"{PARAMETER}.{plain_text(ind, parameter, 'has_name')}"
            for what in ("axis", "unit"):
                yield osc.Property(f"{name}.{what}", plain_text(ind, parameter, f"has_{what}"))
            if ind.is_a(parameter, "DerivedParameter"):
                said = plain_text(ind, parameter, "has_expression")
                yield osc.Property(f"{name}.expression", said)
                if parameter in self._quantities.limits:
                    value = ind.number(parameter, "has_value")
                    yield osc.Property(f"{name}.value", format_double(value))
            for k, text in enumerate(ind.texts(parameter, "constraint"), start=1):
                if text.startswith("$"):
                    raise OntologyError(f"a constraint must not begin with $, got '{text}'")
                yield osc.Property(f"{name}.constraint.{k}", text)

    def _changes(self) -> Iterator[osc.Property]:
        ind = self._individuals
        for event in ind.links(self._scenario, "has_event"):
            if not ind.is_a(event, "TemporaryChange"):
                continue
            name = f"{EVENT}.{plain_text(ind, event, 'has_name')}"
            cls = next(change for change in CHANGES if ind.is_a(event, change))
            yield osc.Property(f"{name}.class", cls)
            for link in ("who", "element"):
                for k, node in enumerate(ind.links(event, f"has_{link}"), start=1):
                    yield osc.Property(f"{name}.{link}.{k}", plain_text(ind, node, "has_name"))
            for link in ("on_lane", "closes_lane"):
                for k, lane in enumerate(ind.links(event, link), start=1):
                    yield osc.Property(f"{name}.{link}.{k}", self._lane(event, lane))
            for k, road in enumerate(ind.links(event, "on_road"), start=1):
                yield osc.Property(f"{name}.on_road.{k}", plain_text(ind, road, "has_road_id"))
            time = ind.optional_number(event, "has_time")
            if time is not None:
                yield osc.Property(f"{name}.time", format_double(time))

    def _lane(self, event: Subject, lane: Subject) -> str:
        ind = self._individuals
        road_id = self._places.road_id(lane)
        if road_id is None:
            raise OntologyError(
                f"{ind.describe(event)} must be on a lane of a road, got {ind.describe(lane)}"
            )
        start = ind.optional_number(lane, "has_section_start") or 0.0
        lane_id = ind.integer(lane, "has_lane_id")
        return f"{quote(road_id, safe='')} {lane_id} {format_double(start)}"
