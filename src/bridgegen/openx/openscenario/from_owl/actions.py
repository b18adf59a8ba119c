"""OWL2OpenSCENARIO, its actions: what participants, the weather and the lights are made to do."""

from collections.abc import Callable

from bridgegen.base.errors import OntologyError, UnsupportedError
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl.entities import Cast, Places, plain_text
from bridgegen.openx.openscenario.from_owl.quantities import Quantities, quoted_element
from bridgegen.openx.openscenario.from_owl.signals import environment, lamp_states
from bridgegen.openx.openscenario.movement import uniform_knots
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.story import ROUTE_CHANGE
from bridgegen.scenario.ontology.vocabulary import Subject


class Actions:
    """The actions of a scenario's individuals.

    Attributes:
        texts: parameters of text that the environments refer to.

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
        self.texts: list[osc.ParameterDeclaration] = []

    def action(
        self, event: str, actors: tuple[str, ...], node: Subject
    ) -> osc.PrivateAction | osc.GlobalAction:
        """Return an action of an event.

        Args:
            event: its name, for what the action declares.
            actors: the event's actors, by name.
            node: the action's individual.

        Raises:
            OntologyError: the action lacks what it needs.
            UnsupportedError: an action of a class that cannot be written.
        """
        ind = self._individuals
        if ind.is_a(node, "OpenScenarioAction"):
            return self._quoted(node)
        if ind.is_a(node, "EnvironmentAction"):
            weather = ind.link(node, "has_weather")
            made, texts = environment(ind, weather, self._quantities, name=event)
            self.texts += texts
            return osc.GlobalAction(osc.EnvironmentAction(made))
        if ind.is_a(node, "TrafficSignalStateAction"):
            return self._signal(node)
        if ind.is_a(node, "AddEntityAction") or ind.is_a(node, "DeleteEntityAction"):
            return self._presence(node)
        if not actors:
            raise OntologyError(f"{ind.describe(node)} must have an actor (has_who of its event)")
        return self.private(actors[0], node)

    # -- of participants ---------------------------------------------------------------------------

    def private(self, actor: str, node: Subject) -> osc.PrivateAction:
        """Return an action of a participant.

        Raises:
            OntologyError: the action lacks what it needs.
            UnsupportedError: an action of a class that cannot be written.
        """
        ind = self._individuals
        if ind.is_a(node, "OpenScenarioAction"):
            made = self._quoted(node)
            if not isinstance(made, osc.PrivateAction):
                raise OntologyError(f"{ind.describe(node)} must be a PrivateAction")
            return made
        kinds: dict[str, Callable[[str, Subject], osc.PrivateAction]] = {
            "SpeedAction": self._speed,
            "LaneChangeAction": self._lane_change,
            "LaneOffsetAction": self._lane_offset,
            "TeleportAction": self._teleport,
            "SynchronizeAction": self._synchronize,
            "LongitudinalDistanceAction": self._keep_distance,
            "FollowTrajectoryAction": self._follow,
            "AssignRouteAction": self._assign_route,
            "LightStateAction": self._switch,
        }
        for name, make in kinds.items():
            if ind.is_a(node, name):
                return make(actor, node)
        raise UnsupportedError(
            f"{ind.describe(node)} must be one of {', '.join(kinds)}, EnvironmentAction, "
            "TrafficSignalStateAction, AddEntityAction or DeleteEntityAction to be written"
        )

    def scenario_wide(self, node: Subject) -> osc.GlobalAction:
        """Return an action of nobody.

        Raises:
            OntologyError: it is another one, or malformed.
        """
        made = self._quoted(node)
        if not isinstance(made, osc.GlobalAction):
            raise OntologyError(f"{self._individuals.describe(node)} must be a GlobalAction")
        return made

    def _quoted(self, node: Subject) -> osc.PrivateAction | osc.GlobalAction:
        options = {"PrivateAction": osc.PrivateAction, "GlobalAction": osc.GlobalAction}
        made = quoted_element(self._individuals, node, options)
        assert isinstance(made, osc.PrivateAction | osc.GlobalAction)
        return made

    def _teleport(self, actor: str, node: Subject) -> osc.PrivateAction:
        del actor
        place = self._individuals.link(node, "has_position")
        position = self._places.position(place, oriented=True)
        return osc.PrivateAction(osc.TeleportAction(position))

    def _speed(self, actor: str, node: Subject) -> osc.PrivateAction:
        """Return a change of speed: by rate [m/s²], time [s] or distance [m], or at once.

        With a maximum jerk [m/s³] it is a speed profile of one entry, which can state that.
        """
        del actor
        speed = self._quantities.get(node, "has_target_speed")
        if self._individuals.optional_number(node, "has_max_jerk") is not None:
            rate, jerk = (self._quantities.get(node, name) for name in ("has_rate", "has_max_jerk"))
            limits = osc.DynamicConstraints(rate, rate, None, jerk, jerk)
            entries = (osc.SpeedProfileEntry(speed),)
            profile = osc.SpeedProfileAction(
                osc.FollowingMode.FOLLOW, entries, dynamic_constraints=limits
            )
            return osc.PrivateAction(osc.LongitudinalAction(profile))
        target = osc.SpeedActionTarget(osc.AbsoluteTargetSpeed(speed))
        return osc.PrivateAction(
            osc.LongitudinalAction(osc.SpeedAction(self._dynamics(node), target))
        )

    def _lane_change(self, actor: str, node: Subject) -> osc.PrivateAction:
        ind = self._individuals
        lanes = ind.integer(node, "has_lane_count")
        offset = None
        if ind.optional_number(node, "has_target_offset") is not None:
            offset = self._quantities.get(node, "has_target_offset")
        target = osc.LaneChangeTarget(osc.RelativeTargetLane(actor, lanes))
        return osc.PrivateAction(
            osc.LateralAction(osc.LaneChangeAction(self._dynamics(node), target, offset))
        )

    def _lane_offset(self, actor: str, node: Subject) -> osc.PrivateAction:
        """Return a move aside: at once where the shape is a step, else as softly as is said."""
        del actor
        ind = self._individuals
        most = None
        if ind.optional_number(node, "has_max_lateral_acceleration") is not None:
            most = self._quantities.get(node, "has_max_lateral_acceleration")
        shape = osc.DynamicsShape(ind.optional_text(node, "has_dynamics_shape") or "linear")
        offset = self._quantities.get(node, "has_target_offset")
        return osc.PrivateAction(
            osc.LateralAction(
                osc.LaneOffsetAction(
                    continuous=False,
                    dynamics=osc.LaneOffsetActionDynamics(shape, most),
                    lane_offset_target=osc.LaneOffsetTarget(osc.AbsoluteTargetLaneOffset(offset)),
                )
            )
        )

    def _synchronize(self, actor: str, node: Subject) -> osc.PrivateAction:
        del actor
        there, master = (
            self._places.position(self._individuals.link(node, link), oriented=False)
            for link in ("has_position", "has_master_position")
        )
        other = self._cast.name(node, "has_entity_ref")
        return osc.PrivateAction(osc.SynchronizeAction(other, master, there))

    def _switch(self, actor: str, node: Subject) -> osc.PrivateAction:
        """Return the switching of a vehicle's lights."""
        del actor
        light = osc.VehicleLightType(self._individuals.text(node, "has_light_type"))
        mode = osc.LightMode(self._individuals.text(node, "has_light_mode"))
        switch = osc.LightStateAction(osc.LightType(osc.VehicleLight(light)), osc.LightState(mode))
        return osc.PrivateAction(osc.AppearanceAction(switch))

    def _keep_distance(self, actor: str, node: Subject) -> osc.PrivateAction:
        """Return the following of another entity, from now on, between the bodies."""
        del actor
        ind = self._individuals
        distance, time, faster, slower, fastest = (
            None if ind.optional_number(node, name) is None else self._quantities.get(node, name)
            for name in (
                "has_kept_distance",
                "has_kept_time",
                "has_max_acceleration",
                "has_max_deceleration",
                "has_max_speed",
            )
        )
        limits = None
        if any(value is not None for value in (faster, slower, fastest)):
            limits = osc.DynamicConstraints(faster, slower, fastest)
        if (distance is None) == (time is None):
            raise OntologyError(
                f"{ind.describe(node)} must have one of has_kept_distance and has_kept_time"
            )
        return osc.PrivateAction(
            osc.LongitudinalAction(
                osc.LongitudinalDistanceAction(
                    entity_ref=self._cast.name(node, "has_entity_ref"),
                    continuous=True,
                    freespace=True,
                    distance=distance,
                    time_gap=time,
                    displacement=osc.LongitudinalDisplacement.TRAILING_REFERENCED_ENTITY,
                    coordinate_system=osc.CoordinateSystem.LANE,
                    dynamic_constraints=limits,
                )
            )
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

    def _follow(self, actor: str, node: Subject) -> osc.PrivateAction:
        """Return the following of a trajectory: to the times that its vertices have, if any."""
        ind = self._individuals
        trajectory = ind.link(node, "has_trajectory")
        vertices = sorted(
            ind.links(trajectory, "has_vertex"), key=lambda link: ind.integer(link, "has_index")
        )
        times = [ind.optional_number(vertex, "has_time") for vertex in vertices]
        timed = all(time is not None for time in times)
        if not timed and any(time is not None for time in times):
            raise OntologyError(
                f"{ind.describe(trajectory)} must have a time at all of its vertices, or at none"
            )
        if len(vertices) < 2:
            raise OntologyError(
                f"{ind.describe(trajectory)} must have two vertices or more, got {len(vertices)}"
            )
        del actor
        points = [
            (self._places.position(ind.link(vertex, "has_position"), oriented=False), time)
            for vertex, time in zip(vertices, times, strict=True)
        ]
        line: osc.Polyline | osc.Nurbs
        order = ind.optional_integer(trajectory, "has_spline_order")
        if order is not None:
            if not 2 <= order <= len(points):
                raise OntologyError(
                    f"has_spline_order of {ind.describe(trajectory)} must be 2 to its number of "
                    f"vertices, {len(points)}, got {order}"
                )
            line = osc.Nurbs(
                order,
                tuple(osc.ControlPoint(place, time) for place, time in points),
                tuple(osc.Knot(value) for value in uniform_knots(order, len(points))),
            )
        else:
            line = osc.Polyline(tuple(osc.Vertex(place, time) for place, time in points))
        reference: osc.NoTime | osc.Timing = osc.NoTime()
        if timed:
            reference = osc.Timing(osc.ReferenceContext.ABSOLUTE, 1.0, 0.0)
        name = plain_text(ind, trajectory, "has_name")
        made = osc.Trajectory(name, closed=False, shape=osc.Shape(line))
        action = osc.FollowTrajectoryAction(
            osc.TimeReference(reference),
            osc.TrajectoryFollowingMode(osc.FollowingMode.POSITION),
            osc.TrajectoryRef(made),
        )
        return osc.PrivateAction(osc.RoutingAction(action))

    def _assign_route(self, actor: str, node: Subject) -> osc.PrivateAction:
        return self.route(f"{actor}_route", self._individuals.link(node, "has_route"))

    def route(self, name: str, node: Subject) -> osc.PrivateAction:
        """Return a route by its ends, with one intersection between them, crossed the shortest way.

        Where it changes lanes, a waypoint on either lane says where it may begin, and must end.
        """
        links = ("has_start", *ROUTE_CHANGE, "has_destination")
        waypoints = tuple(
            osc.Waypoint(osc.RouteStrategy.SHORTEST, self._places.position(place, oriented=True))
            for link in links
            if (place := self._individuals.optional_link(node, link)) is not None
        )
        made = osc.Route(name, closed=False, waypoints=waypoints)
        return osc.PrivateAction(osc.RoutingAction(osc.AssignRouteAction(made)))

    # -- of all else -------------------------------------------------------------------------------

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

    def _presence(self, node: Subject) -> osc.GlobalAction:
        ind = self._individuals
        action: osc.AddEntityAction | osc.DeleteEntityAction = osc.DeleteEntityAction()
        if ind.is_a(node, "AddEntityAction"):
            place = ind.link(node, "has_position")
            action = osc.AddEntityAction(self._places.position(place, oriented=True))
        name = self._cast.name(node, "has_entity_ref")
        return osc.GlobalAction(osc.EntityAction(name, action))
