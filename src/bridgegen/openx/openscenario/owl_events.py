"""OWL2OpenSCENARIO, its events: what happens, and when.

Every action and condition class of the ontology that a scenario's individuals may have is written
here, or refused by name.
"""

from collections.abc import Callable, Mapping

from bridgegen.errors import OntologyError, UnsupportedError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.owl_entities import plain_text
from bridgegen.openx.openscenario.owl_places import Places
from bridgegen.openx.openscenario.owl_quantities import Quantities
from bridgegen.openx.openscenario.owl_signals import lamp_states
from bridgegen.openx.openscenario.owl_weather import environment

AnyCondition = osc.ByEntityCondition | osc.ByValueCondition
_EUCLIDIAN = osc.RelativeDistanceType.EUCLIDIAN_DISTANCE
_ENTITY = osc.CoordinateSystem.ENTITY
_LEAST, _MOST = osc.Rule.GREATER_OR_EQUAL, osc.Rule.LESS_OR_EQUAL


class Events:
    """The events of a scenario's individuals.

    Attributes:
        texts: parameters of text that the events' environments refer to.

    Args:
        individuals: one scenario.
        quantities: its numbers.
        places: its positions.
        participants: entities by name.
    """

    def __init__(
        self,
        individuals: Individuals,
        quantities: Quantities,
        places: Places,
        participants: Mapping[str, Subject],
    ) -> None:
        self._individuals, self._quantities = individuals, quantities
        self._places, self._participants = places, participants
        self.texts: list[osc.ParameterDeclaration] = []

    # -- events --------------------------------------------------------------------------------

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
            who = tuple(self._names(node, "has_who"))
            groups[name] = osc.ManeuverGroup(
                name=f"{name}_group",
                maximum_execution_count=1,
                actors=osc.Actors(False, tuple(osc.EntityRef(one) for one in who)),
                maneuvers=(osc.Maneuver(f"{name}_maneuver", (self._event(name, who, node),)),),
            )
        return tuple(groups.values())

    def _event(self, name: str, who: tuple[str, ...], node: Subject) -> osc.Event:
        ind = self._individuals
        actions = tuple(
            osc.Action(f"{name}_action_{k}", self._action(name, who, action))
            for k, action in enumerate(ind.links(node, "has_what"), start=1)
        )
        if not actions:
            raise OntologyError(f"{ind.describe(node)} must have has_what, and has none")
        trigger = ind.link(node, "has_when")
        groups = tuple(
            self._alternative(f"{name}_condition_{k}", who, condition)
            for k, condition in enumerate(ind.links(trigger, "has_condition"), start=1)
        )
        if not groups:
            raise OntologyError(f"{ind.describe(trigger)} must have has_condition, and has none")
        return osc.Event(
            name, osc.Priority.OVERRIDE, actions, osc.Trigger(groups), maximum_execution_count=1
        )

    # -- actions -------------------------------------------------------------------------------

    def _action(
        self, event: str, who: tuple[str, ...], node: Subject
    ) -> osc.PrivateAction | osc.GlobalAction:
        ind = self._individuals
        if ind.is_a(node, "EnvironmentAction"):
            weather = ind.link(node, "has_weather")
            made, texts = environment(ind, weather, self._quantities, name=event)
            self.texts += texts
            return osc.GlobalAction(osc.EnvironmentAction(made))
        if ind.is_a(node, "TrafficSignalStateAction"):
            return self._signal(node)
        if not who:
            raise OntologyError(f"{ind.describe(node)} must have an actor (has_who of its event)")
        return self.private(who[0], node)

    def private(self, who: str, node: Subject) -> osc.PrivateAction:
        """Return an action of a participant.

        Raises:
            UnsupportedError: an action of a class that cannot be written.
        """
        ind = self._individuals
        kinds: dict[str, Callable[[str, Subject], osc.PrivateAction]] = {
            "SpeedAction": self._speed,
            "LaneChangeAction": self._lane_change,
            "TeleportAction": self._teleport,
            "FollowTrajectoryAction": self._follow,
            "AssignRouteAction": self._assign_route,
        }
        for name, make in kinds.items():
            if ind.is_a(node, name):
                return make(who, node)
        raise UnsupportedError(
            f"{ind.describe(node)} must be one of {', '.join(kinds)}, EnvironmentAction or "
            "TrafficSignalStateAction to be written"
        )

    def _teleport(self, who: str, node: Subject) -> osc.PrivateAction:
        del who
        place = self._individuals.link(node, "has_position")
        position = self._places.position(place, oriented=True)
        return osc.PrivateAction(osc.TeleportAction(position))

    def _speed(self, who: str, node: Subject) -> osc.PrivateAction:
        """Return a speed action: by rate [m/s²], time [s] or distance [m], or at once."""
        del who
        speed = self._quantities.get(node, "has_target_speed")
        target = osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(speed))
        return osc.PrivateAction(
            osc.LongitudinalAction(osc.SpeedAction(self._dynamics(node), target))
        )

    def _lane_change(self, who: str, node: Subject) -> osc.PrivateAction:
        ind = self._individuals
        lanes = ind.integer(node, "has_lane_count")
        offset = None
        if ind.optional_number(node, "has_target_offset") is not None:
            offset = self._quantities.get(node, "has_target_offset")
        target = osc.LaneChangeTarget(osc.RelativeTargetLane(who, lanes))
        return osc.PrivateAction(
            osc.LateralAction(osc.LaneChangeAction(self._dynamics(node), target, offset))
        )

    def _dynamics(self, node: Subject) -> osc.TransitionDynamics:
        ind = self._individuals
        shape = osc.DynamicsShape(ind.optional_text(node, "has_dynamics_shape") or "linear")
        dimensions = {
            "has_rate": osc.DynamicsDimension.RATE,
            "has_transition_time": osc.DynamicsDimension.TIME,
            "has_transition_distance": osc.DynamicsDimension.DISTANCE,
        }
        given = [name for name in dimensions if ind.optional_number(node, name) is not None]
        if len(given) > 1:
            raise OntologyError(
                f"{ind.describe(node)} must have one of {', '.join(dimensions)}, got "
                f"{', '.join(given)}"
            )
        if not given or shape is osc.DynamicsShape.STEP:
            return osc.TransitionDynamics(osc.DynamicsShape.STEP, osc.DynamicsDimension.TIME, 0.0)
        value = self._quantities.get(node, given[0])
        return osc.TransitionDynamics(shape, dimensions[given[0]], value)

    def _follow(self, who: str, node: Subject) -> osc.PrivateAction:
        """Return the following of a trajectory: to the times that its vertices have, if any."""
        ind = self._individuals
        trajectory = ind.link(node, "has_trajectory")
        vertices = sorted(
            ind.links(trajectory, "has_vertex"), key=lambda one: ind.integer(one, "has_index")
        )
        times = [ind.optional_number(one, "has_time") for one in vertices]
        timed = all(time is not None for time in times)
        if not timed and any(time is not None for time in times):
            raise OntologyError(
                f"{ind.describe(trajectory)} must have a time at all of its vertices, or at none"
            )
        if len(vertices) < 2:
            raise OntologyError(
                f"{ind.describe(trajectory)} must have two vertices or more, got {len(vertices)}"
            )
        polyline = osc.Polyline(
            tuple(
                osc.Vertex(
                    self._places.position(ind.link(one, "has_position"), oriented=False), time
                )
                for one, time in zip(vertices, times, strict=True)
            )
        )
        del who
        reference: osc.NoTime | osc.Timing = osc.NoTime()
        if timed:
            reference = osc.Timing(osc.ReferenceContext.ABSOLUTE, 1.0, 0.0)
        name = plain_text(ind, trajectory, "has_name")
        made = osc.Trajectory(name, closed=False, shape=osc.Shape(polyline))
        action = osc.FollowTrajectoryAction(
            osc.TimeReference(reference),
            osc.TrajectoryFollowingMode(osc.FollowingMode.POSITION),
            osc.TrajectoryRef(made),
        )
        return osc.PrivateAction(osc.RoutingAction(action))

    def _assign_route(self, who: str, node: Subject) -> osc.PrivateAction:
        return self.route(f"{who}_route", self._individuals.link(node, "has_route"))

    def route(self, name: str, node: Subject) -> osc.PrivateAction:
        """Return a route by its ends: between them one intersection, crossed the shortest way."""
        waypoints = tuple(
            osc.Waypoint(
                osc.RouteStrategy.SHORTEST,
                self._places.position(self._individuals.link(node, end), oriented=True),
            )
            for end in ("has_start", "has_destination")
        )
        made = osc.Route(name, closed=False, waypoints=waypoints)
        return osc.PrivateAction(osc.RoutingAction(osc.AssignRouteAction(made)))

    def _signal(self, node: Subject) -> osc.GlobalAction:
        ind = self._individuals
        light = ind.link(node, "has_signal")
        state = lamp_states(ind.text(node, "has_signal_state"))
        name = plain_text(ind, light, "has_object_id")
        return osc.GlobalAction(
            osc.InfrastructureAction(
                osc.TrafficSignalAction(osc.TrafficSignalStateAction(name, state))
            )
        )

    # -- conditions ----------------------------------------------------------------------------

    def _alternative(self, name: str, who: tuple[str, ...], node: Subject) -> osc.ConditionGroup:
        """Return conditions that suffice together.

        Their edge is ``none``: a rising edge needs an earlier instant at which the condition was
        false, and would miss one that is true from the start. What it triggers happens once all
        the same.
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
            made, delay = self._condition(who, one)
            found.append(osc.Condition(label, delay, osc.ConditionEdge.NONE, made))
        return osc.ConditionGroup(tuple(found))

    def _condition(
        self, who: tuple[str, ...], node: Subject
    ) -> tuple[AnyCondition, float | osc.ParameterRef]:
        """Return a condition and its delay [s]."""
        ind = self._individuals
        if ind.is_a(node, "StoryboardElementStateCondition"):
            event = plain_text(ind, ind.link(node, "has_event_ref"), "has_name")
            state = osc.StoryboardElementStateCondition(
                osc.StoryboardElementType.EVENT, event, osc.StoryboardElementState.COMPLETE_STATE
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
        return _of(self._subject(who, node), self._of_entity(node)), 0.0

    def _of_entity(self, node: Subject) -> osc.EntityCondition:
        ind = self._individuals
        if ind.is_a(node, "CollisionCondition"):
            return osc.EntityCondition(osc.CollisionCondition(osc.EntityRef(self._other(node))))
        value = self._quantities.get(node, "has_value")
        if ind.is_a(node, "RelativeDistanceCondition"):
            return osc.EntityCondition(
                osc.RelativeDistanceCondition(
                    entity_ref=self._other(node),
                    relative_distance_type=_EUCLIDIAN,
                    value=value,
                    freespace=False,
                    rule=self._rule(node, _MOST),
                    coordinate_system=_ENTITY,
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

    # -- who -----------------------------------------------------------------------------------

    def _subject(self, who: tuple[str, ...], node: Subject) -> str:
        """Return whose state a condition looks at."""
        ind = self._individuals
        if ind.optional_link(node, "has_subject") is not None:
            return self._name(node, "has_subject")
        if len(who) != 1:
            raise OntologyError(
                f"{ind.describe(node)} must say whose it is (has_subject): its event has "
                f"{len(who)} actors"
            )
        return who[0]

    def _other(self, node: Subject) -> str:
        return self._name(node, "has_entity_ref")

    def _name(self, node: Subject, link: str) -> str:
        """Return the name of the participant that a property points to."""
        return self._name_of(node, link, self._individuals.link(node, link))

    def _names(self, node: Subject, link: str) -> list[str]:
        return [self._name_of(node, link, one) for one in self._individuals.links(node, link)]

    def _name_of(self, node: Subject, link: str, target: Subject) -> str:
        for name, participant in self._participants.items():
            if participant == target:
                return name
        raise OntologyError(
            f"{link} of {self._individuals.describe(node)} must be a participant of the scenario, "
            f"got {self._individuals.describe(target)}"
        )


def _of(who: str, condition: osc.EntityCondition) -> osc.ByEntityCondition:
    return osc.ByEntityCondition(
        osc.TriggeringEntities(osc.TriggeringEntitiesRule.ANY, (osc.EntityRef(who),)), condition
    )
