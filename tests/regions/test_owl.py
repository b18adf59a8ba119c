import numpy as np
import pyoxigraph as ox
import pytest
from tests.approval import approve

from bridgegen.scenario.language.kinds import INTEGER
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load as load_scenario
from bridgegen.scenario.ontology.files import from_bytes, load, save, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.vocabulary import LABEL, OWL, RDF, RDFS, XSD, local_name, tbox
from bridgegen.search.regions.box import Box, Evidence, whole
from bridgegen.search.regions.find import Region
from bridgegen.search.regions.owl import carriers, classes, statable

SCENARIO = load_scenario("crossroads-s4")
SPACE = SCENARIO.space(tuple(Axis))
EDGES = {
    "lanes_per_direction": (2, 3), "fog_density": (5.0, 80.0), "bv_start": (7.0, 20.0),
    "bv_trigger_time": (2.5, 10.0),
}  # fmt: skip


def row(seed):
    return SPACE.decode(np.random.default_rng(seed).random((1, SPACE.n_var)))[0]


def individuals(x):
    return build(SCENARIO, SPACE.values(x), driver="route-follower")


def box(**edges):
    outer = whole(SPACE)
    low, high = outer.low.copy(), outer.high.copy()
    for name, (a, b) in edges.items():
        low[SPACE.variables.index(name)], high[SPACE.variables.index(name)] = a, b
    return Box(low, high)


def region(**edges):
    return Region(box(**edges), Evidence(30, 29), Evidence(300, 252, 1), 0.0123, True)


def stated(*regions):
    carried = carriers(individuals(row(0)), SPACE.values(row(0)), SPACE.parameters)
    numbered = dict(enumerate(regions, start=1))
    return classes(numbered, SPACE, carried, driver="route-follower", origin="a test")


class Asserted:
    """Reads a class expression, and says of an individual whether it is asserted to be one.

    Every part of these expressions is positive, so what is asserted is what a reasoner infers.
    """

    def __init__(self, *parts: Individuals) -> None:
        self.said: dict = {}
        for quad in (quad for part in parts for quad in part.quads):
            self.said.setdefault((quad.subject, quad.predicate), []).append(quad.object)

    def get(self, node, name, base=OWL):
        (found,) = self.said[node, ox.NamedNode(base + name)]
        return found

    def items(self, head):
        while head != ox.NamedNode(RDF + "nil"):
            yield self.get(head, "first", RDF)
            head = self.get(head, "rest", RDF)

    def has(self, node, name, base=OWL):
        return (node, ox.NamedNode(base + name)) in self.said

    def is_a(self, node, cls) -> bool:
        if self.has(cls, "equivalentClass"):
            cls = self.get(cls, "equivalentClass")
        if isinstance(cls, ox.NamedNode):
            return cls in self.said.get((node, ox.NamedNode(RDF + "type")), ())
        if self.has(cls, "intersectionOf"):
            return all(self.is_a(node, one) for one in self.items(self.get(cls, "intersectionOf")))
        values = self.said.get((node, self.get(cls, "onProperty")), ())
        if self.has(cls, "hasValue"):
            return self.get(cls, "hasValue") in values
        filler = self.get(cls, "someValuesFrom")
        if self.has(filler, "onDatatype"):
            return any(self.within(value, filler) for value in values)
        return any(self.is_a(value, filler) for value in values)

    def within(self, value, datatype) -> bool:
        assert value.datatype == self.get(datatype, "onDatatype")
        held = []
        for facet in self.items(self.get(datatype, "withRestrictions")):
            ((name, end),) = [
                (name, self.get(facet, name, XSD))
                for name in ("minInclusive", "maxInclusive")
                if self.has(facet, name, XSD)
            ]
            assert end.datatype == value.datatype  # the values of two datatypes are never equal
            number, edge = float(value.value), float(end.value)
            held.append(number >= edge if name == "minInclusive" else number <= edge)
        return all(held)


def class_of(statements, number=1):
    (found,) = [
        quad.subject
        for quad in statements.quads
        if quad.predicate == LABEL and quad.object.value.startswith(f"critical region {number} ")
    ]
    return found


def scenario_of(them):
    return them.one("Scenario")


def test_a_class_holds_the_scenarios_of_its_box_and_no_others():
    statements = stated(region(**EDGES))
    inside = 0
    for seed in range(60):
        x = row(seed)
        held = box(**EDGES).holds(x[[SPACE.index(name) for name in SPACE.variables]][None])[0]
        them = individuals(x)
        assert Asserted(them, statements).is_a(scenario_of(them), class_of(statements)) == held
        inside += held
    assert 3 < inside < 50


@pytest.mark.parametrize("name", SPACE.variables)
def test_every_parameter_is_carried_and_its_edges_count_as_inside(name):
    x = row(1)
    value = SPACE.values(x)[name]
    outer = SPACE.parameters[name]
    whole_numbers = outer.kind == INTEGER
    beyond = value + 1 if whole_numbers else np.nextafter(value, np.inf)
    below = value - 1 if whole_numbers else np.nextafter(value, -np.inf)
    them = individuals(x)
    for edges, held in (
        ((value, outer.high), True), ((outer.low, value), True),
        ((beyond, outer.high), False), ((outer.low, below), False),
    ):  # fmt: skip
        statements = stated(region(**{name: edges}))
        if not outer.low <= edges[0] <= edges[1] <= outer.high or edges == (outer.low, outer.high):
            continue
        assert Asserted(them, statements).is_a(scenario_of(them), class_of(statements)) == held


def test_a_scenario_of_another_name_is_in_no_region():
    statements = stated(region())
    other = load_scenario("crossroads-s3")
    values = other.space().values(other.space().row({}))
    them = build(other, values, driver="route-follower")
    assert not Asserted(them, statements).is_a(scenario_of(them), class_of(statements))
    them = individuals(row(0))
    assert Asserted(them, statements).is_a(scenario_of(them), class_of(statements))


def test_a_class_says_what_is_known_of_it():
    statements = stated(region(**EDGES), region(fog_density=(61.0, 100.0)))
    said = {
        local_name(quad.predicate): quad.object
        for quad in statements.quads
        if quad.subject == class_of(statements, 2) and isinstance(quad.object, ox.Literal)
    }
    approve(said["comment"].value, "fog_density", "61")
    numbers = {name: float(one.value) for name, one in said.items() if one.datatype.value in (
        XSD + "double", XSD + "integer")}  # fmt: skip
    low, high = Evidence(300, 252).interval
    assert numbers.items() >= {
        "fresh_rows": 300, "fresh_critical": 252, "fresh_share": 0.84, "fresh_failed": 1,
        "fresh_share_low": low, "fresh_share_high": high, "search_rows": 30,
        "search_critical": 29, "space_share": 0.0123,
    }.items()  # fmt: skip
    declared = {
        local_name(quad.subject)
        for quad in statements.quads
        if quad.object == ox.NamedNode(OWL + "AnnotationProperty")
    }
    assert numbers.keys() <= declared


def test_a_file_holds_what_was_stated_and_is_the_same_each_time(tmp_path):
    statements = stated(region(**EDGES), region(bv_start=(7.0, 9.5)))
    save(statements, tmp_path / "regions.owl")
    again = load(tmp_path / "regions.owl")
    assert len(again) == len(statements)
    assert to_bytes(statements) == to_bytes(stated(region(**EDGES), region(bv_start=(7.0, 9.5))))
    for seed in range(10):
        them = individuals(row(seed))
        for number in (1, 2):
            before, after = (
                Asserted(them, one).is_a(scenario_of(them), class_of(one, number))
                for one in (statements, again)
            )
            assert before == after


def test_regions_of_two_runs_have_names_of_their_own():
    one, other = (stated(region(bv_start=(7.0, end))) for end in (9.5, 9.6))
    assert class_of(one) != class_of(other)


def test_what_no_individual_carries_cannot_be_stated():
    carried = carriers(individuals(row(0)), SPACE.values(row(0)), SPACE.parameters)
    assert set(SPACE.variables) <= set(carried)
    del carried["fog_density"]
    assert not statable(region(**EDGES), SPACE, carried)
    assert statable(region(bv_start=(7.0, 9.5)), SPACE, carried)


def test_terms_are_the_ontology_s():
    known = {*tbox().kinds}
    for quad in stated(region(**EDGES)).quads:
        if quad.predicate in (
            ox.NamedNode(OWL + "onProperty"), ox.NamedNode(RDFS + "subClassOf")
        ):  # fmt: skip
            assert local_name(quad.object) in known


@pytest.mark.reasoner
def test_a_reasoner_tells_which_region_a_scenario_lies_in(tmp_path):
    from bridgegen.base.errors import InputError
    from bridgegen.scenario.ontology.reasoner import reason, require

    try:
        require()
    except InputError as missing:
        pytest.skip(str(missing))
    rows = [row(seed) for seed in range(40)]
    columns = [SPACE.index(name) for name in SPACE.variables]
    held = [bool(box(**EDGES).holds(x[columns][None])[0]) for x in rows]
    save(stated(region(**EDGES)), tmp_path / "regions.owl")
    classes_read = from_bytes((tmp_path / "regions.owl").read_bytes())
    for inside in (True, False):
        them = individuals(rows[held.index(inside)])
        found = reason(Individuals([*them.quads, *classes_read.quads]))
        assert found.problems == []
        (types,) = [kinds for iri, kinds in found.types.items() if iri.endswith("#scenario")]
        assert ("region_1" in types) == inside
