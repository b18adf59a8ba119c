import math
from itertools import count

import pyoxigraph as ox
import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import OntologyError
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.vocabulary import BG, OWL, RDFS, SCENARIOS, TYPE, XSD, bg

HOME = SCENARIOS + "test#"


def node(name):
    return ox.NamedNode(HOME + name)


def typed(text, kind):
    return ox.Literal(text, datatype=ox.NamedNode(XSD + kind))


def graph(*statements):
    """Individuals from (subject, property, value); "a" is rdf:type."""
    return Individuals(
        ox.Quad(
            node(s) if isinstance(s, str) else s,
            TYPE if p == "a" else bg(p),
            bg(o) if p == "a" else o,
        )
        for s, p, o in statements
    )


ROAD = (("r", "a", "Road"), ("r", "has_name", ox.Literal("A")))


@pytest.mark.parametrize(
    ("literal", "value"),
    [
        (typed("3.5", "double"), 3.5),
        (typed("3.5", "decimal"), 3.5),
        (typed("3", "integer"), 3.0),
        (typed("3", "int"), 3.0),
        (typed("3.5E0", "float"), 3.5),
        (typed("-1e-3", "double"), -0.001),
    ],
)
def test_a_number_may_have_any_numeric_datatype(literal, value):
    assert graph(*ROAD, ("r", "has_length", literal)).number(node("r"), "has_length") == value


@pytest.mark.parametrize(
    "literal",
    [
        typed("long", "double"),
        typed("NaN", "double"),
        typed("INF", "double"),
        typed("true", "boolean"),
        ox.Literal("3.5"),
    ],
)
def test_what_is_no_finite_number_is_refused(literal):
    individuals = graph(*ROAD, ("r", "has_length", literal))
    with refuses(OntologyError, "has_length"):
        individuals.number(node("r"), "has_length")
    with pytest.raises(OntologyError):
        individuals.optional_number(node("r"), "has_length")


def test_a_whole_number_may_be_written_as_a_double():
    individuals = graph(("l", "a", "Lane"), ("l", "has_lane_id", typed("-2.0", "double")))
    assert individuals.integer(node("l"), "has_lane_id") == -2
    half = graph(("l", "a", "Lane"), ("l", "has_lane_id", typed("1.5", "double")))
    with refuses(OntologyError, "1.5"):
        half.integer(node("l"), "has_lane_id")


@pytest.mark.parametrize(
    ("reader", "name"),
    [
        ("number", "has_length"),
        ("integer", "has_inbound_lanes"),
        ("text", "has_road_id"),
        ("link", "has_continuation"),
    ],
)
def test_a_missing_value_is_named_with_its_individual(reader, name):
    individuals = graph(*ROAD)
    with refuses(OntologyError, name):
        getattr(individuals, reader)(node("r"), name)
    assert getattr(individuals, f"optional_{reader}")(node("r"), name) is None


def test_two_values_are_one_too_many():
    individuals = graph(
        *ROAD, ("r", "has_length", ox.Literal(1.0)), ("r", "has_length", ox.Literal(2.0))
    )
    with refuses(OntologyError):
        individuals.number(node("r"), "has_length")
    individuals = graph(
        *ROAD, ("r", "has_continuation", node("s")), ("r", "has_continuation", node("t"))
    )
    with refuses(OntologyError, "s"):
        individuals.link(node("r"), "has_continuation")


def test_a_link_is_no_value_and_a_value_no_link():
    individuals = graph(*ROAD, ("r", "has_length", node("s")), ("r", "has_lane", ox.Literal("s")))
    with refuses(OntologyError):
        individuals.number(node("r"), "has_length")
    with refuses(OntologyError, "s"):
        individuals.links(node("r"), "has_lane")


def test_one_wants_exactly_one():
    with refuses(OntologyError):
        graph().one("Road")
    with refuses(OntologyError):
        graph(*ROAD, ("s", "a", "Road")).one("Road")
    assert graph(*ROAD).one("Road") == node("r")


def test_a_subclass_counts_as_its_class():
    individuals = graph(("c", "a", "Car"), ("p", "a", "Pedestrian"))
    assert individuals.of_class("Vehicle") == [node("c")]
    assert set(individuals.of_class("TrafficParticipant")) == {node("c"), node("p")}
    assert individuals.of_class("Truck") == []
    assert individuals.is_a(node("c"), "LocatedElement")
    assert not individuals.is_a(node("c"), "Pedestrian")


def test_a_subclass_that_the_file_declares_counts_too():
    own, parent = ox.NamedNode(HOME + "Taxi"), ox.NamedNode(HOME + "Hired")
    subclass = ox.NamedNode(RDFS + "subClassOf")
    same = ox.NamedNode(OWL + "equivalentClass")
    individuals = Individuals(
        [
            ox.Quad(own, subclass, parent),
            ox.Quad(bg("Car"), same, parent),
            ox.Quad(parent, subclass, own),  # a circle is no trouble
            ox.Quad(node("t"), TYPE, own),
        ]
    )
    assert individuals.of_class("Vehicle") == [node("t")]
    assert individuals.is_a(node("t"), "Car")


def test_an_unknown_class_is_the_callers_mistake():
    with pytest.raises(KeyError):
        graph().of_class("Spaceship")


def test_has_sun_is_read_by_either_name():
    for written in ("hasSun", "has_sun"):
        individuals = graph(("w", "a", "Weather"), ("w", written, node("s")))
        assert individuals.link(node("w"), "hasSun") == node("s")
        assert individuals.link(node("w"), "has_sun") == node("s")


def test_parameters_are_found_by_the_property_they_bind():
    individuals = graph(
        ("a", "a", "SpeedAction"),
        ("a", "has_parameter", node("p")),
        ("p", "a", "Parameter"),
        ("p", "has_name", ox.Literal("bv_speed")),
        ("p", "binds_property", ox.Literal("has_target_speed")),
        ("a", "has_target_speed", ox.Literal(2.0)),
    )
    assert individuals.parameter(node("a"), "has_target_speed") == "bv_speed"
    assert individuals.parameter(node("a"), "has_rate") is None
    assert individuals.parameter(node("p"), "has_value") is None
    assert individuals.bindings == {"bv_speed": [(node("a"), "has_target_speed")]}


def test_two_parameters_of_one_value_contradict_each_other():
    individuals = graph(
        ("a", "has_parameter", node("p")), ("a", "has_parameter", node("q")),
        ("p", "has_name", ox.Literal("x")), ("p", "binds_property", ox.Literal("has_rate")),
        ("q", "has_name", ox.Literal("y")), ("q", "binds_property", ox.Literal("has_rate")),
    )  # fmt: skip
    with refuses(OntologyError, "x"):
        individuals.parameter(node("a"), "has_rate")


def test_anonymous_individuals_are_individuals():
    lane = ox.BlankNode()
    individuals = graph(("r", "a", "Road"), ("r", "has_lane", lane), (lane, "a", "Lane"),
                        (lane, "has_lane_id", ox.Literal(1)))  # fmt: skip
    assert individuals.links(node("r"), "has_lane") == [lane]
    assert individuals.integer(lane, "has_lane_id") == 1


def renamed(individuals, salt):
    """The same individuals under other IRIs, some of them anonymous, in another order."""
    names = {}
    number = count()

    def new(term):
        if (
            isinstance(term, ox.NamedNode)
            and term.value.startswith(SCENARIOS)
            and "#" in term.value
        ):
            if term not in names:
                k = next(number)
                names[term] = (
                    ox.BlankNode()
                    if k % 5 == 4
                    else ox.NamedNode(f"urn:x:{(k * 7919 + salt) % 10007}")
                )
            return names[term]
        return term

    quads = [ox.Quad(new(s), p, new(o)) for s, p, o, _ in individuals.quads]
    return Individuals(sorted(quads, key=lambda quad: hash((salt, str(quad))))), names


@given(st.integers(0, 10**6))
def test_answers_depend_on_no_iri(individuals, salt):
    other, _ = renamed(individuals, salt)

    def summary(which):
        (ego,) = (n for n in which.of_class("Vehicle") if which.text(n, "has_name") == "ego")
        route = which.link(ego, "has_route")
        start = which.link(route, "has_start")
        crossing = which.one("Intersection")
        legs = which.links(crossing, "has_leg")
        return (
            [which.text(leg, "has_name") for leg in legs],
            [
                sorted(which.integer(x, "has_lane_id") for x in which.links(leg, "has_lane"))
                for leg in legs
            ],
            which.text(which.link(ego, "has_controller"), "has_driver"),
            which.number(start, "has_distance"),
            sorted(
                (which.text(p, "has_name"), which.optional_number(p, "has_low"))
                for p in which.of_class("Parameter")
            ),
            {name: sorted(p for _, p in places) for name, places in which.bindings.items()},
            which.number(which.link(which.one("Weather"), "hasSun"), "has_sun_altitude_angle"),
        )

    assert summary(other) == summary(individuals)


@given(st.floats(allow_nan=False, allow_infinity=False))
def test_a_number_keeps_every_bit(value):
    individuals = graph(*ROAD, ("r", "has_length", ox.Literal(value)))
    read = individuals.number(node("r"), "has_length")
    assert read == value
    assert math.copysign(1.0, read) == math.copysign(1.0, value)


def test_the_store_answers_sparql(individuals):
    query = f"SELECT ?d WHERE {{ ?c a <{BG}Controller> ; <{BG}has_driver> ?d }} ORDER BY ?d"
    drivers = ["insistent", "route-follower"]
    assert [row["d"].value for row in individuals.store.query(query)] == drivers
