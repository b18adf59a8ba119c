"""The ontology as a page for people: every class and property, with all that is said of it.

One HTML file without scripts that fetches nothing. A term's anchor is its local name, so that
``…#Crosswalk`` leads to it wherever the page is put.
"""

import html
import re
from collections.abc import Callable, Iterable, Iterator
from importlib.resources import files
from pathlib import Path

from bridgegen.errors import InputError, StorageError
from bridgegen.ontology.files import write_whole
from bridgegen.ontology.vocabulary import BG, VOCABULARIES, XSD, TBox, local_name, tbox

LAYERS = {
    1: "road network",
    2: "traffic facilities",
    3: "temporary changes",
    4: "traffic participants",
    5: "weather",
}
"""The layers of the operational design domain. Source: paper, Section III-A."""

_OURS = b'<meta name="generator" content="bridgegen ontology docs">'
_DATATYPES = {"double": "number", "integer": "whole number", "string": "text"}
_PROPERTIES = ("ObjectProperty", "DatatypeProperty")
_Properties = Callable[[str], Iterable[str]]


def write_docs(out: Path) -> None:
    """Write the page; it is there whole or not at all.

    Args:
        out: where to. An earlier page is replaced, any other file is not.

    Raises:
        InputError: its name does not end in .html.
        StorageError: it cannot be written, or is something else already.
    """
    if out.suffix.lower() not in (".html", ".htm"):
        raise InputError(f"{out}: the documentation is a page, its name must end in .html")
    _refuse_other(out)
    write_whole(out, to_html(tbox()).encode("utf-8", "replace"))


def _refuse_other(out: Path) -> None:
    try:
        with out.open("rb") as file:
            ours = _OURS in file.read(1000)
    except FileNotFoundError:
        return
    except OSError as error:
        raise StorageError(f"{out}: cannot be written: {error.strerror}") from None
    if not ours:
        raise StorageError(f"{out}: exists already, is no documentation, and is not overwritten")


def to_html(ontology: TBox) -> str:
    """Return the page as text."""
    fill = _Page(ontology).parts()
    parts = re.split(r"\{\{(\w+)\}\}", _resource("docs.html"))
    # what is put in is never searched for placeholders again
    return "".join(fill[part] if number % 2 else part for number, part in enumerate(parts))


def _resource(name: str) -> str:
    return files("bridgegen.ontology").joinpath(name).read_text(encoding="utf-8")


def _text(text: object) -> str:
    return html.escape(str(text), quote=True)


def _link(name: str, shown: str | None = None) -> str:
    return f'<a href="#{_text(name)}">{_text(shown or name)}</a>'


def _links(names: Iterable[str]) -> str:
    return ", ".join(map(_link, names))


def _facts(pairs: Iterable[tuple[str, str]]) -> str:
    """Return pairs (what, markup) as a list; those without markup are left out."""
    rows = "".join(f"<dt>{what}</dt><dd>{said}</dd>\n" for what, said in pairs if said)
    return f'<dl class="says">\n{rows}</dl>\n'


def _table(cls: str, heads: Iterable[str], rows: Iterable[Iterable[str]]) -> str:
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
    return f'<table class="{cls}">\n<thead><tr>{head}</tr></thead>\n<tbody>\n{body}</tbody>\n</table>\n'


class _Page:
    """The parts of the page: strings of markup, everything in them escaped."""

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
        return [name for name, its in self.ontology.kinds.items() if its == kind]

    def parts(self) -> dict[str, str]:
        """Return what the template's placeholders stand for."""
        ontology = self.ontology
        counts = {
            "classes": len(self.classes),
            "object properties": len(self.of_kind("ObjectProperty")),
            "data properties": len(self.of_kind("DatatypeProperty")),
        }
        facts = [f"version {ontology.version}", *(f"{n} {what}" for what, n in counts.items()), BG]
        properties = {
            kind: "".join(map(self.property, sorted(self.of_kind(kind), key=str.casefold)))
            for kind in (*_PROPERTIES, "AnnotationProperty")
        }
        initials = self.initials()
        return {
            "title": "The BridgeGen ontology",
            "css": _resource("docs.css"),
            "comment": _text(ontology.comments.get("bridgegen", "")),
            "facts": "".join(f"<li>{_text(one)}</li>" for one in facts),
            "letters": "".join(_link(f"index-{letter}", letter) for letter in initials),
            "layers": "".join(self.overview()),
            "tree": self.tree([c for c in self.classes if not ontology.parents.get(c)], set()),
            "classes": "".join(map(self.cls, self.classes)),
            "object_properties": properties["ObjectProperty"],
            "data_properties": properties["DatatypeProperty"],
            "annotations": properties["AnnotationProperty"],
            "counterparts": self.counterparts(),
            "index": "".join(self.index(initials)),
        }

    # -- overview ------------------------------------------------------------------------------

    def overview(self) -> Iterator[str]:
        """Yield a card per layer, with the tree of its classes; and one for what has none."""
        layer = self.ontology.layer
        for number, title in LAYERS.items():
            inside = {name for name in self.classes if layer(name) == number}
            yield (
                f'<div class="card l{number}"><h3>{number} {title}</h3>'
                f"{self.part_of_tree(inside)}</div>\n"
            )
        across = {name for name in self.classes if layer(name) is None}
        yield (f'<div class="card"><h3>Across the layers</h3>{self.part_of_tree(across)}</div>\n')

    def part_of_tree(self, inside: set[str]) -> str:
        above = self.ontology.parents
        tops = [n for n in self.classes if n in inside and not inside & set(above.get(n, ()))]
        return self.tree(tops, set(), inside)

    def tree(self, names: list[str], shown: set[str], inside: set[str] | None = None) -> str:
        """Return classes with all below them; a class that was shown before has an arrow.

        Args:
            names: side by side.
            shown: classes above and before; grows.
            inside: the only classes to show; None: all of them. Then each has its layer beside it.
        """
        items = []
        for name in names:
            below = [c for c in self.children.get(name, ()) if inside is None or c in inside]
            again = name in shown and below
            item = _link(name) + (self.badge(name) if inside is None else "")
            if again:
                item += " ↑"
            elif below:
                shown.add(name)
                item += self.tree(below, shown, inside)
            items.append(f"<li>{item}</li>")
        return f"<ul>{''.join(items)}</ul>"

    def badge(self, name: str, title: bool = False) -> str:
        """Return the number of a class's layer, and what the layer is."""
        number = self.ontology.layer(name)
        if number is None:
            return ""
        text = f"layer {number}: {LAYERS[number]}" if title else str(number)
        return f'<span class="number l{number}">{text}</span>'

    # -- terms ---------------------------------------------------------------------------------

    def term(self, name: str, badge: str, body: str) -> str:
        ontology = self.ontology
        return (
            f'<article class="term" id="{_text(name)}">\n<div class="head">'
            f"<h3>{_text(ontology.labels.get(name, name))} <code>{_text(name)}</code></h3>{badge}"
            f"</div>\n<p>{_text(ontology.comments.get(name, ''))}</p>\n{body}</article>\n"
        )

    def cls(self, name: str) -> str:
        """Return all that is said of a class."""
        ontology = self.ontology
        disjoint = [one for group in ontology.disjoint if name in group for one in group]
        pointing = [
            one
            for one in self.of_kind("ObjectProperty")
            if local_name(ontology.ranges[one]) == name
        ]
        facts = _facts([
            ("Source", _text(ontology.sources.get(name, ""))),
            ("Superclasses", self.superclasses(name)),
            ("Subclasses", _links(self.children.get(name, ()))),
            ("Disjoint with", _links(one for one in disjoint if one != name)),
            ("Required", self.by_owner(name, self.required)),
            ("Inherited", self.by_owner(name, self.inherited)),
            ("Value of", _links(pointing)),
            ("Counterparts", ", ".join(map(_counterpart, ontology.see_also.get(name, ())))),
        ])  # fmt: skip
        own = self.by_domain.get(name, [])
        required = ontology.requires.get(name, ())
        rows = (
            (
                _link(one) + (' <span class="tag must">required</span>' if one in required else ""),
                self.values(one),
                f"{_text(ontology.comments.get(one, ''))} "
                f'<span class="from">{_text(ontology.sources.get(one, ""))}</span>',
            )
            for one in own
        )
        table = _table("props", ("Property", "Values", "Meaning"), rows) if own else ""
        return self.term(name, self.badge(name, title=True), facts + table)

    def ancestors(self, name: str) -> list[str]:
        """Return the superclasses of a class, the nearest first."""
        found: list[str] = []
        level = list(self.ontology.parents.get(name, ()))
        while level:
            found += [one for one in level if one not in found]
            level = [up for one in level for up in self.ontology.parents.get(one, ())]
        return found

    def superclasses(self, name: str) -> str:
        direct = self.ontology.parents.get(name, ())
        more = [one for one in self.ancestors(name) if one not in direct]
        return _links(direct) + (f" (and so {_links(more)})" if more else "")

    def required(self, cls: str) -> Iterable[str]:
        return self.ontology.requires.get(cls, ())

    def inherited(self, cls: str) -> Iterable[str]:
        return self.by_domain.get(cls, ())

    def by_owner(self, name: str, properties: _Properties) -> str:
        """Return properties that a class has of its own and from each superclass.

        Of its own, only those that it requires: the others are in its table.
        """
        groups = []
        if properties == self.required and (own := list(properties(name))):
            groups.append(f'<span class="group">{_links(own)}</span>')
        for owner in self.ancestors(name):
            if found := list(properties(owner)):
                groups.append(
                    f'<span class="group">{_links(found)} '
                    f'<span class="from">from {_link(owner)}</span></span>'
                )
        return "".join(groups)

    def property(self, name: str) -> str:
        """Return all that is said of a property."""
        ontology = self.ontology
        same = [local_name(one) for one in ontology.equivalents.get(name, ())]
        owners = [cls for cls, names in ontology.requires.items() if name in names]
        is_annotation = ontology.kinds[name] == "AnnotationProperty"
        return self.term(name, "", _facts([
            ("Source", _text(ontology.sources.get(name, ""))),
            ("Domain", _link(ontology.domains[name]) if name in ontology.domains else ""),
            ("Values", "" if is_annotation else self.values(name)),
            ("Required by", _links(owners)),
            ("Same as", _links(one for one in same if one != name)),
            ("Constraints", "<br>".join(map(_text, ontology.constraints.get(name, ())))),
        ]))  # fmt: skip

    def values(self, name: str) -> str:
        """Return what the values of a property may be: range, unit, limits, how many."""
        ontology = self.ontology
        target = ontology.ranges[name]
        kind = local_name(target)
        is_datatype = target.value.startswith(XSD)
        parts = [_text(_DATATYPES.get(kind, kind)) if is_datatype else _link(kind)]
        if unit := ontology.units.get(name):
            parts[0] += f" [{_text(unit)}]"
        if name in ontology.above:
            parts.append(f"&gt; {ontology.above[name]:g}")
        if choices := ontology.allowed.get(name):
            parts.append("one of " + ", ".join(f"<code>{_text(one)}</code>" for one in choices))
        many = "at most one" if name in ontology.functional else "any number"
        return f'{", ".join(parts)} <span class="tag">{many}</span>'

    # -- counterparts and index ----------------------------------------------------------------

    def counterparts(self) -> str:
        """Return the other vocabularies, and per class that has any its counterparts in each."""
        see = self.ontology.see_also
        about = (
            (f"<code>{prefix}:</code> {_text(name)}", f"<code>{_text(namespace)}</code>",
             str(sum(any(_is_in(iri, prefix) for iri in iris) for iris in see.values())))
            for prefix, (name, namespace) in VOCABULARIES.items()
        )  # fmt: skip
        rows = (
            (_link(cls), *(
                ", ".join(_counterpart(iri) for iri in see[cls] if _is_in(iri, prefix))
                for prefix in VOCABULARIES
            ))
            for cls in self.classes
            if cls in see
        )  # fmt: skip
        names = [_text(name) for name, _ in VOCABULARIES.values()]
        return "".join(
            f'<div class="all">{table}</div>\n'
            for table in (
                _table("vocabularies", ("Vocabulary", "Namespace", "Classes"), about),
                _table("props", ("Class", *names), rows),
            )
        )

    def initials(self) -> dict[str, list[str]]:
        """Return all terms by first letter, what they are called for "has" and the like left out.

        ``has_length`` is found under L.
        """
        found: dict[str, list[str]] = {}
        for name in sorted(self.ontology.kinds, key=lambda one: _sort_key(one)):
            found.setdefault(_sort_key(name)[0].upper(), []).append(name)
        return dict(sorted(found.items()))

    def index(self, initials: dict[str, list[str]]) -> Iterator[str]:
        kinds = {"Class": "class"}
        for letter, names in initials.items():
            items = "".join(
                f"<li>{_link(name)} "
                f'<span class="from">{kinds.get(self.ontology.kinds[name], "")}</span></li>'
                for name in names
            )
            yield f'<h3 class="letter" id="index-{_text(letter)}">{_text(letter)}</h3>\n'
            yield f'<ul class="index list">{items}</ul>\n'


def _sort_key(name: str) -> str:
    return re.sub(r"^has_?(?=[A-Za-z])", "", name).casefold()


def _is_in(iri: str, prefix: str) -> bool:
    return iri.startswith(VOCABULARIES[prefix][1])


def _counterpart(iri: str) -> str:
    """Return a term of another vocabulary by its prefix; it is no link, as few of them lead to a page."""
    for prefix, (_, namespace) in VOCABULARIES.items():
        if iri.startswith(namespace):
            return f'<code title="{_text(iri)}">{prefix}:{_text(iri[len(namespace) :])}</code>'
    return f"<code>{_text(iri)}</code>"
