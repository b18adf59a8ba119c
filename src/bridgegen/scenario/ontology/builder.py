"""Collecting statements: individuals, their values, and the parameters that give these.

The files beside this one define the individuals of a scenario, one per layer.
"""

import math
from collections.abc import Mapping
from typing import TYPE_CHECKING
from urllib.parse import quote

import numpy as np
import pyoxigraph as ox

from bridgegen.base.arrays import Float
from bridgegen.base.errors import OntologyError
from bridgegen.scenario.language.kinds import Kind
from bridgegen.scenario.language.parameters import Derived, Parameter
from bridgegen.scenario.ontology.site import Searched
from bridgegen.scenario.ontology.vocabulary import (
    NAMED_INDIVIDUAL,
    OWL_ONTOLOGY,
    SCENARIOS,
    TYPE,
    VERSION_INFO,
    bg,
    tbox,
)

if TYPE_CHECKING:
    from bridgegen.scenario.language.scenario import LogicalScenario


class Builder:
    """Collects quads; each method adds one individual with all that hangs on it."""

    def __init__(self, name: str, values: Mapping[str, float]) -> None:
        iri = SCENARIOS + quote(name, safe="")
        self.base = iri + "#"
        self.values = values
        header = ox.NamedNode(iri)
        made_with = ox.Literal(f"made with the BridgeGen ontology {tbox().version}")
        self.quads = [
            ox.Quad(header, TYPE, OWL_ONTOLOGY),
            ox.Quad(header, VERSION_INFO, made_with),
        ]
        self.bound: dict[str, set[str]] = {}
        self._bearers: dict[str, list[ox.NamedNode]] = {}
        self._free: set[tuple[ox.NamedNode, str]] = set()
        self.named: set[str] = set()

    def node(self, name: str, cls: str) -> ox.NamedNode:
        """Add an individual of a class.

        Raises:
            OntologyError: there is one of that name (an event called like a participant, say).
        """
        if name in self.named:
            raise OntologyError(f"'{name}' must name one thing only, got a second: {cls}")
        self.named.add(name)
        node = ox.NamedNode(self.base + name)
        self.quads.append(ox.Quad(node, TYPE, NAMED_INDIVIDUAL))
        self.quads.append(ox.Quad(node, TYPE, bg(cls)))
        return node

    def iri(self, name: str) -> ox.NamedNode:
        """Return the IRI of the individual of that name, whether it has been added or not."""
        return ox.NamedNode(self.base + name)

    def put(self, node: ox.NamedNode, name: str, value: str | int | float | ox.NamedNode) -> None:
        """State a value or a link; a float becomes an xsd:double."""
        term = value if isinstance(value, ox.NamedNode) else ox.Literal(value)
        self.quads.append(ox.Quad(node, bg(name), term))

    def quantity(self, node: ox.NamedNode, name: str, value: str | float) -> None:
        """State a number; one that a parameter gives, by name or measured, is bound to it."""
        if isinstance(value, str):
            self.put(node, name, float(self.values[value]))
            self.bind(node, name, value)
        else:
            self.put(node, name, float(value))
            if isinstance(value, Searched):
                self.bind(node, name, value.parameter)
            else:
                self._free.add((node, name))

    def count(self, node: ox.NamedNode, name: str, number: int, given: float | None) -> None:
        """State a whole number, bound to the parameter that gives it, if one does."""
        self.put(node, name, number)
        if isinstance(given, Searched):
            self.bind(node, name, given.parameter)

    def bind(self, node: ox.NamedNode, name: str, parameter: str) -> None:
        """Bind the value of a node's property to a parameter, where parameters are stated."""
        if not self.values:
            return
        self.put(node, "has_parameter", self.iri(f"p_{parameter}"))
        self.bound.setdefault(parameter, set()).add(name)
        self._bearers.setdefault(parameter, []).append(node)

    # -- scenario and parameters ---------------------------------------------------------------

    def scenario(self, scenario: "LogicalScenario") -> ox.NamedNode:
        """Add the scenario itself; what it consists of is linked by the caller."""
        node = self.node("scenario", "Scenario")
        self.put(node, "has_name", scenario.name)
        self.put(node, "has_duration", float(scenario.duration))
        self.put(node, "has_time_step", float(scenario.time_step))
        if scenario.road_end == "stand":
            self.put(node, "has_road_end", scenario.road_end)
        return node

    def parameter(self, name: str, parameter: Parameter | Derived) -> ox.NamedNode:
        """Add a parameter, after all that binds it.

        Raises:
            OntologyError: it is a category and gives a property; or it gives one property of an
                individual, and another one elsewhere that the same individual has from somewhere
                else: readers would take that for its own.
        """
        derived = isinstance(parameter, Derived)
        node = self.node(f"p_{name}", "DerivedParameter" if derived else "Parameter")
        self.put(node, "has_name", name)
        self.put(node, "has_axis", str(parameter.axis))
        self.put(node, "has_unit", parameter.unit)
        if isinstance(parameter, Derived):
            self.put(node, "has_expression", parameter.value.source)
        elif parameter.kind.names:
            self._category(node, name, parameter.kind)
        else:
            self.put(node, "has_low", float(parameter.low))
            self.put(node, "has_high", float(parameter.high))
        if name not in self.bound:  # no other individual carries its value, so it does
            self.quantity(node, "has_value", name)
        for property_name in sorted(self.bound[name]):
            self.put(node, "binds_property", property_name)
        if len(self.bound[name]) > 1:
            for bearer in self._bearers[name]:
                for other in sorted(self.bound[name]):
                    if (bearer, other) in self._free:
                        raise OntologyError(
                            f"{name} gives {other} of one individual, so it must give that of "
                            f"{bearer.value.removeprefix(self.base)}, too"
                        )
        return node

    def _category(self, node: ox.NamedNode, name: str, kind: Kind) -> None:
        """State the value of a category, which nothing but its parameter carries, and its names.

        Raises:
            OntologyError: it gives a property of an individual, which would be a number.
        """
        if name in self.bound:
            given = ", ".join(sorted(self.bound[name]))
            raise OntologyError(f"{name} is a category and gives no number, got {given}")
        for word in kind.names:
            self.put(node, "has_allowed_word", word)
        self.put(node, "has_word", kind.text(self.values[name], str))
        self.bind(node, "has_word", name)

    def explain(self, parameter: str, constraint: str) -> None:
        """Annotate a parameter, and the properties that carry its value, with a constraint."""
        self.put(self.iri(f"p_{parameter}"), "constraint", constraint)
        for name in sorted(self.bound[parameter]):
            self.quads.append(ox.Quad(bg(name), bg("constraint"), ox.Literal(constraint)))


# --- A participant's course (timed poses) as individuals ---


DIGITS = 9
"""Decimals of a course's metres and degrees: enough to write, read and run it unchanged."""


def rounded(course: Float) -> Float:
    """Return a course that its individuals, and the files made of them, give back to the last bit.

    Args:
        course: ``(V, 4)``: time [s], x, y [m], heading [rad].
    """
    degrees = np.round(np.degrees(course[:, 3]), DIGITS).tolist()
    headings = [math.radians(degree) for degree in degrees]  # as the files' reader does
    times, places = np.round(course[:, 0], DIGITS), np.round(course[:, 1:3], DIGITS)
    return np.column_stack((times, places, headings)) + 0.0


def add_course(builder: Builder, name: str, course: Float) -> ox.NamedNode:
    """Add the event by which a participant follows a course from the start on.

    Args:
        builder: where to.
        name: of the participant.
        course: ``(V, 4)``: time [s], x, y [m], heading [rad], rounded.
    """
    put = builder.put
    event = builder.node(f"{name}_course", "StoryboardEvent")
    put(event, "has_name", f"{name}_course")
    put(event, "has_who", builder.iri(name))
    action = builder.node(f"{name}_course_action", "FollowTrajectoryAction")
    put(event, "has_what", action)
    trajectory = builder.node(f"{name}_course_path", "Trajectory")
    put(action, "has_trajectory", trajectory)
    put(trajectory, "has_name", f"{name}_course_path")
    for number, (time, x, y, h) in enumerate(course.tolist(), start=1):
        vertex = builder.node(f"{name}_course_vertex_{number}", "Vertex")
        put(trajectory, "has_vertex", vertex)
        put(vertex, "has_index", number)
        put(vertex, "has_time", time)
        place = builder.node(f"{name}_course_point_{number}", "WorldPosition")
        put(vertex, "has_position", place)
        put(place, "has_world_x", x)
        put(place, "has_world_y", y)
        put(place, "has_world_yaw", round(math.degrees(h), DIGITS))
    begin = builder.node(f"{name}_course_trigger", "Trigger")
    condition = builder.node(f"{name}_course_start", "SimulationTimeCondition")
    put(condition, "has_value", 0.0)
    put(begin, "has_condition", condition)
    put(event, "has_when", begin)
    return event
