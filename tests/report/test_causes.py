"""The causes on the page: what it is told, and what a click on one does."""

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess.cause import Cause
from bridgegen.pages.page import write_report
from bridgegen.pages.payload import payload
from bridgegen.pages.sentences import sentences


@pytest.fixture(scope="module")
def caused(report):
    """The report with a cause for each critical row: planning, control, unavoidable by turns."""
    e = report.evaluations
    hits = np.flatnonzero(e.critical)
    cause = np.zeros(len(e.critical), dtype=np.int8)
    cause[hits] = Cause.PLANNING + np.arange(len(hits)) % 3
    kept = tuple(replace(p, cause=Cause(cause[p.evaluation]).label) for p in report.kept)
    return replace(report, evaluations=replace(e, cause=cause), kept=kept)


def test_the_page_is_told_of_every_row_and_all_together(caused):
    e, told = caused.evaluations, payload(caused)
    assert told["rows"]["cause"] == e.cause.tolist()
    assert told["causes"]["labels"] == ["none", "perception", "planning", "control", "unavoidable"]
    assert told["causes"]["counts"] == np.bincount(e.cause, minlength=5).tolist()
    assert [one["cause"] for one in told["kept"]] == [p.cause for p in caused.kept]
    json.dumps(told, allow_nan=False)


def test_where_none_was_sought_nothing_is_said(report):
    told = payload(report)
    assert told["causes"] is None
    assert told["rows"]["cause"] is None
    assert not any("Quick labels" in sentence for sentence in sentences(report))


def test_one_sentence_says_what_helps(caused):
    counts = np.bincount(caused.evaluations.cause, minlength=5)
    (told,) = [one for one in sentences(caused) if one.startswith("Quick labels")]
    approve(told, *counts[2:5])


def test_a_cause_for_each_row_or_none(caused):
    with refuses(ValueError, "cause", "120"):
        replace(caused.evaluations, cause=np.zeros(3, dtype=np.int8))


@pytest.mark.browser
@pytest.mark.parametrize(("width", "scheme"), [(1280, "light"), (400, "dark")])
def test_a_click_shows_one_cause_s_scenarios_only_and_another_all(
    browser, caused, tmp_path, width, scheme
):
    path = tmp_path / "report.html"
    write_report(path, caused)
    page = browser.new_page(viewport={"width": width, "height": 800}, color_scheme=scheme)
    complaints = []
    page.on("pageerror", lambda error: complaints.append(str(error)))
    page.goto(path.as_uri())
    page.locator("#parallel").scroll_into_view_if_needed()
    page.wait_for_function("Boolean(bridgegen.filter)")
    assert page.evaluate("document.documentElement.scrollWidth") == width
    assert page.is_disabled("#causes button.cause-1")  # nobody's
    n = int((caused.evaluations.cause == Cause.CONTROL).sum())

    page.click("#causes button.cause-3")
    assert page.get_attribute("#causes button.cause-3", "aria-pressed") == "true"
    assert page.inner_text("#list-note").startswith(f"{n} of ")
    causes = page.locator("#list-body tr[data-i] td:last-child").all_inner_texts()
    assert set(causes) == {"control"}
    assert f"{n} of 120 pass, {n} of them critical" in page.inner_text("#filter-note")
    page.click("#filter-clear")
    assert page.get_attribute("#causes button.cause-3", "aria-pressed") == "false"
    total = int(caused.evaluations.critical.sum())
    assert page.inner_text("#list-note") == f"{total} critical scenarios"
    assert complaints == []
    page.close()


@pytest.mark.browser
def test_without_causes_the_page_is_as_ever(browser, report, tmp_path):
    path = tmp_path / "report.html"
    write_report(path, report)
    page = browser.new_page()
    page.goto(path.as_uri())
    assert not page.is_visible("#causes")
    assert "cause" not in page.inner_text("#list-head")
    page.close()
