"""Preventability maps in a suite: which scenarios, which drivers, resumed, on the page."""

import json
import re
from pathlib import Path

import numpy as np
import pytest

from bridgegen.cli import main
from bridgegen.jobs.preventability import preventability
from bridgegen.jobs.preventability.classes import CellClass
from bridgegen.jobs.preventability.grid import DEFAULT_GRIDS, Grid, coarse_axes
from bridgegen.jobs.suite import maps as module
from bridgegen.jobs.suite.maps import map_suite
from bridgegen.jobs.suite.page import write_suite_page
from bridgegen.jobs.suite.suite import evaluate_suite
from bridgegen.scenario import packs
from bridgegen.scenario.language.reader import load

PACK = Path(packs.__path__[0]) / "r157"
CELLS = 200


@pytest.fixture(scope="module")
def mapped(tmp_path_factory):
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(module, "MOST_CELLS", CELLS)
        out = tmp_path_factory.mktemp("suites") / "out"
        files = [PACK / "deceleration.yaml", PACK / "following.yaml"]
        suite = evaluate_suite(files, egos=["route-follower"], samples=2, out=out, workers=1)
        return suite, map_suite(suite)


@pytest.mark.parametrize("name", ["cut-in", "cut-out", "deceleration"])
def test_a_coarse_grid_has_the_ends_of_the_default(name):
    scenario = load(f"r157/{name}")
    axes = coarse_axes(scenario.name, scenario.space(), 20_000)
    assert 5_000 < Grid.of(scenario.space(), axes).cells <= 20_000
    for axis, default in DEFAULT_GRIDS[scenario.name].items():
        assert (axes[axis].low, axes[axis].high) == (default.low, default.high)
    assert coarse_axes("r157-cut-in", load("r157/deceleration").space(), 20_000) is None


def test_scenarios_with_a_grid_are_mapped_beside_the_regulation_s_models(mapped):
    suite, (one,) = mapped  # r157/following has no grid
    assert one.scenario.name == "r157-deceleration"
    assert one.drivers == ("route-follower", "un-r157", "fsm", "computed:rss", "reference")
    assert one.grid.cells <= CELLS
    assert one.page.is_relative_to(suite.folder)
    codes = one.classes["route-follower"]  # it never looks ahead
    assert set(np.unique(codes).tolist()) <= {CellClass.PREVENTABLE, CellClass.UNPREVENTABLE}


def test_a_finished_map_is_read_and_not_made_again(mapped, monkeypatch):
    suite, (before,) = mapped
    monkeypatch.setattr(module, "MOST_CELLS", CELLS)
    monkeypatch.setattr(preventability._Run, "chunk", None)  # would fail if it were called
    (again,) = map_suite(suite)
    np.testing.assert_array_equal(again.outcomes, before.outcomes)


def test_another_driver_s_map_lies_elsewhere(mapped):
    _, (one,) = mapped
    other = module._folder(one.scenario, ["fsm"])
    assert other != one.folder.name
    assert re.fullmatch(r"r157-deceleration-[0-9a-f]{8}", other)


def test_the_page_shows_the_maps(mapped):
    suite, found = mapped
    page = write_suite_page(suite, suite.jobs, maps=found).read_text("utf-8")
    data = json.loads(re.search(r'id="data">(.*?)</script>', page, re.DOTALL)[1])
    (one,) = data["suite"]["maps"]
    assert (suite.folder / one["page"]).is_file()
    assert [driver["name"] for driver in one["drivers"]] == list(found[0].drivers)
    assert one["drivers"][0]["counts"][CellClass.AVOIDED] == 0
    pictures = [uri for driver in one["drivers"] for uri in driver["pictures"]]
    assert len(pictures) == 5 * len(one["columns"])
    assert all(uri.startswith("data:image/png;base64,") for uri in pictures)


def test_the_command(tmp_path, monkeypatch, capsys):
    monkeypatch.setattr(module, "MOST_CELLS", 60)
    words = ["bridgegen", "suite", str(PACK / "deceleration.yaml"), "--samples", "1"]
    words.append("--preventability")
    words += ["--ego", "reference", "--fail-if", "failed_clauses > 0", "--json"]
    monkeypatch.setattr("sys.argv", [*words, "--out", str(tmp_path / "out")])
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 0
    printed = json.loads(capsys.readouterr().out)
    assert printed["maps"][0]["scenario"] == "r157-deceleration"
    assert printed["clauses"][0]["verdict"] == "passed"
    assert printed["clauses"][0]["id"] == "R157-5.2.5.1"
