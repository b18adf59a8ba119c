"""OpenSCENARIO2OWL, its ground: individuals that are stated, taken back, bound to parameters."""

import math
import re
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import replace
from enum import StrEnum
from functools import partial
from typing import Any, NamedTuple, TypeVar
from urllib.parse import quote

import pyoxigraph as ox

from bridgegen.base.errors import InputError
from bridgegen.openx.opendrive.map_names import part_name
from bridgegen.openx.opendrive.model import OpenDrive
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario import parameters
from bridgegen.openx.openscenario.element import Element, rewritten, values_of, walk
from bridgegen.openx.openscenario.read import fragment_of
from bridgegen.openx.openscenario.resolve import part_resolved
from bridgegen.openx.openscenario.to_owl.legs import Stretch
from bridgegen.scenario.ontology.builder import Builder
from bridgegen.scenario.ontology.vocabulary import NAMED_INDIVIDUAL, TYPE, bg, tbox

E = TypeVar("E", bound=StrEnum)

_NO_REFERENCE = str.maketrans("", "", "${}")
_JUST_A_NAME = re.compile(r"\$\{[\s(]*\$([A-Za-z_][A-Za-z0-9_]*)[\s)]*\}")


class Lost(NamedTuple):
    """Something in a file for which the ontology has no words.

    Attributes:
        line: where it stands.
        text: what it is.
        is_detail: whether the same happens without it, as far as the simulator knows.
    """

    line: int
    text: str
    is_detail: bool = False


class NotExpressibleError(Exception):
    """Something for which the ontology has no words.

    Args:
        element: where it stands.
        text: what it is.
        is_detail: see `Lost`.
    """

    def __init__(self, element: Element, text: str, *, is_detail: bool = False) -> None:
        super().__init__(text)
        self.lost = Lost(element.line, text, is_detail)


class StoryBuilder(Builder):
    """Collects the statements of layers 3 to 5 of a file.

    Attributes:
        scenario_file: the file's model.
        roads: its map.
        legs: how distances count on roads that lead to the scenario's intersection, by their ids.
        variables: names of those that are stated.
        added: names of entities that the storyboard adds.
        starts: where participants start, by name.
        cast: entities that have been stated, by name.
        events: events that are, or will be, stated, by name.
        referred: events whose end the event that is being stated waits for.
        problems: what cannot be expressed.
        in_substance: whether an expression may be stated by the value that it has, and an element
            in OpenSCENARIO's own words (`quoted`).
        quoted_lines: of the elements that the ontology's words do not say in full.
        entities: names of all entities of the file.
        element_names: what the storyboard's elements that are stated will be called, by kind and
            name; empty where several have that name.
        acts: acts that begin later than the scenario, by name.
        bindings: nodes, their properties, and the parameters that give these.
        free: nodes and those of their properties that have numbers of their own.
        parameters: the individuals of the file's numeric parameters, by name.
    """

    def __init__(
        self,
        name: str,
        scenario: osc.OpenScenario,
        roads: OpenDrive,
        *,
        in_substance: bool = False,
        quoted_lines: frozenset[int] = frozenset(),
    ) -> None:
        self.scenario_file, self.roads = scenario, roads
        self.in_substance, self.quoted_lines = in_substance, quoted_lines
        self.legs: dict[str, Stretch] = {}
        self.numbers = parameters.numbers(scenario)
        self._constants = parameters.values(scenario)
        super().__init__(name, self.numbers)
        self.named.add("road_network")
        self._names: list[str] = []
        self.variables: set[str] = set()
        self.starts: dict[str, ox.NamedNode] = {}
        self.cast: dict[str, ox.NamedNode] = {}
        self.entities = {self.text(obj.name) for obj in scenario.entities.scenario_objects}
        self.added = {
            self.text(node.entity_ref)
            for story in scenario.storyboard.stories
            for node in walk(story)
            if isinstance(node, osc.EntityAction) and isinstance(node.action, osc.AddEntityAction)
        }
        self.acts: dict[str, ox.NamedNode] = {}
        self.element_names: dict[tuple[str, str], str] = {}
        self.events: dict[str, ox.NamedNode] = {}
        self.referred: set[str] = set()
        self.problems: list[Lost] = []
        self.bindings: list[tuple[ox.NamedNode, str, str]] = []
        self.free: list[tuple[ox.NamedNode, str]] = []
        self.parameters = {number: self.reserve(f"p_{number}") for number in self.numbers}
        self._lights = {
            signal.id: self.iri(part_name("signal", road.id, index))
            for road in reversed(roads.roads)
            for index, signal in reversed(list(enumerate(road.signals)))
            if signal.dynamic == "yes"
        }

    # -- individuals -------------------------------------------------------------------------------

    def reserve(self, name: str) -> ox.NamedNode:
        """Return the IRI of an individual to be; its name is changed where another one has it."""
        plain = wanted = quote(name, safe="")
        number = 1
        while wanted in self.named:
            number += 1
            wanted = f"{plain}_{number}"
        self.named.add(wanted)
        self._names.append(wanted)
        return self.iri(wanted)

    def state(self, node: ox.NamedNode, cls: str) -> ox.NamedNode:
        """State that an individual is, and what."""
        self.quads.append(ox.Quad(node, TYPE, NAMED_INDIVIDUAL))
        self.quads.append(ox.Quad(node, TYPE, bg(cls)))
        return node

    def node(self, name: str, cls: str) -> ox.NamedNode:
        """Add an individual; its name is changed where another one has it."""
        return self.state(self.reserve(name), cls)

    @contextmanager
    def attempt(self) -> Iterator[None]:
        """Take back what is stated within, and note the problem, where it proves unsayable."""
        mark = self.mark()
        try:
            yield
        except NotExpressibleError as error:
            self.problems.append(error.lost)
            self.take_back(mark)

    def mark(self) -> tuple[int, int, int, int]:
        """Return how much has been stated by now."""
        return len(self.quads), len(self._names), len(self.bindings), len(self.free)

    def take_back(self, mark: tuple[int, int, int, int]) -> None:
        """Take back what has been stated since a mark."""
        self.named.difference_update(self._names[mark[1] :])
        del self.quads[mark[0] :], self._names[mark[1] :]
        del self.bindings[mark[2] :], self.free[mark[3] :]

    # -- values ------------------------------------------------------------------------------------

    def text(self, value: osc.ParameterRef | str) -> str:
        """Return a text, at the parameters' values."""
        return parameters.text_of(self._constants, value)

    def choice(self, cls: type[E], value: Any) -> E:
        """Return a member of an enumeration, at the parameters' values."""
        return cls(self.text(value))

    def now(self, value: Any, element: Element) -> float:
        """Return a number, at the parameters' values.

        Raises:
            NotExpressibleError: it is not finite.
        """
        if isinstance(value, osc.ParameterRef | osc.Expr):
            value = value.resolve(self.numbers)
        number = float(value)
        if not math.isfinite(number):
            raise NotExpressibleError(element, f"the number {number} in {type(element).__name__}")
        return number

    def number(self, node: ox.NamedNode, name: str, value: Any, element: Element) -> None:
        """State a number; one that a parameter gives is bound to it.

        Raises:
            NotExpressibleError: not finite, out of the property's range; or an expression,
                unless its value will do.
        """
        value = simplest(value)
        if isinstance(value, osc.Expr) and value.names and not self.in_substance:
            raise NotExpressibleError(
                element, f"the expression {value} in {type(element).__name__}"
            )
        number = self.now(value, element)
        self.check(name, number, element)
        if isinstance(value, osc.ParameterRef):
            self.put(node, name, number)
            self.bind(node, name, value.name)
        else:
            self.put(node, name, number)
            self.free.append((node, name))

    def check(self, name: str, number: float, element: Element) -> None:
        """Make sure that a property may have a value.

        Raises:
            NotExpressibleError: it must be above some number, and is not.
        """
        least = tbox().above.get(name)
        if least is not None and not number > least:
            what, unit = name.removeprefix("has_"), tbox().units.get(name, "1")
            raise NotExpressibleError(
                element, f"a {what} [{unit}] of {number!r} in {type(element).__name__}"
            )

    def bind(self, node: ox.NamedNode, name: str, parameter: str) -> None:
        """Bind the value of a node's property to a parameter of the file."""
        self.put(node, "has_parameter", self.parameters[parameter])
        self.bindings.append((node, name, parameter))

    # -- what is referred to -----------------------------------------------------------------------

    def entity(self, name: osc.ParameterRef | str, element: Element) -> ox.NamedNode:
        """Return the individual of an entity.

        Raises:
            NotExpressibleError: there is none.
        """
        found = self.cast.get(self.text(name))
        if found is None:
            what = type(element).__name__
            raise NotExpressibleError(element, f"{what} of {name}, an entity that is not stated")
        return found

    def light(self, name: osc.ParameterRef | str, element: Element) -> ox.NamedNode:
        """Return the individual of a traffic light.

        Raises:
            NotExpressibleError: the map has none of that id.
        """
        found = self._lights.get(self.text(name))
        if found is None:
            what = type(element).__name__
            raise NotExpressibleError(
                element, f"{what} of {name}, a traffic light that the map lacks"
            )
        return found


def plain_name(name: str) -> str:
    """Return a name without what would make it a reference."""
    return name.translate(_NO_REFERENCE)


def simplest(value: Any) -> Any:
    """Return a reference for an expression that is nothing but one, and anything else as it is."""
    found = _JUST_A_NAME.fullmatch(value.text) if isinstance(value, osc.Expr) else None
    return osc.ParameterRef(f"${found[1]}") if found else value


def shortest(value: float, exact: float, back: Any) -> float:
    """Return the number of fewest digits near ``value`` that ``back`` turns into ``exact``.

    A sum that was rounded has no exact inverse; of all numbers that give it, people write the
    shortest. ``value`` itself where none is found.
    """
    for digits in range(17):
        candidate = round(value, digits)
        if back(candidate) == exact:
            return candidate
    return value


def numbered(count: int) -> list[str]:
    """Return the numbers from 1 so that names that end in them sort as they count."""
    width = len(str(count))
    return [f"{k:0{width}}" for k in range(1, count + 1)]


# --- OpenSCENARIO2OWL, what the ontology has no words for: kept in OpenSCENARIO's own, as XML ---
# An action, a condition or a position of a file of somebody else is then an individual that says
# whose it is and when, and what it is in the words of the standard. Nothing is lost, and it is
# written again as it was; the ontology's constraints see nothing of it.


ACTION, CONDITION, POSITION = (
    "OpenScenarioAction",
    "OpenScenarioCondition",
    "OpenScenarioPosition",
)
"""Ontology's classes of elements that are kept as text."""

_REFERRING = (
    osc.ParameterCondition
    | osc.TrafficSignalControllerCondition
    | osc.TrafficSignalControllerAction
    | osc.ParameterAction
    | osc.SetMonitorAction
)
"""Elements that name parts of the file which are not kept under their names."""


T = TypeVar("T")


def state_or_quote(
    builder: StoryBuilder,
    name: str,
    cls: str,
    element: Element,
    say: Callable[[], T],
    quote: Callable[[ox.NamedNode], T],
) -> T:
    """Return the individual of an element, in the ontology's words or else in OpenSCENARIO's.

    Args:
        builder: where to.
        name: of the individual, if it is quoted.
        cls: its class then.
        element: the element.
        say: states it in the ontology's words.
        quote: makes the same of the individual if it is quoted.

    Raises:
        NotExpressibleError: it can be neither said nor quoted, or is to be said in words only.
    """
    if not builder.in_substance:
        return say()
    if any(node.line in builder.quoted_lines for node in walk(element)):
        return quote(quoted(builder, name, cls, element))
    kept = builder.mark()
    try:
        return say()
    except NotExpressibleError as error:
        if error.lost.is_detail:
            raise
        builder.take_back(kept)
        try:
            return quote(quoted(builder, name, cls, element))
        except NotExpressibleError:
            raise error from None


def node_of(
    builder: StoryBuilder,
    name: str,
    cls: str,
    element: Element,
    say: Callable[[], ox.NamedNode],
) -> ox.NamedNode:
    """Return the individual of an element; see `state_or_quote`."""
    return state_or_quote(builder, name, cls, element, say, lambda node: node)


def quoted(builder: StoryBuilder, name: str, cls: str, element: Element) -> ox.NamedNode:
    """Return the individual of an element in OpenSCENARIO's words.

    Raises:
        NotExpressibleError: it names parts of the file that are not kept, or has no finite value.
    """
    try:
        plain = part_resolved(element, builder.scenario_file, "document")
        plain = rewritten(plain, partial(_renamed, builder))
    except InputError:
        raise NotExpressibleError(element, f"a value of {type(element).__name__}") from None
    for item in walk(plain):
        variable = getattr(item, "variable_ref", None)
        if isinstance(item, _REFERRING) or (variable and variable not in builder.variables):
            raise NotExpressibleError(element, type(item).__name__)
        for attribute, value in values_of(item):
            if attribute.is_entity and str(value) not in builder.entities:
                what = type(item).__name__
                raise NotExpressibleError(item, f"{what} of {value}, an entity that is not stated")
    try:
        text = fragment_of(plain)
    except (TypeError, ValueError):
        raise NotExpressibleError(element, type(element).__name__) from None
    node = builder.node(name, cls)
    builder.put(node, "has_openscenario", text)
    return node


def _renamed(builder: StoryBuilder, element: Element) -> Element:
    """Return an element that calls a part of the storyboard as it will be called.

    Raises:
        NotExpressibleError: the part will not be there, or several have its name.
    """
    if not isinstance(element, osc.StoryboardElementStateCondition):
        return element
    kind, name = str(element.storyboard_element_type), str(element.storyboard_element_ref)
    found = builder.element_names.get((kind, name))
    if not found:
        what = f"StoryboardElementStateCondition on {element.state} of the {kind} {name}"
        raise NotExpressibleError(element, what)
    if kind == "event":
        builder.referred.add(found)
    return replace(element, storyboard_element_ref=found)
