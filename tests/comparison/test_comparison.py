"""A comparison from start to finish: what it says is what its runs say, however they were made."""

import math
import os
import re
import shlex
import signal
import subprocess
import sys
import time
from html.parser import HTMLParser
from pathlib import Path

import numpy as np
import pytest
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import InputError, Interrupted, StorageError, UnknownNameError
from bridgegen.cli import main
from bridgegen.jobs.compare.page import FIGURE_NAMES
from bridgegen.jobs.compare.plan import Cell
from bridgegen.jobs.compare.record import points
from bridgegen.jobs.compare.runs import RunsProgress
from bridgegen.jobs.frame import JobCallbacks
from bridgegen.jobs.search.coverage import coverage_of
from bridgegen.results.store import Store
from bridgegen.search.algorithms.registry import ALGORITHMS
from bridgegen.search.algorithms.sampling import Random

GRID = {"algorithms": ["random", "pso"], "seeds": 2, "budget": 120, "baseline": "random",
        "objective": {"paper": None}}  # fmt: skip
SETTLED = (
    "runs.csv", "summary.csv",
    *(f"figures/crossroads-s4-{name}.svg" for name in FIGURE_NAMES),
)  # fmt: skip


@pytest.fixture(scope="module")
def done(tmp_path_factory) -> "bg.Comparison":
    out = tmp_path_factory.mktemp("comparisons") / "s4"
    return bg.compare("crossroads-s4", **GRID, workers=1, out=out)


def the_same(one: Path, other: Path) -> bool:
    return all((one / name).read_bytes() == (other / name).read_bytes() for name in SETTLED)


def finished(out: Path) -> int:
    """How many runs of a comparison have ended; it may be running."""
    count = 0
    for folder in (out / "runs").iterdir() if (out / "runs").is_dir() else ():
        try:
            with Store.open(folder) as store:
                count += store.finished is not None
        except StorageError:
            continue
    return count


def rows_of(folder: Path):
    with Store.open(folder) as store:
        return store.read()


def test_every_number_is_its_run_s(done):
    frame = done.frame()
    assert len(frame) == 4 * (len(done.measures) - 3)  # three are of time
    for cell in done.plan.cells:
        folder = done.plan.folder(cell)
        rows = rows_of(folder)
        of_it = (frame["algorithm"] == cell.algorithm) & (frame["seed"] == cell.seed)
        told = frame[of_it].set_index("measure")
        hits = np.flatnonzero(rows.critical) + 1
        value = told["value"]
        assert value["r_critic"] == rows.critical.mean()
        for k in (1, 6, 10, 50):
            assert value[f"to_{k}"] == (hits[k - 1] if k <= len(hits) else math.inf)
        ways = coverage_of(folder, strength=2)[1].ways
        assert value[["critical_bins", "critical_pairs"]].tolist() == [w.critical for w in ways]
        assert 1 <= value["distinct"] <= len(hits)
        told_of = rows.findings.take(rows.critical)
        keys = zip(told_of.conflict_type, told_of.responsible, told_of.rule, told_of.partner,
                   strict=True)  # fmt: skip
        keys = list(keys)
        assert value["modes"] == len({key for key in keys if key[0]})
        second = [k for k in range(len(keys)) if len({key for key in keys[: k + 1] if key[0]}) == 2]
        assert value["to_2_modes"] == (hits[second[0]] if second else math.inf)
        assert value["distinct"] < 5 or hits[4] <= value["to_5_distinct"] <= hits[-1]
        at = points(120)
        found = done.records[cell].distinct_found
        assert found[-1] == value["distinct"]
        assert (found == 0)[at < hits[0]].all()
        assert (found > 0)[at >= hits[0]].all()
        assert value["distinct"] < 5 or (found >= 5)[at >= value["to_5_distinct"]].all()
        assert set(told["folder"]) == {f"runs/{folder.name}"}
        assert set(told["evaluations"]) == {120}


def test_the_summary_is_of_the_runs(done):
    frame, summary = done.frame(), done.summary().set_index(["algorithm", "measure"])
    for (name, measure), one in frame.groupby(["algorithm", "measure"]):
        line = summary.loc[(name, measure)]
        finite = one["value"][np.isfinite(one["value"])]
        assert line["never"] == np.isinf(one["value"]).sum()
        if len(finite) == 2:
            assert line["median"] == pytest.approx(np.median(finite))
    # Two seeds each: the surest that two samples of two can be, and pso's are all larger.
    assert summary.loc[("pso", "r_critic")]["a12"] == 1.0
    assert summary.loc[("pso", "r_critic")]["p"] == pytest.approx(1 / 3)
    assert math.isnan(summary.loc[("random", "r_critic")]["p"])
    assert done.line("crossroads-s4", "pso", "t_critic").quartiles.median == 1.0


def test_times_are_apart(done):
    times = done.times()
    assert set(times["measure"]) == {"seconds", "seconds_to_6", "t_critic_seconds"}
    seconds = times[times["measure"] == "seconds"]["value"]
    assert (seconds > 0).all()
    assert "seconds" not in set(done.frame()["measure"])


def test_a_row_s_command_makes_the_same_run(done, tmp_path, monkeypatch):
    frame = done.frame()
    row = frame[(frame["algorithm"] == "pso") & (frame["seed"] == 1)].iloc[0]
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(sys, "argv", shlex.split(row["command"]))
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    again, first = rows_of(Path("replay/crossroads-s4-pso-1")), rows_of(done.folder / row["folder"])
    for name in ("U", "X", "metrics", "F", "critical"):
        assert np.array_equal(getattr(again, name), getattr(first, name), equal_nan=True)


class Page(HTMLParser):
    """The links, pictures and words of a page."""

    def __init__(self) -> None:
        super().__init__()
        self.links, self.ids, self.open, self.text, self.charts = [], set(), [], "", 0

    def handle_starttag(self, tag, attributes):
        given = dict(attributes)
        self.links += [given[name] for name in ("href", "src", "srcset") if name in given]
        self.charts += tag == "svg"
        self.ids |= {given["id"]} if "id" in given else set()
        if tag not in ("meta", "link", "img", "source", "br"):
            self.open.append(tag)

    def handle_endtag(self, tag):
        assert self.open.pop() == tag

    def handle_data(self, data):
        self.text += data


def test_the_page_holds_every_run_and_needs_no_network(done):
    page = Page()
    page.feed(done.page.read_text("utf-8"))
    assert page.open == []
    for link in page.links:
        if link.startswith("#"):
            assert link[1:] in page.ids
        elif not link.startswith("data:"):
            assert (done.folder / link).exists(), link
    assert page.charts == 4 + 1  # the logo
    for cell in done.plan.cells:
        assert f"replay/{cell.name}" in page.text
    assert done.plan.command() in page.text
    assert "Mann–Whitney" in page.text
    assert "{{" not in page.text


def test_killed_and_gone_on_with_it_is_the_same(done, tmp_path):
    """Two processes make the runs, and their leader is killed; then one process makes the rest."""
    out = tmp_path / "s4"
    words = [sys.executable, "-c", "import sys; from bridgegen.cli import main; sys.exit(main())"]
    words += [*shlex.split(done.plan.command())[1:-1], str(out), "--workers", "2"]
    process = subprocess.Popen(words, stderr=subprocess.DEVNULL, stdout=subprocess.DEVNULL)
    while process.poll() is None and finished(out) < 1:
        time.sleep(0.01)
    process.send_signal(signal.SIGKILL)
    process.wait()
    kept = finished(out)
    assert kept >= 1
    told = []
    callbacks = JobCallbacks(progress=lambda *now: told.append(now))
    again = bg.compare("crossroads-s4", **GRID, workers=1, out=out, callbacks=callbacks)
    _, made, total, facts = told[0]
    ended = int(facts.split()[0])
    assert ended >= kept
    assert (made, total) == (120 * ended, 480)
    assert not again.gaps
    assert the_same(done.folder, out)


def test_stopped_it_says_how_to_go_on_and_then_it_may_grow(done, tmp_path, monkeypatch):
    def stop(self, name, evaluations):
        if name.endswith("pso-0") and evaluations >= 80:
            raise KeyboardInterrupt

    out = tmp_path / "s4"
    small = {**GRID, "seeds": 1}
    with monkeypatch.context() as patched:
        patched.setattr(RunsProgress, "batch", stop)
        with pytest.raises(Interrupted) as caught:
            bg.compare("crossroads-s4", **small, workers=1, out=out)
    approve(str(caught.value), "bridgegen", "--seeds", "--budget")
    assert finished(out) == 1
    assert len(rows_of(out / "runs" / "crossroads-s4-pso-0")) == 80
    assert not (out / "runs.csv").exists()
    ended = out / "runs" / "crossroads-s4-random-0" / "run.sqlite"
    before = ended.stat().st_mtime_ns
    bg.compare("crossroads-s4", **GRID, workers=1, out=out)
    assert ended.stat().st_mtime_ns == before
    assert the_same(done.folder, out)


def test_a_run_of_it_is_a_run(done):
    cell = Cell("crossroads-s4", "pso", 1)
    run = bg.resume(done.plan.folder(cell))
    assert run.finished
    assert run.scenarios
    assert run.report.exists()


class Failing(Random):
    """Breaks with seed 1, after a batch."""

    name = "failing"
    broken = True

    def __init__(self, problem, seed, **settings):
        super().__init__(problem, seed)
        self._left = 1 if seed == 1 and Failing.broken else 1_000

    def ask(self):
        self._left -= 1
        if self._left < 0:
            raise ZeroDivisionError("no more luck")
        return super().ask()


def test_a_run_that_fails_is_a_gap_and_is_tried_again(tmp_path, monkeypatch):
    monkeypatch.setitem(ALGORITHMS, "failing", Failing)
    monkeypatch.setattr(Failing, "broken", True)
    grid = {"algorithms": ["failing", "pairwise"], "seeds": 2, "budget": 80, "out": tmp_path / "c"}
    found = bg.compare("crossroads-s4", **grid, workers=1)
    gap = Cell("crossroads-s4", "failing", 1)
    assert found.gaps == {gap: "ZeroDivisionError: no more luck"}
    assert found.line("crossroads-s4", "failing", "r_critic").runs == 1
    frame = found.frame()
    assert frame[frame["seed"] == 1]["ended"].str.contains("no more luck").sum() == 1
    text = found.page.read_text("utf-8")
    assert "failed: ZeroDivisionError: no more luck" in text
    assert "failing with seed 1" in text

    # pairwise ends before its budget, and says so.
    rows = rows_of(found.plan.folder(Cell("crossroads-s4", "pairwise", 0)))
    assert len(rows) < 80
    row = frame[(frame["algorithm"] == "pairwise") & (frame["seed"] == 0)].set_index("measure")
    assert row.loc["r_critic"]["value"] == rows.critical.sum() / len(rows)
    assert row.loc["to_50"]["value"] == math.inf
    assert set(row["ended"]) == {"exhausted"}
    assert "pairwise had no more rows to propose after" in text

    monkeypatch.setattr(Failing, "broken", False)
    whole = bg.compare("crossroads-s4", **{**grid, "algorithms": ["failing"]}, workers=1)
    assert not whole.gaps
    assert len(whole.records) == 2


def test_other_settings_are_refused(done):
    def again(**other):
        return bg.compare("crossroads-s4", **{**GRID, **other}, workers=1, out=done.folder)

    for other, told in (
        ({"budget": 100}, "budget was 120, is 100"),
        ({"ego": "reference"}, 'ego was null, is "reference"'),
        ({"fixed": {"fog_density": 0.0}}, "fixed was"),
        ({"settings": {"pso": {"w": 0.5}}}, 'settings of pso was {"w": 0.8}, is {"w": 0.5}'),
    ):
        with pytest.raises(StorageError, match=re.escape(told)) as caught:
            again(**other)
        assert len(caught.value.problems) == 1


def test_a_folder_of_something_else_is_left_alone(tmp_path):
    (tmp_path / "mine.txt").write_text("mine")
    with refuses(StorageError):
        bg.compare("crossroads-s4", out=tmp_path)
    assert os.listdir(tmp_path) == ["mine.txt"]


@pytest.mark.parametrize(
    ("arguments", "error", "told"),
    [
        ({"algorithms": ["random", "psp"]}, UnknownNameError, "did you mean 'pso'"),
        ({"algorithms": ["pso", "pso"]}, InputError, "algorithm pso must be named once"),
        ({"algorithms": []}, InputError, "needs at least one algorithm"),
        ({"baseline": "ga"}, UnknownNameError, "unknown algorithm of this comparison 'ga'"),
        ({"settings": {"pso": {"ww": 1}}}, UnknownNameError, "unknown setting of pso 'ww'"),
        ({"settings": {"pso": {"w": "x"}}}, InputError, "w must be a number"),
        ({"settings": {"ga": {}}}, UnknownNameError, "of this comparison 'ga'"),
        ({"seeds": 0}, InputError, "1 <= seeds"),
        ({"budget": 0}, InputError, "1 <= budget"),
        ({"workers": 0}, InputError, "workers must be a number of processes, 1 to 1024"),
        ({"apart": 0.0}, InputError, "0 < distinct <= 1"),
        ({"ego": "refrence"}, UnknownNameError, "did you mean 'reference'"),
        ({"road_map": "no.xodr"}, InputError, "no.xodr"),
        ({"objective": {"d_mim": 1.0}}, UnknownNameError, "did you mean 'd_min'"),
    ],
)
def test_mistakes_are_told_before_anything_is_run(tmp_path, arguments, error, told):
    with pytest.raises(error, match=re.escape(told)):
        bg.compare("crossroads-s4", **{"workers": 1, "out": tmp_path / "c", **arguments})
    runs = tmp_path / "c" / "runs"
    assert not runs.exists() or not [*runs.rglob("run.sqlite")]


def test_algorithms_of_one_and_of_many_objectives_are_compared_by_harm(tmp_path):
    """Those of many minimise d_min, too; what both have is harm."""
    found = bg.compare(
        "crossroads-s1", algorithms=["random", "nsga2"], seeds=1, budget=40, workers=1,
        objective={"harm": None}, ego="route-follower", deliver=False, out=tmp_path / "c",
    )  # fmt: skip
    assert {one.terms for one in found.records.values()} == {("harm",)}
    assert len(found.records) == 2
    assert not found.gaps
