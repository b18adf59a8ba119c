"""Run files: the options of a search as YAML, written and read."""

import json
import shlex
import sys
from dataclasses import fields
from pathlib import Path

import jsonschema
import pytest
import yaml
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st
from tests.approval import approve

import bridgegen as bg
from bridgegen.base.errors import InputError
from bridgegen.cli import main
from bridgegen.engine.options import SearchOptions, options_of
from bridgegen.simulation.choice import SimulatorChoice

pytestmark = pytest.mark.thorough

NAMES = st.text("abcdefgh_", min_size=1, max_size=8)
NUMBERS = st.floats(-1e9, 1e9, allow_nan=False, width=32).map(float)
TEXTS = st.text("abc: #'-{}[]%0123", min_size=1, max_size=12).filter(lambda t: not t.isspace())
VALUES = {
    "fixed": st.dictionaries(NAMES, NUMBERS | st.just("90 km/h"), max_size=3),
    "settings": st.dictionaries(NAMES, NUMBERS | st.booleans() | NAMES, max_size=3),
    "objective": st.none()
    | st.dictionaries(NAMES, NUMBERS, min_size=1, max_size=3)
    | st.dictionaries(NAMES, st.none(), min_size=1, max_size=3),
    "budget": st.none() | st.integers(1, 10**7),
    "screen": st.none()
    | st.sampled_from([SimulatorChoice("embedded"), SimulatorChoice("esmini", {"steps": 1})]),
    "screen_budget": st.none() | st.integers(1, 10**7),
    "screen_batch": st.none() | st.integers(1, 10**7),
    "ahead": st.none() | st.integers(1, 10_000),
    "seed": st.none() | st.integers(0, 2**32 - 1),
    "keep": st.integers(0, 1000),
    "time_limit": st.none() | st.floats(0.1, 100.0),
    "causes": st.booleans(),
    "rate": st.just(False),
    "exposure": st.none(),
    "repeats": st.none() | st.integers(1, 100),
    "axes": st.none() | st.lists(NAMES, min_size=1, max_size=3),
    "ideal": st.lists(NAMES, max_size=3),
    "metrics": st.lists(NAMES, max_size=3),
    "algorithm": NAMES,
    "triage": NAMES,
    "criteria": st.lists(
        st.builds(
            lambda name, more: {"id": name, "formula": "always(ego.v > 2 m/s)"} | more,
            NAMES.filter(lambda one: one[0] != "_"),
            st.fixed_dictionaries(
                {},
                optional={
                    "text": TEXTS.map(lambda text: f"x{text}".strip()),
                    "severity": st.sampled_from(["minor", "critical"]),
                    "tags": st.lists(st.sampled_from(["a", "b-1"]), min_size=1, max_size=2),
                },
            ),
        ),
        max_size=3,
        unique_by=lambda one: one["id"],
    ),
}
OTHERS = st.none() | NAMES | TEXTS.map(lambda text: f"x{text}".strip())
ODD = Path(__file__).parents[1] / "docs/examples/motorway-odd.yaml"
VALUES["odd"] = st.sampled_from([None, ODD])
OPTIONS = st.builds(
    SearchOptions,
    **{
        one.name: VALUES.get(one.name, OTHERS)
        for one in fields(SearchOptions)
        if one.name != "simulator"
    },
)


@pytest.fixture
def searched(monkeypatch):
    """Return a function that runs a command line, and returns the options of its search."""
    found = {}

    def keep(scenario, *, out, workers, callbacks, **given):
        found.update(given, scenario=scenario, out=out, workers=workers)
        raise InputError("not today")

    monkeypatch.setattr("bridgegen.jobs.search.run_search", keep)

    def run(*words):
        found.clear()
        monkeypatch.setattr(sys, "argv", ["bridgegen", "search", *map(str, words)])
        with pytest.raises(SystemExit):
            main()
        return dict(found)

    return run


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture])
@given(options=OPTIONS)
def test_options_are_what_their_file_says(options, searched, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    path = tmp_path / "run.yaml"
    path.unlink(missing_ok=True)
    words = [w for one in options_of(SearchOptions) for w in one.words(getattr(options, one.name))]
    called = searched("cut-in", *words, "--save", path)
    assert called
    schema = json.loads(_schema(monkeypatch))
    jsonschema.Draft7Validator(schema).validate(yaml.safe_load(path.read_text("utf-8")))
    filed = searched(path)
    for name in ("road_map", "distribution"):
        for one in (called, filed):
            one[name] = one[name] and one[name].resolve()
    assert filed == called


def _schema(monkeypatch, cache={}):  # noqa: B006
    if not cache:
        from bridgegen.cli.runs import run_file_schema

        cache["text"] = json.dumps(run_file_schema())
    return cache["text"]


def test_every_option_of_search_is_a_key():
    from bridgegen.cli.runs import run_file_schema

    keys = run_file_schema()["definitions"]["run"]["properties"]
    spelled = {one.spelling.removeprefix("--") for one in options_of(SearchOptions)}
    rest = {"scenario", "simulator-set", "workers", "out", "fail-if", "junit", "host", "port"}
    assert spelled | rest <= {*keys}
    assert "save" not in keys


def test_the_command_line_overrides_the_file(searched, tmp_path):
    path = tmp_path / "run.yaml"
    path.write_text(
        "run: {scenario: cut-in, budget: 40, seed: 3, fix: {a: 1, b: 2}, causes: false}", "utf-8"
    )
    found = searched(path, "--budget", 50, "--fix", "b=5")
    assert (found["scenario"], found["budget"], found["seed"]) == ("cut-in", 50, 3)
    assert (found["fixed"], found["causes"]) == ({"a": 1.0, "b": 5.0}, False)


def test_paths_are_relative_to_the_file(searched, tmp_path):
    path = tmp_path / "run.yaml"
    path.write_text(
        "run: {scenario: mine.yaml, map: town.xodr, ego: 'drv.py:Mine', out: runs/mine}", "utf-8"
    )
    found = searched(path)
    assert found["scenario"] == str(tmp_path / "mine.yaml")
    assert (found["road_map"], found["out"]) == (tmp_path / "town.xodr", tmp_path / "runs/mine")
    assert found["ego"] == f"{tmp_path}/drv.py:Mine"


@pytest.mark.parametrize(
    ("text", "messages"),
    [
        (
            "run: {scenario: cut-in, budgt: 3, seed: x, keep: 5000, causes: 1, fix: [a]}",
            [
                "unknown key 'budgt' in run; did you mean 'budget'? (run.yaml, line 1)",
                "run.seed must be a whole number, got 'x' (run.yaml, line 1)",
                "run.keep must be 0 to 1000, got 5000 (run.yaml, line 1)",
                "run.causes must be true or false, got 1 (run.yaml, line 1)",
                "run.fix must be a mapping, NAME: VALUE, got ['a'] (run.yaml, line 1)",
            ],
        ),
        ("run: {budget: 3}", ["run must have the key 'scenario' (run.yaml, line 1)"]),
        ("runs: []", ["runs must be a mapping, NAME: OPTIONS (run.yaml, line 1)"]),
        (
            "runs:\n  a: 3\n  ../b: {scenario: x}",
            [
                "runs.a must be a mapping (run.yaml, line 2)",
                "the name of a run must be a word of letters, digits, '-', '_' and '.', got "
                "'../b' (run.yaml, line 3)",
            ],
        ),
        (
            "run: {scenario: cut-in}\nrun_s: 3",
            ["unknown key 'run_s'; did you mean 'runs'? (run.yaml, line 2)"],
        ),
    ],
)
def test_all_mistakes_at_once(cli, tmp_path, monkeypatch, text, messages):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "run.yaml").write_text(text, "utf-8")
    code, _, err = cli("search", "run.yaml")
    assert code == 2
    assert err.splitlines() == [f"bridgegen: error: {one}" for one in messages]


def test_several_runs_are_resumed_and_the_same_to_the_bit(cli, tmp_path, monkeypatch, same_rows):
    monkeypatch.chdir(tmp_path)
    (tmp_path / "two.yaml").write_text(
        "runs:\n  first: {scenario: crossroads-s4, budget: 60, keep: 1, triage: short}\n"
        "  second: {scenario: crossroads-s4, budget: 60, keep: 1, triage: short, seed: 1}\n",
        "utf-8",
    )
    code, out, err = cli("search", "two.yaml")
    assert code == 0, err
    assert [line.split()[0] for line in out.splitlines()[-2:]] == ["first", "second"]
    alone = bg.run_search(
        "crossroads-s4", budget=60, keep=1, seed=1, triage="short", out=tmp_path / "alone"
    )
    assert same_rows(tmp_path / "runs/two/second", alone.folder)
    (tmp_path / "runs/two/second/report.html").unlink()
    code, out, err = cli("search", "two.yaml")
    assert code == 0, err
    approve(out, "finished")
    assert (tmp_path / "runs/two/second/report.html").is_file()
    text = (tmp_path / "two.yaml").read_text("utf-8").replace("seed: 1", "seed: 2")
    (tmp_path / "two.yaml").write_text(text, "utf-8")
    code, out, err = cli("search", "two.yaml")
    assert code == 2
    approve(err, "options")


def test_a_file_is_not_overwritten(cli, tmp_path):
    path = tmp_path / "run.yaml"
    path.write_text("mine", "utf-8")
    code, _, err = cli("search", "cut-in", "--save", path)
    assert (code, path.read_text("utf-8")) == (2, "mine")
    assert "exists already" in err


def test_the_schema_of_run_files(cli, tmp_path):
    code, out, _ = cli("validate", "--schema", "run")
    assert code == 0
    jsonschema.Draft7Validator.check_schema(json.loads(out))
    code, _, err = cli("validate", "--schema", "rn")
    assert code == 2
    approve(err, "rn", "run")
    assert shlex.split(cli("validate", "--schema", "run", "--out", tmp_path / "s.json")[1])
