"""How far a run's screen agrees, in words."""

from dataclasses import replace
from types import SimpleNamespace

import pytest
from tests.approval import approve

from bridgegen.pages.screened_payload import in_a_line, place_in_words, screened_payload, sentences
from bridgegen.scenario.language.reader import load
from bridgegen.search.screened import NOTE, Agreement
from bridgegen.search.screened.agreement import Place

FOUND = Agreement(
    screen="embedded", simulator="esmini", screen_evaluations=5923, screen_budget=6000,
    compared=300, both=40, screen_only=10, simulator_only=2, rank_correlation=0.814,
    false_early=8, false_late=2, place=Place("bv_speed", 2 / 3, 1.0, 0.21, 0.034),
)  # fmt: skip


@pytest.fixture(scope="module")
def space():
    return load("crossroads-s1").space(None, {})


def test_every_figure_is_said(space):
    assert sentences(FOUND) == [
        "embedded made 5,923 of 6,000 evaluations; 300 scenarios ran in both simulators.",
        "Of 50 that are critical in embedded, 40 are critical in esmini; of 250 others, 2.",
        "Rank correlation of the objectives: 0.81.",
        "Critical in embedded only: 8 in the first half of them, 2 in the second.",
    ]
    approve(in_a_line(FOUND), "5,923", "40", "0.81")
    payload = screened_payload({NOTE: FOUND.to_dict(), "boxes": []}, space)
    assert payload["counts"] == [[40, 10], [2, 248]]
    assert payload["sentences"][:-1] == sentences(FOUND)


def test_the_place_is_in_the_parameter_s_unit(space):
    free = next(n for n in space.variables if not (space.bounds[n] or space.parameters[n].prior))
    one = space.parameters[free]
    edge = one.low + (one.high - one.low) * 2 / 3
    said = place_in_words(replace(FOUND, place=Place(free, 2 / 3, 1.0, 0.21, 0.034)), space)
    approve(said, f"{free} ≥ {edge:.4g}", "0.21", "0.034")
    approve(place_in_words(FOUND), "highest")
    assert place_in_words(replace(FOUND, place=None), space) == ""


def test_a_screen_that_was_given_up(space):
    changes = {"ended_after": 24, "ended_because": "it fails", "rank_correlation": None}
    found = replace(FOUND, **changes)
    approve(sentences(found), "24")
    assert any("undefined" in one for one in sentences(found))
    approve(in_a_line(found), "24")


def test_nothing_was_compared():
    nothing = Agreement("a", "b", 5, 9, 0, 0, 0, 0, None, 0, 0)
    assert len(sentences(nothing)) == 1


def test_a_run_without_a_screen_has_no_section(space):
    assert screened_payload({"boxes": []}, space) is None


def test_the_summary_has_a_line(capsys):
    from bridgegen.cli.terminal.search import screen_rows

    assert screen_rows(SimpleNamespace(screened=None)) == []
    assert screen_rows(SimpleNamespace(screened=FOUND)) == [("screen", in_a_line(FOUND))]
