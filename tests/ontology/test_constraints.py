"""The constraints of the paper's Section III-B: rows never break them, and breaches are found."""

from dataclasses import replace
from functools import cache
from importlib.resources import files

import numpy as np
import pyoxigraph as ox
import pyshacl
import pytest
import rdflib
from tests.approval import approve

from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load, names
from bridgegen.scenario.language.roads import LegSpec, usual
from bridgegen.scenario.ontology.check import check, constraints_in_words
from bridgegen.scenario.ontology.conduct import conduct_rules, placement_rules
from bridgegen.scenario.ontology.files import to_bytes
from bridgegen.scenario.ontology.graph import Individuals
from bridgegen.scenario.ontology.individuals import build, build_static
from bridgegen.scenario.ontology.rule import with_unit
from bridgegen.scenario.ontology.shapes import turtle
from bridgegen.scenario.ontology.vocabulary import SUBCLASS, TYPE, bg, local_name, tbox

from ..openx.opendrive.kinds import KINDS
from .conftest import in_rain_and_haze


@cache
def concrete(name):
    """A valid scenario of the catalogue, at no boundary."""
    scenario = load(name)
    space = scenario.space(axes=list(Axis))
    values = in_rain_and_haze(space)
    return scenario, build(scenario, values, driver="reference")


def base_of(individuals):
    return next(
        quad.subject.value.partition("#")[0] + "#"
        for quad in individuals.quads
        if quad.predicate == bg("has_area")
    )


def edited(individuals, *edits):
    """Individuals after some edits.

    Args:
        individuals: as they were.
        edits: (subject, property, value) sets a value, "+property" adds one, "-property" takes
            that one away (None: all); a text names an individual (or, of "a", a class).
    """
    base, quads = base_of(individuals), list(individuals.quads)
    for subject, name, value in edits:
        node, said = ox.NamedNode(base + subject), name.lstrip("+-")
        predicate = TYPE if said == "a" else bg(said)
        if value is None:
            assert name.startswith("-")
        elif isinstance(value, str):
            value = bg(value) if said == "a" else ox.NamedNode(base + value)
        else:
            value = ox.Literal(value)
        if name.startswith("-") and value is not None:
            quads.remove(ox.Quad(node, predicate, value))
            continue
        if not name.startswith("+"):
            quads = [q for q in quads if (q.subject, q.predicate) != (node, predicate)]
        if value is not None:
            quads.append(ox.Quad(node, predicate, value))
    return Individuals(quads)


LAMP = [
    ("lamp", "a", "StreetLight"), ("road_network", "+has_facility", "lamp"),
    ("lamp", "on_road", "leg_A"), ("lamp", "has_distance", 10.0),
]  # fmt: skip
DARK = [("weather_fog", "has_fog_density", 95.0)]

# Per breach: the constraint, the scenario, what is planted; who breaks which rule, with which
# value, and why.
BREACHES = [
    ("1 to 2: a light where no roads meet", "red-light-runner",
     [("intersection", "-has_leg", "leg_A")],
     "light_A (TrafficLight)", "light-at-intersection", "got leg_A: Traffic lights give and take"),
    ("1 to 2: a light on no road", "red-light-runner", [("light_A", "-on_road", "leg_A")],
     "light_A (TrafficLight)", "light-at-intersection", "got none: Traffic lights give and take"),
    ("1 to 2: a light away from its stop line", "red-light-runner",
     [("light_B", "has_distance", 20.0)],
     "light_B (TrafficLight)", "light-at-stop-line", "got 20: Who waits at a light"),
    ("1 to 2: a light on the road", "red-light-runner", [("light_A", "has_t", 3.0)],
     "light_A (TrafficLight)", "beside-road",
     "beyond the road's edge, 8.5 m from its reference line, by 5 m at most, got 3: What stands"),
    ("1 to 2: a sign on the road", "roundabout-entry", [("yield_sign_A", "has_t", 2.0)],
     "yield_sign_A (YieldSign)", "beside-road", "got 2: What stands on the road"),
    ("1 to 2: a sign on the reference line", "roundabout-entry", [("yield_sign_A", "has_t", 0.0)],
     "yield_sign_A (YieldSign)", "beside-road", "got 0: What stands on the road"),
    ("1 to 2: a sign far off", "roundabout-entry", [("yield_sign_B", "has_t", -30.0)],
     "yield_sign_B (YieldSign)", "beside-road", "got -30: What stands on the road"),
    ("1 to 2: a sign beyond the road's end", "roundabout-entry",
     [("yield_sign_B", "has_distance", 900.0)],
     "yield_sign_B (YieldSign)", "along-road", "0 to 70, got 900: Crosswalks and stop lines"),
    ("1 to 2: a street light on the road", "crossroads-s4", [*LAMP, ("lamp", "has_t", 1.0)],
     "lamp (StreetLight)", "beside-road", "got 1: What stands on the road"),
    ("1 to 2: a street light before the road", "crossroads-s4",
     [*LAMP, ("lamp", "has_t", 9.9), ("lamp", "has_distance", -4.0)],
     "lamp (StreetLight)", "along-road", "got -4: Crosswalks and stop lines"),
    ("1 to 2: a crosswalk off the road", "red-light-runner",
     [("crosswalk_C", "has_distance", 59.0)],
     "crosswalk_C (Crosswalk)", "along-road", "2 to 58, got 59: Crosswalks"),
    ("1 to 2: a stop line off the road", "red-light-runner",
     [("stop_line_C", "has_distance", 61.0)],
     "stop_line_C (StopLine)", "along-road", "0 to 60, got 61: Crosswalks"),
    ("1 to 2: a stop line for another road", "red-light-runner",
     [("stop_line_C", "marks_lane", "leg_B_in_1")],
     "stop_line_C (StopLine)", "own-lanes", "got leg_B_in_1: A light, a sign or a line"),
    ("2: green for conflicting legs", "red-light-runner",
     [("signals_phase_1", "+gives_green_to", "light_B")],
     "AC_green (SignalPhase)", "no-conflicting-green", "got light_A and light_B: Legs that are"),
    ("2: yellow against green", "red-light-runner",
     [("signals_phase_1", "+gives_yellow_to", "light_D")],
     "AC_green (SignalPhase)", "no-conflicting-green", "got light_A and light_D: Legs that are"),
    ("2: a phase without a duration", "red-light-runner",
     [("signals_phase_2", "has_duration", 0.0)],
     "AC_yellow (SignalPhase)", "", "has_duration [s] of AC_yellow (SignalPhase) must be above 0"),
    ("2: a light that is not there", "red-light-runner",
     [("signals", "+has_light", "light_X")],
     "signals (SignalController)", "", "must point to an individual of TrafficLight, got "),
    ("2: a light of no controller", "red-light-runner", [("signals", "-has_light", "light_A")],
     "AC_green (SignalPhase)", "own-lights", "got light_A: A controller switches"),
    ("1 to 4: a pedestrian on the road", "pedestrian-at-night",
     [("walker_start", "on_lane", "leg_D_out_1"), ("walker_start", "has_distance", 30.0)],
     "walker (Pedestrian)", "walks-on-sidewalk", "got leg_D_out_1 at 30 m: Pedestrians walk on"),
    ("1 to 4: a pedestrian beside the sidewalk", "pedestrian-at-night",
     [("walker_start", "has_lateral_offset", 2.0), ("walker_start", "has_distance", 30.0)],
     "walker (Pedestrian)", "walks-on-sidewalk", "got leg_D_out_sidewalk at 30 m: Pedestrians"),
    ("1 to 4: a pedestrian crosses beside the crosswalk", "pedestrian-at-night",
     [("walker_point_2", "has_distance", 20.0)],
     "walker (Pedestrian)", "crosses-on-crosswalk",
     "got leg_D_out_sidewalk at 3 m to leg_D_in_sidewalk at 20 m: Pedestrians walk on sidewalks"),
    ("1 to 4: a pedestrian without a crosswalk", "pedestrian-at-night",
     [("crosswalk_D", "on_road", "leg_A")],
     "walker (Pedestrian)", "crosses-on-crosswalk", "leg_D_in_sidewalk at 3 m: Pedestrians"),
    ("1 to 4: a pedestrian off crosswalks without a reason", "pedestrian-off-crosswalk",
     [("walker", "-has_reason_off_crosswalk", None)],
     "walker (Pedestrian)", "walks-on-sidewalk", "must be a sidewalk, or a lane where"),
    ("1 to 4: a pedestrian crosses without a reason", "child-between-parked",
     [("child", "-has_reason_off_crosswalk", None)],
     "child (Pedestrian)", "crosses-on-crosswalk", "must cross within a crosswalk"),
    ("1 to 4: a vehicle on the sidewalk", "red-light-runner",
     [("runner_start", "on_lane", "leg_D_in_sidewalk")],
     "runner (Car)", "on-drivable-lane", "got leg_D_in_sidewalk: Vehicles keep to the lanes"),
    ("1 to 4: a vehicle that starts in the junction", "crossroads-s4",
     [("bv_start", "on_lane", "intersection")],
     "bv (Car)", "on-drivable-lane", "got intersection: Vehicles keep to the lanes"),
    ("1 to 4: a parked vehicle on the sidewalk", "pedestrian-behind-parked",
     [("van_start", "on_lane", "leg_main_out_sidewalk")],
     "van (Van)", "on-drivable-lane", "got leg_main_out_sidewalk: Vehicles keep to the lanes"),
    ("1 to 4: a route that ends on a sidewalk", "red-light-runner",
     [("runner_destination", "on_lane", "leg_B_out_sidewalk")],
     "runner (Car)", "on-drivable-lane", "got leg_B_out_sidewalk: Vehicles keep to the lanes"),
    ("1 to 4: driving on the shoulder", "pedestrian-behind-parked",
     [("van_init_speed", "has_target_speed", 5.0)],
     "van (Van)", "on-drivable-lane", "got leg_main_out_shoulder: Vehicles keep to the lanes"),
    ("1 to 4: a vehicle beside its lane", "stopped-after-curve",
     [("stopped_start", "has_lateral_offset", -2.5)],
     "stopped (Car)", "within-lane", "±1.575, got -2.5: Vehicles keep to the lanes"),
    ("1 to 4: driving across its lane", "lead-brakes",
     [("lead_start", "has_relative_heading", 90.0)],
     "lead (Car)", "faces-its-way", "0 or 180 deg while it moves, and -180 to 180 deg"),
    ("1 to 4: too fast for the limit", "red-light-runner",
     [("runner_decides_action", "has_target_speed", 14.5)],
     "runner (Car)", "speed-limit", "as road and weather allow, got 14.5: Nobody drives faster"),
    ("1 to 4: the ego too fast for the limit", "lead-brakes",
     [("ego_init_speed", "has_target_speed", 40.0)],
     "ego (Car)", "speed-limit", "as road and weather allow, got 40: Nobody drives faster"),
    ("1 to 4: faster than a truck can", "jam-tail-in-fog",
     [("truck_init_speed", "has_target_speed", 26.0)],
     "truck (Truck)", "body-speed",
     "25 at most, the most that it can do, got 26: Nobody is faster"),
    ("1 to 4: faster than a pedestrian can", "pedestrian-at-night",
     [("walker_crosses_action", "has_target_speed", 5.0)],
     "walker (Pedestrian)", "body-speed", "4 at most, the most that it can do, got 5: Nobody is"),
    ("1 to 4: too fast for a left turn", "crossroads-s2",
     [("bv_sets_off_action", "has_target_speed", 13.0)],
     "bv (Car)", "bend-of-junction", "got 13: A vehicle drives through a bend no faster"),
    ("1 to 4: too fast for a bend", "stopped-after-curve",
     [("leg_main_segment_3", "has_start_curvature", 0.1)],
     "oncoming (Car)", "bend-of-road", "in a bend of R = 10 m with friction = "),
    ("1 to 4: too fast for a roundabout", "roundabout-entry",
     [("bv_changes_pace_action", "has_target_speed", 12.5)],
     "bv (Car)", "bend-of-ring", "in a bend of R = 16 m with friction = "),
    ("5 to 1: on a road that fog closes", "jam-tail-in-fog", DARK,
     "truck (Truck)", "closed-by-fog_density",
     "must not be on leg_main, closed above has_fog_density [%] 90, got 95: The road is closed"),
    ("5 to 1: on a road that rain closes", "jam-tail-in-fog",
     [("weather_rain", "has_precipitation", 99.0)],
     "ego (Car)", "closed-by-precipitation",
     "must not be on leg_main, closed above has_precipitation [%] 95, got 99: The road is closed"),
    ("3: a cone on another lane", "road-works", [("works_cone_3_place", "on_lane",
     "leg_main_out_1")],
     "works_cone_3 (RoadCone)", "works-element",
     "got leg_main_out_1 with has_lateral_offset -0.35"),
    ("3: a cone in the traffic", "road-works", [("works_cone_3_place", "has_lateral_offset", 3.0)],
     "works_cone_3 (RoadCone)", "works-element", "got leg_main_out_2 with has_lateral_offset 3 m"),
    ("3: a sign across the road's edge", "road-works",
     [("works_sign_place", "on_lane", "leg_main_out_1"),
      ("works_sign_place", "has_lateral_offset", -5.2)],
     "works_sign (ConstructionCard)", "works-element",
     "leg_main_out_1 with has_lateral_offset -5.2"),
    ("3: a vehicle of a jam on another lane", "jam-tail-in-fog",
     [("jam_2_start", "on_lane", "leg_main_out_1")],
     "jam_2 (Van)", "jam-on-its-lane",
     "that of its jam, leg_main_out_2, got leg_main_out_1: A jam"),
    ("3: a vehicle of a jam drives", "jam-tail-in-fog",
     [("jam_3_init_speed", "has_target_speed", 4.0)],
     "jam_3 (Truck)", "jam-stands", "must be 0 at the start, in a jam, got 4: A jam"),
    ("3: vehicles of a jam in each other", "jam-tail-in-fog",
     [("jam_2_start", "has_distance", 311.0)],
     "jam_1 (Car)", "jam-in-a-row",
     "must leave room between the vehicles of a jam, got -3.85 m to jam_2: A jam"),
]  # fmt: skip


@pytest.mark.parametrize("breach", BREACHES, ids=[one[0] for one in BREACHES])
def test_a_planted_breach_is_found_and_named(breach):
    _, name, edits, who, key, said = breach
    scenario, individuals = concrete(name)
    found = [one for one in check(edited(individuals, *edits), scenario) if not one.parameter]
    matching = [one for one in found if one.individual == who and said in one.message]
    assert matching, "\n".join(map(str, found))
    rules = {rule.key: rule for rule in (*placement_rules(), *conduct_rules())}
    for one in matching:
        if key:
            rule = rules[key]
            what = with_unit(rule.at_fault)
            assert one.message.startswith(f"{what} of {who} must " if what else f"{who} must ")
            assert one.message.endswith(rule.why)
            assert "(source: " in rule.why
            assert one.property == rule.at_fault
        assert one.nodes[0].startswith(base_of(individuals))


def test_every_rule_has_a_breach_here():
    rules = {rule.key for rule in (*placement_rules(), *conduct_rules())}
    elsewhere = {"on-its-road", "severity-is-a-probability", "responsible-takes-part"}
    assert {one[4] for one in BREACHES} - {""} == rules - elsewhere  # in test_check, test_outcomes


# What is planted in a part of the weather; which parameter breaks which rule.
WEATHER_BREACHES = [
    ("rain without cloud", {"precipitation": 80.0, "cloudiness": 20.0}, "cloudiness",
     "weather_cloud (Cloud): cloudiness >= precipitation (= 80 with precipitation = 80) must hold "
     "for cloudiness [%], got 20: Rain falls from clouds"),
    ("fog in a gale", {"wind_intensity": 90.0, "fog_density": 80.0}, "fog_density",
     "must hold for fog_density [%], got 80: Fog may be dense in calm air"),
    ("light through clouds", {"cloudiness": 100.0, "sun_altitude_angle": 50.0},
     "sun_altitude_angle", "got 50: Clouds and fog take light away"),
    ("light through fog", {"wind_intensity": 0.0, "cloudiness": 0.0, "precipitation": 0.0,
     "fog_density": 100.0, "sun_altitude_angle": 45.0}, "sun_altitude_angle",
     "got 45: Clouds and fog take light away"),
    ("dry road in the rain", {"precipitation_deposits": 0.0}, "precipitation_deposits",
     "must hold for precipitation_deposits [%], got 0: Rain stays on the road"),
    ("puddles without wetness", {"wetness": 0.0}, "wetness", "for wetness [%], got 0: The surface"),
    ("grip on a wet road", {"friction": 1.3}, "friction", "for friction [1], got 1.3: Water"),
    ("clear fog", {"fog_distance": 500.0}, "fog_distance", "fog_distance [m], got 500: The denser"),
    ("fog all the way up", {"fog_falloff": 50.0}, "fog_falloff", "got 50: Dense fog is shallow"),
    ("sun at midnight", {"sun_azimuth_angle": 31.0}, "sun_azimuth_angle",
     "for sun_azimuth_angle [deg], got 31: Over a day"),
]  # fmt: skip
PARTS = {
    "precipitation": "rain", "precipitation_deposits": "rain", "cloudiness": "cloud",
    "wind_intensity": "wind", "fog_density": "fog", "fog_distance": "fog", "fog_falloff": "fog",
    "sun_altitude_angle": "sun", "sun_azimuth_angle": "sun", "wetness": "roadstate",
    "friction": "roadstate",
}  # fmt: skip


@pytest.mark.parametrize("breach", WEATHER_BREACHES, ids=[one[0] for one in WEATHER_BREACHES])
def test_a_breach_within_the_weather_is_found_and_named(breach):
    _, planted, parameter, said = breach
    scenario, individuals = concrete("crossroads-s4")
    edits = [(f"weather_{PARTS[name]}", f"has_{name}", value) for name, value in planted.items()]
    found = check(edited(individuals, *edits), scenario)
    (sentence,) = [one for one in found if one.parameter == parameter and "must hold" in one.message
                   and said in one.message]  # fmt: skip
    assert "(source: " in sentence.message
    assert sentence.individual.startswith(f"weather_{PARTS[parameter]} (")


@pytest.mark.parametrize(
    "weather",
    [
        {"precipitation": 100.0, "cloudiness": 100.0},
        {"fog_density": 100.0},
        {"sun_altitude_angle": -40.0},
    ],
)
def test_rain_fog_and_night_limit_speed(weather):
    """5 to 4: what is fast enough by the road alone is too fast in such weather."""
    scenario = load("lead-brakes")
    space = scenario.space(axes=list(Axis))
    base = {one.name: one.default for one in scenario.parameters.values()}
    base |= {"wind_intensity": 0.0, "cloudiness": 0.0, "ego_speed": 12.0, "sun_altitude_angle": 5.0}
    base["deceleration"] = 4.0  # what a wet road gives, too
    fast = {"ego_speed": float(scenario.roads.knobs["speed_limit"])}
    for kind, expected in (({}, False), (weather, True)):
        free = space.values(space.row(base | kind))
        found = check(build(scenario, {**free, **fast}, driver="reference"), scenario)
        told = [one for one in found if "as road and weather allow" in one.message]
        assert bool(told) == expected, free["speed_factor"]


@pytest.mark.thorough
def test_another_shacl_processor_blames_the_same():
    """The rules over rdflib's own store and SPARQL engine, which share no code with ours."""
    name = "red-light-runner"
    _, individuals = concrete(name)
    planted = [one for one in BREACHES if one[1] == name and one[4]]
    together = edited(individuals, *(edit for one in planted for edit in one[2]))
    graph = rdflib.Graph().parse(data=to_bytes(together), format="xml")
    for child, _, parent, _ in filter(lambda quad: quad.predicate == SUBCLASS, tbox().quads):
        graph.add((rdflib.URIRef(child.value), rdflib.RDFS.subClassOf, rdflib.URIRef(parent.value)))
    shapes = rdflib.Graph().parse(data=turtle(), format="turtle")
    _, report, _ = pyshacl.validate(graph, shacl_graph=shapes)
    said = {str(text) for text in report.objects(None, rdflib.SH.resultMessage)}
    own = [one for one in check(together) if not one.parameter and "(source: " in one.message]
    assert len(own) >= len({one[4] for one in planted})
    for one in own:  # "has_t [m] of light_A (TrafficLight) must …" here, "has_t [m] must …" there
        rule = one.message[one.message.index(" must ") + 1 :]
        assert any(text.endswith(rule) for text in said), one.message


# -- what is valid ---------------------------------------------------------------------------------


@pytest.mark.parametrize("kind", KINDS)
def test_every_kind_of_road_network_keeps_the_rules(kind):
    assert check(build_static({}, KINDS[kind])) == []


@pytest.mark.parametrize("headings", [(270, 30, 150), (0, 72, 144, 216, 288), (0, 50, 180, 230)])
def test_lights_never_let_conflicting_legs_go(headings):
    legs = {name: LegSpec(float(h)) for name, h in zip("ABCDE", headings, strict=False)}
    roads = replace(usual("crossroads", lanes_per_direction=1), legs=legs, signals="two-phase")
    individuals = build_static({}, roads)
    assert check(individuals) == []
    (controller,) = individuals.of_class("SignalController")
    green = [
        node
        for phase in individuals.links(controller, "has_phase")
        for node in individuals.links(phase, "gives_green_to")
    ]
    assert sorted(green, key=str) == sorted(individuals.links(controller, "has_light"), key=str)


@pytest.mark.parametrize("name", names())
def test_ten_thousand_rows_keep_what_is_declared(name):
    scenario = load(name)
    rng = np.random.default_rng(20)
    for axes in (None, list(Axis)):
        space = scenario.space(axes=axes)
        assert space.violations(space.decode(rng.random((10_000, space.n_var)))) == []


@pytest.mark.parametrize("name", names())
def test_individuals_of_random_rows_keep_all_rules(name):
    scenario = load(name)
    space = scenario.space(axes=list(Axis))
    for row in space.decode(np.random.default_rng(21).random((2, space.n_var))):
        individuals = build(scenario, space.values(row), driver="reference")
        assert check(individuals, scenario) == []


@pytest.mark.parametrize(
    ("name", "law", "rules"),
    [
        ("crossroads-s2", "speed and path", {"bend-of-junction"}),
        ("crossroads-s3", "speed and path", {"bend-of-junction"}),
        ("roundabout-entry", "speed and path", {"bend-of-ring"}),
        ("cyclist-right-turn", "constrain participants)", {"speed-limit"}),
        (
            "jam-tail-in-fog",
            "restricts roads",
            {"closed-by-fog_density", "closed-by-precipitation"},
        ),
    ],
)
def test_decoder_and_sparql_draw_the_line_between_layers_at_the_same_place(name, law, rules):
    """The rules between layers are written for both; a value just within breaks neither."""
    scenario = load(name)
    space = scenario.space(axes=list(Axis))
    found = set()
    for row in space.decode(np.random.default_rng(5).random((2, space.n_var))):
        values = dict(space.values(row))
        for bound in scenario.bounds:
            if law not in bound.source:
                continue
            most = float(bound.hi.evaluate(values))
            for factor in (0.999, 1.001):
                changed = values | {bound.target: factor * most}
                judged = check(build(scenario, changed, driver="reference"), scenario)
                broken = {r.key for r in conduct_rules() for one in judged if r.why in one.message}
                assert bool(broken & rules) == (factor > 1.0), (bound.target, most, judged)
                found |= broken & rules
    assert found == rules


@pytest.mark.parametrize("name", names())
def test_properties_belong_to_what_has_them(name):
    """Else a reasoner takes the individual for something that it is not."""
    _, individuals = concrete(name)
    domains = tbox().domains
    for subject, predicate, _, _ in individuals.quads:
        term = local_name(predicate)
        if term in domains:
            assert individuals.is_a(subject, domains[term]), f"{term} of {subject}"


# -- a second weather ------------------------------------------------------------------------------

LATER = """
  weather_turns:
    weather: later_
    when:
      - {kind: time, value: 5.0}
"""


@pytest.fixture(scope="module")
def changing(tmp_path_factory):
    """Thin fog at first, any fog later."""
    text = files("bridgegen.scenario.catalogue").joinpath("lead-brakes.yaml").read_text("utf-8")
    text = text.replace("include: [", "include: [weather as later_, ")
    text = text.replace("\nevents:\n", f"\nevents:{LATER}")
    bound = "\n  - {target: fog_density, hi: 20, why: It is clear at first., source: ours.}\n"
    assert text.count("\nbounds:\n") == 1
    text = text.replace("\nbounds:\n", f"\nbounds:{bound}")
    path = tmp_path_factory.mktemp("later") / "changing.yaml"
    path.write_text(text, encoding="utf-8")
    scenario = load(path)
    space = scenario.space(axes=list(Axis))
    values = space.values(space.row({"later_fog_density": 80.0, "later_wind_intensity": 0.0}))
    return scenario, values


def test_a_later_weather_has_bounds_of_its_own(changing):
    scenario, values = changing
    assert values["fog_density"] < 20.0 < values["later_fog_density"]
    assert check(build(scenario, values, driver="reference"), scenario) == []


def test_each_weather_is_blamed_for_itself(changing):
    scenario, values = changing
    later = {**values, "later_cloudiness": 0.0, "later_precipitation": 50.0}
    found = check(build(scenario, later, driver="reference"), scenario)
    (cloud,) = [one for one in found if one.parameter.endswith("cloudiness")]
    assert cloud.parameter == "later_cloudiness"
    assert cloud.individual == "later_weather_cloud (Cloud)"
    first = check(build(scenario, {**values, "fog_density": 30.0}, driver="reference"), scenario)
    (fog,) = [one for one in first if one.parameter.endswith("fog_density")]
    assert fog.nodes[0].endswith("#weather_fog")
    approve(fog.message, "30")


def test_the_number_of_constraints_says_all():
    assert constraints_in_words(load("crossroads-s4")).partition(" ")[0].isdigit()
