"""The table of all critical scenarios in a real browser: order, filters, keys, speed."""

from collections.abc import Iterator
from typing import Any

import numpy as np
import pytest

from bridgegen.pages.data import ReportData
from bridgegen.pages.page import write_report

pytestmark = pytest.mark.browser

SHOWN = """[...document.querySelectorAll("#list-body tr[data-i]")].map((row) =>
  Number(row.querySelector("button").ariaLabel.match(/evaluation (\\d+)/)[1]) - 1)"""


def open_(browser: Any, data: ReportData, folder: Any, **context: Any) -> Any:
    write_report(folder / "report.html", data)
    page = browser.new_page(**{"viewport": {"width": 1280, "height": 720}} | context)
    page.complaints = []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.goto((folder / "report.html").as_uri())
    return page


@pytest.fixture(scope="module")
def page(browser, report, tmp_path_factory) -> Iterator[Any]:
    page = open_(browser, report, tmp_path_factory.mktemp("table"))
    yield page
    page.close()


@pytest.fixture
def metric(report):
    """Return a metric's values of the critical rows that the table shows, by evaluation."""
    e = report.evaluations
    shown = {*np.flatnonzero(e.critical).tolist(), *(p.evaluation for p in report.kept)}

    def of(name: str) -> dict[int, float]:
        values = next(c.values for c in e.metrics if c.name == name)
        return {i: float(values[i]) for i in shown}

    return of


def test_it_holds_every_critical_row_the_worst_first(page, report, metric):
    e = report.evaluations
    F, hits = e.objectives[0].values, np.flatnonzero(e.critical)
    best = hits[np.argsort(F[hits], kind="stable")][:5].tolist()
    assert page.evaluate(SHOWN)[:5] == best
    rows = int(page.get_attribute("#list-table", "aria-rowcount")) - 1
    assert rows == len(metric("d_min"))


def test_a_click_on_a_head_sorts_and_another_turns_it_round(page, metric):
    values = metric("v_d")
    page.click("#list-head [data-by=v_d] button")
    shown = [values[i] for i in page.evaluate(SHOWN)]
    assert shown == sorted(values.values())[: len(shown)]
    page.click("#list-head [data-by=v_d] button")
    shown = [values[i] for i in page.evaluate(SHOWN)]
    assert shown == sorted(values.values(), reverse=True)[: len(shown)]
    assert page.get_attribute("#list-head [data-by=v_d]", "aria-sort") == "descending"
    page.click("#list-head [data-by=rank] button")


def test_a_metric_filters_it_and_the_parallel_coordinates_say_so(page, metric):
    page.select_option("#list-metric", "l_offset")
    page.fill("#list-high", "0.05")
    values = metric("l_offset")
    want = {i for i, value in values.items() if value <= 0.05}
    page.wait_for_function(
        f"document.getElementById('list-table').ariaRowCount === '{len(want) + 1}'"
    )
    assert set(page.evaluate(SHOWN)) <= want
    assert "l_offset" in page.inner_text("#list-head")  # what is filtered by is to be seen
    page.locator("#parallel").scroll_into_view_if_needed()
    page.wait_for_function("document.getElementById('filter-note').textContent.includes('pass')")
    page.click("#list-clear")
    assert page.input_value("#list-high") == ""
    assert page.get_attribute("#list-table", "aria-rowcount") == f"{len(values) + 1}"


def test_keys_lead_from_row_to_row_and_play(page, report):
    page.locator("#list-body button").first.focus()
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowDown")
    page.keyboard.press("ArrowUp")
    second = page.evaluate(SHOWN)[1]
    assert page.evaluate("document.activeElement.ariaLabel").endswith(", rank 2")
    page.keyboard.press("Enter")
    assert page.locator("#list-body tr[aria-current]").count() == 1
    assert page.inner_text("#measures h3").endswith(f"valuation {second + 1}")
    page.keyboard.press("End")
    last = page.evaluate("document.activeElement.closest('tr').ariaRowIndex")
    assert last == page.get_attribute("#list-table", "aria-rowcount")
    page.keyboard.press("Home")
    assert page.evaluate("document.activeElement.closest('tr').ariaRowIndex") == "2"


def test_a_handed_over_one_plays(page, report):
    page.check("#only-kept")
    rows = page.locator("#list-body tr[data-i]")
    assert rows.count() == len(report.kept)
    rows.locator("button").filter(has_text=report.kept[2].name).click()
    state = page.evaluate("bridgegen.state()")
    assert (state["scenario"], state["playing"]) == (report.kept[2].name, True)
    page.evaluate("bridgegen.pause()")
    page.wait_for_function("location.hash.startsWith('#0003@')")
    page.uncheck("#only-kept")


def test_what_is_shown_from_elsewhere_is_brought_into_sight(page):
    page.evaluate("document.getElementById('list-scroll').style.height = '150px'")
    ranks = page.evaluate("bridgegen.data.rows.rank")
    for rank in (max(ranks), 1):
        page.evaluate(f"bridgegen.open({ranks.index(rank)})")
        current = page.locator("#list-body tr[aria-current]")
        box, frame = current.bounding_box(), page.locator("#list-scroll").bounding_box()
        assert frame["y"] < box["y"] < frame["y"] + frame["height"] - 20
        assert current.locator("button").get_attribute("aria-label").endswith(f", rank {rank}")


def test_nothing_complained_so_far(page):
    assert page.complaints == []


def test_a_filter_that_nothing_passes_says_so(browser, report, tmp_path):
    write_report(tmp_path / "report.html", report)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto((tmp_path / "report.html").as_uri())
    page.fill("#list-low", "100000")
    assert page.inner_text("#list-body").strip() == "No critical scenario passes the filter."
    page.click("#list-clear")
    assert page.locator("#list-body tr[data-i]").count() > 3
    page.close()
