"""Triggers as tables: which groups a trigger has, which conditions a group."""

from collections.abc import Sequence

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.simulation.embedded.program import LanePoint
from bridgegen.simulation.embedded.tables import Tables

_RULES = {
    osc.Rule.GREATER_THAN: 0, osc.Rule.LESS_THAN: 1, osc.Rule.EQUAL_TO: 2,
    osc.Rule.GREATER_OR_EQUAL: 3, osc.Rule.LESS_OR_EQUAL: 4, osc.Rule.NOT_EQUAL_TO: 5,
}  # fmt: skip
_EDGES = {
    osc.ConditionEdge.NONE: 0, osc.ConditionEdge.RISING: 1,
    osc.ConditionEdge.FALLING: 2, osc.ConditionEdge.RISING_OR_FALLING: 3,
}  # fmt: skip
_SIMULATION_TIME, _RELATIVE_DISTANCE, _REACH_POSITION, _TIME_TO_COLLISION, _TIME_HEADWAY = range(5)
_SPEED, _TRAVELED_DISTANCE, _STAND_STILL, _EVENT_ENDED = range(5, 9)
_PAIRS = (
    osc.RelativeDistanceCondition,
    osc.TimeHeadwayCondition,
    osc.TimeToCollisionCondition,
)
_ENDED = (osc.StoryboardElementState.COMPLETE_STATE, osc.StoryboardElementState.END_TRANSITION)


class Triggers:
    """The triggers of a scenario, numbered in the order in which they are added.

    Attributes:
        triggers: first and past-the-last group.
        groups: first and past-the-last condition.
        conditions: kind, entity, other entity, rule, slot, edge, delay in steps.
        points: per condition the position to be reached, or None.
        stop_time: latest simulation time [s] that the first trigger, the scenario's end, names.
    """

    def __init__(self, tables: Tables, time_step: float, event_names: Sequence[str] = ()) -> None:
        self._event_names = list(event_names)
        self.triggers: list[tuple[int, int]] = []
        self.groups: list[tuple[int, int]] = []
        self.conditions: list[tuple[int, ...]] = []
        self.points: list[LanePoint | None] = []
        self.stop_time = 0.0
        self._tables = tables
        self._time_step = time_step

    def add(self, trigger: osc.Trigger | None, *, always: bool = False) -> int:
        """Append a trigger and return its number; a missing one fires at once if ``always``."""
        first = len(self.groups)
        # Conditions are numbered before the next group's, so that each group is a range.
        for group in trigger.condition_groups if trigger else ():
            start = len(self.conditions)
            for condition in group.conditions:
                self._condition(condition)
            self.groups.append((start, len(self.conditions)))
        if trigger is None and always:
            start = len(self.conditions)
            self._append(_SIMULATION_TIME, 0, 0, _RULES[osc.Rule.GREATER_OR_EQUAL], 0.0, 0, 0)
            self.groups.append((start, start + 1))
        self.triggers.append((first, len(self.groups)))
        return len(self.triggers) - 1

    def _append(
        self, kind: int, entity: int, other: int, rule: int, value: Value, edge: int, delay: int,
        point: LanePoint | None = None,
    ) -> None:  # fmt: skip
        self.conditions.append((kind, entity, other, rule, self._tables.slot(value), edge, delay))
        self.points.append(point)

    def _condition(self, condition: osc.Condition) -> None:
        edge = _EDGES.get(condition.condition_edge, -1)  # type: ignore[arg-type]
        if edge < 0:
            self._tables.unsupported(condition, f'conditionEdge="{condition.condition_edge}"')
        delay = round(self._tables.literal(condition, "delay", condition.delay) / self._time_step)
        kind = condition.condition
        if isinstance(kind, osc.ByValueCondition):
            clock = kind.condition
            if isinstance(clock, osc.StoryboardElementStateCondition):
                self._element_state(clock, edge, delay)
                return
            if not isinstance(clock, osc.SimulationTimeCondition):
                self._tables.unsupported(clock, type(clock).__name__)
                return
            self._append(
                _SIMULATION_TIME, 0, 0, self._rule(clock, clock.rule), clock.value, edge, delay
            )
            if not self.triggers:  # the storyboard's own stop trigger is the first
                self.stop_time = max(
                    self.stop_time,
                    self._tables.literal(clock, "value", clock.value) + delay * self._time_step,
                )
            return
        entities = kind.triggering_entities.entity_refs
        if len(entities) != 1:
            self._tables.unsupported(
                kind.triggering_entities, "TriggeringEntities other than one entity"
            )
        entity = self._tables.entity(entities[0].entity_ref)
        inner = kind.entity_condition.condition
        if isinstance(inner, osc.ReachPositionCondition):
            point = self._tables.lane_point(inner.position)
            if point is not None and isinstance(point.s, osc.ParameterRef | Expr):
                self._tables.unsupported(inner, f's="{point.s}" of a position to be reached')
            self._append(_REACH_POSITION, entity, 0, 0, inner.tolerance, edge, delay, point)
            return
        if isinstance(inner, osc.SpeedCondition):
            if inner.direction is not None:
                self._tables.unsupported(inner, f'direction="{inner.direction}"')
            rule = self._rule(inner, inner.rule)
            self._append(_SPEED, entity, 0, rule, inner.value, edge, delay)
        elif isinstance(inner, osc.TraveledDistanceCondition):
            self._append(_TRAVELED_DISTANCE, entity, 0, 0, inner.value, edge, delay)
        elif isinstance(inner, osc.StandStillCondition):
            self._append(_STAND_STILL, entity, 0, 0, inner.duration, edge, delay)
        elif isinstance(inner, osc.CollisionCondition):
            self._tables.unsupported(inner, "CollisionCondition")
        elif isinstance(inner, _PAIRS):
            self._pair(inner, entity, edge, delay)
        else:
            self._tables.unsupported(inner, type(inner).__name__)

    def _pair(
        self,
        inner: osc.RelativeDistanceCondition
        | osc.TimeHeadwayCondition
        | osc.TimeToCollisionCondition,
        entity: int,
        edge: int,
        delay: int,
    ) -> None:
        """Append a condition on two entities: reference points, as the crow flies."""
        if isinstance(inner, osc.TimeToCollisionCondition):
            target = inner.target.target
            if not isinstance(target, osc.EntityRef):
                self._tables.unsupported(target, "TimeToCollisionConditionTarget with a Position")
                return
            other, kind = self._tables.entity(target.entity_ref), _TIME_TO_COLLISION
        else:
            other = self._tables.entity(inner.entity_ref)
            kind = _RELATIVE_DISTANCE
            if isinstance(inner, osc.TimeHeadwayCondition):
                kind = _TIME_HEADWAY
        kinds = osc.RelativeDistanceType
        euclidian = (kinds.EUCLIDIAN_DISTANCE, kinds.CARTESIAN_DISTANCE)
        if inner.relative_distance_type not in euclidian:
            self._tables.unsupported(
                inner, f'relativeDistanceType="{inner.relative_distance_type}"'
            )
        if inner.freespace is not False:
            self._tables.unsupported(inner, f'freespace="{str(inner.freespace).lower()}"')
        rule = self._rule(inner, inner.rule)
        self._append(kind, entity, other, rule, inner.value, edge, delay)

    def _element_state(
        self, inner: osc.StoryboardElementStateCondition, edge: int, delay: int
    ) -> None:
        """Append a condition on the end of an event."""
        name = str(inner.storyboard_element_ref)
        is_event = inner.storyboard_element_type is osc.StoryboardElementType.EVENT
        if not is_event or inner.state not in _ENDED:
            self._tables.unsupported(
                inner, "a StoryboardElementStateCondition other than on the end of an event"
            )
        elif name not in self._event_names:
            self._tables.unsupported(inner, f'storyboardElementRef="{name}" (no such event)')
        else:
            self._append(_EVENT_ENDED, 0, self._event_names.index(name), 0, 0.0, edge, delay)

    def _rule(self, element: Element, rule: osc.Rule | osc.ParameterRef) -> int:
        if isinstance(rule, osc.ParameterRef):
            self._tables.unsupported(element, f'rule="{rule}"')
            return 0
        return _RULES[rule]
