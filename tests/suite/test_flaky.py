"""Variations whose repeats disagree: neither passed nor failed, whatever asks."""

import re
from pathlib import Path

import pytest
from tests.approval import approve
from tests.results.test_failures import failure
from tests.suite.test_known_failures import HIT, KEPT, LOST, SLOW

from bridgegen.cli.verdict.of_suite import SuiteCriteria
from bridgegen.jobs.suite.difference import difference
from bridgegen.jobs.suite.known_failures import KnownFailures
from bridgegen.jobs.suite.results import EntryResult, RowResult
from bridgegen.jobs.suite.suite import SuiteRun, read_suite, run_suite

FLIPS = Path(__file__).parents[1] / "campaign" / "flips.py"
FLAKY = RowResult.of_repeats([KEPT, HIT, KEPT, KEPT, HIT])


def entry(*rows, **more):
    return EntryResult(
        entry="b", ego="", digest="", scenario="b.xosc", driver="mine", rows=list(rows), **more
    )


def suite_of(tmp_path, *rows, status=None):
    suite = SuiteRun(tmp_path, ("",), (entry(*rows),), {})
    of = {} if status is None else {"b": ("b", failure(status=status))}
    suite.__dict__["known_failures"] = KnownFailures(of)
    return suite


def judged(tmp_path, *rows, status=None, texts=()):
    junit = tmp_path / "junit.xml"
    suite = suite_of(tmp_path, *rows, status=status)
    outcomes = SuiteCriteria.read(list(texts), junit).judge(suite)
    text = junit.read_text("utf-8")
    return outcomes, (text, re.search(r'failures="(\d+)" errors="(\d+)"', text).groups())


def test_the_result_of_repeats_is_the_first_of_the_worst():
    assert (FLAKY.verdict, FLAKY.fails, FLAKY.repeats) == ("flaky", 2, 5)
    assert FLAKY.critical
    assert FLAKY.conflict == "contact"
    approve(FLAKY.flaky, "2 of 5", "271 repeats")
    assert RowResult.of_repeats([KEPT]) is KEPT
    assert RowResult.of_repeats([HIT, HIT]).verdict == "failed"
    assert RowResult.of_repeats([KEPT, SLOW]).violated == [0]
    sure = RowResult.of_repeats([KEPT] * 3)
    assert (sure.verdict, sure.repeats, sure.fails, sure.flaky) == ("passed", 3, 0, "")
    lost = RowResult.of_repeats([KEPT, LOST, LOST])  # a missing result is no pass
    assert lost.verdict == "not run"
    approve(lost.problem, "2 of 3")
    assert RowResult.of_repeats([LOST, HIT]).verdict == "failed"


def test_a_flaky_entry_is_no_pass_and_no_failure(tmp_path):
    (outcome,), (text, numbers) = judged(tmp_path, KEPT, FLAKY)
    assert outcome.verdict == "unknown"
    approve(outcome.details)
    assert numbers == ("0", "2")  # its test, and the pass that is taken back
    assert 'name="repeats agree"' in text
    assert "needs 271 repeats" in text
    assert entry(KEPT, FLAKY).verdict == "flaky"
    assert entry(HIT, FLAKY).verdict == "failed"
    assert judged(tmp_path, HIT, FLAKY)[0][0].verdict == "failed"
    assert entry(FLAKY, LOST).verdict == "flaky"
    sure = RowResult.of_repeats([KEPT] * 5)
    (outcome,), (_, numbers) = judged(tmp_path, KEPT, sure)
    assert (outcome.verdict, numbers) == ("passed", ("0", "0"))


@pytest.mark.parametrize(
    ("text", "verdict"),
    [("failed > 0", "unknown"), ("flaky > 1", "passed"), ("flaky > 0", "failed")],
)
def test_a_condition_passes_only_if_it_says_how_many_may_be_flaky(tmp_path, text, verdict):
    assert judged(tmp_path, KEPT, FLAKY, texts=[text])[0][0].verdict == verdict


@pytest.mark.parametrize(
    ("status", "verdict"),
    [("known", "passed"), ("accepted", "passed"), ("fixed", "failed"), ("new", "unknown")],
)
def test_a_failure_that_is_known_may_be_flaky(tmp_path, status, verdict):
    assert judged(tmp_path, KEPT, FLAKY, status=status)[0][0].verdict == verdict


def test_of_two_drivers_a_flaky_one_is_not_comparable():
    found = difference([entry(KEPT, KEPT)], [entry(KEPT, FLAKY)], ("old", "new"))
    assert found.counts["not comparable"] == 1
    assert not found.counts["broken"]
    approve(found.headline, "1 flaky")


def test_a_clause_is_not_passed_by_a_flaky_variation():
    rows = [FLAKY.model_copy(update={"clauses": letter}) for letter in "pxf"]
    assert entry(*rows).letters(0) == "nnf"


def test_a_suite_repeats_each_variation(tmp_path):
    ego = f"{FLIPS}:FlipsBySeed"
    suite = run_suite("cut-in", egos=ego, samples=3, repeats=4, out=tmp_path / "suite", workers=1)
    rows = suite.results[0].rows
    assert [row.repeats for row in rows] == [4] * 4
    assert suite.results[0].verdict == "flaky"
    assert suite.settings["repeats"] == 4
    assert read_suite(suite.folder).results == suite.results
    page = suite.page.read_text("utf-8")
    assert "is flaky" in page
    # A driver that ships repeats: nothing is evaluated again.
    alone = run_suite(
        "cut-in", egos="reference", samples=0, repeats=4, out=tmp_path / "alone", workers=1
    )
    assert [row.repeats for row in alone.results[0].rows] == [1]
