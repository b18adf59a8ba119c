"""What other simulators confirmed, on the page: the section, the table's column, the outlines."""

import json
from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve

from bridgegen.pages import confirmation_payload
from bridgegen.pages.confirmation_payload import confirmations_payload
from bridgegen.pages.page import write_report
from bridgegen.pages.payload import news, payload
from bridgegen.pages.series import unpacked
from bridgegen.results.confirmation.differences import Contact, EntityDivergence, Track
from bridgegen.results.confirmation.record import (
    Change,
    Course,
    Differences,
    Outcome,
    Record,
    Scenario,
)
from bridgegen.scenario.language.thresholds import Thresholds

HOSTILE = '</script><img src=x onerror="window.hacked=1">'


def outcome(critical=True, d_min=0.5, contact=None):
    return Outcome(critical=critical, d_min=d_min, v_d=5.0, n_collision=0.0, F=(0.0,),
                   contact=contact and Contact(contact, "bv"), ends=18.0)  # fmt: skip


def scenario(evaluation, name, there, *, partings=(), tracks=(), why=""):
    here = outcome()
    if there is None:
        return Scenario(evaluation=evaluation, name=name, row="", here=here, failure=why)
    return Scenario(
        evaluation=evaluation, name=name, row="", here=here, there=there,
        change=Change.between(here, there), differences=Differences(partings=partings),
        tracks=tracks, explanation=why,
    )  # fmt: skip


def shifted(p, by, first=40):
    """The other car of a playback, ``by`` metres to the east from an instant on."""
    x, y, h = (getattr(p, name)[1, first : p.n_steps] for name in "xyh")
    return Course.of(Track("bv", first, x + by, y, h))


@pytest.fixture(scope="module")
def record(report):
    """Of the four kept: one confirmed, one not, one not run; and another critical one."""
    a, b, c, _ = report.kept
    rest = {p.evaluation for p in report.kept}
    other = next(i for i in np.flatnonzero(report.evaluations.critical) if i not in rest)
    parts = EntityDivergence("bv", 2.5, 0.6, 0.6, 0.0, 0.1, None, 2.0)
    return Record(
        simulator="esmini",
        label="esmini 3.6",
        settings={},
        reference="embedded",
        run="runs/s4",
        scenario="crossroads-s4",
        ego="route-follower",
        thresholds=Thresholds(),
        objectives=("F",),
        scenarios=(
            scenario(a.evaluation, a.name, outcome(contact=3.0), why="Nobody ever parts."),
            scenario(b.evaluation, b.name, outcome(False, 2.7), partings=(parts,),
                     tracks=(shifted(b, 1.4),), why="d_min is 2.70 m there."),
            scenario(c.evaluation, c.name, None, why=HOSTILE),
            scenario(int(other), None, outcome(d_min=None)),
        ),
    )  # fmt: skip


@pytest.fixture(scope="module")
def found(report, record):
    return replace(report, confirmations=(record,))


def test_the_page_s_data_say_what_the_record_says(found, record):
    data = payload(found)
    (one,) = data["confirmations"]
    assert (one["label"], one["parted_at"], one["without_tracks"]) == ("esmini 3.6", 0.5, 0)
    assert [s["confirmed"] for s in one["scenarios"]] == [True, False, None, True]
    assert one["scenarios"][1]["parts"] == {"entity": "bv", "time": 2.5}
    assert one["scenarios"][2]["there"] is None
    assert one["scenarios"][3]["name"] == f"evaluation {record.scenarios[3].evaluation + 1}"
    approve(one["sentences"][0], "3.6", "95")
    assert data["summary"]["sentences"][-1] == one["sentences"][0]
    json.dumps(data, allow_nan=False)
    assert news(found, 100)["sections"]["confirmations"] == data["confirmations"]


def test_a_track_is_where_it_was_to_the_centimetre(found, report):
    (one,) = payload(found)["confirmations"]
    (track,) = one["scenarios"][1]["tracks"]
    p = report.kept[1]
    assert (track["entity"], track["first"], track["n"]) == ("bv", 40, p.n_steps)
    x = unpacked(track["x"], track["n"], 1) / one["scale"]["x"]
    assert np.isnan(x[:40]).all()
    assert np.abs(x[40:] - p.x[1, 40 : p.n_steps] - 1.4).max() <= 0.005 + 1e-9


def test_where_there_is_no_room_the_most_critical_keep_theirs(found, record, monkeypatch):
    (whole,) = confirmations_payload([record])
    many = record.model_copy(update={"scenarios": (record.scenarios[1],) * 3})
    size = sum(len(run) for name in "xyh" for run in whole["scenarios"][1]["tracks"][0][name])
    monkeypatch.setattr(confirmation_payload, "MOST_NUMBERS", 2 * size)
    (less,) = confirmations_payload([many])
    assert [len(one["tracks"]) for one in less["scenarios"]] == [1, 1, 0]
    assert less["without_tracks"] == 1


def test_confirmed_rows_of_a_long_run_are_on_its_page(found, record, monkeypatch):
    monkeypatch.setattr("bridgegen.pages.payload.ROWS", 10)
    shown = payload(found)["rows"]["evaluation"]
    assert {one.evaluation for one in record.scenarios} <= {*shown}
    assert len(shown) < 30


@pytest.fixture
def page(browser, found, tmp_path):
    write_report(tmp_path / "report.html", found)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.complaints = []
    page.on("pageerror", lambda error: page.complaints.append(str(error)))
    page.on("console", lambda m: page.complaints.append(m.text) if m.type == "error" else None)
    page.goto((tmp_path / "report.html").as_uri())
    yield page
    assert page.complaints == []
    page.close()


@pytest.mark.browser
def test_the_section_tells_each_scenario(page, found):
    text = page.inner_text("#elsewhere")
    approve(text, "3.6")
    rows = page.locator("#elsewhere tbody tr").all_inner_texts()
    assert [("not confirmed" in row, "not run" in row) for row in rows] == [
        (False, False), (True, False), (False, True), (False, False),
    ]  # fmt: skip
    assert "0.50 → 2.70" in rows[1]
    assert "none → 3.00" in rows[0]
    assert "0.50 → ∞" in rows[3]
    assert "bv at 2.50 s" in rows[1]
    approve(rows[1], "d_min", "2.70 m")  # open, for it is not confirmed
    assert "Nobody ever parts." not in rows[0]
    assert HOSTILE in rows[2]
    assert page.evaluate("window.hacked") is None
    assert page.locator("#elsewhere img").count() == 0


@pytest.mark.browser
def test_the_table_has_a_column_and_a_filter(page, found, record):
    signs = """[...document.querySelectorAll("#list-body tr[data-i]")].map((row) =>
      row.lastChild.textContent)"""
    numbers = """[...document.querySelectorAll("#list-body tr[data-i]")].map((row) =>
      Number(row.querySelector("button").ariaLabel.match(/evaluation (\\d+)/)[1]) - 1)"""
    known = {one.evaluation: one.confirmed for one in record.scenarios}
    told = {True: "✓", False: "✗", None: "?"}
    shown = dict(zip(page.evaluate(numbers), page.evaluate(signs), strict=True))
    assert shown == {k: told[known[k]] if k in known else "–" for k in shown}
    assert {*known} <= {*shown}
    page.select_option("#list-elsewhere", label="not confirmed in esmini")
    assert page.evaluate(numbers) == [record.scenarios[1].evaluation]
    page.select_option("#list-elsewhere", label="confirmed in esmini")
    assert {*page.evaluate(numbers)} == {k for k, was in known.items() if was}
    page.select_option("#list-elsewhere", label="not run in esmini")
    assert page.evaluate(numbers) == [record.scenarios[2].evaluation]
    page.click("#list-clear")
    assert page.input_value("#list-elsewhere") == ""
    page.click("#list-head [data-by='in esmini'] button")
    assert page.evaluate(signs)[:4] == ["?", "✗", "✓", "✓"]


@pytest.mark.browser
def test_the_playback_shows_where_the_other_one_had_them(page, report):
    p = report.kept[1]
    page.locator("#elsewhere tbody tr:nth-child(2) button").click()
    page.wait_for_function(f"bridgegen.state()?.scenario === {json.dumps(p.name)}")
    assert page.evaluate("bridgegen.state().index") == 50  # where it parts
    (ghost,) = page.evaluate("bridgegen.state().elsewhere")
    assert (ghost["simulator"], ghost["entity"]) == ("esmini", 1)
    assert ghost["x"] == pytest.approx(p.x[1, 50] + 1.4, abs=0.006)
    assert ghost["y"] == pytest.approx(p.y[1, 50], abs=0.006)
    assert ghost["off"] == pytest.approx(1.4, abs=0.006)
    assert "bv 1.4 m elsewhere in esmini" in page.inner_text("#now")
    assert "where esmini 3.6 has them" in page.inner_text("#legend")
    drawn = "document.getElementById('scene').toDataURL()"
    before = page.evaluate(drawn)
    page.focus("#scene")
    page.keyboard.press("g")
    assert page.evaluate("bridgegen.state().elsewhere") == []
    assert page.evaluate(drawn) != before
    page.click("#elsewhere-button")
    assert page.evaluate(drawn) == before
    page.evaluate("bridgegen.seek(10)")  # nobody was off yet
    assert page.evaluate("bridgegen.state().elsewhere") == []
    page.evaluate("bridgegen.select(0)")
    assert not page.is_visible("#elsewhere-button")


@pytest.mark.browser
def test_without_a_confirmation_nothing_is_said(browser, report, tmp_path):
    write_report(tmp_path / "report.html", report)
    page = browser.new_page()
    page.goto((tmp_path / "report.html").as_uri())
    assert not page.is_visible("#elsewhere")
    assert not page.is_visible("#list-elsewhere")
    assert page.locator("#list-head th").count() == 5
    page.close()
