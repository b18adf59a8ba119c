"""What is wrong with a scenario beyond its syntax: references, ranges, and places on the map."""

import math
from collections.abc import Iterator
from typing import Any

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.lane_changes import plan_with_changes
from bridgegen.openx.opendrive.lanes import lane_pose
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters, references
from bridgegen.openx.openscenario.element import (
    FINITE,
    Attribute,
    Element,
    children_of,
    values_of,
    walk,
)
from bridgegen.openx.openscenario.values import Value

Problem = tuple[int, str]


def problems(scenario: osc.OpenScenario, road_network: OpenDrive | None = None) -> list[str]:
    """Return all that is wrong, one sentence each, with the line where the scenario was read.

    Checked: parameters; names that must differ; entities, parts of the storyboard and controllers
    of lights that are referred to; the standard's ranges; that actors are present when they act;
    and, on a road network, that every road and light is there, every lane position lies on a lane
    and every route can be driven.

    Args:
        scenario: parameters are taken at their declared values.
        road_network: the one that its ``LogicFile`` names.
    """
    found = parameters.problems(scenario)
    if found:  # nothing can be resolved
        return found
    check = _Check(scenario, road_network)
    texts = [
        *check.names(),
        *check.attributes(),
        *check.actors(),
        *references.of_storyboard(scenario, check.value),
        *references.of_controllers(scenario, road_network, check.value),
        *(check.places() if road_network is not None else ()),
        *(references.of_map(scenario, road_network, check.value) if road_network else ()),
    ]
    texts = sorted(dict.fromkeys(texts), key=lambda problem: problem[0])
    return [f"{text} (line {line})" if line else text for line, text in texts]


class _Check:
    """A scenario with the values of its parameters."""

    def __init__(self, scenario: osc.OpenScenario, road_network: OpenDrive | None) -> None:
        self.scenario = scenario
        self.road_network = road_network
        self.values = parameters.values(scenario)
        self.numbers = parameters.numbers(scenario)
        self.entities = [
            str(self.value(node.name))
            for node in walk(scenario.entities)
            if isinstance(node, osc.ScenarioObject)
        ]

    def value(self, value: Value) -> Any:
        """Return a value at the declared values of the parameters."""
        if isinstance(value, osc.Expr):
            return float(value.resolve(self.numbers))
        return self.values[value.name] if isinstance(value, osc.ParameterRef) else value

    def names(self) -> Iterator[Problem]:
        """Yield names that two elements of one kind beside each other share, if they are needed.

        Those are the names by which a file may refer to something; of the storyboard's parts, and
        of the phases of lights, only those by which it does.
        """
        parts = dict.fromkeys(references.PARTS, references.to_storyboard(self.scenario, self.value))
        needed = parts | {"Phase": references.to_phases(self.scenario, self.value)}
        for element in walk(self.scenario):
            seen: set[tuple[str, Any]] = set()
            for tag, child in children_of(element):
                name = getattr(child, "name", None)
                if name is None or tag not in references.NAMED:
                    continue
                name = self.value(name)
                if tag in needed and name not in needed[tag]:
                    continue
                if (tag, name) in seen:
                    yield child.line, f"the name of a {tag} must be its own, got '{name}' twice"
                seen.add((tag, name))

    def attributes(self) -> Iterator[Problem]:
        """Yield entities that do not exist, and numbers outside the standard's ranges."""
        for element in walk(self.scenario):
            for attribute, raw in values_of(element):
                value = self.value(raw)
                what = f"{attribute.name} of {type(element).__name__}"
                if attribute.is_entity and value not in self.entities:
                    known = ", ".join(self.entities) or "none"
                    yield element.line, f"{what} must be one of {known}, got '{value}'"
                elif attribute.kind.is_number and not (
                    _in_range(attribute, value) or self.is_rate(element)
                ):
                    given = (
                        f"{raw} = {value:g}"
                        if isinstance(raw, osc.ParameterRef | osc.Expr)
                        else f"{value:g}"
                    )
                    yield element.line, f"{what} must {_range_text(attribute)}, got {given}"
                elif isinstance(raw, osc.Expr) and (rule := _out_of_type(attribute, value)):
                    yield element.line, f"{what} must {rule}, got {raw} = {value:g}"

    def is_rate(self, element: Element) -> bool:
        """Return whether an element's number is a rate, whose sign says no more than the target."""
        return isinstance(element, osc.TransitionDynamics) and (
            self.value(element.dynamics_dimension) == osc.DynamicsDimension.RATE
        )

    def actors(self) -> Iterator[Problem]:
        """Yield maneuver groups whose private actions have no actor."""
        for group in walk(self.scenario):
            if isinstance(group, osc.ManeuverGroup) and not group.actors.entity_refs:
                private = any(isinstance(below, osc.PrivateAction) for below in walk(group))
                if private and not self.value(group.actors.select_triggering_entities):
                    yield group.line, f"the actions of ManeuverGroup {group.name} must have actors"

    def places(self) -> Iterator[Problem]:
        """Yield lane positions off the map, and routes that cannot be driven."""
        roads = self.road_network
        assert roads is not None
        found: dict[int, tuple[str, int, float]] = {}  # by identity: equal ones may stand apart
        for element in walk(self.scenario):
            if isinstance(element, osc.LanePosition):
                try:
                    place = self.place(element)
                    lane_pose(roads.road(place[0]), place[1], place[2])
                    if place[1]:  # where lanes lead
                        found[id(element)] = place
                except InputError as error:
                    yield element.line, f"LanePosition: {error}"
        for element in walk(self.scenario):
            if isinstance(element, osc.Route):
                stops = [id(waypoint.position.position) for waypoint in element.waypoints]
                if all(stop in found for stop in stops):
                    try:
                        plan_with_changes(roads, [found[stop] for stop in stops])
                    except InputError as error:
                        yield element.line, f"Route {element.name}: {error}"

    def place(self, position: osc.LanePosition) -> tuple[str, int, float]:
        """Return road id, lane id and s [m] of a lane position.

        Raises:
            InputError: the lane's id is not a whole number.
        """
        lane_id = str(self.value(position.lane_id))
        try:
            return str(self.value(position.road_id)), int(lane_id), self.value(position.s)
        except ValueError:
            raise InputError(f"laneId must be a whole number, got '{lane_id}'") from None


def _in_range(attribute: Attribute, value: float) -> bool:
    limits = attribute.limits
    if limits is None:
        return not math.isnan(value)
    is_above = limits.low < value if limits.above else limits.low <= value
    return is_above and value <= limits.high


def _out_of_type(attribute: Attribute, value: float) -> str | None:
    """Return the rule of its type that an expression's value breaks, if it breaks one."""
    if not attribute.kind.is_number:
        return None
    if not math.isfinite(value):
        return "be finite"
    whole = attribute.kind.whole
    if whole is not None and not whole[0] <= value <= whole[1]:
        return f"be of type {attribute.kind.value}, {whole[0]} to {whole[1]}"
    return None


def _range_text(attribute: Attribute) -> str:
    limits = attribute.limits
    if limits is None:
        return "be a number"
    if limits.low == -FINITE:
        return "be finite"
    least = f"{'above' if limits.above else 'at least'} {limits.low:g}"
    if math.isinf(limits.high):
        return f"be {least}"
    if limits.high == FINITE:
        return f"be {least} and finite"
    return f"be {limits.low:g} to {limits.high:g}"
