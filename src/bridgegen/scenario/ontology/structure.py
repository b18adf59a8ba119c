"""The structure of individuals: kind, number and range of values; what a class must have.

What ``bridgegen.owl`` declares makes two checks: SHACL shapes, which say what is wrong, and
`Structure`, which sees in a fraction of their time that nothing is.
"""

import re
from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache, cached_property

import pyoxigraph as ox

from bridgegen.scenario.ontology.graph import Individuals, as_number
from bridgegen.scenario.ontology.vocabulary import (
    EQUIVALENT_CLASS,
    LABEL,
    OWL,
    RDFS,
    SUBCLASS,
    TYPE,
    XSD,
    Subject,
    bg,
    local_name,
    tbox,
)

Node = ox.NamedNode | ox.BlankNode | ox.Triple
_Value = Node | ox.Literal

_SURELY = {
    XSD + "double": re.compile(r"[+-]?[0-9]+([.][0-9]+)?([eE][+-]?[0-9]+)?"),
    XSD + "integer": re.compile(r"[+-]?[0-9]+"),
    XSD + "string": re.compile(r".*", re.DOTALL),
}
"""Regular expressions of texts that are certainly in a datatype's lexical space, if not of all."""


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
        # "Surely" throughout: whatever is in doubt (a spelling of a number that is not plain, a
        # class of a user's own) is left to pyshacl, so the quick answer is never more lenient than
        # SHACL's.
        if self.single and any(len(found) > 1 for found in values.values()):
            return False
        found = set().union(*values.values())
        if not self.is_data:
            return found <= structure.instances(self.kind)
        return all(isinstance(node, ox.Literal) and self._surely_takes(node) for node in found)

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
            found = (self._of_type.get(node, set()) for node in below)
            self._instances[cls] = set().union(*found)
        return self._instances[cls]

    def surely_holds(self, required: Iterable[tuple[str, str]]) -> bool:
        """Return whether all shapes of properties surely hold, and no required value is missing.

        Not sure of individuals that declare classes of their own.

        Args:
            required: (class, property), see `requirements`.
        """
        # Classes of a user's own may be below ours, which is what a reasoner or pyshacl follows.
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


# --- The layer of an individual: that of its class, or of the nearest class above ---
# The annotation ``bg:layer`` defines it, in ``bridgegen.owl`` or in the file itself; no class is
# known here by its name, so that a new one finds its layer by itself.


LAYERS = {
    1: "Road network",
    2: "Traffic facilities",
    3: "Temporary changes",
    4: "Traffic participants",
    5: "Weather",
}
"""The layers of the operational design domain (paper, Section III-A)."""

Values = Mapping[ox.NamedNode, list[Subject | ox.Literal]]


class Members:
    """The individuals of a file, each with its statements, its class and its layer.

    Args:
        individuals: of a scenario or a road network.
    """

    def __init__(self, individuals: Individuals) -> None:
        self.individuals = individuals
        statements: dict[Subject, dict[ox.NamedNode, list[Subject | ox.Literal]]] = {}
        for subject, predicate, value, _ in individuals.quads:
            if isinstance(subject, Subject) and isinstance(value, Subject | ox.Literal):
                statements.setdefault(subject, {}).setdefault(predicate, []).append(value)
        self._statements = statements
        self.nodes = [node for node in statements if any(self.classes(node))]

    def values(self, node: Subject) -> Values:
        """Return all values of a node, per property."""
        return self._statements.get(node, {})

    def is_a(self, node: Subject, name: str) -> bool:
        """Return whether a node is of a class of the ontology, or of one below it."""
        return any(bg(name) in self._above(cls) for cls in self.classes(node))

    def class_of(self, node: Subject) -> ox.NamedNode:
        """Return the class of a node; where it has several, one that is below the others."""
        classes = sorted(self.classes(node), key=lambda cls: cls.value)
        return max(classes, key=lambda cls: len(self._above(cls)))

    def class_label(self, cls: ox.NamedNode) -> str:
        """Return what people call a class, as the ontology or the file labels it."""
        own = texts(self._statements.get(cls, {}).get(LABEL, ()))
        name = local_name(cls)
        return own[0] if own else tbox().labels.get(name, name)

    def layer(self, node: Subject) -> int | None:
        """Return the layer of a node, 1 to 5; None if none of its classes has one."""
        found = (self._layer_of_class(cls) for cls in self.classes(node))
        return next((layer for layer in found if layer is not None), None)

    def name(self, node: Subject) -> str:
        """Return what people call a node: its name, or the end of its IRI."""
        names = texts(self.values(node).get(bg("has_name"), ()))
        return names[0] if names else local_name(node)

    # -- classes -------------------------------------------------------------------------------

    def classes(self, node: Subject) -> Iterator[ox.NamedNode]:
        """Yield the classes of a node; the syntax's own (owl:NamedIndividual) are none."""
        for cls in self._statements.get(node, {}).get(TYPE, ()):
            if isinstance(cls, ox.NamedNode) and not cls.value.startswith((OWL, RDFS)):
                yield cls

    def _layer_of_class(self, cls: ox.NamedNode) -> int | None:
        for node in self._above(cls):
            for value in self._statements.get(node, {}).get(bg("layer"), ()):
                number = as_number(value) if isinstance(value, ox.Literal) else None
                if number in LAYERS:
                    return int(number)
            if node == bg(local_name(node)) and local_name(node) in tbox().layers:
                return tbox().layers[local_name(node)]
        return None

    def _above(self, cls: ox.NamedNode) -> list[ox.NamedNode]:
        """Return a class and all above it, the nearest first."""
        if cls not in self._known_above:
            found = [cls]
            for node in found:  # grows meanwhile
                found += [up for up in self._parents.get(node, ()) if up not in found]
            self._known_above[cls] = found
        return self._known_above[cls]

    @cached_property
    def _known_above(self) -> dict[ox.NamedNode, list[ox.NamedNode]]:
        return {}

    @cached_property
    def _parents(self) -> dict[ox.NamedNode, list[ox.NamedNode]]:
        parents: dict[ox.NamedNode, list[ox.NamedNode]] = {}
        for child, parent in _class_pairs((*tbox().quads, *self.individuals.quads)):
            parents.setdefault(child, []).append(parent)
        return parents


def _class_pairs(quads: Iterable[ox.Quad]) -> Iterator[tuple[ox.NamedNode, ox.NamedNode]]:
    for child, predicate, parent, _ in quads:
        if isinstance(child, ox.NamedNode) and isinstance(parent, ox.NamedNode):
            if predicate in (SUBCLASS, EQUIVALENT_CLASS):
                yield child, parent
            if predicate == EQUIVALENT_CLASS:
                yield parent, child


def texts(values: Iterable[object]) -> list[str]:
    """Return the texts among some values, numbers as they are written."""
    return [value.value for value in values if isinstance(value, ox.Literal)]
