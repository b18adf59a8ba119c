"""Types of crashes on the dashboard: where drivers fail, by how common such crashes are."""

import re
from dataclasses import replace

import bridgegen as bg
from bridgegen.jobs.dashboard.crash_types import FEWEST, crash_types
from bridgegen.jobs.dashboard.modes import Decisions, failure_modes
from bridgegen.jobs.dashboard.page import banner, write_page
from bridgegen.jobs.dashboard.verdicts import standings
from bridgegen.search.triage.record import Estimate

RARE = Estimate(drawn="fresh", rows=256, harmful=1, share=1 / 256, low=0.0, high=0.02)


def results_of(result):
    """Return results of four scenarios, one of which fails, and one rarely."""
    return [
        result("cut-in", modes=("front-to-rear striking",)),
        result("road-works"),
        result("pedestrian-at-night", modes=("road departure",)),
        result("crossroads-s1"),
        result("bus-pulls-out", space=RARE),
        result("mine.yaml", modes=("crossing",)),
    ]


def types_of(results):
    modes = failure_modes(results, Decisions({}))
    return crash_types(standings(results, [mode for mode in modes if mode.fails_now]))


def test_a_failure_counts_in_the_types_of_its_kind_alone(result):
    found = types_of(results_of(result))
    lines = {kind.id: each["stack"] for kind, each in found.lines}
    assert {id: standing.verdict for id, standing in lines.items()} == {
        "18": "fails",  # changing lanes: cut-in fails in it, and road-works does not
        "11": "not judged",  # pedestrian: the ego left the road, and hit nobody
        "30": "no failure found",
        "17": "not judged",  # nobody knows in which conflict a random draw failed
    }
    assert next(iter(lines)) == "18"  # failures first
    assert lines["18"].scenarios == ("cut-in", "road-works")
    assert lines["11"].otherwise == ("pedestrian-at-night",)
    # 5.69 % of the crashes in type 18; 100.02 % less those of the four types.
    assert found.sentence("stack") == (
        "stack fails in 1 of 4 types of crashes that scenarios tried, with 5.7 % of the crashes; "
        "33 of 37 types, with 89 % of the crashes, were not tried."
    )


def test_few_scenarios_are_no_typology(result):
    some = results_of(result)
    assert types_of(some[:FEWEST]) is not None
    assert types_of([*some[: FEWEST - 1], some[-1]]) is None


def test_random_draws_that_fail_are_no_all_clear(project, result, tmp_path):
    found = bg.build_dashboard(project, out=tmp_path / "a.html")
    assert 'id="types"' not in found.page.read_text("utf-8")
    runs = (result("bus-pulls-out", space=RARE),)
    project = replace(found.project, runs=runs, suites=(), problems=())
    found = replace(found, modes=(), requirements=(), project=project)
    assert (banner(found).kind, banner(found).word) == ("fails", "FAILS")
    write_page(found)
    text = found.page.read_text("utf-8")
    assert "FAILS rarely" in text
    assert "1 of 256 random draws" in text
    assert "In bus-pulls-out, random draws alone fail." in text


def test_the_page_weighs_by_type_and_says_what_a_share_is_not(project, result, tmp_path):
    found = bg.build_dashboard(project, out=tmp_path / "a.html")
    some = results_of(result)
    modes = tuple(failure_modes(some, Decisions({})))
    project = replace(found.project, runs=tuple(some), suites=())
    found = replace(found, modes=modes, project=project)
    assert "stack fails in 1 of 4 types of crashes" in banner(found).text
    write_page(found)
    text = found.page.read_text("utf-8")
    section = re.search(r'<section id="types">.*?</section>', text, re.DOTALL)[0]
    words = " ".join(re.sub(r"<[^>]*>", " ", section).split())
    assert "✕ FAILS in 1 of 2 scenarios cut-in, not in road-works worst MAIS3+" in words
    assert "other or rare failures alone in pedestrian-at-night" in words
    assert "human drivers" in words
    assert "Shares of harm by type are not known." in words
    assert "not read: the report itself" in words
    assert "lead vehicle stopped (16 %)" in words
