"""Which parameter of the search space gives which value of a file's individuals."""

import pyoxigraph as ox

from bridgegen.pages.picture import Parameter
from bridgegen.scenario.ontology.graph import as_number
from bridgegen.scenario.ontology.layers import Members, texts
from bridgegen.scenario.ontology.phrases import Phrase
from bridgegen.scenario.ontology.vocabulary import Subject, bg, local_name


class Bindings:
    """The parameters of a file, and the values that they give.

    Attributes:
        parameters: per individual that is one.
    """

    def __init__(self, members: Members) -> None:
        self._members = members
        self.parameters = {
            node: Parameter(
                members.name(node), self._text(node, "has_unit"), self._number(node, "has_low"),
                self._number(node, "has_high"), self._text(node, "has_expression"),
            )
            for node in members.nodes
            if members.is_a(node, "Parameter")
        }  # fmt: skip

    def of(self, node: Subject, term: ox.NamedNode) -> str:
        """Return the name of the parameter that gives a property's value, or nothing."""
        if node in self.parameters:
            return self.parameters[node].name
        for one in self._members.values(node).get(bg("has_parameter"), ()):
            if isinstance(one, Subject) and one in self.parameters:
                binds = texts(self._members.values(one).get(bg("binds_property"), ()))
                if local_name(term) in binds:
                    return self.parameters[one].name
        return ""

    def bound(self, phrase: Phrase) -> list[tuple[str, float]]:
        """Return the parameters that give the values of a phrase, with the values."""
        found: list[tuple[str, float]] = []
        for node, term in phrase.bound:
            name = self.of(node, term)
            for value in self._members.values(node).get(term, ()) if name else ():
                number = as_number(value) if isinstance(value, ox.Literal) else None
                if number is not None and (name, number) not in found:
                    found.append((name, number))
        return found

    def _number(self, node: Subject, name: str) -> float | None:
        found = self._members.values(node).get(bg(name), [])
        return as_number(found[0]) if found and isinstance(found[0], ox.Literal) else None

    def _text(self, node: Subject, name: str) -> str:
        return next(iter(texts(self._members.values(node).get(bg(name), ()))), "")
