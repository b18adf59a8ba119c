"""Does a scenario keep its rules? Answers in sentences that a person understands.

SHACL decides (`shapes`, run by pyshacl over a ``pyoxigraph.Store``) and `words` phrases the result.
Individuals that surely keep all rules are found without pyshacl, in a quarter of its time: their
structure by `structure`, the queries by Oxigraph alone. Whatever is in doubt, pyshacl is asked,
which is imported then.
"""

import logging
from collections.abc import Iterator, Sequence, Set
from contextlib import contextmanager
from functools import cache, cached_property
from typing import TYPE_CHECKING, Any, cast

import pyoxigraph as ox

from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.rule import Rule
from bridgegen.scenario.ontology.shapes import required, rules, structure, turtle
from bridgegen.scenario.ontology.structure import Node, Structure
from bridgegen.scenario.ontology.vocabulary import PREFIXES, SUBCLASS, TYPE, bg, local_name, tbox
from bridgegen.scenario.ontology.words import Finding, Violation, violations_of

if TYPE_CHECKING:
    from bridgegen.scenario.language.scenario import LogicalScenario

__all__ = ["Violation", "check", "constraints_in_words"]

_SH = "http://www.w3.org/ns/shacl#"
_KEPT = 8
"""Number of compiled scenarios that are kept, and for each, of individuals that conform to it."""


def check(individuals: Individuals, scenario: "LogicalScenario | None" = None) -> list[Violation]:
    """Return every rule that the individuals break; nothing if they are as they should be.

    Args:
        individuals: of one scenario.
        scenario: the logical scenario whose ranges, bounds and formulas they must keep; without
            it, the ranges that the individuals declare themselves.
    """
    compiled, quads = _compiled(scenario), frozenset(individuals.quads)
    # A scenario may be checked when it is built and again when it is exported; the second is free.
    if quads in compiled.conforming:
        return []
    store = ox.Store()
    store.extend(individuals.quads)
    # Not all of the ontology: shapes need its subclasses only, and each query looks at fewer
    # statements.
    store.extend(_hierarchy())
    terms = _terms(individuals)
    # A search checks each scenario that it builds, and nearly all conform: 38 → 10 ms
    # (crossroads-s4), and pyshacl and rdflib are not even imported.
    if compiled.surely_conform(individuals, store, terms):
        found = {}
    else:
        found = {
            (violation.nodes, violation.message): violation
            for finding in compiled.validate(store, terms)
            for violation in violations_of(individuals, scenario, compiled.rules, finding)
        }
    if not found:
        _keep(compiled.conforming, quads, True)
    return sorted(found.values(), key=lambda violation: (violation.individual, violation.message))


def constraints_in_words(scenario: "LogicalScenario | None" = None) -> str:
    """Return how many constraints `check` holds individuals against, and where they are from."""
    own, general = len(rules(scenario)), structure().count(" a sh:PropertyShape ")
    whose = f"of scenario {scenario.name}" if scenario else "of every scenario"
    return f"{own + general} constraints checked ({own} {whose}, {general} of the ontology)"


@cache
def _hierarchy() -> tuple[ox.Quad, ...]:
    """Return the subclass relations: shapes apply to subclasses through them."""
    return tuple(quad for quad in tbox().quads if quad.predicate == SUBCLASS)


def _terms(individuals: Individuals) -> frozenset[str]:
    """Return the local names of the properties and classes that occur, superclasses included."""
    names = {local_name(quad.predicate) for quad in individuals.quads}
    types = {quad.object for quad in individuals.quads if quad.predicate == TYPE}
    for cls in tbox().subclasses:
        if not types.isdisjoint(individuals.subclasses(local_name(cls))):
            names.add(local_name(cls))
    return frozenset(names)


class _Compiled:
    """The shapes of one scenario.

    Args:
        text: in Turtle.
        rules: those among them that are queries.
        required: (class, property) where each individual of the class must have a value.
    """

    def __init__(
        self, text: str, rules: Sequence[Rule], required: Sequence[tuple[str, str]]
    ) -> None:
        self.rules: dict[str, Rule] = {rule.key: rule for rule in rules}
        self.conforming: dict[frozenset[ox.Quad], bool] = {}
        self._text, self._required = text, required

    @cached_property
    def _shapes(self) -> Any:
        """All of them, as pyshacl has read them."""
        import rdflib
        from pyshacl.graph_abstraction import to_rdf
        from pyshacl.shapes_graph import ShapesGraph

        graph = rdflib.Graph()
        for quad in ox.parse(self._text, format=ox.RdfFormat.TURTLE):
            graph.add((to_rdf(quad.subject), to_rdf(quad.predicate), to_rdf(quad.object)))
        return ShapesGraph(graph)

    @cached_property
    def _needs(self) -> dict[str, frozenset[str]]:
        """Per shape, by its IRI, the terms without which it finds nothing to check."""
        nodes = [str(shape.node) for shape in self._shapes.shapes]  # builds them, once
        return {node: self._needs_of(local_name(node)) for node in nodes}

    def _needs_of(self, key: str) -> frozenset[str]:
        if key in self.rules:
            return frozenset({self.rules[key].focus, *self.rules[key].needs})
        first, _, rest = key.partition("-")
        return frozenset({rest if first == "property" else first})

    def surely_conform(self, individuals: Individuals, store: ox.Store, terms: Set[str]) -> bool:
        """Return whether individuals surely keep all shapes; if not, `validate` says.

        Args:
            individuals: in question.
            store: of them and of the subclass relations.
            terms: that occur.
        """
        held = Structure(individuals.quads)
        return held.surely_holds(self._required) and not any(
            _is_broken(rule, store, focus)
            for key, rule in self.rules.items()
            if self._needs_of(key) <= terms
            for focus in held.instances(bg(rule.focus))
        )

    def validate(self, store: ox.Store, terms: Set[str]) -> Iterator[Finding]:
        """Yield what the shapes find, but for those whose terms do not occur."""
        from pyshacl.graph_abstraction import DataGraph
        from pyshacl.validator import Validator
        from rdflib import Literal, URIRef

        # pyshacl.validate() would read the shapes anew at each call
        validator = Validator(
            DataGraph.from_oxigraph_store(store),
            shacl_graph=self._shapes.graph,
            # A shape whose terms do not occur cannot find anything, and pyshacl takes 0.3 ms a
            # query before it has begun.
            options={"use_shapes": [item for item, needs in self._needs.items() if needs <= terms]},
        )
        validator.shacl_graph = self._shapes
        with _quiet():
            conforms, report, _ = validator.run()
        if conforms:
            return

        def text_of(result: Any, name: str) -> Any:
            return report.value(result, URIRef(_SH + name))

        for result in report.objects(None, URIRef(_SH + "result")):
            value = text_of(result, "value")
            yield Finding(
                shape=str(text_of(result, "sourceShape")),
                component=str(text_of(result, "sourceConstraintComponent")),
                focus=str(text_of(result, "focusNode")),
                value=str(value) if value is not None else None,
                literal=isinstance(value, Literal),
                message=str(text_of(result, "resultMessage")),
            )


def _is_broken(rule: Rule, store: ox.Store, focus: Node) -> bool:
    """Return whether a rule's query finds anything of one individual, as SHACL evaluates it."""
    found = store.query(
        rule.select,
        prefixes=PREFIXES,
        use_default_graph_as_union=True,
        substitutions={ox.Variable("this"): focus},
    )
    return any(True for _ in cast(ox.QuerySolutions, found))


_of_scenario: dict[int, tuple["LogicalScenario | None", _Compiled]] = {}
_of_text: dict[str, _Compiled] = {}


def _compiled(scenario: "LogicalScenario | None") -> _Compiled:
    """Return the shapes of a scenario, made at the first check of one with these shapes."""
    kept = _of_scenario.get(id(scenario))  # has no hash; being kept here, its id stays its own
    if kept is None:
        text = turtle(scenario)
        compiled = _of_text.get(text) or _Compiled(text, rules(scenario), required(scenario))
        _keep(_of_text, text, compiled)
        kept = (scenario, compiled)
        _keep(_of_scenario, id(scenario), kept)
    return kept[1]


def _keep(kept: dict[Any, Any], key: Any, value: Any) -> None:
    """Keep a value, and forget the first of those that are too many."""
    while len(kept) >= _KEPT and key not in kept:
        kept.pop(next(iter(kept)))
    kept[key] = value


@contextmanager
def _quiet() -> Iterator[None]:
    """Keep rdflib from logging a traceback for each ill-typed literal: it is a finding."""
    logger = logging.getLogger("rdflib.term")

    def refuse(_: logging.LogRecord) -> bool:
        return False

    logger.addFilter(refuse)
    try:
        yield
    finally:
        logger.removeFilter(refuse)
