"""What HermiT finds and what it leaves to SHACL; and what is said where it is not installed."""

import pyoxigraph as ox
import pytest
from tests.approval import approve, refuses
from tests.covering import covering

from bridgegen.base.errors import InputError, OntologyError
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology import reasoner as module
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import save
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.reasoner import reason, require, smallest
from bridgegen.scenario.ontology.vocabulary import OWL, SCENARIOS, SUBCLASS, TYPE, XSD, bg, tbox

from .conftest import in_rain_and_haze


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


def about(individuals, *names):
    """Return the statements that name one of these individuals: few, so that a smallest part of
    them is soon found. Whether it is also found in the whole, two other tests say.
    """
    return Individuals(q for q in individuals.quads if q.subject in names or q.object in names)


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
    values = in_rain_and_haze(space)
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
    approve(sentence, "statements")
    assert len(found.contradiction) in (2, 3)
    if contradiction is not None:
        assert set(found.contradiction) == contradiction


# -- the layers beyond the paper's crossroads ------------------------------------------------------


@reasoning
def test_every_class_of_the_ontology_can_have_an_individual():
    """One of each class at once, each a thing of its own."""
    classes = [name for name, kind in tbox().kinds.items() if kind == "Class"]
    assert len(classes) > 90
    each = [(ox.NamedNode(f"{SCENARIOS}x#one_{name}"), TYPE, bg(name)) for name in classes]
    found = reason(planted(Individuals(()), *each))
    assert found.problems == []
    for name in classes:
        assert found.types[f"{SCENARIOS}x#one_{name}"] == (name,)


@reasoning
@pytest.mark.parametrize("name", covering())
def test_the_catalogue_is_consistent(name, individuals_of):
    found = reason(individuals_of(name))
    assert found.problems == []
    kinds = {classes for classes in found.types.values() if len(classes) != 1}
    assert kinds == set()  # nothing is inferred to be two things at once


@reasoning
def test_everything_at_once_is_consistent(everything):
    found = reason(everything)
    assert found.problems == []
    by_name = {iri.rpartition("#")[2]: classes for iri, classes in found.types.items()}
    for name, cls in {
        "works": "RoadWorks", "works_cone_1": "RoadCone", "works_sign": "ConstructionCard",
        "queue": "TrafficJam", "walker": "Pedestrian", "crosswalk_B": "Crosswalk",
        "signals_phase_1": "SignalPhase", "light_A": "TrafficLight", "fog_falls":
        "EnvironmentChangeEvent", "bv_moves_over_condition_1": "ConditionGroup",
        "walker_path": "Trajectory", "stop_line_C": "StopLine", "later_weather": "Weather",
    }.items():  # fmt: skip
        assert by_name[name] == (cls,)


@reasoning
@pytest.mark.parametrize(
    ("statement", "contradiction"),
    [
        ("walker a Car", {"walker is a Pedestrian", "walker is a Car"}),
        ("crosswalk_A a Lane", {"crosswalk_A is a Crosswalk", "crosswalk_A is a Lane"}),
        ("leg_A_in_sidewalk a Shoulder",
         {"leg_A_in_sidewalk is a Sidewalk", "leg_A_in_sidewalk is a Shoulder"}),
        ("intersection a Roundabout", {"intersection is a Crossroads",
                                       "intersection is a Roundabout"}),
        ("light_A a YieldSign", {"light_A is a TrafficLight", "light_A is a YieldSign"}),
        ("works a TrafficJam", {"works is a RoadWorks", "works is a TrafficJam"}),
        ("fog_falls a StoryboardEvent",
         {"fog_falls is a EnvironmentChangeEvent", "fog_falls is a StoryboardEvent"}),
        ("bv_moves_over_condition_1 a SpeedCondition",
         {"bv_moves_over_condition_1 is a ConditionGroup",
          "bv_moves_over_condition_1 is a SpeedCondition"}),
        ("later_weather a Fog", {"later_weather is a Weather", "later_weather is a Fog"}),
        ("bv_sets_off has_who works_cone_1",
         {"bv_sets_off has_who works_cone_1", "works_cone_1 is a RoadCone"}),
        ("queue has_who works_sign",
         {"queue has_who works_sign", "works_sign is a ConstructionCard"}),
        ("works closes_lane stop_line_A",
         {"works closes_lane stop_line_A", "stop_line_A is a StopLine"}),
        ("works has_element bv", {"works has_element bv", "bv is a Truck"}),
        ("signals has_phase light_A", {"signals has_phase light_A", "light_A is a TrafficLight"}),
        ("signals_phase_1 gives_green_to crosswalk_A",
         {"signals_phase_1 gives_green_to crosswalk_A", "crosswalk_A is a Crosswalk"}),
        ("walker_path has_vertex walker_start",
         {"walker_path has_vertex walker_start", "walker_start is a LanePosition"}),
        ("scenario has_outcome bv_sets_off",
         {"scenario has_outcome bv_sets_off", "bv_sets_off is a StoryboardEvent"}),
        ("crosswalk_A on_road light_A", {"crosswalk_A on_road light_A",
                                         "light_A is a TrafficLight"}),
    ],
)  # fmt: skip
def test_planted_contradictions_in_every_layer(everything, statement, contradiction):
    subject, verb, target = statement.split()
    here = f"{SCENARIOS}everything#"
    who, whom = ox.NamedNode(here + subject), ox.NamedNode(here + target)
    few = about(everything, who, whom)
    assert len(few.quads) < len(everything.quads) / 10
    found = reason(planted(
        few, (who, TYPE if verb == "a" else bg(verb), bg(target) if verb == "a" else whom)
    ))  # fmt: skip
    assert not found.consistent
    assert set(found.contradiction) == contradiction
    assert reason(few).consistent


@reasoning
def test_a_phase_has_one_duration(everything):
    phase = ox.NamedNode(f"{SCENARIOS}everything#signals_phase_1")
    found = reason(planted(everything, (phase, bg("has_duration"), typed("7", "double"))))
    assert not found.consistent
    assert len(found.contradiction) == 2
    assert all(one.startswith("signals_phase_1 has_duration") for one in found.contradiction)


@reasoning
@pytest.mark.parametrize(
    ("first", "second"),
    [("Crosswalk", "Lane"), ("RoadCone", "Signage"), ("SignalPhase", "TrafficLight"),
     ("RoadWorks", "TrafficJam"), ("ConditionGroup", "Condition"), ("Trajectory", "Route"),
     ("TrafficJam", "StoryboardEvent"), ("Crossroads", "TJunction")],
)  # fmt: skip
def test_a_class_below_two_disjoint_ones_is_named(first, second):
    new = bg("Both")
    found = reason(planted(
        Individuals(()), (new, TYPE, ox.NamedNode(OWL + "Class")),
        (new, SUBCLASS, bg(first)), (new, SUBCLASS, bg(second)),
    ))  # fmt: skip
    assert found.problems == ["no individual can be of class Both"]


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
    with refuses(InputError, "bridgegen[reasoner]") as error:
        reason(individuals)
    approve(str(error.value), "owlready2")


@pytest.mark.parametrize("culprits", [{0}, {7}, {0, 99}, {3, 50, 51}, set(range(8))])
def test_smallest(culprits):
    asked = 0

    def holds(some):
        nonlocal asked
        asked += 1
        return culprits <= set(some)

    assert set(smallest(range(100), holds)) == culprits
    assert asked < 100
