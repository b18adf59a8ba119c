"""What a condition looks at: one probe for each triggering entity or element of the storyboard."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Expr, Value
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.program import LanePoint
from bridgegen.simulation.embedded.tables import Tables

if TYPE_CHECKING:
    from bridgegen.simulation.embedded.storyboard import Node

_RULES = {
    osc.Rule.GREATER_THAN: codes.GREATER, osc.Rule.LESS_THAN: codes.LESS,
    osc.Rule.EQUAL_TO: codes.EQUAL, osc.Rule.GREATER_OR_EQUAL: codes.GREATER_EQUAL,
    osc.Rule.LESS_OR_EQUAL: codes.LESS_EQUAL, osc.Rule.NOT_EQUAL_TO: codes.NOT_EQUAL,
}  # fmt: skip
_ELEMENTS = {
    osc.StoryboardElementType.STORY: codes.STORY, osc.StoryboardElementType.ACT: codes.ACT,
    osc.StoryboardElementType.MANEUVER_GROUP: codes.GROUP,
    osc.StoryboardElementType.MANEUVER: codes.MANEUVER,
    osc.StoryboardElementType.EVENT: codes.EVENT, osc.StoryboardElementType.ACTION: codes.ACTION,
}  # fmt: skip
_TRANSITION = codes.COMPLETE + 1  # transitions are numbered after the phases
_STATES = {
    osc.StoryboardElementState.STANDBY_STATE: codes.STANDBY,
    osc.StoryboardElementState.RUNNING_STATE: codes.RUNNING,
    osc.StoryboardElementState.COMPLETE_STATE: codes.COMPLETE,
    osc.StoryboardElementState.START_TRANSITION: _TRANSITION + codes.STARTED,
    osc.StoryboardElementState.END_TRANSITION: _TRANSITION + codes.ENDED,
    osc.StoryboardElementState.STOP_TRANSITION: _TRANSITION + codes.STOPPED,
    osc.StoryboardElementState.SKIP_TRANSITION: _TRANSITION + codes.SKIPPED,
}  # fmt: skip


@dataclass(frozen=True)
class Probe:
    """A row of ``Program.probes``; ``limit`` is a value and not yet its slot."""

    kind: int
    who: int = 0
    other: int = 0
    rule: int = 0
    limit: Value = 0.0
    place: int = 0


class Probes:
    """The probes of conditions; what cannot be looked at is taken down in ``tables``.

    Args:
        tables: the compiler's.
        nodes: the storyboard's elements.
        points: takes the positions that probes name.
    """

    def __init__(self, tables: Tables, nodes: "Sequence[Node]", points: list[LanePoint]) -> None:
        self._tables, self._nodes, self._points = tables, nodes, points

    def by_value(self, condition: Element) -> list[Probe]:
        """Return the probes of a condition that no entity triggers."""
        if isinstance(condition, osc.SimulationTimeCondition):
            rule = self._rule(condition, condition.rule)
            return [Probe(codes.SIMULATION_TIME, rule=rule, limit=condition.value)]
        if isinstance(condition, osc.StoryboardElementStateCondition):
            return self._element_state(condition)
        self._tables.unsupported(condition, type(condition).__name__)
        return []

    def by_entity(self, condition: Element, entities: Sequence[int]) -> list[Probe]:
        """Return a condition's probes, one for each triggering entity."""
        make = self._maker(condition)
        return [make(e) for e in entities]

    def _maker(self, one: Element) -> Callable[[int], Probe]:
        """Return what makes the probe of an entity."""
        match one:
            case osc.SpeedCondition():
                if one.direction is not None:
                    self._tables.unsupported(one, f'direction="{one.direction}"')
                rule = self._rule(one, one.rule)
                return lambda e: Probe(codes.SPEED, e, rule=rule, limit=one.value)
            case osc.TraveledDistanceCondition():
                return lambda e: Probe(codes.TRAVELED_DISTANCE, e, limit=one.value)
            case osc.StandStillCondition():
                return lambda e: Probe(codes.STAND_STILL, e, limit=one.duration)
            case osc.ReachPositionCondition():
                place = self._place(one)
                return lambda e: Probe(codes.REACH_POSITION, e, limit=one.tolerance, place=place)
            case osc.RelativeDistanceCondition():
                return self._pair(one, one.entity_ref, codes.RELATIVE_DISTANCE)
            case osc.TimeHeadwayCondition():
                return self._pair(one, one.entity_ref, codes.TIME_HEADWAY)
            case osc.TimeToCollisionCondition():
                target = one.target.target
                if isinstance(target, osc.EntityRef):
                    return self._pair(one, target.entity_ref, codes.TIME_TO_COLLISION)
                self._tables.unsupported(target, "TimeToCollisionConditionTarget with a Position")
            case _:
                self._tables.unsupported(one, type(one).__name__)
        return lambda e: Probe(codes.NEVER_TRUE, e)

    def _place(self, one: osc.ReachPositionCondition) -> int:
        point = self._tables.lane_point(one.position)
        if point is None:
            return 0
        if isinstance(point.s, osc.ParameterRef | Expr):
            self._tables.unsupported(one, f's="{point.s}" of a position to be reached')
        self._points.append(point)
        return len(self._points) - 1

    def _pair(
        self,
        one: osc.RelativeDistanceCondition
        | osc.TimeHeadwayCondition
        | osc.TimeToCollisionCondition,
        entity_ref: object,
        kind: int,
    ) -> Callable[[int], Probe]:
        """Return what makes a probe on two entities: reference points, as the crow flies."""
        kinds = osc.RelativeDistanceType
        if one.relative_distance_type not in (kinds.EUCLIDIAN_DISTANCE, kinds.CARTESIAN_DISTANCE):
            self._tables.unsupported(one, f'relativeDistanceType="{one.relative_distance_type}"')
        if one.freespace is not False:
            self._tables.unsupported(one, f'freespace="{str(one.freespace).lower()}"')
        other, rule = self._tables.entity(entity_ref), self._rule(one, one.rule)
        return lambda e: Probe(kind, e, other, rule, one.value)

    def _element_state(self, one: osc.StoryboardElementStateCondition) -> list[Probe]:
        """Return a probe for each element that bears the name, or ends in the path of names."""
        if isinstance(one.storyboard_element_type, osc.ParameterRef) or isinstance(
            one.state, osc.ParameterRef
        ):
            self._tables.unsupported(one, "a StoryboardElementStateCondition by a parameter")
            return []
        kind, state = _ELEMENTS[one.storyboard_element_type], _STATES[one.state]
        path = tuple(str(one.storyboard_element_ref).split("::"))
        found = [
            number
            for number, node in enumerate(self._nodes)
            if node.kind == kind and node.path[-len(path) :] == path
        ]
        if not found:
            what = f'storyboardElementRef="{one.storyboard_element_ref}"'
            self._tables.unsupported(one, f"{what} (no such {one.storyboard_element_type})")
        return [Probe(codes.ELEMENT_STATE, number, state) for number in found]

    def _rule(self, element: Element, rule: osc.Rule | osc.ParameterRef) -> int:
        if isinstance(rule, osc.ParameterRef):
            self._tables.unsupported(element, f'rule="{rule}"')
            return 0
        return _RULES[rule]
