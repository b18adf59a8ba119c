"""OpenSCENARIO2OWL, its actions: what participants, the weather and the lights are made to do."""

from collections.abc import Sequence

import pyoxigraph as ox

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.from_owl.signals import LAMPS
from bridgegen.openx.openscenario.movement import is_uniform
from bridgegen.openx.openscenario.to_owl.build import (
    ACTION,
    NotExpressibleError,
    StoryBuilder,
    node_of,
    numbered,
    plain_name,
)
from bridgegen.openx.openscenario.to_owl.lights import known_light
from bridgegen.openx.openscenario.to_owl.places import add_position, same_place
from bridgegen.openx.openscenario.to_owl.weather import add_weather

Start = tuple[ox.NamedNode, osc.Position]

_DIMENSIONS = {
    osc.DynamicsDimension.RATE: "has_rate",
    osc.DynamicsDimension.TIME: "has_transition_time",
    osc.DynamicsDimension.DISTANCE: "has_transition_distance",
}
_STATES = {lamps: state for state, lamps in LAMPS.items()}


def add_action(
    builder: StoryBuilder,
    event: str,
    name: str,
    actors: tuple[str, ...],
    wrapped: osc.PrivateAction | osc.GlobalAction | osc.UserDefinedAction,
) -> ox.NamedNode:
    """Add an action of an event.

    Args:
        builder: where to.
        event: the event's name.
        name: of the individual.
        actors: the event's actors.
        wrapped: the action.

    Raises:
        NotExpressibleError: an action that the ontology has no class for, or no property, and that
            cannot be quoted.
    """
    return node_of(
        builder, name, ACTION, wrapped, lambda: _action(builder, event, name, actors, wrapped)
    )


def _action(
    builder: StoryBuilder,
    event: str,
    name: str,
    actors: tuple[str, ...],
    wrapped: osc.PrivateAction | osc.GlobalAction | osc.UserDefinedAction,
) -> ox.NamedNode:
    if isinstance(wrapped, osc.GlobalAction):
        return _global(builder, event, name, wrapped)
    if isinstance(wrapped, osc.UserDefinedAction):
        raise NotExpressibleError(wrapped, "UserDefinedAction")
    action = wrapped.action
    inner = getattr(action, "action", action)
    if not actors:
        raise NotExpressibleError(wrapped, "a PrivateAction without an actor")
    if isinstance(action, osc.TeleportAction):
        node = builder.node(name, "TeleportAction")
        put_place(builder, node, "has_position", f"{name}_place", action.position)
    elif isinstance(action, osc.SynchronizeAction):
        node = builder.node(name, "SynchronizeAction")
        master = builder.entity(action.master_entity_ref, action)
        builder.put(node, "has_entity_ref", master)
        put_place(builder, node, "has_position", f"{name}_place", action.target_position)
        there = action.target_position_master
        put_place(builder, node, "has_master_position", f"{name}_master_place", there)
    elif isinstance(inner, osc.LightStateAction) and (light := known_light(inner, builder.text)):
        node = builder.node(name, "LightStateAction")
        mode = builder.choice(osc.LightMode, inner.light_state.mode)
        builder.put(node, "has_light_type", light)
        builder.put(node, "has_light_mode", mode.value)
    elif isinstance(inner, osc.LongitudinalDistanceAction):
        node = _keep_distance(builder, name, inner)
    elif isinstance(inner, osc.SpeedAction):
        node = builder.node(name, "SpeedAction")
        put_speed(builder, node, inner)
    elif isinstance(inner, osc.SpeedProfileAction):
        node = _change_with_jerk(builder, name, inner)
    elif isinstance(inner, osc.LaneChangeAction | osc.LaneOffsetAction):
        node = _lateral(builder, name, actors, inner)
    elif isinstance(inner, osc.FollowTrajectoryAction):
        node = builder.node(name, "FollowTrajectoryAction")
        add_trajectory(builder, name, node, inner, None)
    elif isinstance(inner, osc.AssignRouteAction):
        node = builder.node(name, "AssignRouteAction")
        builder.put(node, "has_route", add_route(builder, name, inner.route, None))
    else:
        raise NotExpressibleError(inner, type(inner).__name__)
    return node


def put_place(
    builder: StoryBuilder, node: ox.NamedNode, link: str, name: str, position: osc.Position
) -> None:
    """Link a node to a position of its own."""
    builder.put(node, link, add_position(builder, name, position))


def put_speed(builder: StoryBuilder, node: ox.NamedNode, action: osc.SpeedAction) -> None:
    """State the speed that an action leads to, and how fast.

    Raises:
        NotExpressibleError: the speed is relative to another's, or an expression.
    """
    target = action.speed_action_target.target
    if not isinstance(target, osc.AbsoluteTargetSpeed):
        raise NotExpressibleError(target, "RelativeTargetSpeed")
    builder.number(node, "has_target_speed", target.value, target)
    _put_change(builder, node, action.dynamics)


def _change_with_jerk(
    builder: StoryBuilder, name: str, action: osc.SpeedProfileAction
) -> ox.NamedNode:
    """Add a change to one speed within limits of acceleration and jerk, the same both ways.

    Raises:
        NotExpressibleError: another speed profile.
    """
    limits = action.dynamic_constraints or osc.DynamicConstraints()
    rate, jerk = limits.max_acceleration, limits.max_acceleration_rate
    (entry, *more) = action.entries
    if (
        more
        or entry.time is not None
        or action.entity_ref is not None
        or rate is None
        or jerk is None
        or limits.max_speed is not None
        or (rate, jerk) != (limits.max_deceleration, limits.max_deceleration_rate)
        or builder.choice(osc.FollowingMode, action.following_mode) is not osc.FollowingMode.FOLLOW
    ):
        raise NotExpressibleError(action, "SpeedProfileAction")
    node = builder.node(name, "SpeedAction")
    builder.number(node, "has_target_speed", entry.speed, entry)
    builder.number(node, "has_rate", rate, limits)
    builder.number(node, "has_max_jerk", jerk, limits)
    return node


def _put_change(builder: StoryBuilder, node: ox.NamedNode, how: osc.TransitionDynamics) -> None:
    shape = builder.choice(osc.DynamicsShape, how.dynamics_shape)
    if shape is osc.DynamicsShape.STEP:
        return
    dimension = builder.choice(osc.DynamicsDimension, how.dynamics_dimension)
    if dimension is not osc.DynamicsDimension.RATE and builder.now(how.value, how) == 0.0:
        return  # in no time, or on the spot: a step
    value = how.value
    if dimension is osc.DynamicsDimension.RATE and builder.in_substance:
        rate = builder.now(value, how)
        value = -rate if rate < 0.0 else value  # its size, whichever way
    builder.number(node, _DIMENSIONS[dimension], value, how)
    if shape is not osc.DynamicsShape.LINEAR:
        builder.put(node, "has_dynamics_shape", shape.value)


def _keep_distance(
    builder: StoryBuilder, name: str, action: osc.LongitudinalDistanceAction
) -> ox.NamedNode:
    """Add the following of another entity, in the one way that the ontology defines.

    Raises:
        NotExpressibleError: not from now on, not between the bodies, within limits, or not behind.
    """
    what = "LongitudinalDistanceAction"
    if action.continuous is not True or action.freespace is not True:
        raise NotExpressibleError(action, f"{what} that is not continuous and between the bodies")
    limits = action.dynamic_constraints or osc.DynamicConstraints()
    unsaid = (limits.max_acceleration_rate, limits.max_deceleration_rate)
    if any(value is not None for value in unsaid):
        raise NotExpressibleError(limits, f"DynamicConstraints of {what} besides accelerations")
    kept = action.time_gap if action.distance is None else action.distance
    if kept is not None and builder.now(kept, action) < 0.0:
        raise NotExpressibleError(action, f"{what} with a number below 0")
    side, axes = action.displacement, action.coordinate_system
    behind = osc.LongitudinalDisplacement.TRAILING_REFERENCED_ENTITY
    if side is not None and builder.text(side) != behind:
        raise NotExpressibleError(action, f'displacement="{side}" of {what}')
    if axes is None or builder.text(axes) != osc.CoordinateSystem.LANE:
        raise NotExpressibleError(action, f'coordinateSystem="{axes}" of {what}')
    node = builder.node(name, what)
    builder.put(node, "has_entity_ref", builder.entity(action.entity_ref, action))
    if action.distance is not None:
        builder.number(node, "has_kept_distance", action.distance, action)
    if action.time_gap is not None:
        builder.number(node, "has_kept_time", action.time_gap, action)
    if limits.max_acceleration is not None:
        builder.number(node, "has_max_acceleration", limits.max_acceleration, limits)
    if limits.max_deceleration is not None:
        builder.number(node, "has_max_deceleration", limits.max_deceleration, limits)
    if limits.max_speed is not None:
        builder.number(node, "has_max_speed", limits.max_speed, limits)
    return node


def _lateral(
    builder: StoryBuilder,
    name: str,
    actors: tuple[str, ...],
    action: osc.LaneChangeAction | osc.LaneOffsetAction,
) -> ox.NamedNode:
    if isinstance(action, osc.LaneOffsetAction):
        aside = action.lane_offset_target.target
        if not isinstance(aside, osc.AbsoluteTargetLaneOffset):
            raise NotExpressibleError(aside, "RelativeTargetLaneOffset")
        node = builder.node(name, "LaneOffsetAction")
        builder.number(node, "has_target_offset", aside.value, aside)
        how = action.dynamics
        if how.max_lateral_acc is not None:
            builder.number(node, "has_max_lateral_acceleration", how.max_lateral_acc, how)
        shape = builder.choice(osc.DynamicsShape, how.dynamics_shape)
        if shape is not osc.DynamicsShape.LINEAR:
            builder.put(node, "has_dynamics_shape", shape.value)
        return node
    target = action.lane_change_target.target
    if not isinstance(target, osc.RelativeTargetLane):
        raise NotExpressibleError(target, "AbsoluteTargetLane")
    if builder.text(target.entity_ref) != actors[0]:
        raise NotExpressibleError(
            target, f"a RelativeTargetLane of {target.entity_ref}, not the actor,"
        )
    node = builder.node(name, "LaneChangeAction")
    builder.put(node, "has_lane_count", round(builder.now(target.value, target)))
    if action.target_lane_offset is not None:
        builder.number(node, "has_target_offset", action.target_lane_offset, action)
    _put_change(builder, node, action.dynamics)
    return node


# -- ways ------------------------------------------------------------------------------------------


def add_trajectory(
    builder: StoryBuilder,
    name: str,
    node: ox.NamedNode,
    action: osc.FollowTrajectoryAction,
    start: Start | None,
) -> None:
    """Add the trajectory that an action follows.

    Args:
        builder: where to.
        name: that the individuals' begin with.
        node: the action's.
        action: what is followed.
        start: of the participant, which the first vertex may be.

    Raises:
        NotExpressibleError: times that count are missing, or a vertex has no place.
    """
    item = action.trajectory_ref.trajectory
    trajectory = builder.node(f"{name}_path", "Trajectory")
    builder.put(node, "has_trajectory", trajectory)
    called = builder.text(item.name)
    builder.put(trajectory, "has_name", plain_name(called) if builder.in_substance else called)
    timed = isinstance(action.time_reference.reference, osc.Timing)
    vertices = _vertices(builder, trajectory, item.shape.shape)
    for k, (number, vertex) in enumerate(zip(numbered(len(vertices)), vertices, strict=True)):
        point = builder.node(f"{name}_vertex_{number}", "Vertex")
        builder.put(trajectory, "has_vertex", point)
        builder.put(point, "has_index", k + 1)
        if timed:
            if vertex.time is None:
                raise NotExpressibleError(vertex, "a Vertex without a time among Timing's")
            builder.put(point, "has_time", builder.now(vertex.time, vertex))
        if k == 0 and start is not None and same_place(vertex.position, start[1]):
            builder.put(point, "has_position", start[0])
        else:
            place = add_position(builder, f"{name}_point_{number}", vertex.position)
            builder.put(point, "has_position", place)


def _vertices(
    builder: StoryBuilder,
    trajectory: ox.NamedNode,
    line: osc.Polyline | osc.Clothoid | osc.ClothoidSpline | osc.Nurbs,
) -> Sequence[osc.Vertex | osc.ControlPoint]:
    """Return the points of a line; of a spline its control points, and its order is put."""
    if isinstance(line, osc.Polyline):
        return line.vertices
    if not isinstance(line, osc.Nurbs):
        raise NotExpressibleError(line, type(line).__name__)
    points, order = line.control_points, round(builder.now(line.order, line))
    weights = [builder.now(point.weight, point) for point in points if point.weight is not None]
    knots = [builder.now(knot.value, knot) for knot in line.knots]
    if any(weight != weights[0] for weight in weights) or 0 < len(weights) < len(points):
        raise NotExpressibleError(line, "a Nurbs whose weights differ")
    if len(knots) != len(points) + order or order > len(points) or not is_uniform(knots, order):
        raise NotExpressibleError(line, "a Nurbs whose knots are not uniform between its ends")
    builder.put(trajectory, "has_spline_order", order)
    return points


def add_route(
    builder: StoryBuilder, name: str, route: osc.Route, start: Start | None
) -> ox.NamedNode:
    """Add a route by its ends.

    Args:
        builder: where to.
        name: that the individuals' begin with.
        route: of two waypoints.
        start: of the participant, which the first waypoint may be.

    Raises:
        NotExpressibleError: it has more waypoints, or one of them no place.
    """
    if len(route.waypoints) != 2:
        raise NotExpressibleError(route, f"a Route of {len(route.waypoints)} waypoints")
    first, last = (waypoint.position for waypoint in route.waypoints)
    node = builder.node(f"{name}_route", "Route")
    if start is not None and same_place(first, start[1]):
        builder.put(node, "has_start", start[0])
    else:
        put_place(builder, node, "has_start", f"{name}_route_start", first)
    put_place(builder, node, "has_destination", f"{name}_destination", last)
    return node


# -- of all else -----------------------------------------------------------------------------------


def _global(
    builder: StoryBuilder, event: str, name: str, wrapped: osc.GlobalAction
) -> ox.NamedNode:
    action = wrapped.action
    if isinstance(action, osc.EnvironmentAction):
        node = builder.node(name, "EnvironmentAction")
        weather = add_weather(builder, action.environment, event)
        if weather is None:
            raise NotExpressibleError(action, "an EnvironmentAction that sets no weather")
        builder.put(node, "has_weather", weather)
        return node
    if isinstance(action, osc.EntityAction):
        entity = builder.entity(action.entity_ref, action)
        if isinstance(action.action, osc.DeleteEntityAction):
            node = builder.node(name, "DeleteEntityAction")
        else:
            node = builder.node(name, "AddEntityAction")
            place = action.action.position
            put_place(builder, node, "has_position", f"{name}_place", place)
        builder.put(node, "has_entity_ref", entity)
        return node
    if not isinstance(action, osc.InfrastructureAction):
        raise NotExpressibleError(action, type(action).__name__)
    set_ = action.traffic_signal_action.action
    if not isinstance(set_, osc.TrafficSignalStateAction):
        raise NotExpressibleError(set_, type(set_).__name__)
    node = builder.node(name, "TrafficSignalStateAction")
    builder.put(node, "has_signal", builder.light(set_.name, set_))
    builder.put(node, "has_signal_state", signal_state(builder, set_.state, set_))
    return node


def signal_state(builder: StoryBuilder, state: str | osc.ParameterRef, element: Element) -> str:
    """Return the state that a light's lamps show.

    Raises:
        NotExpressibleError: none that the ontology knows.
    """
    found = _STATES.get(builder.text(state))
    if found is None:
        known = ", ".join(_STATES)
        what = type(element).__name__
        raise NotExpressibleError(element, f'state="{state}" of {what} (other than {known})')
    return found
