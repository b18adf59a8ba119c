"""A plan's command line is the plan; and what its runs are made with."""

import json
import shlex
import sys

import pytest
from tests.approval import refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, StorageError
from bridgegen.cli import main
from bridgegen.engine.options import CommonOptions
from bridgegen.jobs.compare.plan import Cell, begin, make_plan


@pytest.fixture
def plans(monkeypatch):
    """The plans that comparisons begin with; none is carried out."""
    found = []

    def keep(plan):
        found.append(plan)
        raise InputError("not today")

    monkeypatch.setattr("bridgegen.jobs.compare.comparison.begin", keep)
    return found


@pytest.mark.parametrize(
    "options",
    [
        {},
        {"algorithms": ["random", "pso", "nsga2"], "baseline": "pso", "seeds": 3, "budget": 77},
        {"settings": {"pso": {"w": 0.5, "population": 20, "mutate_best": False}}, "apart": 0.25},
        {"objective": {"d_min": 0.25, "ttc": 1.0}, "scale": "standardised", "metrics": ["pet"]},
        {"objective": {"d_min": None, "ttc": None}, "weights": "entropy", "cause": "planning"},
        {"ego": "my driver.py:It's", "ideal": ["control", "perception"], "time_limit": 2.5},
        {"axes": ["static", "weather"], "fixed": {"fog_density": 1e-3}, "causes": True},
        {"objectives": "many", "road_map": "town.xodr", "junction": "965", "adversary": "bv"},
    ],
)
def test_its_command_is_the_plan(plans, monkeypatch, tmp_path, options):
    with pytest.raises(InputError, match="not today"):
        bg.compare(["crossroads-s4", "cut-in"], out=tmp_path / "c", **options)
    monkeypatch.setattr(sys, "argv", shlex.split(plans[0].command()))
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 2
    assert len(plans) == 2
    assert plans[0] == plans[1]


def plan(budget=9, out=None, **options):
    given = {"settings": {}, "seeds": 2, "baseline": None, "apart": 0.1}
    names = ["crossroads-s4", "crossroads-s1"], ["pso", "nsga2"]
    return make_plan(*names, **given, budget=budget, out=out, options=CommonOptions(**options))


def test_the_grid_in_the_order_of_running_and_of_telling():
    names = ["pso", "nsga2"]
    scenarios = ["crossroads-s4", "crossroads-s1"]
    made = plan()
    assert list(made.cells) == [Cell(s, a, k) for k in range(2) for s in scenarios for a in names]
    assert list(made.cells_in_order) == [
        Cell(s, a, k) for s in scenarios for a in names for k in range(2)
    ]
    assert str(made.out) == "comparisons/crossroads-s4-crossroads-s1"
    assert made.folder(made.cells[0]).name == "crossroads-s4-pso-0"
    assert made.baseline == "pso"


def test_weights_are_for_those_who_search_a_sum():
    one, many = Cell("crossroads-s4", "pso", 0), Cell("crossroads-s4", "nsga2", 0)
    made = plan(objective={"d_min": 0.5, "v_d": 1.0}, weights="fixed", objectives=None)
    assert made.options_of(one).objective == {"d_min": 0.5, "v_d": 1.0}
    assert made.options_of(one).weights == "fixed"
    assert made.options_of(many).objective == {"d_min": None, "v_d": None}
    assert made.options_of(many).weights is None
    asked = plan(objective={"d_min": 0.5, "v_d": 1.0}, weights="fixed", objectives="many")
    assert asked.options_of(many).weights == "fixed"  # and so it is refused


def test_a_mistake_that_made_no_run_binds_nobody(tmp_path):
    out = tmp_path / "c"
    begin(plan(out=out, ego="refrence"))
    made = plan(out=out, ego="reference")
    begin(made)
    folder = made.folder(made.cells[0])
    folder.mkdir()
    (folder / "run.sqlite").touch()
    begin(made)
    with refuses(StorageError):
        begin(plan(out=out, ego="reference", others="attentive"))
    without = json.loads((out / "compare.json").read_text("utf-8"))
    del without["others"]  # as comparisons were recorded that could not choose them
    (out / "compare.json").write_text(json.dumps(without), "utf-8")
    with refuses(StorageError):
        begin(plan(out=out, ego="reference", others="attentive"))
    begin(made)
    (out / "compare.json").write_text("[]", "utf-8")
    with refuses(StorageError):
        begin(made)
    (out / "compare.json").write_text('{"budget": 9, "ego": "reference"}', "utf-8")
    with refuses(StorageError, "10"):
        begin(plan(budget=10, out=out, ego=None))
