"""Conflicts, failure modes and implausible rows, as the page has them."""

from dataclasses import replace

import numpy as np
import pytest
from tests.approval import approve, refuses

from bridgegen.assess.conflict.findings import Findings
from bridgegen.assess.conflict.summary import ConflictSummary
from bridgegen.assess.objective import Objective
from bridgegen.pages import payload, sentences
from bridgegen.pages.build import rule_in_words
from bridgegen.pages.data import Column
from bridgegen.pages.findings_payload import (
    FINDING_FIELDS,
    conflict_payload,
    findings_payload,
    implausible_payload,
    triage_payload,
)
from bridgegen.pages.playback import Conflict
from bridgegen.search.triage.record import (
    Bound,
    Estimate,
    Least,
    Minimal,
    Mode,
    Neighbourhood,
    Treatment,
    Triage,
)

SPACE = Estimate(drawn="fresh", rows=200, harmful=10, share=0.05, low=0.024, high=0.09)
HARMLESS = Estimate(drawn="fresh", rows=200, harmful=0, share=0.0, low=0.0, high=0.02)


def mode(number=1, shown=0, **changes):
    facts = dict(  # noqa: C408
        number=number, title="collides with a car at a crossing", conflict="contact",
        conflict_type="crossing", responsible="ego", rule="signs", cause="planning", tested=True,
        partner="car", place="in the junction", count=7, space=SPACE, harm=0.7, severity=0.25,
        worst=shown, shown=shown, robustness=0.75, examples=(shown,), exports=("0001",),
        minimal=Minimal(
            name="minimal-01", x=(1.0,), noise_key="7", values={"a": 1.0}, conditions=(),
            sentence="needs a >= 1 m; all else nominal", rows=32, harmful=20, robustness=0.625,
            harm=0.6, severity=0.1,
        ),
    )  # fmt: skip
    return Mode(**facts | changes)


def treatment(name, cause, gone, low, high):
    return Treatment(name=name, cause=cause, rows=32, gone=gone, new=0, drop=gone / 32,
                     low=low, high=high)  # fmt: skip


def triage(*modes, evaluations=120, harmful=40):
    fixes = (
        treatment("ideal perception", "perception", 1, -0.05, 0.1),
        treatment("un-r157 drives", "planning", 24, 0.5, 0.9),
    )
    near = Neighbourhood(
        evaluation=modes[0].shown if modes else 0, rows=32, harmful=24, robustness=0.75, low=0.6,
        high=0.9, cause="planning", fixes=fixes, placebo=treatment("random move", "", 2, -0.1, 0.2),
    )  # fmt: skip
    return Triage(
        scenario="crossroads-s4", ego="route-follower", count="ego", results="0" * 64, seed=0,
        neighbours=32, radius=0.025, sampled=0,
        bound=Bound(
            evaluations=evaluations, failed=0, implausible=0, harmful=harmful,
            space=SPACE if harmful else HARMLESS,
            least=(Least(quantity="d_min", value=1.5, unit="m", evaluation=3),),
            sentence="At most 2 % of the space is harmful (95 %).",
        ),
        modes=modes, neighbourhoods=(near,) if modes else (),
    )  # fmt: skip


def findings(n, **columns):
    none = Findings.none(n)
    return replace(none, **{k: np.array(v, dtype=object) for k, v in columns.items()})


def test_findings_are_numbers_of_distinct_keys():
    told = findings(4, conflict=["contact", "", "contact", "contact"], partner=["a", "", "b", "a"])
    found = findings_payload(told, np.array([True, True, True, True]))
    assert len(found["keys"]) == 3
    back = [dict(zip(FINDING_FIELDS, found["keys"][k], strict=True)) for k in found["at"]]
    assert [one["partner"] for one in back] == ["a", "", "b", "a"]
    assert findings_payload(told, np.array([False, True, False, True]))["at"] == [0, 1]


def test_implausible_rows_are_counted_by_reason():
    told = findings(5, implausible=["", "overlap", "skid", "overlap", ""])
    assert implausible_payload(told) == {"count": 3, "reasons": [["overlap", 2], ["skid", 1]]}
    assert implausible_payload(None) == {"count": 0, "reasons": []}


def test_a_mode_has_its_fix_and_its_placebo():
    (told,) = triage_payload(triage(mode()))["modes"]
    assert (told["rows"], told["harmful"]) == (32, 24)
    assert told["fix"] == {"name": "un-r157 drives", "rows": 32, "drop": 0.75, "low": 0.5,
                           "high": 0.9}  # fmt: skip
    assert told["placebo"]["drop"] == 2 / 32
    assert told["minimal"]["sentence"].startswith("needs a")
    assert not told["knife_edge"]


def test_nothing_found_has_its_bound(report):
    told = triage_payload(triage())
    assert told["modes"] == []
    assert told["bound"]["least"][0]["value"] == 1.5
    e = replace(report.evaluations, critical=np.zeros(120, bool))
    quiet = replace(report, evaluations=e, triage=triage(harmful=0),
                    summary=replace(report.summary, n_critical=0))  # fmt: skip
    approve(sentences.sentences(quiet)[-1], "95")


@pytest.fixture
def harmful(report):
    """The report with harm: near misses first by F, contacts by harm."""
    n = 120
    conflict = ["contact" if k % 2 else "near miss" for k in range(n)]
    harm = np.where(np.arange(n) % 2 == 1, 0.6 + np.arange(n) / 1000, 0.3 + np.arange(n) / 1000)
    severity = np.where(np.arange(n) % 2 == 1, 0.25, 0.0)
    e = replace(
        report.evaluations, critical=np.arange(n) < 40,
        metrics=(*report.evaluations.metrics, Column("harm", "1", harm),
                 Column("severity", "1", severity)),
        findings=findings(n, conflict=conflict, conflict_type=["crossing"] * n,
                          responsible=["ego"] * n, rule=["signs"] * n, partner=["bv"] * n),
    )  # fmt: skip
    s = replace(report.summary, harm="harm", n_critical=40, critical_distance=None)
    return replace(report, evaluations=e, summary=s, triage=triage(mode(shown=1)))


def test_no_near_miss_ranks_above_a_contact(harmful):
    told = payload.payload(harmful)["rows"]
    rank = np.array(told["rank"])
    conflict = [told["findings"]["keys"][k][0] for k in told["findings"]["at"]]
    contacts = [r for r, kind in zip(rank, conflict, strict=True) if r and kind == "contact"]
    near = [r for r, kind in zip(rank, conflict, strict=True) if r and kind == "near miss"]
    assert sorted(contacts) == list(range(1, 21))
    assert sorted(near) == list(range(21, 41))


def test_by_thresholds_collisions_come_first_then_the_most_severe_then_the_paper_s_order(harmful):
    papers = replace(harmful, summary=replace(harmful.summary, harm=""))
    e = papers.evaluations
    values = {c.name: c.values[:40] for c in (*e.metrics, *e.objectives)}
    rank = np.array(payload.payload(papers)["rows"]["rank"])[:40]
    keys = [
        (-int(n > 0), -severity, F)
        for n, severity, F in zip(
            values["n_collision"], values["severity"], values["F"], strict=True
        )
    ]
    assert 0 < sum(first for first, _, _ in keys) + 40 < 40  # some collide, some do not
    assert [keys[i] for i in np.argsort(rank)] == sorted(keys)


def test_the_text_names_modes_collisions_and_severity(harmful):
    said = " ".join(sentences.sentences(harmful))
    approve(said, "route-follower", "20", "25.0")
    table = dict(sentences.summary_table(harmful))
    assert table["Critical: collisions"] == "20"
    assert table["Critical: near misses"] == "20"
    assert not any("d_min" in name for name in table)


def test_what_could_not_happen_is_said(harmful):
    told = replace(harmful.evaluations.findings,
                   implausible=np.array(["overlap"] * 12 + [""] * 108, dtype=object))  # fmt: skip
    data = replace(harmful, evaluations=replace(harmful.evaluations, findings=told))
    assert any(one.startswith("12 scenarios (10.0") for one in sentences.sentences(data))
    assert payload.payload(data)["implausible"] == {"count": 12, "reasons": [["overlap", 12]]}


def test_findings_are_as_many_as_rows(report):
    with refuses(ValueError, "findings", "120"):
        replace(report.evaluations, findings=Findings.none(3))


def conflict(**changes):
    facts = dict(  # noqa: C408
        conflict="contact", sentence="A collision with bv.", partner="bv", type="crossing",
        type_source="NHTSA", responsible="ego", rule="signs", rule_says="signs give priority",
        rule_source="StVO § 8", zone_ego="front", zone_other="left side", preventable=True,
        time=4.0, decided=2.5, left=1.5, ttc=0.0, needed_deceleration=float("inf"),
        closing_normal=8.0, closing_tangential=1.0, v_ego=8.0, v_other=3.0, stood_ego=0.0,
        stood_other=0.0, overlap=0.5, delta_v_ego=4.0, delta_v_other=4.0, severity=0.12, harm=0.65,
    )  # fmt: skip
    return Conflict(ConflictSummary(**facts | changes), 1, 80, 50, (1, 3))


def test_a_scenario_s_conflict_has_its_instants_and_zones():
    told = conflict_payload(conflict())
    assert (told["instant"], told["decided"], told["zones"]) == (80, 50, [1, 3])
    assert told["numbers"]["severity"] == [0.12, "1"]
    assert told["numbers"]["needed_deceleration"] == [None, "m/s²"]
    assert told["rule_source"] == "StVO § 8"
    assert told["sentence"] == conflict().summary.sentence
    judged = conflict_payload(conflict(), "planning")
    approve(judged["sentence"], "planning")
    assert judged["sentence"].startswith(judged["bare"])


def test_what_is_critical_in_words():
    paper = Objective(("d_min",), (1.0,))
    assert "d_min below 2 m" in rule_in_words(paper)
    harm = Objective(("harm",), (1.0,), rule="harm")
    assert "d_min" not in rule_in_words(harm)
    assert "responsible" in rule_in_words(harm)
    everybody = Objective(("harm_any",), (1.0,), rule="harm", count="any")
    approve(rule_in_words(everybody), "responsible")


# -- in a browser ----------------------------------------------------------------------------------


@pytest.fixture
def page(browser, harmful, tmp_path):
    from bridgegen.pages.page import write_report

    kept = tuple(replace(one, evaluation=k, conflict=conflict()) for k, one in
                 enumerate(harmful.kept))  # fmt: skip
    simplest = replace(kept[1], name="minimal-01")
    found = triage(mode(shown=1), mode(number=2, shown=0, rule="red light"))
    data = replace(harmful, kept=kept, minimal=(simplest,), triage=found)
    write_report(tmp_path / "report.html", data)
    page = browser.new_page(viewport={"width": 1280, "height": 900})
    errors = []
    page.on("pageerror", lambda error: errors.append(str(error)))
    page.goto((tmp_path / "report.html").as_uri())
    yield page
    page.close()
    assert errors == []


def _unfold(page):
    """Show the details of the first failure mode."""
    button = page.locator(".mode").first.get_by_role("button", name="Details of mode 1")
    button.click()
    assert button.get_attribute("aria-expanded") == "true"


@pytest.mark.browser
def test_verdict_modes_and_playback_are_the_first_screen(page):
    """At 1280×720: the verdict, the first failure mode, and the worst scenario, which plays."""
    page.set_viewport_size({"width": 1280, "height": 720})
    page.reload()
    for name in ("#modes-title", "#modes-lead", ".mode >> nth=0", "#scene", "#play"):
        box = page.locator(name).bounding_box()
        assert box["y"] >= 0.0
        assert box["y"] + box["height"] <= 720.0, name
    assert page.evaluate("bridgegen.state().playing")


@pytest.mark.browser
def test_the_contents_lead_to_each_section(page):
    names = page.locator("#contents button").all_inner_texts()
    assert names[:2] == ["Failures", "Result"]
    page.locator("#contents button", has_text="Coverage").click()
    page.wait_for_function("document.getElementById('coverage').getBoundingClientRect().top < 300")
    page.wait_for_function(
        "document.querySelector('#contents [aria-current]').textContent === 'Coverage'"
    )


@pytest.mark.browser
def test_the_page_leads_with_the_failure_modes(page):
    first = page.locator("main h2:visible").first
    assert first.get_attribute("id") == "modes-title"
    assert page.locator("#modes-title").inner_text() == "2 ways in which route-follower fails"
    _unfold(page)
    card = page.locator(".mode").first.inner_text()
    for words in ("7 scenarios", "25\u202f% worst severity", "24 of 32 neighbours harmful",
                  "5.0\u202f% of the space", "If un-r157 drives, the harmful share",
                  "drops by 75 percentage points",
                  "Simplest form: needs a ≥ 1 m"):  # fmt: skip
        assert words in card


@pytest.mark.browser
def test_a_mode_plays_its_worst_scenario_and_its_simplest_form(page):
    page.locator(".mode").first.get_by_role("button", name="Play 0002, mode 1").click()
    page.wait_for_function("document.getElementById('scene-name').textContent === '0002'")
    _unfold(page)
    page.locator(".mode").first.get_by_role("button", name="Play the simplest form").click()
    page.wait_for_function("document.getElementById('scene-name').textContent === 'minimal-01'")
    assert "simplest form" in page.locator("#measures h3").first.inner_text()


@pytest.mark.browser
def test_its_scenarios_narrows_the_table_and_lifts_again(page):
    note = page.locator("#list-note")
    assert note.inner_text() == "40 critical scenarios"
    _unfold(page)
    button = page.locator(".mode").first.get_by_role("button", name="Its scenarios")
    button.click()
    assert note.inner_text() == "20 of 40 critical scenarios"
    assert button.get_attribute("aria-pressed") == "true"
    button.click()
    assert note.inner_text() == "40 critical scenarios"


@pytest.mark.browser
def test_the_playback_shows_sentence_and_instants(page):
    page.evaluate("window.bridgegen.select(0)")
    assert page.locator("#conflict").inner_text() == "A collision with bv."
    titles = page.locator("#ticks i").evaluate_all("all => all.map((one) => one.title)")
    assert titles == ["decided at 2.50 s", "collision at 4.00 s"]
    assert page.evaluate("window.bridgegen.state().index") == 80
    page.locator("#scene").focus()
    page.keyboard.press("t")
    assert page.evaluate("window.bridgegen.state().index") == 50
    assert page.locator("#flag").inner_text() == "decided here"


@pytest.mark.browser
def test_the_table_has_the_conflict_s_columns(page):
    heads = page.locator("#list-head th").evaluate_all("all => all.map((one) => one.dataset.by)")
    assert heads[:7] == ["rank", "conflict", "type", "responsible", "partner", "severity", "harm"]
    page.locator("#list-head th[data-by=severity] button").click()
    page.locator("#list-head th[data-by=severity] button").click()
    page.evaluate("document.getElementById('list-scroll').scrollTop = 0")
    page.wait_for_function(
        "document.querySelector('#list-body tr[data-i]').textContent.includes('collision')"
    )
    first = page.locator("#list-body tr[data-i]").first.inner_text()
    assert "25\u202f%" in first
    page.locator("#list-head th[data-by=conflict] button").click()
    page.locator("#list-head th[data-by=conflict] button").click()
    page.evaluate("document.getElementById('list-scroll').scrollTop = 0")
    page.wait_for_function(
        "document.querySelector('#list-body tr[data-i]').textContent.includes('near miss')"
    )


@pytest.mark.browser
def test_where_nothing_was_found_the_nearest_scenario_plays(browser, report, tmp_path):
    from bridgegen.pages.page import write_report

    near = replace(report.kept[0], name="evaluation 4", evaluation=3, files=(), critical=False)
    e = replace(report.evaluations, critical=np.zeros(120, bool))
    quiet = replace(
        report, evaluations=e, kept=(), more=(near,), triage=triage(harmful=0),
        summary=replace(report.summary, n_critical=0),
    )  # fmt: skip
    write_report(tmp_path / "quiet.html", quiet)
    page = browser.new_page(viewport={"width": 1280, "height": 720})
    page.goto((tmp_path / "quiet.html").as_uri())
    assert page.locator("#modes-title").inner_text() == "No failure found"
    assert "At most 2 % of the space" in page.locator("#modes-lead").inner_text()
    assert "Evaluation 4, which came nearest" in page.locator("#modes-note").inner_text()
    page.wait_for_function("document.getElementById('scene-name').textContent === 'evaluation 4'")
    page.wait_for_function("bridgegen.state().playing && bridgegen.state().position > 0")
    button = page.locator("#play").bounding_box()
    assert button["y"] + button["height"] < 720  # on the first screen
    assert page.locator("#list").is_hidden()
    bound = quiet.triage.bound.model_copy(update={"space": SPACE})
    drawn = replace(quiet, triage=quiet.triage.model_copy(update={"bound": bound}))
    write_report(tmp_path / "drawn.html", drawn)
    page.goto((tmp_path / "drawn.html").as_uri())
    title = page.locator("#modes-title").inner_text()
    approve(title)
    page.close()
