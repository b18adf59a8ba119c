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
SUBCLASS = ox.NamedNode(RDFS + "subClassOf")
RANGE = ox.NamedNode(RDFS + "range")
NAMED_INDIVIDUAL = ox.NamedNode(OWL + "NamedIndividual")
OWL_ONTOLOGY = ox.NamedNode(OWL + "Ontology")
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
        equivalents: per property that has any, all that mean the same, the paper's name first.
        requires: per class, the properties that its individuals must have, inherited ones included.
        ranges: per property, its range: a class or a datatype.
        units: per data property with a unit, the unit.
        functional: the properties that have at most one value.
    """

    quads: tuple[ox.Quad, ...]
    version: str
    subclasses: Mapping[ox.NamedNode, frozenset[ox.NamedNode]]
    equivalents: Mapping[str, tuple[ox.NamedNode, ...]]
    requires: Mapping[str, tuple[str, ...]]
    ranges: Mapping[str, ox.NamedNode]
    units: Mapping[str, str]
    functional: frozenset[str]


@cache
def tbox() -> TBox:
    """Read ``bridgegen.owl``, once a process."""
    data = files("bridgegen.ontology").joinpath("bridgegen.owl").read_bytes()
    everything = list(ox.parse(data, format=ox.RdfFormat.RDF_XML))
    header = ox.NamedNode(ONTOLOGY)
    quads = tuple(quad for quad in everything if quad.subject != header)
    version = ox.NamedNode(OWL + "versionInfo")
    parents = [(q.subject, q.object) for q in quads if q.predicate == SUBCLASS]
    classes = [
        q.subject for q in quads if q.predicate == TYPE and q.object == ox.NamedNode(OWL + "Class")
    ]
    subclasses = {node: closure(node, parents) for node in classes if _named(node)}
    own = [(q.subject, q.object) for q in quads if q.predicate == bg("requires")]
    equal = [(q.subject, q.object) for q in quads if q.predicate == EQUIVALENT_PROPERTY]
    return TBox(
        quads=quads,
        version=next(
            str(q.object.value)
            for q in everything
            if q.predicate == version and isinstance(q.object, ox.Literal)
        ),
        subclasses=subclasses,
        equivalents={
            local_name(one): (other, one)
            for pair in equal
            for one in pair
            for other in pair
            if one != other and _named(one) and _named(other)
        },
        requires={
            local_name(node): tuple(
                dict.fromkeys(
                    local_name(needed)
                    for owner, needed in own
                    if node in subclasses.get(owner, frozenset())
                )
            )
            for node in subclasses
        },
        ranges={
            local_name(q.subject): q.object
            for q in quads
            if q.predicate == RANGE and isinstance(q.object, ox.NamedNode)
        },
        units={
            local_name(q.subject): q.object.value
            for q in quads
            if q.predicate == bg("unit") and isinstance(q.object, ox.Literal)
        },
        functional=frozenset(
            local_name(q.subject)
            for q in quads
            if q.predicate == TYPE and q.object == ox.NamedNode(OWL + "FunctionalProperty")
        ),
    )


def closure(
    top: ox.NamedNode, parents: Iterable[tuple[object, object]]
) -> frozenset[ox.NamedNode]:
    """Return ``top`` and every class below it.

    Args:
        top: a class.
        parents: pairs (class, its superclass); circles are no trouble.
    """
    below: dict[object, list[object]] = {}
    for child, parent in parents:
        below.setdefault(parent, []).append(child)
    found = {top}
    todo: list[object] = [top]
    while todo:
        for child in below.get(todo.pop(), ()):
            if isinstance(child, ox.NamedNode) and child not in found:
                found.add(child)
                todo.append(child)
    return frozenset(found)


def _named(node: object) -> bool:
    return isinstance(node, ox.NamedNode)
