"""OpenSCENARIO2OWL, its check: contents of a file that its individuals, written again, lack."""

from collections.abc import Callable, Iterator
from dataclasses import replace
from functools import partial

from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import Element, rewritten
from bridgegen.openx.openscenario.to_owl.build import Lost, StoryBuilder
from bridgegen.openx.openscenario.to_owl.differences import Differences
from bridgegen.openx.openscenario.to_owl.events import Happening

Compare = Callable[[Element, Element | None], Iterator[Lost]]


def losses(
    builder: StoryBuilder,
    again: osc.OpenScenario,
    controllers: list[str],
    stated: list[Happening],
) -> Iterator[Lost]:
    """Yield lines of a file, and what stands there that is lost.

    What was not stated at all, and is a problem already, is not named again.

    Args:
        builder: of the individuals.
        again: the file that they make.
        controllers: names of the controllers that are stated.
        stated: events that are.
    """
    here = builder.scenario_file
    compare = Differences(parameters.values(here), parameters.values(again)).between
    if here.file_header.license is not None:
        yield Lost(here.file_header.license.line, "License", is_detail=True)
    if here.file_header.properties is not None:
        yield from compare(here.file_header.properties, again.file_header.properties)
    declared = {
        parameter_declaration.name: parameter_declaration
        for parameter_declaration in _declarations(again)
    }
    for declaration in _declarations(here):
        yield from compare(declaration, declared.get(declaration.name))
    if here.road_network.scene_graph_file is not None:
        yield Lost(here.road_network.scene_graph_file.line, "SceneGraphFile", is_detail=True)
    for element in _unsaid(builder, here):
        yield from compare(element, None)
    others = {
        str(traffic_signal_controller.name): traffic_signal_controller
        for traffic_signal_controller in _controllers(again)
    }
    for controller in _controllers(here):
        if (name := builder.text(controller.name)) in controllers:
            yield from compare(controller, others.get(name))
    entities = {str(obj.name): obj for obj in again.entities.scenario_objects}
    for entity in here.entities.scenario_objects:
        if (name := builder.text(entity.name)) in builder.cast:
            yield from compare(entity, entities.get(name))
    yield from _in_init(builder, compare, again.storyboard.init.actions)
    yield from _in_events(builder, compare, again, stated)
    stop = here.storyboard.stop_trigger
    if stop is not None:  # it says when one looks no further
        for lost in compare(stop, again.storyboard.stop_trigger):
            yield lost._replace(is_detail=True)


def _unsaid(builder: StoryBuilder, here: osc.OpenScenario) -> Iterator[Element]:
    """Yield the parts of a file that no individual stands for."""
    variables = None if builder.variables else here.variable_declarations
    parts = (variables, here.monitor_declarations, here.road_network.used_area)
    yield from (part for part in parts if part is not None)
    yield from here.entities.entity_selections
    yield from here.storyboard.init.actions.user_defined_actions


def _in_init(builder: StoryBuilder, compare: Compare, there: osc.InitActions) -> Iterator[Lost]:
    here = builder.scenario_file.storyboard.init.actions
    left = list(there.global_actions)
    for global_action in here.global_actions:
        fitting = [other for other in left if not any(compare(global_action, other))] or [
            other
            for other in left
            if isinstance(other.action, osc.EnvironmentAction)
            and isinstance(global_action.action, osc.EnvironmentAction)
        ]
        if fitting:
            left.remove(fitting[0])
            yield from compare(global_action, fitting[0])
        else:
            yield Lost(global_action.line, f"{type(global_action.action).__name__} of Init")
    actions = {str(item.entity_ref): item.private_actions for item in there.privates}
    for private in here.privates:
        name = builder.text(private.entity_ref)
        again = {_kind(action): action for action in actions.get(name, ())}
        for action in private.private_actions:
            if (other := again.pop(_kind(action), None)) is not None:
                yield from compare(action, other)


def _in_events(
    builder: StoryBuilder, compare: Compare, again: osc.OpenScenario, stated: list[Happening]
) -> Iterator[Lost]:
    events = {
        str(event.name): event
        for story in again.storyboard.stories
        for act in story.acts
        for group in act.maneuver_groups
        for maneuver in group.maneuvers
        for event in maneuver.events
    }
    for happening in stated:
        count = happening.group.maximum_execution_count
        if count != 1:
            yield Lost(happening.group.line, f'maximumExecutionCount="{count}" of ManeuverGroup')
        if (event := events.get(happening.name)) is not None:
            yield from compare(rewritten(happening.event, partial(_called, builder)), event)


def _called(builder: StoryBuilder, element: Element) -> Element:
    """Return a condition that calls the storyboard's element as it is called once it is stated."""
    if not isinstance(element, osc.StoryboardElementStateCondition):
        return element
    kind, name = element.storyboard_element_type, element.storyboard_element_ref
    found = builder.element_names.get((builder.text(kind), builder.text(name)))
    return replace(element, storyboard_element_ref=found) if found else element


def _kind(action: osc.PrivateAction) -> str:
    """Return what an init action is, as the standard's innermost element names it."""
    inner = action.action
    if isinstance(inner, osc.LongitudinalAction | osc.LateralAction | osc.RoutingAction):
        return type(inner.action).__name__
    return type(inner).__name__


def _declarations(scenario: osc.OpenScenario) -> tuple[osc.ParameterDeclaration, ...]:
    declared = scenario.parameter_declarations
    return () if declared is None else declared.parameters


def _controllers(scenario: osc.OpenScenario) -> tuple[osc.TrafficSignalController, ...]:
    signals = scenario.road_network.traffic_signals
    return () if signals is None else signals.controllers
