"""An option of a run is declared once; keywords, command lines and texts follow from it."""

import inspect
import shlex
import sys
from dataclasses import fields, replace

import numpy as np
import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError
from bridgegen.cli import main, runs
from bridgegen.cli.jobs import COMPARE, command_of
from bridgegen.engine.options import CommonOptions, PipelineOptions, SearchOptions, options_of
from bridgegen.engine.options.forms import read_names, read_numbers, read_settings, read_terms
from bridgegen.jobs.suite.suite import evaluate_suite
from bridgegen.simulation.choice import SimulatorChoice

DECLARED = {one.name: one for one in options_of(SearchOptions)}


def line(options):
    return [
        word for one in options_of(type(options)) for word in one.words(getattr(options, one.name))
    ]


@pytest.mark.parametrize("kind", [PipelineOptions, CommonOptions, SearchOptions])
def test_every_field_is_an_option_and_says_what_it_means(kind):
    assert {one.name for one in options_of(kind)} == {one.name for one in fields(kind)}
    for one in options_of(kind):
        assert one.help.endswith("."), one.name
        assert one.spelling.startswith("--"), one.name


def test_keywords_are_those_of_the_options():
    search = inspect.signature(bg.run_search).parameters
    assert {one.name for one in fields(SearchOptions)} < {*search}
    assert next(iter(search)) == "scenario"
    assert search["causes"].default is True
    compare = inspect.signature(bg.compare).parameters
    assert {one.name for one in fields(CommonOptions)} < {*compare}
    assert "keep" not in compare
    assert compare["causes"].default is False
    for function, parameters in ((bg.run_search, search), (bg.compare, compare)):
        described = inspect.getdoc(function).partition("Args:")[2].partition("Returns:")[0]
        assert [text.split(":")[0].strip() for text in described.strip().splitlines()] == [
            *parameters
        ]


@pytest.mark.parametrize(
    ("function", "given", "named", "said"),
    [
        (bg.run_search, ("cut-in",), {"bugdet": 10}, "bugdet"),
        (bg.run_search, (), {}, "run_search"),
        (bg.run_search, ("cut-in", 3), {}, "run_search"),
        (bg.run_search, (5,), {}, "5"),
        (bg.compare, ("cut-in",), {"sedes": 3}, "sedes"),
        (bg.compare, ("cut-in",), {"seeds": "x"}, "x"),
        (evaluate_suite, ("cut-in",), {"samples": "x"}, "x"),
        (bg.resume, ("runs/a",), {"eog": "x"}, "eog"),
        (bg.confirm, ("runs/a",), {}, "confirm"),
        (bg.estimate_risk, ("cut-in",), {"evnet": "x"}, "evnet"),
        (bg.map_preventability, ("cut-in",), {"gird": 3}, "gird"),
        (bg.simulate_file, ("a.xosc",), {"eog": "x"}, "eog"),
    ],
)
def test_a_wrong_argument_is_an_error_of_input(function, given, named, said):
    with refuses(InputError, said):
        function(*given, **named)


@pytest.mark.parametrize(
    ("named", "said"),
    [
        ({"budget": "many"}, "many"),
        ({"seed": 1.5}, "seed"),
        ({"keep": None}, "keep"),
        ({"time_limit": "1"}, "time_limit"),
        ({"causes": "no"}, "causes"),
        ({"ego": 5}, "ego"),
        ({"axes": 3}, "axes"),
        ({"metrics": [3]}, "metrics"),
        ({"fixed": "fog_density"}, "fog_density"),
        ({"fixed": [1]}, "fixed"),
        ({"objective": {"d_min": "x"}}, "objective"),
        ({"objective": "d_min=x"}, "d_min=x"),
        ({"objective": "harmm"}, "harmm"),
        ({"objective": "papre"}, "papre"),
        ({"criteria": 3}, "criteria"),
        ({"simulator": "esmni"}, "esmni"),
    ],
)
def test_a_wrong_value_is_an_error_of_input(named, said, tmp_path):
    with refuses(InputError, said):
        bg.run_search("cut-in", **named, out=tmp_path / "run")
    assert not (tmp_path / "run").exists()


def test_all_wrong_values_are_named_at_once():
    with pytest.raises(InputError) as error:
        bg.run_search("cut-in", budget="x", seed="y")
    assert [one.split()[0] for one in error.value.problems] == ["budget", "seed"]


def test_texts_are_read_as_on_the_command_line():
    given = SearchOptions(
        axes="participants,weather", fixed="fog_density=80", objective="d_min=0.5,ttc",
        criteria="R-1: min(gap to any) > 1 m", settings="w=0.5", simulator="esmini", budget=7,
    )  # fmt: skip
    assert given == SearchOptions(
        axes=("participants", "weather"), fixed={"fog_density": 80.0},
        objective={"d_min": 0.5, "ttc": None}, criteria=["R-1: min(gap to any) > 1 m"],
        settings={"w": 0.5}, simulator=SimulatorChoice("esmini"), budget=np.int64(7),
    )  # fmt: skip
    assert SearchOptions(objective=["d_min", "ttc"]).objective == {"d_min": None, "ttc": None}
    assert SearchOptions(objective="harm").objective == {"harm": None}


def test_the_command_line_has_them_all():
    search = inspect.signature(runs.search).parameters
    assert {*DECLARED} - {*search} == set()
    compare = inspect.signature(command_of(COMPARE)).parameters
    assert {one.name for one in options_of(CommonOptions)} - {*compare} == set()


@pytest.mark.parametrize(
    "options",
    [
        SearchOptions(),
        SearchOptions(
            algorithm="random", budget=7, seed=3, keep=0, settings={"w": 0.5, "on": True, "as": "x"}
        ),
        SearchOptions(ego="my driver.py:It's", ideal=["control", "perception"], time_limit=2.5),
        SearchOptions(axes=["static", "weather"], fixed={"fog_density": 1e-3}, causes=False),
        SearchOptions(objective={"d_min": 0.25, "ttc": 1.0}, scale="standardised", metrics=["pet"]),
        SearchOptions(objective={"d_min": None, "ttc": None}, weights="entropy", cause="planning"),
        SearchOptions(objectives="many", road_map="town.xodr", junction="965", adversary="bv"),
        SearchOptions(others="scripted", count="any", distribution="d.xosc"),
        SearchOptions(simulator=SimulatorChoice("esmini", {"steps": 4})),
        SearchOptions(
            simulator=SimulatorChoice("esmini"),
            screen=SimulatorChoice("embedded"),
            screen_budget=100,
            screen_batch=4,
        ),
        SearchOptions(screen=SimulatorChoice("esmini", {"steps": 2})),
        SearchOptions(algorithm="surrogate", ahead=8),
    ],
)
def test_options_are_what_their_command_line_says(options, monkeypatch):
    found = {}

    def keep(scenario, *, out, workers, callbacks, **given):
        found.update(given)
        raise InputError("not today")

    monkeypatch.setattr("bridgegen.jobs.search.run_search", keep)
    words = shlex.split(shlex.join(["bridgegen", "search", "crossroads-s4", *line(options)]))
    monkeypatch.setattr(sys, "argv", words)
    with pytest.raises(SystemExit):
        main()
    paths = {name: found[name] and str(found[name]) for name in ("road_map", "distribution")}
    assert SearchOptions(**found | paths) == options


def test_options_keep_what_they_are_given_as_values():
    names, numbers = ["perception"], {"fog_density": 80.0}
    options = SearchOptions(ideal=names, fixed=numbers)
    names.append("control")
    numbers["rain"] = 1.0
    assert (options.ideal, options.fixed) == (("perception",), {"fog_density": 80.0})


def test_a_part_of_the_options_and_back():
    options = SearchOptions(ego="reference", causes=True, budget=5)
    part = PipelineOptions.of(options, ego=None)
    assert part == PipelineOptions(causes=True)
    assert SearchOptions.of(part, budget=5) == replace(options, ego=None)


def test_texts_of_the_command_line():
    assert read_names(" a, b,") == ["a", "b"]
    assert read_names(None) == []
    assert read_settings(["a=1", "b=true", "c=x", "d=[1]"], "--set") == {
        "a": 1, "b": True, "c": "x", "d": "[1]"
    }  # fmt: skip
    assert read_terms("d_min=0.5,ttc", "--objective") == {"d_min": 0.5, "ttc": None}
    with pytest.raises(InputError) as refused:
        read_numbers(["a", "b=x", "c=1"], "--fix")
    assert refused.value.problems == (
        "--fix must read NAME=NUMBER, got 'a'",
        "--fix must read NAME=NUMBER, got 'b=x'",
    )
