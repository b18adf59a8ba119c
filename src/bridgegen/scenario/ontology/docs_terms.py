"""The documentation page's entries for classes and properties."""

from collections.abc import Callable, Iterable

from bridgegen.scenario.ontology.layers import LAYERS
from bridgegen.scenario.ontology.markup import definitions, escaped, link, links, table_of
from bridgegen.scenario.ontology.vocabulary import VOCABULARIES, XSD, TBox, local_name

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
