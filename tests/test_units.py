"""Numbers with a unit: what they are in SI, and which are refused."""

import re
from importlib import resources
from pathlib import Path

import jsonschema
import pytest
import yaml
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import ScenarioError
from bridgegen.base.units import WRITTEN, has_unit, in_unit
from bridgegen.scenario.language.json_schema import schema
from bridgegen.scenario.language.parameters import UNITS
from bridgegen.scenario.language.reader import load


@pytest.mark.parametrize(
    ("text", "unit", "value"),
    [
        ("90 km/h", "m/s", 25.0),
        ("90km/h", "m/s", 25.0),
        ("60 mph", "m/s", 26.8224),  # the mile is 1609.344 m by definition
        ("5 cm", "m", 0.05),
        ("6 ft", "m", 1.8288),
        ("1.5 min", "s", 90.0),
        ("-30 deg", "deg", -30.0),
        ("3.141592653589793 rad", "deg", 180.0),
        ("80 %", "%", 80.0),
        ("80 %", "1", 0.8),
        ("1 g", "m/s²", 9.80665),
        ("1.5 t", "kg", 1500.0),
        ("50 °F", "°C", 10.0),
        ("0 K", "°C", -273.15),
        ("2e3 1/km", "1/m", 2.0),
    ],
)
def test_values(text, unit, value):
    assert has_unit(text)
    assert in_unit(text, unit) == pytest.approx(value, rel=1e-15)


@given(st.floats(-1e6, 1e6, allow_subnormal=False), st.sampled_from(sorted(WRITTEN)))
def test_the_unit_itself_changes_nothing(value, unit):
    if unit in WRITTEN[unit]:
        text = f"{value!r} {unit}"
        assert not has_unit(text) or in_unit(text, unit) == value


def test_every_unit_is_a_parameter_s():
    assert {*WRITTEN} < {*UNITS}


@pytest.mark.parametrize("text", ["12", "ego_speed", "1e-3", "5*speed", "0.5 + 2", "3-speed", ""])
def test_what_has_no_unit(text):
    assert not has_unit(text)


@pytest.mark.parametrize(
    ("text", "unit", "message"),
    [
        ("5 cm", "m/s", "must be a number in m/s, or one with a unit (m/s, km/h, mph)"),
        ("90 kmh", "m/s", "(m/s, km/h, mph; did you mean 'km/h'?)"),
        ("5 cm", "count", "must be a number without a unit"),
        ("5 cm", "1", "must be a number without a unit, or one with a unit (%)"),
    ],
)
def test_refusals(text, unit, message):
    with pytest.raises(ValueError, match=re.escape(message)):
        in_unit(text, unit)


@pytest.fixture
def cut_in(tmp_path):
    """Write the scenario cut-in with some texts replaced; return the file."""
    folder = resources.files("bridgegen.scenario.catalogue")
    for one in folder.iterdir():
        if one.name.endswith(".yaml"):
            (tmp_path / one.name).write_bytes(one.read_bytes())

    def write(*changes: tuple[str, str]) -> Path:
        path = tmp_path / "cut-in.yaml"
        text = path.read_text("utf-8")
        for old, new in changes:
            assert old in text
            text = text.replace(old, new, 1)
        path.write_text(text, "utf-8")
        return path

    return write


def test_a_scenario_file_in_other_units(cut_in):
    changed = cut_in(
        ("duration: 20.0", "duration: 20000 ms"),
        ("time_step: 0.05", "time_step: 50 ms"),
        ("speed_limit: 36.1", "speed_limit: 129.96 km/h"),
        ("closing_fog_density: 90.0", "closing_fog_density: 90 %"),
        ("distance: 60.0", "distance: 6000 cm"),
        ("value: 8.0", "value: 8000 ms"),
        ("low: 15.0", "low: 54 km/h"),
        ("high: 33.0", "high: 118.8 km/h"),
        ("default: 25.0", "default: 90 km/h"),
        ("low: 10.0", "low: 0.01 km"),
    )
    before, after = load("cut-in"), load(changed)
    assert (after.duration, after.time_step) == (before.duration, before.time_step)
    assert (after.roads, after.story) == (before.roads, before.story)
    assert after.parameters == before.parameters
    jsonschema.Draft7Validator(schema()).validate(yaml.safe_load(changed.read_text("utf-8")))


def test_a_wrong_unit_says_which_is_needed(cut_in):
    duration = yaml.safe_load(cut_in().read_text("utf-8"))["duration"]
    with pytest.raises(ScenarioError) as refused:
        load(cut_in((f"duration: {duration}", "duration: 12 km/h")))
    assert re.search(
        r"duration must be a number in s, or one with a unit \(s, ms, min, h\), got '12 km/h' "
        r"\(.*cut-in.yaml, line \d+\)",
        str(refused.value),
    )


def test_fixed_parameters_with_a_unit():
    space = load("crossroads-s4").space(None, {"ego_speed": "18 km/h"})
    assert space.fixed == {"ego_speed": 5.0}
    with refuses(ScenarioError, "ego_speed"):
        load("crossroads-s4").space(None, {"ego_speed": "5 cm"})
