"""What an algorithm learnt, as tables."""

import json
from dataclasses import replace

import pytest
from tests.approval import approve

from bridgegen.pages.notes import MOST, NoteTable, box_in_words, tables
from bridgegen.pages.page import write_report
from bridgegen.pages.payload import payload
from bridgegen.scenario.language.reader import load


@pytest.fixture(scope="module")
def space():
    return load("crossroads-s4").space(["participants", "weather"])


def test_records_are_a_table_and_single_values_another(space):
    notes = {
        "filled": 3,
        "trees": [{"tree": 1, "share": 0.25}, {"tree": 2, "sure": True}],
        "score": None,
    }
    assert tables(notes, space) == (
        NoteTable("In short", ("", "value"), (("filled", "3"), ("score", "–"))),
        NoteTable("trees", ("tree", "share", "sure"), (("1", "0.25", ""), ("2", "", "yes"))),
    )
    assert tables({}, space) == ()


def test_of_a_long_table_the_page_has_the_beginning(space):
    (table,) = tables({"t": [{"n": n} for n in range(MOST + 7)]}, space)
    assert table.left_out == 7
    assert table.rows[-1] == (f"{MOST - 1}",)
    assert len(table.rows) == MOST


def test_a_box_is_told_in_units_where_nothing_limits_the_parameter(space):
    free = space.parameters["bv_trigger_distance"]
    assert not space.bounds["bv_trigger_distance"]
    middle = f"{(free.low + free.high) / 2:.4g}"
    assert box_in_words({free.name: [0.5, 1.0]}, space) == f"{free.name} ≥ {middle} m"
    assert box_in_words({free.name: [0.0, 0.5]}, space) == f"{free.name} ≤ {middle} m"
    assert space.bounds["cloudiness"]
    told = box_in_words({"cloudiness": [0.25, 0.5], free.name: [0.5, 0.5]}, space)
    approve(told, "25.0", "50.0")
    assert box_in_words({}, space) == "anywhere"


@pytest.mark.parametrize(
    ("box", "told"),
    [
        ({"cloudiness": [0.5, 1.0]}, "cloudiness ≥ 50.0 % of what is left to it"),
        ({"clouds": [0.5, 1.0]}, "clouds: 0.5, 1"),
        ({"cloudiness": [0.5]}, "cloudiness: 0.5"),
        ({"cloudiness": [20, 30]}, "cloudiness: 20, 30"),
        ("none", "none"),
    ],
)
def test_what_is_no_box_of_the_space_is_told_as_it_is(space, box, told):
    (table,) = tables({"boxes": [{"box": box}]}, space)
    assert table.rows == ((told,),)


def test_the_page_holds_them(report, tmp_path):
    table = NoteTable("critical boxes", ("tree", "box"), (("1", "fog ≥ 61 <%>"),), 4)
    told = payload(replace(report, notes=(table,)))
    assert json.loads(json.dumps(told["notes"])) == [
        {
            "title": "critical boxes",
            "columns": ["tree", "box"],
            "rows": [["1", "fog ≥ 61 <%>"]],
            "left_out": 4,
        }
    ]
    assert payload(report)["notes"] == []


@pytest.mark.browser
def test_the_page_shows_them(browser, report, tmp_path):
    table = NoteTable("critical boxes", ("tree", "box"), (("1", "fog ≥ 61 <%>"),), 4)
    write_report(tmp_path / "with.html", replace(report, notes=(table,)))
    write_report(tmp_path / "without.html", report)
    page = browser.new_page()
    page.goto((tmp_path / "with.html").as_uri())
    assert page.locator("#notes td").all_inner_texts() == ["1", "fog ≥ 61 <%>"]
    assert "4 more" in page.locator("#notes").inner_text()
    page.goto((tmp_path / "without.html").as_uri())
    assert page.locator("#notes").is_hidden()
    page.close()
