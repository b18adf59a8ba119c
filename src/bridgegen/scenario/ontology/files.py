"""Scenarios as ``.owl`` files: RDF/XML that Protégé opens, with the ontology merged in.

A saved file is self-contained. Loading takes the ontology's own statements out again, so that
what was saved and what is loaded are the same individuals; what a user added to the ontology
(a subclass, say) stays with them.
"""

from collections import Counter
from collections.abc import Iterable, Iterator
from functools import cache
from pathlib import Path
from xml.parsers import expat

import pyoxigraph as ox

from bridgegen.base.disk import write_whole
from bridgegen.base.errors import FileFormatError
from bridgegen.scenario.ontology.graph import Individuals, as_number
from bridgegen.scenario.ontology.mirror import mirrored
from bridgegen.scenario.ontology.vocabulary import (
    DOUBLE,
    INTEGER,
    ONTOLOGY,
    OWL,
    OWL_ONTOLOGY,
    PREFIXES,
    SCENARIOS,
    TYPE,
    bg,
    tbox,
)

MAX_BYTES = 100 * 2**20
MAX_DEPTH = 256
"""Largest nesting depth of XML elements, and of anonymous nodes that are compared with the
ontology's own."""

_IMPORTS = ox.NamedNode(OWL + "imports")
_ONTOLOGY = ox.NamedNode(ONTOLOGY)
_RDF_XML = ox.RdfFormat.RDF_XML


def save(individuals: Individuals, path: Path | str, include_tbox: bool = True) -> None:
    """Write individuals to a file; it is there whole or not at all.

    Args:
        individuals: of a scenario or a road network.
        path: where to; a file that exists is replaced.
        include_tbox: merge ``bridgegen.owl`` in; otherwise the file imports it by its IRI.

    Raises:
        StorageError: the file cannot be written.
    """
    write_whole(Path(path), [to_bytes(individuals, include_tbox)])


def to_bytes(individuals: Individuals, include_tbox: bool = True) -> bytes:
    """Return what `save` writes: the same bytes for the same statements in the same order."""
    header: ox.NamedNode | ox.BlankNode | ox.Triple = ox.NamedNode(SCENARIOS + "unnamed")
    by_subject: dict[object, list[ox.Quad]] = {}
    for quad in mirrored(individuals).quads:
        if quad.predicate == TYPE and quad.object == OWL_ONTOLOGY:
            header = quad.subject
        by_subject.setdefault(quad.subject, []).append(quad)
    # The header first, then the ontology: tools that read RDF/XML as a stream know what it is of.
    quads = by_subject.pop(header, [ox.Quad(header, TYPE, OWL_ONTOLOGY)])
    quads += tbox().quads if include_tbox else [ox.Quad(header, _IMPORTS, _ONTOLOGY)]
    for about_one in by_subject.values():  # each individual in one piece, however it was built
        quads += about_one
    data = ox.serialize(_renamed(quads), format=_RDF_XML, prefixes=PREFIXES)
    assert data is not None
    return data


def _renamed(quads: Iterable[ox.Quad]) -> Iterator[ox.Quad]:
    """Yield statements whose anonymous nodes are numbered; a parser calls them at random."""
    names: dict[object, ox.BlankNode] = {}

    def name(node: ox.BlankNode) -> ox.BlankNode:
        return names.setdefault(node, ox.BlankNode(f"b{len(names) + 1}"))

    for quad in quads:
        subject, value = quad.subject, quad.object
        if isinstance(subject, ox.BlankNode) or isinstance(value, ox.BlankNode):
            yield ox.Quad(
                name(subject) if isinstance(subject, ox.BlankNode) else subject,
                quad.predicate,
                name(value) if isinstance(value, ox.BlankNode) else value,
            )
        else:
            yield quad


def load(path: Path | str) -> Individuals:
    """Read individuals from an RDF/XML file, ours or Protégé's.

    Raises:
        FileFormatError: missing, not a file, unreadable, larger than 100 MiB, not RDF/XML, nested
            deeper than 256 levels, with a DOCTYPE (entities are never expanded), or with a
            type that is no class.
    """
    path = Path(path)
    try:
        size = path.stat().st_size
        if not path.is_file():
            raise FileFormatError(f"{path}: cannot be read: not a file")
        if size > MAX_BYTES:
            raise FileFormatError(f"{path}: may have at most {MAX_BYTES} bytes, got {size}")
        data = path.read_bytes()
    except OSError as error:
        raise FileFormatError(f"{path}: cannot be read: {error.strerror}") from None
    return from_bytes(data, str(path))


def from_bytes(data: bytes, place: str = "document") -> Individuals:
    """Read individuals from RDF/XML text; see `load`."""
    # Before the RDF parser: depth and DOCTYPE are refused here, with a line, whatever that parser
    # would make of them.
    _check_xml(data, place)
    try:
        quads = list(ox.parse(data, format=_RDF_XML, base_iri=SCENARIOS + "unnamed"))
    except (SyntaxError, ValueError) as error:
        raise FileFormatError(f"{place}: not RDF/XML: {_first_line(error)}") from None
    for quad in quads:
        if quad.predicate == TYPE and isinstance(quad.object, ox.Literal):
            raise FileFormatError(
                f"{place}: the type of {quad.subject} must be a class, got '{quad.object.value}'"
            )
    return mirrored(Individuals(_typed(quad) for quad in _without_tbox(quads)))


def _check_xml(data: bytes, place: str) -> None:
    """Refuse what is not XML, or hostile, before the RDF parser sees it."""
    parser = expat.ParserCreate()
    depth = 0

    def on_doctype(*_: object) -> None:
        raise FileFormatError(f"{place}: a DOCTYPE is refused (entities are never expanded)")

    def on_start(*_: object) -> None:
        nonlocal depth
        depth += 1
        if depth > MAX_DEPTH:
            line = parser.CurrentLineNumber
            raise FileFormatError(
                f"{place}: elements may nest {MAX_DEPTH} deep, line {line} is deeper"
            )

    def on_end(*_: object) -> None:
        nonlocal depth
        depth -= 1

    parser.StartDoctypeDeclHandler = on_doctype
    parser.StartElementHandler = on_start
    parser.EndElementHandler = on_end
    try:
        parser.Parse(data, True)
    except (expat.ExpatError, LookupError, ValueError) as error:  # the latter two: encodings
        raise FileFormatError(
            f"{place}: not well-formed XML: {_first_line(error)} (in Protégé, save as RDF/XML)"
        ) from None


def _first_line(error: Exception) -> str:
    lines = str(error).splitlines() or [type(error).__name__]
    return lines[0]


def _typed(quad: ox.Quad) -> ox.Quad:
    """Give a number the datatype that the ontology asks for (Protégé may write xsd:decimal)."""
    value = quad.object
    wanted = _number_ranges().get(quad.predicate)
    if wanted is None or not isinstance(value, ox.Literal) or value.datatype == wanted:
        return quad
    number = as_number(value)
    if number is None or (wanted == INTEGER and number != int(number)):
        return quad
    return ox.Quad(
        quad.subject, quad.predicate, ox.Literal(int(number) if wanted == INTEGER else number)
    )


@cache
def _number_ranges() -> dict[ox.NamedNode, ox.NamedNode]:
    return {
        bg(name): target for name, target in tbox().ranges.items() if target in (DOUBLE, INTEGER)
    }


def _without_tbox(quads: list[ox.Quad]) -> list[ox.Quad]:
    """Leave out the statements of ``bridgegen.owl``, with anonymous nodes (of lists)."""
    plain, trees = _known()
    ours = {quad for key, tree in _trees(quads) if key in trees for quad in tree}
    return [
        quad
        for quad in quads
        if quad not in plain
        and quad not in ours
        and not (quad.predicate == _IMPORTS and quad.object == _ONTOLOGY)
    ]


@cache
def _known() -> tuple[frozenset[ox.Quad], frozenset[str]]:
    quads = tbox().quads
    return frozenset(quads), frozenset(key for key, _ in _trees(quads))


def _trees(quads: Iterable[ox.Quad]) -> Iterator[tuple[str, list[ox.Quad]]]:
    """Yield each tree of anonymous nodes: its contents without their arbitrary ids, and its quads.

    A node that is referred to twice ends its tree, so each is visited once at most, and circles
    not at all.
    """
    about: dict[object, list[ox.Quad]] = {}
    references: Counter[object] = Counter()
    roots: list[ox.Quad | ox.BlankNode] = []
    for quad in quads:
        if isinstance(quad.object, ox.BlankNode):
            references[quad.object] += 1
            if not isinstance(quad.subject, ox.BlankNode):
                roots.append(quad)
        if isinstance(quad.subject, ox.BlankNode):
            about.setdefault(quad.subject, []).append(quad)
    roots += [node for node in about if isinstance(node, ox.BlankNode) and not references[node]]

    def text(node: object, tree: list[ox.Quad], depth: int) -> str:
        if not isinstance(node, ox.BlankNode) or references[node] > 1 or depth == 0:
            return str(node)
        own = about.get(node, [])
        tree += own
        # By contents: a parser gives anonymous nodes ids at random, so ids say nothing of two
        # files.
        parts = sorted(f"{quad.predicate} {text(quad.object, tree, depth - 1)}" for quad in own)
        return f"[{' ; '.join(parts)}]"

    for root in roots:
        tree: list[ox.Quad] = []
        if isinstance(root, ox.Quad):
            tree.append(root)
            yield f"{root.subject} {root.predicate} {text(root.object, tree, MAX_DEPTH)}", tree
        else:
            yield text(root, tree, MAX_DEPTH), tree
