"""Categories and angles in individuals, in OpenSCENARIO files, and back."""

from pathlib import Path

import numpy as np
import pyoxigraph as ox
import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError, OntologyError
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.openscenario import distributions as dst
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.ranges import ranges_of
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.openx.openscenario.validate import problems
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import from_bytes, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build

SCENARIO = load(Path(__file__).parents[3] / "docs/examples/braking-manner.yaml")
SPACE = SCENARIO.space(tuple(Axis))


def individuals(u) -> Individuals:
    return build(SCENARIO, SPACE.values(SPACE.decode([u])[0]), driver="reference")


def with_word(them: Individuals, word: str) -> Individuals:
    return Individuals(
        [
            ox.Quad(one.subject, one.predicate, ox.Literal(word))
            if one.predicate.value.endswith("#has_word")
            else one
            for one in them.quads
        ]
    )


def declared(storyboard) -> dict[str, osc.ParameterDeclaration]:
    return {one.name: one for one in storyboard.parameter_declarations.parameters}


@settings(max_examples=15, deadline=None, suppress_health_check=[HealthCheck.too_slow])
@given(st.integers(0, 2**32 - 1))
def test_a_row_survives_files_and_keeps_every_rule(seed):
    u = np.random.default_rng(seed).random(SPACE.n_var)
    them = from_bytes(to_bytes(individuals(u)), "made.owl")
    values = SPACE.values(SPACE.decode([u])[0])
    assert check(them, SCENARIO) == []
    assert check(them) == []
    storyboard, roads = openscenario_from_owl(them, "made.xodr"), opendrive_from_owl(them)
    assert problems(storyboard, roads) == []
    said = declared(storyboard)
    assert said["manner"].parameter_type is osc.ParameterType.STRING
    assert said["manner"].value == ("gentle", "firm", "emergency")[int(values["manner"])]
    assert float(said["wind_from"].value) == pytest.approx(values["wind_from"], abs=1e-9)
    back, lost = individuals_from_openscenario(storyboard, roads, "made.xodr", "")
    assert lost == []
    assert check(back, SCENARIO) == []
    assert openscenario_from_owl(back, "made.xodr") == storyboard


def test_a_word_that_is_not_allowed_is_found():
    them = with_word(individuals(np.full(SPACE.n_var, 0.5)), "wild")
    said = (
        "manner (Parameter): manner is one of gentle, firm, emergency must hold for manner [1], "
        "got 'wild'"
    )
    assert said in [str(one) for one in check(them, SCENARIO)]
    (found,) = check(them)  # by the names that the individuals state themselves
    approve(str(found), "category")
    with refuses(OntologyError, "manner", "wild"):
        openscenario_from_owl(them, "made.xodr")


def test_a_formula_that_the_names_break_is_found():
    them = individuals(np.full(SPACE.n_var, 0.5))  # firm
    found = [str(one) for one in check(with_word(them, "gentle"), SCENARIO)]
    assert len(found) == 1
    approve(found[0], "deceleration", "wind_from", "2.2")


# -- a file whose text varies ----------------------------------------------------------------------


def exported() -> osc.OpenScenario:
    return openscenario_from_owl(individuals(np.full(SPACE.n_var, 0.5)), "made.xodr")


def of(name: str, *words: str) -> dst.Deterministic:
    elements = tuple(map(dst.DistributionSetElement, words))
    return dst.Deterministic(
        (dst.DeterministicSingleParameterDistribution(name, dst.DistributionSet(elements)),)
    )


def test_a_distribution_lets_a_text_vary_and_formulas_follow_it():
    ranges = ranges_of(exported(), of("manner", "emergency", "gentle"))
    manner = ranges.parameters["manner"]
    assert manner.kind.text(manner.low, str) in ("emergency", "gentle")
    assert manner.kind.names == ("emergency", "firm", "gentle")  # all that the file allows
    drawn = manner.at(np.linspace(0.0, 1.0, 9), manner.low, manner.high)
    assert {manner.kind.text(value, str) for value in drawn} == {"emergency", "gentle"}
    np.testing.assert_array_equal(manner.at(manner.share(drawn, 0.0, 2.0), 0.0, 2.0), drawn)
    (rate,) = [one for one in ranges.derived if one.name == "deceleration"]
    assert rate.value == parse(
        rate.value.source, categories={"manner": ("emergency", "firm", "gentle")}
    )
    values = {"manner": np.array([0.0, 2.0]), "wind_from": 90.0}
    np.testing.assert_allclose(rate.value.evaluate(values), [6.0, 2.0])


def test_weights_of_texts_are_kept():
    elements = tuple(
        dst.ProbabilityDistributionSetElement(word, weight)
        for word, weight in (("gentle", 3.0), ("emergency", 1.0))
    )
    one = dst.StochasticDistribution("manner", dst.ProbabilityDistributionSet(elements))
    manner = ranges_of(exported(), dst.Stochastic(10, (one,))).parameters["manner"]
    drawn = manner.at((np.arange(400) + 0.5) / 400.0, manner.low, manner.high)
    assert (drawn == 2.0).sum() == 300


@pytest.mark.parametrize(
    ("name", "words", "message"),
    [
        ("manner", ("gentle", "wild"), "parameter"),
        ("nobody", ("x",), "nobody"),
    ],
)
def test_texts_that_cannot_vary_are_refused(name, words, message):
    made = exported()
    with refuses(FileFormatError, message):
        ranges_of(made, of(name, *words))
