"""OWL2OpenSCENARIO (paper, Algorithm 1, step 3): a storyboard from the ontology's individuals.

It reads nothing but individuals, so a file that somebody edited in Protégé converts as one that
we wrote. Every number that is bound to a parameter becomes ``$name``, and the parameter's value
is the individual's. Nothing depends on static parameters but the road file that is named.

What other tools need (found by reading and running esmini): orientations always with a type;
``override`` as of 1.2; routes by lane positions; inline vehicles; a stop trigger.
"""

from bridgegen.errors import OntologyError, UnsupportedError
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.vocabulary import Subject
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.owl_places import Places
from bridgegen.openx.openscenario.owl_quantities import Quantities
from bridgegen.openx.openscenario.owl_weather import environment
from bridgegen.openx.openscenario.values import format_double

DATE = "2025-01-01T00:00:00"
"""The header's date unless another is given: the same individuals give the same bytes."""

TIME_STEP = "time_step"
"""Property of the header: the step [s] of the evaluation, for which the standard has no place."""

EGO = "ego"
ARRIVAL = 2.0
"""The ego has arrived within this distance of its destination [m]."""

_ESMINI_CONTROLLER = "ExternalController"
_CATEGORIES = {
    "Car": osc.VehicleCategory.CAR,
    "Truck": osc.VehicleCategory.TRUCK,
    "Bus": osc.VehicleCategory.BUS,
    "Motorcycle": osc.VehicleCategory.MOTORBIKE,
}
# An axle as on a mid-size saloon; the ontology has no more of it than the wheelbase.
_MAX_STEERING = 0.6  # [rad]
_WHEEL_DIAMETER = 0.65  # [m]
_BODY_OVER_TRACK = 0.3  # [m], how much wider the body is than the track


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
    return _Converter(individuals).scenario(road_file, date)


class _Converter:
    """The individuals, and what is known of them."""

    def __init__(self, individuals: Individuals) -> None:
        self.individuals = individuals
        self.node = individuals.one("Scenario")
        self.quantities = Quantities(individuals, self.node)
        self.places = Places(individuals, self.quantities)
        self.participants = self._participants()

    def scenario(self, road_file: str, date: str) -> osc.OpenScenario:
        participants = self.participants
        init, texts = self._init(participants)
        declarations = self.quantities.declarations()
        for text in texts:
            if text.name in self.quantities.values:
                raise OntologyError(f"a parameter must not have the reserved name {text.name}")
        name = self._text(self.node, "has_name")
        return osc.OpenScenario(
            osc.FileHeader(
                1, 2, date, name, "BridgeGen", properties=osc.Properties(self._settings())
            ),
            osc.RoadNetwork(osc.File(road_file)),
            osc.Entities(tuple(self._object(name, node) for name, node in participants.items())),
            osc.Storyboard(osc.Init(init), self._stories(), self._stop(participants[EGO])),
            parameter_declarations=osc.ParameterDeclarations((*declarations, *texts)),
        )

    def _settings(self) -> tuple[osc.Property, ...]:
        step = self.individuals.optional_number(self.node, "has_time_step")
        return () if step is None else (osc.Property(TIME_STEP, format_double(step)),)

    def _participants(self) -> dict[str, Subject]:
        """Return the participants by name, the ego first, then in alphabetical order."""
        found: dict[str, Subject] = {}
        for node in self.individuals.links(self.node, "has_participant"):
            name = self._text(node, "has_name")
            if name in found:
                raise OntologyError(f"participants must have different names, got {name} twice")
            found[name] = node
        if EGO not in found:
            raise OntologyError(
                f"one participant must have the name {EGO}, got {', '.join(found) or 'none'}"
            )
        return {name: found[name] for name in sorted(found, key=lambda n: (n != EGO, n))}

    # -- entities ------------------------------------------------------------------------------

    def _object(self, name: str, node: Subject) -> osc.ScenarioObject:
        controller = self.individuals.optional_link(node, "has_controller")
        controllers = () if controller is None else (self._controller(controller),)
        return osc.ScenarioObject(name, self._vehicle(node), controllers)

    def _vehicle(self, node: Subject) -> osc.Vehicle:
        ind = self.individuals
        category = next((c for name, c in _CATEGORIES.items() if ind.is_a(node, name)), None)
        if category is None:
            raise UnsupportedError(
                f"{ind.describe(node)} must be one of {', '.join(_CATEGORIES)} to be written"
            )
        length, width, height = (
            ind.number(node, f"has_box_{name}") for name in ("length", "width", "height")
        )
        return osc.Vehicle(
            name=category.value,
            vehicle_category=category,
            bounding_box=osc.BoundingBox(
                osc.Center(ind.number(node, "has_center_ahead"), 0.0, height / 2),
                osc.Dimensions(width, length, height),
            ),
            performance=osc.Performance(
                ind.number(node, "has_max_speed"),
                ind.number(node, "has_max_acceleration"),
                ind.number(node, "has_max_deceleration"),
            ),
            axles=osc.Axles(
                _axle(_MAX_STEERING, width, ind.number(node, "has_wheelbase")),
                _axle(0.0, width, 0.0),
            ),
            properties=osc.Properties(),
        )

    def _controller(self, node: Subject) -> osc.ObjectController:
        """Return a named controller; who wants another driver replaces it or its property.

        To esmini it is an external one, which stays idle until it is activated; a type that esmini
        does not know would be an error in its log.
        """
        driver = self._text(node, "has_driver")
        properties = osc.Properties(
            (osc.Property("driver", driver), osc.Property("esminiController", _ESMINI_CONTROLLER))
        )
        return osc.ObjectController(osc.Controller(self._text(node, "has_name"), properties))

    # -- start and end -------------------------------------------------------------------------

    def _init(
        self, participants: dict[str, Subject]
    ) -> tuple[osc.InitActions, list[osc.ParameterDeclaration]]:
        weather = self.individuals.optional_link(self.node, "has_weather")
        globals_: tuple[osc.GlobalAction, ...] = ()
        texts: list[osc.ParameterDeclaration] = []
        if weather is not None:
            result, texts = environment(self.individuals, weather, self.quantities)
            globals_ = (osc.GlobalAction(osc.EnvironmentAction(result)),)
        privates = tuple(
            osc.Private(name, self._start(name, node)) for name, node in participants.items()
        )
        return osc.InitActions(globals_, privates), texts

    def _start(self, name: str, node: Subject) -> tuple[osc.PrivateAction, ...]:
        """Return place, speed and route of a participant, in this order."""
        ind = self.individuals
        teleports: list[osc.PrivateAction] = []
        speeds: list[osc.PrivateAction] = []
        for action in ind.links(node, "has_init_action"):
            if ind.is_a(action, "TeleportAction"):
                position = self.places.position(ind.link(action, "has_position"), oriented=True)
                teleports.append(osc.PrivateAction(osc.TeleportAction(position)))
            else:
                speeds.append(self._speed(action))
        if len(teleports) != 1 or len(speeds) > 1:
            raise OntologyError(
                f"{ind.describe(node)} must have one TeleportAction and at most one SpeedAction as "
                f"has_init_action, got {len(teleports)} and {len(speeds)}"
            )
        actions = teleports + speeds
        route = ind.optional_link(node, "has_route")
        if route is not None:
            actions.append(self._route(f"{name}_route", route))
        return tuple(actions)

    def _route(self, name: str, node: Subject) -> osc.PrivateAction:
        """Return a route by its ends: between them one intersection, crossed the shortest way."""
        waypoints = tuple(
            osc.Waypoint(
                osc.RouteStrategy.SHORTEST,
                self.places.position(self.individuals.link(node, end), oriented=True),
            )
            for end in ("has_start", "has_destination")
        )
        route = osc.Route(name, closed=False, waypoints=waypoints)
        return osc.PrivateAction(osc.RoutingAction(osc.AssignRouteAction(route)))

    def _speed(self, node: Subject) -> osc.PrivateAction:
        """Return a speed action: at a constant rate [m/s²], or at once where there is none."""
        if not self.individuals.is_a(node, "SpeedAction"):
            raise UnsupportedError(
                f"{self.individuals.describe(node)} must be a SpeedAction to be written here"
            )
        if self.individuals.optional_number(node, "has_rate") is None:
            dynamics = osc.TransitionDynamics(
                osc.DynamicsShape.STEP, osc.DynamicsDimension.TIME, 0.0
            )
        else:
            dynamics = osc.TransitionDynamics(
                osc.DynamicsShape.LINEAR,
                osc.DynamicsDimension.RATE,
                self.quantities.get(node, "has_rate"),
            )
        speed = self.quantities.get(node, "has_target_speed")
        target = osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(speed))
        return osc.PrivateAction(osc.LongitudinalAction(osc.SpeedAction(dynamics, target)))

    def _stop(self, ego: Subject) -> osc.Trigger:
        """Return the end: the duration has passed, or the ego has arrived."""
        duration = self.quantities.get(self.node, "has_duration")
        groups = [_alternative("duration", _after(duration))]
        route = self.individuals.optional_link(ego, "has_route")
        if route is not None:
            destination = self.individuals.link(route, "has_destination")
            position = self.places.position(destination, oriented=False)
            arrived = osc.ReachPositionCondition(ARRIVAL, position)
            groups.append(_alternative("ego_arrives", _of_entity(EGO, arrived)))
        return osc.Trigger(tuple(groups))

    # -- events --------------------------------------------------------------------------------

    def _stories(self) -> tuple[osc.Story, ...]:
        groups: dict[str, osc.ManeuverGroup] = {}
        for node in self.individuals.links(self.node, "has_event"):
            name = self._text(node, "has_name")
            if name in groups:
                raise OntologyError(f"events must have different names, got {name} twice")
            who = self._participant(node, "has_who")
            groups[name] = osc.ManeuverGroup(
                name=f"{name}_group",
                maximum_execution_count=1,
                actors=osc.Actors(False, (osc.EntityRef(who),)),
                maneuvers=(osc.Maneuver(f"{name}_maneuver", (self._event(name, who, node),)),),
            )
        if not groups:
            return ()
        start = osc.Trigger((_alternative("start", _after(0.0)),))
        return (osc.Story("story", (osc.Act("act", tuple(groups.values()), start),)),)

    def _event(self, name: str, who: str, node: Subject) -> osc.Event:
        ind = self.individuals
        actions = tuple(
            osc.Action(f"{name}_action_{k}", self._speed(action))
            for k, action in enumerate(ind.links(node, "has_what"), start=1)
        )
        if not actions:
            raise OntologyError(f"{ind.describe(node)} must have has_what, and has none")
        trigger = ind.link(node, "has_when")
        groups = tuple(
            _alternative(f"{name}_condition_{k}", self._condition(who, condition))
            for k, condition in enumerate(ind.links(trigger, "has_condition"), start=1)
        )
        if not groups:
            raise OntologyError(f"{ind.describe(trigger)} must have has_condition, and has none")
        return osc.Event(
            name, osc.Priority.OVERRIDE, actions, osc.Trigger(groups), maximum_execution_count=1
        )

    def _condition(self, who: str, node: Subject) -> osc.ByEntityCondition | osc.ByValueCondition:
        """Return a condition: from a time on, or within a distance between reference points."""
        value = self.quantities.get(node, "has_value")
        if self.individuals.is_a(node, "SimulationTimeCondition"):
            return _after(value)
        if self.individuals.is_a(node, "RelativeDistanceCondition"):
            return _of_entity(
                who,
                osc.RelativeDistanceCondition(
                    entity_ref=self._participant(node, "has_entity_ref"),
                    relative_distance_type=osc.RelativeDistanceType.EUCLIDIAN_DISTANCE,
                    value=value,
                    freespace=False,
                    rule=osc.Rule.LESS_OR_EQUAL,
                    coordinate_system=osc.CoordinateSystem.ENTITY,
                ),
            )
        raise UnsupportedError(
            f"{self.individuals.describe(node)} must be a SimulationTimeCondition or a "
            "RelativeDistanceCondition to be written"
        )

    def _text(self, node: Subject, name: str) -> str:
        """Return a text that reads as itself in the file, not as a reference to a parameter."""
        text = self.individuals.text(node, name)
        if text.startswith("$"):
            raise OntologyError(
                f"{name} of {self.individuals.describe(node)} must not begin with $, got '{text}'"
            )
        return text

    def _participant(self, node: Subject, link: str) -> str:
        """Return the name of the participant that a property points to."""
        target = self.individuals.link(node, link)
        for name, participant in self.participants.items():
            if participant == target:
                return name
        raise OntologyError(
            f"{link} of {self.individuals.describe(node)} must be a participant of the scenario, "
            f"got {self.individuals.describe(target)}"
        )


def _axle(max_steering: float, width: float, position: float) -> osc.Axle:
    return osc.Axle(
        max_steering,
        _WHEEL_DIAMETER,
        round(width - _BODY_OVER_TRACK, 3),
        position,
        _WHEEL_DIAMETER / 2,
    )


def _alternative(
    name: str, condition: osc.ByEntityCondition | osc.ByValueCondition
) -> osc.ConditionGroup:
    """Return a condition that suffices alone.

    Its edge is ``none``: a rising edge needs an earlier instant at which the condition was false,
    and would miss one that is true from the start. What it triggers happens once all the same.
    """
    return osc.ConditionGroup((osc.Condition(name, 0.0, osc.ConditionEdge.NONE, condition),))


def _after(time: float | osc.ParameterRef) -> osc.ByValueCondition:
    return osc.ByValueCondition(osc.SimulationTimeCondition(time, osc.Rule.GREATER_OR_EQUAL))


def _of_entity(
    who: str, condition: osc.RelativeDistanceCondition | osc.ReachPositionCondition
) -> osc.ByEntityCondition:
    return osc.ByEntityCondition(
        osc.TriggeringEntities(osc.TriggeringEntitiesRule.ANY, (osc.EntityRef(who),)),
        osc.EntityCondition(condition),
    )
