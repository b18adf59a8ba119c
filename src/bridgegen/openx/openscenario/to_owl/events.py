"""OpenSCENARIO2OWL, its events: actors, actions and conditions; and the temporary changes.

A storyboard's stories, acts, groups and maneuvers are levels without a meaning of their own where
they begin with the scenario and happen once: their names are not kept. An act is stated where it
begins later, a maneuver where its events end one another, and both where a condition names them.
"""

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass, replace
from itertools import count
from urllib.parse import unquote

import pyoxigraph as ox

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lanes import lane_at, section_index
from bridgegen.openx.opendrive.map_names import lane_name, road_name
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import walk
from bridgegen.openx.openscenario.from_owl.notes import CHANGES
from bridgegen.openx.openscenario.to_owl.actions import add_action
from bridgegen.openx.openscenario.to_owl.build import (
    Lost,
    NotExpressibleError,
    StoryBuilder,
    numbered,
    plain_name,
)
from bridgegen.openx.openscenario.to_owl.conditions import add_trigger
from bridgegen.openx.openscenario.to_owl.entities import as_number
from bridgegen.openx.openscenario.to_owl.parameters import Facts

_ENDING = (osc.Priority.OVERRIDE, osc.Priority.OVERWRITE)
_EARLY = (osc.Rule.GREATER_OR_EQUAL, osc.Rule.GREATER_THAN)


@dataclass(frozen=True)
class Happening:
    """An event with whose it is.

    Attributes:
        name: its own.
        group: of the event, as if it stood alone in it.
        event: with the priority that it has by itself, or in the maneuver that is stated.
        act: its act, if that is stated.
        maneuver: the name of its maneuver, if that is stated.
    """

    name: str
    group: osc.ManeuverGroup
    event: osc.Event
    act: osc.Act | None = None
    maneuver: str | None = None


def happenings(builder: StoryBuilder) -> Iterator[Happening]:
    """Yield the events of a storyboard, each once; problems are noted."""
    seen: set[str] = set()
    storyboard, names = builder.scenario_file.storyboard, builder.element_names
    named = named_elements(storyboard, builder.text)
    if len(storyboard.stories) == 1:
        names["story", builder.text(storyboard.stories[0].name)] = "story"
    for act in (item for story in storyboard.stories for item in story.acts):
        name, stated = builder.text(act.name), None
        if not _begins_at_once(builder, act.start_trigger) or ("act", name) in named:
            if not builder.in_substance or ("act", name) in names:
                builder.problems.append(Lost(act.line, f"the Act {act.name}, which starts later,"))
                continue
            stated, names["act", name] = act, name
        if act.stop_trigger is not None and act.stop_trigger.condition_groups:
            builder.problems.append(Lost(act.stop_trigger.line, "StopTrigger of Act"))
        for group in act.maneuver_groups:
            for maneuver in group.maneuvers:
                together = _together(builder, group, maneuver, named)
                for event in maneuver.events:
                    name = builder.text(event.name)
                    if name in seen and (not builder.in_substance or ("event", name) in named):
                        text = f"a second Event of the name {name}"
                        builder.problems.append(Lost(event.line, text))
                        continue
                    wanted, name = name, plain_name(name) if builder.in_substance else name
                    if name in seen:
                        name = next(n for k in count(2) if (n := f"{name}_{k}") not in seen)
                    if name != wanted:
                        event = replace(event, name=name)
                    seen.add(name)
                    for number, action in enumerate(event.actions, start=1):
                        key = "action", builder.text(action.name)
                        # Two actions of one name: a condition on it could mean either. The empty
                        # name is no event's, so that such a condition is not stated.
                        names[key] = f"{name}_action_{number}" if key not in names else ""
                    names["event", wanted] = name
                    if len(maneuver.events) > 1 and event.priority in _ENDING and not together:
                        text = f'priority="{event.priority}" of Event {name} among others'
                        builder.problems.append(Lost(event.line, text))
                    own = event if together else _by_itself(event)
                    yield Happening(name, group, own, stated, together)


def named_elements(
    storyboard: osc.Storyboard, text: Callable[[osc.ParameterRef | str], str]
) -> set[tuple[str, str]]:
    """Return the kinds and names of the storyboard's elements whose state a condition looks at."""
    return {
        (text(node.storyboard_element_type), text(node.storyboard_element_ref))
        for node in walk(storyboard)
        if isinstance(node, osc.StoryboardElementStateCondition)
    }


def _together(
    builder: StoryBuilder,
    group: osc.ManeuverGroup,
    maneuver: osc.Maneuver,
    named: set[tuple[str, str]],
) -> str | None:
    """Return the name under which a maneuver is stated; None if it is not."""
    name, of_group = builder.text(maneuver.name), builder.text(group.name)
    several = len(maneuver.events) > 1
    ends = several and any(event.priority in _ENDING for event in maneuver.events)
    is_named = ("maneuver", name) in named or (
        ("maneuverGroup", of_group) in named and len(group.maneuvers) == 1
    )
    names = builder.element_names
    if not (ends or is_named) or not builder.in_substance:
        return None
    wanted = next(
        n for k in count(1) if ("maneuver", n := f"{name}_{k}" if k > 1 else name) not in names
    )
    if wanted != name and is_named:
        return None  # two of one name, and one of them is meant
    names["maneuver", wanted] = wanted
    if len(group.maneuvers) == 1:
        names["maneuverGroup", of_group] = f"{wanted}_group"
    return wanted


def _by_itself(event: osc.Event) -> osc.Event:
    """Return an event as it is with nothing beside it, where its priority makes no difference."""
    if event.priority in (osc.Priority.OVERWRITE, osc.Priority.PARALLEL):
        return replace(event, priority=osc.Priority.OVERRIDE)
    return event


def _begins_at_once(builder: StoryBuilder, trigger: osc.Trigger | None) -> bool:
    if trigger is None:
        return True
    for group in trigger.condition_groups:
        conditions = [condition.condition for condition in group.conditions]
        if len(conditions) == 1 and isinstance(conditions[0], osc.ByValueCondition):
            time = conditions[0].condition
            if isinstance(time, osc.SimulationTimeCondition):
                rule = builder.choice(osc.Rule, time.rule)
                with builder.attempt():
                    if rule in _EARLY and builder.now(time.value, time) <= 0.0:
                        return True
    return False


def add_events(builder: StoryBuilder, scenario: ox.NamedNode, all_: list[Happening]) -> set[str]:
    """Add the events; one that waits for an event that cannot be expressed is left out, too.

    Returns:
        The names of those that are stated.
    """
    for happening in all_:
        # Names first: a condition may wait for an event that comes later in the file.
        builder.events[happening.name] = builder.reserve(happening.name)
    waits: dict[str, set[str]] = {}
    awaited = {
        name: _add_act(builder, act)
        for name, act in {
            builder.text(happening.act.name): happening.act for happening in all_ if happening.act
        }.items()
    }
    lines = {happening.name: happening.event.line for happening in all_}
    start = len(builder.problems)
    kept = builder.mark()
    done = {
        happening.name
        for happening in all_
        if _attempt(builder, scenario, happening, waits, awaited)
    }
    lost = [name for name in lines if name not in done]
    if not lost:
        return done
    waiting: dict[str, list[str]] = {}
    for name, others in waits.items():
        for other in others:
            waiting.setdefault(other, []).append(name)
    while lost:
        for name in waiting.get(gone := lost.pop(), ()):
            if name in done:
                done.discard(name)
                lost.append(name)
                text = f"the Event {name}, which waits for {gone},"
                builder.problems.append(Lost(lines[name], text))
    # An event that waits for a lost one has been stated among the others. All is taken back, and
    # stated again without those; the first pass has said all problems.
    problems = builder.problems[:]
    builder.take_back(kept)
    for happening in all_:
        if happening.name in done:
            _attempt(builder, scenario, happening, waits, awaited)
    builder.problems[start:] = problems[start:]
    return done


def _add_act(builder: StoryBuilder, act: osc.Act) -> set[str]:
    """Add an act with when it begins; return the events that it waits for."""
    name = builder.text(act.name)
    builder.referred = set()
    with builder.attempt():
        node = builder.node(f"{name}_act", "Act")
        builder.put(node, "has_name", name)
        trigger = add_trigger(builder, f"{name}_act", (), act.start_trigger)
        builder.put(node, "begins_when", trigger)
        builder.acts[name] = node
    return builder.referred


def _attempt(
    builder: StoryBuilder,
    scenario: ox.NamedNode,
    happening: Happening,
    waits: dict[str, set[str]],
    awaited: Mapping[str, set[str]],
) -> bool:
    builder.referred = set()
    before = len(builder.problems)
    with builder.attempt():
        _add_event(builder, happening)
        builder.put(scenario, "has_event", builder.events[happening.name])
    act = set() if happening.act is None else awaited[builder.text(happening.act.name)]
    waits[happening.name] = builder.referred | act
    return len(builder.problems) == before


def _add_event(builder: StoryBuilder, happening: Happening) -> None:
    actors = happening.group.actors
    if actors.select_triggering_entities is not False:
        raise NotExpressibleError(actors, "Actors by selectTriggeringEntities")
    nodes = {
        builder.text(ref.entity_ref): builder.entity(ref.entity_ref, ref)
        for ref in actors.entity_refs
    }
    wrapped = [action.action for action in happening.event.actions]
    concerned = [
        action.action
        for action in wrapped
        if isinstance(action, osc.GlobalAction) and isinstance(action.action, osc.EntityAction)
    ]
    if not nodes:  # of an entity that comes or goes it is its own
        nodes = {
            builder.text(action.entity_ref): builder.entity(action.entity_ref, action)
            for action in concerned
        }
    signals = [
        isinstance(action, osc.GlobalAction) and isinstance(action.action, osc.InfrastructureAction)
        for action in wrapped
    ]
    usual = "SignalChangeEvent" if all(signals) else "EnvironmentChangeEvent"
    node = builder.state(builder.events[happening.name], "StoryboardEvent" if nodes else usual)
    builder.put(node, "has_name", happening.name)
    if happening.act is not None:
        if (act := builder.acts.get(builder.text(happening.act.name))) is None:
            raise NotExpressibleError(
                happening.act, f"the Act {happening.act.name}, which starts later,"
            )
        builder.put(node, "in_act", act)
    if happening.maneuver is not None:
        priority = builder.choice(osc.Priority, happening.event.priority)
        usual = osc.Priority.OVERRIDE if priority is osc.Priority.OVERWRITE else priority
        builder.put(node, "in_maneuver", happening.maneuver)
        builder.put(node, "has_priority", usual.value)
    most = happening.event.maximum_execution_count
    if builder.in_substance and most is not None and builder.now(most, happening.event) != 1.0:
        builder.put(node, "has_execution_count", round(builder.now(most, happening.event)))
    for actor in nodes.values():
        builder.put(node, "has_who", actor)
    names = tuple(sorted(nodes))
    for number, action in zip(numbered(len(wrapped)), wrapped, strict=True):
        suffix = "" if int(number) == 1 else f"_{number}"
        name = f"{happening.name}_action{suffix}"
        builder.put(node, "has_what", add_action(builder, happening.name, name, names, action))
    trigger = add_trigger(builder, happening.name, names, happening.event.start_trigger)
    builder.put(node, "has_when", trigger)


# -- temporary changes -----------------------------------------------------------------------------


def add_changes(
    builder: StoryBuilder, scenario: ox.NamedNode, said: Facts, elements: Mapping[str, str]
) -> None:
    """Add the temporary changes that the header's properties describe.

    Args:
        builder: where to.
        scenario: whose they are.
        said: by the change's name.
        elements: things that stand at road works, with whose they are.
    """
    for name, facts in said.items():
        with builder.attempt():
            _add_change(builder, scenario, name, facts, elements)


def _add_change(
    builder: StoryBuilder,
    scenario: ox.NamedNode,
    name: str,
    facts: dict[str, list[osc.Property]],
    elements: Mapping[str, str],
) -> None:
    first = next(iter(facts.values()))[0]
    cls = builder.text(facts["class"][0].value) if facts.get("class") else ""
    if cls not in CHANGES:
        raise NotExpressibleError(first, f"the temporary change {name} of the class '{cls}'")
    if name in builder.events:
        raise NotExpressibleError(first, f"a second event of the name {name}")
    node = builder.node(name, cls)
    builder.put(node, "has_name", name)
    for link in ("who", "element"):
        for property_ in facts.get(link, ()):
            target = builder.text(property_.value)
            if (link == "element") != (elements.get(target) == name):
                raise NotExpressibleError(property_, f"{target} as {link} of {name}")
            builder.put(node, f"has_{link}", builder.entity(property_.value, property_))
    for link in ("on_lane", "closes_lane"):
        for property_ in facts.get(link, ()):
            builder.put(node, link, _lane(builder, property_))
    for property_ in facts.get("on_road", ()):
        road_id = builder.text(property_.value)
        if road_id not in builder.roads.roads_by_id:
            raise NotExpressibleError(property_, f"the road {road_id}, which the map lacks,")
        builder.put(node, "on_road", builder.iri(road_name(road_id)))
    for property_ in facts.get("time", ())[:1]:
        builder.put(node, "has_time", as_number(builder, property_.value, property_))
    builder.put(scenario, "has_event", node)


def _lane(builder: StoryBuilder, property_: osc.Property) -> ox.NamedNode:
    text = builder.text(property_.value)
    try:
        road_id, lane_id, start = text.split()
        road = builder.roads.road(unquote(road_id))
        s = float(start)
        lane_at(road, int(lane_id), s)
        return builder.iri(lane_name(road.id, section_index(road, s), int(lane_id)))
    except (ValueError, InputError):
        raise NotExpressibleError(
            property_, f"the lane '{text[:40]}', which the map lacks,"
        ) from None
