"""What a condition looks at: one probe for each triggering entity or element of the storyboard."""

import math
from collections.abc import Sequence
from dataclasses import dataclass, replace

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import Element
from bridgegen.openx.openscenario.values import Value
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.declared import EQUALITY, Node, seconds
from bridgegen.simulation.embedded.compiler.global_actions import GlobalActions
from bridgegen.simulation.embedded.compiler.positions import Positions
from bridgegen.simulation.embedded.compiler.tables import Tables

_RULES = {
    osc.Rule.GREATER_THAN: codes.GREATER,
    osc.Rule.LESS_THAN: codes.LESS,
    osc.Rule.EQUAL_TO: codes.EQUAL,
    osc.Rule.GREATER_OR_EQUAL: codes.GREATER_EQUAL,
    osc.Rule.LESS_OR_EQUAL: codes.LESS_EQUAL,
    osc.Rule.NOT_EQUAL_TO: codes.NOT_EQUAL,
}
_ELEMENTS = {
    osc.StoryboardElementType.STORY: codes.STORY,
    osc.StoryboardElementType.ACT: codes.ACT,
    osc.StoryboardElementType.MANEUVER_GROUP: codes.GROUP,
    osc.StoryboardElementType.MANEUVER: codes.MANEUVER,
    osc.StoryboardElementType.EVENT: codes.EVENT,
    osc.StoryboardElementType.ACTION: codes.ACTION,
}
_TRANSITION = codes.COMPLETE + 1  # transitions are numbered after the phases
_STATES = {
    osc.StoryboardElementState.STANDBY_STATE: codes.STANDBY,
    osc.StoryboardElementState.RUNNING_STATE: codes.RUNNING,
    osc.StoryboardElementState.COMPLETE_STATE: codes.COMPLETE,
    osc.StoryboardElementState.START_TRANSITION: _TRANSITION + codes.STARTED,
    osc.StoryboardElementState.END_TRANSITION: _TRANSITION + codes.ENDED,
    osc.StoryboardElementState.STOP_TRANSITION: _TRANSITION + codes.STOPPED,
    osc.StoryboardElementState.SKIP_TRANSITION: _TRANSITION + codes.SKIPPED,
}


Pair = (
    osc.DistanceCondition
    | osc.RelativeDistanceCondition
    | osc.TimeHeadwayCondition
    | osc.TimeToCollisionCondition
)
"""The conditions on a distance, or on a time in which one is covered."""

_PAIRS = {
    osc.DistanceCondition: codes.DISTANCE,
    osc.RelativeDistanceCondition: codes.DISTANCE,
    osc.TimeHeadwayCondition: codes.TIME_HEADWAY,
    osc.TimeToCollisionCondition: codes.TIME_TO_COLLISION,
}
_MEASURES = {
    osc.RelativeDistanceType.EUCLIDIAN_DISTANCE: codes.EUCLIDIAN,
    osc.RelativeDistanceType.CARTESIAN_DISTANCE: codes.EUCLIDIAN,
    osc.RelativeDistanceType.LONGITUDINAL: codes.LONGITUDINAL,
    osc.RelativeDistanceType.LATERAL: codes.LATERAL,
}
_SYSTEMS = {
    osc.CoordinateSystem.ENTITY: codes.ENTITY_SYSTEM,
    osc.CoordinateSystem.LANE: codes.PATH_SYSTEM,
    osc.CoordinateSystem.ROAD: codes.PATH_SYSTEM,
    osc.CoordinateSystem.TRAJECTORY: codes.PATH_SYSTEM,
    osc.CoordinateSystem.WORLD: codes.WORLD_SYSTEM,
}
_ANGLE_SYSTEMS = _SYSTEMS | {osc.CoordinateSystem.ROAD: codes.ROAD_SYSTEM}
_DIRECTIONS = {
    osc.DirectionalDimension.LONGITUDINAL: codes.LONGITUDINAL,
    osc.DirectionalDimension.LATERAL: codes.LATERAL,
    osc.DirectionalDimension.VERTICAL: codes.VERTICAL,
}
_DISTANCES = (codes.DISTANCE, codes.TIME_TO_COLLISION, codes.TIME_HEADWAY)
_OFTEN = (
    codes.NEVER_TRUE,
    codes.SIMULATION_TIME,
    codes.ELEMENT_STATE,
    codes.SPEED,
    codes.TRAVELED_DISTANCE,
    codes.STAND_STILL,
)
_ON_OWN_WAY = (osc.RoutingAlgorithm.UNDEFINED, osc.RoutingAlgorithm.ASSIGNED_ROUTE)


@dataclass(frozen=True)
class Probe:
    """A row of ``Program.probes``; ``limit`` and ``within`` are values and not yet their slots."""

    kind: int
    entity: int = 0
    other: int = 0
    rule: int = 0
    limit: Value = 0.0
    place: int = 0
    measure: int = 0
    system: int = 0
    freespace: bool = False
    within: Value = 0.0

    @property
    def looks_closely(self) -> bool:
        """Whether it is seldom asked for, and looked at in a function of its own."""
        if self.kind in _DISTANCES:
            return self.other < 0 or self.freespace or self.measure != codes.EUCLIDIAN
        return self.kind not in _OFTEN or (self.kind == codes.SPEED and self.measure != codes.TOTAL)


class Probes:
    """The probes of conditions; unsupported ones are reported to ``tables``.

    Args:
        tables: the compiler's.
        nodes: the storyboard's elements.
        positions: takes the places that probes name.
        global_actions: knows lights, controllers and values.

    Attributes:
        marks, clearances, ranges: as `Program` has them.
    """

    def __init__(
        self,
        tables: Tables,
        nodes: "Sequence[Node]",
        positions: Positions,
        global_actions: GlobalActions,
    ) -> None:
        self._tables, self._nodes, self._positions = tables, nodes, positions
        self.marks: list[int] = []
        self.clearances: list[tuple[int, ...]] = []
        self.ranges: list[tuple[float, float]] = []
        self._signals, self._values = global_actions.signals, global_actions.values

    def by_value(self, condition: Element) -> list[Probe]:
        """Return the probes of a condition that no entity triggers."""
        match condition:
            case osc.SimulationTimeCondition():
                rule = self._rule(condition.rule)
                return [Probe(codes.SIMULATION_TIME, rule=rule, limit=condition.value)]
            case osc.StoryboardElementStateCondition():
                return self._element_state(condition)
            case osc.ParameterCondition():
                return [self._value(condition, "parameter", condition.parameter_ref)]
            case osc.VariableCondition():
                return [self._value(condition, "variable", condition.variable_ref)]
            case osc.TimeOfDayCondition():
                rule, date = self._rule(condition.rule), self._tables.text(condition.date_time)
                moment = seconds(date)
                if moment is not None:
                    return [Probe(codes.TIME_OF_DAY, rule=rule, limit=moment)]
                self._tables.unsupported(condition, f'dateTime="{date}"')
                return []
            case osc.TrafficSignalCondition():
                light = self._signals.light(self._tables.text(condition.name))
                state = self._signals.state(condition, self._tables.text(condition.state))
                return [Probe(codes.LIGHT_STATE, other=light, limit=float(state))]
            case osc.TrafficSignalControllerCondition():
                name = self._tables.text(condition.traffic_signal_controller_ref)
                controller = self._signals.controller(condition, name)
                wanted = self._tables.text(condition.phase)
                phase = self._signals.phase(condition, controller, wanted)
                return [Probe(codes.LIGHT_PHASE, other=controller, limit=float(phase))]
        self._tables.unsupported(condition, type(condition).__name__)
        return []

    def _value(
        self, condition: osc.ParameterCondition | osc.VariableCondition, what: str, name: str
    ) -> Probe:
        """Return the probe of a condition on a parameter or variable."""
        rule, number = self._rule(condition.rule), self._values.number(condition, what, name)
        if not self._values.is_ordered(what, name) and rule not in EQUALITY:
            self._tables.unsupported(
                condition, f"rule=\"{condition.rule}\" for the text of {what} '{name}'"
            )
        value = self._values.value(condition, what, name, condition.value)
        return Probe(codes.VALUE, other=number, rule=rule, limit=value)

    def by_entity(self, condition: Element, entities: Sequence[int]) -> list[Probe]:
        """Return a condition's probes, one for each triggering entity."""
        probe = self._probe(condition)
        return [replace(probe, entity=e) for e in entities]

    def _probe(self, element: Element) -> Probe:
        """Return the probe of a condition on no entity in particular."""
        match element:
            case osc.SpeedCondition() | osc.AccelerationCondition():
                kind = (
                    codes.SPEED if isinstance(element, osc.SpeedCondition) else codes.ACCELERATING
                )
                direction = self._direction(element.direction)
                return Probe(
                    kind, rule=self._rule(element.rule), limit=element.value, measure=direction
                )
            case osc.RelativeSpeedCondition():
                return Probe(
                    codes.SPEED_DIFFERENCE,
                    other=self._tables.entity(element.entity_ref),
                    rule=self._rule(element.rule),
                    limit=element.value,
                    measure=self._direction(element.direction),
                )
            case osc.TraveledDistanceCondition():
                return Probe(codes.TRAVELED_DISTANCE, limit=element.value)
            case osc.StandStillCondition():
                return Probe(codes.STAND_STILL, limit=element.duration)
            case osc.EndOfRoadCondition():
                return Probe(codes.END_OF_ROAD, limit=element.duration)
            case osc.ReachPositionCondition():
                where, place = self._place(element.position)
                return Probe(
                    codes.DISTANCE,
                    other=where,
                    rule=codes.LESS_EQUAL,
                    limit=element.tolerance,
                    place=place,
                )
            case osc.OffroadCondition():
                return Probe(codes.OFFROAD, limit=element.duration)
            case osc.RelativeClearanceCondition():
                return self._clearance(element)
            case osc.CollisionCondition(target=osc.EntityRef() as target):
                return Probe(codes.COLLISION, other=self._tables.entity(target.entity_ref))
            case osc.CollisionCondition(target=osc.ByObjectType() as target):
                number = self._tables.type_number(target.type)
                return Probe(codes.COLLISION_WITH_TYPE, other=number)
            case osc.AngleCondition() | osc.RelativeAngleCondition():
                return self._angle(element)
            case (
                osc.DistanceCondition()
                | osc.RelativeDistanceCondition()
                | osc.TimeHeadwayCondition()
                | osc.TimeToCollisionCondition()
            ):
                return self._pair(element)
        self._tables.unsupported(element, type(element).__name__)
        return Probe(codes.NEVER_TRUE)

    def _place(self, position: osc.Position) -> tuple[int, int]:
        """Return of which kind a place is, and its number among those of its kind."""
        place = self._positions.place(position)
        if place >= 0:
            return codes.AT_POINT, place
        self.marks.append(-1 - place)
        return codes.AT_MARK, len(self.marks) - 1

    def _clearance(self, condition: osc.RelativeClearanceCondition) -> Probe:
        """Return the probe of a condition on the lanes around an entity."""
        first = len(self.ranges)
        for lanes in condition.relative_lane_ranges:
            ends = ((lanes.from_, "from", -math.inf), (lanes.to, "to", math.inf))
            low, high = (
                unsaid if end is None else self._tables.literal(lanes, name, end)
                for end, name, unsaid in ends
            )
            if low > high:
                self._tables.unsupported(lanes, f'from="{low:g}" to="{high:g}" (none between)')
            self.ranges.append((low, high))
        named = [e for ref in condition.entity_refs for e in self._tables.members(ref.entity_ref)]
        counts = [int(not named or e in named) for e in range(len(self._tables.names))]
        opposite = int(self._tables.truth(condition.opposite_lanes))
        self.clearances.append((first, len(self.ranges), opposite, *counts))
        return Probe(
            codes.CLEARANCE,
            other=len(self.clearances) - 1,
            limit=condition.distance_forward or 0.0,
            within=condition.distance_backward or 0.0,
            freespace=self._tables.truth(condition.free_space),
        )

    def _pair(self, pair: Pair) -> Probe:
        """Return the probe of a condition on a distance to an entity or a place."""
        place = 0
        if isinstance(pair, osc.DistanceCondition):
            other, place = self._place(pair.position)
        elif isinstance(pair, osc.TimeToCollisionCondition):
            target = pair.target.target
            if isinstance(target, osc.EntityRef):
                other = self._tables.entity(target.entity_ref)
            else:
                other, place = self._place(target)
        else:
            other = self._tables.entity(pair.entity_ref)
        measure, system = self._measure(pair)
        freespace = self._tables.truth(pair.freespace)
        return Probe(
            _PAIRS[type(pair)],
            0,
            other,
            self._rule(pair.rule),
            pair.value,
            place,
            measure,
            system,
            freespace,
        )

    def _measure(self, pair: Pair) -> tuple[int, int]:
        """Return the kind of distance and the coordinate system; 1.0 has ``alongRoute`` instead."""
        if not isinstance(pair, osc.RelativeDistanceCondition) and pair.along_route is not None:
            along = self._tables.truth(pair.along_route)
            return (codes.LONGITUDINAL, codes.PATH_SYSTEM) if along else (codes.EUCLIDIAN, 0)
        measure, system = codes.EUCLIDIAN, codes.ENTITY_SYSTEM
        if pair.relative_distance_type is not None:
            kind = self._tables.choice(osc.RelativeDistanceType, pair.relative_distance_type)
            measure = _MEASURES[kind]
        if pair.coordinate_system is not None:
            system = _SYSTEMS[self._tables.choice(osc.CoordinateSystem, pair.coordinate_system)]
        if measure == codes.EUCLIDIAN:
            return measure, system
        if system == codes.WORLD_SYSTEM:
            self._tables.unsupported(pair, 'coordinateSystem="world" of a distance')
        if pair.routing_algorithm is not None and system == codes.PATH_SYSTEM:
            way = self._tables.choice(osc.RoutingAlgorithm, pair.routing_algorithm)
            if way not in _ON_OWN_WAY:  # distances are measured on the entity's own way
                self._tables.unsupported(pair, f'routingAlgorithm="{way}"')
        return measure, system

    def _angle(self, angle_condition: osc.AngleCondition | osc.RelativeAngleCondition) -> Probe:
        """Return the probe of a condition on a heading."""
        kind = self._tables.choice(osc.AngleType, angle_condition.angle_type)
        if kind is not osc.AngleType.HEADING:
            self._tables.unsupported(angle_condition, f'angleType="{kind}"')
        system = codes.WORLD_SYSTEM
        if angle_condition.coordinate_system is not None:
            chosen = self._tables.choice(osc.CoordinateSystem, angle_condition.coordinate_system)
            system = _ANGLE_SYSTEMS[chosen]
        within = angle_condition.angle_tolerance
        if isinstance(angle_condition, osc.AngleCondition):
            return Probe(codes.ANGLE, limit=angle_condition.angle, system=system, within=within)
        other = self._tables.entity(angle_condition.entity_ref)
        return Probe(
            codes.RELATIVE_ANGLE,
            other=other,
            limit=angle_condition.angle,
            system=system,
            within=within,
        )

    def _element_state(self, condition: osc.StoryboardElementStateCondition) -> list[Probe]:
        """Return a probe for each element that bears the name, or ends in the path of names."""
        kind = self._tables.choice(osc.StoryboardElementType, condition.storyboard_element_type)
        state = self._tables.choice(osc.StoryboardElementState, condition.state)
        path = tuple(self._tables.text(condition.storyboard_element_ref).split("::"))
        found = [
            number
            for number, node in enumerate(self._nodes)
            if node.kind == _ELEMENTS[kind] and node.path[-len(path) :] == path
        ]
        if not found:
            what = f'storyboardElementRef="{condition.storyboard_element_ref}"'
            self._tables.unsupported(condition, f"{what} (no such {kind})")
        return [Probe(codes.ELEMENT_STATE, number, _STATES[state]) for number in found]

    def _rule(self, rule: osc.Rule | osc.ParameterRef) -> int:
        return _RULES[self._tables.choice(osc.Rule, rule)]

    def _direction(self, direction: osc.DirectionalDimension | osc.ParameterRef | None) -> int:
        if direction is None:
            return codes.TOTAL
        return _DIRECTIONS[self._tables.choice(osc.DirectionalDimension, direction)]


# --- Triggers as tables: which groups a trigger has, which conditions a group, which probes those -


_EDGES = {
    osc.ConditionEdge.NONE: codes.NO_EDGE,
    osc.ConditionEdge.RISING: codes.RISING,
    osc.ConditionEdge.FALLING: codes.FALLING,
    osc.ConditionEdge.RISING_OR_FALLING: codes.EITHER,
}
SAME_STEP = 1e-6
"""Tolerance of a delay for rounding [steps]."""

MAX_STEPS = 100_000
"""Largest number of instants of a run."""

_QUANTITIES = {
    osc.TriggeringEntitiesRule.ANY: codes.ANY,
    osc.TriggeringEntitiesRule.ALL: codes.ALL,
}


class Triggers:
    """The triggers of a scenario, numbered in the order in which they are added.

    Attributes:
        triggers, groups, conditions, probes: as `Program` has them.
        looks: makes the probes, and has their tables.
        stop_time: latest simulation time [s] that the first trigger, the scenario's end, names.
    """

    def __init__(
        self,
        tables: Tables,
        time_step: float,
        nodes: "Sequence[Node]",
        positions: Positions,
        global_actions: GlobalActions,
    ) -> None:
        self.triggers: list[tuple[int, int]] = []
        self.groups: list[tuple[int, int]] = []
        self.conditions: list[tuple[int, ...]] = []
        self.probes: list[tuple[int, ...]] = []
        self.stop_time = 0.0
        self._tables = tables
        self._time_step = time_step
        self.looks = Probes(tables, nodes, positions, global_actions)

    def add(self, trigger: osc.Trigger | None) -> int:
        """Append a trigger and return its number; -1 if it is missing."""
        if trigger is None:
            return -1
        first = len(self.groups)
        # Conditions are numbered before the next group's, so that each group is a range.
        for group in trigger.condition_groups:
            start = len(self.conditions)
            for condition in group.conditions:
                self._condition(condition)
            self.groups.append((start, len(self.conditions)))
        self.triggers.append((first, len(self.groups)))
        return len(self.triggers) - 1

    def entities(self, trigger: int) -> list[int]:
        """Return the entities whose state a trigger looks at."""
        if trigger < 0:
            return []
        first, last = self.triggers[trigger]
        found: dict[int, None] = {}
        for start, end in self.groups[first:last]:
            for condition in self.conditions[start:end]:
                for probe in self.probes[condition[codes.PROBES] : condition[codes.PROBES_END]]:
                    if probe[codes.PROBE] >= codes.FIRST_BY_ENTITY:
                        found[probe[codes.WHO]] = None
        return list(found)

    def _condition(self, condition: osc.Condition) -> None:
        """Append a condition; an unsupported one is reported and never true."""
        known = len(self._tables.problems)
        edge = _EDGES[self._tables.choice(osc.ConditionEdge, condition.condition_edge)]
        seconds = self._tables.literal(condition, "delay", condition.delay)
        delay = MAX_STEPS  # no run is longer: it never comes
        if seconds < MAX_STEPS * self._time_step:
            # A delay is over at the first instant after it; 0.15 s is not 3 · 0.05 s in binary.
            delay = max(math.ceil(seconds / self._time_step - SAME_STEP), 0)
        kind, quantity = condition.condition, codes.ANY
        if isinstance(kind, osc.ByValueCondition):
            probes = [] if condition.is_criterion else self.looks.by_value(kind.condition)
            if isinstance(kind.condition, osc.SimulationTimeCondition):
                self._note_end(kind.condition, delay)
        else:
            triggering = kind.triggering_entities
            rule = self._tables.choice(
                osc.TriggeringEntitiesRule, triggering.triggering_entities_rule
            )
            quantity = _QUANTITIES[rule]
            entities = [
                e for ref in triggering.entity_refs for e in self._tables.members(ref.entity_ref)
            ]
            probes = self.looks.by_entity(kind.entity_condition.condition, entities)
        if len(self._tables.problems) > known or not probes:
            probes, quantity = [Probe(codes.NEVER_TRUE)], codes.ANY
        first = len(self.probes)
        for probe in probes:
            limit, within = self._tables.slot(probe.limit), self._tables.slot(probe.within)
            self.probes.append(
                (
                    probe.kind,
                    probe.entity,
                    probe.other,
                    probe.rule,
                    limit,
                    probe.place,
                    probe.measure,
                    probe.system,
                    int(probe.freespace),
                    within,
                    int(probe.looks_closely),
                )
            )
        self.conditions.append((first, len(self.probes), quantity, edge, delay))

    def _note_end(self, clock: osc.SimulationTimeCondition, delay: int) -> None:
        """Record the latest end of the scenario by the storyboard's own stop trigger."""
        if not self.triggers:  # it is the first
            end = self._tables.literal(clock, "value", clock.value) + delay * self._time_step
            if math.isfinite(end) and delay < MAX_STEPS:  # else it never comes
                self.stop_time = max(self.stop_time, end)
