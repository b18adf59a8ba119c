"""OpenSCENARIO2OWL, its conditions: when an event happens."""

import pyoxigraph as ox

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.from_owl.events import USUAL_RULES
from bridgegen.openx.openscenario.to_owl.actions import put_place, signal_state
from bridgegen.openx.openscenario.to_owl.build import (
    CONDITION,
    StoryBuilder,
    UnsayableError,
    numbered,
    said_or_quoted,
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
        UnsayableError: a condition that the ontology has no words for, or no condition at all.
    """
    node = builder.node(f"{event}_trigger", "Trigger")
    if trigger is None:
        condition = builder.node(f"{event}_condition_1", "SimulationTimeCondition")
        builder.put(condition, "has_value", 0.0)
        builder.put(node, "has_condition", condition)
        return node
    groups = trigger.condition_groups
    if not groups:
        raise UnsayableError(trigger, f"the event {event}, which never happens,")
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
    node, is_quoted = said_or_quoted(
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
    one = wrapped.condition.condition
    node = builder.node(name, type(one).__name__)
    if isinstance(one, osc.SimulationTimeCondition):
        builder.number(node, "has_value", one.value, one)
        _put_rule(builder, node, one)
    elif isinstance(one, osc.TrafficSignalCondition):
        builder.put(node, "has_signal", builder.light(one.name, one))
        builder.put(node, "has_signal_state", signal_state(builder, one.state, one))
    elif not isinstance(one, osc.StoryboardElementStateCondition):
        raise UnsayableError(one, type(one).__name__)
    else:
        kind = builder.text(one.storyboard_element_type)
        event = builder.text(one.storyboard_element_ref)
        event = builder.element_names.get((kind, event), event)
        state = builder.text(one.state)
        known = ("completeState", "startTransition")
        if kind != "event" or state not in known or event not in builder.events:
            raise UnsayableError(
                one, f"StoryboardElementStateCondition on {state} of the {kind} {event}"
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
        raise UnsayableError(
            wrapped.triggering_entities, f"a condition on {len(refs)} TriggeringEntities"
        )
    one = wrapped.entity_condition.condition
    if not isinstance(one, _SAYABLE):
        raise UnsayableError(one, type(one).__name__)
    node = builder.node(name, type(one).__name__)
    subject = builder.entity(refs[0].entity_ref, refs[0])
    if actors != (builder.text(refs[0].entity_ref),):
        builder.put(node, "has_subject", subject)
    if isinstance(one, osc.CollisionCondition):
        if not isinstance(one.target, osc.EntityRef):
            raise UnsayableError(one.target, "ByType")
        builder.put(node, "has_entity_ref", builder.entity(one.target.entity_ref, one.target))
    elif isinstance(one, osc.StandStillCondition):
        builder.number(node, "has_value", one.duration, one)
    elif isinstance(one, osc.ReachPositionCondition):
        builder.number(node, "has_value", one.tolerance, one)
        put_place(builder, node, "has_position", f"{name}_place", one.position)
    else:
        builder.number(node, "has_value", one.value, one)
        if isinstance(one, Relative):
            if _is_gap(builder, one):
                builder.put(node, "has_distance_measure", "gap")
            builder.put(node, "has_entity_ref", builder.entity(_other(builder, one), one))
        if not isinstance(one, osc.TraveledDistanceCondition):
            _put_rule(builder, node, one)
    return node


def _other(builder: StoryBuilder, one: Relative) -> str | osc.ParameterRef:
    """Return the entity that a condition measures to, in the one way that the ontology defines.

    Raises:
        UnsayableError: another distance, other axes, between boxes, or to a position.
    """
    if _is_gap(builder, one):
        assert isinstance(one, osc.RelativeDistanceCondition)
        return one.entity_ref
    what = type(one).__name__
    distance, axes = one.relative_distance_type, one.coordinate_system
    if distance is not None and builder.text(distance) not in (
        osc.RelativeDistanceType.EUCLIDIAN_DISTANCE,
        osc.RelativeDistanceType.CARTESIAN_DISTANCE,
    ):
        raise UnsayableError(one, f'relativeDistanceType="{distance}" of {what}')
    if axes is not None and builder.text(axes) != osc.CoordinateSystem.ENTITY:
        raise UnsayableError(one, f'coordinateSystem="{axes}" of {what}')
    if one.freespace is not False:
        raise UnsayableError(one, f'freespace="{str(one.freespace).lower()}" of {what}')
    if not isinstance(one, osc.TimeToCollisionCondition):
        return one.entity_ref
    target = one.target.target
    if not isinstance(target, osc.EntityRef):
        raise UnsayableError(target, "TimeToCollisionCondition with a Position")
    return target.entity_ref


def _is_gap(builder: StoryBuilder, one: Relative) -> bool:
    """Return whether a distance is measured along the lane and between the bodies."""
    if not isinstance(one, osc.RelativeDistanceCondition) or one.freespace is not True:
        return False
    kind, axes = one.relative_distance_type, one.coordinate_system
    return (
        kind is not None
        and builder.text(kind) == osc.RelativeDistanceType.LONGITUDINAL
        and axes is not None
        and builder.text(axes) == osc.CoordinateSystem.LANE
    )


def _put_rule(builder: StoryBuilder, node: ox.NamedNode, one: Element) -> None:
    rule = builder.choice(osc.Rule, one.rule)  # type: ignore[attr-defined]
    if rule is not USUAL_RULES[type(one).__name__]:
        builder.put(node, "has_rule", rule.value)
