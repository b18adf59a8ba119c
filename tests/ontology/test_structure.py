"""What surely keeps all rules, SHACL finds right; what the product exports, surely keeps them."""

import math
from functools import cache

import numpy as np
import pyoxigraph as ox
import pytest

from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.ontology import check as checks
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.structure import Structure, property_shapes, requirements
from bridgegen.scenario.ontology.vocabulary import RDFS, SCENARIOS, TYPE, XSD, bg, tbox

SCENARIO = "crossroads-s4"


@cache
def built(name):
    scenario = load(name)
    space = scenario.space()
    rows = space.decode(np.random.default_rng(4).random((3, space.n_var)))
    return scenario, [build(scenario, space.values(row), driver="reference") for row in rows]


def shacl_alone(monkeypatch, individuals, scenario):
    with monkeypatch.context() as patched:
        patched.setattr(checks._Compiled, "surely_conform", lambda *_: False)
        return check(individuals, scenario)


@pytest.mark.thorough
@pytest.mark.parametrize("name", names())
def test_shacl_is_not_asked_of_what_is_right(name, monkeypatch):
    monkeypatch.setattr(checks._Compiled, "validate", lambda *_: pytest.fail("it was asked"))
    scenario, rows = built(name)
    for individuals in rows:
        assert check(Individuals(individuals.quads), scenario) == []


def mutated(quads, rng):
    """Return statements of which one is missing, doubled, of another kind or about another node."""
    quads = list(quads)
    # neither RDF's own statements nor names of properties: SHACL is asked of individuals
    kept = (TYPE, bg("binds_property"))
    i, j = rng.choice([k for k, quad in enumerate(quads) if quad.predicate not in kept], 2)
    one, other = quads[i], quads[j]
    value = one.object
    match int(rng.integers(0, 7)):
        case 0:
            del quads[i]
        case 1:
            quads[i] = ox.Quad(one.subject, one.predicate, other.object)
        case 2:
            quads.append(ox.Quad(one.subject, one.predicate, other.object))
        case 3:
            quads[i] = ox.Quad(other.subject, one.predicate, value)
        case 4 if isinstance(value, ox.Literal):
            kind = ("double", "integer", "string", "boolean", "decimal")[rng.integers(0, 5)]
            changed = ox.Literal(value.value, datatype=ox.NamedNode(XSD + kind))
            quads[i] = ox.Quad(one.subject, one.predicate, changed)
        case 5 if isinstance(value, ox.Literal):
            text = ("", "x", "0", "-1.5", "1e3", "NaN", "INF", " 1", "1.")[rng.integers(0, 9)]
            changed = ox.Literal(text, datatype=value.datatype)
            quads[i] = ox.Quad(one.subject, one.predicate, changed)
        case _:
            classes = [node for node in tbox().subclasses if node != value]
            cls = classes[rng.integers(0, len(classes))]
            typed = [k for k, quad in enumerate(quads) if quad.predicate == TYPE]
            k = typed[rng.integers(0, len(typed))]
            quads[k] = ox.Quad(quads[k].subject, TYPE, cls)
    return Individuals(quads)


@pytest.mark.thorough
@pytest.mark.parametrize("given", [SCENARIO, None])
def test_a_mutant_has_the_violations_that_shacl_finds(given, monkeypatch):
    """Not less of them where the answer comes without pyshacl, and not more."""
    scenario, rows = built(SCENARIO)
    rng, sure, broken = np.random.default_rng(11), 0, 0
    for _ in range(24):
        mutant = mutated(rows[0].quads, rng)
        against = scenario if given else None
        found = check(mutant, against)
        checks._compiled(against).conforming.clear()  # so that it is not remembered
        assert found == shacl_alone(monkeypatch, mutant, against)
        broken += bool(found)
        sure += not found
    assert broken >= 8
    assert sure >= 2


def structure_of(individuals, *added):
    return Structure((*individuals.quads, *added)).surely_holds(requirements())


def test_in_doubt_it_is_not_sure():
    """Of what SHACL takes, too: another spelling of a number, classes of a user."""
    _, (individuals, *_) = built(SCENARIO)
    ego = ox.NamedNode(f"{SCENARIOS}{SCENARIO}#ego")
    assert structure_of(individuals)
    taxi = ox.NamedNode("urn:own#Taxi")
    assert not structure_of(
        individuals, ox.Quad(taxi, ox.NamedNode(RDFS + "subClassOf"), bg("Car"))
    )
    assert not structure_of(individuals, ox.Quad(ego, bg("has_wheelbase"), ox.Literal(math.inf)))


def test_each_kind_of_shape_is_declared():
    """What the mutants are about exists."""
    shapes = property_shapes()
    for kind in ("single", "allowed", "is_data"):
        assert any(getattr(one, kind) for one in shapes)
        assert not all(getattr(one, kind) for one in shapes)
    assert any(one.above is not None for one in shapes)
