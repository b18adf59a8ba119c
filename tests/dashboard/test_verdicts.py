"""The dashboard's first screen: verdicts by scenario and driver, pictures, and versions."""

import re
import shutil
from dataclasses import replace

import pytest

import bridgegen as bg
from bridgegen.jobs.dashboard.modes import Decisions, failure_modes
from bridgegen.jobs.dashboard.page import MOST_TRIED, write_page
from bridgegen.jobs.dashboard.verdicts import history, standings
from bridgegen.pages.thumbnails import FILE

DAY = 86_400.0


def stand(results):
    modes = failure_modes(results, Decisions({}))
    return standings(results, [mode for mode in modes if mode.fails_now])


def test_each_pair_has_the_verdict_of_its_current_results(result):
    found = stand(
        [
            result("cut-in", "1.0", 1.0, modes=("a", "b")),
            result("cut-in", "2.0", 2.0, modes=("b",)),
            result("merge", "2.0", 3.0),
            result("rain", "2.0", 4.0, unjudged=True),
            result("fog", "2.0", 5.0, finished=False),
            result("snow", "2.0", 5.0, evaluations=0),
            result("night", "2.0", 6.0, kind="difference", worse_than="stack-1.0"),
        ]
    )
    verdicts = {scenario: standing.verdict for (scenario, _), standing in found.items()}
    assert verdicts == {
        "cut-in": "fails",
        "merge": "no failure found",
        "rain": "not judged",
        "fog": "not judged",
        "snow": "not judged",
        "night": "not judged",
    }
    assert len(found["cut-in", "stack"].modes) == 1  # of version 2.0 alone
    assert found["cut-in", "stack"].worst.driver.version == "2.0"


def test_a_version_is_one_step_and_days_stand_for_unknown_versions(result):
    found = history(
        [
            result("cut-in", "1.0", 1.0, modes=("a", "b")),
            result("merge", "1.0", 2.0),
            result("cut-in", "1.1", 3.0),
            result("cut-in", "1.2", 4.0, modes=("a",), finished=False),
            result("cut-in", "", 1.0, name="mine", modes=("a",)),
            result("cut-in", "", DAY + 1.0, name="mine"),
        ]
    )
    steps = [(step.name, step.modes, step.failing, step.scenarios) for step in found["stack"]]
    assert steps == [("1.0", 2, 1, 2), ("1.1", 0, 0, 1)]
    days = [(step.name, step.modes) for step in found["mine"]]
    assert days == [("1970-01-01", 1), ("1970-01-02", 0)]


def matrix_of(text):
    """Return the matrix's cells as the page has them, tags removed, by scenario."""
    table = re.search(r'<table class="data verdicts">.*?</table>', text, re.DOTALL)[0]
    rows = re.findall(r"<tr><th scope=\"row\">(.*?)</tr>", table, re.DOTALL)
    bare = [re.sub(r"<svg.*?</svg>|<[^>]*>", " ", row, flags=re.DOTALL) for row in rows]
    return table, [" ".join(row.split()) for row in bare]


def test_the_page_says_each_verdict_in_words_and_shows_the_worst_failure(project, tmp_path):
    shutil.copytree(project, tmp_path / "project")
    page = bg.build_dashboard(tmp_path / "project").page
    table, rows = matrix_of(page.read_text("utf-8"))
    (cut_in,) = [row for row in rows if row.startswith("cut-in")]
    assert "✕ FAILS, " in cut_in
    assert table.count("<svg") == table.count("<animateTransform") // 4 > 0  # two bodies each
    assert 'href="./runs/route-follower/report.html"' in table
    # Without the file there is no picture, and all else stands.
    for path in (tmp_path / "project").rglob(FILE):
        path.unlink()
    page = bg.build_dashboard(tmp_path / "project").page
    assert matrix_of(page.read_text("utf-8"))[1] == rows
    assert "<animateTransform" not in page.read_text("utf-8")


def test_what_is_left_out_is_said_and_what_fails_is_kept(project, result, tmp_path):
    found = bg.build_dashboard(project, out=tmp_path / "a.html")
    many = [result(f"ok-{i:03d}") for i in range(MOST_TRIED)] + [result("zz", modes=("a",))]
    modes = tuple(failure_modes(many, Decisions({})))
    found = replace(found, modes=modes, project=replace(found.project, runs=tuple(many), suites=()))
    write_page(found)
    text = found.page.read_text("utf-8")
    _, rows = matrix_of(text)
    assert len(rows) == MOST_TRIED
    assert rows[0].split()[0] == "zz"
    assert "1 scenario left out" in text


def test_versions_are_a_chart_and_a_large_project_a_page_of_bounded_size(project, result, tmp_path):
    found = bg.build_dashboard(project, out=tmp_path / "a.html")
    many = [
        result(f"s{s}", f"1.{v}", v * DAY, name=f"stack{d}", modes=tuple("abcd"[: 4 - v]))
        for d in range(20)
        for s in range(20)
        for v in range(5)
    ]
    modes = tuple(failure_modes(many, Decisions({})))
    write_page(
        replace(found, modes=modes, project=replace(found.project, runs=tuple(many), suites=()))
    )
    text = found.page.read_text("utf-8")
    assert len(text) < 3_000_000
    chart = re.search(r'aria-label="Failure modes of stack7 by version: (.*?)".*?</svg>', text)
    assert chart[1].startswith("1.0 80 failure modes; 1.1 60 failure modes")
    assert chart[1].endswith("1.4 0 failure modes")
    assert "20 of 20 fail" in chart[0]
    assert "0 of 20 fail" in chart[0]


@pytest.mark.browser
@pytest.mark.parametrize("width", [1440, 390])
def test_a_large_matrix_moves_in_its_box_under_its_heads(width, project, result, browser, tmp_path):
    found = bg.build_dashboard(project, out=tmp_path / "a.html")
    many = [result(f"scenario-{i}", name=f"stack-of-{d}") for i in range(40) for d in range(12)]
    write_page(replace(found, modes=(), project=replace(found.project, runs=tuple(many))))
    tab = browser.new_page(viewport={"width": width, "height": 850})
    tab.goto(found.page.as_uri())
    assert tab.evaluate("document.documentElement.scrollWidth") <= width
    head, side = ".verdicts thead th:last-child", ".verdicts tbody tr:last-child th"
    box = tab.locator(".wide:has(> .verdicts)")
    assert box.bounding_box()["height"] <= 0.8 * 850
    box.evaluate("(element) => element.scrollTo(10000, 10000)")
    outer = box.bounding_box()
    assert tab.locator(head).bounding_box()["y"] == pytest.approx(outer["y"], abs=2)
    assert tab.locator(side).bounding_box()["x"] == pytest.approx(outer["x"], abs=2)
    tab.close()
