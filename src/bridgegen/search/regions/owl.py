"""Regions as classes of the ontology: a reasoner infers which regions contain a scenario.

A class is equivalent to a conjunction, in Manchester syntax:

    Scenario and (has_name value "crossroads-s4")
      and (has_event some (has_what some ((has_parameter some (has_name value "bv_speed"))
           and (has_target_speed some xsd:double[>= 1.2, <= 2.0]))))

that is: this property path leads from the scenario to an individual that is bound to the parameter
of that name and has a value in that range. The path is that of an exported scenario's individuals.
(A shorter path, from the parameter by the inverse of ``has_parameter``, takes HermiT more than ten
times as long.)
"""

import hashlib
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from urllib.parse import quote

import pyoxigraph as ox

from bridgegen.scenario.language.kinds import FLOAT
from bridgegen.scenario.language.parameters import Parameter
from bridgegen.scenario.language.space import SearchSpace
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import (
    COMMENT,
    EQUIVALENT_CLASS,
    INTEGER,
    LABEL,
    ONTOLOGY,
    OWL,
    OWL_ONTOLOGY,
    RDF,
    RDFS,
    TYPE,
    VERSION_INFO,
    XSD,
    Subject,
    bg,
    local_name,
    tbox,
)
from bridgegen.search.regions.box import Box, Evidence, sentence, whole
from bridgegen.search.regions.find import Region

REGIONS = ONTOLOGY + "/regions"

_CLASS, _RESTRICTION = ox.NamedNode(OWL + "Class"), ox.NamedNode(OWL + "Restriction")
_ANNOTATIONS = {
    "fresh_rows": "Random scenarios of the region that were simulated.",
    "fresh_critical": "Critical ones among the fresh rows.",
    "fresh_share": "Share of critical ones among the fresh rows: what counts.",
    "fresh_share_low": "Lower end of the share's 95 % confidence interval (Clopper-Pearson).",
    "fresh_share_high": "Upper end of the share's 95 % confidence interval (Clopper-Pearson).",
    "fresh_failed": "Random scenarios of the region whose simulation failed.",
    "search_rows": "Rows of the run that lie in the region; the search chose them.",
    "search_critical": "Critical ones among the run's rows in the region.",
    "search_share": "Share of critical ones among the run's rows in the region; biased.",
    "search_share_low": "Lower end of its interval, were these rows random.",
    "search_share_high": "Upper end of its interval, were these rows random.",
    "space_share": "Share of the search space's random scenarios that lie in the region.",
}


@dataclass(frozen=True)
class Carrier:
    """The place of a parameter's value among a scenario's individuals.

    Attributes:
        path: the object properties from the scenario to the individual.
        property: the data property with the value.
        datatype: of that property.
    """

    path: tuple[str, ...]
    property: str
    datatype: ox.NamedNode


def carriers(
    individuals: Individuals, values: Mapping[str, float], parameters: Mapping[str, Parameter]
) -> dict[str, Carrier]:
    """Return the carrier of each parameter's value.

    Args:
        individuals: of one row.
        values: of that row, by name; generic, so that no two parameters are equal by chance.
        parameters: the parameters that vary, by name.
    """
    paths = _paths(individuals)
    found = {}
    for name, bound in individuals.bindings.items():
        ways = [
            (len(paths[node]), paths[node], carried)
            for node, carried in bound
            if node in paths and _has(individuals, node, carried, parameters, name, values)
        ]
        if ways:
            # The shortest path, then by name: the same class in each run.
            _, path, carried = min(ways)
            found[name] = Carrier(path, carried, tbox().ranges[carried])
    return found


def _has(
    individuals: Individuals,
    node: Subject,
    carried: str,
    parameters: Mapping[str, Parameter],
    name: str,
    values: Mapping[str, float],
) -> bool:
    """Return whether an individual has the value of a parameter."""
    if name not in values:
        return False
    kind = parameters[name].kind if name in parameters else FLOAT
    if kind.names:
        return individuals.optional_text(node, carried) == kind.text(values[name], repr)
    return individuals.optional_number(node, carried) == values[name]


def _paths(individuals: Individuals) -> dict[Subject, tuple[str, ...]]:
    """Return a shortest path from the scenario to each individual, nearest first."""
    links: dict[Subject, list[tuple[str, Subject]]] = {}
    for quad in individuals.quads:
        name = local_name(quad.predicate)
        if (
            tbox().kinds.get(name) == "ObjectProperty"
            and name != "has_parameter"
            and isinstance(quad.subject, Subject)
            and isinstance(quad.object, Subject)
        ):
            links.setdefault(quad.subject, []).append((name, quad.object))
    top = individuals.one("Scenario")
    paths: dict[Subject, tuple[str, ...]] = {top: ()}
    todo = [top]
    for node in todo:
        for name, other in links.get(node, ()):
            if other not in paths:
                paths[other] = (*paths[node], name)
                todo.append(other)
    return paths


def statable(region: Region, space: SearchSpace, carried: Mapping[str, Carrier]) -> bool:
    """Return whether the ontology contains every parameter that a region's rule names."""
    named = region.box.narrows(whole(space))
    return all(name in carried for name, item in zip(space.variables, named, strict=True) if item)


def classes(
    regions: Mapping[int, Region],
    space: SearchSpace,
    carried: Mapping[str, Carrier],
    *,
    driver: str,
    origin: str,
) -> Individuals:
    """Return the statements that define a class for each region.

    Args:
        regions: by number; each is `statable`.
        space: the search space.
        carried: the carriers of its parameters.
        driver: the ego's driver.
        origin: the source of the regions, in words.
    """
    writer = _Writer(space, carried)
    digest = hashlib.sha256(repr([space.name, driver]).encode())
    for item in regions.values():
        digest.update(item.box.low.tobytes() + item.box.high.tobytes())
    # Regions of several runs may be loaded together, so the names contain the run's digest.
    name = quote(space.name, safe="")
    header = ox.NamedNode(f"{REGIONS}/{name}/{digest.hexdigest()[:12]}")
    writer.put(header, TYPE, OWL_ONTOLOGY)
    writer.put(
        header, VERSION_INFO, ox.Literal(f"made with the BridgeGen ontology {tbox().version}")
    )
    about = f"Critical regions of {space.name} for {driver}, found in {origin}."
    writer.put(header, COMMENT, ox.Literal(about))
    for term, text in _ANNOTATIONS.items():
        node = _annotation(term)
        writer.put(node, TYPE, ox.NamedNode(OWL + "AnnotationProperty"))
        writer.put(node, LABEL, ox.Literal(term.replace("_", " ")))
        writer.put(node, COMMENT, ox.Literal(text))
    for number, region in regions.items():
        writer.region(ox.NamedNode(f"{header.value}#region_{number}"), number, region, driver)
    return Individuals(writer.quads)


class _Writer:
    """Collects quads."""

    def __init__(self, space: SearchSpace, carried: Mapping[str, Carrier]) -> None:
        self._space, self._carried = space, carried
        self.quads: list[ox.Quad] = []
        self._count = 0

    def put(
        self,
        node: Subject,
        predicate: ox.NamedNode,
        value: ox.NamedNode | ox.BlankNode | ox.Literal,
    ) -> None:
        """Add a statement."""
        self.quads.append(ox.Quad(node, predicate, value))

    def _anonymous(self) -> ox.BlankNode:
        self._count += 1
        return ox.BlankNode(f"part{self._count}")  # a random name would differ each time

    def region(self, node: ox.NamedNode, number: int, region: Region, driver: str) -> None:
        """Define the class of a region, annotated with its evidence."""
        name = self._space.name
        self.put(node, TYPE, _CLASS)
        self.put(node, LABEL, ox.Literal(f"critical region {number} of {name}"))
        words = sentence(region.box, self._space, driver, region.fresh)
        self.put(node, COMMENT, ox.Literal(words))
        facts = {**_facts("fresh", region.fresh), **_facts("search", region.search)}
        facts |= {"fresh_failed": region.fresh.failed, "space_share": region.space_share}
        for term, value in facts.items():
            self.put(node, _annotation(term), ox.Literal(value))
        parts: list[ox.NamedNode | ox.BlankNode] = [bg("Scenario"), self._named(name)]
        self.put(node, EQUIVALENT_CLASS, self._all([*parts, *self._conditions(region.box)]))

    def _conditions(self, box: Box) -> list[ox.BlankNode]:
        outer = whole(self._space)
        found = []
        for k in box.narrows(outer).nonzero()[0].tolist():
            name = self._space.variables[k]
            carrier = self._carried[name]
            # An end of the whole range needs no facet: no scenario lies beyond it.
            low = float(box.low[k]) if box.low[k] > outer.low[k] else None
            high = float(box.high[k]) if box.high[k] < outer.high[k] else None
            names = self._space.parameters[name].kind.within(float(box.low[k]), float(box.high[k]))
            values = self._one_of(names) if names else self._range(carrier.datatype, low, high)
            value = self._some(carrier.property, values)
            bound = self._some("has_parameter", self._named(name))
            there = self._all([bound, value])
            # From the inside out: the class expression of the last step is the filler of the one
            # before.
            for step in reversed(carrier.path):
                there = self._some(step, there)
            found.append(there)
        return found

    def _named(self, name: str) -> ox.BlankNode:
        node = self._restriction("has_name")
        self.put(node, ox.NamedNode(OWL + "hasValue"), ox.Literal(name))
        return node

    def _some(self, prop: str, filler: ox.NamedNode | ox.BlankNode) -> ox.BlankNode:
        node = self._restriction(prop)
        self.put(node, ox.NamedNode(OWL + "someValuesFrom"), filler)
        return node

    def _restriction(self, prop: str) -> ox.BlankNode:
        node = self._anonymous()
        self.put(node, TYPE, _RESTRICTION)
        self.put(node, ox.NamedNode(OWL + "onProperty"), bg(prop))
        return node

    def _all(self, parts: Sequence[ox.NamedNode | ox.BlankNode]) -> ox.BlankNode:
        node = self._anonymous()
        self.put(node, TYPE, _CLASS)
        self.put(node, ox.NamedNode(OWL + "intersectionOf"), self._list(parts))
        return node

    def _range(self, datatype: ox.NamedNode, low: float | None, high: float | None) -> ox.BlankNode:
        """Return the values of a datatype between two inclusive bounds."""
        facets = []
        for facet, end in (("minInclusive", low), ("maxInclusive", high)):
            if end is not None:
                item = self._anonymous()
                number = int(end) if datatype == INTEGER else end
                self.put(item, ox.NamedNode(XSD + facet), ox.Literal(number))
                facets.append(item)
        node = self._anonymous()
        self.put(node, TYPE, ox.NamedNode(RDFS + "Datatype"))
        self.put(node, ox.NamedNode(OWL + "onDatatype"), datatype)
        self.put(node, ox.NamedNode(OWL + "withRestrictions"), self._list(facets))
        return node

    def _one_of(self, names: Sequence[str]) -> ox.BlankNode:
        """Return the data range of a list of texts."""
        node = self._anonymous()
        self.put(node, TYPE, ox.NamedNode(RDFS + "Datatype"))
        self.put(
            node, ox.NamedNode(OWL + "oneOf"), self._list([ox.Literal(name) for name in names])
        )
        return node

    def _list(
        self, parts: Sequence[ox.NamedNode | ox.BlankNode | ox.Literal]
    ) -> ox.NamedNode | ox.BlankNode:
        head: ox.NamedNode | ox.BlankNode = ox.NamedNode(RDF + "nil")
        for part in reversed(parts):
            node = self._anonymous()
            self.put(node, ox.NamedNode(RDF + "first"), part)
            self.put(node, ox.NamedNode(RDF + "rest"), head)
            head = node
        return head


def _annotation(term: str) -> ox.NamedNode:
    return ox.NamedNode(f"{REGIONS}#{term}")


def _facts(of: str, evidence: Evidence) -> dict[str, int | float]:
    low, high = evidence.interval
    facts: dict[str, int | float] = {
        f"{of}_rows": evidence.rows,
        f"{of}_critical": evidence.critical,
        f"{of}_share_low": low,
        f"{of}_share_high": high,
    }
    return facts if evidence.share is None else {**facts, f"{of}_share": evidence.share}
