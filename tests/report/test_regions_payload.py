"""Critical regions on the page: who lies in them, the table, the boxes, the filter."""

import json
from dataclasses import replace
from typing import Any

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.base.errors import FileFormatError
from bridgegen.pages.page import write_report
from bridgegen.pages.payload import payload
from bridgegen.search.regions.record import read_record


def region(number: int, confirmed: bool, **box: tuple[float, float]) -> dict[str, Any]:
    """One as `bridgegen.search.regions.record` writes it."""
    evidence = {"rows": 300, "critical": 206, "failed": 0, "share": 0.687, "interval": [0.63, 0.74]}
    return {
        "number": number,
        "confirmed": confirmed,
        "narrowed": False,
        "rule": " and ".join(f"{name} in {low} .. {high}" for name, (low, high) in box.items()),
        "sentence": "It is known.",
        "named": list(box),
        "box": {name: {"low": low, "high": high} for name, (low, high) in box.items()},
        "fresh": evidence,
        "search": evidence | {"rows": 0, "critical": 0, "share": None},
        "space_share": 0.0123,
    }


@pytest.fixture(scope="module")
def record():
    """Two regions, the first of them confirmed."""
    return {
        "evaluations": 120,
        "critical": 40,
        "critical_held": 30,
        "space_share": 0.02,
        "confidence": 0.95,
        "at_least": 0.5,
        "regions": [
            region(1, True, bv_speed=(3.0, 6.0), bv_start=(2.0, 12.0)),
            region(2, False, fog_density=(0.0, 50.0)),
        ],
    }


@pytest.fixture(scope="module")
def found(report, record):
    return replace(report, regions=record)


def inside(data, **box):
    values = {c.name: c.values for c in data.evaluations.parameters}
    held = [(low <= values[name]) & (values[name] <= high) for name, (low, high) in box.items()]
    return np.all(held, axis=0)


def test_a_region_names_the_rows_that_lie_in_it(found):
    one, other = payload(found)["regions"]["regions"]
    held = inside(found, bv_speed=(3.0, 6.0), bv_start=(2.0, 12.0))
    assert 0 < held.sum() < 120
    assert one["rows"] == np.flatnonzero(held).tolist()
    assert other["box"] == {"fog_density": [0.0, 50.0]}
    json.dumps(payload(found), allow_nan=False)


def test_rows_that_failed_are_in_no_region(found):
    e = found.evaluations
    status = np.where(np.arange(120) < 60, 1, 0)
    one, _ = payload(replace(found, evaluations=replace(e, status=status)))["regions"]["regions"]
    held = inside(found, bv_speed=(3.0, 6.0), bv_start=(2.0, 12.0))
    assert one["rows"] == np.flatnonzero(held[60:]).tolist()


@pytest.mark.parametrize(
    "text",
    ["", "[]", "{}", '{"regions": 3}', '{"regions": [{"number": "x"}]}', "[" * 100_000, "\xff"],
)
def test_what_is_no_record_is_one_clear_error(tmp_path, text):
    path = tmp_path / "regions.json"
    path.write_bytes(text.encode("latin-1"))
    with refuses(FileFormatError, "regions.json"):
        read_record(path)


def test_numbers_that_are_none_are_refused_and_no_file_is_no_record(tmp_path, record):
    path = tmp_path / "regions.json"
    assert read_record(path) is None
    path.write_text(json.dumps(record))
    assert read_record(path) == record
    path.write_text(json.dumps(record | {"space_share": float("nan")}))
    with refuses(FileFormatError, "numbers", "NaN"):
        read_record(path)


@pytest.fixture
def page(browser, found, tmp_path):
    write_report(tmp_path / "report.html", found)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.complaints = []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.goto((tmp_path / "report.html").as_uri())
    return page


@pytest.mark.browser
def test_the_page_tells_draws_and_filters(page, found):
    assert page.locator("#regions-body tr").count() == 2
    text = page.inner_text("#regions-body tr:first-child")
    approve(text, "bv_speed", "63", "74", "206")
    page.locator("#scatter").scroll_into_view_if_needed()
    page.select_option("#axis-x", "bv_speed")
    page.select_option("#axis-y", "fog_density")
    page.wait_for_function("bridgegen.scatter.points?.length")
    drawn = "bridgegen.scatter.projections.map(({ x, y }) => [x, y].flat())"
    x, y = (page.evaluate(f"(({{ from, to }}) => [from, to])(bridgegen.scatter.{a})") for a in "xy")
    low, high = page.evaluate("[3, 6].map((value) => bridgegen.scatter.x.within(value))")
    assert x[0] < low < high <= x[1]
    assert page.evaluate(drawn) == [[low, high, *y]]  # only what holds, over all of the other axis

    page.select_option("#list-region", "1")
    held = inside(found, fog_density=(0.0, 50.0))
    critical = (held & found.evaluations.critical).sum()
    counts = "bridgegen.scatter.series.slice(0, 2).map(({ items }) => items.length)"
    page.wait_for_function(f"String({counts}) === '{held.sum() - critical},{critical}'")
    ends = page.evaluate("[0, 50].map((value) => bridgegen.scatter.y.within(value))")
    assert page.evaluate(f"{drawn}[0].slice(2)") == ends  # the chosen one instead
    assert set(page.locator("#list-body td:last-child").all_inner_texts()) <= {"1", "2"}
    pressed = page.locator("#regions-body button[aria-pressed=true]")
    approve(pressed.get_attribute("aria-label"))
    pressed.click()
    assert page.input_value("#list-region") == ""
    assert page.complaints == []
    page.close()


@pytest.mark.browser
def test_without_regions_nothing_is_said(browser, report, tmp_path):
    write_report(tmp_path / "report.html", report)
    page = browser.new_page()
    page.goto((tmp_path / "report.html").as_uri())
    assert not page.is_visible("#regions")
    assert not page.is_visible("#list-region")
    page.close()
