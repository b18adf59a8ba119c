"""The table of the weather, from a scenario file to the page; no quantity is named in the laws."""

import math
import re
from dataclasses import replace
from importlib.resources import files

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from bridgegen.drivers import _weather_columns as column
from bridgegen.openx.opendrive.from_owl import opendrive_from_owl
from bridgegen.openx.openscenario import model as osc
from bridgegen.openx.openscenario.element import rewritten
from bridgegen.openx.openscenario.from_owl import openscenario_from_owl
from bridgegen.openx.openscenario.to_owl import individuals_from_openscenario
from bridgegen.scenario.language.checks import NEEDED
from bridgegen.scenario.language.expression import parse
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.ontology.individuals import build
from bridgegen.scenario.ontology.questions import ask, questions
from bridgegen.scenario.ontology.shapes import WEATHER_PATHS
from bridgegen.scenario.ontology.vocabulary import XSD, bg, tbox
from bridgegen.scenario.weather import (
    CARLA_FIELDS,
    CARLA_NAMES,
    COLUMNS,
    PARAMETERS,
    PARTS,
    PHRASES,
    PHYSICAL,
    RAIN,
    STATED_BY,
    VISIBILITY,
    WIND,
    in_words,
    rain_formula,
)

ALL = list(PARAMETERS.values())
LAWFUL = [one for one in ALL if one.stands_for]
CLEAR = {one.name: one.clear for one in COLUMNS}


def name_of(one):
    return one.name


def at(formula, x):
    return float(parse(formula).evaluate({"x": x}))


# -- laws ------------------------------------------------------------------------------------------


def test_what_the_percentages_stand_for():
    """By hand: at 0 %, half way and 100 %; files of earlier versions hold these very texts."""
    assert RAIN.formula == "0.1*pow(500,x/100)*ceil(x/100)"
    assert rain_formula("($p)") == "0.1*pow(500,($p))*ceil(($p))"
    assert VISIBILITY.formula == "10000/pow(200,x/100)"
    assert WIND.formula == "0.2*x"
    assert [at(RAIN.formula, x) for x in (0.0, 100.0)] == [0.0, pytest.approx(50.0)]
    assert [at(VISIBILITY.formula, x) for x in (0.0, 100.0)] == [10_000.0, pytest.approx(50.0)]
    assert at(WIND.formula, 100.0) == 20.0
    assert RAIN.inverse(0.1 * math.sqrt(500.0)) == pytest.approx(50.0)
    assert RAIN.inverse(0.0) == 0.0
    assert VISIBILITY.inverse(1e4 / math.sqrt(200.0)) == pytest.approx(50.0)
    assert WIND.inverse(5.0) == pytest.approx(25.0)
    text = (files("bridgegen.scenario.catalogue") / "weather.yaml").read_text("utf-8")
    for said in ("0.1·500^(p/100) mm/h", "10000·200^(-f/100) m", "0.2 m/s of wind"):
        assert said in text


@pytest.mark.parametrize("one", LAWFUL, ids=name_of)
@given(share=st.floats(0.001, 1.0))
def test_every_law_has_its_inverse(one, share):
    most = {"%": 100.0, "deg": 90.0, "1": 1.0, "mm/h": 50.0}[one.unit]
    x = share * most
    assert one.law.inverse(at(one.law.formula, x)) == pytest.approx(x, rel=1e-9)


# -- the table and what is made of it --------------------------------------------------------------


def test_the_table_is_whole():
    assert {one.stands_for for one in LAWFUL} <= PHYSICAL.keys()
    assert {of for one in ALL for of, _ in one.formulas} == PHYSICAL.keys()
    assert [one for part in PARTS.values() for one in part] == ALL  # parts are not interleaved
    for physical in PHYSICAL.values():
        # what is no element is a property, which only a parameter's name can find
        assert physical.element or STATED_BY[physical.name].unit == "%"
        assert bool(physical.element) == bool(physical.attribute)


@pytest.mark.parametrize("one", ALL, ids=name_of)
def test_the_ontology_has_every_parameter(one):
    terms, has = tbox(), one.owl_property
    assert terms.kinds[has] == "DatatypeProperty"
    assert terms.domains[has] == one.part.owl_class
    assert terms.ranges[has].value == XSD + "double"
    assert terms.units.get(has, "1") == one.unit
    assert has in terms.functional
    assert terms.labels[has].startswith("has ")
    assert bool(terms.comments[has])
    assert bool(terms.sources[has])


@pytest.mark.parametrize("part", PARTS, ids=lambda part: part.owl_class)
def test_the_ontology_has_every_part(part):
    terms = tbox()
    assert terms.kinds[part.link] == "ObjectProperty"
    assert terms.domains[part.link] == "Weather"
    assert terms.ranges[part.link] == bg(part.owl_class)
    assert terms.parents[part.owl_class] == ("WeatherEnvironment",)
    (group,) = (names for names in terms.disjoint if "Weather" in names)
    assert set(group) == {"Weather", *(one.owl_class for one in PARTS)}
    required = {one.owl_property for one in PARTS[part] if one.is_required}
    assert set(terms.requires.get(part.owl_class, ())) <= required


def test_the_ontology_has_no_other():
    terms = tbox()
    parts = {one.owl_class for one in PARTS}
    assert {one for one, cls in terms.domains.items() if cls in parts} == {
        one.owl_property for one in ALL
    }


def test_every_scenario_declares_them():
    declared = {one.name: one.unit for one in ALL if one.is_declared}
    assert {"speed_factor": "1"} | declared == NEEDED
    assert WEATHER_PATHS.keys() == declared.keys()
    scenario = load("cut-in")
    found = scenario.parameters | {one.name: one for one in scenario.derived}
    assert {name: found[name].unit for name in declared} == declared
    for name in declared.keys() & scenario.parameters.keys():
        field = CARLA_FIELDS[PARAMETERS[name].carla]
        assert field.low <= found[name].low < found[name].high <= field.high


def test_the_columns_are_those_of_the_kernels():
    assert column.STATED == len(COLUMNS) == len(column.CLEAR_DAY)
    for index, one in enumerate(COLUMNS):
        assert getattr(column, one.name.upper()) == index
        assert column.CLEAR_DAY[index] == one.clear
    derived = (
        column.EXTINCTION, column.ATTENUATION, column.BACKGROUND, column.GLARE, column.GLASS,
        column.FRICTION, column.SUN_X, column.SUN_Y, column.SIGHT,
    )  # fmt: skip
    assert derived == tuple(range(column.STATED, column.STATED + 9))


def test_the_clear_day_is_clear():
    assert CLEAR["visual_range"] == 10_000.0  # WMO
    assert (CLEAR["rain"], CLEAR["snow"], CLEAR["cloud"]) == (0.0, 0.0, 0.0)
    assert (CLEAR["sun_azimuth"], CLEAR["sun_elevation"]) == (math.pi, math.radians(45.0))
    assert CLEAR["friction_scale"] == 1.0


def test_every_field_of_carla_has_a_name_in_our_files():
    assert set(CARLA_NAMES.values()) == CARLA_FIELDS.keys()
    assert all(one.carla in CARLA_FIELDS for one in ALL if one.carla)
    assert {one.name for one in ALL if not one.carla} == {"friction", "snowfall"}


# -- there and back --------------------------------------------------------------------------------


@pytest.fixture(scope="module", params=["jam-tail-in-fog", "pedestrian-at-night"])
def case(request):
    scenario = load(request.param)
    space = scenario.space()
    values = space.values(space.decode(np.full((1, space.n_var), 0.37))[0])
    return values, build(scenario, values, driver="reference")


def numbers(individuals):
    """Return the parameters of the scenario's weather, by name."""
    (scenario,) = individuals.of_class("Scenario")
    weather = individuals.link(scenario, "has_weather")
    return {
        one.name: value
        for part, parameters in PARTS.items()
        if (node := individuals.optional_link(weather, part.link)) is not None
        for one in parameters
        if (value := individuals.optional_number(node, one.owl_property)) is not None
    }


def without_properties(one):
    return replace(one, properties=None) if isinstance(one, osc.RoadCondition) else one


def test_our_files_bring_every_parameter_back(case):
    values, individuals = case
    storyboard = openscenario_from_owl(individuals, "map.xodr")
    roads = opendrive_from_owl(individuals)
    again, lost = individuals_from_openscenario(storyboard, roads, "map.xodr")
    assert lost == []
    assert numbers(again) == numbers(individuals)
    assert numbers(individuals) == {one.name: values[one.name] for one in ALL if one.is_declared}


def test_the_standard_s_own_elements_bring_back_what_they_say(case):
    _, individuals = case
    storyboard = rewritten(openscenario_from_owl(individuals, "map.xodr"), without_properties)
    roads = opendrive_from_owl(individuals)
    again, _ = individuals_from_openscenario(storyboard, roads, "map.xodr", partial=True)
    before, found = numbers(individuals), numbers(again)
    for one in LAWFUL:
        if one.is_declared and PHYSICAL[one.stands_for].element:
            turn = math.remainder(found[one.name] - before[one.name], 360.0)
            assert turn == pytest.approx(0.0, abs=1e-9), one.name
    assert found["cloudiness"] == pytest.approx(before["cloudiness"], abs=12.5)  # eighths


def test_questions_about_the_weather_name_no_part(case):
    _, individuals = case
    answers = {what for _, what, _, _ in ask(individuals, "weather").rows}
    labels = {tbox().labels[one.owl_property].removeprefix("has ") for one in ALL}
    assert answers == labels - {"snowfall"}
    for name in ("weather", "weather-changes"):
        query = questions()[name].query
        assert [one.link for one in PARTS if f"bg:{one.link}" in query] == []


# -- the page --------------------------------------------------------------------------------------


@pytest.mark.parametrize(
    ("changed", "words"),
    [
        ({}, "day"),
        ({"sun_elevation": math.radians(-3.0)}, "dusk"),
        ({"sun_elevation": -0.5, "visual_range": 79.4}, "night, fog, visibility 79 m"),
        ({"visual_range": 234.0, "friction_scale": 0.95}, "day, fog, visibility 234 m"),
        ({"visual_range": 2345.0}, "day, haze, visibility 2.3 km"),
        ({"visual_range": 4000.0, "rain": 12.0}, "day, haze, visibility 4 km, rain 12 mm/h"),
        ({"rain": 0.36, "friction_scale": 0.6}, "day, rain 0.4 mm/h, friction 60 % of dry"),
        ({"snow": 2.5, "friction_scale": 0.07}, "day, snow 2.5 mm/h, friction 7 % of dry"),
    ],
)  # fmt: skip
def test_the_weather_in_words(changed, words):
    assert in_words(CLEAR | changed) == words


def test_every_phrase_is_of_a_column():
    assert PHRASES.keys() <= CLEAR.keys()


def test_the_page_draws_what_it_is_sent_and_has_no_words_of_its_own():
    web = files("bridgegen.pages").joinpath("web")
    drawing = (web / "atmosphere.js").read_text("utf-8")
    used = set(re.findall(r"\bweather\.(\w+)", drawing))
    sent = CLEAR.keys() | {"sight", "background"}
    assert used <= sent
    assert {"friction_scale", "rain", "snow", "sight", "background"} <= {
        word for word in re.findall(r"\w+", drawing) if word in sent
    }
    assert "visibility" not in (web / "words.js").read_text("utf-8")
