"""Scenarios bounded by an operational design domain."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import FileFormatError, ScenarioError
from bridgegen.scenario.language.parameters import Axis
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.odd.bounding import bounded
from bridgegen.scenario.odd.reader import read_odd
from bridgegen.scenario.odd.states import concept_of, states_of, table

ODD = Path(__file__).with_name("my_odd.yaml")


def _odd(folder, include="", exclude="", more=""):
    lines = ["ODD:", "  one:"]
    for kind, text in (("INCLUDE_AND", include), ("EXCLUDE_OR", exclude)):
        lines += [f"    {kind}:", *(f"      {line}" for line in text.splitlines())] if text else []
    (folder / "odd.yaml").write_text("\n".join(lines) + "\n" + more, encoding="utf-8")
    return read_odd(folder / "odd.yaml")


def _rows(scenario, n=2000, axes=None):
    space = scenario.space(axes)
    X = space.decode(np.random.default_rng(1).random((n, space.n_var)))
    return dict(zip(space.names, X.T, strict=True))


def _rain(x):
    return np.where(x > 0, 0.1 * 500 ** (x / 100), 0.0)


def test_conditions_narrow_ranges_exactly():
    scenario = bounded(load("cut-in"), read_odd(ODD))
    ranges = {name: (p.low, p.high) for name, p in scenario.parameters.items()}
    assert ranges["ego_speed"] == (15.0, pytest.approx(90 / 3.6, rel=1e-8))
    assert _rain(ranges["precipitation"][1]) == pytest.approx(10.0, rel=1e-8)
    # 200 m are the fog density at which 10000/200^(f/100) m are so many
    assert ranges["fog_density"] == (0.0, pytest.approx(100 * np.log(50) / np.log(200), rel=1e-8))
    assert ranges["wind_intensity"] == (0.0, 100.0)


def test_combinations_become_bounds_that_the_decoder_keeps():
    scenario = bounded(load("cut-in"), read_odd(ODD))
    assert not scenario.checks
    rows = _rows(scenario)
    wind, rain = 0.2 * rows["wind_intensity"], _rain(rows["precipitation"])
    assert not ((wind > 10.001) & (rain > 2.001)).any()
    # and nothing else is lost: wind above 10 m/s and rain above 2 mm/h both occur alone
    assert (wind > 15).any()
    assert (rain > 8).any()


def test_what_a_scenario_cannot_state_is_listed_and_bounds_nothing():
    fit = bounded(load("cut-in"), read_odd(ODD)).odd
    assert fit.gaps == {
        "connectivity_bandwidth > 1 Mbps": "no scenario states it",
        "is_signed_off = unknown": "no scenario states it",
    }


def test_a_scenario_without_an_odd_is_as_before():
    assert load("cut-in").odd is None
    assert load("cut-in").fingerprint != bounded(load("cut-in"), read_odd(ODD)).fingerprint


def test_without_anything_to_bound_the_scenario_stays_what_it_is(tmp_path):
    odd = _odd(tmp_path, include='operational_speed: "<= 300 km/h"\nlatency: "< 1 ms"')
    assert bounded(load("cut-in"), odd).fingerprint == load("cut-in").fingerprint


@pytest.mark.parametrize(
    ("include", "exclude", "named"),
    [
        ('operational_speed: "<= 40 km/h"', "", "operational_speed <= 40 km/h"),
        ("drivable_area_type: [town]", "", "motorway"),
        ('number_of_lanes: ">= 3"', "", "cut-in has 2"),
        ('curve_radius: "< 500 m"', "", "cut-in has none"),
        ("pedestrian: true", "", "pedestrian"),
        ("t_junction: true", "", "t_junction"),
        ("agent_type: [pedestrians]", "", "has car"),
        ("", "agent_type: [motor_vehicle]", "motor_vehicle"),
        ('rainfall_rate: "> 10 mm/h"', 'rainfall_rate: "> 5 mm/h"', "rainfall_rate > 10 mm/h"),
        ('rainfall_rate: "> 80 mm/h"', "", "80 mm/h"),
        ("road_surface_condition: [icy_road]", "", "icy_road"),
        ('visibility: "< 100 m"\nwind_speed: "> 15 m/s"', "", "visibility"),
    ],
)
def test_an_odd_that_excludes_every_row_says_what_it_asks(tmp_path, include, exclude, named):
    with refuses(ScenarioError, named):
        bounded(load("cut-in"), _odd(tmp_path, include, exclude))


@pytest.mark.parametrize("text", ['operational_speed: "<= 40 lx"', 'number_of_lanes: "[3 .. 2]"'])
def test_a_condition_that_no_number_can_keep_is_refused(tmp_path, text):
    with refuses(FileFormatError, text.partition(":")[0]):
        bounded(load("cut-in"), _odd(tmp_path, text))


def test_literals_that_define_each_other_are_refused(tmp_path):
    more = "TAXONOMY:\n  a:\n    x: {b: y}\n  b:\n    y: {a: x}\n"
    with refuses(FileFormatError, "a → b → a"):
        bounded(load("cut-in"), _odd(tmp_path, "a: x", more=more))


def test_modules_that_double_at_each_step_are_refused_at_once(tmp_path):
    lines = ["MODULES:"]
    for number in range(25):
        nested = f"      OR:\n        m{number + 1}: true"
        lines += [f"  m{number}:", "    INCLUDE_AND:", f"      m{number + 1}: true", nested]
    lines += ["  m25:", "    INCLUDE_AND:", '      rainfall_rate: "< 1 mm/h"']
    (tmp_path / "odd.yaml").write_text("\n".join(lines) + "\n")
    with refuses(FileFormatError, "5,000"):
        bounded(load("cut-in"), read_odd(tmp_path / "odd.yaml"))


def test_where_narrowing_would_leave_no_value_rows_are_refused_instead(tmp_path):
    """Fog that wind takes away: a bound of the weather stands against the ODD's range."""
    scenario = bounded(load("cut-in"), _odd(tmp_path, 'visibility: "< 500 m"'))
    assert [check.why for check in scenario.checks] == ["visibility < 500 m"]
    assert scenario.parameters["fog_density"].low == 0.0
    rows = _rows(scenario)
    (broken,) = scenario.broken(rows).values()
    assert np.array_equal(broken, ~scenario.odd.inside(rows))
    assert 0 < broken.mean() < 1


def test_roads_of_a_map_are_not_judged(tmp_path):
    odd = _odd(tmp_path, 'lane_width: ">= 9 m"\nt_junction: true\noperational_speed: "< 90 km/h"')
    fit = bounded(load("cut-in"), odd, on_map=True).odd
    assert set(fit.gaps.values()) == {"the roads of a map are not read"}
    assert len(fit.gaps) == 2


def test_units_of_a_file_are_converted(tmp_path):
    more = "conversion:\n  velocity:\n    m/s:\n      kn:\n        scale: 1.943844\n"
    odd = _odd(tmp_path, 'operational_speed: "<= 48.5961 kn"', more=more)
    high = bounded(load("cut-in"), odd).parameters["ego_speed"].high
    assert high == pytest.approx(25.0, rel=1e-6)


def test_participants_that_a_category_gives_are_excluded_row_by_row(tmp_path):
    ncap = load("paper/crossroads-s1")
    bv = replace(ncap.participants[1], type_by="kind", types=("car", "truck"))
    kind = replace(
        load("cut-in").parameters["gap"], name="kind", unit="1", low=0, high=1, default=0
    )
    from bridgegen.scenario.language.kinds import Category

    kind = replace(kind, kind=Category(("car", "truck")), axis=Axis.PARTICIPANTS)
    story = replace(ncap.story, participants=(ncap.participants[0], bv))
    scenario = replace(ncap, story=story, parameters=ncap.parameters | {"kind": kind})
    found = bounded(scenario, _odd(tmp_path, exclude="agent_type: [trucks]"))
    rows = _rows(found)
    (broken,) = found.broken(rows).values()
    assert np.array_equal(broken, rows["kind"] == 1)


def test_every_attribute_of_the_table_is_stated_of_each_template():
    """Each quantity's values lie between the limits that the table gives."""
    for name in ("cut-in", "crossroads-s4", "roundabout-entry", "motorway-merge"):
        states = states_of(load(name))
        rows = _rows(load(name), axes=list(Axis))
        for quantity, formula in states.quantities.items():
            entry = table().quantities[quantity]
            values = np.atleast_1d(formula.evaluate(rows))
            if quantity != "curve_radius":
                assert entry["low"] - 1e-6 <= values.min(), quantity
                assert values.max() <= entry["high"] + 1e-6, quantity
        for concept in table().concepts.values():
            row = {key: float(values[0]) for key, values in rows.items()}
            value = states.value(concept, row)
            assert value is None or isinstance(value, float | list)


# -- the same verdict as openodd-py's --

_NUMERIC = {
    "rainfall_rate": ("mm/h", 0.0, 50.0, "precipitation_rate"),
    "wind_speed": ("m/s", 0.0, 20.0, "velocity"),
    "visibility": ("m", 50.0, 10_000.0, "length"),
    "operational_speed": ("km/h", 50.0, 120.0, "velocity"),
    "lane_width": ("m", 3.0, 4.0, "length"),
}


@st.composite
def _conditions(draw):
    name = draw(st.sampled_from([*_NUMERIC, "t_junction", "agent_type", "latency"]))
    if name == "latency":
        return 'latency: "< 10 s"'
    if name == "t_junction":
        return f"t_junction: {draw(st.sampled_from(['true', 'false']))}"
    if name == "agent_type":
        return f"agent_type: [{draw(st.sampled_from(['car', 'truck', 'car, truck']))}]"
    unit, low, high, _ = _NUMERIC[name]
    a, b = sorted(round(low + draw(st.integers(0, 97)) / 97 * (high - low), 3) for _ in range(2))
    text = draw(st.sampled_from([f"< {a}", f">= {a}", f"> {b}", f"<= {b}", f"[{a} .. {b}]"]))
    return f'{name}: "{text} {unit}"'


@st.composite
def _modules(draw, modules=("one", "two", "three")):
    lines = ["ODD:"]
    for number, name in enumerate(modules):
        lines += [f"  {name}:"]
        chosen = draw(st.sampled_from([("INCLUDE",), ("EXCLUDE",), ("INCLUDE", "EXCLUDE")]))
        for kind in chosen:
            sign = draw(st.sampled_from(["AND", "OR"]))
            lines += [f"    {kind}_{sign}:"]
            found = draw(st.lists(_conditions(), min_size=1, max_size=3, unique_by=_named))
            lines += [f"      {each}" for each in found]
            if draw(st.booleans()):
                other = "OR" if sign == "AND" else "AND"
                inner = draw(st.lists(_conditions(), min_size=1, max_size=2, unique_by=_named))
                lines += [f"      {other}:", *(f"        {each}" for each in inner)]
            if number + 1 < len(modules) and draw(st.booleans()):
                lines += [
                    f"      {modules[number + 1]}: {draw(st.sampled_from(['true', 'false']))}"
                ]
    return "\n".join(lines) + "\n"


def _named(text):
    return text.partition(":")[0]


_TAXONOMY = (
    "TAXONOMY:\n"
    + "".join(f"  {name}: float {kind}\n" for name, (_, _, _, kind) in _NUMERIC.items())
    + "  t_junction: boolean\n  agent_type: [car, truck]\n  latency: float time\n"
)


@given(_modules())
@settings(deadline=None, max_examples=60)
def test_rows_are_judged_as_by_openodd_py_and_bounded_rows_are_inside(tmp_path_factory, text):
    openodd = pytest.importorskip("openodd")
    folder = tmp_path_factory.mktemp("odd")
    (folder / "odd.yaml").write_text(_TAXONOMY + text, encoding="utf-8")
    bindings = {
        name: {"probe": "tests:none", "unit": unit} for name, (unit, *_) in _NUMERIC.items()
    }
    backend = openodd.Backend(
        probes={name: (lambda _: None, unit) for name, (unit, *_) in _NUMERIC.items()}
    )
    bindings = {name: {"probe": name} for name in _NUMERIC}
    peer = openodd.load_openodd(folder / "odd.yaml", bindings=bindings, backend=backend)
    names = {attribute.name.rpartition(".")[2]: attribute.name for attribute in peer.attributes}
    scenario = load("cut-in")
    states = states_of(scenario)

    def verdict(rows, i):
        row = {name: float(values[i]) for name, values in rows.items()}
        values = {}
        for name in (*_NUMERIC, "t_junction", "agent_type"):
            value = states.value(concept_of(name), row)
            values[names[name]] = value[0] if isinstance(value, list) else value
        values[names["t_junction"]] = values[names["t_junction"]] == "true"
        return peer.evaluate(values).inside

    try:
        found = bounded(scenario, read_odd(folder / "odd.yaml"))
    except ScenarioError:
        rows = _rows(scenario, 60, list(Axis))
        assert not any(verdict(rows, i) for i in range(60))
        return
    # Any row of the scenario is inside, or not, by both.
    rows = _rows(scenario, 60, list(Axis))
    ours = found.odd.inside(rows)
    assert [verdict(rows, i) for i in range(60)] == ours.tolist()
    # What the bounded scenario's decoder makes, and no check refuses, is inside by both.
    rows = _rows(found, 60, list(Axis))
    broken = np.zeros(60, np.bool_)
    for each in found.broken(rows).values():
        broken |= each
    assert found.odd.inside(rows)[~broken].all()
    assert all(verdict(rows, i) for i in np.flatnonzero(~broken)[:20])
