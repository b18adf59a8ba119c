"""The terms of ``bridgegen.owl``: their IRIs, and what the ontology says about them.

Code refers to a term by its local name (``"has_length"``); `bg` makes the IRI of it.
"""

from collections.abc import Iterable, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import pyoxigraph as ox

ONTOLOGY = "https://w3id.org/bridgegen"
BG = ONTOLOGY + "#"
SCENARIOS = ONTOLOGY + "/scenarios/"
"""Each scenario's individuals live in a namespace of their own below this."""

OWL = "http://www.w3.org/2002/07/owl#"
RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS = "http://www.w3.org/2000/01/rdf-schema#"
XSD = "http://www.w3.org/2001/XMLSchema#"
DCTERMS = "http://purl.org/dc/terms/"
PREFIXES = {"bg": BG, "dcterms": DCTERMS, "owl": OWL, "rdfs": RDFS, "xsd": XSD}

Subject = ox.NamedNode | ox.BlankNode

TYPE = ox.NamedNode(RDF + "type")
LABEL = ox.NamedNode(RDFS + "label")
COMMENT = ox.NamedNode(RDFS + "comment")
SUBCLASS = ox.NamedNode(RDFS + "subClassOf")
DOMAIN = ox.NamedNode(RDFS + "domain")
RANGE = ox.NamedNode(RDFS + "range")
DOUBLE = ox.NamedNode(XSD + "double")
INTEGER = ox.NamedNode(XSD + "integer")
NAMED_INDIVIDUAL = ox.NamedNode(OWL + "NamedIndividual")
OWL_ONTOLOGY = ox.NamedNode(OWL + "Ontology")
VERSION_INFO = ox.NamedNode(OWL + "versionInfo")
EQUIVALENT_CLASS = ox.NamedNode(OWL + "equivalentClass")
EQUIVALENT_PROPERTY = ox.NamedNode(OWL + "equivalentProperty")


@cache
def bg(name: str) -> ox.NamedNode:
    """Return the IRI of the term with this local name."""
    return ox.NamedNode(BG + name)


def local_name(node: object) -> str:
    """Return the part of an IRI after its last ``#`` or ``/``, as people call it."""
    text = node.value if isinstance(node, ox.NamedNode | ox.BlankNode) else str(node)
    return text.rstrip("#/").replace("/", "#").rpartition("#")[2]


@dataclass(frozen=True)
class TBox:
    """The ontology without individuals, as read from ``bridgegen.owl``.

    Attributes:
        quads: all of it but its own header, in the order of the file.
        version: its ``owl:versionInfo``.
        subclasses: per class, the class itself and all below it.
        equivalents: per property that has any, all that mean the same.
        requires: per class, the properties that its individuals must have, besides inherited ones.
        ranges: per property, its range: a class or a datatype.
        domains: per property, the class that it belongs to.
        units: per data property with a unit, the unit.
        labels: per term, what people call it.
        comments: per term, what it means.
        layers: per class that says so, its layer, 1 to 5; the others have that of a superclass.
        functional: the properties that have at most one value.
        above: per data property whose values must exceed something, that.
        allowed: per data property with an enumeration, its values.
    """

    quads: tuple[ox.Quad, ...]
    version: str
    subclasses: Mapping[ox.NamedNode, frozenset[ox.NamedNode]]
    equivalents: Mapping[str, tuple[ox.NamedNode, ...]]
    requires: Mapping[str, tuple[str, ...]]
    ranges: Mapping[str, ox.NamedNode]
    domains: Mapping[str, str]
    units: Mapping[str, str]
    labels: Mapping[str, str]
    comments: Mapping[str, str]
    layers: Mapping[str, int]
    functional: frozenset[str]
    above: Mapping[str, float]
    allowed: Mapping[str, tuple[str, ...]]


@cache
def tbox() -> TBox:
    """Read ``bridgegen.owl``, once a process."""
    data = files("bridgegen.ontology").joinpath("bridgegen.owl").read_bytes()
    everything = list(ox.parse(data, format=ox.RdfFormat.RDF_XML))
    header = ox.NamedNode(ONTOLOGY)
    quads = tuple(quad for quad in everything if quad.subject != header)
    said: dict[ox.NamedNode, list[tuple[Subject, ox.NamedNode | ox.Literal]]] = {}
    for quad in everything:
        if isinstance(quad.subject, Subject) and isinstance(quad.object, ox.NamedNode | ox.Literal):
            said.setdefault(quad.predicate, []).append((quad.subject, quad.object))

    def links(predicate: ox.NamedNode) -> list[tuple[ox.NamedNode, ox.NamedNode]]:
        return [
            (a, b)
            for a, b in said.get(predicate, ())
            if isinstance(a, ox.NamedNode) and isinstance(b, ox.NamedNode)
        ]

    def texts(predicate: ox.NamedNode) -> dict[str, tuple[str, ...]]:
        found: dict[str, tuple[str, ...]] = {}
        for node, value in said.get(predicate, ()):
            if isinstance(value, ox.Literal):
                found[local_name(node)] = (*found.get(local_name(node), ()), value.value)
        return found

    def first(predicate: ox.NamedNode) -> dict[str, str]:
        return {name: values[0] for name, values in texts(predicate).items()}

    parents = links(SUBCLASS)
    types = links(TYPE)
    classes = [node for node, cls in types if cls == ox.NamedNode(OWL + "Class")]
    subclasses = {node: closure(node, parents) for node in classes}
    needed = links(bg("requires"))
    equal = links(EQUIVALENT_PROPERTY)
    return TBox(
        quads=quads,
        version=first(VERSION_INFO)[local_name(header)],
        subclasses=subclasses,
        equivalents={local_name(term): pair for pair in equal for term in pair},
        requires={
            local_name(cls): names
            for cls in classes
            if (names := tuple(local_name(term) for owner, term in needed if owner == cls))
        },
        ranges={local_name(term): target for term, target in links(RANGE)},
        domains={local_name(term): local_name(cls) for term, cls in links(DOMAIN)},
        units=first(bg("unit")),
        labels=first(LABEL),
        comments=first(COMMENT),
        layers={name: int(text) for name, text in first(bg("layer")).items()},
        functional=frozenset(
            local_name(term)
            for term, cls in types
            if cls == ox.NamedNode(OWL + "FunctionalProperty")
        ),
        above={name: float(text) for name, text in first(bg("above")).items()},
        allowed=texts(bg("allows")),
    )


def closure(
    top: ox.NamedNode, parents: Iterable[tuple[ox.NamedNode, ox.NamedNode]]
) -> frozenset[ox.NamedNode]:
    """Return ``top`` and every class below it.

    Args:
        top: a class.
        parents: pairs (class, its superclass); circles are no trouble.
    """
    below: dict[ox.NamedNode, list[ox.NamedNode]] = {}
    for child, parent in parents:
        below.setdefault(parent, []).append(child)
    found = {top}
    todo = [top]
    while todo:
        for child in below.get(todo.pop(), ()):
            if child not in found:
                found.add(child)
                todo.append(child)
    return frozenset(found)
