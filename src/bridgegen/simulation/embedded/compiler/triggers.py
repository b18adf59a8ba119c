"""Triggers as tables: which groups a trigger has, which conditions a group, which probes those."""

import math
from collections.abc import Sequence

from bridgegen.openx.openscenario import model as osc
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.global_actions import GlobalActions
from bridgegen.simulation.embedded.compiler.nodes import Node
from bridgegen.simulation.embedded.compiler.positions import Positions
from bridgegen.simulation.embedded.compiler.probes import Probe, Probes
from bridgegen.simulation.embedded.compiler.tables import Tables

_EDGES = {
    osc.ConditionEdge.NONE: codes.NO_EDGE, osc.ConditionEdge.RISING: codes.RISING,
    osc.ConditionEdge.FALLING: codes.FALLING, osc.ConditionEdge.RISING_OR_FALLING: codes.EITHER,
}  # fmt: skip
SAME_STEP = 1e-6
"""Steps that a delay may be off by rounding."""

MAX_STEPS = 100_000
"""Instants that a run may have."""

_QUANTITIES = {
    osc.TriggeringEntitiesRule.ANY: codes.ANY, osc.TriggeringEntitiesRule.ALL: codes.ALL,
}  # fmt: skip


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
                    probe.kind, probe.entity, probe.other, probe.rule, limit, probe.place,
                    probe.measure, probe.system, int(probe.freespace), within,
                    int(probe.looks_closely),
                )
            )  # fmt: skip
        self.conditions.append((first, len(self.probes), quantity, edge, delay))

    def _note_end(self, clock: osc.SimulationTimeCondition, delay: int) -> None:
        """Record the latest end of the scenario by the storyboard's own stop trigger."""
        if not self.triggers:  # it is the first
            end = self._tables.literal(clock, "value", clock.value) + delay * self._time_step
            if math.isfinite(end) and delay < MAX_STEPS:  # else it never comes
                self.stop_time = max(self.stop_time, end)
