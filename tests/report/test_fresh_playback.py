"""Where fresh random draws alone fail, the page plays and lists them, and holds their files."""

import json
import re
import shutil

import pytest

import bridgegen as bg
from bridgegen.assess.conflict.harm import NEAR_MISS
from bridgegen.jobs.search.notebook import draw
from bridgegen.jobs.search.report import rewrite_report
from bridgegen.jobs.search.restored import pipeline_of
from bridgegen.jobs.view.run_view import RunView


@pytest.fixture(scope="module")
def unlucky(tmp_path_factory):
    """A run none of whose evaluations fails; 4 of its fresh draws do, of which it exports 2."""
    return bg.run_search(
        "crossroads-s4", ego="route-follower", objective={"harm": None}, budget=10, keep=2,
        causes=False, out=tmp_path_factory.mktemp("runs") / "unlucky",
    )  # fmt: skip


def data_of(page: str) -> dict:
    (text,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', page, re.S)
    return json.loads(text)


def test_the_page_holds_the_failing_draws_with_their_files(unlucky):
    assert (unlucky.verdict, unlucky.triage.bound.harmful, unlucky.scenarios) == ("fails", 0, ())
    data = data_of(unlucky.report.read_text("utf-8"))
    assert [one["name"] for one in data["kept"]] == ["fresh-01", "fresh-02"]
    for one in data["kept"]:
        exported = unlucky.folder / "critical" / one["name"]
        driven = bg.simulate_file(exported.with_suffix(".xosc"))  # the file alone says the same
        assert one["metrics"]["harm"] == driven.metrics["harm"] >= NEAR_MISS
        assert one["metrics"]["n_collision"] == 1
        facts = json.loads(exported.with_suffix(".json").read_text("utf-8"))
        assert one["conflict"]["sentence"] == facts["conflict"]["sentence"]
        suffixes = ("owl", "xodr", "xosc", "json")
        assert one["files"] == [f"critical/{one['name']}.{suffix}" for suffix in suffixes]
        assert set(one["files"]) <= set(data["files"]["names"])
    worst, second = (one["metrics"]["harm"] for one in data["kept"])
    assert worst == max(one for one in unlucky.triage.fresh.harm if one is not None) >= second


def test_a_page_that_is_made_later_holds_the_same(unlucky, tmp_path):
    run = bg.Run(shutil.copytree(unlucky.folder, tmp_path / "run"))
    (path,) = rewrite_report(run, pipeline_of(run, "open"), lambda stage: None)
    written = data_of(unlucky.report.read_text("utf-8"))["kept"]
    assert data_of(path.read_text("utf-8"))["kept"] == written
    view = RunView(run.folder)
    assert data_of(view.page().decode())["kept"] == written
    assert view.news(10)["kept"] == 2
    for name in written[0]["files"]:
        assert view.file(name) == (run.folder / name).read_bytes()


def test_a_notebook_shows_the_worst_draw(unlucky):
    assert "the worst scenario, fresh-01" in [one.get_title() for one in draw(unlucky).axes]


@pytest.mark.browser
def test_the_page_plays_the_worst_draw_first_and_lists_them(browser, unlucky):
    page = browser.new_page(viewport={"width": 1280, "height": 800})
    page.goto(unlucky.report.as_uri())
    page.wait_for_function("document.getElementById('scene-name').textContent === 'fresh-01'")
    page.wait_for_function("bridgegen.state().playing && bridgegen.state().position > 0")
    assert "in 4 of 256 fresh random draws" in page.locator("#modes-lead").inner_text()
    assert "nearest" not in page.locator("#modes-note").inner_text()
    assert "struck the left side of 'bv'" in page.locator("#conflict").inner_text()
    assert "Scenario fresh-01, a fresh random draw" in page.locator("#measures").inner_text()
    assert "critical/fresh-01.xosc" in page.locator("#details .files").inner_text()
    first, second = page.locator("#modes-list > li").all()
    assert "struck the left side of 'bv'" in first.inner_text()
    assert "severity" in first.inner_text()
    assert page.locator("#list").is_hidden()  # no evaluation is critical
    second.get_by_role("button", name="Play fresh-02").click()
    page.wait_for_function("document.getElementById('scene-name').textContent === 'fresh-02'")
    page.wait_for_function("location.hash.startsWith('#fresh-02')")
    page.reload()
    page.wait_for_function("document.getElementById('scene-name').textContent === 'fresh-02'")
    page.close()
