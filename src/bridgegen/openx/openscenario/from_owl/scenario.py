"""OWL2OpenSCENARIO (paper, Algorithm 1, step 3): a storyboard from the ontology's individuals.

It reads nothing but individuals, so a file that was edited in Protégé converts as one that
we wrote. Every number that is bound to a parameter becomes ``$name``, and the parameter's value
is the individual's. Nothing depends on static parameters but the road file that is named.

What other tools need (found by reading and running esmini): orientations always with a type;
``override`` as of 1.2; routes by lane positions; inline vehicles; a stop trigger.
"""

from dataclasses import replace
from itertools import count

from bridgegen.base.errors import OntologyError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.actions import Actions
from bridgegen.openx.openscenario.from_owl.entities import Cast, Places, plain_text, scenario_object
from bridgegen.openx.openscenario.from_owl.events import Conditions, Events
from bridgegen.openx.openscenario.from_owl.notes import Notes
from bridgegen.openx.openscenario.from_owl.quantities import Quantities, quoted_element
from bridgegen.openx.openscenario.from_owl.signals import Signals, environment
from bridgegen.openx.openscenario.parameters import EGO
from bridgegen.openx.openscenario.write import least_version, to_version
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.mirror import is_left_hand
from bridgegen.scenario.ontology.vocabulary import Subject

DATE = "2025-01-01T00:00:00"
"""The header's date unless another is given: the same individuals give the same bytes."""

ARRIVAL = 2.0
"""Distance of its destination within which the ego has arrived [m]."""


def openscenario_from_owl(
    individuals: Individuals, road_file: str, *, date: str = DATE
) -> osc.OpenScenario:
    """Return the scenario, version 1.2, that a scenario's individuals describe.

    Args:
        individuals: one scenario.
        road_file: path of its OpenDRIVE file, relative to where the scenario is written.
        date: ``YYYY-MM-DDThh:mm:ss`` for the header.

    Raises:
        OntologyError: an individual lacks what a scenario needs, or contradicts another.
        UnsupportedError: a participant or an action of a class that cannot be written yet.
    """
    made = _Converter(individuals).scenario(road_file, date)
    return replace(made, left_hand=is_left_hand(individuals))


class _Converter:
    """The individuals, and what is known of them."""

    def __init__(self, individuals: Individuals) -> None:
        self.individuals = individuals
        self.node = individuals.one("Scenario")
        self.quantities = Quantities(individuals, self.node)
        self.places = Places(individuals, self.quantities)
        self.participants = self._participants()
        cast = Cast(individuals, self.participants)
        said = individuals, self.quantities, self.places, cast
        self.actions = Actions(*said)
        self.events = Events(individuals, cast, self.actions, Conditions(*said))
        self.signals = Signals(individuals, individuals.number(self.node, "has_duration"))

    def scenario(self, road_file: str, date: str) -> osc.OpenScenario:
        elements = self._elements()
        init, texts = self._init(elements)
        groups, acts = self.events.acts(self.node)
        groups += tuple(self.signals.maneuver_groups())
        texts += self.actions.texts
        declarations = self.quantities.declarations()
        for text in texts:
            if text.name in self.quantities.values or text.name in self.quantities.words:
                raise OntologyError(f"a parameter must not have the reserved name {text.name}")
        name = plain_text(self.individuals, self.node, "has_name")
        controllers = tuple(self.signals.controllers)
        notes = tuple(
            Notes(self.individuals, self.node, self.quantities, self.places).properties(
                self.signals
            )
        )
        made = osc.OpenScenario(
            osc.FileHeader(1, 2, date, name, "BridgeGen", properties=osc.Properties(notes)),
            osc.RoadNetwork(
                osc.File(road_file),
                traffic_signals=osc.TrafficSignals(controllers) if controllers else None,
            ),
            osc.Entities(
                tuple(
                    scenario_object(self.individuals, self.quantities, name, node)
                    for name, node in (self.participants | elements).items()
                )
            ),
            osc.Storyboard(
                osc.Init(init), _stories(groups, acts), self._stop(self.participants[EGO])
            ),
            parameter_declarations=osc.ParameterDeclarations((*declarations, *texts)),
            variable_declarations=self._variables(),
        )
        version = least_version(made)
        return made if version == "1.2" else to_version(made, version, name)

    def _participants(self) -> dict[str, Subject]:
        """Return the participants by name, the ego first, then in alphabetical order."""
        found: dict[str, Subject] = {}
        for node in self.individuals.links(self.node, "has_participant"):
            name = plain_text(self.individuals, node, "has_name")
            if name in found:
                raise OntologyError(f"participants must have different names, got {name} twice")
            found[name] = node
        if EGO not in found:
            raise OntologyError(
                f"one participant must have the name {EGO}, got {', '.join(found) or 'none'}"
            )
        return {name: found[name] for name in sorted(found, key=lambda n: (n != EGO, n))}

    def _elements(self) -> dict[str, Subject]:
        """Return what stands at road works, by name."""
        found: dict[str, Subject] = {}
        for event in self.individuals.links(self.node, "has_event"):
            if self.individuals.is_a(event, "RoadWorks"):
                for node in self.individuals.links(event, "has_element"):
                    name = plain_text(self.individuals, node, "has_name")
                    if name in found or name in self.participants:
                        raise OntologyError(f"entities must have different names, got {name} twice")
                    found[name] = node
        return {name: found[name] for name in sorted(found)}

    def _variables(self) -> osc.VariableDeclarations | None:
        found = [
            quoted_element(self.individuals, node, {"VariableDeclaration": osc.VariableDeclaration})
            for node in self.individuals.links(self.node, "has_variable")
        ]
        known = tuple(element for element in found if isinstance(element, osc.VariableDeclaration))
        return osc.VariableDeclarations(known) if known else None

    # -- start and end -------------------------------------------------------------------------

    def _init(
        self, elements: dict[str, Subject]
    ) -> tuple[osc.InitActions, list[osc.ParameterDeclaration]]:
        weather = self.individuals.optional_link(self.node, "has_weather")
        globals_: list[osc.GlobalAction] = []
        texts: list[osc.ParameterDeclaration] = []
        if weather is not None:
            result, texts = environment(self.individuals, weather, self.quantities)
            globals_.append(osc.GlobalAction(osc.EnvironmentAction(result)))
        for action in self.individuals.links(self.node, "has_global_action"):
            globals_.append(self.actions.scenario_wide(action))
        privates = [
            osc.Private(name, self._start(name, node)) for name, node in self.participants.items()
        ]
        for name, node in elements.items():
            place = self.individuals.link(node, "has_position")
            position = self.places.position(place, oriented=True)
            standing = osc.PrivateAction(osc.TeleportAction(position))
            privates.append(osc.Private(name, (standing,)))
        return osc.InitActions((*globals_, *self.signals.start), tuple(privates)), texts

    def _start(self, name: str, node: Subject) -> tuple[osc.PrivateAction, ...]:
        """Return place, speed and way of a participant, in this order, and what else it does."""
        ind = self.individuals
        kinds = ("TeleportAction", "SpeedAction", "FollowTrajectoryAction", "")
        found: dict[str, list[osc.PrivateAction]] = {kind: [] for kind in kinds}
        for action in ind.links(node, "has_init_action"):
            kind = next((item for item in kinds[:3] if ind.is_a(action, item)), kinds[3])
            found[kind].append(self.actions.private(name, action))
        counts = [len(found[kind]) for kind in kinds]
        comes_later = counts[0] == 0 and node in self._added()
        if (counts[0] != 1 and not comes_later) or counts[1] > 1 or counts[2] > 1:
            raise OntologyError(
                f"{ind.describe(node)} must have one TeleportAction and at most one SpeedAction "
                f"and one FollowTrajectoryAction as has_init_action, got {counts[0]}, {counts[1]} "
                f"and {counts[2]}"
            )
        others = found.pop(kinds[3])
        actions = [action for each in found.values() for action in each]
        route = ind.optional_link(node, "has_route")
        if route is not None:
            actions.append(self.actions.route(f"{name}_route", route))
        return (*actions, *others)

    def _added(self) -> set[Subject]:
        """Return the participants that an action adds; they need no place at the start."""
        return {
            who
            for action in self.individuals.of_class("AddEntityAction")
            for who in self.individuals.links(action, "has_entity_ref")
        }

    def _stop(self, ego: Subject) -> osc.Trigger:
        """Return the end: the duration has passed, the ego has arrived, or what else ends it."""
        duration = self.quantities.get(self.node, "has_duration")
        passed = osc.SimulationTimeCondition(duration, osc.Rule.GREATER_OR_EQUAL)
        groups = [_alternative("duration", osc.ByValueCondition(passed))]
        route = self.individuals.optional_link(ego, "has_route")
        if route is not None and self.individuals.optional_text(self.node, "has_arrival") is None:
            destination = self.individuals.link(route, "has_destination")
            position = self.places.position(destination, oriented=False)
            arrived = osc.ByEntityCondition(
                osc.TriggeringEntities(osc.TriggeringEntitiesRule.ANY, (osc.EntityRef(EGO),)),
                osc.EntityCondition(osc.ReachPositionCondition(ARRIVAL, position)),
            )
            groups.append(_alternative("ego_arrives", arrived))
        stop = self.individuals.optional_link(self.node, "has_stop")
        if stop is not None:
            groups += self.events.groups("stop", (), stop)
        return osc.Trigger(tuple(groups))


def _stories(
    groups: tuple[osc.ManeuverGroup, ...], later: tuple[osc.Act, ...]
) -> tuple[osc.Story, ...]:
    if not groups and not later:
        return ()
    begun = osc.SimulationTimeCondition(0.0, osc.Rule.GREATER_OR_EQUAL)
    start = osc.Trigger((_alternative("start", osc.ByValueCondition(begun)),))
    taken = {act.name for act in later}
    name = next(item for k in count(1) if (item := f"act_{k}" if k > 1 else "act") not in taken)
    first = (osc.Act(name, groups, start),) if groups else ()
    return (osc.Story("story", (*first, *later)),)


def _alternative(
    name: str, condition: osc.ByEntityCondition | osc.ByValueCondition
) -> osc.ConditionGroup:
    return osc.ConditionGroup((osc.Condition(name, 0.0, osc.ConditionEdge.NONE, condition),))
