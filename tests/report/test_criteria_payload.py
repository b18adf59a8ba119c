"""Pass criteria on the page: their data, the sentences, and what a browser shows of them."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.approval import approve
from tests.report.conftest import make_report

from bridgegen.assess.criteria import headline, summarise_criteria
from bridgegen.assess.criteria.monitor import LARGEST
from bridgegen.pages.confirmation_payload import criteria_payload, histogram, margins_shown
from bridgegen.pages.data import Column, ReportData
from bridgegen.pages.page import write_report
from bridgegen.pages.payload import payload
from bridgegen.pages.sentences import sentences, summary_table
from bridgegen.scenario.language.criteria import Criterion
from bridgegen.scenario.stl import TINY

HOSTILE = "</script><script>window.hacked = 1</script><img src=x onerror='window.hacked = 2'>"

CLEAR = Criterion(
    "R-12", "always(gap to bv > 3 m)", f"Keeps 3 m. {HOSTILE}", "critical", ("distance",)
)
SLOW = Criterion("R-13", "v_d < 30 m/s", severity="minor")
UNHURT = Criterion("R-14", "n_collision == 0")


def judged(*criteria: Criterion, report: ReportData) -> ReportData:
    """The same report with criteria; margins are made of its metrics."""
    e = report.evaluations
    of = {one.name: one.whole for one in e.metrics}
    margins = {
        "R-12": of["d_min"] - 3.0,
        "R-13": 30.0 - of["v_d"],
        "R-14": np.where(of["n_collision"] > 0, -1.0, TINY),
    }
    columns = tuple(
        Column(one.quantity, "m", margins[one.id], f"margin of {one.id}") for one in criteria
    )
    kept = tuple(
        replace(p, metrics={**p.metrics, **{c.name: float(c.whole[p.evaluation]) for c in columns}})
        for p in report.kept
    )
    metrics = np.stack([column.whole for column in columns], axis=1)
    names = [column.name for column in columns]
    return replace(
        report, kept=kept, evaluations=replace(e, metrics=(*e.metrics, *columns)),
        criteria=summarise_criteria(criteria, metrics, names),
    )  # fmt: skip


def uncritical(data: ReportData) -> ReportData:
    """The same run by another rule, by which nothing is critical, without files."""
    e = data.evaluations
    return replace(
        data, kept=(), more=data.kept, evaluations=replace(e, critical=np.zeros_like(e.critical)),
        summary=replace(data.summary, n_critical=0),
    )  # fmt: skip


@pytest.fixture(scope="module")
def data() -> ReportData:
    return judged(CLEAR, SLOW, UNHURT, report=make_report(120, 4))


def test_the_page_has_each_criterion_with_its_counts(data):
    found = criteria_payload(data)
    margins = data.evaluations.metrics[-3].whole
    first = found["list"][0]
    assert (first["id"], first["severity"], first["tags"]) == ("R-12", "critical", ["distance"])
    assert first["violated"] == int((margins < 0).sum()) > 0
    assert (first["violated"] + first["met"], first["failed"]) == (120, 0)
    assert first["worst"] == float(margins.min())
    assert first["at"] == int(margins.argmin())
    assert json.dumps(found, allow_nan=False)


def test_without_criteria_the_page_has_no_section():
    assert criteria_payload(make_report(20, 1)) is None


def test_zero_is_an_edge_of_a_histogram_and_all_margins_are_counted():
    margins = np.array([-1.0, -0.4, -TINY, TINY, 0.3, 2.0, 2.5, np.nan, LARGEST, -LARGEST])
    found = histogram(margins)
    edges = (found["first"] + np.arange(len(found["counts"]) + 1)) * found["width"]
    zero = int(np.flatnonzero(edges == 0.0)[0])
    assert sum(found["counts"][:zero]) == 3  # the violated ones
    assert sum(found["counts"][zero:]) == 4
    assert found["width"] == 0.2  # 1, 2 or 5 times a power of ten: 3 to 4 in 22 bins


def test_one_outlier_does_not_flatten_a_histogram():
    margins = np.concatenate([np.linspace(-1.0, 1.0, 1000), [900.0]])
    assert histogram(margins)["width"] <= 0.2


@pytest.mark.parametrize("sign", [-1.0, 1.0])
def test_one_violation_of_a_thousand_stands_left_of_zero(sign):
    """However few lie on a side of 0, they are not counted on the other."""
    margins = sign * np.concatenate([np.linspace(5.0, 9.0, 1000), [-0.1]])
    found = histogram(margins)
    left = -found["first"]
    assert sum(found["counts"][:left]) == int((margins < 0.0).sum())
    assert sum(found["counts"][left:]) == int((margins > 0.0).sum())


def test_histograms_of_equal_margins_and_of_none():
    assert histogram(np.full(5, TINY)) == {"first": 0, "width": 1.0, "counts": [5]}
    assert histogram(np.full(5, -2.0))["counts"][0] == 5
    assert histogram(np.full(5, np.nan)) is None
    assert histogram(np.full(5, LARGEST)) is None


def test_rounding_keeps_the_verdict():
    shown = margins_shown(np.array([LARGEST, -0.04, -TINY, TINY, -1e-12, np.nan]))
    assert [None if one is None else float(np.sign(one)) for one in shown] == [
        1.0, -1.0, -1.0, 1.0, -1.0, None,
    ]  # fmt: skip
    assert shown[1] == -0.04


def test_the_page_s_rows_keep_the_verdict(data):
    page = payload(data)
    column = next(c for c in page["rows"]["columns"] if c["name"] == "criterion:R-14")
    violated = [value < 0 for value in column["values"]]
    assert violated == (data.evaluations.metrics[-1].whole < 0).tolist()


def test_the_result_begins_with_the_criteria(data):
    n = data.criteria[0].violated, data.criteria[2].violated
    first = sentences(data)[0]
    approve(first, f"R-12 in {n[0]}", f"R-14 in {n[1]}", "120")
    met = judged(SLOW, report=make_report(120, 4))
    approve(sentences(met)[0], "R-13", "120")


def test_headlines():
    def of(counts: dict[str, int], n: int = 300) -> str:
        criteria = [Criterion(name, "ttc > 1") for name in counts]
        rows = [np.where(np.arange(n) < k, -1.0, 1.0) for k in counts.values()]
        names = [one.quantity for one in criteria]
        return headline("my-ego", summarise_criteria(criteria, np.stack(rows, axis=1), names))

    approve(of({"A": 160}), "160", "300")
    approve(of({"A": 1, "B": 2}), "B in 2", "A in 1", "300")
    approve(of({"A": 0, "B": 0}), "2", "300")
    approve(of({"A": 0}, 1), "A in 1")
    many = of({name: k for k, name in enumerate("ABCDE")})
    approve(many, "E in 4", "300")
    assert headline("my-ego", ()) == ""
    failed = summarise_criteria([SLOW], np.full((3, 1), np.nan), [SLOW.quantity])
    assert headline("my-ego", failed) == ""


def test_what_violates_a_criterion_is_no_near_miss(data):
    """By the rule of criteria a scenario without any conflict may be critical."""
    from bridgegen.assess.conflict.findings import Findings

    e = data.evaluations
    findings = Findings.none(120)
    shown = replace(
        data, evaluations=replace(e, findings=findings),
        summary=replace(data.summary, harm="harm", criteria=("criterion:R-12",)),
    )  # fmt: skip
    assert ("Critical: near misses", "0") in summary_table(shown)
    assert "All are near misses" not in " ".join(sentences(shown))


def open_(browser: Any, data: ReportData, folder: Any, **context: Any) -> Any:
    write_report(folder / "report.html", data)
    page = browser.new_page(**{"viewport": {"width": 1440, "height": 900}} | context)
    page.complaints = []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.goto((folder / "report.html").as_uri())
    return page


@pytest.fixture(scope="module")
def page(browser, data, tmp_path_factory):
    page = open_(browser, data, tmp_path_factory.mktemp("criteria"))
    yield page
    assert page.complaints == []
    page.close()


@pytest.mark.browser
def test_the_verdict_is_on_the_first_screen(page, data):
    verdict = page.locator("#criteria-verdict")
    assert headline(data.summary.ego, data.criteria) in verdict.inner_text()
    assert verdict.bounding_box()["y"] < page.locator("#list").bounding_box()["y"] < 900
    assert page.evaluate("window.hacked") is None
    assert HOSTILE in page.locator("#criteria-body tr").first.inner_text()
    assert page.locator("#criteria-body img").count() == 0


@pytest.mark.browser
def test_the_violations_of_a_criterion_alone(page, data):
    margins = data.evaluations.metrics[-3].whole
    page.get_by_role("button", name="Show the violations of R-12 only").click()
    note = page.locator("#list-note").inner_text()
    assert str((margins < 0).sum()) in note
    assert "R-12" in note
    assert page.locator("#list-criterion").input_value() == "criterion:R-12"
    shown = page.evaluate(
        """[...document.querySelectorAll("#list-body tr[data-i]")].map((row) =>
             Number(row.querySelector("button").ariaLabel.match(/evaluation (\\d+)/)[1]) - 1)"""
    )
    listed = margins[shown]
    assert listed[0] == margins.min()
    assert (np.diff(listed) >= 0.0).all()  # the least margin first
    assert (listed < 0.0).all()
    page.locator("#list-clear").click()
    assert "critical scenarios" in page.locator("#list-note").inner_text()
    assert page.get_by_role("button", name="violations of R-12").get_attribute("aria-pressed") == (
        "false"
    )


@pytest.mark.browser
def test_the_least_margin_plays_and_a_scenario_lists_its_margins(page, data):
    worst = data.kept[0].evaluation
    row = page.locator("#criteria-body tr").first
    at = data.criteria[0].at
    row.get_by_role("button", name="the least margin of R-12").click()
    page.wait_for_function(f"document.getElementById('measures').textContent.includes('{at}')")
    page.evaluate("bridgegen.select(0)")
    text = page.locator("#measures").inner_text()
    approve(text, "criteria")
    margin = data.evaluations.metrics[-3].whole[worst]
    assert f"violated, −{abs(margin):.3g}" in text.replace("\u202f", " ")
    assert "criterion:R-12" not in text


@pytest.mark.browser
@pytest.mark.parametrize("width", [390, 1440])
def test_where_nothing_is_critical_the_violations_are_listed(browser, data, tmp_path, width):
    page = open_(browser, uncritical(data), tmp_path, viewport={"width": width, "height": 900})
    assert page.locator("#scenarios-title").inner_text() == "Violations of pass criteria"
    assert page.locator("#list").is_visible()
    assert page.locator("#no-scenarios").is_hidden()
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.complaints == []
    page.close()


@pytest.mark.browser
def test_criteria_that_are_met_take_one_line(browser, tmp_path):
    page = open_(browser, judged(SLOW, report=make_report(120, 4)), tmp_path)
    assert "R-13" in page.locator("#criteria-verdict").inner_text()
    assert page.locator("#criteria-verdict h2").count() == 0
    assert page.get_by_role("button", name="violations of R-13").is_disabled()
    page.close()
