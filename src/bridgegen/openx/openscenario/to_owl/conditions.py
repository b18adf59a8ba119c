"""OpenSCENARIO2OWL, its conditions: when an event happens."""

import pyoxigraph as ox

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.from_owl.events import USUAL_RULES
from bridgegen.openx.openscenario.to_owl.actions import put_place, signal_state
from bridgegen.openx.openscenario.to_owl.build import (
    CONDITION,
    NotExpressibleError,
    StoryBuilder,
    numbered,
    state_or_quote,
)

Relative = osc.RelativeDistanceCondition | osc.TimeHeadwayCondition | osc.TimeToCollisionCondition


_SAYABLE = (
    Relative
    | osc.CollisionCondition
    | osc.ReachPositionCondition
    | osc.SpeedCondition
    | osc.StandStillCondition
    | osc.TraveledDistanceCondition
)


def add_trigger(
    builder: StoryBuilder, event: str, actors: tuple[str, ...], trigger: osc.Trigger | None
) -> ox.NamedNode:
    """Add the trigger of an event; without one it happens at the start.

    Raises:
        NotExpressibleError: a condition that the ontology has no words for, or no condition at all.
    """
    node = builder.node(f"{event}_trigger", "Trigger")
    if trigger is None:
        condition = builder.node(f"{event}_condition_1", "SimulationTimeCondition")
        builder.put(condition, "has_value", 0.0)
        builder.put(node, "has_condition", condition)
        return node
    groups = trigger.condition_groups
    if not groups:
        raise NotExpressibleError(trigger, f"the event {event}, which never happens,")
    for number, group in zip(numbered(len(groups)), groups, strict=True):
        name = f"{event}_condition_{number}"
        builder.put(node, "has_condition", _add_group(builder, name, actors, group))
    return node


def _add_group(
    builder: StoryBuilder, name: str, actors: tuple[str, ...], group: osc.ConditionGroup
) -> ox.NamedNode:
    if len(group.conditions) == 1:
        return _add_condition(builder, name, actors, group.conditions[0])
    node = builder.node(name, "ConditionGroup")
    numbers = numbered(len(group.conditions))
    for number, condition in zip(numbers, group.conditions, strict=True):
        part = _add_condition(builder, f"{name}_{number}", actors, condition)
        builder.put(node, "has_condition", part)
    return node


def _add_condition(
    builder: StoryBuilder, name: str, actors: tuple[str, ...], wrapped: osc.Condition
) -> ox.NamedNode:
    node, is_quoted = state_or_quote(
        builder,
        name,
        CONDITION,
        wrapped.condition,
        lambda: (_stated(builder, name, actors, wrapped), False),
        lambda node: (node, True),
    )
    edge = builder.choice(osc.ConditionEdge, wrapped.condition_edge)
    if edge is not osc.ConditionEdge.NONE:
        builder.put(node, "has_condition_edge", edge.value)
    delayed = isinstance(wrapped.delay, osc.ParameterRef | osc.Expr) or wrapped.delay != 0.0
    by_state = isinstance(wrapped.condition, osc.ByValueCondition) and isinstance(
        wrapped.condition.condition, osc.StoryboardElementStateCondition
    )
    if delayed and (is_quoted or not by_state):  # of an event's state it is the condition's value
        builder.number(node, "has_delay", wrapped.delay, wrapped)
    return node


def _stated(
    builder: StoryBuilder, name: str, actors: tuple[str, ...], wrapped: osc.Condition
) -> ox.NamedNode:
    if isinstance(wrapped.condition, osc.ByEntityCondition):
        return _by_entity(builder, name, actors, wrapped.condition)
    condition = wrapped.condition.condition
    node = builder.node(name, type(condition).__name__)
    if isinstance(condition, osc.SimulationTimeCondition):
        builder.number(node, "has_value", condition.value, condition)
        _put_rule(builder, node, condition)
    elif isinstance(condition, osc.TrafficSignalCondition):
        builder.put(node, "has_signal", builder.light(condition.name, condition))
        builder.put(node, "has_signal_state", signal_state(builder, condition.state, condition))
    elif not isinstance(condition, osc.StoryboardElementStateCondition):
        raise NotExpressibleError(condition, type(condition).__name__)
    else:
        kind = builder.text(condition.storyboard_element_type)
        event = builder.text(condition.storyboard_element_ref)
        event = builder.element_names.get((kind, event), event)
        state = builder.text(condition.state)
        known = ("completeState", "startTransition")
        if kind != "event" or state not in known or event not in builder.events:
            raise NotExpressibleError(
                condition, f"StoryboardElementStateCondition on {state} of the {kind} {event}"
            )
        builder.referred.add(event)
        builder.put(node, "has_event_ref", builder.events[event])
        if state == "startTransition":
            builder.put(node, "has_event_state", "began")
        builder.number(node, "has_value", wrapped.delay, wrapped)
    return node


def _by_entity(
    builder: StoryBuilder, name: str, actors: tuple[str, ...], wrapped: osc.ByEntityCondition
) -> ox.NamedNode:
    refs = wrapped.triggering_entities.entity_refs
    if len(refs) != 1:
        raise NotExpressibleError(
            wrapped.triggering_entities, f"a condition on {len(refs)} TriggeringEntities"
        )
    condition = wrapped.entity_condition.condition
    if not isinstance(condition, _SAYABLE):
        raise NotExpressibleError(condition, type(condition).__name__)
    node = builder.node(name, type(condition).__name__)
    subject = builder.entity(refs[0].entity_ref, refs[0])
    if actors != (builder.text(refs[0].entity_ref),):
        builder.put(node, "has_subject", subject)
    if isinstance(condition, osc.CollisionCondition):
        if not isinstance(condition.target, osc.EntityRef):
            raise NotExpressibleError(condition.target, "ByType")
        builder.put(
            node, "has_entity_ref", builder.entity(condition.target.entity_ref, condition.target)
        )
    elif isinstance(condition, osc.StandStillCondition):
        builder.number(node, "has_value", condition.duration, condition)
    elif isinstance(condition, osc.ReachPositionCondition):
        builder.number(node, "has_value", condition.tolerance, condition)
        put_place(builder, node, "has_position", f"{name}_place", condition.position)
    else:
        builder.number(node, "has_value", condition.value, condition)
        if isinstance(condition, Relative):
            if _is_gap(builder, condition):
                builder.put(node, "has_distance_measure", "gap")
            builder.put(
                node, "has_entity_ref", builder.entity(_other(builder, condition), condition)
            )
        if not isinstance(condition, osc.TraveledDistanceCondition):
            _put_rule(builder, node, condition)
    return node


def _other(builder: StoryBuilder, relative: Relative) -> str | osc.ParameterRef:
    """Return the entity that a condition measures to, in the one way that the ontology defines.

    Raises:
        NotExpressibleError: another distance, other axes, between boxes, or to a position.
    """
    if _is_gap(builder, relative):
        assert isinstance(relative, osc.RelativeDistanceCondition)
        return relative.entity_ref
    what = type(relative).__name__
    distance, axes = relative.relative_distance_type, relative.coordinate_system
    if distance is not None and builder.text(distance) not in (
        osc.RelativeDistanceType.EUCLIDIAN_DISTANCE,
        osc.RelativeDistanceType.CARTESIAN_DISTANCE,
    ):
        raise NotExpressibleError(relative, f'relativeDistanceType="{distance}" of {what}')
    if axes is not None and builder.text(axes) != osc.CoordinateSystem.ENTITY:
        raise NotExpressibleError(relative, f'coordinateSystem="{axes}" of {what}')
    if relative.freespace is not False:
        raise NotExpressibleError(
            relative, f'freespace="{str(relative.freespace).lower()}" of {what}'
        )
    if not isinstance(relative, osc.TimeToCollisionCondition):
        return relative.entity_ref
    target = relative.target.target
    if not isinstance(target, osc.EntityRef):
        raise NotExpressibleError(target, "TimeToCollisionCondition with a Position")
    return target.entity_ref


def _is_gap(builder: StoryBuilder, relative: Relative) -> bool:
    """Return whether a distance is measured along the lane and between the bodies."""
    if not isinstance(relative, osc.RelativeDistanceCondition) or relative.freespace is not True:
        return False
    kind, axes = relative.relative_distance_type, relative.coordinate_system
    return (
        kind is not None
        and builder.text(kind) == osc.RelativeDistanceType.LONGITUDINAL
        and axes is not None
        and builder.text(axes) == osc.CoordinateSystem.LANE
    )


def _put_rule(builder: StoryBuilder, node: ox.NamedNode, element: Element) -> None:
    rule = builder.choice(osc.Rule, element.rule)  # type: ignore[attr-defined]
    # The export writes the usual rule where none is stated: a file of ours comes back the same.
    if rule is not USUAL_RULES[type(element).__name__]:
        builder.put(node, "has_rule", rule.value)
