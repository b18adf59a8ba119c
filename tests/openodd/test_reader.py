"""Operational design domains read from ASAM OpenODD 1.0's YAML."""

import contextlib
import os
from pathlib import Path

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import BridgeGenError, FileFormatError, InputError
from bridgegen.scenario.odd.reader import odd_of, read_odd

ODD = Path(__file__).with_name("my_odd.yaml")


def _read(tmp_path, text):
    (tmp_path / "odd.yaml").write_text(text, encoding="utf-8")
    return read_odd(tmp_path / "odd.yaml")


def _asked(module):
    return f"ODD:\n  one:\n    INCLUDE_AND:\n      {module}\n"


def test_each_construct_is_read():
    odd = read_odd(ODD)
    assert (odd.name, odd.title) == ("my_odd", "Motorway pilot")
    asked = [condition.name for condition in odd.conditions]
    assert asked == [
        "drivable_area_type = motorway, primary_road",
        "number_of_lanes = [2 .. 4]",
        "lane_width >= 300 cm",
        "t_junction = false",
        "traffic_lights = true",
        "agent_type = cars, trucks",
        "emergency_vehicle = true",
        "operational_speed <= 90 km/h",
        "connectivity_bandwidth > 1 Mbps",
        "rain_level >= heavy",
        "visibility < 0.2 km",
        "wind_speed > 10 m/s",
        "rainfall_rate > 2 mm/h",
        "is_signed_off = unknown",
    ]  # the module that is not active asks nothing
    assert not any(condition.problem for condition in odd.conditions)


def test_a_record_holds_the_whole_odd():
    odd = read_odd(ODD)
    found = odd_of(odd.to_record())
    assert (found.formula, found.digest, found.title) == (odd.formula, odd.digest, odd.title)
    changed = odd.to_record()
    changed["files"]["taxonomy.yaml"] += ["  further: boolean"]
    with refuses(FileFormatError, "digest"):
        odd_of(changed)


@pytest.mark.parametrize(
    ("text", "named"),
    [
        ("speed: 3\n", "OpenODD 1.0"),
        ("VERSION: 2\nODD: {}\n", "VERSION"),
        ("ODD: {}\n", "module"),
        ("COD: [{speed: 3}]\n", "module"),
        ("TAXONOMY: {speed: float velocity}\n", "module"),
        ("ODD: {one: {TITLE: empty}}\n", "one"),
        ("ODD: {one: {INCLUDE_AND: {}}}\n", "INCLUDE_AND"),
        ("ODD: {one: {INCLUDE_AND: {a: 1}, INCLUDE_OR: {b: 1}}}\n", "INCLUDE_OR"),
        ("ODD: {one: {INCLUDES: {a: 1}}}\n", "INCLUDES"),
        ("ODD:\n  a: {INCLUDE_AND: {b: true}}\n  b: {INCLUDE_AND: {a: true}}\n", "a → b → a"),
        ("ODD:\n  a: {INCLUDE_AND: {b: perhaps}}\n  b: {INCLUDE_AND: {x: 1}}\n", "perhaps"),
        ("IMPORT: ../other.yaml\n", "other.yaml"),
        ("IMPORT: [[a]]\n", "IMPORT"),
        ("ODD: &x [*x]\n", "x"),
        ("conversion: {length: {m: {ell: {scale: 0}}}}\nODD: {a: {INCLUDE_AND: {x: 1}}}", "scale"),
    ],
)
def test_what_is_no_odd_is_refused(tmp_path, text, named):
    (tmp_path / "sub").mkdir()
    with refuses(FileFormatError, named):
        _read(tmp_path / "sub", text)


def test_a_missing_import_is_named(tmp_path):
    with refuses(InputError, "gone.yaml"):
        _read(tmp_path, "IMPORT: gone.yaml\n" + _asked("x: 1"))


def test_an_import_does_not_leave_its_folder_by_a_link(tmp_path):
    (tmp_path / "sub").mkdir()
    (tmp_path / "secret.yaml").write_text("TAXONOMY: {x: boolean}\n", encoding="utf-8")
    os.symlink(tmp_path / "secret.yaml", tmp_path / "sub" / "near.yaml")
    with refuses(FileFormatError, "near.yaml"):
        _read(tmp_path / "sub", "IMPORT: near.yaml\n" + _asked("x: true"))


def test_expressions_with_parameters_are_kept_as_what_cannot_be_judged(tmp_path):
    odd = _read(tmp_path, _asked("lane_width: > 2*$ego_width"))
    assert [c.problem for c in odd.conditions] == ["its expression has parameters"]


def test_several_groups_of_a_section_all_count(tmp_path):
    odd = _read(
        tmp_path,
        "MODULE:\n  one:\n    INCLUDE_AND:\n      OR: {a: 1, b: 1}\n      OR:\n"
        "        c: 1\n        d: 1\n".replace(
            "OR: {a: 1, b: 1}", "OR:\n        a: 1\n        b: 1"
        ),
    )
    assert [condition.concept for condition in odd.conditions] == ["a", "b", "c", "d"]


@pytest.mark.thorough
@given(st.text(max_size=300) | st.binary(max_size=300).map(lambda data: data.decode("latin-1")))
def test_any_text_is_read_or_refused_in_words(tmp_path_factory, text):
    folder = tmp_path_factory.mktemp("odd")
    with contextlib.suppress(BridgeGenError, UnicodeEncodeError):
        _read(folder, "ODD:\n  one:\n    INCLUDE_AND:\n" + text)
