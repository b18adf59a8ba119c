"""The ontology as a page: every class and property, with all statements about it.

One HTML file without scripts that fetches nothing. A term's anchor is its local name, so that
``…#Crosswalk`` leads to it wherever the page is put.
"""

import html
import re
from collections.abc import Callable, Iterable, Iterator
from importlib.resources import files
from pathlib import Path

from bridgegen.base.disk import refuse_other, write_whole
from bridgegen.scenario.ontology.structure import LAYERS
from bridgegen.scenario.ontology.vocabulary import BG, VOCABULARIES, XSD, TBox, local_name, tbox

# --- Pieces of HTML; everything that is not called markup is escaped ---


def escaped(what: object) -> str:
    """Return what is safe as text and within the quotes of an attribute."""
    return html.escape(str(what), quote=True)


def link(name: str, shown: str | None = None) -> str:
    """Return a link to an anchor of the page."""
    return f'<a href="#{escaped(name)}">{escaped(shown or name)}</a>'


def links(names: Iterable[str]) -> str:
    """Return links to anchors, with commas."""
    return ", ".join(map(link, names))


def definitions(pairs: Iterable[tuple[str, str]]) -> str:
    """Return pairs (what, markup) as a list; those without markup are left out."""
    rows = "".join(f"<dt>{what}</dt><dd>{said}</dd>\n" for what, said in pairs if said)
    return f'<dl class="says">\n{rows}</dl>\n'


def table_of(cls: str, heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
    """Return a table of markup; on a narrow screen, each row is a block with the heads in it."""
    heads = list(heads)
    head = "".join(f'<th scope="col">{one}</th>' for one in heads)
    body = "".join(
        "<tr>"
        + "".join(
            f'<td data-is="{what}">{cell}</td>' if number and cell else f"<td>{cell}</td>"
            for number, (what, cell) in enumerate(zip(heads, row, strict=True))
        )
        + "</tr>\n"
        for row in rows
    )
    top = f'<table class="{cls}">\n<thead><tr>{head}</tr></thead>\n'
    return f"{top}<tbody>\n{body}</tbody>\n</table>\n"


# --- The documentation page's entries for classes and properties ---


_DATATYPES = {"double": "number", "integer": "whole number", "string": "text"}
_Properties = Callable[[str], Iterable[str]]


class Terms:
    """Renders terms as markup, each as an article with the term's local name as its anchor."""

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

    def badge(self, name: str, title: bool = False) -> str:
        """Return the number of a class's layer, and what the layer is."""
        number = self.ontology.layer(name)
        if number is None:
            return ""
        text = f"layer {number}: {LAYERS[number].lower()}" if title else str(number)
        return f'<span class="number l{number}">{text}</span>'

    # -- terms ---------------------------------------------------------------------------------

    def _term(self, name: str, badge: str, body: str) -> str:
        label = escaped(self.ontology.labels.get(name, name))
        comment = escaped(self.ontology.comments.get(name, ""))
        return (
            f'<article class="term" id="{escaped(name)}">\n<div class="head">'
            f"<h3>{label} <code>{escaped(name)}</code></h3>{badge}</div>\n"
            f"<p>{comment}</p>\n{body}</article>\n"
        )

    def cls(self, name: str) -> str:
        """Return the entry of a class."""
        ontology = self.ontology
        disjoint = [one for group in ontology.disjoint if name in group for one in group]
        pointing = [
            one
            for one in self.of_kind("ObjectProperty")
            if local_name(ontology.ranges[one]) == name
        ]
        facts = definitions([
            ("Source", escaped(ontology.sources.get(name, ""))),
            ("Superclasses", self._superclasses(name)),
            ("Subclasses", links(self.children.get(name, ()))),
            ("Disjoint with", links(one for one in disjoint if one != name)),
            ("Required", self._by_owner(name, self._required)),
            ("Inherited", self._folded(name)),
            ("Pointed to by", links(pointing)),
            ("Counterparts", ", ".join(map(counterpart, ontology.see_also.get(name, ())))),
        ])  # fmt: skip
        own = self.by_domain.get(name, [])
        required = ontology.requires.get(name, ())
        rows = (
            (
                link(one) + (' <span class="tag must">required</span>' if one in required else ""),
                self._values(one),
                f"{escaped(ontology.comments.get(one, ''))} "
                f'<span class="from">{escaped(ontology.sources.get(one, ""))}</span>',
            )
            for one in own
        )
        table = table_of("props", ("Property", "Values", "Meaning"), rows) if own else ""
        return self._term(name, self.badge(name, title=True), facts + table)

    def _ancestors(self, name: str) -> list[str]:
        """Return the superclasses of a class, the nearest first."""
        found: list[str] = []
        level = list(self.ontology.parents.get(name, ()))
        while level:
            found += dict.fromkeys(level)
            above = [up for one in level for up in self.ontology.parents.get(one, ())]
            level = [one for one in above if one not in found]
        return found

    def _superclasses(self, name: str) -> str:
        direct = self.ontology.parents.get(name, ())
        more = [one for one in self._ancestors(name) if one not in direct]
        return links(direct) + (f" (and so {links(more)})" if more else "")

    def _required(self, cls: str) -> Iterable[str]:
        return self.ontology.requires.get(cls, ())

    def _inherited(self, cls: str) -> Iterable[str]:
        return self.by_domain.get(cls, ())

    def _by_owner(self, name: str, properties: _Properties) -> str:
        """Return properties that a class has of its own and from each superclass.

        Of its own, only those that it requires: the others are in its table.
        """
        groups = []
        if properties == self._required and (own := list(properties(name))):
            groups.append(f'<span class="group">{links(own)}</span>')
        for owner in self._ancestors(name):
            if found := list(properties(owner)):
                groups.append(
                    f'<span class="group">{links(found)} '
                    f'<span class="from">from {link(owner)}</span></span>'
                )
        return "".join(groups)

    def _folded(self, name: str) -> str:
        """Return the properties that a class has from its superclasses, folded away."""
        count = sum(len(self.by_domain.get(one, ())) for one in self._ancestors(name))
        if not count:
            return ""
        what = "1 property" if count == 1 else f"{count} properties"
        groups = self._by_owner(name, self._inherited)
        return f"<details><summary>{what} of superclasses</summary>{groups}</details>"

    def property(self, name: str) -> str:
        """Return the entry of a property."""
        ontology = self.ontology
        same = [local_name(one) for one in ontology.equivalents.get(name, ())]
        owners = [cls for cls, names in ontology.requires.items() if name in names]
        is_annotation = ontology.kinds[name] == "AnnotationProperty"
        return self._term(name, "", definitions([
            ("Source", escaped(ontology.sources.get(name, ""))),
            ("Domain", link(ontology.domains[name]) if name in ontology.domains else ""),
            ("Values", "" if is_annotation else self._values(name)),
            ("Required by", links(owners)),
            ("Same as", links(one for one in same if one != name)),
            ("Constraints", "<br>".join(map(escaped, ontology.constraints.get(name, ())))),
        ]))  # fmt: skip

    def _values(self, name: str) -> str:
        """Return what the values of a property may be: range, unit, limits, how many."""
        ontology = self.ontology
        target = ontology.ranges[name]
        kind = local_name(target)
        is_datatype = target.value.startswith(XSD)
        parts = [escaped(_DATATYPES.get(kind, kind)) if is_datatype else link(kind)]
        if unit := ontology.units.get(name):
            parts[0] += f" [{escaped(unit)}]"
        if name in ontology.above:
            parts.append(f"&gt; {ontology.above[name]:g}")
        if choices := ontology.allowed.get(name):
            parts.append("one of " + ", ".join(f"<code>{escaped(one)}</code>" for one in choices))
        many = "at most one" if name in ontology.functional else "any number"
        return f'{", ".join(parts)} <span class="tag">{many}</span>'


def is_in(iri: str, prefix: str) -> bool:
    """Return whether a term belongs to a vocabulary."""
    return iri.startswith(VOCABULARIES[prefix][1])


def counterpart(iri: str, with_prefix: bool = True) -> str:
    """Return a term of another vocabulary; it is no link, as few of them lead to a page."""
    for prefix, (_, namespace) in VOCABULARIES.items():
        if iri.startswith(namespace):
            name = iri[len(namespace) :]
            shown = f"{prefix}:{name}" if with_prefix else name
            breakable = escaped(shown).replace("_", "_<wbr>")
            return f'<code title="{escaped(iri)}">{breakable}</code>'
    return f"<code>{escaped(iri)}</code>"


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
