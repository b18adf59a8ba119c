"""The ontology as a page: every class and property, with all statements about it.

One HTML file without scripts that fetches nothing. A term's anchor is its local name, so that
``…#Crosswalk`` leads to it wherever the page is put.
"""

import re
from collections.abc import Iterator
from importlib.resources import files
from pathlib import Path

from bridgegen.base.disk import refuse_other, write_whole
from bridgegen.scenario.ontology.docs_terms import Terms, counterpart, is_in
from bridgegen.scenario.ontology.layers import LAYERS
from bridgegen.scenario.ontology.markup import escaped, link, table_of
from bridgegen.scenario.ontology.vocabulary import BG, VOCABULARIES, TBox, tbox

_PROPERTIES = ("ObjectProperty", "DatatypeProperty")


def write_docs(out: Path) -> None:
    """Write the page; it is there whole or not at all.

    Args:
        out: where to. An earlier page is replaced, any other file is not.

    Raises:
        InputError: its name does not end in .html.
        StorageError: it cannot be written, or is something else already.
    """
    refuse_other(out, "bridgegen ontology docs", "documentation page")
    write_whole(out, [to_html(tbox()).encode("utf-8", "replace")])


def to_html(ontology: TBox) -> str:
    """Return the page as text."""
    fill = _Page(ontology).parts()
    parts = re.split(r"\{\{(\w+)\}\}", _resource("docs.html"))
    # what is put in is never searched for placeholders again
    return "".join(fill[part] if number % 2 else part for number, part in enumerate(parts))


def _resource(name: str) -> str:
    return files("bridgegen.scenario.ontology").joinpath(name).read_text(encoding="utf-8")


class _Page:
    """The parts of the page: strings of markup, everything in them escaped."""

    def __init__(self, ontology: TBox) -> None:
        self.ontology = ontology
        self.terms = Terms(ontology)
        self.classes, self.children = self.terms.classes, self.terms.children

    def parts(self) -> dict[str, str]:
        """Return what the template's placeholders stand for."""
        ontology = self.ontology
        counts = {
            "classes": len(self.classes),
            "object properties": len(self.terms.of_kind("ObjectProperty")),
            "data properties": len(self.terms.of_kind("DatatypeProperty")),
        }
        facts = [f"version {ontology.version}", *(f"{n} {what}" for what, n in counts.items()), BG]
        properties = {
            kind: "".join(map(self.terms.property, sorted(self.terms.of_kind(kind), key=_sort_key)))
            for kind in (*_PROPERTIES, "AnnotationProperty")
        }
        initials = self._initials()
        return {
            "title": "The BridgeGen ontology",
            "css": _resource("docs.css"),
            "comment": escaped(ontology.comments.get("bridgegen", "")),
            "facts": "".join(f"<li>{escaped(one)}</li>" for one in facts),
            "letters": "".join(link(f"index-{letter}", letter) for letter in initials),
            "layers": "".join(self._overview()),
            "tree": self._tree([c for c in self.classes if not ontology.parents.get(c)], set()),
            "classes": "".join(map(self.terms.cls, self.classes)),
            "object_properties": properties["ObjectProperty"],
            "data_properties": properties["DatatypeProperty"],
            "annotations": properties["AnnotationProperty"],
            "counterparts": self._counterparts(),
            "index": "".join(self._index(initials)),
        }

    # -- overview ------------------------------------------------------------------------------

    def _overview(self) -> Iterator[str]:
        """Yield a card per layer, with the tree of its classes; and one for what has none."""
        layer = self.ontology.layer
        for number, title in LAYERS.items():
            inside = {name for name in self.classes if layer(name) == number}
            yield (
                f'<div class="card l{number}"><h3>{number} {title}</h3>'
                f"{self._part_of_tree(inside)}</div>\n"
            )
        across = {name for name in self.classes if layer(name) is None}
        yield f'<div class="card"><h3>Across the layers</h3>{self._part_of_tree(across)}</div>\n'

    def _part_of_tree(self, inside: set[str]) -> str:
        above = self.ontology.parents
        tops = [n for n in self.classes if n in inside and not inside & set(above.get(n, ()))]
        return self._tree(tops, set(), inside)

    def _tree(self, names: list[str], shown: set[str], inside: set[str] | None = None) -> str:
        """Return classes with all below them; one whose subclasses were shown before has an arrow.

        Args:
            names: side by side.
            shown: classes above and before; grows.
            inside: the only classes to show; None: all of them. Then each has its layer beside it.
        """
        items = []
        for name in names:
            below = [c for c in self.children.get(name, ()) if inside is None or c in inside]
            again = name in shown and below
            item = link(name) + (self.terms.badge(name) if inside is None else "")
            if again:
                item += " ↑"
            elif below:
                shown.add(name)
                item += self._tree(below, shown, inside)
            items.append(f"<li>{item}</li>")
        return f"<ul>{''.join(items)}</ul>"

    # -- counterparts and index ----------------------------------------------------------------

    def _counterparts(self) -> str:
        """Return the other vocabularies, and per class that has any its counterparts in each."""
        see = self.ontology.see_also
        about = (
            (f"<code>{prefix}:</code> {escaped(name)}", f"<code>{escaped(namespace)}</code>",
             str(sum(any(is_in(iri, prefix) for iri in iris) for iris in see.values())))
            for prefix, (name, namespace) in VOCABULARIES.items()
        )  # fmt: skip
        rows = (
            (link(cls), *(
                ", ".join(counterpart(iri, False) for iri in see[cls] if is_in(iri, prefix))
                for prefix in VOCABULARIES
            ))
            for cls in self.classes
            if cls in see
        )  # fmt: skip
        names = [escaped(name) for name, _ in VOCABULARIES.values()]
        return "".join(
            f'<div class="all">{one}</div>\n'
            for one in (
                table_of("vocabularies", ("Vocabulary", "Namespace", "Classes"), about),
                table_of("others", ("Class", *names), rows),
            )
        )

    def _initials(self) -> dict[str, list[str]]:
        """Return all terms by first letter; ``has_length`` is found under L."""
        found: dict[str, list[str]] = {}
        for name in sorted(self.ontology.kinds, key=_sort_key):
            found.setdefault(_sort_key(name)[0].upper(), []).append(name)
        return dict(sorted(found.items()))

    def _index(self, initials: dict[str, list[str]]) -> Iterator[str]:
        for letter, names in initials.items():
            items = "".join(
                f"<li>{link(name)}"
                + ('<span class="from"> class</span>' if name in self.classes else "")
                + "</li>"
                for name in names
            )
            yield f'<h3 class="letter" id="index-{escaped(letter)}">{escaped(letter)}</h3>\n'
            yield f'<ul class="index list">{items}</ul>\n'


def _sort_key(name: str) -> str:
    return re.sub(r"^has_?(?=[A-Za-z])", "", name).casefold()
