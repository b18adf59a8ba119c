"""The structure of individuals: kind, number and range of values; what a class must have.

What ``bridgegen.owl`` declares makes two checks: SHACL shapes, which say what is wrong, and
`Structure`, which sees in a fraction of their time that nothing is.
"""

import re
from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache

import pyoxigraph as ox

from bridgegen.scenario.ontology.vocabulary import SUBCLASS, TYPE, XSD, bg, tbox

Node = ox.NamedNode | ox.BlankNode | ox.Triple
_Value = Node | ox.Literal

_SURELY = {
    XSD + "double": re.compile(r"[+-]?[0-9]+([.][0-9]+)?([eE][+-]?[0-9]+)?"),
    XSD + "integer": re.compile(r"[+-]?[0-9]+"),
    XSD + "string": re.compile(r".*", re.DOTALL),
}
"""What is surely in a datatype's lexical space, if not all of it."""


@dataclass(frozen=True)
class PropertyShape:
    """What the values of one property must be, on any individual that has it.

    Attributes:
        name: local name of the property.
        kind: datatype or class of the values.
        single: whether there is one value at most.
        above: what values must exceed, or None.
        allowed: the values of an enumeration; empty if any will do.
    """

    name: str
    kind: ox.NamedNode
    single: bool
    above: float | None
    allowed: tuple[str, ...]

    @property
    def is_data(self) -> bool:
        """Whether values are literals."""
        return self.kind.value.startswith(XSD)

    def turtle(self) -> str:
        """Return the shape in SHACL."""
        facts = [f"sh:{'datatype' if self.is_data else 'class'} <{self.kind.value}>"]
        if self.single:
            facts.append("sh:maxCount 1")
        if self.above is not None:
            facts.append(f'sh:minExclusive "{self.above!r}"^^xsd:double')
        if self.allowed:
            facts.append(f"sh:in ( {' '.join(map(quoted, self.allowed))} )")
        return (
            f":property-{self.name} a sh:PropertyShape ; sh:targetSubjectsOf bg:{self.name} ; "
            f"sh:path bg:{self.name} ; {' ; '.join(facts)} ."
        )

    def surely_holds(self, values: Mapping[Node, set[_Value]], structure: "Structure") -> bool:
        """Return whether values surely are as they must be.

        Args:
            values: of each individual that has the property.
            structure: of all individuals.
        """
        if self.single and any(len(found) > 1 for found in values.values()):
            return False
        found = set().union(*values.values())
        if not self.is_data:
            return found <= structure.instances(self.kind)
        return all(isinstance(one, ox.Literal) and self._surely_takes(one) for one in found)

    def _surely_takes(self, value: ox.Literal) -> bool:
        text = value.value
        known = _SURELY.get(self.kind.value)
        if value.datatype != self.kind or known is None or not known.fullmatch(text):
            return False
        if self.allowed and text not in self.allowed:
            return False
        return self.above is None or float(text) > self.above


@cache
def property_shapes() -> tuple[PropertyShape, ...]:
    """Return the shapes of all properties with a range.

    One shape per property instead of one per class: pyshacl looks at all individuals at once then,
    which takes it half the time.
    """
    ontology = tbox()
    return tuple(
        PropertyShape(
            name,
            kind,
            name in ontology.functional,
            ontology.above.get(name),
            ontology.allowed.get(name, ()),
        )
        for name, kind in ontology.ranges.items()
    )


@cache
def requirements() -> tuple[tuple[str, str], ...]:
    """Return (class, property) where each individual of the class must have a value."""
    needed = tbox().requires.items()
    return tuple((cls, name) for cls, names in needed for name in names)


def required_turtle(cls: str, name: str) -> str:
    """Return the shape, in SHACL, that each individual of a class has a value of a property."""
    return (
        f":{cls}-{name} a sh:PropertyShape ; sh:targetClass bg:{cls} ; "
        f"sh:path bg:{name} ; sh:minCount 1 ."
    )


def quoted(text: str) -> str:
    """Return a string literal in Turtle."""
    escaped = text.replace("\\", "\\\\").replace('"', '\\"').replace("\n", "\\n")
    return '"' + escaped.replace("\r", "\\r") + '"'


class Structure:
    """Statements by property and by class.

    Args:
        quads: the individuals', without the ontology's own.
    """

    def __init__(self, quads: tuple[ox.Quad, ...]) -> None:
        self._values: dict[ox.NamedNode, dict[Node, set[_Value]]] = {}
        for subject, predicate, value, _ in quads:
            self._values.setdefault(predicate, {}).setdefault(subject, set()).add(value)
        self._of_type: dict[_Value, set[Node]] = {}
        for node, classes in self._values.get(TYPE, {}).items():
            for cls in classes:
                self._of_type.setdefault(cls, set()).add(node)
        self._instances: dict[ox.NamedNode, set[Node]] = {}

    def instances(self, cls: ox.NamedNode) -> set[Node]:
        """Return the individuals of a class and of those that the ontology has below it."""
        if cls not in self._instances:
            below = tbox().subclasses.get(cls, frozenset({cls}))
            found = (self._of_type.get(one, set()) for one in below)
            self._instances[cls] = set().union(*found)
        return self._instances[cls]

    def surely_holds(self, required: Iterable[tuple[str, str]]) -> bool:
        """Return whether all shapes of properties surely hold, and no required value is missing.

        Not sure of individuals that declare classes of their own.

        Args:
            required: (class, property), see `requirements`.
        """
        if SUBCLASS in self._values:
            return False
        for shape in property_shapes():
            values = self._values.get(bg(shape.name))
            if values and not shape.surely_holds(values, self):
                return False
        return all(
            self.instances(bg(cls)) <= self._values.get(bg(name), {}).keys()
            for cls, name in required
        )
