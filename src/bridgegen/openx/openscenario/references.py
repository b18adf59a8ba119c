"""What a scenario refers to by name besides entities: is it there?

Source: ASAM OpenSCENARIO XML 1.3, sections 7.1 (names and references) and 9.3; a reference to a
part of the storyboard may begin with the names of the parts around it, each followed by ``::``.
"""

from collections.abc import Callable, Iterator
from typing import Any

from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import ROAD, Element, children_of, values_of, walk

Problem = tuple[int, str]
ValueOf = Callable[[Any], Any]
"""Function that returns a value at the declared values of the parameters."""

PARTS = ("Story", "Act", "ManeuverGroup", "Maneuver", "Event", "Action")
"""The storyboard's parts, by their tags."""

NAMED = frozenset(
    {
        *PARTS,
        *("ScenarioObject", "EntitySelection", "ObjectController"),
        *("VariableDeclaration", "MonitorDeclaration"),
        *("TrafficSignalController", "Phase"),
    }
)
"""The tags of all that a file may refer to by its name, besides parameters."""

_TAGS = {osc.StoryboardElementType(tag[0].lower() + tag[1:]): tag for tag in PARTS}


def to_storyboard(scenario: osc.OpenScenario, value_of: ValueOf) -> set[str]:
    """Return the names of the storyboard's parts that are referred to."""
    return {
        part
        for node in walk(scenario)
        if isinstance(node, osc.StoryboardElementStateCondition)
        for part in str(value_of(node.storyboard_element_ref)).split("::")
    }


def to_phases(scenario: osc.OpenScenario, value_of: ValueOf) -> set[str]:
    """Return the names of the phases of traffic lights that are referred to."""
    return {
        str(value_of(node.phase))
        for node in walk(scenario)
        if isinstance(
            node, osc.TrafficSignalControllerAction | osc.TrafficSignalControllerCondition
        )
    }


def of_storyboard(scenario: osc.OpenScenario, value_of: ValueOf) -> Iterator[Problem]:
    """Yield references to parts of the storyboard that it does not have."""
    wanted = [
        node for node in walk(scenario) if isinstance(node, osc.StoryboardElementStateCondition)
    ]
    if not wanted:
        return
    paths = list(_paths(scenario.storyboard, value_of))
    for condition in wanted:
        tag = _TAGS[osc.StoryboardElementType(value_of(condition.storyboard_element_type))]
        name = str(value_of(condition.storyboard_element_ref))
        names = tuple(name.split("::"))
        if not any(kind == tag and path[-len(names) :] == names for kind, path in paths):
            known = ", ".join(path[-1] for kind, path in paths if kind == tag) or "none"
            what = "storyboardElementRef of StoryboardElementStateCondition"
            yield (
                condition.line,
                f"{what} must name one of the elements {tag} {known}, got '{name}'",
            )


def _paths(
    element: Element, value_of: ValueOf, above: tuple[str, ...] = ()
) -> Iterator[tuple[str, tuple[str, ...]]]:
    for tag, child in children_of(element):
        if tag in PARTS:
            path = (*above, str(value_of(child.name)))  # type: ignore[attr-defined]
            yield tag, path
            yield from _paths(child, value_of, path)


def of_controllers(
    scenario: osc.OpenScenario, roads: OpenDrive | None, value_of: ValueOf
) -> Iterator[Problem]:
    """Yield references to controllers of lights, and to phases, that are declared nowhere."""
    signals = scenario.road_network.traffic_signals
    phases = {
        value_of(controller.name): {value_of(phase.name) for phase in controller.phases}
        for controller in (() if signals is None else signals.controllers)
    }
    on_map = set() if roads is None else {controller.id for controller in roads.controllers}
    for node in walk(scenario):
        if not isinstance(
            node, osc.TrafficSignalControllerAction | osc.TrafficSignalControllerCondition
        ):
            continue
        what, name = type(node).__name__, value_of(node.traffic_signal_controller_ref)
        if name in phases:
            if (phase := value_of(node.phase)) not in phases[name]:
                known = ", ".join(sorted(phases[name])) or "none"
                yield node.line, f"phase of {what} must be one of {known}, got '{phase}'"
        elif name not in on_map:
            known = ", ".join(sorted(phases)) or "none"
            said = f"must be one of {known}, got '{name}'"
            yield node.line, f"trafficSignalControllerRef of {what} {said}"


def of_map(scenario: osc.OpenScenario, roads: OpenDrive, value_of: ValueOf) -> Iterator[Problem]:
    """Yield roads and lights that the map does not have, and places beyond a road's end."""
    lights = {signal.id for road in roads.roads for signal in road.signals}
    for node in walk(scenario):
        what = type(node).__name__
        if isinstance(node, osc.TrafficSignalStateAction | osc.TrafficSignalCondition):
            if (name := value_of(node.name)) not in lights:
                yield node.line, f"name of {what} must be a light of the map, got '{name}'"
        elif isinstance(node, osc.TrafficSignalState):
            if (name := value_of(node.traffic_signal_id)) not in lights:
                said = f"must be a light of the map, got '{name}'"
                yield node.line, f"trafficSignalId of {what} {said}"
        elif not isinstance(node, osc.LanePosition):  # a lane's place is checked with its lane
            yield from _on_road(node, roads, value_of)


def _on_road(element: Element, roads: OpenDrive, value_of: ValueOf) -> Iterator[Problem]:
    for attribute, raw in values_of(element):
        if attribute.means is not ROAD:
            continue
        what, road_id = type(element).__name__, str(value_of(raw))
        road = roads.roads_by_id.get(road_id)
        if road is None:
            yield element.line, f"{what}: road '{road_id}' is not in the road network"
        elif (s := value_of(getattr(element, "s", None))) is not None and not s <= road.length:
            said = f"0 <= s [m] <= {road.length:g} must hold on road {road_id}, got s={s:g}"
            yield element.line, f"{what}: {said}"
