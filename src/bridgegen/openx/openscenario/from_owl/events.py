"""OWL2OpenSCENARIO, its events: actors, actions and conditions.

Every action and condition class of the ontology that a scenario's individuals may have is written
here, or refused by name.
"""

from bridgegen.base.errors import OntologyError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.actions import Actions
from bridgegen.openx.openscenario.from_owl.entities import Cast, Places, plain_text
from bridgegen.openx.openscenario.from_owl.quantities import Quantities, quoted_element
from bridgegen.openx.openscenario.from_owl.signals import lamp_states
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject

# --- OWL2OpenSCENARIO, its conditions: when an event happens ---


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
        for k, item in enumerate(nodes, start=1):
            label = name if len(nodes) == 1 else f"{name}_{k}"
            made, delay = self._condition(actors, item)
            if ind.optional_number(item, "has_delay") is not None:
                delay = self._quantities.get(item, "has_delay")
            found.append(osc.Condition(label, delay, self._edge(item), made))
        return osc.ConditionGroup(tuple(found))

    def _edge(self, node: Subject) -> osc.ConditionEdge:
        said = self._individuals.optional_text(node, "has_condition_edge")
        if said is None:
            return osc.ConditionEdge.NONE
        known = {str(edge.value): edge for edge in osc.ConditionEdge}
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


_PRIORITIES = (osc.Priority.OVERRIDE, osc.Priority.PARALLEL, osc.Priority.SKIP)


class Events:
    """The events of a scenario's individuals.

    Args:
        individuals: one scenario.
        cast: its participants.
        actions: what they do.
        conditions: when.
    """

    def __init__(
        self, individuals: Individuals, cast: Cast, actions: Actions, conditions: Conditions
    ) -> None:
        self._individuals, self._cast = individuals, cast
        self._actions, self._conditions = actions, conditions

    def acts(self, scenario: Subject) -> tuple[tuple[osc.ManeuverGroup, ...], tuple[osc.Act, ...]]:
        """Return the groups that begin with the scenario, and the acts that begin later.

        Each event that acts has a group of its own, unless its maneuver is stated; they are in the
        order of their names. Temporary changes (a jam, road works) are what participants and
        objects already are.

        Raises:
            OntologyError: an event lacks what it needs, or shares its name.
            UnsupportedError: an action or condition that cannot be written.
        """
        individuals = self._individuals
        seen: set[str] = set()
        groups: dict[Subject | None, dict[tuple[str, str], osc.ManeuverGroup]] = {None: {}}
        for node in individuals.links(scenario, "has_event"):
            if individuals.is_a(node, "TemporaryChange"):
                continue
            name = plain_text(individuals, node, "has_name")
            if name in seen:
                raise OntologyError(f"events must have different names, got {name} twice")
            seen.add(name)
            names = self._cast.names(node, "has_who")
            actors = osc.Actors(False, tuple(osc.EntityRef(item) for item in names))
            event = self._event(name, names, node)
            maneuver = individuals.optional_text(node, "in_maneuver")
            of_act = groups.setdefault(individuals.optional_link(node, "in_act"), {})
            key = ("event", name) if maneuver is None else ("maneuver", maneuver)
            other = of_act.get(key)
            if other is not None and other.actors != actors:
                raise OntologyError(
                    f"events of the maneuver {maneuver} must have the same actors, "
                    f"{individuals.describe(node)} has {', '.join(names) or 'none'}"
                )
            before = () if other is None else other.maneuvers[0].events
            called = f"{name}_maneuver" if maneuver is None else maneuver
            of_act[key] = osc.ManeuverGroup(
                name=f"{maneuver or name}_group",
                maximum_execution_count=1,
                actors=actors,
                maneuvers=(osc.Maneuver(called, (*before, event)),),
            )
        first = tuple(groups.pop(None).values())
        return first, tuple(self._act(node, tuple(of.values())) for node, of in groups.items())

    def _act(self, node: Subject | None, groups: tuple[osc.ManeuverGroup, ...]) -> osc.Act:
        assert node is not None
        name = plain_text(self._individuals, node, "has_name")
        trigger = self._individuals.link(node, "begins_when")
        return osc.Act(name, groups, osc.Trigger(self.groups(name, (), trigger)))

    def _event(self, name: str, actors: tuple[str, ...], node: Subject) -> osc.Event:
        ind = self._individuals
        actions = tuple(
            osc.Action(f"{name}_action_{k}", self._actions.action(name, actors, action))
            for k, action in enumerate(ind.links(node, "has_what"), start=1)
        )
        if not actions:
            raise OntologyError(f"{ind.describe(node)} must have has_what, and has none")
        most = ind.optional_integer(node, "has_execution_count")
        if most is not None and most < 1:
            raise OntologyError(
                f"has_execution_count of {ind.describe(node)} must be at least 1, got {most}"
            )
        return osc.Event(
            name,
            self._priority(node),
            actions,
            osc.Trigger(self.groups(name, actors, ind.link(node, "has_when"))),
            maximum_execution_count=1 if most is None else most,
        )

    def _priority(self, node: Subject) -> osc.Priority:
        said = self._individuals.optional_text(node, "has_priority")
        if said is None:
            return osc.Priority.OVERRIDE
        known = {priority.value: priority for priority in _PRIORITIES}
        if said not in known:
            raise OntologyError(
                f"has_priority of {self._individuals.describe(node)} must be one of "
                f"{', '.join(known)}, got '{said}'"
            )
        return known[said]

    def groups(
        self, name: str, actors: tuple[str, ...], trigger: Subject
    ) -> tuple[osc.ConditionGroup, ...]:
        """Return the alternatives of a trigger.

        Args:
            name: of what it triggers.
            actors: the event's, by name.
            trigger: its individual.

        Raises:
            OntologyError: there is none, or one lacks what it needs.
            UnsupportedError: a condition that cannot be written.
        """
        ind = self._individuals
        groups = tuple(
            self._conditions.group(f"{name}_condition_{k}", actors, condition)
            for k, condition in enumerate(ind.links(trigger, "has_condition"), start=1)
        )
        if not groups:
            raise OntologyError(f"{ind.describe(trigger)} must have has_condition, and has none")
        return groups
