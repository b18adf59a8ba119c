"""The ontology as a page: every class and property, with all statements about it.

One HTML file without scripts that fetches nothing. A term's anchor is its local name, so that
``…#Crosswalk`` leads to it wherever the page is put.
"""

import re
from collections.abc import Iterable, Mapping, Sequence
from functools import cached_property
from pathlib import Path
from typing import Any

from bridgegen.base.disk import refuse_other, write_whole
from bridgegen.pages import templates
from bridgegen.scenario.ontology.structure import LAYERS
from bridgegen.scenario.ontology.vocabulary import BG, VOCABULARIES, XSD, TBox, local_name, tbox

GENERATOR = "bridgegen ontology docs"
_DATATYPES = {"double": "number", "integer": "whole number", "string": "text"}
_COUNTED = {
    "Class": "classes",
    "ObjectProperty": "object properties",
    "DatatypeProperty": "data properties",
}

Tree = list[tuple[str, bool, "Tree"]]
"""Names of classes; whether a class's own subclasses stand further up; the classes below it."""


def write_docs(out: Path) -> None:
    """Write the page; it is there whole or not at all.

    Args:
        out: where to. An earlier page is replaced, any other file is not.

    Raises:
        InputError: its name does not end in .html.
        StorageError: it cannot be written, or is something else already.
    """
    refuse_other(out, GENERATOR, "documentation page")
    write_whole(out, [to_html(tbox())])


def to_html(ontology: TBox) -> bytes:
    """Return the page."""
    terms = Terms(ontology)
    counts = [f"{len(terms.of_kind(kind))} {what}" for kind, what in _COUNTED.items()]
    return templates.page(
        "pages/web/ontology.html",
        title="The BridgeGen ontology",
        generator=GENERATOR,
        facts=[f"version {ontology.version}", *counts, BG],
        ontology=ontology,
        terms=terms,
        layers=LAYERS,
        vocabularies=VOCABULARIES,
        properties={
            kind: sorted(terms.of_kind(kind), key=_sort_key)
            for kind in ("ObjectProperty", "DatatypeProperty", "AnnotationProperty")
        },
    )


class Terms:
    """What the template asks of an ontology's terms, by their local names."""

    def __init__(self, ontology: TBox) -> None:
        self.ontology = ontology
        self.classes = self.of_kind("Class")
        self.children: dict[str, list[str]] = {}
        for name in self.classes:
            for parent in ontology.parents.get(name, ()):
                self.children.setdefault(parent, []).append(name)
        self.by_domain: dict[str, list[str]] = {}
        for name in (*self.of_kind("ObjectProperty"), *self.of_kind("DatatypeProperty")):
            self.by_domain.setdefault(ontology.domains[name], []).append(name)

    def of_kind(self, kind: str) -> list[str]:
        """Return the terms that are declared as something, in the order of the file."""
        return [name for name, its in self.ontology.kinds.items() if its == kind]

    def ancestors(self, name: str) -> list[str]:
        """Return the superclasses of a class, the nearest first."""
        found: list[str] = []
        level = list(self.ontology.parents.get(name, ()))
        while level:
            found += dict.fromkeys(level)
            above = [up for item in level for up in self.ontology.parents.get(item, ())]
            level = [item for item in above if item not in found]
        return found

    def disjoint(self, name: str) -> list[str]:
        """Return the classes that a class is disjoint with."""
        groups = (group for group in self.ontology.disjoint if name in group)
        return [item for group in groups for item in group if item != name]

    def pointing(self, name: str) -> list[str]:
        """Return the object properties whose values are of a class."""
        ranges = self.ontology.ranges
        return [item for item in self.of_kind("ObjectProperty") if local_name(ranges[item]) == name]

    def from_superclasses(
        self, name: str, properties: Mapping[str, Sequence[str]]
    ) -> list[tuple[str, Sequence[str]]]:
        """Return each superclass of a class that has properties, with these."""
        return [
            (ancestor, properties[ancestor])
            for ancestor in self.ancestors(name)
            if properties.get(ancestor)
        ]

    def requiring(self, name: str) -> list[str]:
        """Return the classes that require a property."""
        return [cls for cls, names in self.ontology.requires.items() if name in names]

    def same(self, name: str) -> list[str]:
        """Return the properties that are equivalent to one."""
        others = map(local_name, self.ontology.equivalents.get(name, ()))
        return [other for other in others if other != name]

    def values(self, name: str) -> dict[str, Any]:
        """Return what the values of a property may be: range, unit, limits, how many."""
        ontology, target = self.ontology, self.ontology.ranges[name]
        kind, is_datatype = local_name(target), target.value.startswith(XSD)
        return {
            "kind": _DATATYPES.get(kind, kind) if is_datatype else kind,
            "is_class": not is_datatype,
            "unit": ontology.units.get(name),
            "above": ontology.above.get(name),
            "choices": ontology.allowed.get(name, ()),
            "many": "at most one" if name in ontology.functional else "any number",
        }

    @staticmethod
    def counterpart(iri: str) -> tuple[str, str]:
        """Return the prefix and name of a term of another vocabulary; no prefix if none is known.

        It is no link, as few of them lead to a page.
        """
        for prefix, (_, namespace) in VOCABULARIES.items():
            if iri.startswith(namespace):
                return prefix, iri[len(namespace) :]
        return "", iri

    def counterparts(self, name: str, prefix: str) -> list[str]:
        """Return a class's counterparts in a vocabulary."""
        iris = self.ontology.see_also.get(name, ())
        return [iri for iri in iris if iri.startswith(VOCABULARIES[prefix][1])]

    def using(self, prefix: str) -> int:
        """Return how many classes have a counterpart in a vocabulary."""
        return sum(bool(self.counterparts(name, prefix)) for name in self.ontology.see_also)

    # -- overview and index --------------------------------------------------------------------

    @property
    def tree(self) -> Tree:
        """All classes, each below what it is a kind of."""
        tops = [kind for kind in self.classes if not self.ontology.parents.get(kind)]
        return self._tree(tops, set(), set(self.classes))

    def tree_of(self, layer: int | None) -> Tree:
        """Return the tree of the classes of a layer; None: of those that have none."""
        inside = {name for name in self.classes if self.ontology.layer(name) == layer}
        above = self.ontology.parents
        tops = [n for n in self.classes if n in inside and not inside & set(above.get(n, ()))]
        return self._tree(tops, set(), inside)

    def _tree(self, names: Iterable[str], shown: set[str], inside: set[str]) -> Tree:
        """Return classes with all below them, in the order of the page.

        Args:
            names: side by side.
            shown: classes above and before, whose subclasses are not shown again; grows.
            inside: the only classes to show.
        """
        found: Tree = []
        for name in names:
            below = [item for item in self.children.get(name, ()) if item in inside]
            again = bool(below) and name in shown
            if below:
                shown.add(name)
            found.append((name, again, [] if again else self._tree(below, shown, inside)))
        return found

    @cached_property
    def initials(self) -> dict[str, list[str]]:
        """All terms by first letter; ``has_length`` is found under L."""
        found: dict[str, list[str]] = {}
        for name in sorted(self.ontology.kinds, key=_sort_key):
            found.setdefault(_sort_key(name)[0].upper(), []).append(name)
        return dict(sorted(found.items()))


def _sort_key(name: str) -> str:
    return re.sub(r"^has_?(?=[A-Za-z])", "", name).casefold()
