"""OWL2OpenSCENARIO, its events: actors, actions and conditions.

Every action and condition class of the ontology that a scenario's individuals may have is written
here, or refused by name.
"""

from bridgegen.base.errors import OntologyError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.actions import Actions
from bridgegen.openx.openscenario.from_owl.conditions import Conditions
from bridgegen.openx.openscenario.from_owl.entities import Cast, plain_text
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import Subject

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
            actors = osc.Actors(False, tuple(osc.EntityRef(one) for one in names))
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
        known = {one.value: one for one in _PRIORITIES}
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
