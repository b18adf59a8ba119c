"""The terms of ``bridgegen.owl``: their IRIs, and the ontology's statements about them.

Code refers to a term by its local name (``"has_length"``); `bg` makes the IRI of it.
"""

from collections.abc import Iterable, Iterator, Mapping
from dataclasses import dataclass
from functools import cache
from importlib.resources import files

import pyoxigraph as ox

ONTOLOGY = "https://w3id.org/bridgegen"
BG = ONTOLOGY + "#"
SCENARIOS = ONTOLOGY + "/scenarios/"
"""Namespace below which each scenario's individuals have one of their own."""

OWL = "http://www.w3.org/2002/07/owl#"
RDF = "http://www.w3.org/1999/02/22-rdf-syntax-ns#"
RDFS = "http://www.w3.org/2000/01/rdf-schema#"
XSD = "http://www.w3.org/2001/XMLSchema#"
DCTERMS = "http://purl.org/dc/terms/"
VOCABULARIES = {
    "osc": ("ASAM OpenSCENARIO XML", "http://code.asam.net/simulation/standard/openscenario#"),
    "odr": ("ASAM OpenDRIVE", "http://code.asam.net/simulation/standard/opendrive#"),
    "auto": ("A.U.T.O.", "http://purl.org/auto/"),
    "openlabel": ("ASAM OpenLABEL", "https://openlabel.asam.net/V1-0-0/ontologies/"),
}
"""Vocabularies that classes are aligned with by ``rdfs:seeAlso``: name and namespace by prefix.

Every term is taken from the vocabulary itself; ``docs/decisions.md`` names the sources."""
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
SEE_ALSO = ox.NamedNode(RDFS + "seeAlso")
SOURCE = ox.NamedNode(DCTERMS + "source")
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
        kinds: per term, what it is declared as: ``Class``, ``ObjectProperty``,
            ``DatatypeProperty`` or ``AnnotationProperty``; in the order of the file.
        subclasses: per class, the class itself and all below it.
        parents: per class, its direct superclasses.
        disjoint: groups of classes no two of which share an individual.
        equivalents: per property that has any, all that mean the same.
        requires: per class, the properties that its individuals must have, besides inherited ones.
        ranges: per property, its range: a class or a datatype.
        domains: per property, the class that it belongs to.
        units: per data property with a unit, the unit.
        labels: per term, what people call it.
        comments: per term, what it means.
        sources: per term, where it comes from.
        see_also: per class that has any, IRIs of its counterparts in other vocabularies.
        layers: per class that declares one, its layer, 1 to 5; others have that of a superclass.
        functional: the properties that have at most one value.
        above: per data property whose values must exceed something, that.
        allowed: per data property with an enumeration, its values.
        constraints: per property that has any, what its values must keep, in words.
    """

    quads: tuple[ox.Quad, ...]
    version: str
    kinds: Mapping[str, str]
    subclasses: Mapping[ox.NamedNode, frozenset[ox.NamedNode]]
    parents: Mapping[str, tuple[str, ...]]
    disjoint: tuple[tuple[str, ...], ...]
    equivalents: Mapping[str, tuple[ox.NamedNode, ...]]
    requires: Mapping[str, tuple[str, ...]]
    ranges: Mapping[str, ox.NamedNode]
    domains: Mapping[str, str]
    units: Mapping[str, str]
    labels: Mapping[str, str]
    comments: Mapping[str, str]
    sources: Mapping[str, str]
    see_also: Mapping[str, tuple[str, ...]]
    layers: Mapping[str, int]
    functional: frozenset[str]
    above: Mapping[str, float]
    allowed: Mapping[str, tuple[str, ...]]
    constraints: Mapping[str, tuple[str, ...]]

    def layer(self, cls: str) -> int | None:
        """Return the layer of a class, its own or the nearest superclass's, or None."""
        level: tuple[str, ...] = (cls,)
        while level:
            for name in level:
                if name in self.layers:
                    return self.layers[name]
            level = tuple(parent for name in level for parent in self.parents.get(name, ()))
        return None


@cache
def tbox() -> TBox:
    """Read ``bridgegen.owl``, once a process."""
    data = files("bridgegen.scenario.ontology").joinpath("bridgegen.owl").read_bytes()
    everything = list(ox.parse(data, format=ox.RdfFormat.RDF_XML))
    header = ox.NamedNode(ONTOLOGY)
    quads = tuple(quad for quad in everything if quad.subject != header)
    statements: dict[ox.NamedNode, list[tuple[Subject, ox.NamedNode | ox.Literal]]] = {}
    for quad in everything:
        if isinstance(quad.subject, Subject) and isinstance(quad.object, ox.NamedNode | ox.Literal):
            statements.setdefault(quad.predicate, []).append((quad.subject, quad.object))

    def links(predicate: ox.NamedNode) -> list[tuple[ox.NamedNode, ox.NamedNode]]:
        return [
            (a, b)
            for a, b in statements.get(predicate, ())
            if isinstance(a, ox.NamedNode) and isinstance(b, ox.NamedNode)
        ]

    def texts(predicate: ox.NamedNode) -> dict[str, tuple[str, ...]]:
        found: dict[str, tuple[str, ...]] = {}
        for node, value in statements.get(predicate, ()):
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
    seen = links(SEE_ALSO)
    equal = links(EQUIVALENT_PROPERTY)
    return TBox(
        quads=quads,
        version=first(VERSION_INFO)[local_name(header)],
        kinds={
            local_name(term): local_name(kind)
            for term, kind in types
            if local_name(kind) in _KINDS and kind.value.startswith(OWL)
        },
        subclasses=subclasses,
        parents=_grouped(parents),
        disjoint=tuple(_disjoint(everything)),
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
        sources=first(SOURCE),
        see_also={
            local_name(cls): tuple(other.value for term, other in seen if term == cls)
            for cls in dict.fromkeys(term for term, _ in seen)
        },
        layers={name: int(text) for name, text in first(bg("layer")).items()},
        functional=frozenset(
            local_name(term)
            for term, cls in types
            if cls == ox.NamedNode(OWL + "FunctionalProperty")
        ),
        above={name: float(text) for name, text in first(bg("above")).items()},
        allowed=texts(bg("allows")),
        constraints=texts(bg("constraint")),
    )


_KINDS = ("Class", "ObjectProperty", "DatatypeProperty", "AnnotationProperty")


def _grouped(pairs: Iterable[tuple[ox.NamedNode, ox.NamedNode]]) -> dict[str, tuple[str, ...]]:
    """Return per left term all right ones, by local name."""
    found: dict[str, tuple[str, ...]] = {}
    for left, right in pairs:
        found[local_name(left)] = (*found.get(local_name(left), ()), local_name(right))
    return found


def _disjoint(quads: Iterable[ox.Quad]) -> Iterator[tuple[str, ...]]:
    """Yield the members of each ``owl:AllDisjointClasses``."""
    statements = {(quad.subject, quad.predicate): quad.object for quad in quads}
    for (_, predicate), head in statements.items():
        if predicate == ox.NamedNode(OWL + "members"):
            names = []
            while isinstance(head, ox.BlankNode):
                names.append(local_name(statements[head, ox.NamedNode(RDF + "first")]))
                head = statements[head, ox.NamedNode(RDF + "rest")]
            yield tuple(names)


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
