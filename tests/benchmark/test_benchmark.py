"""A benchmark from start to finish, with planners that an installed package adds."""

import csv
import json
import re
import subprocess
import sys
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import InputError, Interrupted, StorageError, UnknownNameError
from bridgegen.jobs.benchmark.benchmark import benchmark_planners
from bridgegen.jobs.benchmark.failures import failures_of
from bridgegen.jobs.benchmark.plan import Cell
from bridgegen.jobs.compare.runs import RunsProgress
from bridgegen.jobs.search.run import Run
from bridgegen.pages.thumbnails import read_thumbnails
from bridgegen.scenario.participants import PARTICIPANTS

pytestmark = pytest.mark.thorough

GRID = {
    "scenarios": ["cut-in", "left-across-path"], "budget": 6, "seeds": 1, "keep": 1, "workers": 1,
}  # fmt: skip
DRIVERS = ["blind", "raises", "un-r157"]
TABLES = ("drivers.csv", "outcomes.csv", "modes.csv")


@pytest.fixture(scope="module")
def package(add_planners):
    add_planners(blind="BLIND", raises="RAISES", absent="ABSENT")


@pytest.fixture(scope="module")
def done(package, tmp_path_factory):
    return benchmark_planners(DRIVERS, **GRID, out=tmp_path_factory.mktemp("benchmarks") / "done")


def table(path: Path) -> list[dict[str, str]]:
    with path.open(newline="", encoding="utf-8") as file:
        return list(csv.DictReader(file))


def test_it_says_what_its_runs_say(done):
    """Modes, failures and careful drivers; outside its domain nobody is judged."""
    out = done.plan.out
    outcomes = {
        (row["driver"], row["scenario"], row["perception"]): row for row in table(out / TABLES[1])
    }
    blind = outcomes["blind", "cut-in", "perfect"]
    assert blind["state"] == "driven"
    assert int(blind["evaluations"]) == 6
    runs = [Run(out / "runs" / f"cut-in-blind-perfect-{seed}") for seed in range(1)]
    own = [failures_of(run, run.rows()) for run in runs]
    assert int(blind["failures"]) == sum(len(one.rows) for one in own) > 0
    assert float(blind["first_failure"]) == np.median([one.rows[0] + 1 for one in own])
    assert float(blind["severity"]) == max(max(one.severity) for one in own)
    assert 0.0 < float(blind["avoided_by_un-r157"]) <= 1.0  # the regulation says so of cut-ins
    assert int(blind["modes"]) >= int(blind["robust"]) >= 1
    assert outcomes["blind", "left-across-path", "perfect"]["state"] == "not applicable"
    why = outcomes["blind", "left-across-path", "sensed"]["why"]
    approve(why)
    assert ("un-r157", "cut-in", "sensed") not in outcomes  # it has no sensors
    assert outcomes["un-r157", "cut-in", "perfect"]["modes"] == "0"
    standing = {(row["driver"], row["perception"]): row for row in table(out / TABLES[0])}
    assert standing["blind", "perfect"]["not_applicable"] == "1"
    assert standing["blind", "perfect"]["modes"] == blind["modes"]


def test_a_planner_that_fails_in_every_row_is_a_cell(done):
    """The benchmark goes on; the reason is in the table and on the page."""
    rows = [row for row in table(done.plan.out / TABLES[1]) if row["driver"] == "raises"]
    driven = [row for row in rows if row["scenario"] == "cut-in"]
    assert {row["state"] for row in driven} == {"failed"}
    assert all("no idea" in row["why"] for row in driven)
    assert "no idea" in done.page.read_text("utf-8")


def test_each_failure_has_its_files_and_a_script(done):
    """The script needs no BridgeGen: what the planner saw is beside it."""
    out = done.plan.out
    modes = [row for row in table(out / TABLES[2]) if row["driver"] == "blind"]
    assert modes
    for row in modes:
        file, script = out / row["scenario_file"], out / row["script"]
        assert file.is_file()
        assert file.with_suffix(".xodr").is_file()
        text = script.read_text("utf-8")
        assert "bridgegen" not in text
        ran = subprocess.run(
            [sys.executable, script.name], cwd=script.parent, capture_output=True, text=True,
            check=True,
        )  # fmt: skip
        name = re.search(r"'(.*\.npz)'", text)
        with np.load(script.with_name(name[1])) as seen:
            assert int(ran.stdout) == len(seen["time"]) > 30
            assert np.allclose(np.diff(seen["time"]), np.diff(seen["time"])[0])
            assert seen["length"] == PARTICIPANTS["car"].body.length
        assert (out / row["playback"].partition("#")[0]).is_file()
    # The worst failure of the run plays in the table, beside the links to it.
    page = done.page.read_text("utf-8")
    (shown,) = read_thumbnails(out / "runs/cut-in-blind-perfect-0")
    assert shown.caption in {row["mode"] for row in modes}
    assert f"<title>{shown.caption}</title>" in page


def test_every_link_of_the_page_leads_to_a_file(done):
    text = done.page.read_text("utf-8")
    links = {one.partition("#")[0] for one in re.findall(r'href="([^"]+)"', text)} - {"", "data:,"}
    assert {"drivers.csv", "outcomes.csv", "modes.csv", "runs/"} <= links
    assert all((done.plan.out / one).exists() for one in links)
    assert not re.search(r'(src|href)="(https?:)?//', text)


def test_interrupted_and_resumed_it_is_the_same(done, tmp_path, monkeypatch):
    """Nor do results depend on how many runs there are at a time."""
    out = tmp_path / "other"
    ended = []

    def interrupt(self, name: str, failure: str | None) -> None:
        ended.append(name)
        if len(ended) == 1:
            raise KeyboardInterrupt

    drive = ["blind", "un-r157"]
    with monkeypatch.context() as patched:
        patched.setattr(RunsProgress, "ended", interrupt)
        with refuses(Interrupted, "--ego"):
            benchmark_planners(drive, **GRID, out=out)
    assert not (out / "benchmark.html").exists()
    benchmark_planners(drive, **{**GRID, "workers": 2}, out=out)
    for name in TABLES:
        of_all = [row for row in table(done.plan.out / name) if row["driver"] in drive]
        assert table(out / name) == of_all != []


def test_a_later_call_adds_runs_and_makes_none_again(done, monkeypatch):
    """Of its seeds, the first is triaged, and the second if it fails in another way."""
    out = done.plan.out
    before = {path: path.stat().st_mtime_ns for path in out.glob("runs/*/run.sqlite")}
    searched = []
    monkeypatch.setattr(RunsProgress, "batch", lambda self, name, _: searched.append(name))
    drivers, grid = ["un-r157", "route-follower"], {**GRID, "scenarios": ["cut-in"], "seeds": 2}
    more = benchmark_planners(drivers, **grid, out=out)
    new = {"un-r157-perfect-1", "route-follower-perfect-0", "route-follower-perfect-1"}
    assert {*searched} == {f"cut-in-{name}" for name in new}
    assert all(path.stat().st_mtime_ns == then for path, then in before.items())
    assert [one.name for one in more.plan.entrants] == drivers
    runs = [Run(out / "runs" / f"cut-in-route-follower-perfect-{seed}") for seed in range(2)]
    ways = [set(failures_of(run, run.rows()).ways) for run in runs]
    assert [run.report.exists() for run in runs] == [True, bool(ways[1] - ways[0])]
    with refuses(StorageError, "13"):
        benchmark_planners(["blind"], **{**GRID, "budget": 13}, out=out)


def test_a_driver_that_cannot_be_made_is_said_before_it_starts(package, tmp_path):
    (tmp_path / "bad.py").write_text("class Bad:\n    def reset(self, n, scene): ...\n")
    spec = f"{tmp_path / 'bad.py'}:Bad"
    found = benchmark_planners(
        [spec, "un-r157"], scenarios=["cut-in"], budget=3, seeds=1, workers=1,
        out=tmp_path / "out",
    )  # fmt: skip
    assert {one.state for one in found.outcomes if one.driver == spec} == {"failed"}
    approve(found.plan.entrants[0].problem, "methods")
    assert [cell for cell in found.plan.cells if cell.driver == spec] == []
    assert isinstance(found.plan.cells[0], Cell)


@pytest.mark.parametrize(
    ("changes", "error", "message"),
    [
        ({"drivers": ["blnd"]}, UnknownNameError, "'blnd'; did you mean 'blind'"),
        ({"drivers": ["absent"]}, InputError, "pip install 'no-such-planner>=1.0,<2'"),
        ({"drivers": ["carla-agent"]}, InputError, "drives in carla alone"),
        ({"drivers": ["blind", "blind"]}, InputError, "must have different names"),
        ({"scenarios": ["cutin"]}, InputError, "did you mean 'cut-in'"),
        ({"scenarios": ["cut-in", "cut-in"]}, InputError, "cut-in must be named once"),
        ({"budget": 0}, InputError, "1 <= budget <= 10000000 must hold, got 0"),
        ({"seeds": 0}, InputError, "1 <= seeds <= 1000 must hold, got 0"),
        ({"workers": 0}, InputError, "workers must be a number of processes, 1 to"),
        ({"algorithm": "psoo"}, UnknownNameError, "did you mean 'pso'"),
    ],
)
def test_bad_arguments_are_one_error(package, tmp_path, changes, error, message):
    given = {"drivers": ["blind"], **GRID, "out": tmp_path / "out", **changes}
    with pytest.raises(error, match=re.escape(message)):
        benchmark_planners(**given)
    assert not (tmp_path / "out").exists()


def test_without_planners_ours_take_part(monkeypatch, tmp_path):
    from bridgegen.jobs.benchmark.plan import entrants, ours

    found = [one.name for one in entrants(None, ours())]
    assert found[-len(ours()) :] == list(ours())


def test_the_command_prints_the_table(package, cli, tmp_path):
    code, out, err = cli(
        "benchmark", "planners", "--ego", "un-r157", "--scenario", "cut-in", "--budget", 3,
        "--seeds", 1, "--workers", 1, "--out", tmp_path / "out",
    )  # fmt: skip
    assert code == 0
    assert re.search(r"un-r157 +perfect +0 +0 +never", out)
    assert "1 runs of 3 evaluations: about" in err
    assert json.loads((tmp_path / "out" / "benchmark.json").read_text())["budget"] == 3


def test_a_scenario_that_did_not_happen_is_not_without_failures(tmp_path):
    van = Path(__file__).parents[1] / "campaign" / "double-parked.yaml"
    made = benchmark_planners(
        ["reference"], scenarios=[van], budget=6, seeds=1, triage="none", workers=1,
        out=tmp_path / "out",
    )  # fmt: skip
    why = "Not judged: the scenario did not happen: stuck in 5 of 6"
    assert why in made.page.read_text("utf-8")
    assert table(made.plan.out / TABLES[1])[0]["why"].startswith(why)
