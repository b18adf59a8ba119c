"""Regions of categories and angles: rules in names, and classes that hold these names."""

from pathlib import Path

import numpy as np
import pyoxigraph as ox
import pytest

from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.vocabulary import OWL, RDF
from bridgegen.search.regions.box import Box, Evidence, conditions, whole
from bridgegen.search.regions.find import Found, Region
from bridgegen.search.regions.owl import carriers, classes, statable
from bridgegen.search.regions.record import to_json

SCENARIO = load(Path(__file__).parents[2] / "docs/examples/braking-manner.yaml")
SPACE = SCENARIO.space()


def region(**edges):
    outer = whole(SPACE)
    low, high = outer.low.copy(), outer.high.copy()
    for name, (a, b) in edges.items():
        low[SPACE.variables.index(name)], high[SPACE.variables.index(name)] = a, b
    return Region(Box(low, high), Evidence(30, 29), Evidence(300, 252, 1), 0.0123, True)


@pytest.mark.parametrize(
    ("edges", "rule"),
    [
        ({"manner": (1.0, 2.0)}, "manner in {firm, emergency}"),
        ({"manner": (2.0, 2.0)}, "manner = emergency"),
        ({"wind_from": (300.0, 370.5)}, "wind_from in 300 .. 10.5 deg"),
        ({"wind_from": (355.0, 420.0)}, "wind_from in 355 .. 60 deg"),
        ({"gap": (30.0, 60.0)}, "gap ≥ 30 m"),
    ],
)
def test_rules_state_names_and_angles_within_one_turn(edges, rule):
    assert conditions(region(**edges).box, SPACE) == [rule]


def test_the_record_says_how_values_are_read():
    found = to_json(Found((), 0, 0, 0, 0.0, 0), SPACE, "reference")
    said = {one["name"]: one for one in found["parameters"]}
    assert said["manner"]["words"] == ["gentle", "firm", "emergency"]
    assert said["wind_from"]["turn"] == 360.0
    assert "words" not in said["gap"]


def test_a_class_names_the_values_that_a_reasoner_compares():
    x = SPACE.decode(np.random.default_rng(0).random((1, SPACE.n_var)))[0]
    individuals = build(SCENARIO, SPACE.values(x), driver="reference")
    carried = carriers(individuals, SPACE.values(x), SPACE.parameters)
    one = region(manner=(1.0, 2.0))
    assert statable(one, SPACE, carried)
    assert (carried["manner"].path, carried["manner"].property) == (
        ("has_parameter_declaration",), "has_word",
    )  # fmt: skip
    stated = classes({1: one}, SPACE, carried, driver="reference", origin="a test")
    said = {(q.subject, q.predicate.value): q.object for q in stated.quads}
    (head,) = [end for (_, predicate), end in said.items() if predicate == OWL + "oneOf"]
    names = []
    while head != ox.NamedNode(RDF + "nil"):
        names.append(said[head, RDF + "first"].value)
        head = said[head, RDF + "rest"]
    assert names == ["firm", "emergency"]
