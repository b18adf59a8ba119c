"""The layer of an individual: that of its class, or of the nearest class above.

The annotation ``bg:layer`` defines it, in ``bridgegen.owl`` or in the file itself; no class is
known here by its name, so that a new one finds its layer by itself.
"""

from collections.abc import Iterable, Iterator, Mapping
from functools import cached_property

import pyoxigraph as ox

from bridgegen.scenario.ontology.graph import Individuals, as_number
from bridgegen.scenario.ontology.vocabulary import (
    EQUIVALENT_CLASS,
    LABEL,
    OWL,
    RDFS,
    SUBCLASS,
    TYPE,
    Subject,
    bg,
    local_name,
    tbox,
)

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
        for one in self._above(cls):
            for value in self._statements.get(one, {}).get(bg("layer"), ()):
                number = as_number(value) if isinstance(value, ox.Literal) else None
                if number in LAYERS:
                    return int(number)
            if one == bg(local_name(one)) and local_name(one) in tbox().layers:
                return tbox().layers[local_name(one)]
        return None

    def _above(self, cls: ox.NamedNode) -> list[ox.NamedNode]:
        """Return a class and all above it, the nearest first."""
        if cls not in self._known_above:
            found = [cls]
            for one in found:  # grows meanwhile
                found += [up for up in self._parents.get(one, ()) if up not in found]
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
    return [one.value for one in values if isinstance(one, ox.Literal)]
