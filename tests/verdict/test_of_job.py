"""Criteria of a preventability map: per driver, exit status, JUnit XML."""

from xml.etree import ElementTree

import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError
from bridgegen.cli import main
from bridgegen.cli.verdict.of_job import JobCriteria
from bridgegen.jobs.preventability.options import FIGURES
from bridgegen.jobs.preventability.preventability import map_preventability

GRID = ["gap=36:46:2", "lateral_speed=1.7:1.8:2"]
FIX = {"relative_speed": "40 km/h"}
"""At 60 km/h; un-r157 avoids all four, a driver that does not brake none (see test_map)."""


@pytest.fixture(scope="module")
def found(tmp_path_factory):
    out = tmp_path_factory.mktemp("maps") / "map"
    drivers = ["route-follower", "un-r157"]
    return map_preventability("r157/cut-in", drivers, grid=GRID, fixed=FIX, out=out)


def test_each_driver_is_judged_by_itself(found):
    outcomes = JobCriteria.read(["preventable_share >= 0.5", "no_result > 0"], None, FIGURES).judge(
        found
    )
    assert [(one.test, one.verdict) for one in outcomes] == [
        ("route-follower: the map has results", "passed"),
        ("route-follower: not preventable_share >= 0.5", "failed"),
        ("route-follower: not no_result > 0", "passed"),
        ("un-r157: the map has results", "passed"),
        ("un-r157: not preventable_share >= 0.5", "passed"),
        ("un-r157: not no_result > 0", "passed"),
    ]


def test_the_figures_are_those_of_the_map(found):
    first, second = found.judged()
    assert first.figures == {
        "avoided": 0, "preventable": 4, "unpreventable": 0, "not_applicable": 0, "no_result": 0,
        "avoided_share": 0.0, "preventable_share": 1.0, "unpreventable_share": 0.0,
    }  # fmt: skip
    assert second.figures.keys() == FIGURES.keys()


def test_a_map_without_results_does_not_pass(tmp_path):
    """The other would drive slower than 10 km/h in each cell, so none applies."""
    nothing = map_preventability(
        "r157/cut-in", "fsm", grid=["ego_speed=20 km/h:30 km/h:2"],
        fixed={"relative_speed": "40 km/h"}, out=tmp_path / "map",
    )  # fmt: skip
    outcomes = JobCriteria.read(["preventable > 0"], None, FIGURES).judge(nothing)
    assert [one.verdict for one in outcomes] == ["unknown", "unknown"]


def test_no_criteria_have_no_outcomes_and_wrong_ones_are_refused(found):
    assert JobCriteria.read([], None, FIGURES).judge(found) == ()
    with refuses(InputError, "preventable"):
        JobCriteria.read(["preventible > 0"], None, FIGURES)


def test_the_command_ends_with_3_and_writes_junit(tmp_path, monkeypatch, capsys):
    junit = tmp_path / "junit.xml"
    words = ["bridgegen", "preventability", "r157/cut-in", "--ego", "route-follower,un-r157"]
    words += ["--grid", GRID[0], "--grid", GRID[1], "--fix", "relative_speed=40 km/h"]
    words += ["--fail-if", "preventable > 0", "--junit", str(junit), "--out", str(tmp_path / "m")]
    monkeypatch.setattr("sys.argv", words)
    with pytest.raises(SystemExit) as end:
        main()
    assert end.value.code == 3
    said = capsys.readouterr().err
    approve(said, "route-follower")
    root = ElementTree.parse(junit).getroot()
    assert (root.get("tests"), root.get("failures"), root.get("errors")) == ("4", "1", "0")
    facts = {one.get("name"): one.get("value") for one in root[0].iter("property")}
    assert facts["preventable"] == "4"
    assert facts["axis gap"] == "36 to 46 m, 2 values"
    assert "--grid gap=36:46:2" in facts["command"]
