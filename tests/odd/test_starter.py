"""A file to start from: valid as it is, and nobody's file is overwritten."""

import json

import pytest
from tests.approval import approve, refuses
from tests.covering import covering

from bridgegen.base.errors import InputError, StorageError, UnknownNameError
from bridgegen.scenario.language.json_schema import schema
from bridgegen.scenario.language.reader import load
from bridgegen.scenario.language.starter import start_scenario


def test_it_is_valid_and_says_what_each_section_is(tmp_path):
    path = start_scenario("my-own", folder=tmp_path)
    assert path == tmp_path / "my-own.yaml"
    assert load(path).name == "my-own"
    text = path.read_text("utf-8")
    assert text.count("#") > 30
    assert "NAME" not in text


@pytest.mark.parametrize("name", covering())
def test_a_copy_differs_in_its_name_only(tmp_path, name):
    copy, original = load(start_scenario("mine", like=name, folder=tmp_path)), load(name)
    assert copy.name == "mine"
    assert copy.parameters == original.parameters
    assert copy.story == original.story
    assert copy.roads == original.roads


def test_mistakes(tmp_path):
    start_scenario("mine", folder=tmp_path)
    with refuses(StorageError):
        start_scenario("mine", folder=tmp_path)
    with refuses(UnknownNameError, "cut-in"):
        start_scenario("other", like="cut-inn", folder=tmp_path)
    with refuses(InputError):
        start_scenario("../evil", folder=tmp_path)
    with refuses(InputError, "BridgeGen"):
        start_scenario("cut-in", folder=tmp_path)
    with refuses(StorageError):
        start_scenario("mine", folder=tmp_path / "nowhere")
    (tmp_path / "taken").mkdir()
    (tmp_path / "taken" / "bridgegen.schema.json").write_text("{}")
    with refuses(StorageError):
        start_scenario("mine", folder=tmp_path / "taken")
    assert [path.name for path in (tmp_path / "taken").iterdir()] == ["bridgegen.schema.json"]
    assert {path.name for path in tmp_path.glob("*.*")} == {"mine.yaml", "bridgegen.schema.json"}


def test_editors_find_its_schema(tmp_path):
    for name in ("mine", "other"):  # the second replaces the first's
        first, *_ = start_scenario(name, folder=tmp_path).read_text("utf-8").splitlines()
    key, _, path = first.rpartition("=")
    approve(key, "yaml-language-server")
    assert json.loads((tmp_path / path).read_text("utf-8")) == schema()
