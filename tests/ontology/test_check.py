"""SHACL and the check of rows must agree: one declaration, two compilers (design: test parity)."""

import subprocess
import sys
from dataclasses import replace

import numpy as np
import pyoxigraph as ox
import pytest
import rdflib
from tests.approval import approve

from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.kinds import FLOAT, TOLERANCE, slack
from bridgegen.scenario.language.parameters import Axis, Bound, Derived, Parameter
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.ontology.check import check
from bridgegen.scenario.ontology.files import from_bytes, to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.shapes import rules, turtle
from bridgegen.scenario.ontology.site import ArmRoad, Leg, Site, SiteLane
from bridgegen.scenario.ontology.vocabulary import RDFS, SCENARIOS, TYPE, bg


def at_fault(scenario, values):
    """Which parameters SHACL finds at fault."""
    found = check(build(scenario, values, driver="reference"), scenario)
    return {violation.parameter for violation in found} - {""}


def parity(scenario, space, X):
    """Assert that SHACL and the check of rows blame the same; return how many rows are at fault."""
    expected = {row: set() for row in range(len(X))}
    for violation in space.violations(X):
        expected[violation.row].add(violation.parameter)
    for row, parameters in expected.items():
        values = dict(zip(space.names, X[row].tolist(), strict=True))
        assert at_fault(scenario, values) == parameters, values
    return sum(map(bool, expected.values()))


# -- parity ----------------------------------------------------------------------------------------


def test_decoded_rows_pass(scenario, space):
    X = space.decode(np.random.default_rng(1).random((20, space.n_var)))
    assert parity(scenario, space, X) == 0


def test_corners_of_the_cube_pass(scenario, space):
    """There bounds are touched, to the last bit."""
    rng = np.random.default_rng(2)
    corners = rng.integers(0, 2, (20, space.n_var)).astype(float)
    corners[0], corners[1] = 0.0, 1.0
    assert parity(scenario, space, space.decode(corners)) == 0


def test_faces_of_the_cube_pass(scenario, space):
    rng = np.random.default_rng(3)
    cube = rng.random((15, space.n_var))
    cube[rng.random(cube.shape) < 0.5] = 1.0
    cube[rng.random(cube.shape) < 0.3] = 0.0
    assert parity(scenario, space, space.decode(cube)) == 0


def test_values_rounded_to_four_digits_pass(scenario, space):
    """As they stand in a table or a file that somebody typed."""
    rng = np.random.default_rng(4)
    cube = rng.random((20, space.n_var))
    cube[rng.random(cube.shape) < 0.3] = 1.0
    assert parity(scenario, space, np.round(space.decode(cube), 4)) == 0


def test_infeasible_rows_get_the_same_verdict(scenario, space):
    rng = np.random.default_rng(5)
    X = space.decode(rng.random((50, space.n_var)))
    movable = [k for k, name in enumerate(space.names) if name != "lanes_per_direction"]
    for row in X:
        for column in rng.choice(movable, rng.integers(1, 3), replace=False):
            row[column] += rng.normal() * (1.0 + abs(row[column]))
    failed = parity(scenario, space, X)
    assert 25 <= failed <= 50  # else the test says nothing


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_what_is_no_number_breaks_the_rules_that_use_it(scenario, space, values, value):
    for name in ("cloudiness", "bv_speed", "friction"):
        row = np.array([[{**values, name: value}[column] for column in space.names]])
        with np.errstate(all="ignore"):
            assert parity(scenario, space, row) == 1


@pytest.mark.thorough
def test_every_scenario_of_the_catalogue(space):
    for name in names():
        scenario = load(name)
        space = scenario.space()
        X = space.decode(np.random.default_rng(6).random((2, space.n_var)))
        assert parity(scenario, space, X) == 0
        X[:, space.index("friction")] += 0.1
        assert parity(scenario, space, X) == 2


# -- planted violations: each rule, found and named ------------------------------------------------


def planted(scenario, values):
    """Per rule about a parameter: a name for the test, the parameter, its value, what is said."""
    space = scenario.space(axes=["static", "participants", "weather"])
    for name, parameter in scenario.parameters.items():
        for limit, step in ((parameter.low, -1.0), (parameter.high, 1.0)):
            value = limit + step * (3 * float(slack(limit)) if parameter.kind == FLOAT else 1.0)
            if value != 0.0 or name != "lanes_per_direction":  # no lane, no place to start at
                yield name, value, f"{parameter.low:g} <= {name} <= {parameter.high:g}"
    for bound in scenario.bounds:
        for sign, side, step in ((">=", bound.lo, -1.0), ("<=", bound.hi, 1.0)):
            if side is not None:
                limit = float(side.evaluate(values))
                value = limit + step * 3 * float(slack(limit))
                yield bound.target, value, f"{bound.target} {sign} {side}"
    for derived in scenario.derived:
        limit = values[derived.name]
        yield derived.name, limit + 3 * float(slack(limit)), str(derived)
    assert space.n_var > 10


def test_each_planted_violation_is_found_and_named(scenario, values):
    cases = list(planted(scenario, values))
    assert len(cases) > 35
    units = {one.name: one.unit for one in (*scenario.parameters.values(), *scenario.derived)}
    for name, value, rule in cases:
        found = check(build(scenario, {**values, name: value}, driver="x"), scenario)
        (message,) = [v.message for v in found if v.parameter == name and rule in v.message]
        approve(message, name, units[name], f"{value:.10g}")


def test_a_sentence_says_who_what_why(scenario, values):
    wet = {**values, "precipitation": 80.0, "cloudiness": 20.0}
    found = check(build(scenario, wet, driver="x"), scenario)
    (cloud,) = [violation for violation in found if violation.parameter == "cloudiness"]
    approve(cloud.message, "weather_cloud", "80", "Section")
    assert "\n" not in cloud.message
    assert cloud.property == "has_cloudiness"
    assert cloud.individual == "weather_cloud (Cloud)"
    assert cloud.nodes == (f"{SCENARIOS}crossroads-s4#weather_cloud",)
    assert str(cloud) == cloud.message


def test_a_value_in_many_places_makes_one_sentence(scenario, values):
    found = check(build(scenario, {**values, "lane_width": 9.0}, driver="x"), scenario)
    (wide,) = [violation for violation in found if violation.parameter == "lane_width"]
    assert wide.message.startswith("A (Road) and ")
    assert len(wide.nodes) > 10


# -- edits, as somebody makes them in Protégé ------------------------------------------------------


def without(individuals, *, subject="", predicate=""):
    return Individuals(
        quad for quad in individuals.quads
        if not (quad.subject.value.endswith(subject) and quad.predicate.value.endswith(predicate))
    )  # fmt: skip


def changed(individuals, subject, predicate, value):
    node = ox.NamedNode(f"{SCENARIOS}crossroads-s4#{subject}")
    rest = without(individuals, subject=f"#{subject}", predicate=f"#{predicate}").quads
    return Individuals([*rest, ox.Quad(node, bg(predicate), value)])


def sentences(individuals, scenario=None):
    return [violation.message for violation in check(individuals, scenario)]


def test_a_scenario_as_built_keeps_all_rules(individuals, scenario):
    assert check(individuals, scenario) == []
    assert check(individuals) == []
    assert check(from_bytes(to_bytes(individuals)), scenario) == []


def test_what_conforms_to_one_scenario_is_held_against_another(individuals, scenario, values):
    low = values["bv_speed"] - 0.1
    slower = replace(scenario.parameters["bv_speed"], high=low, default=low)
    narrow = replace(scenario, parameters={**scenario.parameters, "bv_speed": slower})
    for _ in range(2):
        assert check(individuals, load(scenario.name)) == []
        assert {one.parameter for one in check(individuals, narrow)} == {"bv_speed"}


def test_weather_is_checked_without_its_bindings(individuals, scenario):
    unbound = without(individuals, predicate="#has_parameter")
    broken = changed(unbound, "weather_cloud", "has_cloudiness", ox.Literal(0.0))
    found = {violation.parameter for violation in check(broken, scenario)}
    assert "cloudiness" in found
    assert "precipitation" not in found  # found as a part of the weather
    assert "bv_speed" in found  # but this one can no longer be found


def test_weather_with_the_other_spelling_of_sun(individuals, scenario, values):
    swapped = Individuals(
        ox.Quad(q.subject, bg("has_sun"), q.object) if q.predicate == bg("hasSun") else q
        for q in individuals.quads
    )
    assert check(swapped, scenario) == []
    high = changed(swapped, "weather_sun", "has_sun_altitude_angle", ox.Literal(50.0))
    assert {v.parameter for v in check(high, scenario)} >= {
        "sun_altitude_angle",
        "sun_azimuth_angle",
    }


def test_a_missing_value_is_missed(individuals, scenario):
    found = sentences(without(individuals, predicate="#has_friction"), scenario)
    approve(found, "friction")
    approve(found, "has_friction")


def test_a_missing_weather_is_missed(individuals, scenario):
    found = sentences(without(individuals, predicate="#has_weather"), scenario)
    approve(found, "has_weather", "crossroads-s4")


def test_a_value_changed_at_one_place_only(individuals, scenario):
    broken = changed(individuals, "leg_A_in_1", "has_width", ox.Literal(3.9))
    for declared in (scenario, None):
        (message,) = sentences(broken, declared)
        approve(message, "lane_width", "leg_A_in_1", "3.9")


def test_without_a_scenario_the_declared_ranges_hold(individuals):
    fast = changed(individuals, "bv_sets_off_action", "has_target_speed", ox.Literal(30.0))
    (message,) = [one.message for one in check(fast) if one.parameter]
    approve(message, "bv_sets_off_action", "bv_speed")


def double(text):
    return ox.Literal(text, datatype=ox.NamedNode("http://www.w3.org/2001/XMLSchema#double"))


@pytest.mark.parametrize(
    ("subject", "predicate", "value", "message"),
    [
        ("leg_A", "has_speed_limit", double("fast"),
         "has_speed_limit [m/s] of A (Road) must be a number (xsd:double), got 'fast'"),
        ("leg_A", "has_road_id", ox.Literal(7),
         "has_road_id of A (Road) must be a text (xsd:string), got '7'"),
        ("leg_A", "has_inbound_lanes", ox.Literal(1.5),
         "has_inbound_lanes of A (Road) must be a whole number (xsd:integer), got '1.5'"),
        ("leg_A", "has_junction_end", ox.Literal("middle"),
         "has_junction_end of A (Road) must be one of start, end, both, none, got 'middle'"),
        ("ego", "has_wheelbase", ox.Literal(0.0),
         "has_wheelbase [m] of ego (Car) must be above 0, got '0.0'"),
        ("ego", "has_route", ox.NamedNode(f"{SCENARIOS}crossroads-s4#leg_A"),
         "has_route of ego (Car) must point to an individual of Route, got A (Road)"),
        ("ego_route", "has_start", ox.Literal("here"),
         "has_start of ego_route (Route) must point to an individual of Position, got 'here'"),
        ("ego", "has_route", ox.NamedNode("urn:nowhere"),
         "has_route of ego (Car) must point to an individual of Route, got urn:nowhere"),
    ],
)  # fmt: skip
def test_structure(individuals, subject, predicate, value, message, caplog):
    assert message in sentences(changed(individuals, subject, predicate, value))
    assert not caplog.records  # rdflib logs a traceback for 'fast'


def test_required_properties(individuals):
    for cls, predicate in (
        ("Car", "has_wheelbase"), ("Road", "has_length"), ("Trigger", "has_condition"),
        ("StoryboardEvent", "has_who"), ("Scenario", "has_road_network"),
        ("Controller", "has_driver"),
    ):  # fmt: skip
        found = sentences(without(individuals, predicate=f"#{predicate}"))
        assert any(f"({cls}) must have {predicate}" in text for text in found), predicate


def test_one_value_too_many(individuals):
    ego = ox.NamedNode(f"{SCENARIOS}crossroads-s4#ego")
    two = Individuals([*individuals.quads, ox.Quad(ego, bg("has_wheelbase"), ox.Literal(3.0))])
    approve(sentences(two), "has_wheelbase", "2.8")


def test_shapes_apply_to_a_users_own_subclass(individuals):
    taxi = ox.NamedNode("urn:own#Taxi")
    cab = ox.NamedNode("urn:own#cab")
    wider = Individuals([
        *individuals.quads,
        ox.Quad(taxi, ox.NamedNode(RDFS + "subClassOf"), bg("Car")),
        ox.Quad(cab, TYPE, taxi),
    ])  # fmt: skip
    approve(sentences(wider), "has_wheelbase")


def test_a_position_beyond_its_road(individuals, scenario, values):
    far = changed(individuals, "ego_start", "has_distance", ox.Literal(500.0))
    assert sentences(far, scenario) == [
        "has_distance [m] of ego_start (LanePosition) must lie on the road of its lane "
        "(leg_C_in_1), got 500"
    ]
    at_end = values["arm_length"]
    on_it = changed(individuals, "ego_start", "has_distance", ox.Literal(at_end))
    assert sentences(on_it, scenario) == []


def test_a_map_made_elsewhere(scenario, values):
    """No static parameters there; a position must lie on the right road of a chain."""
    lanes = (SiteLane(1, "in", 3.5), SiteLane(-1, "out", 3.5))
    roads = tuple(ArmRoad(f"r{k}", 25.0, "start", lanes) for k in range(2))
    legs = tuple(
        Leg(name, 0.0, tuple(replace(road, road_id=name + road.road_id) for road in roads))
        for name in "ABCD"
    )
    site = Site("town", "town.xodr", "7", None, legs)
    good = build(scenario, values, driver="x", site=site)
    assert sentences(good, scenario) == []
    near = changed(good, "ego_start", "has_distance", ox.Literal(10.0))
    assert [text.split(" [")[0] for text in sentences(near, scenario)] == ["has_distance"]


# -- scenarios that users write --------------------------------------------------------------------


def test_names_and_formulas_that_users_may_think_of(scenario, values):
    """SPARQL's keywords and pyshacl's variables are fine names; formulas may use every function."""
    odd = ["minus", "values", "service", "select", "this", "value", "path", "limit", "failure", "x"]
    own = {
        name: Parameter(name, Axis.EXTENSION, "1", 0.0, 2.0, 1.0)
        for name in odd
    }  # fmt: skip
    bounds = [
        Bound(
            name, parse("0.1*" + other), parse(f"9 + sqrt({other})"), 'because "x" < {?y}', "a\\b"
        )
        for name, other in zip(odd[1:], odd[:-1], strict=True)
    ]
    formula = "exp(sin(minus)) + log(1 + values) + asin(min(this/2, 1)) + value**1.5 % 2"
    total = Derived("total", Axis.EXTENSION, "1", parse(formula), "why", "source")
    wider = replace(
        scenario,
        parameters={**scenario.parameters, **own},
        bounds=(*scenario.bounds, *bounds),
        derived=(*scenario.derived, total),
    )
    space = wider.space(axes=["extension"])
    X = space.decode(np.random.default_rng(8).random((3, space.n_var)))
    assert parity(wider, space, X) == 0
    X[0, space.index("minus")] = 100.0
    X[1, space.index("total")] += 0.1
    assert parity(wider, space, X) == 2


def test_a_formula_without_a_value_breaks_its_rule(scenario, values):
    root = Derived("root", Axis.EXTENSION, "1", parse("sqrt(bv_speed - 99)"), "why", "source")
    odd = replace(scenario, derived=(*scenario.derived, root))
    assert at_fault(odd, {**values, "root": 1.0}) == {"root"}


def test_scenarios_do_not_share_shapes(scenario, values):
    """Compiled once per scenario, and never mistaken for another's."""
    for high in (2.0, 3.0, 4.0) * 4:
        bv_speed = replace(scenario.parameters["bv_speed"], high=high, default=0.5)
        own = replace(scenario, parameters={**scenario.parameters, "bv_speed": bv_speed})
        assert at_fault(own, {**values, "bv_speed": 2.5}) == (
            {"bv_speed"} if high == 2.0 else set()
        )


# -- portability and cost --------------------------------------------------------------------------


def test_shapes_are_turtle_that_rdflib_reads_too(scenario):
    graph = rdflib.Graph().parse(data=turtle(scenario), format="turtle")
    shapes = set(
        graph.subjects(rdflib.RDF.type, rdflib.URIRef("http://www.w3.org/ns/shacl#NodeShape"))
    )
    assert len(shapes) == len(rules(scenario))


@pytest.mark.thorough
def test_another_shacl_processor_agrees(scenario, values):
    """The same shapes over rdflib's own store and SPARQL engine, which share no code with ours."""
    import pyshacl

    bad = {**values, "sun_azimuth_angle": values["sun_azimuth_angle"] + 1.0, "lane_width": 9.0}
    graph = rdflib.Graph().parse(data=to_bytes(build(scenario, bad, driver="x")), format="xml")
    shapes = rdflib.Graph().parse(data=turtle(scenario), format="turtle")
    conforms, report, _ = pyshacl.validate(graph, shacl_graph=shapes)
    assert not conforms
    source = rdflib.URIRef("http://www.w3.org/ns/shacl#sourceShape")
    blamed = {str(shape).rpartition("#")[2] for shape in report.objects(None, source)}
    assert blamed == {
        "range-lane_width", "bound-0-low-intersection_size", "derived-sun_azimuth_angle"
    }  # fmt: skip


def test_pyshacl_is_imported_when_it_is_used():
    code = (
        "import sys, bridgegen.scenario.ontology.check, bridgegen.scenario.ontology.individuals\n"
        "print(sorted({'pyshacl', 'rdflib', 'pandas', 'numba', 'pydantic'} & set(sys.modules)))"
    )
    done = subprocess.run([sys.executable, "-c", code], capture_output=True, text=True, check=True)
    assert done.stdout.strip() == "[]"


def test_the_tolerance_is_the_one_of_all_checks(scenario):
    compared = [rule for rule in rules(scenario) if rule.target]
    assert len(compared) > 20
    assert all(repr(TOLERANCE).rstrip("0") in rule.select for rule in compared)
