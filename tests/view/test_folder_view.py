"""A folder of runs: what it lists, how it takes damaged ones, and two side by side."""

import json
import re
import shutil
import sqlite3
from html.parser import HTMLParser
from pathlib import Path
from types import SimpleNamespace

import pytest
from hypothesis import given
from hypothesis import strategies as st
from tests.approval import approve, refuses

import bridgegen as bg
from bridgegen.base.errors import StorageError
from bridgegen.jobs.dashboard.home import Home
from bridgegen.jobs.view import folder_view
from bridgegen.jobs.view.folder_view import _by_key, _count
from bridgegen.jobs.view.overview import DEEPEST, find_runs, read_line
from bridgegen.jobs.view.server import Server, answer
from bridgegen.results.store import Store

HOSTILE = '<img src=x onerror="alert(1)">'


@pytest.fixture(scope="module")
def runs(finished, tmp_path_factory) -> Path:
    """Runs at two depths: two that ended, one without a row, one damaged; and other folders."""
    folder = tmp_path_factory.mktemp("runs")
    shutil.copytree(finished, folder / "s4")
    shutil.copytree(finished, folder / "week 2" / "again")
    (folder / "notes").mkdir()
    shutil.copytree(finished, folder / "damaged")
    (folder / "damaged" / "run.sqlite").write_bytes(b"not a database at all" * 100)
    with Store.open(finished) as store:
        Store.create(
            folder / "new", store.settings, store.parameters, store.metrics, n_var=3, n_obj=1
        ).close()
    return folder


def listed(page: bytes) -> dict[str, dict]:
    """Return what the page holds of each run."""
    (text,) = re.findall(rb'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    return {run["path"]: run for run in json.loads(text)["runs"]}


def test_it_lists_every_run_with_what_is_known_of_it(runs, finished):
    found = listed(Home(runs).page())
    assert list(found) == ["damaged", "new", "s4", "week 2/again"]
    triage = json.loads((finished / "triage.json").read_text("utf-8"))
    with sqlite3.connect(finished / "run.sqlite") as connection:
        (n,) = connection.execute("SELECT COUNT(*) FROM evaluations").fetchone()
    run = found["week 2/again"]
    assert (run["scenario"], run["ego"], run["evaluations"]) == (
        "crossroads-s4",
        "route-follower",
        n,
    )
    assert run["modes"] == len(triage["modes"]) + triage["unrecorded_modes"]
    assert run["failures"] == triage["bound"]["harmful"]
    assert run["share"] == triage["bound"]["space"]["share"]
    assert run["finished"]
    files = sum(one.stat().st_size for one in (runs / "s4").rglob("*") if one.is_file())
    assert found["s4"]["size"] == files
    assert (found["new"]["evaluations"], found["new"]["finished"]) == (0, False)


def test_a_damaged_run_is_listed_with_the_reason_and_the_others_are_shown(runs):
    site = Home(runs)
    found = listed(site.page())
    assert "run.sqlite" in found["damaged"]["problem"]
    assert answer(site, f"/run/{found['s4']['number']}/").status == 200
    broken = answer(site, f"/run/{found['damaged']['number']}/")
    assert broken.status == 500
    assert b"run.sqlite" in broken.body


def test_each_run_s_page_news_and_files_are_below_its_number(runs):
    site = Home(runs)
    number = listed(site.page())["s4"]["number"]
    assert b"<title>crossroads-s4" in answer(site, f"/run/{number}/").body
    assert json.loads(answer(site, f"/run/{number}/news?after=0").body)["finished"]
    assert b"OpenSCENARIO" in answer(site, f"/run/{number}/critical/0001.xosc").body
    assert answer(site, f"/run/{number}").status == 404


@pytest.mark.parametrize(
    "path",
    ["/run/99/", "/run/-1/", "/run/x/", "/run/", "/pair", "/pair?first=0",
     "/pair?first=0&second=99", "/s4/run.sqlite", "/run/2/../../etc/passwd", "/run/2/run.sqlite"],
)  # fmt: skip
def test_nothing_else_is_there(runs, path):
    assert answer(Home(runs), path).status == 404


@given(st.text())
def test_no_path_at_all_breaks_it(runs, path):
    assert answer(Home(runs), path).status in (200, 404, 500)


def test_two_runs_side_by_side_match_their_failure_modes(runs):
    site = Home(runs)
    found = listed(site.page())
    a, b = found["s4"]["number"], found["week 2/again"]["number"]
    page = answer(site, f"/pair?first={a}&second={b}").body.decode()
    assert page.count("<iframe") == 2
    assert f'src="run/{a}/"' in page
    assert f'src="run/{b}/"' in page
    assert "Failure modes of both" in page
    assert "Only in" not in page  # the same run
    assert 'class="differs"' not in page
    alone = answer(site, f"/pair?first={a}&second={found['new']['number']}").body.decode()
    assert "Failure modes of both" not in alone
    assert "Only in s4" in alone


def test_two_modes_of_one_kind_in_a_run_are_counted_together():
    """Of other places on the route: another run may have them elsewhere."""
    mode = SimpleNamespace(
        conflict="contact", conflict_type="turning", responsible="ego", rule="r", partner="car"
    )
    modes = [
        SimpleNamespace(**vars(mode), title=t, count=n) for t, n in (("here", 3), ("there", 4))
    ]
    ((_, grouped),) = _by_key(SimpleNamespace(modes=modes)).items()
    assert [one.title for one in grouped] == ["here", "there"]
    assert _count(grouped) == "7"


def test_few_runs_are_open_at_a_time(runs, monkeypatch):
    monkeypatch.setattr(folder_view, "MOST_OPEN", 1)
    site = Home(runs)
    found = listed(site.page())
    first, second = (found[name]["number"] for name in ("s4", "week 2/again"))
    kept = site.run(first)
    assert site.run(first) is kept
    site.run(second)
    assert site.run(first) is not kept


class Tags(HTMLParser):
    def __init__(self) -> None:
        super().__init__()
        self.found: list[str] = []

    def handle_starttag(self, tag, attrs) -> None:
        self.found.append(tag)


def test_a_hostile_name_is_text(finished, tmp_path):
    shutil.copytree(finished, tmp_path / "x" / HOSTILE.replace("/", ""))
    site = Home(tmp_path / "x")
    for page in (site.page(), answer(site, "/pair?first=0&second=0").body):
        tags = Tags()
        tags.feed(page.decode())
        assert "img" not in tags.found


def test_links_are_not_followed_and_depth_is_bounded(finished, tmp_path):
    (tmp_path / "loop").symlink_to(tmp_path)
    (tmp_path / "elsewhere").symlink_to(finished)
    deep = tmp_path.joinpath(*"abcdefghijkl"[: DEEPEST + 2])
    shutil.copytree(finished, deep)
    assert find_runs(tmp_path) == []
    shutil.copytree(finished, deep.parents[1] / "run")
    assert find_runs(tmp_path) == [deep.parents[1] / "run"]


def test_a_line_of_the_list_reads_no_rows(finished, monkeypatch):
    """So a long run is listed as fast as a short one."""
    monkeypatch.setattr(Store, "read", None)
    monkeypatch.setattr(Store, "rows", None)
    line = read_line(finished.parent, finished)
    assert line.problem == ""
    assert line.modes


def test_a_folder_without_runs_is_one_clear_error(tmp_path, cli):
    with refuses(StorageError):
        Home(tmp_path)
    code, _, said = cli("open", str(tmp_path))
    assert code != 0
    approve(said, "contains")


def test_options_of_one_run_are_refused_for_a_folder_of_runs(runs, cli):
    code, _, said = cli("open", str(runs), "--evaluation", "3")
    assert code != 0
    approve(said, "itself")


@pytest.mark.browser
def test_runs_are_filtered_sorted_and_two_of_them_play_side_by_side(browser, runs):
    server = Server(Home(runs))
    server.start()
    page = browser.new_page(viewport={"width": 1440, "height": 900})
    complaints: list[str] = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.on("console", lambda m: complaints.append(m.text) if m.type == "error" else None)
    page.goto(server.url)

    def names() -> list[str]:
        return page.locator("#runs tbody tr td:nth-child(2)").all_inner_texts()

    assert len(names()) == 4
    page.click("#runs th:nth-child(2) button")
    assert [one.split("\n")[0] for one in names()] == ["damaged", "new", "s4", "week 2/again"]
    page.fill("#text", "week")
    assert names() == ["week 2/again"]
    page.fill("#text", "")
    page.check("#failing")
    assert names() == ["s4", "week 2/again"]
    assert page.get_attribute("#compare", "href") is None
    for k in (0, 1):
        page.locator("#runs tbody input").nth(k).check()
    page.click("#compare")
    page.wait_for_url(re.compile("/pair"))
    page.wait_for_function("document.querySelectorAll('iframe').length === 2")
    for frame in page.frames[1:]:
        frame.wait_for_function("window.bridgegen?.state()?.playing")
    assert len(page.frames) == 3
    page.click("text=All runs")
    page.wait_for_url(f"{server.url}#searches")
    page.click("text=week 2/again")
    page.wait_for_url(re.compile("/run/"))
    page.wait_for_function("bridgegen.state() !== null")
    assert complaints == []
    page.close()
    server.shutdown()
    server.server_close()


def test_a_run_that_violates_a_criterion_is_not_listed_as_without_failure(tmp_path):
    bg.run_search(
        "cut-in", budget=60, algorithm="random", keep=0, causes=False, triage="short",
        out=tmp_path / "runs" / "a",
        criteria=["R-12: always(gap to bv > 2 m)", "R-14: n_collision == 0"],
    )  # fmt: skip
    run = listed(Home(tmp_path / "runs").page())["a"]
    violated = bg.Run(tmp_path / "runs" / "a").criteria[0].violated
    approve(run["judged"], "12", violated)
    assert run["violated"]
    line = read_line(tmp_path / "runs", tmp_path / "runs" / "a")
    assert folder_view._FIGURES["pass criteria"](line) == run["judged"]


def test_a_run_without_criteria_says_nothing_of_them(runs):
    run = listed(Home(runs).page())["s4"]
    assert (run["judged"], run["violated"]) == ("", False)
