"""The storyboard as a table: stories, acts, groups, maneuvers, events, actions."""

from collections.abc import Sequence

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.empty_triggers import is_empty
from bridgegen.simulation.embedded import _codes as codes
from bridgegen.simulation.embedded.compiler.actions import Actions
from bridgegen.simulation.embedded.compiler.nodes import Node
from bridgegen.simulation.embedded.compiler.tables import Tables
from bridgegen.simulation.embedded.compiler.triggers import Triggers

_PRIORITIES = {
    osc.Priority.OVERWRITE: codes.OVERRIDE, osc.Priority.OVERRIDE: codes.OVERRIDE,
    osc.Priority.SKIP: codes.SKIP, osc.Priority.PARALLEL: codes.PARALLEL,
}  # fmt: skip


def elements(
    found: Sequence[Node], tables: Tables, triggers: Triggers, actions: Actions
) -> list[tuple[int, ...]]:
    """Compile all elements; return them as ``Program.elements`` has them."""
    rows: list[list[int]] = []
    group: osc.ManeuverGroup | None = None
    act_start = n_events = 0
    for node in found:
        part = node.part
        start = stop = number = -1
        priority, count, first = 0, 1, len(actions.rows)
        if isinstance(part, osc.Act | osc.Event) and is_empty(part.start_trigger):
            tables.note(
                part,
                f"the {type(part).__name__} {part.name} has an empty StartTrigger, so it never "
                "starts; esmini starts it at once, and so does --empty-trigger now",
            )
        if isinstance(part, osc.Act):
            act_start = start = triggers.add(part.start_trigger)
            if part.stop_trigger is not None and part.stop_trigger.condition_groups:
                stop = triggers.add(part.stop_trigger)
        elif isinstance(part, osc.ManeuverGroup):
            group, start = part, act_start
            count = _count(tables, part)
        elif isinstance(part, osc.Event):
            number, n_events = n_events, n_events + 1
            priority, count = _priority(tables, part), _count(tables, part)
            start = act_start if part.start_trigger is None else triggers.add(part.start_trigger)
        elif isinstance(part, osc.Action):
            assert group is not None  # actions are in events, events in groups
            count, event = 0, rows[node.parent]
            named, selected = _actors(tables, group, triggers.entities(event[codes.START]))
            actions.add(part, named, selected)
            event[codes.LAST] = len(actions.rows)
        last = len(actions.rows)
        rows.append(
            [node.kind, node.parent, node.end, start, stop, priority, count, first, last, number]
        )
    return [tuple(row) for row in rows]


def _count(tables: Tables, part: osc.ManeuverGroup | osc.Event) -> int:
    """Return how often an element may run; the standard's default is once."""
    if part.maximum_execution_count is None:
        return 1
    return int(tables.literal(part, "maximumExecutionCount", part.maximum_execution_count))


def _priority(tables: Tables, event: osc.Event) -> int:
    return _PRIORITIES[tables.choice(osc.Priority, event.priority)]


def _actors(
    tables: Tables, group: osc.ManeuverGroup, triggering: Sequence[int]
) -> tuple[list[int], list[int]]:
    """Return a group's actors, and those that act only if they make the event's trigger fire."""
    refs = group.actors.entity_refs
    named = list(dict.fromkeys(e for ref in refs for e in tables.members(ref.entity_ref)))
    selects = tables.truth(group.actors.select_triggering_entities)
    return named, [e for e in triggering if e not in named] if selects else []
