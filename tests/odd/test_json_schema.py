"""The schema of scenario files agrees with their reader, whatever a file says."""

import copy
import json
from functools import lru_cache
from importlib import resources
from pathlib import Path

import pytest
from hypothesis import given, settings
from hypothesis import strategies as st
from tests.approval import refuses

from bridgegen.base.errors import InputError, StorageError
from bridgegen.scenario.language.json_schema import schema, schema_text, write_schema
from bridgegen.scenario.language.plain_yaml import Document, read_plain_yaml
from bridgegen.scenario.language.reader import _Declarations, build, names
from bridgegen.scenario.language.schema import FragmentFile, ScenarioFile
from bridgegen.scenario.language.schema_types import shape_problems

ROOT = Path(__file__).parents[2]
OTHERS = [
    ROOT / "tests/campaign/t-turn.yaml",
    ROOT / "tests/report/all_layers.yaml",
    ROOT / "tests/ontology/everything.yaml",
    ROOT / "docs/examples/braking-manner.yaml",
    ROOT / "docs/examples/oil-spill.yaml",
    ROOT / "src/bridgegen/scenario/language/starter.yaml",
]


def catalogue(name: str) -> object:
    data = resources.files("bridgegen.scenario.catalogue").joinpath(f"{name}.yaml").read_bytes()
    return read_plain_yaml(data, name).data


@lru_cache
def validator(kind):
    from jsonschema import Draft7Validator

    return Draft7Validator(schema(kind))


def problems(kind: str, data: object) -> list[str]:
    return [f"{one.json_path}: {one.message}" for one in validator(kind).iter_errors(data)]


def test_they_are_schemas():
    for each in (validator("scenario"), validator("fragment")):
        each.check_schema(each.schema)
        for section in (each.schema, *each.schema["definitions"].values()):
            assert section["additionalProperties"] is False
            assert section["description"]
            for name, one in section["properties"].items():
                assert one.get("description") or "$ref" in one, name  # what an editor shows


@pytest.mark.parametrize("name", names())
def test_every_scenario_that_ships_is_valid(name):
    assert problems("scenario", catalogue(name)) == []


@pytest.mark.parametrize("name", names("fragment"))
def test_every_fragment_that_ships_is_valid(name):
    assert problems("fragment", catalogue(name)) == []
    assert problems("scenario", catalogue(name))


@pytest.mark.parametrize("path", OTHERS, ids=lambda path: path.stem)
def test_every_other_file_is_valid(path):
    assert problems("scenario", read_plain_yaml(path.read_bytes(), path.name).data) == []


VALUES = [
    None, True, 0, 1, -1, 0.5, 2.0, 7, 12, 1e30, "", " ", "x", "ego", "bv_speed", "a b", "P3",
    "P11", "A", "in", "sidewalk", "car", "crossroads", "road", "participants", "time", "after", "m",
    "km/h", [], [[]], {}, {"x": 1}, ["participants"], [{}], "cubic", "two-phase", "entropy",
]  # fmt: skip
KEYS = [
    "ego", "kind", "to", "event", "all", "of", "participant", "weather", "speed", "rate", "time",
    "distance", "lane_change", "point", "leg", "way", "lane", "path", "start", "end", "unit", "lo",
    "hi", "radius", "length", "segments", "signals", "legs", "heading", "turns", "x", "Not a name",
]  # fmt: skip


def places(data: object, path: tuple = ()) -> list[tuple]:
    """Return the path of every entry."""
    inside = data.items() if isinstance(data, dict) else enumerate(data) if data else ()
    found = []
    for key, value in inside:
        found.append((*path, key))
        if isinstance(value, dict | list):
            found += places(value, (*path, key))
    return found


@st.composite
def changed(draw, originals):
    """A file with one to three changes: an entry that is gone, another, or new."""
    data = copy.deepcopy(draw(st.sampled_from(originals)))
    for _ in range(draw(st.integers(1, 3))):
        paths = places(data)
        *parents, last = draw(st.sampled_from(paths))
        at = data
        for key in parents:
            at = at[key]
        what = draw(st.sampled_from(["drop", "replace", "replace", "add"]))
        value = copy.deepcopy(draw(st.sampled_from(VALUES)))
        if what == "drop":
            del at[last]
        elif what == "replace":
            at[last] = value
        elif isinstance(at, dict):
            at[draw(st.sampled_from(KEYS))] = value
        else:
            at.append(value)
        if not data:
            break
    return data


def change(data, path, value):
    """Set an entry; None: drop it."""
    *parents, last = path
    for key in parents:
        data = data[key]
    if value is None:
        del data[last]
    else:
        data[last] = value


def refused(data: object) -> bool:
    try:
        build(Document(data, {}, "made.yaml"), None)
    except InputError:
        return True
    return False


CHANGED = [catalogue(name) for name in ("crossroads-s4", "pedestrian-behind-parked", "road-works")]


@settings(max_examples=150)
@given(changed(CHANGED))
def test_schema_and_reader_agree(data):
    valid = validator("scenario").is_valid(data)
    if shape_problems(ScenarioFile, Document(data, {}, "made.yaml")):
        assert not valid  # what has not the shape is refused by both
    elif not valid:
        assert refused(data), problems("scenario", data)  # a rule between keys, which both know


@settings(max_examples=60)
@given(changed([catalogue("weather"), catalogue("encounter")]))
def test_schema_and_reader_agree_on_fragments(data):
    document, valid = Document(data, {}, "made.yaml"), validator("fragment").is_valid(data)
    if shape_problems(FragmentFile, document):
        assert not valid
    elif not valid:
        declared = _Declarations()
        declared.take(document)
        assert declared.problems, problems("fragment", data)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("fragment",), 3.0),
        (("parameters", "precipitation", "low"), "none"),
        (("parameters", "precipitation", "low"), None),
        (("parameters", "precipitation", "unit"), "km/h"),
        (("parameters", "Rain"), {}),
        (("bounds", 0, "target"), None),
        (("derived", "friction", "value"), None),
    ],
)
def test_a_damaged_fragment_is_invalid_to_both(path, value):
    data = copy.deepcopy(catalogue("weather"))
    assert validator("fragment").is_valid(data)
    change(data, path, value)
    declared, document = _Declarations(), Document(data, {}, "made.yaml")
    declared.take(document)
    assert shape_problems(FragmentFile, document) or declared.problems
    assert not validator("fragment").is_valid(data)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (("participants", "bv", "start"), None),
        (("participants", "bv", "start", "leg"), "B"),
        (("roads",), {"radius": 15.0}),
        (("parameters", "bv_speed", "unit"), "km/h"),
        (("parameters", "BV"), {}),
        (("events", "bv_sets_off", "time"), 3.0),
        (("events", "bv_sets_off", "weather"), "later_"),
        (("events", "bv_sets_off", "speed"), None),
        (("events", "bv_sets_off", "lane_change"), {"lanes": 1}),
        (("events", "bv_sets_off", "lane_change"), {"lanes": 0, "time": 2.0}),
        (("events", "bv_sets_off", "when", 0), {}),
        (("events", "bv_sets_off", "when", 0), {"kind": "distance", "value": 3.0}),
        (("events", "bv_sets_off", "when", 0), {"kind": "time", "to": "ego"}),
        (("events", "bv_sets_off", "when", 0), {"kind": "after", "value": 3.0}),
        (("events", "bv_sets_off", "when", 0), {"kind": "began", "value": 3.0}),
        (("participants", "bv", "places"), {"a": {"start": {"point": "P3", "distance": 9.0}}}),
        (("participants", "bv", "place_by"), "side"),
    ],
)
def test_rules_between_keys_are_the_schema_s_too(path, value):
    data = copy.deepcopy(catalogue("crossroads-s4"))
    change(data, path, value)
    assert refused(data)
    assert not validator("scenario").is_valid(data)


@pytest.mark.parametrize(
    ("path", "value"),
    [
        (
            ("participants", "bv"),
            {
                "type": "car",
                "place_by": "side",
                "places": {"a": {"start": {"point": "P3", "distance": 9.0}}},
            },
        ),
        (("events", "bv_sets_off", "when", 0), {"kind": "began", "event": "other", "value": 3.0}),
    ],
)
def test_alternatives_are_the_schema_s_too(path, value):
    data = copy.deepcopy(catalogue("crossroads-s4"))
    change(data, path, value)
    assert problems("scenario", data) == []


def test_it_is_written_and_nobody_s_file_is_lost(tmp_path):
    path = tmp_path / "s.json"
    write_schema(path, "fragment")
    assert json.loads(path.read_text("utf-8")) == schema("fragment")
    write_schema(path)
    assert path.read_text("utf-8") == schema_text()
    path.write_text("{}")
    with refuses(StorageError):
        write_schema(path)
