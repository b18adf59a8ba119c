"""OWL2OpenSCENARIO, its conditions: when an event happens."""

from bridgegen.base.errors import OntologyError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.entities import Cast, plain_text
from bridgegen.openx.openscenario.from_owl.places import Places
from bridgegen.openx.openscenario.from_owl.quantities import Quantities
from bridgegen.openx.openscenario.from_owl.quoted import quoted_element
from bridgegen.openx.openscenario.from_owl.signals import lamp_states
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject

AnyCondition = osc.ByEntityCondition | osc.ByValueCondition
_EUCLIDIAN = osc.RelativeDistanceType.EUCLIDIAN_DISTANCE
_LONGITUDINAL = osc.RelativeDistanceType.LONGITUDINAL
_ENDED = osc.StoryboardElementState.COMPLETE_STATE
_ENTITY = osc.CoordinateSystem.ENTITY
_LEAST, _MOST = osc.Rule.GREATER_OR_EQUAL, osc.Rule.LESS_OR_EQUAL

USUAL_RULES = {
    "SimulationTimeCondition": _LEAST,
    "SpeedCondition": _LEAST,
    "RelativeDistanceCondition": _MOST,
    "TimeToCollisionCondition": _MOST,
    "TimeHeadwayCondition": _MOST,
}
"""The comparison of a condition whose individual states none (has_rule)."""


class Conditions:
    """The conditions of a scenario's individuals.

    Args:
        individuals: one scenario.
        quantities: its numbers.
        places: its positions.
        cast: its participants.
    """

    def __init__(
        self, individuals: Individuals, quantities: Quantities, places: Places, cast: Cast
    ) -> None:
        self._individuals, self._quantities = individuals, quantities
        self._places, self._cast = places, cast

    def group(self, name: str, actors: tuple[str, ...], node: Subject) -> osc.ConditionGroup:
        """Return conditions that suffice together.

        Without a word about it their edge is ``none``: a rising edge needs an earlier instant at
        which the condition was false, and would miss one that is true from the start. What it
        triggers happens once all the same.

        Args:
            name: of the group.
            actors: the event's actors, by name.
            node: a Condition or a ConditionGroup.

        Raises:
            OntologyError: a condition lacks what it needs.
            UnsupportedError: a condition of a class that cannot be written.
        """
        ind = self._individuals
        nodes = [node]
        if ind.is_a(node, "ConditionGroup"):
            nodes = ind.links(node, "has_condition")
            if not nodes:
                raise OntologyError(f"{ind.describe(node)} must have has_condition, and has none")
        found = []
        for k, one in enumerate(nodes, start=1):
            label = name if len(nodes) == 1 else f"{name}_{k}"
            made, delay = self._condition(actors, one)
            if ind.optional_number(one, "has_delay") is not None:
                delay = self._quantities.get(one, "has_delay")
            found.append(osc.Condition(label, delay, self._edge(one), made))
        return osc.ConditionGroup(tuple(found))

    def _edge(self, node: Subject) -> osc.ConditionEdge:
        said = self._individuals.optional_text(node, "has_condition_edge")
        if said is None:
            return osc.ConditionEdge.NONE
        known = {str(one.value): one for one in osc.ConditionEdge}
        if said not in known:
            raise OntologyError(
                f"has_condition_edge of {self._individuals.describe(node)} must be one of "
                f"{', '.join(known)}, got '{said}'"
            )
        return known[said]

    def _condition(
        self, actors: tuple[str, ...], node: Subject
    ) -> tuple[AnyCondition, float | osc.ParameterRef]:
        """Return a condition and its delay [s]."""
        ind = self._individuals
        if ind.is_a(node, "OpenScenarioCondition"):
            options = {
                "ByEntityCondition": osc.ByEntityCondition,
                "ByValueCondition": osc.ByValueCondition,
            }
            made = quoted_element(ind, node, options)
            assert isinstance(made, osc.ByEntityCondition | osc.ByValueCondition)
            return made, 0.0
        if ind.is_a(node, "StoryboardElementStateCondition"):
            event = plain_text(ind, ind.link(node, "has_event_ref"), "has_name")
            said = ind.optional_text(node, "has_event_state")
            began, ended = osc.StoryboardElementState.START_TRANSITION, _ENDED
            state = osc.StoryboardElementStateCondition(
                osc.StoryboardElementType.EVENT, event, began if said == "began" else ended
            )
            return osc.ByValueCondition(state), self._quantities.get(node, "has_value")
        if ind.is_a(node, "TrafficSignalCondition"):
            light = plain_text(ind, ind.link(node, "has_signal"), "has_object_id")
            lamps = lamp_states(ind.text(node, "has_signal_state"))
            return osc.ByValueCondition(osc.TrafficSignalCondition(light, lamps)), 0.0
        if ind.is_a(node, "SimulationTimeCondition"):
            time = self._quantities.get(node, "has_value")
            return osc.ByValueCondition(
                osc.SimulationTimeCondition(time, self._rule(node, _LEAST))
            ), 0.0
        return _of(self._subject(actors, node), self._of_entity(node)), 0.0

    def _of_entity(self, node: Subject) -> osc.EntityCondition:
        ind = self._individuals
        if ind.is_a(node, "CollisionCondition"):
            return osc.EntityCondition(osc.CollisionCondition(osc.EntityRef(self._other(node))))
        value = self._quantities.get(node, "has_value")
        if ind.is_a(node, "RelativeDistanceCondition"):
            is_gap = ind.optional_text(node, "has_distance_measure") == "gap"
            return osc.EntityCondition(
                osc.RelativeDistanceCondition(
                    entity_ref=self._other(node),
                    relative_distance_type=_LONGITUDINAL if is_gap else _EUCLIDIAN,
                    value=value,
                    freespace=is_gap,
                    rule=self._rule(node, _MOST),
                    coordinate_system=osc.CoordinateSystem.LANE if is_gap else _ENTITY,
                )
            )
        if ind.is_a(node, "TimeToCollisionCondition"):
            return osc.EntityCondition(
                osc.TimeToCollisionCondition(
                    target=osc.TimeToCollisionConditionTarget(osc.EntityRef(self._other(node))),
                    freespace=False,
                    rule=self._rule(node, _MOST),
                    value=value,
                    coordinate_system=_ENTITY,
                    relative_distance_type=_EUCLIDIAN,
                )
            )
        if ind.is_a(node, "TimeHeadwayCondition"):
            return osc.EntityCondition(
                osc.TimeHeadwayCondition(
                    entity_ref=self._other(node),
                    freespace=False,
                    rule=self._rule(node, _MOST),
                    value=value,
                    coordinate_system=_ENTITY,
                    relative_distance_type=_EUCLIDIAN,
                )
            )
        if ind.is_a(node, "SpeedCondition"):
            return osc.EntityCondition(osc.SpeedCondition(self._rule(node, _LEAST), value))
        if ind.is_a(node, "TraveledDistanceCondition"):
            return osc.EntityCondition(osc.TraveledDistanceCondition(value))
        if ind.is_a(node, "StandStillCondition"):
            return osc.EntityCondition(osc.StandStillCondition(value))
        if ind.is_a(node, "ReachPositionCondition"):
            position = self._places.position(ind.link(node, "has_position"), oriented=False)
            return osc.EntityCondition(osc.ReachPositionCondition(value, position))
        raise UnsupportedError(f"{ind.describe(node)} must be a condition that can be written")

    def _rule(self, node: Subject, usual: osc.Rule) -> osc.Rule:
        said = self._individuals.optional_text(node, "has_rule")
        return usual if said is None else osc.Rule(said)

    def _subject(self, actors: tuple[str, ...], node: Subject) -> str:
        """Return whose state a condition looks at."""
        ind = self._individuals
        if ind.optional_link(node, "has_subject") is not None:
            return self._cast.name(node, "has_subject")
        if len(actors) != 1:
            raise OntologyError(
                f"{ind.describe(node)} must say whose it is (has_subject): its event has "
                f"{len(actors)} actors"
            )
        return actors[0]

    def _other(self, node: Subject) -> str:
        return self._cast.name(node, "has_entity_ref")


def _of(actor: str, condition: osc.EntityCondition) -> osc.ByEntityCondition:
    return osc.ByEntityCondition(
        osc.TriggeringEntities(osc.TriggeringEntitiesRule.ANY, (osc.EntityRef(actor),)), condition
    )
