"""The page of a suite: its words, what it holds of each variation, its size, hostile texts."""

import base64
import json
import re
import shlex
import subprocess
import sys
import zlib
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from tests.approval import approve
from tests.results.test_failures import failure

from bridgegen.jobs.suite import page
from bridgegen.jobs.suite.difference import KINDS, in_order, suite_difference
from bridgegen.jobs.suite.difference import difference as variations_compared
from bridgegen.jobs.suite.page import FILE, write_suite_page
from bridgegen.jobs.suite.page_payload import payload
from bridgegen.jobs.suite.results import EntryResult, RowResult
from bridgegen.jobs.suite.sentences import difference, differences, headline
from bridgegen.jobs.suite.suite import SuiteRun, evaluate_suite
from bridgegen.pages.playback import Entity, Playback
from bridgegen.pages.playbacks import diverged_at
from bridgegen.pages.thumbnails import read_thumbnails
from bridgegen.results.failures import read_failures, write_failures

CRITERIA = {"criteria": ["C-1: always(ego.v < 12 m/s)"]}
HIT = RowResult(critical=True, harm=0.5, severity=0.1, collisions=1.0, d_min=0.0)
KEPT = RowResult(d_min=3.0)
LOST = RowResult(problem="it diverges")
JUMP = RowResult(collisions=1.0, d_min=0.0, implausible="jump", margins=[1.0])


def result(entry: str, ego: str = "", rows: tuple[RowResult, ...] = (), **more: Any) -> EntryResult:
    return EntryResult(
        entry=entry, ego=ego, digest="", scenario=f"{entry}.xosc", driver=ego or "reference",
        rows=list(rows), **more,
    )  # fmt: skip


def suite_of(*results: EntryResult, folder: Any = "suites/some") -> SuiteRun:
    egos = tuple(dict.fromkeys(one.ego for one in results))
    return SuiteRun(Path(folder), egos, results, {})


def unpacked(text: str) -> Any:
    return json.loads(zlib.decompress(base64.b64decode(text)))


def data_of(text: str) -> dict[str, Any]:
    (found,) = re.findall(r'<script type="application/json" id="data">(.*?)</script>', text, re.S)
    return json.loads(found)


# ---- words ----


@pytest.mark.parametrize(
    ("rows", "words"),
    [
        ([(KEPT,), (KEPT,)], "ref passes all 2 scenarios"),
        ([(KEPT,)], "ref passes 1 of 1 scenario"),
        ([(KEPT, KEPT), (KEPT,)], "ref passes all 2 scenarios (3 variations)"),
        ([(KEPT, HIT), (KEPT,)], "ref passes 1 of 2 scenarios (2 of 3 variations) and fails 1"),
        ([(KEPT,), ()], "ref passes 1 of 2 scenarios; 1 did not run"),
        ([(KEPT, JUMP), (JUMP,)], "ref passes 1 of 2 scenarios (1 of 3 variations); 1 is not "
                                  "judged"),
        ([(KEPT, LOST)], "ref passes 0 of 1 scenario (1 of 2 variations); 1 ran only in part"),
        ([(LOST, HIT), (LOST,)], "ref passes 0 of 2 scenarios (0 of 3 variations) and fails 1; "
                                 "1 did not run"),
    ],
)  # fmt: skip
def test_the_headline_counts_scenarios_and_variations(rows, words):
    results = [result(f"e{k}", rows=some) for k, some in enumerate(rows)]
    assert headline(results, "ref") == words


def test_own_drivers_are_many():
    approve(headline([result("a", rows=(HIT,))], "the scenarios' own drivers"))


@pytest.mark.parametrize(
    ("verdicts", "words"),
    [
        (("failed", "failed"), ""),
        (("failed", "passed"), "only A fails"),
        (("not run", "failed"), "B fails; A did not run"),
        (("passed", "failed", "failed"), "only A passes"),
        (("not judged", "passed", "not judged"), "B passes; A, C are not judged"),
        (("failed", "not judged"), "A fails; B is not judged"),
        (("passed", "failed", "passed"), "only B fails"),
        (("passed", "failed", "failed", "passed"), "B, C fail; A, D pass"),
    ],
)
def test_differences_of_egos_are_said(verdicts, words):
    assert difference(verdicts, "ABCD"[: len(verdicts)]) == words


def test_agreement_is_counted_too():
    of = [("failed", "passed")] * 2 + [("passed", "passed")] * 3 + [("not run", "not run")]
    approve(differences(of, "AB"))
    assert differences([("failed",)], "A") == ""


# ---- data ----


def test_the_failed_variations_are_first_and_keep_their_numbers():
    rows = (KEPT, LOST, HIT, HIT.model_copy(update={"harm": 0.9, "x": [7.123456789]}))
    one = result("a", rows=rows, parameters=["speed"], units=["m/s"])
    found = payload(suite_of(one), {}, {})["suite"]
    assert found["entries"][0]["results"] == [
        {"v": "f", "n": [1, 2, 1, 0], "problem": "it diverges", "severity": 0.1,
         "conflict": ["", "", ""]}
    ]  # fmt: skip
    details = unpacked(found["details"][0])["results"][0]
    assert (details["at"], details["verdict"], details["worst"]) == ([3, 2, 1, 0], "ffnp", 3)
    assert details["x"] == [[7.12346, None, None, None]]
    assert details["d_min"] == [0.0, 0.0, None, 3.0]


def test_what_is_not_judged_has_its_reason_and_meets_no_criterion():
    criterion = {"id": "R-1", "formula": "ttc >= 1.5 s"}
    one = result("a", rows=(JUMP, JUMP, KEPT), criteria=[criterion])
    two = result("b", rows=(KEPT,), not_happened=["stuck in 1 of 1"])
    found = payload(suite_of(one, two), {}, {})["suite"]
    assert [each["results"][0] for each in found["entries"]] == [
        {"v": "u", "n": [1, 0, 0, 2],
         "unjudged": "only 1 of 3 variations could be judged: 2 × implausible traffic (jump)"},
        {"v": "u", "n": [0, 0, 0, 1],
         "unjudged": "the scenario did not happen: stuck in 1 of 1"},
    ]  # fmt: skip
    details = unpacked(found["details"][0])
    assert details["results"][0]["verdict"] == "uup"
    assert [details["words"][k] for k in details["results"][0]["note"]] == ["jump", "jump", ""]
    assert found["criteria"][0]["of"] == [{"entries": [0, 0, 1], "rows": [0, 0, 3]}]


def test_criteria_are_counted_by_ego():
    criterion = {"id": "R-1", "formula": "ttc >= 1.5 s", "severity": "critical"}
    other = {"id": "R-1", "formula": "ttc >= 9 s"}  # of another file: another requirement
    bad, good = (
        KEPT.model_copy(update={"margins": [-1e-9]}),
        KEPT.model_copy(update={"margins": [2.0]}),
    )
    suite = suite_of(
        result("a", "A", (bad, good, LOST), criteria=[criterion]),
        result("a", "B", (good,), criteria=[criterion]),
        result("b", "A", (good,), criteria=[other]),
        result("b", "B", (), criteria=[other]),
    )
    found = payload(suite, {}, {})["suite"]
    first, second = found["criteria"]
    assert (first["formula"], first["severity"]) == ("ttc >= 1.5 s", "critical")
    assert first["of"] == [
        {"entries": [1, 0, 0], "rows": [1, 1, 1]}, {"entries": [0, 1, 0], "rows": [0, 1, 0]},
    ]  # fmt: skip
    assert (second["formula"], second["severity"]) == ("ttc >= 9 s", "major")
    assert [one["entries"] for one in second["of"]] == [[0, 1, 0], [0, 0, 1]]
    assert found["entries"][0]["results"][0]["violated"] == [0]
    assert found["entries"][0]["differ"] == "only A fails"
    details = unpacked(found["details"][0])["results"]
    assert details[0]["margins"] == [[-1e-9, None, 2.0]]  # rounding keeps the sign
    assert details[1]["beside"] == []  # not the same variations


def test_a_known_failure_is_told_from_a_new_one(tmp_path):
    hit = HIT.model_copy(update={"conflict": "contact", "conflict_type": "turning",
                                 "responsible": "ego"})  # fmt: skip
    named = {id: failure(id, type="turning") for id in ("a", "b", "c")}
    named["a"] = named["a"].model_copy(update={"status": "known", "comment": "<b> JIRA-3"})
    named["c"] = named["c"].model_copy(update={"status": "fixed"})
    write_failures(read_failures(tmp_path), named)
    made = [
        one.model_copy(update={"scenario": str(tmp_path / one.scenario)})
        for one in (result(id, rows=(hit,)) for id in "abcd")
    ]
    found = payload(suite_of(*made), {}, {})["suite"]
    assert found["facts"] == [
        "of the variations that fail, 1 is known or accepted, 2 new, 1 regression"
    ]
    cells = [one["results"][0] for one in found["entries"]]
    stand = [(one.get("standing"), one.get("excused"), one.get("comment")) for one in cells]
    assert stand == [
        ("known failure", True, "<b> JIRA-3"), ("new failure", False, ""),
        ("regression: it was fixed", False, ""), (None, None, None),
    ]  # fmt: skip


def test_egos_are_compared_on_the_same_variations():
    rows = [KEPT.model_copy(update={"x": [value]}) for value in (1.0, 2.0)]
    more = {"parameters": ["v"], "units": ["m/s"]}
    fails = rows[1].model_copy(update={"critical": True})
    suite = suite_of(
        result("a", "A", (rows[0], fails), **more), result("a", "B", tuple(rows), **more)
    )
    first, second = unpacked(payload(suite, {}, {})["suite"]["details"][0])["results"]
    assert (first["at"], first["beside"]) == ([1, 0], ["fp", "pp"])
    assert (second["at"], second["beside"]) == ([0, 1], ["pp", "fp"])


def test_other_variations_are_not_compared():
    first, second = (KEPT.model_copy(update={"x": [value]}) for value in (1.0, 2.0))
    more = {"parameters": ["v"], "units": ["m/s"]}
    suite = suite_of(result("a", "A", (first,), **more), result("a", "B", (second,), **more))
    of_a, of_b = unpacked(payload(suite, {}, {})["suite"]["details"][0])["results"]
    assert (of_a["beside"], of_b["beside"]) == (["p-"], ["-p"])


@pytest.mark.thorough
def test_a_thousand_entries_with_many_variations_fit():
    """Numbers that nothing compresses; each entry keeps its worst."""
    rng = np.random.default_rng(0)
    rows = tuple(
        RowResult(
            x=rng.random(4).tolist(), critical=bool(rng.random() < 0.5), harm=rng.random(),
            severity=rng.random(), d_min=rng.random(), margins=[1.0 + rng.random()],
        )
        for _ in range(400)
    )  # fmt: skip
    names = [f"p{k}" for k in range(4)]
    some = [
        result(
            f"Entry {k}", rows=rows[k % 300 : k % 300 + 100], parameters=names, units=["m/s"] * 4,
            title="A scenario with a title of usual length",
            criteria=[{"id": "R", "formula": "ttc > 1 s"}],
        )
        for k in range(1000)
    ]  # fmt: skip
    data = payload(suite_of(*some), {}, {}, code=200_000)
    assert len(json.dumps(data)) < 3_000_000 - 200_000
    assert len(data["suite"]["details"]) == 1000
    for one, packed in zip(some[:50], data["suite"]["details"], strict=False):
        (found,) = unpacked(packed)["results"]
        assert found["total"] == 100
        assert 1 <= len(found["at"]) <= 100
        assert found["at"][0] == one.worst


# ---- where two drivers diverge ----


def played(x: list[float], a: list[float]) -> Playback:
    """Return the motion of an ego alone, by its position [m] and acceleration [m/s²]."""
    row = np.array([x])
    return Playback(
        name="one", rank=1, evaluation=0, parameters={}, metrics={}, critical=False,
        time_step=0.1, entities=(Entity("ego", 4.0, 2.0, 1.4),), x=row, y=0.0 * row, h=0.0 * row,
        v=0.0 * row, a=np.array([a]), distance=np.full(len(x), np.inf), lanes=(), n_steps=len(x),
    )  # fmt: skip


@pytest.mark.parametrize(
    ("x", "a", "instant"),
    [
        ([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, 0.0], None),
        ([0.0, 1.0, 2.09, 3.0], [0.0, 0.9, 0.0, 0.0], None),  # less than what one sees
        ([0.0, 1.0, 2.0, 3.2], [0.0, 0.0, 0.0, 0.0], 3),  # 0.2 m apart
        ([0.0, 1.0, 2.0, 2.9], [0.0, -4.0, -4.0, 0.0], 1),  # the command shows first
        ([0.0, 1.0, 2.0, 3.0], [0.0, 0.0, 0.0, -9.0], None),  # no step follows the last instant
        ([0.0, 1.0, 2.0], [0.0, 0.0, 0.0], 2),  # it ends earlier
    ],
)
def test_drivers_diverge_by_position_or_by_command(x, a, instant):
    plain = played([0.0, 1.0, 2.0, 3.0], [0.0] * 4)
    assert diverged_at(plain, played(x, a)) == diverged_at(played(x, a), plain) == instant


# ---- pages of suites that ran ----


@pytest.fixture
def run(folder, tmp_path):
    return evaluate_suite(
        folder, egos=["route-follower", "reference"], **CRITERIA, out=tmp_path / "out",
        workers=1,
    )  # fmt: skip


def test_the_page_plays_the_worst_failure_of_each(folder, tmp_path):
    run = evaluate_suite(folder, egos="route-follower", **CRITERIA, out=tmp_path / "one", workers=1)
    path = write_suite_page(run, run.jobs)
    assert path == run.folder / FILE
    data = data_of(path.read_text("utf-8"))
    failed = [one for one in run.results if one.verdict == "failed"]
    assert len(failed) >= 2
    motions = data["suite"]["motions"]
    assert len(motions["texts"]) == len(failed)
    assert len(motions["roads"]) < len(failed)  # the same road is held once
    cells = {entry["name"]: entry["results"][0] for entry in data["suite"]["entries"]}
    for one in failed:
        motion = unpacked(motions["texts"][cells[one.entry]["motion"]])
        row = one.rows[one.worst]
        assert motion["evaluation"] == one.worst
        assert bool(motion["contacts"]) == bool(row.collisions)
        assert "twin" not in motion
        assert motions["names"][cells[one.entry]["motion"]] == f"{one.entry} ({one.ego})"
    # What a dashboard shows of them without simulating.
    kept = {(shown.entry, shown.ego): shown for shown in read_thumbnails(run.folder)}
    assert kept.keys() == {(one.entry, one.ego) for one in failed}
    for one in failed:
        touches = kept[one.entry, one.ego].contact is not None
        assert touches == bool(one.rows[one.worst].collisions)
    assert path.read_bytes() == write_suite_page(run, run.jobs).read_bytes()


@pytest.mark.thorough
def test_of_two_drivers_the_page_plays_both_where_something_changes(run):
    found = suite_difference(run)
    suite = data_of(write_suite_page(run, run.jobs).read_text("utf-8"))["suite"]
    changed, motions = suite["changed"], suite["motions"]
    table = unpacked(changed["rows"])
    assert changed["headline"] == found.headline
    assert dict(changed["kinds"]) == found.kinds
    assert changed["silent"] == []
    assert len(table["row"]) == sum(row.run for row in found.rows)
    assert table["kind"] == sorted(table["kind"])  # the most important first
    played = [k for k, motion in enumerate(table["motion"]) if motion >= 0]
    assert sum(KINDS[table["kind"][k]] in ("broken", "fixed") for k in played) >= 1
    names = [entry["name"] for entry in suite["entries"]]
    for k in played:
        motion = unpacked(motions["texts"][table["motion"][k]])
        name = names[table["entry"][k]]
        assert motion["name"] == f"{name}, variation {table['row'][k] + 1}"
        for ego, one in zip(run.egos, (motion["twin"], motion), strict=True):
            (result,) = [each for each in run.of_ego(ego) if each.entry == name]
            assert bool(one["contacts"]) == bool(result.rows[table["row"][k]].collisions)


def test_there_are_at_most_so_many_playbacks_the_most_important(run, monkeypatch):
    monkeypatch.setattr(page, "MOST_PAIRS", 1)
    changed = data_of(write_suite_page(run, run.jobs).read_text("utf-8"))["suite"]["changed"]
    kinds = suite_difference(run).kinds
    table = unpacked(changed["rows"])
    assert [k for k, motion in enumerate(table["motion"]) if motion >= 0] == [0]
    left = {kind: kinds[kind] for kind in KINDS[:4] if kinds[kind]}
    left[KINDS[table["kind"][0]]] -= 1
    assert dict(changed["silent"]) == {kind: n for kind, n in left.items() if n}


def test_the_headline_of_a_difference_counts_each_variation_once():
    def hit(severity: float) -> RowResult:
        return HIT.model_copy(update={"severity": severity})

    rows = [  # of the first and of the second driver
        (HIT, KEPT), (KEPT, HIT), (KEPT, HIT),
        (HIT, hit(0.2)), (HIT, hit(0.0)), (HIT, hit(0.1 + 9e-5)),  # the last one reads the same
        (KEPT, KEPT), (JUMP, KEPT),
    ]  # fmt: skip
    first, second = (
        [result("e", ego, tuple(pair[k] for pair in rows))] for k, ego in enumerate("ab")
    )
    found = variations_compared(first, second, ("V1", "V2"))
    assert found.headline == (
        "V2 against V1: fixes 1, breaks 2, 1 worse, 1 milder of 7 variations; 1 not comparable"
    )
    assert found.kinds == {
        "broken": 2, "fixed": 1, "worse": 1, "milder": 1, "same": 2, "not comparable": 1,
    }  # fmt: skip
    assert [row.kind for row in in_order(found)] == [
        "broken", "broken", "fixed", "worse", "milder", "same", "same", "not comparable",
    ]  # fmt: skip


def test_no_playback_of_files_that_have_changed(run, folder):
    for file in folder.rglob("*.xosc"):
        file.write_text(file.read_text("utf-8") + "<!-- changed -->", "utf-8")
    suite = data_of(write_suite_page(run, run.jobs).read_text("utf-8"))["suite"]
    assert suite["motions"]["texts"] == []
    assert read_thumbnails(run.folder) == ()
    assert not any("motion" in one for entry in suite["entries"] for one in entry["results"])


@pytest.mark.thorough
def test_the_command_shows_the_failure_again(run, folder):
    by_name = {(job.entry.name, job.ego): job for job in run.jobs}
    plain = next(one for one in run.results if one.entry == "plain")
    words = shlex.split(page.command_of(run.folder, by_name["plain", plain.ego], plain))
    assert words[:3] == ["bridgegen", "simulate", str(folder / "plain.xosc")]
    found = subprocess.run(
        [Path(sys.executable).with_name("bridgegen"), *words[1:], "--json"],
        capture_output=True, text=True, check=False,
    )  # fmt: skip
    assert found.returncode == (3 if plain.verdict == "failed" else 0), found.stderr
    varied = next(one for one in run.results if one.entry != "plain")
    words = shlex.split(page.command_of(run.folder, by_name[varied.entry, varied.ego], varied))
    number = str(varied.worst + 1)
    assert words[:5] == ["bridgegen", "suite", "replay", str(run.folder), varied.entry]
    assert words[5:] == [number, "--ego", varied.ego]


@pytest.mark.parametrize(
    ("outcomes", "kind"),
    [
        ({"a": KEPT}, "passes"),
        ({"a": HIT}, "fails"),
        ({"a": LOST}, "open"),
        ({"a": HIT, "b": KEPT, "c": KEPT}, "fails"),  # whichever of several fails
        ({"a": KEPT, "b": LOST, "c": KEPT}, "open"),
        ({"a": HIT, "b": KEPT}, "passes"),  # of two the second, which is named
        ({"a": KEPT, "b": HIT}, "fails"),
    ],
)
def test_the_page_begins_with_the_verdict(tmp_path, outcomes, kind):
    results = [result("e", rows=(row,), ego=ego) for ego, row in outcomes.items()]
    text = write_suite_page(suite_of(*results, folder=tmp_path), ()).read_text("utf-8")
    (banner,) = re.findall(r'<div class="banner (\w*)" role="status">.*?<p>(.*?)</p>', text)
    assert banner[0] == kind
    if len(outcomes) == 2:
        words = "fixes 1, breaks 0" if outcomes["a"] is HIT else "fixes 0, breaks 1"
        assert banner[1] == f"{words.capitalize()}, 0 worse, 0 milder of 1 variation."


def test_hostile_texts_stay_texts(tmp_path):
    bad = "</script><script>alert(1)</script><!-- \ud800 &amp; {{data}}"
    row = HIT.model_copy(update={"conflict": "contact", "partner": bad, "x": [bad]})
    folder = tmp_path / "<b>&{{css}}"
    folder.mkdir()
    one = result(bad, rows=(row,), title=bad, parameters=[bad], units=[bad], notes=[bad])
    text = write_suite_page(suite_of(one, folder=folder), ()).read_text("utf-8")
    assert "alert(1)</script>" not in text
    approve(text, "BridgeGen")
    entry = data_of(text)["suite"]["entries"][0]
    assert (entry["name"], entry["results"][0]["conflict"][2]) == (bad, bad)
    assert text.count("default-src 'none'") == 1
