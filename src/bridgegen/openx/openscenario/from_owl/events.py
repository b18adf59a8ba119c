"""OWL2OpenSCENARIO, its events: actors, actions and conditions.

Every action and condition class of the ontology that a scenario's individuals may have is written
here, or refused by name.
"""

from bridgegen.errors import OntologyError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.actions import Actions
from bridgegen.openx.openscenario.from_owl.conditions import Conditions
from bridgegen.openx.openscenario.from_owl.entities import Cast, plain_text


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

    def maneuver_groups(self, scenario: Subject) -> tuple[osc.ManeuverGroup, ...]:
        """Return a group for each event that acts, in the order of their names.

        Temporary changes (a jam, road works) are what participants and objects already are.

        Raises:
            OntologyError: an event lacks what it needs, or shares its name.
            UnsupportedError: an action or condition that cannot be written.
        """
        individuals = self._individuals
        groups: dict[str, osc.ManeuverGroup] = {}
        for node in individuals.links(scenario, "has_event"):
            if individuals.is_a(node, "TemporaryChange"):
                continue
            name = plain_text(individuals, node, "has_name")
            if name in groups:
                raise OntologyError(f"events must have different names, got {name} twice")
            actors = self._cast.names(node, "has_who")
            groups[name] = osc.ManeuverGroup(
                name=f"{name}_group",
                maximum_execution_count=1,
                actors=osc.Actors(False, tuple(osc.EntityRef(one) for one in actors)),
                maneuvers=(osc.Maneuver(f"{name}_maneuver", (self._event(name, actors, node),)),),
            )
        return tuple(groups.values())

    def _event(self, name: str, actors: tuple[str, ...], node: Subject) -> osc.Event:
        ind = self._individuals
        actions = tuple(
            osc.Action(f"{name}_action_{k}", self._actions.action(name, actors, action))
            for k, action in enumerate(ind.links(node, "has_what"), start=1)
        )
        if not actions:
            raise OntologyError(f"{ind.describe(node)} must have has_what, and has none")
        trigger = ind.link(node, "has_when")
        groups = tuple(
            self._conditions.group(f"{name}_condition_{k}", actors, condition)
            for k, condition in enumerate(ind.links(trigger, "has_condition"), start=1)
        )
        if not groups:
            raise OntologyError(f"{ind.describe(trigger)} must have has_condition, and has none")
        return osc.Event(
            name, osc.Priority.OVERRIDE, actions, osc.Trigger(groups), maximum_execution_count=1
        )
