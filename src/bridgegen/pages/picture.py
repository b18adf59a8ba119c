"""A scenario's individuals as a picture of five columns: boxes, their contents, links.

A box is an individual that belongs to a layer, or an event (with its participant, in layer 4).
Individuals without a layer (actions, conditions, positions, routes) become phrases in the boxes
that refer to them; so do actions and conditions that have a layer. Parameters have no box: a value
that one gives shows its name and range.
"""

from collections.abc import Iterator, Mapping
from dataclasses import dataclass


@dataclass(frozen=True)
class Parameter:
    """A parameter of the search space.

    Attributes:
        name: its name.
        unit: its unit.
        low: lower end of its range; None if it is derived.
        high: upper end.
        formula: of a derived one; else empty.
    """

    name: str
    unit: str
    low: float | None
    high: float | None
    formula: str


@dataclass(frozen=True)
class Fact:
    """A line of a box.

    Attributes:
        label: what it is about; empty where the text is a sentence.
        text: the value with its unit, or words.
        bound: parameters that give values in it, and these values.
        wrong: whether a violated constraint is about it.
    """

    label: str
    text: str
    bound: tuple[tuple[str, float], ...] = ()
    wrong: bool = False


@dataclass(frozen=True)
class Reason:
    """A violated constraint.

    Attributes:
        about: the individual that violates it, and its property ("weather_fog (Fog): fog_density").
        text: one sentence: the individual, the value, the rule, why it holds, the source.
    """

    about: str
    text: str


@dataclass(frozen=True)
class Link:
    """A line from a box to another.

    Attributes:
        label: the properties on the way ("starts at, on lane").
        to: the other box's id.
    """

    label: str
    to: str


@dataclass(frozen=True)
class Box:
    """An individual.

    Attributes:
        id: the end of its IRI; unique in the picture.
        name: its label.
        cls: the label of its class.
        layer: 1 to 5, its column.
        facts: bound values and words first.
        links: to other boxes.
        broken: indices of its own violations among the picture's.
        shown: how many of its facts are shown at first; the rest on demand.
        inside: events whose participant it is.
    """

    id: str
    name: str
    cls: str
    layer: int
    facts: tuple[Fact, ...]
    links: tuple[Link, ...]
    broken: tuple[int, ...]
    shown: int
    inside: "tuple[Box, ...]" = ()


@dataclass(frozen=True)
class Picture:
    """A scenario, or a road network, in five columns.

    Attributes:
        name: the scenario's, or the road network's.
        facts: of the scenario itself, and the values that no other individual carries.
        boxes: the columns from left to right, by class in the ontology's order, then by name.
        parameters: those that give a value in a box, by name.
        violations: all of them.
        homeless: indices of the violations that concern no box.
        left_out: individuals that are in no box and in no phrase.
        checked: what was checked, in words.
    """

    name: str
    facts: tuple[Fact, ...]
    boxes: tuple[Box, ...]
    parameters: Mapping[str, Parameter]
    violations: tuple[Reason, ...]
    homeless: tuple[int, ...]
    left_out: tuple[str, ...]
    checked: str

    def all_boxes(self) -> Iterator[Box]:
        """Yield every box, nested ones included."""
        for box in self.boxes:
            yield box
            yield from box.inside
