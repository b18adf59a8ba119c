"""Reading individuals: the questions that the converters and checks ask of a scenario's graph.

Answers depend on classes, properties and values only, never on how an individual's IRI is
spelled, so a file that was edited in Protégé reads like one that BridgeGen wrote.
"""

import math
from collections.abc import Iterable
from functools import cached_property

import pyoxigraph as ox

from bridgegen.base.errors import OntologyError
from bridgegen.scenario.ontology.vocabulary import (
    EQUIVALENT_CLASS,
    SUBCLASS,
    TYPE,
    XSD,
    Subject,
    bg,
    closure,
    local_name,
    tbox,
)

Value = ox.NamedNode | ox.BlankNode | ox.Literal | ox.Triple

_INTEGERS = frozenset(
    ox.NamedNode(XSD + name)
    for name in (
        "integer",
        "int",
        "long",
        "short",
        "byte",
        "nonNegativeInteger",
        "positiveInteger",
        "nonPositiveInteger",
        "negativeInteger",
        "unsignedInt",
        "unsignedLong",
        "unsignedShort",
        "unsignedByte",
    )
)
_NUMBERS = _INTEGERS | {ox.NamedNode(XSD + name) for name in ("double", "decimal", "float")}


class Individuals:
    """The individuals of one scenario, or of a road network alone. Immutable.

    Every reader takes a node and the local name of a property (``"has_length"``; a property that
    is declared equivalent answers too). A reader without ``optional_`` raises
    `bridgegen.base.errors.OntologyError`, naming individual and property, where there is no value;
    all of them raise it where there are several or the value is of another kind.

    Args:
        quads: the statements, without the ontology's own; classes that a user added may be among
            them.
    """

    def __init__(self, quads: Iterable[ox.Quad]) -> None:
        # A dict for distinct statements in the order of the file, which a set would lose.
        self.quads = tuple(dict.fromkeys(quads))

    @cached_property
    def store(self) -> ox.Store:
        """The statements as a store to put SPARQL queries to (a copy: adding changes nothing)."""
        store = ox.Store()
        store.extend(self.quads)
        return store

    def __len__(self) -> int:
        return len(self.quads)

    # -- which individuals there are -----------------------------------------------------------

    def of_class(self, name: str) -> list[Subject]:
        """Return the individuals of a class or of a class below it, ordered by name, then IRI."""
        found = {node for cls in self.subclasses(name) for node in self._of_type.get(cls, ())}
        # Always in one order: converters write what they are given, and the same individuals must
        # give the same bytes, whatever order Protégé saved them in.
        return sorted(found, key=lambda node: (self._name(node), node.value))

    def one(self, name: str) -> Subject:
        """Return the only individual of a class.

        Raises:
            OntologyError: there is no such individual, or there are several.
        """
        found = self.of_class(name)
        if len(found) != 1:
            names = ", ".join(self.describe(node) for node in found[:5])
            raise OntologyError(
                f"exactly one individual of class {name} is needed, got {len(found)}"
                + (f" ({names})" if found else "")
            )
        return found[0]

    def is_a(self, node: Subject, name: str) -> bool:
        """Return whether a node is of a class or of a class below it."""
        return any(node in self._of_type.get(cls, ()) for cls in self.subclasses(name))

    def subclasses(self, name: str) -> frozenset[ox.NamedNode]:
        """Return a class and all below it, those included that the file itself declares.

        Raises:
            KeyError: the ontology has no such class.
        """
        known = tbox().subclasses[bg(name)]
        if not self._own_parents:
            return known
        return known.union(*(closure(node, self._own_parents) for node in known))

    def find(self, iri: str) -> Subject | None:
        """Return the individual with this IRI (or this id, if anonymous), or None."""
        return self._by_iri.get(iri)

    def describe(self, node: Subject) -> str:
        """Return what to call a node in a message: its name and class, or the end of its IRI."""
        classes = sorted(local_name(cls) for cls in self._types.get(node, ()))
        name = self._name(node) or local_name(node)
        return f"{name} ({', '.join(classes)})" if classes else name

    # -- values --------------------------------------------------------------------------------

    def number(self, node: Subject, name: str) -> float:
        """Return a finite number; ``xsd:double``, ``decimal``, ``float`` and integers will do."""
        value = self.optional_number(node, name)
        if value is None:
            raise self._missing(node, name)
        return value

    def optional_number(self, node: Subject, name: str) -> float | None:
        """Return a number, or None where there is none."""
        literal = self._literal(node, name)
        if literal is None:
            return None
        value = as_number(literal)
        if value is None:
            raise self._wrong(node, name, "a finite number", literal)
        return value

    def integer(self, node: Subject, name: str) -> int:
        """Return a whole number; ``2.0`` will do."""
        value = self.optional_integer(node, name)
        if value is None:
            raise self._missing(node, name)
        return value

    def optional_integer(self, node: Subject, name: str) -> int | None:
        """Return a whole number, or None where there is none."""
        value = self.optional_number(node, name)
        if value is None:
            return None
        if value != int(value):
            raise self._wrong(node, name, "a whole number", value)
        return int(value)

    def text(self, node: Subject, name: str) -> str:
        """Return a text."""
        value = self.optional_text(node, name)
        if value is None:
            raise self._missing(node, name)
        return value

    def optional_text(self, node: Subject, name: str) -> str | None:
        """Return a text, or None where there is none."""
        literal = self._literal(node, name)
        return None if literal is None else literal.value

    def texts(self, node: Subject, name: str) -> list[str]:
        """Return all texts of a property that may have several, in alphabetical order."""
        values = self.values(node, name)
        return sorted(value.value for value in values if isinstance(value, ox.Literal))

    def link(self, node: Subject, name: str) -> Subject:
        """Return the individual that a property points to."""
        value = self.optional_link(node, name)
        if value is None:
            raise self._missing(node, name)
        return value

    def optional_link(self, node: Subject, name: str) -> Subject | None:
        """Return the individual that a property points to, or None."""
        found = self.links(node, name)
        if len(found) > 1:
            names = ", ".join(self.describe(other) for other in found)
            raise self._wrong(node, name, "one individual", names)
        return found[0] if found else None

    def links(self, node: Subject, name: str) -> list[Subject]:
        """Return the individuals that a property points to, ordered by name, then IRI."""
        found: list[Subject] = []
        for value in self.values(node, name):
            if not isinstance(value, ox.NamedNode | ox.BlankNode):
                raise self._wrong(node, name, "an individual", value)
            found.append(value)
        return sorted(found, key=lambda other: (self._name(other), other.value))

    def parameter(self, node: Subject, name: str) -> str | None:
        """Return the name of the parameter that the value of a property is bound to, or None."""
        spellings = {local_name(term) for term in _spellings(name)}
        found = {
            self.text(parameter, "has_name")
            for parameter in self.links(node, "has_parameter")
            if spellings.intersection(self.texts(parameter, "binds_property"))
        }
        if len(found) > 1:
            raise self._wrong(node, name, "bound to one parameter", ", ".join(sorted(found)))
        return found.pop() if found else None

    @cached_property
    def bindings(self) -> dict[str, list[tuple[Subject, str]]]:
        """Per parameter that is bound, the individuals and properties that carry its value."""
        found: dict[str, list[tuple[Subject, str]]] = {}
        for parameter in self.of_class("Parameter"):
            name = self._name(parameter)
            bound = self.texts(parameter, "binds_property")
            for node in self._bound_to.get(parameter, ()):
                for property_name in bound:
                    if self.values(node, property_name):
                        found.setdefault(name, []).append((node, property_name))
        return found

    def values(self, node: Subject, name: str) -> list[Value]:
        """Return whatever a property points to, in no particular order."""
        properties = self._index.get(node, {})
        found = [value for term in _spellings(name) for value in properties.get(term, ())]
        return list(dict.fromkeys(found))

    # -- inside --------------------------------------------------------------------------------

    @cached_property
    def _index(self) -> dict[Subject, dict[ox.NamedNode, list[Value]]]:
        index: dict[Subject, dict[ox.NamedNode, list[Value]]] = {}
        for subject, predicate, value, _ in self.quads:
            if isinstance(subject, Subject):
                index.setdefault(subject, {}).setdefault(predicate, []).append(value)
        return index

    @cached_property
    def _by_iri(self) -> dict[str, Subject]:
        return {node.value: node for node in self._index}

    @cached_property
    def _bound_to(self) -> dict[Value, list[Subject]]:
        """Per parameter, the individuals that have it."""
        found: dict[Value, list[Subject]] = {}
        for node, properties in self._index.items():
            for parameter in properties.get(bg("has_parameter"), ()):
                found.setdefault(parameter, []).append(node)
        return found

    @cached_property
    def _of_type(self) -> dict[Value, dict[Subject, None]]:
        """Per class, its own individuals (a dict for order and quick look-up)."""
        found: dict[Value, dict[Subject, None]] = {}
        for node, properties in self._index.items():
            for cls in properties.get(TYPE, ()):
                found.setdefault(cls, {})[node] = None
        return found

    @cached_property
    def _types(self) -> dict[Subject, list[ox.NamedNode]]:
        """Per individual, its classes, the syntax's own (owl:NamedIndividual) left out."""
        found: dict[Subject, list[ox.NamedNode]] = {}
        for cls, nodes in self._of_type.items():
            if isinstance(cls, ox.NamedNode) and not cls.value.startswith(_SYNTAX):
                for node in nodes:
                    found.setdefault(node, []).append(cls)
        return found

    @cached_property
    def _own_parents(self) -> list[tuple[ox.NamedNode, ox.NamedNode]]:
        """All pairs (class, superclass), where the file declares any besides the ontology's."""
        own = _subclass_pairs(self.quads)
        return own and own + _subclass_pairs(tbox().quads)

    def _name(self, node: Subject) -> str:
        for value in self._index.get(node, {}).get(bg("has_name"), ()):
            if isinstance(value, ox.Literal):
                return value.value
        return ""

    def _literal(self, node: Subject, name: str) -> ox.Literal | None:
        found = self.values(node, name)
        if not found:
            return None
        if len(found) > 1:
            shown = ", ".join(sorted(local_value(value) for value in found))
            raise self._wrong(node, name, "one value", shown)
        if not isinstance(found[0], ox.Literal):
            raise self._wrong(node, name, "a value", found[0])
        return found[0]

    def _missing(self, node: Subject, name: str) -> OntologyError:
        unit = tbox().units.get(name)
        what = f"{name} [{unit}]" if unit else name
        return OntologyError(f"{self.describe(node)} must have {what}, and has none")

    def _wrong(self, node: Subject, name: str, rule: str, got: object) -> OntologyError:
        unit = tbox().units.get(name)
        shown = local_value(got) if isinstance(got, ox.Literal | ox.NamedNode) else str(got)
        what = f"{name} [{unit}]" if unit else name
        return OntologyError(f"{what} of {self.describe(node)} must be {rule}, got {shown}")


_SYNTAX = "http://www.w3.org/"


def as_number(literal: ox.Literal) -> float | None:
    """Return a literal's value if it is a finite number, of whatever numeric datatype."""
    try:
        value = float(literal.value) if literal.datatype in _NUMBERS else math.nan
    except ValueError:
        return None
    return value if math.isfinite(value) else None


def local_value(value: object) -> str:
    """Return a value as people write it: a literal's text, an IRI's last part."""
    if isinstance(value, ox.Literal):
        number = value.datatype in _NUMBERS
        return value.value if number else f"'{value.value}'"
    return local_name(value)


def _spellings(name: str) -> tuple[ox.NamedNode, ...]:
    return tbox().equivalents.get(name) or (bg(name),)


def _subclass_pairs(quads: Iterable[ox.Quad]) -> list[tuple[ox.NamedNode, ox.NamedNode]]:
    pairs: list[tuple[ox.NamedNode, ox.NamedNode]] = []
    for child, predicate, parent, _ in quads:
        if isinstance(child, ox.NamedNode) and isinstance(parent, ox.NamedNode):
            if predicate in (SUBCLASS, EQUIVALENT_CLASS):
                pairs.append((child, parent))
            if predicate == EQUIVALENT_CLASS:
                pairs.append((parent, child))
    return pairs
