"""OpenSCENARIO2OWL, its entities: bodies, drivers, and starts."""

from functools import partial

import pyoxigraph as ox

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.bodies import kind_of
from bridgegen.openx.openscenario.declarations import DRIVER, GHOST, IDEAL, TRACKER
from bridgegen.openx.openscenario.from_owl.entities import LIFTED, MAX_SPEED
from bridgegen.openx.openscenario.to_owl.actions import (
    add_action,
    add_route,
    add_trajectory,
    put_speed,
)
from bridgegen.openx.openscenario.to_owl.build import (
    ACTION,
    Lost,
    NotExpressibleError,
    StoryBuilder,
    numbered,
    state_or_quote,
)
from bridgegen.openx.openscenario.to_owl.differences import is_detail
from bridgegen.openx.openscenario.to_owl.lights import known_light
from bridgegen.openx.openscenario.to_owl.places import add_position
from bridgegen.scenario.language.story import GHOST_UNITS, TRACKER_UNITS
from bridgegen.scenario.named_models import MODELS
from bridgegen.scenario.participants import PARTICIPANTS

_AS_IN_EVENTS = (
    osc.LongitudinalDistanceAction
    | osc.LaneOffsetAction
    | osc.LaneChangeAction
    | osc.SynchronizeAction
)
_ROAD_WORKS = {
    participant.written.name: participant
    for participant in PARTICIPANTS.values()
    if not participant.takes_part
}
_FURNITURE = {osc.MiscObjectCategory.POLE: PARTICIPANTS["sign"]}


def add_participant(
    builder: StoryBuilder,
    scenario_object: osc.ScenarioObject,
    actions: tuple[osc.PrivateAction, ...],
) -> ox.NamedNode:
    """Add a participant with its body, its driver and its init actions.

    Args:
        builder: where to.
        scenario_object: the entity.
        actions: its own of the storyboard's Init.

    Raises:
        NotExpressibleError: it is of a kind without a class, or starts nowhere.
    """
    name = builder.text(scenario_object.name)
    node = _add_body(
        builder, scenario_object, name, _class_of(builder, scenario_object.entity_object)
    )
    if len(scenario_object.object_controllers) == 1:
        _add_controller(builder, node, name, scenario_object.object_controllers[0].controller)
    # An entity that an event adds has its place in that event, and none at the start.
    if name in builder.added and not any(
        isinstance(wrapped.action, osc.TeleportAction) for wrapped in actions
    ):
        standing = builder.node(f"{name}_init_speed", "SpeedAction")
        builder.put(standing, "has_target_speed", 0.0)
        builder.put(node, "has_init_action", standing)
        return node
    first = _teleport(scenario_object, actions)
    start = add_position(builder, f"{name}_start", first.position)
    teleport = builder.node(f"{name}_teleport", "TeleportAction")
    builder.put(teleport, "has_position", start)
    builder.starts[name] = start
    builder.put(node, "has_init_action", teleport)
    return node


def add_begun(
    builder: StoryBuilder,
    scenario_object: osc.ScenarioObject,
    actions: tuple[osc.PrivateAction, ...],
) -> None:
    """Add what a participant does from the start on; all of them have been stated.

    Args:
        builder: where to.
        scenario_object: the entity.
        actions: its own of the storyboard's Init.
    """
    name = builder.text(scenario_object.name)
    node = builder.cast[name]
    if name not in builder.starts:  # it comes later
        for wrapped in actions:
            action = wrapped.action
            if isinstance(action, osc.LongitudinalAction) and (
                isinstance(action.action, osc.SpeedAction)
                and isinstance(action.action.speed_action_target.target, osc.AbsoluteTargetSpeed)
                and action.action.speed_action_target.target.value == 0.0
            ):
                continue  # that it stands is stated anyhow
            text = f"an initial action of {name}, which comes later,"
            builder.problems.append(Lost(wrapped.line, text))
        return
    first = _teleport(scenario_object, actions)
    begun: set[type[object]] = {osc.TeleportAction}
    left = [wrapped for wrapped in actions if wrapped.action is not first]
    start = builder.starts[name], first.position
    for number, wrapped in zip(numbered(len(left)), left, strict=True):
        with builder.attempt():
            done = f"{name}_init_{number}"
            link, found = state_or_quote(
                builder,
                done,
                ACTION,
                wrapped,
                partial(_init, builder, name, done, wrapped, begun, start),
                lambda what: ("has_init_action", what),
            )
            builder.put(node, link, found)


def add_element(
    builder: StoryBuilder,
    scenario_object: osc.ScenarioObject,
    actions: tuple[osc.PrivateAction, ...],
) -> ox.NamedNode:
    """Add a cone or a sign of road works, at its place.

    Raises:
        NotExpressibleError: it is none, or stands nowhere.
    """
    name, body = builder.text(scenario_object.name), scenario_object.entity_object
    if not isinstance(body, osc.MiscObject):
        raise NotExpressibleError(body, f"{type(body).__name__} {name} at road works")
    category = builder.choice(osc.MiscObjectCategory, body.misc_object_category)
    named = _ROAD_WORKS.get(builder.text(body.name))
    kind = named or _FURNITURE.get(category, PARTICIPANTS["cone"])
    node = _add_body(builder, scenario_object, name, kind.owl_class)
    place = add_position(builder, f"{name}_place", _teleport(scenario_object, actions).position)
    builder.put(node, "has_position", place)
    for wrapped in actions:
        if not isinstance(wrapped.action, osc.TeleportAction):
            text = f"an initial {type(wrapped.action).__name__} of {name}"
            builder.problems.append(Lost(wrapped.line, text))
    return node


Body = osc.Vehicle | osc.Pedestrian | osc.MiscObject | osc.ExternalObjectReference


def _class_of(builder: StoryBuilder, body: Body) -> str:
    if isinstance(body, osc.ExternalObjectReference):
        raise NotExpressibleError(body, f"the ExternalObjectReference {body.name}")
    if isinstance(body, osc.MiscObject):
        return PARTICIPANTS["obstacle"].owl_class
    kind = kind_of(body, builder.text)
    if kind is None:
        assert isinstance(body, osc.Vehicle)  # every Pedestrian has one
        category = builder.choice(osc.VehicleCategory, body.vehicle_category)
        raise NotExpressibleError(body, f"a Vehicle of the category {category}")
    return kind.owl_class


def _add_body(
    builder: StoryBuilder, scenario_object: osc.ScenarioObject, name: str, cls: str
) -> ox.NamedNode:
    body, now = scenario_object.entity_object, builder.now
    if isinstance(body, osc.ExternalObjectReference):
        raise NotExpressibleError(body, f"the ExternalObjectReference {body.name}")
    box = body.bounding_box
    values = {
        "has_box_length": now(box.dimensions.length, box.dimensions),
        "has_box_width": now(box.dimensions.width, box.dimensions),
        "has_box_height": now(box.dimensions.height, box.dimensions),
        "has_center_ahead": now(box.center.x, box.center),
    }
    if body.mass is not None:
        values["has_mass"] = now(body.mass, body)
    if isinstance(body, osc.Vehicle):
        limits, axles = body.performance, body.axles
        if axles.front is None:
            raise NotExpressibleError(axles, f"the Vehicle {name} without a FrontAxle")
        values |= {
            "has_wheelbase": now(axles.front.position_x, axles.front)
            - now(axles.rear.position_x, axles.rear),
            "has_max_speed": now(limits.max_speed, limits),
            "has_max_acceleration": now(limits.max_acceleration, limits),
            "has_max_deceleration": now(limits.max_deceleration, limits),
        }
    elif isinstance(body, osc.Pedestrian) and body.properties is not None:
        fastest = body.properties.get(MAX_SPEED)
        if fastest is not None:
            values["has_max_speed"] = as_number(builder, fastest, body.properties)
    node = builder.node(name, cls)
    builder.put(node, "has_name", name)
    model = MODELS.get(builder.text(body.name))
    if model is not None and PARTICIPANTS[model.type].owl_class == cls:
        builder.put(node, "has_model", model.name)
    if isinstance(body, osc.Vehicle | osc.Pedestrian) and body.properties is not None:
        for key, name in LIFTED.items():
            if (said := body.properties.get(name)) is not None:
                builder.put(node, key, builder.text(said))
    for key, value in values.items():
        builder.check(key, value, body)
        builder.put(node, key, value)
    return node


def as_number(
    builder: StoryBuilder, text: str | osc.ParameterRef, element: osc.Property | osc.Properties
) -> float:
    """Return the finite number of a property.

    Raises:
        NotExpressibleError: it has none.
    """
    said = builder.text(text)
    try:
        return builder.now(float(said), element)
    except ValueError:
        raise NotExpressibleError(
            element, f"a Property that must be a number, '{said[:40]}',"
        ) from None


def _add_controller(
    builder: StoryBuilder, node: ox.NamedNode, name: str, item: osc.Controller
) -> None:
    """Add a controller that names its driver; what is missing then, the comparison finds."""
    driver = None if item.properties is None else item.properties.get(DRIVER)
    if driver is None:
        return
    controller = builder.node(f"{name}_controller", "Controller")
    builder.put(controller, "has_name", builder.text(item.name))
    builder.put(controller, "has_driver", builder.text(driver))
    ideal = None if item.properties is None else item.properties.get(IDEAL)
    if ideal is not None:
        builder.put(controller, "has_ideal_stages", builder.text(ideal))
    ghosts: dict[str, ox.NamedNode] = {}
    for said in item.properties.properties if item.properties else ():
        prefix, ghost, word = (*builder.text(said.name).split(".", 2), "", "")[:3]
        if prefix == TRACKER and ghost in TRACKER_UNITS and not word:
            as_number(builder, said.value, said)
            builder.number(controller, f"has_tracker_{ghost}", said.value, said)
        if prefix != GHOST or word not in ("type", "mirrors", *GHOST_UNITS):
            continue
        if ghost not in ghosts:
            ghosts[ghost] = builder.node(ghost, "Ghost")
            builder.put(ghosts[ghost], "has_name", ghost)
            builder.put(controller, "has_ghost", ghosts[ghost])
        if word in ("type", "mirrors"):
            builder.put(ghosts[ghost], f"has_ghost_{word}", builder.text(said.value))
        else:
            as_number(builder, said.value, said)
            builder.number(ghosts[ghost], f"has_ghost_{word}", said.value, said)
    builder.put(node, "has_controller", controller)


def _teleport(
    scenario_object: osc.ScenarioObject, actions: tuple[osc.PrivateAction, ...]
) -> osc.TeleportAction:
    for wrapped in actions:
        if isinstance(wrapped.action, osc.TeleportAction):
            return wrapped.action
    raise NotExpressibleError(
        scenario_object, f"the entity {scenario_object.name} without an initial TeleportAction"
    )


def _init(
    builder: StoryBuilder,
    name: str,
    done: str,
    wrapped: osc.PrivateAction,
    begun: set[type[object]],
    start: tuple[ox.NamedNode, osc.Position],
) -> tuple[str, ox.NamedNode]:
    """Return what an entity does at the start, and the property that links it."""
    action = wrapped.action
    if isinstance(action, osc.LongitudinalAction | osc.LateralAction | osc.RoutingAction):
        action = action.action  # type: ignore[assignment]
    kind = type(action)
    if isinstance(action, _AS_IN_EVENTS) or known_light(action, builder.text):
        return "has_init_action", add_action(builder, name, done, (name,), wrapped)
    if kind in begun:
        raise NotExpressibleError(wrapped, f"a second initial {kind.__name__} of {name}")
    begun.add(kind)
    if isinstance(action, osc.SpeedAction):
        speed = builder.node(f"{name}_init_speed", "SpeedAction")
        put_speed(builder, speed, action)
        return "has_init_action", speed
    if isinstance(action, osc.FollowTrajectoryAction):
        follow = builder.node(f"{name}_follow", "FollowTrajectoryAction")
        add_trajectory(builder, name, follow, action, start)
        return "has_init_action", follow
    if isinstance(action, osc.AssignRouteAction):
        return "has_route", add_route(builder, name, action.route, start)
    raise NotExpressibleError(wrapped, f"an initial {kind.__name__}", is_detail=is_detail(action))
